"""How sure a fit is beyond its covariance: posterior, predictive band and profiles together.

In numbers for the fit file, and in words.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever.cluster import local_client, run_all
from hotlever.errors import HotleverError
from hotlever.fitting.fit import Fit
from hotlever.fitting.posterior import BAND_QUANTILES, predictive_band, sample_posterior
from hotlever.fitting.profile import profile_likelihood
from hotlever.materials import PARAMETERS

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

#: Chains are called unsettled above this R̂ or below this effective sample size (Vehtari et al.,
#: doi:10.1214/20-BA1221).
_RHAT, _EFFECTIVE = 1.01, 400
#: A parameter is called undetermined if this share of the samples lies within the second share
#: of its range from a bound, or if its spread is more than the third share of the prior's.
_AT_BOUND, _NEAR, _AS_WIDE = 0.025, 0.02, 0.7
#: Intervals are said to differ from those of the standard error by more than this share of it.
_DIFFERENT = 0.5


@dataclass(frozen=True)
class Uncertainty:
    """What was sampled and profiled of a fit.

    Attributes
    ----------
    fit : Fit
    posterior, band : xarray.Dataset or None
        See `sample_posterior` and `predictive_band`.
    profiles : dict of str to xarray.Dataset
        By parameter; see `profile_likelihood`.
    """

    fit: Fit
    posterior: xr.Dataset | None
    band: xr.Dataset | None
    profiles: dict[str, xr.Dataset]

    def statements(self) -> list[str]:
        """Say in words what the data leave open, and what that means for the tip temperature."""
        found = []
        if self.posterior is not None:
            found += _unsettled(self.posterior)
            for name in self.fit.names:
                found += _about(self.fit, name, self.posterior[name].values.ravel())
        for profile in self.profiles.values():
            found += profile.attrs["notes"].splitlines()
        if self.band is not None:
            low, *_, high = self.band.tip_K.values
            widest = int(np.argmax(high - low))
            found.append(
                "the predicted tip temperature is uncertain by at most "
                f"{(high - low)[widest] / 2:.1f} K (half of the 95 % band, at "
                f"{self.band.bias_V.values[widest]:.3g} V), the model taken as exact"
            )
        return found

    def to_json(self) -> str:
        """Return the fit file with the keys ``posterior`` and ``profiles`` beside its own."""
        content = json.loads(self.fit.to_json())
        if self.posterior is not None:
            content["posterior"] = _posterior_content(self.posterior)
        if self.band is not None:
            content["posterior"]["band"] = {
                name: _listed(self.band[name].values)
                for name in ("quantile", "bias_V", "tip_K", "power_mW", "tip_at_power_K")
            }
        if self.profiles:
            content["profiles"] = {
                name: _profile_content(profile) for name, profile in self.profiles.items()
            }
        content["uncertainty_notes"] = self.statements()
        return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def examine(
    fit: Fit,
    *,
    samples: int | None = None,
    profiles: bool = False,
    processes: int = 1,
    sampling: Progress | None = None,
    banding: Progress | None = None,
    profiling: Progress | None = None,
) -> Uncertainty:
    """Sample the posterior of a fit, with its predictive band, and profile its parameters.

    Parameters
    ----------
    fit : Fit
    samples : int, optional
        Of the posterior, at least; none by default.
    profiles : bool
        Whether to profile every parameter that the fit varied.
    processes : int
        Started by spawn, if more than one: see `sample_posterior`.
    sampling, banding, profiling : callable, optional
        Called with the steps (for profiles: parameters) done and their number.

    Raises
    ------
    InputError
        If a number is too small, or profiles are asked for of the only varied parameter.
    ComputationError
        If no start for sampling is found, a worker process dies, or the lever cannot be solved.
    """
    curves = _profiles(fit, processes, profiling) if profiles else {}
    posterior = band = None
    if samples is not None:
        posterior = sample_posterior(fit, samples=samples, processes=processes, progress=sampling)
        band = predictive_band(fit, posterior, progress=banding)
    return Uncertainty(fit, posterior, band, curves)


def _profiles(fit: Fit, processes: int, progress: Progress | None) -> dict[str, xr.Dataset]:
    """Profile each varied parameter; some at a time in processes of their own."""
    names = fit.names
    found: dict[str, xr.Dataset] = {}

    def tell() -> None:
        if progress is not None:
            progress(len(found), len(names))

    tell()
    if processes == 1:
        for name in names:
            found[name] = profile_likelihood(fit, name)
            tell()
        return found
    with local_client(min(processes, len(names))) as client:
        for number, result in run_all(client, profile_likelihood, ((fit, name) for name in names)):
            if isinstance(result, HotleverError):
                raise result
            found[names[number]] = result
            tell()
    return {name: found[name] for name in names}


def _unsettled(posterior: xr.Dataset) -> list[str]:
    """Name the quantities whose chains do not agree, or say too little."""
    rhat, effective = posterior.rhat.values, posterior.effective_sample_size.values
    names = posterior.quantity.values[(rhat > _RHAT) | (effective < _EFFECTIVE)].tolist()
    if not names:
        return []
    return [
        f"the posterior of {', '.join(names).replace('_temperature', ' temperature')} is not "
        f"settled: R̂ up to {rhat.max():.3f} (expected at most {_RHAT:g}), as few as "
        f"{effective.min():.0f} effective samples (expected at least {_EFFECTIVE}); take more "
        "samples"
    ]


def _about(fit: Fit, name: str, values: Array) -> list[str]:
    """Say whether a parameter is undetermined, or its interval not that of its standard error."""
    known, fitted = PARAMETERS[name], fit.parameters[name]
    span = known.upper - known.lower
    for bound, inwards in ((known.lower, 1.0), (known.upper, -1.0)):
        if np.mean(inwards * (values - bound) < _NEAR * span) > _AT_BOUND:
            return [
                f"{name} is not determined by these data: its posterior reaches its bound "
                f"{bound:g} {'' if known.unit == '1' else known.unit}".rstrip()
            ]
    if values.std() > _AS_WIDE * span / np.sqrt(12.0):
        return [
            f"{name} is not determined by these data: its posterior is about as wide as its bounds"
        ]
    if not fitted.stderr:
        return []
    low, high = np.percentile(values, (2.5, 97.5))
    # two standard errors, nearly: the quantile of the normal distribution
    reach = 1.96 * fitted.stderr
    if max(abs(low - fitted.value + reach), abs(high - fitted.value - reach)) > _DIFFERENT * reach:
        return [
            f"{name}: 95 % of the posterior lies between {low:.4g} and {high:.4g}, not between "
            f"{fitted.value - reach:.4g} and {fitted.value + reach:.4g} as its standard error says"
        ]
    return []


def _posterior_content(posterior: xr.Dataset) -> dict[str, Any]:
    quantities = {}
    for name in posterior.quantity.values.tolist():
        one = posterior.sel(quantity=name)
        values = posterior[name].values
        quantities[name] = {
            "mean": float(values.mean()),
            "standard_deviation": float(values.std()),
            "quantiles": {
                f"{quantile:g}": float(np.percentile(values, quantile))
                for quantile in BAND_QUANTILES
            },
            "effective_sample_size": round(one.effective_sample_size.item(), 1),
            "rhat": round(one.rhat.item(), 5),
            "unit": posterior[name].attrs["units"],
        }
    return {
        "samples": posterior.sizes["chain"] * posterior.sizes["draw"],
        "seed": posterior.attrs["seed"],
        "noise": posterior.attrs["noise"],
        "acceptance_fraction": round(posterior.acceptance_fraction.item(), 4),
        "quantities": quantities,
    }


def _profile_content(profile: xr.Dataset) -> dict[str, Any]:
    return {
        "value": _listed(profile.value.values),
        "delta_chi_square": _listed(profile.delta_chi_square.values),
        "interval": {
            f"{100 * level:.0f}": _listed(profile.interval.sel(level=level).values)
            for level in profile.level.values
        },
        "notes": profile.attrs["notes"].splitlines(),
    }


def _listed(values: Array) -> Any:
    """Return an array as lists, with None for what is not a number: JSON has no NaN."""
    return np.where(np.isnan(values), np.array(None), values).tolist()
