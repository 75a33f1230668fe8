"""Figures of levers that a controller holds at a resistance or a power."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from hotlever.colours import BLACK, VERMILION
from hotlever.figures.style import COLOURS, axis_label, entitle, figure

if TYPE_CHECKING:
    import xarray as xr

#: Share of a step of which a line is drawn; and of the gains, whose times are told apart.
_OVERSHOOT, _SHOWN = 0.1, 0.8


def held_states(data: xr.Dataset, curve: xr.Dataset | None = None) -> Figure:
    """Draw the states at set points: the held quantity and the bias against the tip temperature.

    Parameters
    ----------
    data, curve : xarray.Dataset
        Of `hotlever.lever.set_points.hold`.
    """
    of_power = "set_mW" in data
    column, scale = ("set_mW", 1.0) if of_power else ("set_ohm", 1000.0)
    with figure(7.4, 3.4, 1, 2, letters=True) as (made, (quantity, bias)):
        if curve is not None:
            whole = curve.power_mW if of_power else curve.lever_V / curve.current_mA
            style: Any = {"color": "0.6", "lw": 1.0, "label": "all states"}
            quantity.plot(curve.tip_K, whole, **style)
            bias.plot(curve.tip_K, curve.bias_V, **style)
        for number, colour in zip(np.unique(data.state).tolist(), cycle(COLOURS), strict=False):
            some = data.isel(bias=data.state.values == number)
            label = f"state {number:g} of a set point"
            for axes, values in ((quantity, some[column] / scale), (bias, some.bias_V)):
                axes.plot(some.tip_K, values, "o", color=colour, label=label)
        highest = 1.25 * float(data[column].max()) / scale
        if curve is not None:
            # a resistance has poles where other supplies turn the current: no room for these
            highest = max(highest, min(whole.max().item(), 1.5 * whole.quantile(0.9).item()))
        quantity.set(
            xlabel=axis_label("tip_K"),
            ylabel="power P$_l$ (mW)" if of_power else "resistance V$_l$/I$_h$ (kΩ)",
            ylim=(0.0, 1.05 * highest),
        )
        bias.set(xlabel=axis_label("tip_K"), ylabel=axis_label("bias_V"))
        quantity.legend()
        entitle(made, data)
    return made


def gain_map(data: xr.Dataset, gains: tuple[float, float] | None = None) -> Figure:
    """Draw over gains how fast a closed loop settles, and where it is not stable.

    Parameters
    ----------
    data : xarray.Dataset
        Of `hotlever.lever.transient.closed_loop.ClosedLoop.gain_map`.
    gains : tuple of float, optional
        P (V/kΩ) and I (V/(kΩ ms)) to mark.
    """
    P, per_ms = (np.abs(data[name].values) for name in ("proportional", "integral"))
    settled, minus = data.settling_us.values.T, "−" if data.integral.values[0] < 0.0 else ""
    with figure(5.4, 4.4) as (made, axes):
        lowest, highest = np.nanquantile(settled, [0.0, _SHOWN])
        colours = axes.pcolormesh(
            P,
            per_ms,
            settled,
            norm=LogNorm(lowest, highest),
            cmap="cividis_r",
            shading="nearest",
            rasterized=True,
        )
        made.colorbar(colours, extend="max").set_label("time until a step has settled to 2 % (µs)")
        axes.set(facecolor="0.85", xscale="log", yscale="log")
        style: Any = {"colors": BLACK, "linewidths": 1.2}
        axes.contour(P, per_ms, data.growth_per_us.values.T, [0.0], **style)
        axes.contour(P, per_ms, data.overshoot.values.T, [_OVERSHOOT], linestyles="--", **style)
        if gains is not None:
            at = np.clip(abs(gains[0]), *P[[0, -1]]), np.clip(abs(gains[1]), *per_ms[[0, -1]])
            mark: Any = {"color": VERMILION, "mec": "w", "ms": 7, "ls": "none", "clip_on": False}
            axes.plot(*at, "o", label=f"P, I = {gains[0]:g}, {gains[1]:g}", **mark)
        axes.plot([], [], "--", color=BLACK, lw=1.2, label=f"overshoot {_OVERSHOOT:.0%}")
        axes.fill_between([], [], color="0.85", label="not stable")
        axes.set(xlabel=f"{minus}P (V/kΩ)", ylabel=f"{minus}I (V/(kΩ ms))")
        made.legend(loc="outside lower center", ncols=3)
        held = f"{data.attrs['set_ohm']:.5g} Ω, tip at {data.attrs['tip_K']:.0f} K"
        entitle(made, data, more=f"{held}, filter {data.attrs['filter_us']:g} µs")
    return made
