"""The paper's rule: one factor k from the knee of a measured I-V curve (its Section V).

On another lever, or in another medium, the tip has the same temperature at k times the power. Its
error comes from the knee, from the meters, and from how much levers of other dimensions and
materials differ from the one whose temperatures are taken over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.calibration.knee import (
    IVCurve,
    Knee,
    KneeOutsideError,
    find_knee,
    scale_to,
    smooth_rows,
)
from hotlever.calibration.transfer import TemperatureCurve, knee_of
from hotlever.errors import InputError
from hotlever.estimation.scales import METERS
from hotlever.lever import Branch
from hotlever.lever.branch import Reach
from hotlever.lever.curve import spline_through
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.probe import Probe
from hotlever.probe.priors import RESISTANCE, default_priors
from hotlever.text import value_with_error
from hotlever.types import Array

#: Largest relative error of a knee estimated from the points below it, to go on with.
_WORST_ESTIMATE = 0.3


@dataclass(frozen=True)
class ByRule:
    """What the rule says.

    Attributes
    ----------
    knee : Knee
        As measured, or with its power estimated.
    bias_V, current_mA, tip_K : ndarray, shape (n,)
        Even rows over the measured range.
    parts : dict of str to ndarray
        Standard error (K) at the rows, by source.
    notes : list of str
    """

    knee: Knee
    bias_V: Array
    current_mA: Array
    tip_K: Array
    parts: dict[str, Array]
    notes: list[str]


def by_rule(
    curve: IVCurve, like: Branch, probe: Probe, reference: TemperatureCurve, where: str
) -> ByRule:
    """Calibrate a measured curve by its knee.

    Parameters
    ----------
    curve : IVCurve
    like : Branch
        Of `probe`, which resembles the lever, in the medium it is in.
    reference : TemperatureCurve
        Whose temperatures are taken over.
    where : str
        Names the measurement in errors.

    Raises
    ------
    InputError
        If the points neither show the knee nor tell its power to 30 %.
    """
    scatter, notes = _Scatter(probe, like), []
    try:
        knee = find_knee(curve, like)
    except KneeOutsideError as outside:
        knee = _estimated_knee(curve, like, reference, scatter.of_knee, f"{where}: {outside}")
        notes.append(
            f"{outside}; until then the power of the knee is estimated from the points below it, "
            f"as {value_with_error(knee.power_mW, knee.power_mW_stderr)} mW"
        )
    bias, current = smooth_rows(curve, knee.power_mW, like)
    power = curve.circuit.power(bias, current)
    tip = reference.at(power, knee.power_mW)
    parts = _knee_and_meters(curve, like, reference, knee, bias, current)
    parts["other levers"] = scatter.of_tip(power / knee.power_mW)
    return ByRule(knee, bias, current, tip, parts, notes)


class _Scatter:
    """How levers of other dimensions and materials differ from one, by their priors."""

    def __init__(self, probe: Probe, branch: Branch) -> None:
        priors = default_priors(probe)
        # the circuit is the measured one, whatever the lever
        names = tuple(name for name in priors if name != "series_resistance_ohm")
        past = float(branch.bias(branch.hottest_K, probe.circuit))
        found = SimilarLevers(Lever(probe, COARSE)).linearised(
            probe, Reach(probe.circuit, min(past, 1e3)), None, names
        )
        known = found.branch
        spreads = np.array([priors[name].absolute for name in names])
        u, (lever, current) = known.u[1:], known.values[1:, :2].T
        by_voltage = spline_through(u, found.shown[1:, 0] * spreads)
        # relative change of the power at a tip temperature, one standard deviation of each
        change = found.shown[1:, 0] / lever[:, None] + found.shown[1:, 1] / current[:, None]
        self._of_power = spline_through(u, change * spreads)
        knee = knee_of(known)
        at = np.sqrt(knee.tip_K - known.base_temperature_K)
        # the knee goes to where V_l is level after the change
        bend = known.curve(at, 2)[0]
        (by_lever, by_current) = known.curve(at, 1)[:2]
        steep = by_lever / knee.lever_V + by_current / knee.current_mA
        self._at_knee = self._of_power(at) - steep * by_voltage(at, 1) / bend
        self._known, self._knee_mW = known, knee.power_mW

    @property
    def of_knee(self) -> float:
        """Relative standard deviation of the power of the knee, for the same resistances."""
        return float(np.sqrt(np.sum(self._at_knee**2)))

    def of_tip(self, ratio: Array) -> Array:
        """Return the standard deviation (K) of the tip at powers over that of the knee."""
        power = np.asarray(ratio) * self._knee_mW
        tip = self._known.tip_temperature(power)
        u = np.sqrt(tip - self._known.base_temperature_K)
        difference = self._at_knee - self._of_power(u)
        spread = np.sqrt(np.sum(difference**2, axis=-1))
        return np.asarray(spread * power * self._known.tip_slope(np.maximum(power, 1e-12)))


def _estimated_knee(
    curve: IVCurve, like: Branch, reference: TemperatureCurve, scatter: float, text: str
) -> Knee:
    """Estimate the knee from how the resistance rises below it, with its error.

    Levers of other materials have other knees for the same rise: `scatter` of its power.
    """
    scale = scale_to(curve, like)
    # the knee of a fitted measurement stands above or below the model's
    power, error = scale.power * reference.knee_mW, float(np.hypot(scale.power_stderr, scatter))
    if error > _WORST_ESTIMATE:
        raise InputError(
            f"{text}. The points below it give its power to ± {error:.0%} only, which is too "
            "little to calibrate with"
        )
    return Knee(power_mW=power, power_mW_stderr=error * power)


def _knee_and_meters(
    curve: IVCurve,
    model: Branch,
    reference: TemperatureCurve,
    knee: Knee,
    bias: Array,
    current: Array,
) -> dict[str, Array]:
    """Return the effects (K) of the knee's scatter, and of R_s and the meters."""

    def temperature(series: float, voltage: float, amperes: float, knee_mW: float) -> Array:
        lever = curve.circuit.lever_voltage(voltage * bias, series * amperes * current)
        return reference.at(lever * amperes * current, knee_mW)

    power = knee.power_mW
    nominal = temperature(1.0, 1.0, 1.0, power)
    by_knee = temperature(1.0, 1.0, 1.0, power + knee.power_mW_stderr) - nominal
    shares = np.diag([RESISTANCE, METERS, METERS])
    squares = np.zeros_like(nominal)
    for series, voltage, amperes in 1.0 + shares:
        ohm = series * curve.circuit.series_resistance_ohm
        changed = IVCurve(
            voltage * curve.bias_V,
            amperes * curve.current_mA,
            curve.circuit.with_(series_resistance_ohm=float(ohm)),
        )
        try:
            moved = find_knee(changed, model).power_mW
        except InputError:
            # estimated or hardly determined: the knee moves as the points do
            moved = power * float(np.median(changed.power_mW / curve.power_mW))
        squares += (temperature(series, voltage, amperes, moved) - nominal) ** 2
    return {"k": np.abs(by_knee), "electronics": np.sqrt(squares)}
