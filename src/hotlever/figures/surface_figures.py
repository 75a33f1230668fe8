"""Figures of a lever at a sample: a tip that touches it, and a reader that shows its distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from hotlever.colours import BLUE, HEAT, ORANGE, PURPLE, VERMILION
from hotlever.contact.picture import contact_picture
from hotlever.figures.style import COLOURS, axis_label, curve, entitle, figure, marker
from hotlever.probe import Probe

if TYPE_CHECKING:
    import xarray as xr


def contact_overview(data: xr.Dataset, probe: Probe) -> Figure:
    """Draw tip, contact and sample with their resistances, and temperatures, heat and current.

    Parameters
    ----------
    data : xarray.Dataset
        Of `hotlever.lever.contact`, by bias or in time.
    probe : Probe
        In contact.
    """
    along = "time_us" if "time" in data.sizes else "bias_V"
    (dimension,) = data.apex_K.dims
    mark = f"{marker(data, str(dimension))}-"
    with figure(9.6, 5.2) as (fig, axes):
        axes.remove()
        grid = fig.add_gridspec(3, 2, width_ratios=(1.15, 1.0))
        hottest = data.isel({dimension: int(np.argmax(data.tip_K.values))})
        _draw(fig.add_subplot(grid[:, 0]), hottest, probe)
        temperature, heat, current = (fig.add_subplot(grid[row, 1]) for row in range(3))
        curve(temperature, data, along, "tip_K", mark, color=VERMILION, label="tip at the lever")
        curve(temperature, data, along, "apex_K", mark, color=PURPLE, label="apex")
        temperature.set(ylabel="temperature (K)")
        temperature.legend()
        through = ("sample_mW", ORANGE, "through the contact"), ("beside_mW", BLUE, "through air")
        for name, colour, label in through[: 1 + bool((data.beside_mW > 1e-9).any())]:
            heat.plot(data[along], 1e3 * data[name], mark, color=colour, label=label)
        heat.set(ylabel="heat into the\nsample (µW)")
        heat.legend()
        current.plot(data[along], 1e3 * data.current_change_mA, mark, color=BLUE)
        current.set(ylabel="change of I$_h$\nat contact (µA)", xlabel=axis_label(along))
        for above in (temperature, heat):
            above.set(xlabel="")
            above.tick_params(labelbottom=False)
        entitle(fig, data)
    return fig


def _draw(axes: Axes, state: xr.Dataset, probe: Probe) -> None:
    """Draw lever, tip and sample of one state, coloured by temperature."""
    tip = probe.tip
    assert tip is not None
    base, hot, apex = probe.circuit.base_temperature_K, float(state.tip_K), float(state.apex_K)
    drawn = contact_picture(probe, hot)
    heat, scale = mpl.colormaps[HEAT], Normalize(base, max(hot, base + 1.0))
    width = drawn.half_width
    for number, (name, top, bottom) in enumerate(drawn.layers):
        grey = str(0.78 + 0.16 * (number % 2))
        axes.fill_between([-width, width], bottom, top, facecolor=grey)
        axes.text(-0.97 * width, (top + bottom) / 2.0, name, va="center", fontsize=8)
    for corners, T in drawn.pieces:
        axes.fill(*zip(*corners, strict=True), facecolor=heat(scale(T)), lw=0.0)
    for line in drawn.outlines:
        axes.plot(*zip(*line, strict=True), color="0.3", lw=0.8)

    def word(height: float, text: str) -> None:
        axes.text(1.06 * width, height, text, va="center", fontsize=8)

    high, low = drawn.height[0], drawn.bottom
    end = f"r = {1e3 * tip.apex_radius_um:.4g} nm"
    word(high + 0.35, f"heater: {hot:.0f} K")
    word(0.6 * high, f"cone, {tip.height_um:g} µm: {_per_watt(state.tip_K_per_mW)}")
    word(0.12 * high, f"apex: {apex:.0f} K")
    word(0.0, f"interface, {end}: {_per_watt(state.interface_K_per_mW)}")
    word(0.3 * low, f"spreading: {_per_watt(state.spreading_K_per_mW)}")
    word(0.5 * low, f"heat: {1e3 * float(state.sample_mW):.3g} µW")
    word(low, f"far away: {base:.0f} K")
    # less heat (mW) is none but for rounding
    if float(state.beside_mW) > 1e-9:
        air = f"air: {1e3 * float(state.beside_mW):.3g} µW"
        axes.text(-0.97 * width, 0.08 * high, air, fontsize=8)
    axes.set(xlim=(-1.05 * width, 2.45 * width), ylim=(low - 0.2, drawn.top + 0.2), xticks=[])
    axes.set_yticks(*zip(*drawn.ticks, strict=True))
    axes.tick_params(labelsize=8)
    axes.grid(visible=False)
    axes.spines[["bottom", "right", "top"]].set_visible(False)
    axes.set_title(f"where it is hottest, at {float(state.bias_V):.4g} V")


def _per_watt(resistance: Any) -> str:
    """Return a thermal resistance (K/mW) as text."""
    value = 1e3 * float(resistance)
    return f"{value:.3g} K/W" if value > 0 else "none"


class _Plain(LogFormatter):
    """Numbers of a logarithmic axis as they are."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a number; empty where it has none."""
        return f"{x:g}" if super().__call__(x, pos) else ""


