"""Figures of a calibration with its error budget, and of a design question."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
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
from hotlever.fitting.misfit import SCATTER
from hotlever.studies.design import label_of

if TYPE_CHECKING:
    import xarray as xr


def calibration_curves(calibration: Calibration) -> Figure:
    """Draw the tip temperature against power and bias with its band, the knee and the budget.

    Where the lever does not show what was measured, the difference stands in place of the budget,
    with the rows marked that are off, and no band is drawn.
    """
    table, knee, described = calibration.table, calibration.knee, calibration.describes_data
    power, tip = table.power_mW, table.tip_K
    measured = calibration.measurement.dataset(calibration.probe.circuit)
    with figure(8.0, 6.0, 2, 2, letters=True) as (made, grid):
        by_power, by_bias, iv, budget = grid.ravel()
        for axes, along, label in (
            (by_power, "power_mW", "power P$_l$ (mW)"),
            (by_bias, "bias_V", "bias V$_b$ (V)"),
        ):
            if described:
                low, high = table.tip_low_K, table.tip_high_K
                axes.fill_between(table[along], low, high, color=SKY, alpha=0.6, lw=0)
            text = "calibration and 95 % band" if described else "the nearest lever"
            axes.plot(table[along], tip, color=BLUE, label=text)
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
        text = "calibrated lever" if described else "the nearest lever"
        iv.plot(table.lever_V, table.current_mA, color=BLUE, label=text)
        if calibration.knee_measured:
            across, up = 1.96 * knee.lever_V_stderr, 1.96 * knee.current_mA_stderr
            style: Any = {"fmt": "s", "color": VERMILION, "label": "knee, 95 %"}
            iv.errorbar(knee.lever_V, knee.current_mA, xerr=across, yerr=up, **style)
        iv.set(xlabel="lever voltage V$_l$ (V)", ylabel="heater current I$_h$ (mA)")
        iv.set(xlim=(0, None), ylim=(0, None))
        iv.legend(loc="upper left")
        if described:
            _budget(budget, table)
        else:
            _difference(budget, calibration, measured)
    return made


def _budget(axes: Axes, table: xr.Dataset) -> None:
    """Draw the standard error of the tip temperature by source."""
    for source, colour in zip(table.source.values, COLOURS, strict=False):
        axes.plot(table.tip_K, table.budget_K.sel(source=source), color=colour, label=source)
    axes.plot(table.tip_K, table.tip_stderr_K, color=BLACK, lw=2.0, label="together")
    axes.set(xlabel="tip temperature (K)", ylabel="standard error (K)", ylim=(0, None))
    axes.legend(loc="upper left")


def _difference(axes: Axes, calibration: Calibration, measured: xr.Dataset) -> None:
    """Draw data minus the nearest lever, and mark the rows that are off."""
    table, known = calibration.table, measured.dropna("bias", subset=["current_mA"])
    largest = float(np.abs(known.current_mA).max())
    shown = np.interp(known.bias_V, table.bias_V, table.current_mA)
    share = (known.current_mA - shown) / largest
    off = np.abs(share) > SCATTER
    axes.axhspan(-100 * SCATTER, 100 * SCATTER, color="0.9", lw=0, label="as usual")
    axes.plot(known.bias_V, 100 * share, "o", color=BLACK, ms=3.0, label="measured")
    axes.plot(known.bias_V[off], 100 * share[off], "o", color=VERMILION, ms=5.0, label="off")
    axes.set(xlabel="bias V$_b$ (V)", ylabel="I$_h$: data − lever (% of the largest)")
    axes.legend(loc="best")


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
