"""Whether data can be those of a lever at all, before it is fitted and after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hotlever.errors import InputError
from hotlever.fitting.measurement import Measurement
from hotlever.fitting.residuals import Residuals
from hotlever.lever.lever import COARSE, Lever
from hotlever.probe import Probe

if TYPE_CHECKING:
    from hotlever.calibration.inference import PriorUse

#: The resistance of a cold lever is within this factor of its model's.
_WITHIN = 2.5
#: Data are not described where they scatter about the model by more than this share of the largest,
#: and neighbours together; or where a parameter is so many standard deviations from its prior.
_SCATTER, _TOGETHER, _FAR = 0.004, 0.6, 4.5


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
    cold = Lever(probe, COARSE).branch_to(0.0).values[1]
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
    for factor, unit in ((1e3, "A"), (1e-3, "µA")):
        if 1 / _WITHIN < found / factor / (lever + series) < _WITHIN:
            return f"is the current given in {unit}?"
    if 1 / _WITHIN < found / lever < _WITHIN:
        return "is the series resistance left out, or is V_b the lever's own voltage?"
    if found <= series:
        return "is the series resistance smaller than stated?"
    if found / (lever + series) > 1:
        return "is the doping lower, or a terminal open?"
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
    for name, use in priors.items():
        away = abs(use.posterior_value - use.value) / use.spread
        if away > _FAR:
            return (
                f"{name} had to be moved by {away:.1f} standard deviations of what was known of "
                f"it, from {use.value:.4g} to {use.posterior_value:.4g}"
            )
    return ""
