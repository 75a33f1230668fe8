"""How sure a fit is beyond its covariance: posterior, predictive band and profiles together.

In numbers for the fit file, and in words.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from hotlever.estimate.estimate import Estimate
from hotlever.estimate.profile import profile_likelihood
from hotlever.estimate.sampling import BAND_QUANTILES, predictive_band, sample_posterior
from hotlever.files import json_text
from hotlever.materials.parameters import heading, scale_of
from hotlever.probe.probe_parameters import parameters_of
from hotlever.processes import PROCESSORS, local_processes
from hotlever.text import BAND, aligned, with_unit
from hotlever.types import Array, Progress


@dataclass(frozen=True)
class Uncertainty:
    """What was sampled and profiled of a fit.

    Attributes
    ----------
    fit : Estimate
    posterior, band : xarray.Dataset or None
        See `sample_posterior` and `predictive_band`.
    profiles : dict of str to xarray.Dataset
        By parameter; see `profile_likelihood`.
    """

    fit: Estimate
    posterior: xr.Dataset | None
    band: xr.Dataset | None
    profiles: dict[str, xr.Dataset]

    def statements(self) -> list[str]:
        """Say in words what the data leave open, and what that means for the tip temperature."""
        texts = []
        if self.posterior is not None:
            fewest = self.fit.options.numerics.trials.fewest_effective
            texts += _unsettled(self.posterior, fewest)
            error = self.posterior.attrs["surrogate_error_K"]
            if error > 1.0:
                texts.append(
                    f"the lever that was sampled is off by up to {error:.1f} K at the outermost "
                    "samples of the posterior"
                )
            for name in self.fit.names:
                texts += _about(self.fit, name, self.posterior[name].values.ravel())
        for profile in self.profiles.values():
            texts += profile.attrs["notes"].splitlines()
        if self.band is not None:
            low, *_, high = self.band.tip_K.values
            widest = int(np.argmax(high - low))
            texts.append(
                "the predicted tip temperature is uncertain by at most "
                f"{(high - low)[widest] / 2:.1f} K (half of the 95 % band, at "
                f"{self.band.bias.values[widest]:.3g} V), the model taken as exact"
            )
        return texts

    @property
    def quantities(self) -> dict[str, dict[str, Any]]:
        """What the posterior says of each quantity, by name, as it stands in a fit file."""
        quantities: dict[str, dict[str, Any]] = {}
        if self.posterior is None:
            return quantities
        for name in self.posterior.quantity.values.tolist():
            samples = self.posterior[name]
            values = np.percentile(samples, BAND_QUANTILES).tolist()
            quantities[name] = {
                "mean": samples.mean().item(),
                "standard_deviation": samples.std().item(),
                "quantiles": {
                    f"{q:g}": value for q, value in zip(BAND_QUANTILES, values, strict=True)
                },
                "unit": samples.attrs["units"],
            }
        return quantities

    def tables(self) -> Iterator[tuple[str, list[str], list[list[str]]]]:
        """Give the intervals of profiles and the quantiles of a posterior as tables."""
        if self.profiles:
            first = next(iter(self.profiles.values()))
            columns = ["profile likelihood"]
            for level in first.level.values:
                columns += [f"{100 * level:.0f} % from", "to"]
            rows = [
                [heading(name), *_cells(profile.interval.values.ravel(), name, "open")]
                for name, profile in self.profiles.items()
            ]
            yield "Confidence intervals of the profile likelihoods.", columns, rows
        if self.posterior is not None:
            quantities = self.quantities
            levels = next(iter(quantities.values()))["quantiles"]
            columns = ["posterior", *(f"{level} %" for level in levels)]
            rows = [
                [heading(name), *_cells(quantity["quantiles"].values(), name)]
                for name, quantity in quantities.items()
            ]
            count, worth = self.posterior.sizes["draw"], self.posterior.effective_sample_size.item()
            caption = f"Quantiles of {count} posterior samples, worth {worth:.0f} independent ones."
            yield caption, columns, rows

    def text(self) -> str:
        """Return the tables as lines of text."""
        tables = (aligned([columns, *rows]) for _, columns, rows in self.tables())
        return "\n".join(line for table in tables for line in table)

    def to_json(self) -> str:
        """Return the fit file with the keys ``posterior`` and ``profiles`` beside its own."""
        content = self.fit.content()
        if self.posterior is not None:
            content["posterior"] = {
                "samples": self.posterior.sizes["draw"],
                "seed": self.posterior.attrs["seed"],
                "noise": self.posterior.attrs["noise"],
                "effective_sample_size": round(self.posterior.effective_sample_size.item(), 1),
                "quantities": self.quantities,
            }
        if self.band is not None:
            content["posterior"]["band"] = {
                name.replace("bias", "bias_V"): self.band[name].values.tolist()
                for name in ("quantile", "bias", "tip_K", "power_mW", "tip_at_power_K")
            }
        if self.profiles:
            content["profiles"] = {
                name: {
                    "value": profile.value.values.tolist(),
                    "delta_chi_square": profile.delta_chi_square.values.tolist(),
                    "interval": {
                        f"{100 * level:.0f}": profile.interval.sel(level=level).values.tolist()
                        for level in profile.level.values
                    },
                    "notes": profile.attrs["notes"].splitlines(),
                }
                for name, profile in self.profiles.items()
            }
        return json_text({**content, "uncertainty_notes": self.statements()})


def examine(
    fit: Estimate,
    *,
    samples: int | None = None,
    profiles: bool = False,
    processes: int | None = None,
    sampling: Progress | None = None,
    banding: Progress | None = None,
    profiling: Progress | None = None,
) -> Uncertainty:
    """Sample the posterior of a fit, with its predictive band, and profile its parameters.

    Parameters
    ----------
    fit : Estimate
    samples : int, optional
        Of the posterior, at least; none by default.
    profiles : bool
        Whether to profile every parameter that the fit varied.
    processes : int, optional
        Started by spawn, if more than one: see `sample_posterior`. By default one for each
        processor.
    sampling, banding, profiling : callable, optional
        Called with the steps (for profiles: parameters) done and their number.

    Raises
    ------
    InputError
        If a number is too small, or profiles are asked for of the only varied parameter.
    ComputationError
        If no trial of the posterior finds a lever, a worker process dies, or the lever cannot be
        solved.
    """
    processes = processes or PROCESSORS
    curves, posterior, band = {}, None, None
    if profiles:
        tasks = [(fit, name) for name in fit.names]
        # some at a time, in processes of their own
        with local_processes(min(processes, len(tasks))) as run:
            results = run(profile_likelihood, tasks, profiling)
        curves = dict(zip(fit.names, results, strict=True))
    if samples is not None:
        posterior = sample_posterior(fit, samples=samples, processes=processes, progress=sampling)
        band = predictive_band(fit, posterior, progress=banding)
    return Uncertainty(fit, posterior, band, curves)


def _unsettled(posterior: xr.Dataset, fewest: int) -> list[str]:
    """Say that samples say too little, if they do."""
    effective = posterior.effective_sample_size.item()
    if effective >= fewest:
        return []
    return [
        f"the posterior is not settled: its samples are worth {effective:.0f} independent ones, "
        f"expected at least {fewest}; take more samples"
    ]


def _about(fit: Estimate, name: str, values: Array) -> list[str]:
    """Say whether a parameter is undetermined, or its interval not that of its standard error."""
    parameter, fitted = parameters_of(fit.probe)[name], fit.parameters[name]
    span = parameter.upper - parameter.lower
    undetermined = f"{name} is not determined by these data: its posterior"
    for bound in (parameter.lower, parameter.upper):
        # one tail of 95 % of the samples lies near a bound
        if np.mean(np.abs(values - bound) < 0.02 * span) > 0.025:
            return [f"{undetermined} reaches its bound {with_unit(f'{bound:g}', parameter.unit)}"]
    prior = fit.known.get(name)
    if prior is not None and np.std([*map(prior.deviation, values)]) > 0.9:
        return [f"{name} is as known before: these data do not tell"]
    if values.std() > 0.7 * span / np.sqrt(12.0):
        return [f"{undetermined} is about as wide as its bounds"]
    # two standard errors, nearly: the quantile of the normal distribution
    reach = BAND * (fitted.stderr or 0.0)
    expected = np.array([fitted.value - reach, fitted.value + reach])
    sampled = np.percentile(values, (2.5, 97.5))
    if not reach or np.abs(sampled - expected).max() <= 0.5 * reach:
        return []
    return [
        f"{name}: 95 % of the posterior lies between {sampled[0]:.4g} and {sampled[1]:.4g}, not "
        f"between {expected[0]:.4g} and {expected[1]:.4g} as its standard error says"
    ]


def _cells(values: Iterable[float], name: str, unknown: str = "") -> list[str]:
    return [unknown if np.isnan(value) else f"{value / scale_of(name):.4g}" for value in values]
