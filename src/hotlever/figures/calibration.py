"""Figures of calibrations: of one, of many levers, of judged ones, and of what to measure next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from hotlever.estimate.calibration import Calibration
from hotlever.estimate.diagnosis import USUAL_SCATTER
from hotlever.estimate.levers import tips_along
from hotlever.estimate.next_measurement import SURE, Plan
from hotlever.estimate.pulses import PulseCalibration
from hotlever.figures.style import (
    LINES,
    MEASURED,
    axis_label,
    curve,
    entitle,
    figure,
    from_zero,
    values_by_lever,
)
from hotlever.studies.simulation_based_calibration import ESTIMATE, LEVELS, WAYS
from hotlever.text import BAND

if TYPE_CHECKING:
    import xarray as xr

#: What levers are compared by.
_COMPARED = ("tip_K", "knee_lever_V", "knee_current_mA", "knee_power_mW")
#: What is drawn of a tip in contact.
_OF_THE_CONTACT = {"apex_K": ("apex", GREEN), "surface_K": ("the sample under it", VERMILION)}
#: Colour of each way of calibrating.
_BY_WAY = (BLUE, GREEN, ORANGE, VERMILION)
#: How each kind of measurement is marked, and colours of errors, now and after more of them.
_MARKS: dict[str, Any] = {
    "bias": {"marker": "o", "color": BLUE},
    "reader": {"marker": "s", "color": GREEN},
    "spectra": {"marker": "^", "color": PURPLE},
}
_BY_ADDED = (BLACK, ORANGE, GREEN, BLUE, SKY)


def calibration_curves(calibration: Calibration) -> Figure:
    """Draw the tip temperature against power and bias with its band, the knee and the budget.

    Where the lever does not show what was measured, the difference stands in place of the budget,
    with the rows marked that are off, no band is drawn, and the title says so. The peak of a pulse,
    if calibrated, stands beside the static curve.
    """
    table, knee, described = calibration.table, calibration.knee, calibration.describes_data
    power = table.power_mW
    measured = calibration.measurement.dataset(calibration.probe.circuit)
    with figure(8.0, 6.0, 2, 2, letters=True) as (fig, grid):
        by_power, by_bias, iv, budget = grid.ravel()
        entitle(fig, more=calibration.probe.title, is_described=bool(described))
        name = "calibration and 95 % band" if described else "the nearest lever"
        if described and "apex_K" in table:
            name = "tip and 95 % band"
        for axes, along in ((by_power, "power_mW"), (by_bias, "bias_V")):
            if described:
                low, high = table.tip_low_K, table.tip_high_K
                axes.fill_between(table[along], low, high, color=SKY, alpha=0.6, lw=0)
            curve(axes, table, along, "tip_K", color=BLUE, label=name)
            curve(axes, measured, along, "tip_K", **MEASURED)
            for column, (label, colour) in _OF_THE_CONTACT.items():
                if column in table:
                    curve(axes, table, along, column, color=colour, label=label)
                if column in measured:
                    curve(axes, measured, along, column, **MEASURED | {"mfc": colour})
            if "apex_K" in table:
                axes.set_ylabel("temperature (K)")
        if calibration.power_law is not None and np.isfinite(calibration.k):
            law = calibration.power_law.scaled(calibration.k)
            expected = law.tip_temperature(power, calibration.base_temperature_K)
            by_power.plot(power, expected, "--", color=ORANGE, label="power law at P$_l$/k")
        if knee.power_mW <= power.max():
            by_power.axvline(knee.power_mW, color=VERMILION, lw=0.9, ls=":")
            base = calibration.base_temperature_K
            by_power.annotate(" knee", (knee.power_mW, base), color=VERMILION)
        by_power.legend(loc="upper left")
        if calibration.pulse is not None:
            _pulse(by_bias, calibration.pulse)
        curve(iv, measured, "lever_V", "current_mA", **MEASURED)
        name = "calibrated lever" if described else "the nearest lever"
        curve(iv, table, "lever_V", "current_mA", color=BLUE, label=name)
        if calibration.knee_measured:
            across, up = BAND * knee.lever_V_stderr, BAND * knee.current_mA_stderr
            label = "knee, 95 %" if described else "its knee"
            style: Any = {"fmt": "s", "color": VERMILION, "label": label}
            iv.errorbar(knee.lever_V, knee.current_mA, xerr=across, yerr=up, **style)
        iv.set(xlim=from_zero(table.lever_V), ylim=from_zero(table.current_mA))
        iv.legend(loc="upper left")
        if described:
            _budget(budget, table)
        else:
            _difference(budget, calibration, measured)
    return fig


def calibrated_levers(calibrations: Mapping[str, Calibration], levers: xr.Dataset) -> Figure:
    """Draw where the calibrations of several levers differ.

    Parameters
    ----------
    calibrations : mapping of str to Calibration
        By lever; those whose data are not described are left out.
    levers : xarray.Dataset
        From `hotlever.estimate.levers.compare_calibrations`.
    """
    along, count = levers.attrs["along"], levers.sizes["lever"]
    tips, many = tips_along(calibrations, along), count > len(LINES)
    named: Any = {"rotation": 45, "ha": "right", "parse_math": False, "fontsize": 7}
    with figure(8.0, 7.6, 3, 2, letters=True) as (fig, grid):
        curves, differences, *by_lever = grid.ravel()
        for tip, (line, colour) in zip(tips.tip_K, cycle(LINES), strict=False):
            style: Any = {"color": colour, "ls": line, "lw": 0.8 if many else 1.2}
            curves.plot(tips[along], tip, label=tip.lever.item(), **style)
            differences.plot(tips[along], tip - tips.tip_K.mean("lever"), **style)
        half = BAND * tips.tip_stderr_K.mean("lever")
        band: Any = {"color": "0.88", "lw": 0, "label": "95 % of a lever"}
        differences.fill_between(tips[along], -half, half, **band)
        differences.legend(loc="upper left")
        curves.set(ylabel=axis_label("tip_K"))
        differences.set(ylabel="difference from the mean (K)")
        for axes in (curves, differences):
            axes.axvline(levers[along].values[0], color="0.6", lw=0.8, ls=":")
            axes.set(xlabel=axis_label(along))
        if not many:
            fig.legend(*curves.get_legend_handles_labels(), loc="outside lower center", ncols=6)
        for name, axes in zip(_COMPARED, by_lever, strict=True):
            values_by_lever(axes, levers.sel(quantity=name))
            axes.set(ylabel=levers.heading.sel(quantity=name).item(), xlim=(0.5, count + 0.5))
            if many:
                axes.set(xlabel="lever")
            else:
                axes.set_xticks(np.arange(1, count + 1), levers.lever.values, **named)
    return fig


def judged_calibrations(judged: xr.Dataset) -> Figure:
    """Draw how wrong each way of calibrating is, and whether the stated errors hold.

    Parameters
    ----------
    judged : xarray.Dataset
        From `hotlever.studies.simulation_based_calibration.concatenated`.
    """
    largest, other = abs(judged.off_K).max("row"), judged.other_law.values
    ratio = (judged.off_K.sel(way=ESTIMATE) / judged.stated_K).transpose("lever", "row")
    laws = [law for law in (False, True) if law in other]
    with figure(8.0, 3.8, 1, 2, letters=True) as (fig, (by_way, by_bias)):
        beside: Any = {"transform": by_way.get_yaxis_transform(), "va": "center", "fontsize": 8}
        for row, (way, colour) in enumerate(zip(WAYS, _BY_WAY, strict=True)):
            for law in laws:
                at = row + (0.2 if law else -0.2) * (len(laws) - 1)
                here = largest.sel(way=way).values[other == law]
                marks: Any = {"color": colour, "mfc": "white" if law else colour}
                by_way.plot(here, np.linspace(-0.12, 0.12, here.size) + at, "o", ms=4, **marks)
                middle = float(np.nanmedian(here))
                by_way.plot([middle] * 2, [at - 0.18, at + 0.18], color=BLACK, lw=2)
                by_way.text(1.01, at, f"{middle:.0f} K", **beside)
        by_way.set(xscale="log", xlabel="largest error above 400 K (K); bar, right: median")
        by_way.set(yticks=range(len(WAYS)), ylim=(len(WAYS) - 0.4, -0.6))
        by_way.set_yticklabels([way.replace(" at ", "\nat ") for way in WAYS])
        by_way.xaxis.set_major_formatter("{x:g}")
        for level, limit in reversed(LEVELS.items()):
            by_bias.axhspan(-limit, limit, color=SKY, alpha=0.3, lw=0)
            by_bias.annotate(f"stated {level:.0%} ", (1, limit), ha="right", va="top", fontsize=7)
        for law in laws:
            marks = {"color": BLACK, "mfc": "white" if law else BLACK, "ls": "--" if law else "-"}
            label = "another law" if law else "mobility of Eq. 8"
            by_way.plot([], [], "o", label=label, **{**marks, "ls": "none"})
            for errors in ratio.values[other == law]:
                finite = errors[np.isfinite(errors)]
                share = np.linspace(0.0, 1.0, finite.size)
                by_bias.plot(share, finite, color=_BY_WAY[0], ls=marks["ls"], lw=0.9)
            by_bias.plot([], [], color=_BY_WAY[0], ls=marks["ls"], label=label)
        by_bias.axhline(0.0, color=BLACK, lw=0.8)
        by_bias.set(xlim=(0, 1), xlabel="bias V$_b$ (above 400 K)")
        by_bias.set(ylabel="error of the estimate (stated errors)")
        by_bias.set_xticks([0, 1], ["400 K", "hottest"])
        for axes in (by_way, by_bias):
            axes.legend(loc="lower left", bbox_to_anchor=(0.1, 1.0), ncols=2, borderpad=0.1)
    return fig


def _pulse(axes: Axes, pulse: PulseCalibration) -> None:
    """Draw the peak of a pulse by its height, with its band."""
    table = pulse.table
    axes.fill_between(table.height_V, table.peak_low_K, table.peak_high_K, color=ORANGE, alpha=0.4)
    axes.plot(table.height_V, table.peak_K, color=VERMILION, label=f"peak of {pulse.timing.text}")
    axes.legend(loc="upper left")


def _budget(axes: Axes, table: xr.Dataset) -> None:
    """Draw the standard error of the tip temperature by source."""
    # black is that of all together
    lines = cycle((line, colour) for line, colour in LINES if colour != BLACK)
    for source, (line, colour) in zip(table.source.values, lines, strict=False):
        part = table.budget_K.sel(source=source)
        axes.plot(table.tip_K, part, ls=line, color=colour, label=source)
    axes.plot(table.tip_K, table.tip_stderr_K, color=BLACK, lw=2.0, label="together")
    axes.set(xlabel=axis_label("tip_K"), ylabel="standard error (K)", ylim=(0, None))
    axes.legend(loc="upper left")


def _difference(axes: Axes, calibration: Calibration, measured: xr.Dataset) -> None:
    """Draw data minus the nearest lever, and mark the rows that are off."""
    table, data = calibration.table, measured.dropna("bias", subset=["current_mA"])
    expected = np.interp(data.bias_V, table.bias_V, table.current_mA)
    share = 100 * (data.current_mA - expected) / float(np.abs(data.current_mA).max())
    usual = 100 * USUAL_SCATTER
    off = np.abs(share) > usual
    axes.axhspan(-usual, usual, color="0.9", lw=0, label="as usual")
    axes.plot(data.bias_V, share, "o", color=BLACK, ms=3.0, label="measured")
    axes.plot(data.bias_V[off], share[off], "o", color=VERMILION, ms=5.0, label="off")
    axes.set(xlabel=axis_label("bias_V"), ylabel="I$_h$: data − lever (% of the largest)")
    axes.legend(loc="best")


def planned_measurements(plan: Plan) -> Figure:
    """Draw the error by temperature now and after more measurements, and how hot the tip may get.

    The proposed measurements are marked, with how often each is proposed, and the limit.
    """
    errors, proposals = plan.errors, plan.proposals
    finite = np.isfinite(errors.tip_limit_K.values)
    kinds = proposals.what.values.tolist()
    counts = Counter(zip(kinds, proposals.bias_V.values.tolist(), strict=True))
    with figure(8.0, 3.8, 1, 2, letters=True) as (fig, (by_tip, by_bias)):
        entitle(fig, more=plan.lever)
        for added, colour in zip(errors.added.values.tolist(), cycle(_BY_ADDED), strict=False):
            label = f"after {added} more" if added else "now"
            stderr = errors.tip_stderr_K.sel(added=added)
            by_tip.plot(errors.tip_K[finite], stderr[finite], color=colour, label=label)
        last = errors.tip_stderr_K.isel(added=-1)
        by_tip.axvline(plan.at_K, color="0.6", lw=0.9, ls=":")
        above: Any = {"xycoords": by_tip.get_xaxis_transform(), "color": "0.4", "fontsize": 7}
        by_tip.annotate(f"{plan.at_K:.0f} K, where it counts", (plan.at_K, 1.0), **above)
        by_bias.plot(errors.bias[finite], errors.tip_K[finite], color=BLACK, label="expected")
        limit: Any = {"color": VERMILION, "label": f"no hotter, by {SURE:.0%}"}
        by_bias.plot(errors.bias[finite], errors.tip_limit_K[finite], "--", **limit)
        by_bias.axvspan(plan.safe_V, float(errors.bias[finite].max()), color="0.92", lw=0)
        if plan.stay_below_K is not None:
            by_bias.axhline(plan.stay_below_K, color=VERMILION, lw=0.9)
            text = f" limit {plan.stay_below_K:.0f} K"
            by_bias.annotate(text, (errors.bias.values[0], plan.stay_below_K), va="bottom")
        for (kind, bias), times in counts.items():
            tip = float(np.interp(bias, errors.bias, errors.tip_K))
            stderr_K = float(np.interp(bias, errors.bias, last))
            style = {"ls": "none", "ms": 7.0, "mec": "white", **_MARKS[kind], "zorder": 3}
            for axes, at in ((by_bias, (bias, tip)), (by_tip, (tip, stderr_K))):
                axes.plot(*at, **style)
                if times > 1:
                    axes.annotate(f" {times}×", at, fontsize=7, va="top")
        for kind in dict.fromkeys(kinds):
            by_bias.plot([], [], ls="none", label=f"{kind}, proposed", **_MARKS[kind])
        by_tip.set(xlabel=axis_label("tip_K"), ylabel="standard error (K)", ylim=(0, None))
        by_bias.set(xlabel=axis_label("bias_V"), ylabel=axis_label("tip_K"))
        for axes in (by_tip, by_bias):
            axes.legend(loc="upper left")
    return fig
