"""A calibration in words and as a figure."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from hotlever.calibration.calibration import Calibration
from hotlever.report.fit_report import value_with_error
from hotlever.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    ORANGE,
    SKY,
    VERMILION,
    figure,
    panel_letter,
)

#: Tip temperatures (K) at which the error budget is printed.
_SHOWN = (400.0, 600.0, 800.0, 900.0, 1000.0, 1100.0, 1200.0)
#: What each route rests on, in words.
_BASIS = {
    "power law": "a given power law",
    "probe": "the model of a probe like this lever",
    "fit in vacuum": "a fit of this lever in vacuum",
    "fit in air": "a fit of this lever in air",
}
#: Errors (K) up to which a calibration is called good, and fair.
_GOOD, _FAIR = 15.0, 40.0


def calibration_text(calibration: Calibration) -> str:
    """Return the result of a calibration as lines of text."""
    law, stated = calibration.power_law, calibration.tip_temperature_uncertainty_K
    lines = [
        f"based on {_BASIS[calibration.route]}, used in {calibration.medium}",
        _knee_line(calibration),
        f"k = {value_with_error(calibration.k, calibration.k_stderr)} times the power of the knee "
        f"in vacuum, {law.threshold_mW:.3f} mW",
        f"power law in vacuum: a {law.linear_K_per_mW:.1f} K/mW, b {law.nonlinear_K:.2f} K, "
        f"m {law.exponent:.3f}, c {law.hot_K_per_mW:.1f} K/mW; jump {law.jump_K:+.0f} K"
        + (
            f", within {calibration.law_residual_K:.0f} K of the model"
            if calibration.law_residual_K
            else ""
        ),
        "",
        *_budget_lines(calibration),
        "",
        f"sure to ± {stated:.0f} K (standard error, largest in the table): {_verdict(calibration)}",
    ]
    if np.isfinite(calibration.measured_rms_K):
        lines.append(
            f"the measured tip temperatures differ by {calibration.measured_rms_K:.1f} K (rms)"
        )
    return "\n".join(lines)


def _knee_line(calibration: Calibration) -> str:
    knee = calibration.knee
    if knee is None:
        power = value_with_error(calibration.knee_mW, calibration.knee_stderr_mW)
        return f"knee (estimated): {power} mW, tip {calibration.knee_tip_K:.0f} K"
    return (
        f"knee: {value_with_error(knee.lever_V, knee.lever_V_stderr)} V, "
        f"{value_with_error(knee.current_mA, knee.current_mA_stderr)} mA, "
        f"{value_with_error(knee.power_mW, knee.power_mW_stderr)} mW at a bias of "
        f"{value_with_error(knee.bias_V, knee.bias_V_stderr)} V, tip {calibration.knee_tip_K:.0f} K"
    )


def _budget_lines(calibration: Calibration) -> list[str]:
    """Return the standard error by source at some temperatures, and the power there."""
    table, sources = calibration.table, calibration.budget
    known = np.isfinite(table.tip_K.values)
    tip = table.tip_K.values[known]
    heads = ["T_tip (K)", "P_l (mW)", "± (K)", *sources]
    widths = [max(len(head), 7) for head in heads]
    lines = ["  ".join(head.rjust(width) for head, width in zip(heads, widths, strict=True))]
    for shown in _SHOWN:
        if not tip[0] <= shown <= tip[-1]:
            continue
        power = np.interp(shown, tip, table.power_mW.values[known])
        errors = [table.tip_stderr_K.values, *sources.values()]
        cells = [f"{shown:.0f}", f"{power:.3f}"]
        cells += [f"{np.interp(shown, tip, error[known]):.1f}" for error in errors]
        lines.append(
            "  ".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
        )
    return lines


def _verdict(calibration: Calibration) -> str:
    stated = calibration.tip_temperature_uncertainty_K
    word = "good" if stated <= _GOOD else "fair" if stated <= _FAIR else "rough"
    largest = max(
        calibration.budget, key=lambda source: float(np.nanmax(calibration.budget[source]))
    )
    better = {
        "probe": "a fit of this lever (--fit) would know its material",
        "power law": "a probe (--probe) or a fit (--fit) would know more than a power law",
        "fit in vacuum": "a fit in air would measure the loss to air instead of modelling it",
    }
    advice = {
        "k": "a finer measurement near the knee would help",
        "constant k": "--medium air would not assume a constant k",
        "Raman": "a better thermometer would help",
        "electronics": "better known meters would help",
    }
    text = f"{word}; mostly from {largest}"
    if largest in advice:
        return f"{text}: {advice[largest]}"
    in_vacuum = calibration.route == "fit in vacuum" and calibration.medium == "vacuum"
    return text if in_vacuum else "; ".join([text, *filter(None, [better.get(calibration.route)])])


def calibration_figure(calibration: Calibration) -> Figure:
    """Draw the tip temperature against power and bias with its band, the knee and the budget."""
    table = calibration.table
    power, tip, half = table.power_mW, table.tip_K, 1.96 * table.tip_stderr_K
    measured = calibration.measurement
    series = calibration.probe.circuit.series_resistance_ohm / 1000.0
    lever = measured.bias_V - series * measured.current_mA
    with figure(8.0, 6.0) as made:
        grid = made.subplots(2, 2)
        by_power, by_bias, iv, budget = grid.ravel()
        law = calibration.power_law.scaled(calibration.k)
        for axes, along, label in (
            (by_power, power, "power P$_l$ (mW)"),
            (by_bias, table.bias_V, "bias V$_b$ (V)"),
        ):
            axes.fill_between(along, tip - half, tip + half, color=SKY, alpha=0.6, lw=0)
            axes.plot(along, tip, color=BLUE, label="calibration and 95 % band")
            axes.set(xlabel=label, ylabel="tip temperature (K)")
        by_power.plot(
            power,
            law.tip_temperature(power, calibration.base_temperature_K),
            "--",
            color=ORANGE,
            label="power law at P$_l$/k",
        )
        if np.isfinite(measured.tip_K).any():
            by_power.plot(
                lever * measured.current_mA, measured.tip_K, "o", mfc="none", color=BLACK,
                label="measured",
            )  # fmt: skip
            by_bias.plot(measured.bias_V, measured.tip_K, "o", mfc="none", color=BLACK)
        by_power.axvline(calibration.knee_mW, color=VERMILION, lw=0.9, ls=":")
        by_power.annotate(
            " knee", (calibration.knee_mW, calibration.base_temperature_K), color=VERMILION
        )
        by_power.legend(loc="upper left")
        iv.plot(lever, measured.current_mA, "o", mfc="none", color=BLACK, label="measured")
        iv.plot(table.lever_V, table.current_mA, color=BLUE, label="smoothed")
        if calibration.knee is not None:
            knee = calibration.knee
            iv.errorbar(
                knee.lever_V,
                knee.current_mA,
                xerr=1.96 * knee.lever_V_stderr,
                yerr=1.96 * knee.current_mA_stderr,
                fmt="s",
                color=VERMILION,
                label="knee, 95 %",
            )
        iv.set(
            xlabel="lever voltage V$_l$ (V)",
            ylabel="heater current I$_h$ (mA)",
            xlim=(0, None),
            ylim=(0, None),
        )
        iv.legend(loc="upper left")
        for (source, error), colour in zip(calibration.budget.items(), COLOURS, strict=False):
            budget.plot(tip, error, color=colour, label=source)
        budget.plot(tip, table.tip_stderr_K, color=BLACK, lw=2.0, label="together")
        budget.set(xlabel="tip temperature (K)", ylabel="standard error (K)", ylim=(0, None))
        budget.legend(loc="upper left")
        for axes, letter in zip(grid.ravel(), "abcd", strict=True):
            panel_letter(axes, letter)
    return made
