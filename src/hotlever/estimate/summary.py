"""An estimate in words and tables: its parameters, its tip, and what data leave open."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hotlever.estimate.estimate import Estimate
from hotlever.estimate.tip_table import PulseCalibration, TipTable
from hotlever.estimate.uncertainty_budget import TemperatureBudget
from hotlever.materials.parameters import own_name, scale_of, scaled_unit
from hotlever.probe.priors import PriorUse
from hotlever.probe.probe_parameters import parameters_of
from hotlever.probe.shapes import EDGE_BIAS
from hotlever.text import NOT_DETERMINED, aligned, significant, value_with_error
from hotlever.types import Array

#: What the numbers of a fit are that does not describe its data.
NEAREST = (
    "what follows is of the lever that comes nearest, and no estimate: errors are not stated, "
    "since they would not hold"
)

# --- of the parameters --------------------------------------------------------------------------


def parameter_rows(fit: Estimate) -> list[tuple[str, str, str, str]]:
    """Return name, value with error, unit and a remark for each parameter of a fit."""
    rows, declared = [], parameters_of(fit.probe, in_time=True)
    for name, fitted in fit.parameters.items():
        stderr, remark = fitted.stderr, "" if fitted.vary else "fixed"
        if fitted.vary and stderr is None:
            stderr, remark = np.nan, "no error"
        value = value_with_error(fitted.value, stderr, scale_of(name), declared[name].bounds)
        rows.append((name, value, scaled_unit(name), remark))
    return rows


def conclusions(fit: Estimate) -> list[str]:
    """Say what follows from the parameters of a fit, and how well it describes the data."""
    lines = [_tip_in_time(fit.band_columns)] if fit.in_time else []
    if np.isfinite(fit.inversion_temperature_K):
        inversion = value_with_error(
            fit.inversion_temperature_K, fit.inversion_temperature_stderr_K
        )
        unit = "" if inversion == NOT_DETERMINED else " K"
        lines.append(f"inversion temperature: {inversion}{unit}")
    rms = []
    for column, value in fit.residual_rms.items():
        name, _, unit = column.rpartition("_")
        rms.append(f"{name} {value:.3g} {unit}")
    return [
        *lines,
        f"rms of data - model: {', '.join(rms)}",
        f"fitted to {', '.join(fit.observables)} in {fit.steps} steps, {fit.seconds:.1f} s",
    ]


def _tip_in_time(band: Mapping[str, Array]) -> str:
    """Say how hot the tip became."""
    hottest, last = (
        f"{value_with_error(float(band['tip_K'][row]), float(band['tip_stderr_K'][row]))} K after "
        f"{band['time_us'][row]:.4g} µs"
        for row in (int(np.argmax(band["tip_K"])), -1)
    )
    if hottest == last:
        return f"tip temperature: {last}, at its hottest and last"
    return f"tip temperature: {hottest}, at its hottest, {last}, at last"


def prior_lines(priors: Mapping[str, PriorUse]) -> list[str]:
    """Say which priors an answer leans on, and which the data moved far.

    That is where the data narrow them to no less than nine tenths, and where they move them by more
    than their standard deviation.
    """
    leaned = [name for name, use in priors.items() if use.spread_ratio > 0.9]
    shifts = [
        f"{name} by {use.shift:+.1f} σ to {use.posterior_value:.4g}"
        for name, use in priors.items()
        if abs(use.shift) > 1.0
    ]
    lines = {
        "moved by the data beyond what was known before": shifts,
        "as known before, since the data do not tell": leaned,
    }
    return [f"{text}: {', '.join(names)}" for text, names in lines.items() if names]


def fit_text(fit: Estimate) -> str:
    """Return the result of a fit as lines of text; first that it describes no data, if so."""
    lines = [] if fit.describes_data else [fit.doubt, NEAREST]
    lines += [*aligned(parameter_rows(fit)), *conclusions(fit), *prior_lines(fit.priors)]
    return "\n".join(lines)


# --- of the tip ---------------------------------------------------------------------------------


def calibration_parts(
    calibration: Estimate,
) -> tuple[list[str], list[tuple[str, list[list[str]]]], list[str]]:
    """Return what a calibration says: words, tables with their captions, and words that end it.

    Of one that does not describe its data there is no table.
    """
    routes = {
        "power law": "a given power law",
        "probe": "a probe like this lever, brought up to date by these data",
        "fit in vacuum": "a fit of this lever in vacuum, and these data",
        "fit in air": "a fit of this lever in air, and these data",
    }
    basis = f"based on {routes[calibration.route]}, used in {calibration.medium}"
    after, tables = prior_lines(calibration.priors), []
    if calibration.describes_data:
        before = [basis, *_knee_lines(calibration), _law_line(calibration)]
        tables = [("", _budget_rows(calibration))]
        if "apex_budget_K" in calibration.tip_table.budgets:
            caption = "in contact: the apex with its error by source, and the surface of the sample"
            tables.append((f"{caption} under it", _apex_rows(calibration)))
        if calibration.pulse is not None:
            tables.append((calibration.pulse.timing.text, _pulse_rows(calibration.pulse)))
        stated = significant(calibration.tip_temperature_uncertainty_K)
        after.append(f"sure to ± {stated} K at worst (standard error), {_verdict(calibration)}")
        if calibration.gum is not None:
            after += _budget_lines(calibration.gum)
    else:
        knee = [f"its knee: {_knee_point(calibration)}"] if calibration.knee.measured else []
        before = [calibration.doubt, f"{NEAREST}; it is {basis}", *knee]
    if np.isfinite(calibration.measured_rms_K):
        after.append(
            f"the measured tip temperatures differ by {calibration.measured_rms_K:.1f} K (rms)"
        )
    return before, tables, after


def calibration_text(calibration: Estimate) -> str:
    """Return the result of a calibration as lines of text."""
    lines, tables, after = calibration_parts(calibration)
    for caption, rows in tables:
        lines += ["", *([f"{caption}:"] if caption else []), *aligned(rows, right=True)]
    return "\n".join([*lines, *([""] if tables else []), *after])


def _budget_lines(stated: TemperatureBudget) -> list[str]:
    """Return what the uncertainty budget comes to, and whether it holds."""
    away = significant(stated.budget.expanded())
    linear = linear_words(stated)
    return [
        f"{stated.measurand}: {stated.estimate_K:.0f} K ± {away} K with 95 %, by its uncertainty "
        f"budget (k = {stated.budget.coverage_factor():.2f})",
        *([f"this budget is {linear}"] if linear else []),
    ]


def linear_words(stated: TemperatureBudget) -> str:
    """Say whether the linear budget holds; nothing of a file that does not tell."""
    interval = stated.monte_carlo
    if interval is None:
        return ""
    if np.isnan(interval.low):
        return (
            "not linear: levers within its errors melt at this bias, or are hotter than those that "
            "were solved, so that the Monte Carlo method (JCGM 101) fails"
        )
    trials = (
        f"95 % of {interval.trials} Monte Carlo trials lie from {interval.low:.0f} to "
        f"{interval.high:.0f} K (JCGM 101, within {stated.budget.tolerance:g} K)"
    )
    if stated.linear:
        return f"linear: {trials}"
    low, high = stated.limits_K
    return (
        f"not linear: {trials}, the table's limits are {low:.0f} and {high:.0f} K; the widest of "
        "these and the budget's hold"
    )


def _law_line(calibration: Estimate) -> str:
    law = calibration.power_law
    if law is None:
        return "no power law: " + (
            "the power falls while the tip gets hotter; the bias tells how hot it is"
            if calibration.probe.circuit.starts_cold
            else "with held supplies the tip does not follow from the power of one"
        )
    text = (
        f"power law in vacuum: a {law.linear_K_per_mW:.1f} K/mW, b {law.nonlinear_K:.2f} K, "
        f"m {law.exponent:.3f}, c {law.hot_K_per_mW:.1f} K/mW; jump {law.jump_K:+.0f} K"
    )
    residual = calibration.law_residual_K
    return f"{text}, within {residual:.0f} K of the model" if residual else text


def _knee_lines(calibration: Estimate) -> list[str]:
    """Return the knee of a lever that shows its data, and the factor k."""
    knee, law = calibration.knee, calibration.power_law
    if np.isnan(knee.power_mW):
        return ["no knee as far as the lever can be heated"]
    if not knee.measured:
        power = value_with_error(knee.power_mW, knee.power_mW_stderr)
        lines = [f"knee (estimated): {power} mW, tip {knee.tip_K:.0f} K"]
    elif calibration.knee_measured:
        lines = [f"knee: {_knee_point(calibration)}"]
    else:
        lines = [f"knee, beyond the measured range: about {_knee_point(calibration)}"]
    if law is not None:
        k = value_with_error(calibration.k, calibration.k_stderr)
        lines.append(f"k = {k} times the power of the knee in vacuum, {law.threshold_mW:.3f} mW")
    return lines


def _knee_point(calibration: Estimate) -> str:
    """Return the values at a knee, with their errors where these are known."""
    knee = calibration.knee
    return (
        f"{value_with_error(knee.lever_V, knee.lever_V_stderr)} V, "
        f"{value_with_error(knee.current_mA, knee.current_mA_stderr)} mA, "
        f"{value_with_error(knee.power_mW, knee.power_mW_stderr)} mW at a bias of "
        f"{value_with_error(knee.bias_V, knee.bias_V_stderr)} V, "
        f"tip {value_with_error(knee.tip_K, knee.tip_K_stderr)} K"
    )


def _budget_rows(calibration: Estimate) -> list[list[str]]:
    """Return the standard error by source at some temperatures, and the power there.

    Without a power law the bias tells more.
    """
    table, tip = calibration.heating, calibration.heating["tip_K"]
    tells = ("V_b (V)", "bias_V") if calibration.power_law is None else ("P_l (mW)", "power_mW")
    usual = np.array([400.0, 600.0, 800.0, 900.0, 1000.0, 1100.0, 1200.0])
    temperatures = usual[(tip[0] <= usual) & (usual <= tip[-1])]
    if temperatures.size < 4:  # a cold lever, or a short range
        temperatures = np.linspace(tip[0], tip[-1], 5)[1:].round(1)
    columns = [("T_tip (K)", "tip_K", 0), (*tells, 3), ("± (K)", "tip_stderr_K", 1)]
    return _rows(table, columns, temperatures)


def _apex_rows(calibration: Estimate) -> list[list[str]]:
    """Return temperatures at the contact for some of the tip, with the apex's error by source."""
    temperatures = [float(row[0]) for row in _budget_rows(calibration)[1:]]
    columns = [("T_tip (K)", "tip_K", 0), ("apex (K)", "apex_K", 0), ("± (K)", "apex_stderr_K", 1)]
    columns += [("surface (K)", "surface_K", 0), ("± (K)", "surface_stderr_K", 1)]
    return _rows(calibration.heating, columns, np.array(temperatures), "apex_budget_K")


