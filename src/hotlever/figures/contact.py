"""Figures of a tip that touches a sample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from hotlever.colours import BLUE, HEAT, ORANGE, PURPLE, VERMILION
from hotlever.figures.style import axis_label, curve, figure, marker
from hotlever.probe import Probe

if TYPE_CHECKING:
    import xarray as xr

#: Heat (mW) that is none but for rounding.
_NONE_MW = 1e-9
#: Where things stand in the drawing, which is not to scale: half the widths of lever, base and
#: flat end, and heights.
_LEVER, _BASE, _END, _TOP, _DEPTH = 1.0, 0.52, 0.1, 1.25, 0.75


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
    with figure(9.6, 5.2) as (made, axes):
        axes.remove()
        grid = made.add_gridspec(3, 2, width_ratios=(1.15, 1.0))
        _draw(
            made.add_subplot(grid[:, 0]),
            data.isel({dimension: int(np.argmax(data.tip_K.values))}),
            probe,
        )
        temperature, heat, current = (made.add_subplot(grid[row, 1]) for row in range(3))
        curve(temperature, data, along, "tip_K", mark, color=VERMILION, label="tip at the lever")
        curve(temperature, data, along, "apex_K", mark, color=PURPLE, label="apex")
        temperature.set(ylabel="temperature (K)")
        temperature.legend()
        through = ("sample_mW", ORANGE, "through the contact"), ("beside_mW", BLUE, "through air")
        for name, colour, label in through[: 1 + bool((data.beside_mW > _NONE_MW).any())]:
            heat.plot(data[along], 1e3 * data[name], mark, color=colour, label=label)
        heat.set(ylabel="heat into the\nsample (µW)")
        heat.legend()
        current.plot(data[along], 1e3 * data.current_change_mA, mark, color=BLUE)
        current.set(ylabel="change of I$_h$\nat contact (µA)", xlabel=axis_label(along))
        for above in (temperature, heat):
            above.set(xlabel="")
            above.tick_params(labelbottom=False)
    return made


def _draw(axes: Axes, state: xr.Dataset, probe: Probe) -> None:
    """Draw lever, tip and sample of one state, coloured by temperature; not to scale."""
    tip, contact = probe.tip, probe.contact
    assert tip is not None
    assert contact is not None
    base = probe.circuit.base_temperature_K
    heat = mpl.colormaps[HEAT]
    scale = Normalize(base, max(float(state.tip_K), base + 1.0))

    def piece(corners: list[tuple[float, float]], T: float, **style: Any) -> None:
        axes.fill(*zip(*corners, strict=True), facecolor=heat(scale(T)), edgecolor="0.3", **style)

    hot, apex = float(state.tip_K), float(state.apex_K)
    piece([(-_LEVER, _TOP), (_LEVER, _TOP), (_LEVER, _TOP + 0.22), (-_LEVER, _TOP + 0.22)], hot)
    slices = 24
    for number in range(slices):
        low, high = number / slices, (number + 1) / slices
        # most of the fall is where the cone is narrow
        T = hot + (apex - hot) * (1.0 - low) ** 3
        left, right = (_END + (_BASE - _END) * share for share in (low, high))
        corners = [(-left, low), (left, low), (right, high), (-right, high)]
        piece([(x, _TOP * y) for x, y in corners], T, linewidth=0.0)
    axes.plot([-_BASE, -_END, _END, _BASE], [_TOP, 0.0, 0.0, _TOP], color="0.3", lw=0.8)
    layers = contact.layers
    for number, layer in enumerate(layers):
        top, bottom = (-_DEPTH * part / len(layers) for part in (number, number + 1))
        grey = str(0.78 + 0.16 * (number % 2))
        axes.fill_between([-_LEVER, _LEVER], bottom, top, facecolor=grey, edgecolor="0.3")
        thick = "" if layer.thickness_um is None else f", {1e3 * layer.thickness_um:.4g} nm"
        name = layer.material + thick
        axes.text(-0.95, (top + bottom) / 2.0, name, va="center", fontsize=8)

    def word(height: float, text: str) -> None:
        axes.text(_LEVER + 0.08, height, text, va="center", fontsize=8)

    word(_TOP + 0.11, f"heater: {hot:.0f} K")
    word(0.75 * _TOP, f"cone, {tip.height_um:g} µm: {_per_watt(state.tip_K_per_mW)}")
    word(0.36, f"apex: {apex:.0f} K")
    word(
        0.0,
        f"interface, r = {1e3 * tip.apex_radius_um:.4g} nm: {_per_watt(state.interface_K_per_mW)}",
    )
    word(-0.35 * _DEPTH, f"spreading: {_per_watt(state.spreading_K_per_mW)}")
    word(-_DEPTH, f"far away: {base:.0f} K")
    axes.annotate(
        "",
        (0.0, -0.5 * _DEPTH),
        (0.0, 0.62 * _TOP),
        arrowprops={"arrowstyle": "-|>", "color": "0.15", "lw": 1.2},
    )
    axes.text(0.04, -0.52 * _DEPTH, f"{1e3 * float(state.sample_mW):.3g} µW", fontsize=8, va="top")
    if float(state.beside_mW) > _NONE_MW:
        axes.text(-0.98, 0.25, f"air: {1e3 * float(state.beside_mW):.3g} µW", fontsize=8)
    axes.set(xlim=(-1.05, 2.55), ylim=(-_DEPTH - 0.1, _TOP + 0.35))
    axes.set_axis_off()
    axes.set_title(f"where it is hottest, at {float(state.bias_V):.4g} V (not to scale)")


def _per_watt(resistance: Any) -> str:
    """Return a thermal resistance (K/mW) as text."""
    value = 1e3 * float(resistance)
    return f"{value:.3g} K/W" if value > 0 else "none"
