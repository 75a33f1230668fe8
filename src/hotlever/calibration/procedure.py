"""Calibrating one lever from its I-V curve, with an error budget."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hotlever.calibration.calibration import Calibration, table_by_bias, table_of
from hotlever.calibration.inference import (
    estimate_lever,
    held_power,
    highest_bias,
    knee_of,
    tip_by_bias,
)
from hotlever.calibration.jumps import not_of_a_ramp
from hotlever.calibration.knee import IVCurve
from hotlever.calibration.knee_scaling import (
    curve_of_law,
    curve_of_model,
    scaled_by_knee,
)
from hotlever.calibration.plausibility import check_plausible, misfit, what_data_lack
from hotlever.calibration.power_law import PowerLaw, law_of_model, power_turns
from hotlever.calibration.pulses import PulseTiming, pulse_calibration
from hotlever.errors import ComputationError, InputError
from hotlever.estimation import Fit, Measurement, read_fit
from hotlever.estimation.diagnosis import Diagnosis
from hotlever.estimation.inverse_problem import Estimate, error_of_choice, likelier
from hotlever.estimation.lack_of_fit import suspicious_points
from hotlever.estimation.objective import TIP
from hotlever.estimation.options import UNKNOWN_MEDIUM
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.measurement import given_measurement, with_measured_circuit
from hotlever.measurement.rows import averaged, note_on_averages
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import Prior, PriorUse, known_beforehand
from hotlever.types import Array, Progress

#: A vacuum model that needs this factor is told that its lever is probably in air.
_LOOKS_LIKE_AIR = 1.08
#: Share of the measured biases that a lever must reach to show the data.
_REACHED = 0.98


def calibrate(
    measurement: Measurement | str | os.PathLike[str],
    *,
    probe: Probe | str | os.PathLike[str] | None = None,
    fit: Fit | str | os.PathLike[str] | None = None,
    law: PowerLaw | None = None,
    medium: str | None = None,
    priors: Mapping[str, Prior | str] | None = None,
    pulse: PulseTiming | None = None,
    samples: int = 0,
    progress: Progress | None = None,
) -> Calibration:
    """Find the tip temperature of a lever from its I-V curve.

    What is known of the lever beforehand is brought up to date by all that was measured
    (`hotlever.calibration.inference`); with a power law the paper's rule is used instead
    (`hotlever.calibration.knee_scaling`).

    Parameters
    ----------
    measurement : Measurement or path
        With bias and current; reader voltages and tip temperatures count where they are.
    probe : Probe or path, optional
        A probe like the measured one; the reference probe by default.
    fit : Fit or path, optional
        A fit of the measured lever itself, in vacuum or in air. Not together with `probe`.
    law : PowerLaw, optional
        A power law in vacuum, in place of a model. It takes a lever that only the swept supply
        heats.
    medium : {"vacuum", "air", "unknown"}, optional
        What the lever is in; by default what the data file says, or else the fit or the probe. If
        it is unknown both are tried (`hotlever.estimation.inverse_problem`).
        With vacuum for data from air the paper's rule is used: the temperatures that the probe has
        in vacuum, at k times the power.
    priors : mapping of str to Prior or str, optional
        What is known beforehand, in place of some of the usual priors, such as
        ``{"n_d": "3.3e17 ± 15%"}``; see `hotlever.probe.priors`. If empty there are none, and
        dimensions are held.
    pulse : PulseTiming, optional
        Of pulses whose tip temperature is wanted too (`hotlever.calibration.pulses`).
    samples : int
        Of the posterior, at least, from which the limits of the tip temperature are taken; by
        default they follow from its linearised error, or estimates of hotter and colder levers.
    progress : callable, optional
        Called with solved branches, then with steps of the sampler and followed pulses, and how
        many there usually are.

    Raises
    ------
    InputError
        If the data cannot be those of the probe.
    ComputationError
        If no lever near the probe has states at all measured biases.
    """
    if (probe is not None) + (fit is not None) + (law is not None) > 1:
        raise InputError("a fit, a probe and a power law exclude each other")
    if law is not None and medium not in (None, "vacuum"):
        raise InputError("a power law holds in vacuum; with one, leave the medium out")
    if law is not None and priors is not None:
        raise InputError("a power law takes no priors; a probe or a fit does")
    if fit is not None:
        fit = fit if isinstance(fit, Fit) else read_fit(fit)
        fit.measurement.need_rest("a calibration with a fit")
        route, origin = f"fit in {fit.medium}", fit.probe
    else:
        route = "probe" if law is None else "power law"
        origin = Probe.reference() if probe is None else Probe.coerce(probe)
    whole = given_measurement(measurement, origin.circuit)
    measured = averaged(whole, robust=True)
    measured.need_rest("a calibration")
    more = note_on_averages(whole, measured)
    if law is not None or (medium == "vacuum" and measured.medium == "air"):
        if samples:
            raise InputError("the paper's rule has no posterior; expected a probe or a fit")
        if pulse is not None:
            raise InputError(
                "the paper's rule says nothing about a pulse; expected a probe or a fit, in the "
                "medium of the data"
            )
        # a power law holds for vacuum, whatever the lever is in
        known = measured if law is None else replace(measured, medium=None)
        probe, notes = with_measured_circuit(origin, known, "vacuum")
        probe.circuit.need_cold_start("a power law")
        return _by_rule(measured, probe, law, route, [*notes, *more])
    if pulse is not None:
        origin.circuit.need_cold_start("a calibration for pulses")

    def within(medium: str | None) -> tuple[Estimate, Calibration]:
        """Calibrate the lever in a medium."""
        probe, notes = with_measured_circuit(origin, measured, medium)
        causes = Diagnosis(measured, probe, priors)
        check_plausible(measured, probe, causes, known_beforehand(probe, priors))
        try:
            estimate, known = estimate_lever(measured, probe, fit, priors, progress)
            result = _by_estimate(measured, estimate, known, route, samples, progress)
        except ComputationError as error:
            raise ComputationError(f"{error}; {causes.named(fit is not None)}") from error
        if result.reason and result.converged:
            cause = causes.named(fit is not None)
            result = replace(result, reason=f"{result.reason}; {cause}")
        return estimate, replace(result, notes=list(dict.fromkeys([*notes, *result.notes])))

    if medium == UNKNOWN_MEDIUM:
        estimate, result, other, words = likelier(within)
        if other is not None:
            result = _in_either(result, other)
        result = replace(result, notes=[*more, words, *result.notes])
    else:
        estimate, result = within(medium)
        result = replace(result, notes=[*more, *result.notes])
    if pulse is None:
        return result
    if not result.describes_data:
        said = "the pulse was not followed, since it would be that of another lever"
        return replace(result, notes=[*result.notes, said])
    return replace(result, pulse=pulse_calibration(estimate, pulse, progress))


# --- by an estimate -----------------------------------------------------------------------------


def _by_estimate(
    measured: Measurement,
    estimate: Estimate,
    known: Mapping[str, Prior],
    route: str,
    samples: int,
    progress: Progress | None,
) -> Calibration:
    probe, circuit, own = estimate.probe, estimate.probe.circuit, estimate.branch
    medium, use = probe.surroundings.medium, estimate.priors(known)
    tip = tip_by_bias(estimate, samples, progress)
    converged, reason = _verdict(estimate, use)
    notes = [*what_data_lack(measured, tip.tip_K), *estimate.notes]
    notes += [tip.asymmetry] if tip.asymmetry and not reason else []
    notes += [jump.note for jump in tip.jumps]
    values = estimate.prediction.values
    notes += suspicious_points(estimate.residuals, values, robust=True)
    lever = Lever(probe.in_medium("vacuum"), COARSE)
    vacuum = lever.branch()
    # beyond the measured range a coarse lever says where the knee is
    if own.knee is None:
        own = vacuum if medium == "vacuum" else lever.in_medium(medium).branch()
    knee, threshold = knee_of(estimate, own), vacuum.knee
    k = k_stderr = residual = float("nan")
    law = None
    # with held supplies, or where the power turns, the tip does not follow from a power
    turns = ""
    if circuit.starts_cold:
        turns = power_turns(own, medium) or power_turns(vacuum, "vacuum")
    alone = circuit.starts_cold and not turns
    if own.knee is None or (alone and threshold is None):
        notes.append(f"the model has no knee below {vacuum.hottest_K:.0f} K; none is needed")
    elif alone and medium == "vacuum":
        # the law is that of the lever itself
        k, k_stderr, threshold = 1.0, 0.0, own.knee
    elif alone and threshold is not None:
        k = own.knee.power_mW / threshold.power_mW
        k_stderr = k * knee.power_mW_stderr / knee.power_mW
    if turns:
        notes.append(f"{turns}; there is no power law, and the table is read by bias")
    if not probe.shape.outline_moves:
        notes.append("the outline is taken to be as drawn: no error of it is in the result")
    if alone:
        law, residual = law_of_model(vacuum, None if threshold is None else threshold.power_mW)
    held = None if circuit.starts_cold else held_power(estimate, tip.bias_V)
    return Calibration(
        table=table_by_bias(
            circuit,
            *(tip.bias_V, tip.current_mA, tip.tip_K),
            tip.parts,
            (tip.low_K, tip.high_K),
            held,
        ),
        route=route,
        medium=medium,
        power_law=law,
        law_residual_K=residual,
        k=k,
        k_stderr=k_stderr,
        knee=knee,
        knee_tip_K=float("nan") if own.knee is None else own.knee.tip_K,
        measured_rms_K=_rms(measured.tip_K - _tips(estimate.branch, measured, circuit)),
        probe=probe,
        measurement=measured,
        priors=use,
        reason=reason,
        converged=converged,
        notes=notes,
    )


def _verdict(estimate: Estimate, priors: Mapping[str, PriorUse]) -> tuple[bool, str]:
    """Return whether the search came to an end, and why the data are not described, if so."""
    residuals, values = estimate.residuals, estimate.prediction.values
    lack_of_fit = misfit(residuals, values, priors, estimate.posterior.moved)
    converged, reason = estimate.verdict(lack_of_fit)
    circuit, bias = estimate.probe.circuit, residuals.bias
    reason = reason or not_of_a_ramp(estimate.branch, circuit, bias, values[TIP])
    highest = highest_bias(estimate)
    if not reason and highest < _REACHED * float(bias.max()):
        reason = f"the lever that comes nearest has no steady state above {highest:.4g} V"
    return converged, reason


def _in_either(result: Calibration, other: Calibration) -> Calibration:
    """Return a calibration whose errors hold another of the same data as well."""
    table, bias = result.table, result.table.bias_V.values
    tip, low, high = (
        np.interp(bias, other.table.bias_V.values, other.table[name].values)
        for name in ("tip_K", "tip_low_K", "tip_high_K")
    )
    columns = {name: table[name].values for name in result.columns}
    parts = {
        str(source): table.budget_K.sel(source=source).values for source in table.source.values
    }
    parts["medium"] = error_of_choice(columns["tip_K"], tip)
    columns |= {
        "tip_stderr_K": np.hypot(columns["tip_stderr_K"], parts["medium"]),
        "tip_low_K": np.minimum(columns["tip_low_K"], low),
        "tip_high_K": np.maximum(columns["tip_high_K"], high),
    }
    return replace(result, table=table_of(columns, parts))


# --- by the paper's rule ------------------------------------------------------------------------


def _by_rule(
    measured: Measurement, probe: Probe, law: PowerLaw | None, route: str, notes: list[str]
) -> Calibration:
    lever = Lever(probe)
    vacuum, circuit = lever.branch(), probe.circuit
    if turns := power_turns(vacuum, "vacuum"):
        raise InputError(f"the paper's rule: {turns}; expected a lever of which it is")
    of_model = curve_of_model(vacuum)
    curve = IVCurve.of(measured.bias_V, measured.current_mA, circuit)
    reference = of_model if law is None else curve_of_law(law, circuit.base_temperature_K)
    scaled = scaled_by_knee(curve, vacuum, probe, reference, str(measured.path or "measurement"))
    rows, at_knee = circuit.power(scaled.bias_V, scaled.current_mA), scaled.knee.power_mW
    parts = scaled.parts
    if law is not None:
        parts = {**parts, "power law": np.abs(of_model.at(rows, at_knee) - scaled.tip_K)}
    if law is None or at_knee > _LOOKS_LIKE_AIR * reference.knee_mW:
        in_air = curve_of_model(lever.in_medium("air").branch())
        away = in_air.at(rows, at_knee) - of_model.at(rows, at_knee)
        parts = {**parts, "constant k": np.abs(away)}
    used, residual = (law, 0.0) if law is not None else law_of_model(vacuum, of_model.knee_mW)
    k = at_knee / used.threshold_mW
    own = reference.at(circuit.power(measured.bias_V, measured.current_mA), at_knee)
    return Calibration(
        table=table_by_bias(circuit, scaled.bias_V, scaled.current_mA, scaled.tip_K, parts),
        route=route,
        medium="vacuum",
        power_law=used,
        law_residual_K=residual,
        k=k,
        k_stderr=scaled.knee.power_mW_stderr / used.threshold_mW,
        knee=scaled.knee,
        knee_tip_K=float(reference.at(np.array(at_knee), at_knee)),
        measured_rms_K=_rms(measured.tip_K - own),
        probe=probe,
        measurement=measured,
        notes=[*notes, *scaled.notes, *_statements(k, scaled.tip_K, measured.medium, law)],
    )


def _statements(k: float, tip: Array, medium: str | None, law: PowerLaw | None) -> list[str]:
    """Say what the user should know."""
    statements = []
    if k > _LOOKS_LIKE_AIR and medium != "vacuum":
        better = "--medium air is" if law is None else "a probe with --medium air would be"
        statements.append(
            f"the lever needs {k:.2f} times the power of the model in vacuum: it seems to be "
            f"in air, where {better} more accurate"
        )
    beyond = int(np.isnan(tip).sum())
    if beyond:
        statements.append(
            f"{beyond} rows of the table are hotter than the models go, and have no temperature"
        )
    return statements


# --- both ---------------------------------------------------------------------------------------


def _tips(branch: Branch, measured: Measurement, circuit: Circuit) -> Array:
    """Return the tip temperatures of a branch at the measured power; or bias, if not that tells."""
    if circuit.starts_cold and branch.power_turns_K is None:
        return branch.tip_temperature(circuit.power(measured.bias_V, measured.current_mA))
    return branch.tip_K(branch.read(circuit, measured.bias_V).u)


def _rms(difference: Array) -> float:
    present = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(present**2))) if present.size else float("nan")