def _pulse_rows(pulse: PulseCalibration) -> list[list[str]]:
    """Return heights of the pulse for some peak temperatures, with the error by source."""
    first, last = pulse.tabulated["peak_K"][[0, -1]]
    peak = np.linspace(first, last, 6)[1:].round(0 if last - first > 50 else 1)
    columns = [("peak (K)", "peak_K", 0), ("height (V)", "height_V", 3)]
    columns += [("± (K)", "peak_stderr_K", 1)]
    columns += [(f"{moment} (K)", f"{moment}_K", 0) for moment in ("end", "mean")]
    return _rows(pulse.tabulated, columns, np.minimum(peak, last))


def _rows(
    table: TipTable, columns: list[tuple[str, str, int]], at: Array, budget: str = "budget_K"
) -> list[list[str]]:
    """Return columns of a table as cells where the first has some values, then a budget.

    Of a column are given its head, its name in the table, and the digits behind the point.
    """
    along = table[columns[0][1]]
    numbers = [(head, table[name], digits) for head, name, digits in columns]
    numbers += [(source, error, 1) for source, error in table.budgets[budget].items()]
    cells = [
        [head, *(f"{number:.{digits}f}" for number in np.interp(at, along, values))]
        for head, values, digits in numbers
    ]
    return [list(row) for row in zip(*cells, strict=True)]


