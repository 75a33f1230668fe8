"""Design questions answered: sensitivities in words, sweeps as figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from hotlever.calibration.design import ANNEALING, QUANTITIES, Design
from hotlever.materials import PARAMETERS
from hotlever.report.style import BLUE, GREEN, ORANGE, PURPLE, VERMILION, figure, panel_letter

#: Columns of the table of sensitivities.
_SHOWN = ("knee_K", "knee_mW", "knee_V", "knee_bias_V", "tip_K", "cold_ohm", "k")


def sensitivity_text(
    design: Design,
    base: Mapping[str, float],
    slopes: Mapping[str, Mapping[str, float]],
    power_mW: float,
) -> str:
    """Return the sensitivities of a design as lines of text."""
    lines = [
        f"knee at {base['knee_K']:.0f} K, {base['knee_V']:.3f} V, {base['knee_mA']:.3f} mA, "
        f"{base['knee_mW']:.3f} mW (bias {base['knee_bias_V']:.2f} V), inversion temperature "
        f"{base['inversion_K']:.0f} K; tip at {base['tip_K']:.0f} K with {power_mW:g} mW; "
        f"{base['cold_ohm']:.0f} ohm when cold"
        + ("" if np.isnan(base["k"]) else f"; k = {base['k']:.3f} in air"),
        "change for 1 % more of each (K for temperatures, % for the others):",
        "",
    ]
    shown = [key for key in _SHOWN if np.isfinite(base[key])]
    width = max(len(name) for name in slopes)
    lines.append("  ".join(["".ljust(width), "at".rjust(9), *(key.rjust(11) for key in shown)]))
    for name, row in slopes.items():
        cells = [name.ljust(width), f"{design.value(name):9.4g}"]
        cells += [f"{row[key]:+11.3f}" for key in shown]
        lines.append("  ".join(cells))
    return "\n".join(lines)


def design_csv(data: xr.Dataset) -> str:
    """Return a sweep of a design as CSV, one row per value; empty where nothing is known."""
    (name,) = data.dims
    lines = [",".join([str(name), *QUANTITIES])]
    for place, value in enumerate(data[name].values):
        cells = [data[key].values[place] for key in QUANTITIES]
        lines.append(
            ",".join([f"{value:.6g}", *("" if np.isnan(cell) else f"{cell:.6g}" for cell in cells)])
        )
    return "\n".join(lines) + "\n"


def _axis_label(name: str) -> str:
    if name in ANNEALING:
        return f"{ANNEALING[name][0]} ({name.rsplit('_', 1)[1]})"
    if name in PARAMETERS:
        known = PARAMETERS[name]
        return known.symbol if known.unit == "1" else f"{known.symbol} ({known.unit})"
    words, _, unit = name.rpartition("_")
    return f"{words.replace('_', ' ')} ({unit.replace('um', 'µm').replace('ohm', 'Ω')})"


def design_figure(data: xr.Dataset) -> Figure:
    """Draw temperatures, knee and k against the number that was varied."""
    (name,) = data.dims
    along = data[name]
    with figure(8.0, 5.6) as made:
        grid = made.subplots(2, 2, sharex=True)
        temperature, power, volts, loss = grid.ravel()
        temperature.plot(along, data.knee_K, "o-", color=VERMILION, label="knee")
        temperature.plot(along, data.inversion_K, "--", color=ORANGE, label="inversion T$_i$")
        temperature.plot(
            along, data.tip_K, "s-", color=BLUE, label=f"tip at {data.attrs['power_mW']:g} mW"
        )
        temperature.set(ylabel="tip temperature (K)")
        temperature.legend()
        power.plot(along, data.knee_mW, "o-", color=BLUE)
        power.set(ylabel="power of the knee (mW)")
        volts.plot(along, data.knee_V, "o-", color=BLUE, label="lever V$_l$ (V)")
        volts.plot(along, data.knee_bias_V, "s-", color=GREEN, label="bias V$_b$ (V)")
        volts.plot(along, data.knee_mA, "^-", color=PURPLE, label="current I$_h$ (mA)")
        volts.set(ylabel="at the knee (V, mA)", ylim=(0, None))
        volts.legend()
        if data.k.notnull().any():
            loss.plot(along, data.k, "o-", color=BLUE)
            loss.set(ylabel="k, power in air / in vacuum")
        else:
            loss.plot(along, data.cold_ohm / 1000.0, "o-", color=BLUE)
            loss.set(ylabel="cold resistance (kΩ)")
        for axes, letter in zip(grid.ravel(), "abcd", strict=True):
            panel_letter(axes, letter)
            axes.axvline(data.attrs["base_value"], color="0.6", lw=0.8, ls=":")
        for axes in grid[1]:
            axes.set(xlabel=_axis_label(str(name)))
    return made
