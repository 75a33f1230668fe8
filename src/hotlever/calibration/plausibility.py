"""Whether data can be those of a lever at all, before it is fitted and after."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtrc

from hotlever.errors import InputError
from hotlever.fitting.measurement import Measurement
from hotlever.fitting.residuals import Residuals
from hotlever.lever.lever import COARSE, Lever
from hotlever.probe import Probe
from hotlever.probe.priors import PriorUse

#: The resistance of a cold lever is within this factor of its model's.
_WITHIN = 2.5
#: Data are not described where they scatter about the model by more than this share of the largest,
#: and neighbours together; or where parameters are as far from their priors as one lever in 500 is.
_SCATTER, _TOGETHER, _UNLIKELY = 0.004, 0.6, 2e-3


def check_plausible(measured: Measurement, probe: Probe) -> None:
    """Refuse data whose resistance at low bias is far from the lever's.

    Raises
    ------
    InputError
        Saying what was compared, and the likeliest cause.
    """
    where = measured.path or "measurement"
    here = np.isfinite(measured.current_mA) & (measured.bias_V > 0) & (measured.current_mA > 0)
    if here.sum() < 3:
        raise InputError(
            f"{where}: {here.sum()} rows with a bias and a current above 0, expected 3 or more"
        )
    bias, current = measured.bias_V[here], measured.current_mA[here]
    low = np.argsort(bias)[: max(3, bias.size // 8)]
    found = float(np.median(bias[low] / current[low]))
    # what a cold lever shows does not depend on what is around it
    cold = Lever(probe.in_medium("vacuum"), COARSE).branch_to(0.0).values[1]
    series = probe.circuit.series_kohm
    lever = float(cold[0] / cold[1])
    ratio = found / (lever + series)
    if 1 / _WITHIN < ratio < _WITHIN and found > series:
        return
    raise InputError(
        f"{where}: V_b / I_h is {found:.4g} kΩ at low bias, expected about {lever + series:.4g} kΩ "
        f"({series:g} kΩ in series and {lever:.3g} kΩ of the lever): {_cause(found, lever, series)}"
    )


def _cause(found: float, lever: float, series: float) -> str:
    """Return the likeliest cause of a resistance (kΩ) that is not the lever's."""
    for factor, units in (
        (1e3, "the current given in A, or the bias in mV"),
        (1e-3, "the current given in µA, or the bias in kV"),
    ):
        if 1 / _WITHIN < found / factor / (lever + series) < _WITHIN:
            return f"is {units}, by their headings?"
    if 1 / _WITHIN < found / lever < _WITHIN:
        return "is the series resistance left out, or is V_b the lever's own voltage?"
    if found <= series:
        return "is the series resistance smaller than stated, or are columns swapped?"
    if found / (lever + series) > 1:
        return (
            f"is the series resistance rather {found - lever:.3g} kΩ, the doping lower, or a "
            "terminal open?"
        )
    return "is the doping higher, or another part in parallel?"


def misfit(residuals: Residuals, values: np.ndarray, priors: Mapping[str, PriorUse]) -> str:
    """Return why data are not described by what was fitted to them; empty if they are."""
    difference = residuals.difference(values) / residuals.largest
    for name, whole in zip(residuals.observables, difference, strict=True):
        if name == "tip":
            continue  # a thermometer's scale may be off by more than its readings scatter
        row = whole[np.isfinite(whole)]
        rms = float(np.sqrt(np.mean(row**2)))
        # of white noise neighbours differ by twice its variance
        together = np.mean(np.diff(row) ** 2) / max(2.0 * np.mean(row**2), 1e-300)
        if rms > _SCATTER and together < _TOGETHER and row.size > 6:
            worst = int(np.nanargmax(np.abs(whole)))
            return (
                f"{name} differs by {rms:.1%} of its largest value (rms), and not at random; most "
                f"at {residuals.bias[worst]:.3g} V"
            )
    away = {name: (use.posterior_value - use.value) / use.spread for name, use in priors.items()}
    # as many are free to be away as the data tell of
    told = sum(1.0 - (use.posterior_spread / use.spread) ** 2 for use in priors.values())
    if told > 0 and chdtrc(told, sum(one**2 for one in away.values())) < _UNLIKELY:
        most = sorted(away, key=lambda name: -abs(away[name]))[:3]
        moved = ", ".join(f"{name} by {away[name]:+.1f} σ" for name in most)
        return (
            f"what was known beforehand would have to be wrong by too much together, {moved}; is "
            "it another lever, medium or resistor?"
        )
    return ""
