"""Calibrating one lever from its I-V curve, with an error budget."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.calibration import Calibration
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.estimator import error_of_choice, in_medium
from hotlever.estimate.inference import (
    UNLIKELY_PULL,
    calibrated_by_estimate,
    estimate_lever,
)
from hotlever.estimate.inverse_problem import Estimate
from hotlever.estimate.knee_scaling import calibrated_by_knee
from hotlever.estimate.power_law import PowerLaw
from hotlever.estimate.pulses import PulseTiming, pulse_calibration
from hotlever.estimate.result import Fit, read_fit
from hotlever.estimate.tip_table import budgets_of, table_with_budgets
from hotlever.estimate.tip_temperature import check_in_range, limits_of_range
from hotlever.estimate.uncertainty_budget import BudgetOf, check_budget_of, limits_of
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement, given_measurement, with_measured_circuit
from hotlever.measurement.contents import colder_than_base
from hotlever.measurement.rows import averaged, note_on_averages
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, as_known, known_beforehand
from hotlever.probe.probe_parameters import parameters_of
from hotlever.types import Progress

#: The resistance of a cold lever is within this factor of its model's.
_WITHIN = 2.5
#: Beyond so many times that of its model hardly any current flows.
_OPEN = 100.0
#: Different biases that a calibration needs.
_FEWEST = 3
#: Biases below this share of the largest hardly change what other supplies drive.
_HARDLY = 0.05


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
    at_V: float | None = None,
    budget_of: BudgetOf = "tip",
    progress: Progress | None = None,
) -> Calibration:
    """Find the tip temperature of a lever from its I-V curve.

    What is known of the lever beforehand is brought up to date by all that was measured
    (`hotlever.estimate.inference`); with a power law the paper's rule is used instead
    (`hotlever.estimate.knee_scaling`).

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
        it is unknown both are tried (`hotlever.estimate.estimator`).
        With vacuum for data from air the paper's rule is used: the temperatures that the probe has
        in vacuum, at k times the power.
    priors : mapping of str to Prior or str, optional
        What is known beforehand, in place of some of the usual priors, such as
        ``{"n_d": "3.3e17 ± 15%"}``; see `hotlever.probe.priors`. If empty there are none, and
        dimensions are held.
    pulse : PulseTiming, optional
        Of pulses whose tip temperature is wanted too (`hotlever.estimate.pulses`).
    samples : int
        Of the posterior, at least, from which the limits of the tip temperature are taken; by
        default they follow from its linearised error, or estimates of hotter and colder levers.
    at_V : float, optional
        Bias of the uncertainty budget; that of the hottest tip by default.
    budget_of : {"tip", "apex"}
        What the uncertainty budget is of: the tip, or its apex that touches a sample.
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
    whole = given_measurement(measurement, origin)
    measured = averaged(whole, robust=True)
    measured.need_rest("a calibration")
    if np.isnan(measured.current(origin.circuit)).all():
        raise InputError(
            f"{measured.path}: no values of I_h, which a calibration needs beside V_b, or of "
            "V_bridge, of a probe with bridge_upper_ohm and bridge_lower_ohm in [circuit]"
        )
    notes = note_on_averages(whole, measured)
    check_budget_of(budget_of, origin.contact is not None)
    if law is not None or (medium == "vacuum" and measured.medium == "air"):
        lacks = {
            "has no posterior": samples > 0,
            "has no uncertainty budget": at_V is not None or budget_of != "tip",
            "says nothing about a pulse": pulse is not None,
        }
        for lack, is_requested in lacks.items():
            if is_requested:
                raise InputError(
                    f"the paper's rule {lack}; expected a probe or a fit, in the medium of the data"
                )
        return _by_the_rule(measured, origin, law, route, notes)
    if pulse is not None:
        origin.circuit.need_cold_start("a calibration for pulses")

    def within(medium: str | None) -> tuple[Estimate, Calibration]:
        """Calibrate the lever in a medium."""
        probe, of_circuit = with_measured_circuit(origin, measured, medium)
        probe = as_known(probe, priors)
        causes = Diagnosis(measured, probe, priors)
        check_plausible(measured, probe, causes, known_beforehand(probe, priors))
        check_in_range(at_V, *limits_of_range(measured, probe))
        try:
            estimate, stated = estimate_lever(measured, probe, fit, priors, progress)
            result = calibrated_by_estimate(
                measured, estimate, stated, route, samples, at_V, budget_of, progress
            )
        except ComputationError as error:
            raise ComputationError(f"{error}; {causes.named(fit is not None)}") from error
        if result.reason and result.converged:
            cause = causes.named(fit is not None)
            result = replace(result, reason=f"{result.reason}; {cause}")
        return estimate, replace(result, notes=list(dict.fromkeys([*of_circuit, *result.notes])))

    estimate, result = in_medium(medium, within, _in_either)
    notes += result.notes
    if pulse is not None and result.describes_data:
        result = replace(result, pulse=pulse_calibration(estimate, pulse, progress))
    elif pulse is not None:
        notes.append("the pulse was not followed, since it would be that of another lever")
    return replace(result, notes=notes)


def _by_the_rule(
    measured: Measurement, origin: Probe, law: PowerLaw | None, route: str, notes: list[str]
) -> Calibration:
    """Calibrate a lever by the paper's rule."""
    # a power law holds for vacuum, whatever the lever is in
    anywhere = measured if law is None else replace(measured, medium=None)
    probe, of_circuit = with_measured_circuit(origin, anywhere, "vacuum")
    probe.circuit.need_cold_start("a power law")
    try:
        result = calibrated_by_knee(measured, probe, law, route)
    except InputError as error:
        raise InputError(f"{measured.path or 'measurement'}: {error}") from error
    return replace(result, notes=[*of_circuit, *notes, *result.notes])