def _verdict(calibration: Estimate) -> str:
    stated = calibration.tip_temperature_uncertainty_K
    word = "good" if stated <= 15.0 else "fair" if stated <= 40.0 else "rough"
    budget = calibration.tip_table.budgets["budget_K"]
    largest = max(budget, key=lambda source: np.fmax.reduce(budget[source]))
    text = f"which is {word}; most of it is from {largest}"
    by_law = calibration.route == "power law"
    if largest == "geometry" and not calibration.probe.shape.outline_moves:
        # of a drawing there is no share of all dimensions
        edges = [f"{name}=±0.05" for name in calibration.priors if own_name(name) == EDGE_BIAS]
        known = ", ".join([*edges, "thickness_um=±2%"])
        return f"{text}: a better known drawing would help (--prior {known})"
    measured = "tip" in calibration.observables
    temperatures = "more tip temperatures" if measured else "tip temperatures at some points"
    # what would make the largest error smaller, by its source
    advice = {
        "measurement": f"less noise, or {temperatures}, would help",
        "geometry": "better known dimensions would help (--prior dimensions=±2%)",
        "material": f"a fit of this lever (--fit), or {temperatures}, would know its material",
        "laws": f"{temperatures} would help; what is known better of a law may be said "
        "(--prior law.n_i=±5%)",
        "fit": "more data for the fit would help",
        "air": "a fit in air would measure the loss to air",
        "k": "a finer measurement near the knee would help",
        "constant k": "--medium air would not assume a constant k",
        "electronics": "better known meters would help",
        "contact": "melting points, or the current in and out of contact, would help",
        "base temperature": "a thermometer at the chip would help",
    }
    if largest in advice and not (by_law and largest == "constant k"):
        return f"{text}: {advice[largest]}"
    if by_law:
        return f"{text}; a probe (--probe) or a fit (--fit) would know more than a power law"
    return text