def reader_overview(data: xr.Dataset) -> Figure:
    """Draw what a reader shows, by distance to the surface or else by bias.

    Parameters
    ----------
    data : xarray.Dataset
        Of `hotlever.lever.reader.over_surface`.
    """
    along = "distance" if data.sizes["distance"] > 1 or data.sizes["bias"] == 1 else "bias"
    x_name = {"distance": "surface_gap_um", "bias": "bias_V"}[along]
    labels = {"distance": "{:.3g} µm", "bias": "{:.4g} V", "pressure": "{:.3g} mbar"}
    others = [name for name in labels if name in data.sizes and name != along]
    points = [
        dict(zip(others, indices, strict=True))
        for indices in np.ndindex(*(data.sizes[name] for name in others))
    ]
    chosen = np.unique(np.linspace(0, len(points) - 1, min(6, len(points))).round())
    curves = [data.isel(points[int(number)]) for number in chosen]
    best = data.isel(data.resolution_nm_per_rtHz.argmin(...))
    of_best = data.sel({name: best[name].item() for name in others})
    mark = f"{marker(data, along)}-"
    with figure(8.2, 5.6, 2, 2, letters=True) as (fig, ((voltage, slope), (noise, resolution))):
        for curve, colour in zip(curves, COLOURS, strict=False):
            label = ", ".join(labels[name].format(curve[name].item()) for name in others)
            style = {"color": colour, "label": label}
            x = curve[x_name]
            voltage.plot(x, curve.reader_V, mark, **style)
            slope.plot(x, 10.0 * np.abs(curve.dlnR_dz_per_um), mark, **style)
            resolution.plot(x, 1e3 * curve.resolution_nm_per_rtHz, mark, **style)
        voltage.set(ylabel="reader voltage (V)")
        slope.set(ylabel="|d ln R/dz| (10$^{-4}$/nm)", yscale="log")
        resolution.set(ylabel="resolution (pm/√Hz)", yscale="log")
        noise.plot(of_best[x_name], 1e9 * of_best.noise_V_per_rtHz, "k" + mark, label="all")
        for source in data.source.values.tolist():
            part = of_best.source_V_per_rtHz.sel(source=source)
            if (part**2 > 1e-3 * of_best.noise_V_per_rtHz**2).any():
                noise.plot(of_best[x_name], 1e9 * part, mark, label=source)
        at = ", ".join(labels[name].format(best[name].item()) for name in others)
        noise.set(ylabel=f"noise at {at} (nV/√Hz)", yscale="log")
        noise.legend(fontsize=7)
        if len(curves) > 1:
            slope.legend(fontsize=7)
        for axes in (voltage, slope, noise, resolution):
            axes.set(xlabel=axis_label(x_name))
        for axes in (slope, noise, resolution):
            for which in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
                which(_Plain(minor_thresholds=(2, 0.5)))
        entitle(fig, data, more=f"read at the terminal {data.attrs['read_at']}")
    return fig
