"""Figures of a calibration with its error budget, and of a design question."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from hotlever.calibration.calibration import Calibration
from hotlever.figures.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    MEASURED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    figure,
)
from hotlever.studies.design import label_of
from hotlever.studies.twins import ESTIMATE, LEVELS, WAYS

if TYPE_CHECKING:
    import xarray as xr

#: Colour of each way of calibrating.
_BY_WAY = (BLUE, GREEN, ORANGE, VERMILION)


def calibration_curves(calibration: Calibration) -> Figure:
    """Draw the tip temperature against power and bias with its band, the knee and the budget."""
    table, knee = calibration.table, calibration.knee
    power, tip, half = table.power_mW, table.tip_K, 1.96 * table.tip_stderr_K
    measured = calibration.measurement.dataset(calibration.probe.circuit)
    with figure(8.0, 6.0, 2, 2, letters=True) as (made, grid):
        by_power, by_bias, iv, budget = grid.ravel()
        for axes, along, label in (
            (by_power, "power_mW", "power P$_l$ (mW)"),
            (by_bias, "bias_V", "bias V$_b$ (V)"),
        ):
            axes.fill_between(table[along], tip - half, tip + half, color=SKY, alpha=0.6, lw=0)
            axes.plot(table[along], tip, color=BLUE, label="calibration and 95 % band")
            axes.set(xlabel=label, ylabel="tip temperature (K)")
            if measured.tip_K.notnull().any():
                axes.plot(measured[along], measured.tip_K, **MEASURED)
        if np.isfinite(calibration.k):
            law = calibration.power_law.scaled(calibration.k)
            expected = law.tip_temperature(power, calibration.base_temperature_K)
            by_power.plot(power, expected, "--", color=ORANGE, label="power law at P$_l$/k")
        if knee.power_mW <= power.max():
            by_power.axvline(knee.power_mW, color=VERMILION, lw=0.9, ls=":")
            base = calibration.base_temperature_K
            by_power.annotate(" knee", (knee.power_mW, base), color=VERMILION)
        by_power.legend(loc="upper left")
        iv.plot(measured.lever_V, measured.current_mA, **MEASURED)
        iv.plot(table.lever_V, table.current_mA, color=BLUE, label="calibrated lever")
        if calibration.knee_measured:
            across, up = 1.96 * knee.lever_V_stderr, 1.96 * knee.current_mA_stderr
            style: Any = {"fmt": "s", "color": VERMILION, "label": "knee, 95 %"}
            iv.errorbar(knee.lever_V, knee.current_mA, xerr=across, yerr=up, **style)
        iv.set(xlabel="lever voltage V$_l$ (V)", ylabel="heater current I$_h$ (mA)")
        iv.set(xlim=(0, None), ylim=(0, None))
        iv.legend(loc="upper left")
        for source, colour in zip(table.source.values, COLOURS, strict=False):
            budget.plot(tip, table.budget_K.sel(source=source), color=colour, label=source)
        budget.plot(tip, table.tip_stderr_K, color=BLACK, lw=2.0, label="together")
        budget.set(xlabel="tip temperature (K)", ylabel="standard error (K)", ylim=(0, None))
        budget.legend(loc="upper left")
    return made


def twins(found: xr.Dataset) -> Figure:
    """Draw how wrong each way of calibrating is, and whether the stated errors hold.

    Parameters
    ----------
    found : xarray.Dataset
        From `hotlever.studies.twins.together`.
    """
    shape: Any = {"width_ratios": (1.0, 1.0)}
    with figure(8.0, 3.4, 1, 2, letters=True, **shape) as (made, (by_way, by_bias)):
        largest = abs(found.off_K).max("row")
        for place, (way, colour) in enumerate(zip(WAYS, _BY_WAY, strict=True)):
            here = largest.sel(way=way).values
            # next to each other, in the same order for every way
            across = place + np.linspace(-0.25, 0.25, here.size)
            by_way.plot(here, across, "o", color=colour, ms=4, alpha=0.7)
            middle = np.nanmedian(here)
            by_way.plot([middle] * 2, [place - 0.36, place + 0.36], color=BLACK, lw=2)
            by_way.annotate(f"{middle:.0f} K", (middle, place - 0.38), ha="center", va="bottom")
        by_way.set(xscale="log", xlabel="largest error above 400 K (K), bar: median")
        by_way.set(yticks=range(len(WAYS)), ylim=(len(WAYS) - 0.4, -0.7))
        by_way.set_yticklabels([way.replace(" at ", "\nat ") for way in WAYS])
        by_way.xaxis.set_major_formatter("{x:g}")
        for level, limit in reversed(LEVELS.items()):
            label = f"stated {level:.0%} band"
            by_bias.axhspan(-limit, limit, color=SKY, alpha=0.3, lw=0, label=label)
        ratio = found.off_K.sel(way=ESTIMATE) / found.tip_stderr_K
        for one in ratio.values:
            known = one[np.isfinite(one)]
            share = np.linspace(0.0, 1.0, known.size)
            by_bias.plot(share, known, color=BLUE, lw=0.9, alpha=0.8)
        by_bias.axhline(0.0, color=BLACK, lw=0.8)
        by_bias.set(xlim=(0, 1), xlabel="bias, from 400 K to the highest")
        by_bias.set(ylabel="error / stated error of the estimate")
        by_bias.set_xticks([0, 1], ["400 K", "hottest"])
        by_bias.legend(loc="upper left", ncols=2)
    return made


def design_sweep(data: xr.Dataset) -> Figure:
    """Draw temperatures, knee and k against the number that was varied.

    Parameters
    ----------
    data : xarray.Dataset
        From `hotlever.studies.design.vary`.
    """
    (name,) = data.dims
    along = data[name]
    with figure(8.0, 5.6, 2, 2, sharex=True, letters=True) as (made, grid):
        temperature, power, volts, loss = grid.ravel()
        temperature.plot(along, data.knee_K, "o-", color=VERMILION, label="knee")
        temperature.plot(along, data.inversion_K, "--", color=ORANGE, label="inversion T$_i$")
        tip = f"tip at {data.attrs['power_mW']:g} mW"
        temperature.plot(along, data.tip_K, "s-", color=BLUE, label=tip)
        temperature.set(ylabel="tip temperature (K)")
        temperature.legend()
        power.plot(along, data.knee_mW, "o-", color=BLUE)
        power.set(ylabel="power of the knee (mW)")
        volts.plot(along, data.knee_V, "o-", color=BLUE, label="lever V$_l$ (V)")
        volts.plot(along, data.knee_bias_V, "s-", color=GREEN, label="bias V$_b$ (V)")
        volts.plot(along, data.knee_mA, "^-", color=PURPLE, label="current I$_h$ (mA)")
        volts.set(ylabel="at the knee (V, mA)", ylim=(0, None))
        volts.legend()
        in_air = bool(np.isfinite(data.k).any())
        loss.plot(along, data.k if in_air else data.cold_ohm / 1000.0, "o-", color=BLUE)
        loss.set(ylabel="k, power in air / in vacuum" if in_air else "cold resistance (kΩ)")
        for axes in grid.ravel():
            axes.axvline(data.attrs["base_value"], color="0.6", lw=0.8, ls=":")
        for axes in grid[1]:
            axes.set(xlabel=label_of(str(name)))
    return made
