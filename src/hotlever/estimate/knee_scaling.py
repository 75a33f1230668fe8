"""Knee scaling: one factor k from the knee of a measured I-V curve (the paper's Section V).

In another medium, or on another lever of the same kind, the tip temperature is the same function
of the power but for one factor, T(P) = T_ref(P / k), and the knee of the I-V curve tells the
factor. What T_ref is decides how good that is: a power law, the model of a probe, or a model fitted
to the lever itself. The error comes from the knee, from the meters, and from how much levers of
other dimensions and materials differ from the one whose temperatures are taken over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hotlever.errors import InputError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.knee import (
    IVCurve,
    Knee,
    KneeOutsideError,
    SmoothCurves,
    find_knee,
    scale_to,
)
from hotlever.estimate.power_law import PowerLaw, law_of_model, power_turns
from hotlever.estimate.tip_table import rms, table_by_bias
from hotlever.lever import Branch
from hotlever.lever.branch import Reach, shifted
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement, with_measured_circuit
from hotlever.measurement.rows import averaged, note_on_averages
from hotlever.piecewise import spline_through
from hotlever.probe import Probe
from hotlever.probe.priors import METERS, default_priors
from hotlever.probe.probe_parameters import RESISTANCE
from hotlever.text import value_with_error
from hotlever.types import Array

#: How far a parameter is moved for a derivative, in standard deviations of its prior.
_STEP = 0.1


@dataclass(frozen=True)
class TemperatureCurve:
    """Tip temperature against power of a reference, and the power of its knee.

    Attributes
    ----------
    tip : callable
        Temperature (K) of powers (mW); NaN where nothing is known.
    knee_mW : float
    """

    tip: Callable[[Array], Array]
    knee_mW: float

    def at(self, power_mW: Array, knee_mW: float) -> Array:
        """Return the temperature (K) of a lever whose knee is at `knee_mW`."""
        return self.tip(np.asarray(power_mW, dtype=float) * (self.knee_mW / knee_mW))


def curve_of_law(law: PowerLaw, base_temperature_K: float) -> TemperatureCurve:
    """Return a power law as a reference; its threshold stands for the knee, as in the paper."""
    return TemperatureCurve(
        lambda power: law.tip_temperature(power, base_temperature_K), law.threshold_mW
    )


def curve_of_model(model: Branch) -> TemperatureCurve:
    """Return the model of a lever, in the medium it is to be calibrated in, as reference.

    Raises
    ------
    ComputationError
        If it has no knee.
    """
    return TemperatureCurve(model.tip_temperature, model.need_knee("the model").power_mW)


def calibrated_by_rule(
    whole: Measurement, origin: Probe, law: PowerLaw | None, route: str
) -> Estimate:
    """Calibrate a lever by the paper's rule: the temperatures of a reference at k times the power.

    Parameters
    ----------
    whole : Measurement
        As it was read.
    origin : Probe
        As it is given: resembles the lever.
    law : PowerLaw, optional
        The reference; the probe's model in vacuum by default.
    route : str
        See `hotlever.estimate.Estimate`.

    Raises
    ------
    InputError
        If the points neither show the knee nor tell its power to 30 %, it is far from that of the
        reference, or the power of the probe turns.
    ComputationError
        If the probe has no knee.
    """
    measured = averaged(whole, robust=True)
    # a power law holds for vacuum, whatever the lever is in
    anywhere = measured if law is None else replace(measured, medium=None)
    probe, notes = with_measured_circuit(origin, anywhere, "vacuum")
    probe.circuit.need_cold_start("a power law")
    try:
        result = _calibrated_by_knee(measured, probe, law, route)
    except InputError as error:
        raise InputError(f"{measured.path or 'measurement'}: {error}") from error
    return replace(result, notes=[*notes, *note_on_averages(whole, measured), *result.notes])


def _calibrated_by_knee(
    measured: Measurement, probe: Probe, law: PowerLaw | None, route: str
) -> Estimate:
    """Return the calibration of a lever like a probe in vacuum, in the circuit of its data."""
    lever = Lever(probe)
    vacuum, circuit = lever.branch(), probe.circuit
    if turns := power_turns(vacuum, "vacuum"):
        raise InputError(f"the paper's rule: {turns}; expected a lever of which it is")
    model, similar = curve_of_model(vacuum), _similar_branches(probe, vacuum)
    reference = model if law is None else curve_of_law(law, circuit.base_temperature_K)
    current = measured.current(circuit)
    curve = IVCurve.of(measured.bias_V, current, circuit)
    notes = []
    try:
        knee = find_knee(curve, vacuum)
    except KneeOutsideError as outside:
        knee = _estimated_knee(curve, vacuum, reference, similar, str(outside))
        notes.append(
            f"{outside}; until then the power of the knee is estimated from the points below it, "
            f"as {value_with_error(knee.power_mW, knee.power_mW_stderr)} mW"
        )
    knee_mW, like_mW = knee.power_mW, reference.knee_mW
    # large levers have 20 mW where small ones have 2, and a wrong unit is a thousand
    if not 1.0 / 100.0 < knee_mW / like_mW < 100.0:
        raise InputError(
            f"the knee is at {knee_mW:.3g} mW, that of the lever it is compared with at "
            f"{like_mW:.3g} mW, expected within a factor of 100; are bias and current in "
            "their units?"
        )
    rows = smooth_rows(curve, knee_mW, vacuum)
    power = rows.power_mW
    tip, of_model = reference.at(power, knee_mW), model.at(power, knee_mW)
    parts = {
        "k": np.abs(reference.at(power, knee_mW + knee.power_mW_stderr) - tip),
        "electronics": _error_of_meters(reference, knee_mW, rows),
        "other levers": _error_of_other_levers(similar, power / knee_mW),
    }
    if law is not None:
        parts["power law"] = np.abs(of_model - tip)
    like_air = 1.08  # a lever that needs so many times the power is probably in air
    if law is None or knee_mW > like_air * like_mW:
        in_air = curve_of_model(lever.in_medium("air").branch())
        parts["constant k"] = np.abs(in_air.at(power, knee_mW) - of_model)
    used, residual = (law, 0.0) if law is not None else law_of_model(vacuum, model.knee_mW)
    k = knee_mW / used.threshold_mW
    if k > like_air and measured.medium != "vacuum":
        better = "--medium air is" if law is None else "a probe with --medium air would be"
        notes.append(
            f"the lever needs {k:.2f} times the power of the model in vacuum: it seems to be "
            f"in air, where {better} more accurate"
        )
    if beyond := int(np.isnan(tip).sum()):
        notes.append(
            f"{beyond} rows of the table are hotter than the models go, and have no temperature"
        )
    own = reference.at(circuit.power(measured.bias_V, current), knee_mW)
    return Estimate(
        tabulated=table_by_bias(circuit, rows.bias_V, rows.current_mA, tip, {"budget_K": parts}),
        route=route,
        power_law=used,
        law_residual_K=residual,
        k=k,
        k_stderr=knee.power_mW_stderr / used.threshold_mW,
        knee=replace(knee, tip_K=float(reference.at(np.array(knee_mW), knee_mW))),
        measured_rms_K=rms(measured.tip_K - own),
        probe=probe,
        measurement=measured,
        notes=notes,
    )


def smooth_rows(
    curve: IVCurve, knee_mW: float, like: Branch | None = None, count: int = 101
) -> IVCurve:
    """Return points over the measured range, `count` even ones in bias and in power, smoothed.

    At the knee, where the bias hardly tells temperatures apart, the power does.

    The power of the knee may be measured or estimated; for `like` see `find_knee`.
    """
    smooth = SmoothCurves(curve, knee_mW, like)
    measured = smooth.points
    power = np.linspace(measured.power_mW[0], measured.power_mW[-1], 2000)
    fine = smooth.likeliest(power)
    bias = np.maximum.accumulate(fine.bias_V)
    low, high = max(measured.bias_V[0], bias[0]), min(measured.bias_V.max(), bias[-1])
    by_power = np.interp(np.linspace(power[0], power[-1], count), power, bias)
    rows = np.unique(np.concatenate([np.linspace(low, high, count), np.clip(by_power, low, high)]))
    return IVCurve(rows, np.interp(rows, bias, fine.current_mA), curve.circuit)


def _estimated_knee(
    curve: IVCurve, like: Branch, reference: TemperatureCurve, similar: list[Branch], text: str
) -> Knee:
    """Estimate the knee from how the resistance rises below it, with its error.

    Levers of other materials have other knees for the same rise.
    """
    scale = scale_to(curve, like)
    model, *others = (branch.need_knee("the model").power_mW for branch in similar)
    spread = np.linalg.norm(np.array(others) / model - 1.0) / _STEP
    error = float(np.hypot(scale.power_stderr, spread))
    if error > 0.3:
        raise InputError(
            f"{text}. The points below it give its power to ± {error:.0%} only, which is too "
            "little to calibrate with"
        )
    # the knee of a fitted measurement stands above or below the model's
    power = scale.power * reference.knee_mW
    return Knee(power_mW=power, power_mW_stderr=error * power)


def _error_of_meters(reference: TemperatureCurve, knee_mW: float, rows: IVCurve) -> Array:
    """Return the standard error (K) at smooth rows by R_s and the scales of both meters.

    The knee moves as the highest lever voltage of the rows does.
    """
    changes = []
    for series, voltage, current in 1.0 + np.diag([RESISTANCE, METERS, METERS]):
        ohm = float(series * rows.circuit.series_resistance_ohm)
        misread = IVCurve(
            voltage * rows.bias_V,
            current * rows.current_mA,
            rows.circuit.with_(series_resistance_ohm=ohm),
        )
        moved_mW = knee_mW * misread.vertex.power_mW / rows.vertex.power_mW
        changes.append(reference.at(misread.power_mW, moved_mW))
    return np.linalg.norm(np.array(changes) - reference.at(rows.power_mW, knee_mW), axis=0)


# --- levers of other dimensions and materials ---------------------------------------------------


def _similar_branches(probe: Probe, like: Branch) -> list[Branch]:
    """Return a coarse model of a probe, and the same with each parameter moved within its prior."""
    priors = default_priors(probe)
    # the circuit is the measured one, whatever the lever
    names = tuple(name for name in priors if name != "series_resistance_ohm")
    past = float(like.bias(like.hottest_K, probe.circuit))
    reach = Reach(probe.circuit, min(past, 1e3))
    solved = SimilarLevers(Lever(probe, COARSE)).linearised(probe, reach, None, names)
    model = solved.branch
    changes = solved.output_slopes * np.array([_STEP * priors[name].absolute for name in names])
    slopes = spline_through(model.u, changes)(model.u, 1)
    perturbations = zip(np.moveaxis(changes, 2, 0), np.moveaxis(slopes, 2, 0), strict=True)
    return [model, *(shifted(model, *change) for change in perturbations)]


def _error_of_other_levers(similar: list[Branch], ratio: Array) -> Array:
    """Return the standard deviation (K) of the tip at powers over that of the knee, (n,)."""
    knees = [branch.need_knee("the model").power_mW for branch in similar]
    ends = [branch.by_power.highest_mW for branch in similar]
    # where one of them has melted they differ as they do before
    power = np.outer(knees, np.minimum(ratio, np.min(np.divide(ends, knees))))
    tip, *perturbed_tips = (
        branch.tip_temperature(row) for branch, row in zip(similar, power, strict=True)
    )
    return np.linalg.norm(np.array(perturbed_tips) - tip, axis=0) / _STEP