def _in_either(result: Calibration, other: Calibration) -> Calibration:
    """Return a calibration whose errors hold another of the same data as well."""
    columns = {name: result.table[name].values for name in result.columns}
    others = {
        name: np.interp(columns["bias_V"], other.table.bias_V.values, other.table[name].values)
        for name in columns
    }
    columns["tip_low_K"] = np.minimum(columns["tip_low_K"], others["tip_low_K"])
    columns["tip_high_K"] = np.maximum(columns["tip_high_K"], others["tip_high_K"])
    choices = {}
    for error in (name for name in columns if name.endswith("_stderr_K")):
        name = error.replace("_stderr", "")
        choices[name] = error_of_choice(columns[name], others[name])
        columns[error] = np.hypot(columns[error], choices[name])
    budgets = {
        name: parts | {"medium": choices["apex_K" if name.startswith("apex") else "tip_K"]}
        for name, parts in budgets_of(result.table).items()
    }
    table, gum = table_with_budgets(columns, budgets), result.gum
    if gum is not None and other.gum is not None:
        row = columns["bias_V"].tolist().index(gum.bias_V)
        limits = limits_of(table.isel(bias=row), gum.of)
        gum = gum.in_either(other.gum, choices[f"{gum.of}_K"][row].item(), limits)
    return replace(result, table=table, gum=gum)


# --- whether data can be those of a lever at all -------------------------------------------------


def check_plausible(
    measured: Measurement, probe: Probe, causes: Diagnosis, priors: Mapping[str, Prior]
) -> None:
    """Refuse data whose resistance at low bias, or whose temperatures, are far from the lever's.

    Raises
    ------
    InputError
        Saying what was compared, and the likeliest cause.
    """
    where = measured.path or "measurement"
    alone, size = probe.circuit.starts_cold, np.abs(measured.bias_V)
    current = measured.current(probe.circuit)
    here = np.isfinite(current) & (measured.bias_V > 0) & (current > 0)
    if not alone:
        # other supplies drive a current as well, which is known less well than what is added
        here = np.isfinite(current) & (size > _HARDLY * size.max())
    different = np.unique(measured.bias_V[here]).size
    if different < _FEWEST:
        above = " above 0" if alone else ""
        raise InputError(
            f"{where}: currents{above} at {different} different biases{above}, expected "
            f"{_FEWEST} or more"
        )
    _check_temperatures(measured, probe, where)
    bias, current = measured.bias_V[here], current[here]
    low = np.argsort(np.abs(bias))[: max(_FEWEST, bias.size // 8)]
    # what a cold lever shows does not depend on what is around it
    cold = probe.in_medium("vacuum") if alone else probe
    rest = Lever(cold, COARSE).branch_to(0.0)
    lever = float(rest.value_slopes[0, 0] / rest.value_slopes[0, 1])
    series = probe.circuit.series_kohm
    added = current[low] - rest.values[0, 1]
    cold_kohm = float(np.median(bias[low] / np.where(added == 0.0, np.nan, added)))
    ratio = cold_kohm / (lever + series)
    if cold_kohm > series and abs(np.log(ratio)) < np.log(_WITHIN):
        return
    # an owner who knows little of a lever expects no less of it
    spread = cold_resistance_spread(cold, priors) if alone else 0.0
    if cold_kohm > series and abs(np.log((cold_kohm - series) / lever)) < UNLIKELY_PULL * spread:
        return
    quantity = "V_b / I_h" if alone else "the change of V_b over that of I_h"
    cause = causes.likeliest()
    if not cause and cold_kohm > _OPEN * (lever + series):
        cause = "hardly any current flows, as if a terminal was open or the meter at another one"
    cause = cause or "no single cause that is known explains it"
    raise InputError(
        f"{where}: {quantity} is {cold_kohm:.4g} kΩ at low bias, expected about "
        f"{lever + series:.4g} kΩ ({series:g} kΩ in series and {lever:.3g} kΩ of the lever): "
        f"{cause}"
    )


def cold_resistance_spread(probe: Probe, priors: Mapping[str, Prior]) -> float:
    """Return the standard deviation of the logarithm of a cold lever's resistance by its priors."""
    lever = SimilarLevers(Lever(probe, COARSE))
    names = tuple(name for name in priors if name in parameters_of(probe))
    branch = lever.linearised(probe, Reach(probe.circuit, 0.0), names=names)
    first = int(branch.branch.solved[0])
    by = branch.output_slopes[first, :2] / branch.branch.values[first, :2, None]
    spreads = np.array([priors[name].absolute for name in names])
    return float(np.linalg.norm((by[0] - by[1]) * spreads))


def _check_temperatures(measured: Measurement, probe: Probe, where: str) -> None:
    """Refuse tips that are colder than the base of the lever."""
    base = probe.circuit.base_temperature_K
    colder = colder_than_base(measured.tip_K, measured.tip_error_K, base)
    if colder.any():
        row = int(np.argmax(colder))
        raise InputError(
            f"{where}: T_tip is {measured.tip_K[row]:.4g} K at {measured.bias_V[row]:.4g} V, "
            f"expected more than the base temperature, {base:g} K: is it in °C, or another column?"
        )
