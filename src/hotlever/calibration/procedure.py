"""Calibrating one lever from its I-V curve, with an error budget."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import count

import numpy as np

from hotlever.calibration.budget import (
    MATERIAL_SCATTER,
    Tolerances,
    geometry_variations,
    knee_and_meters,
    levers,
    material_variations,
    thermometer,
)
from hotlever.calibration.calibration import TABLE_COLUMNS, Calibration, table_of
from hotlever.calibration.knee import (
    IVCurve,
    Knee,
    KneeOutsideError,
    find_knee,
    scale_to,
    smooth_rows,
)
from hotlever.calibration.power_law import PowerLaw
from hotlever.calibration.power_law_fit import fit_power_law
from hotlever.calibration.transfer import (
    Models,
    TemperatureCurve,
    curve_of_law,
    curve_of_model,
    knee_of,
)
from hotlever.errors import InputError
from hotlever.fitting import Fit, Measurement, read_fit
from hotlever.fitting.estimation import with_measured_circuit
from hotlever.lever import Branch
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.types import Array

#: A vacuum model that needs this factor is told that its lever is probably in air.
_LOOKS_LIKE_AIR = 1.08
#: Largest relative error of a knee estimated from the points below it, to go on with.
_WORST_ESTIMATE = 0.3
#: Powers (over the knee's) at which the power law is fitted to a model: even, up to here.
_LAW_TO, _LAW_POINTS = 1.4, 160


def calibrate(
    measurement: Measurement | str | os.PathLike[str],
    *,
    probe: Probe | str | os.PathLike[str] | None = None,
    fit: Fit | str | os.PathLike[str] | None = None,
    law: PowerLaw | None = None,
    medium: str | None = None,
    tolerances: Tolerances | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Calibration:
    """Find the tip temperature of a lever from its I-V curve.

    Parameters
    ----------
    measurement : Measurement or path
        With bias and current; its own tip temperatures, if it has any, are only compared with.
    probe : Probe or path, optional
        A probe like the measured one; the reference probe by default.
    fit : Fit or path, optional
        A fit of the measured lever itself, in vacuum or in air. Not together with `probe`.
    law : PowerLaw, optional
        A power law in vacuum, in place of a model.
    medium : {"vacuum", "air"}, optional
        Of the model whose temperatures are used; by default what the data file says, or else
        the fit or the probe. With vacuum the paper's rule is used in any medium: the same
        temperatures at k times the power.
    tolerances : Tolerances, optional
    progress : callable, optional
        Called with solved levers and their number.

    Raises
    ------
    InputError
        If the measurement cannot tell: no knee in its range and too cold for an estimate.
    ComputationError
        If a model cannot be solved, or has no knee.
    """
    if (probe is not None) + (fit is not None) + (law is not None) > 1:
        raise InputError("a fit, a probe and a power law exclude each other")
    if law is not None and medium not in (None, "vacuum"):
        raise InputError("a power law holds in vacuum; with one, leave the medium out")
    measured, tolerances = Measurement.given(measurement), tolerances or Tolerances()
    if fit is not None:
        fit = fit if isinstance(fit, Fit) else read_fit(fit)
        route, origin = f"fit in {fit.medium}", fit.probe
    else:
        route = "probe" if law is None else "power law"
        origin = Probe.reference() if probe is None else Probe.given(probe)
    # a power law holds for vacuum, whatever the lever is in
    known = measured if law is None else replace(measured, medium=None)
    probe, notes = with_measured_circuit(origin, known, medium if law is None else "vacuum")
    medium, circuit = probe.surroundings.medium, probe.circuit
    step = _steps(probe, fit, tolerances, progress)

    models = Models(probe, solved=step)
    curve, like = IVCurve.of(measured.bias_V, measured.current_mA, circuit), models[medium]
    measured_knee = None if fit is None else _knee_of_fit(fit, models, notes)
    reference = (
        curve_of_model(models, medium, measured_knee)
        if law is None
        else curve_of_law(law, circuit.base_temperature_K)
    )
    try:
        knee = find_knee(curve, like)
    except KneeOutsideError as outside:
        others = material_variations(probe, tolerances.material) if fit is None else ()
        scatter = [
            (variation.share, Models(variation.probe, COARSE)[medium]) for variation in others
        ]
        where = measured.path or "measurement"
        knee = _estimated_knee(curve, like, reference, scatter, f"{where}: {outside}")
        notes.append(
            f"{outside}; until then the power of the knee is estimated from the points below it, "
            f"as {knee.power_mW:.2f} ± {knee.power_mW_stderr:.2f} mW"
        )
    bias, current = smooth_rows(curve, knee.power_mW, like)
    lever_V = circuit.lever_voltage(bias, current)
    rows = lever_V * current
    tip = reference.at(rows, knee.power_mW)

    def temperature(changed: Probe) -> Array:
        coarse = curve_of_model(Models(changed, COARSE), medium, measured_knee)
        return coarse.at(rows, knee.power_mW)

    def away_from(medium: str) -> Array:
        return np.abs(curve_of_model(models, medium).at(rows, knee.power_mW) - tip)

    parts = knee_and_meters(curve, like, reference, knee, bias, current, tolerances)
    parts |= levers(probe, fit, tolerances, temperature, step)
    if law is not None:
        parts["power law"] = away_from("vacuum")
    if fit is not None and "tip" in fit.observables:
        parts["Raman"] = thermometer(fit.measurement, tip, notes)
    if medium == "vacuum" and knee.power_mW > _LOOKS_LIKE_AIR * reference.knee_mW:
        parts["constant k"] = away_from("air")
    total = np.sqrt(np.sum([part**2 for part in parts.values()], axis=0))
    found, residual = (law, 0.0) if law is not None else _law_of(models, measured_knee)
    k = knee.power_mW / found.threshold_mW
    columns = dict(zip(TABLE_COLUMNS, (bias, lever_V, current, rows, tip, total), strict=True))
    own = reference.at(circuit.power(measured.bias_V, measured.current_mA), knee.power_mW)
    return Calibration(
        route=route,
        medium=medium,
        power_law=found,
        law_residual_K=residual,
        k=k,
        k_stderr=knee.power_mW_stderr / found.threshold_mW,
        knee=knee,
        knee_tip_K=float(reference.at(np.array(knee.power_mW), knee.power_mW)),
        table=table_of(columns, parts),
        measured_rms_K=_rms(measured.tip_K - own),
        probe=probe,
        measurement=measured,
        notes=[*notes, *_statements(medium, k, tip)],
    )


def _steps(
    probe: Probe,
    fit: Fit | None,
    tolerances: Tolerances,
    progress: Callable[[int, int], None] | None,
) -> Callable[[], None]:
    """Return what is called after each solved lever, and tells their usual number with it."""
    dimensions = sum(1 for _ in geometry_variations(probe, tolerances.geometry))
    materials = len(fit.names) if fit is not None else len(MATERIAL_SCATTER)
    usual, done = 2 * dimensions + materials + 4, count(1)

    def step() -> None:
        number = next(done)
        if progress is not None:
            progress(number, max(usual, number))

    return step


def _knee_of_fit(fit: Fit, models: Models, notes: list[str]) -> tuple[str, float] | None:
    """Find medium and power of the knee in the data of a fit, if they are there and reach it."""
    data = fit.measurement
    try:
        curve = IVCurve.of(data.bias_V, data.current_mA, fit.probe.circuit)
        return fit.medium, find_knee(curve, models[fit.medium]).power_mW
    except InputError:
        notes.append("the fitted measurement does not show its knee, so the model's sets the scale")
        return None


def _estimated_knee(
    curve: IVCurve,
    like: Branch,
    reference: TemperatureCurve,
    scatter: list[tuple[float, Branch]],
    text: str,
) -> Knee:
    """Estimate the knee from how the resistance rises below it, with its error.

    `scatter` holds levers of other materials, which have other knees for the same rise, with
    their shares of the variance; `text` says why the knee is not measured.
    """

    def estimate(model: Branch) -> float:
        return scale_to(curve, model).power * knee_of(model).power_mW

    nominal = estimate(like)
    squares = scale_to(curve, like).power_stderr ** 2
    squares += sum(share * (estimate(other) / nominal - 1.0) ** 2 for share, other in scatter)
    # the knee of a fitted measurement stands above or below the model's
    power, error = nominal * reference.knee_mW / knee_of(like).power_mW, float(np.sqrt(squares))
    if error > _WORST_ESTIMATE:
        raise InputError(
            f"{text}. The points below it give its power to ± {error:.0%} only, which is too "
            "little to calibrate with"
        )
    return Knee(power_mW=power, power_mW_stderr=error * power)


def _law_of(models: Models, measured_knee: tuple[str, float] | None) -> tuple[PowerLaw, float]:
    """Fit Eq. 12 to the model in vacuum, with its threshold at the knee; return what it misses."""
    model = models["vacuum"]
    threshold = curve_of_model(models, "vacuum", measured_knee).knee_mW
    power = np.linspace(0.0, _LAW_TO, _LAW_POINTS + 1)[1:] * threshold
    found = fit_power_law(
        power,
        model.tip_temperature(power),
        base_temperature_K=model.base_temperature_K,
        threshold_mW=threshold,
    )
    return found.law, found.largest_residual_K()


def _statements(medium: str, k: float, tip: Array) -> list[str]:
    """Say what the user should know."""
    found = []
    if medium == "vacuum" and k > _LOOKS_LIKE_AIR:
        found.append(
            f"the lever needs {k:.2f} times the power of the model in vacuum: it seems to be "
            "in air, where --medium air is more accurate"
        )
    if medium == "air" and k < _LOOKS_LIKE_AIR:
        found.append(
            f"the lever needs only {k:.2f} times the power of the model in vacuum: it seems to "
            "be in vacuum, not in air"
        )
    beyond = int(np.isnan(tip).sum())
    if beyond:
        found.append(
            f"{beyond} rows of the table are hotter than the models go, and have no temperature"
        )
    return found


def _rms(difference: Array) -> float:
    known = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
