"""Figures of a lever: its drawing, its fields, and what a sweep gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.tri import Triangulation

from hotlever.calibration.power_law import EQ12, PowerLaw
from hotlever.colours import HEAT
from hotlever.figures.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    MEASURED,
    ORANGE,
    SKY,
    VERMILION,
    figure,
    from_zero,
)
from hotlever.materials import HIGH_DOPED
from hotlever.probe import Layout, ProbeMesh, Region
from hotlever.spieser2017 import BASE_TEMPERATURE_K, POWER_LAW_SPREAD_K, PublishedPoint

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.fields import FieldMap


#: Characters of a title that have room above a drawing.
_TITLE = 90
#: Most of the lever that is magnified, as a share of its length.
_MAGNIFIED = 0.3
#: Length of a terminal's name over the height of a drawing.
_NAME = 0.33


def _marker(sweep: xr.Dataset, marker: str = "o") -> str:
    """Mark the points of a sweep, unless they are so many that they hide the line."""
    return marker if sweep.sizes["bias"] <= 40 else ""


def _patch(region: Region, **style: Any) -> PathPatch:
    """Return a region as it is drawn, its holes left out."""
    rings = [Path([*ring, ring[0]], closed=True) for ring in region.rings]
    return PathPatch(Path.make_compound_path(*rings), **style)


def probe_drawing(layout: Layout, title: str = "", *, mesh: ProbeMesh | None = None) -> Figure:
    """Draw a probe from above, with heater, reader, terminals and tip marked, or its mesh too."""
    with figure(7.0, 3.4) as (made, axes):
        handles: dict[str, Patch | Line2D] = {}
        for region in layout.regions:
            colour, label = _shown_as(region)
            axes.add_patch(_patch(region, facecolor=colour, edgecolor="0.55", lw=0.6))
            handles.setdefault(label, Patch(facecolor=colour, edgecolor="0.55", label=label))
        if mesh is not None:
            x, y = mesh.elements.p
            axes.triplot(Triangulation(x, y, mesh.elements.t.T), color="0.25", lw=0.25)
        middle, labelled = layout.box.mean(axis=0), set[tuple[int, bool]]()
        for name, edges in groupby(layout.terminals, lambda terminal: terminal.name):
            ends = np.array([(edge.start, edge.end) for edge in edges])
            axes.plot(*ends.T, color=BLUE, lw=4, solid_capstyle="butt")
            at = ends.mean(axis=(0, 1))
            # away from the middle of the lever, along the nearer axis
            along = int(np.argmax(np.abs(at - middle) / np.ptp(layout.box, axis=0)))
            low = bool(at[along] < middle[along])
            labelled.add((along, low))
            shift = [0, 0]
            shift[along] = -8 if low else 8
            beside: Any = {"xytext": shift, "textcoords": "offset points", "color": BLUE}
            if along == 0:
                beside |= {"ha": "right" if low else "left", "va": "center"}
            else:
                beside |= {"ha": "center", "va": "top" if low else "bottom"}
            axes.annotate(name, at, **beside)
        handles["terminal"] = Line2D([], [], color=BLUE, lw=4, label="terminal (base temperature)")
        (tip,) = axes.plot(*layout.tip, marker="^", color=BLACK, ls="none", label="tip")
        handles["tip"] = tip
        (left, bottom), (right, high) = layout.box
        margin = 0.04 * max(right - left, high - bottom)
        # beside a lever that is as wide as long names take more of its size
        name_um = max(5 * margin, _NAME * (high - bottom))
        beyond = {True: name_um, False: margin}
        axes.set_xlim(left - beyond[(0, True) in labelled], right + beyond[(0, False) in labelled])
        beyond[True] = 5 * margin
        axes.set_ylim(bottom - beyond[(1, True) in labelled], high + beyond[(1, False) in labelled])
        axes.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)")
        if title:
            lines = "\n".join(wrap(title, _TITLE))
            made.suptitle(lines, x=0.01, ha="left", fontsize=9, parse_math=False)
        made.legend(handles=list(handles.values()), loc="outside lower center", ncols=3)
    return made


def _shown_as(region: Region) -> tuple[str, str]:
    """Return colour and label of a region in a drawing of its probe."""
    heats = region.part == "heater"
    if region.insulates:
        return "0.93", f"{region.stack[-1].material} (insulates)"
    if region.films:
        top = region.films[-1].material
        return (VERMILION, f"heater ({top})") if heats else (ORANGE, top)
    if region.taper is not None:
        name = "heater" if heats else "reader"
        return VERMILION if heats else SKY, f"{name} (low-doped)"
    material = region.stack[0].material
    label = "high-doped silicon" if material == HIGH_DOPED else material
    return (VERMILION, f"heater ({label})") if heats else ("0.82", label)


def outlines(axes: Axes, layout: Layout) -> None:
    """Draw the regions and the tip of a lever over a map of it."""
    for region in layout.regions:
        axes.add_patch(_patch(region, fill=False, edgecolor="0.45", lw=0.4))
    axes.plot(*layout.tip, marker="^", mfc="white", mec="black", ms=4)
    axes.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)")
    axes.grid(False)


def field_maps(fields: FieldMap, layout: Layout, title: str = "") -> Figure:
    """Draw temperature, potential and current density, whole lever and magnified heater."""
    mesh = Triangulation(fields.points[:, 0], fields.points[:, 1], fields.triangles)
    density = np.linalg.norm(fields.current_density, axis=1)
    strong = max(density.max(), 1e-9)
    density = np.maximum(density, strong * 1e-3)
    maps = (
        ("temperature (K)", fields.temperature, HEAT, None),
        ("potential (V)", fields.potential, "viridis", None),
        ("current density (mA/µm²)", density, "cividis", LogNorm(strong * 1e-3, strong)),
    )
    what, size, centre = "heater", layout.heater.sides.max(), layout.heater.box.mean(axis=0)
    most = _MAGNIFIED * np.ptp(layout.box, axis=0).max()
    if size > most:  # where all of the conductor heats
        what, size, centre = "tip", most, np.array(layout.tip)
    with figure(7.0, 6.8, 3, 2, width_ratios=(1.75, 1.0)) as (made, grid):
        for row, (label, values, colours, norm) in zip(grid, maps, strict=True):
            shading = "gouraud" if values.size == len(fields.points) else "flat"
            style: Any = {"cmap": colours, "norm": norm, "shading": shading, "rasterized": True}
            for axes in row:
                image = axes.tripcolor(mesh, values, **style)
                outlines(axes, layout)
            row[1].set_xlim(centre[0] + np.array([-0.85, 0.85]) * size)
            row[1].set_ylim(centre[1] + np.array([-0.65, 0.65]) * size)
            made.colorbar(image, ax=row[1], label=label, extend="min" if norm else "neither")
        grid[0, 0].set_title(title)
        grid[0, 1].set_title(f"{what}, magnified")
    return made


def sweep_overview(sweep: xr.Dataset) -> Figure:
    """Draw what a sweep gives against the bias: current, voltages, tip temperature, I-V."""
    with figure(7.4, 5.2, 2, 2, letters=True) as (made, grid):
        current, voltage, tip, iv = grid.ravel()
        current.plot(sweep.bias_V, sweep.current_mA, "o-", color=BLUE)
        current.set(ylabel="heater current I$_h$ (mA)")
        terminals = [name for name in map(str, sweep.data_vars) if name.endswith("_mA")]
        others = [name for name in terminals if name not in ("current_mA", "ground_current_mA")]
        for name, colour in zip(others, COLOURS[1:], strict=False):
            label = f"at {name.removesuffix('_mA')}"
            current.plot(sweep.bias_V, sweep[name], "s-", color=colour, label=label)
        if others:
            current.lines[0].set_label("I$_h$, swept supply")
            current.set(ylabel="current into the lever (mA)")
            current.legend()
        voltage.plot(sweep.bias_V, sweep.lever_V, "o-", color=BLUE, label="lever V$_l$")
        if sweep.reader_V.notnull().any():
            voltage.plot(sweep.bias_V, sweep.reader_V, "s-", color=GREEN, label="reader V$_r$")
        voltage.set(ylabel="voltage (V)")
        voltage.legend()
        tip.plot(sweep.bias_V, sweep.tip_K, "o-", color=VERMILION)
        tip.set(ylabel="tip temperature (K)")
        iv.plot(sweep.lever_V, sweep.current_mA, "o-", color=BLUE)
        iv.set(xlabel="lever voltage V$_l$ (V)", ylabel="heater current I$_h$ (mA)")
        for axes in (current, voltage, tip):
            axes.set(xlabel="bias V$_b$ (V)")
    return made


def iv_curves(
    sweeps: Mapping[str, xr.Dataset],
    knees: Mapping[str, xr.Dataset] | None = None,
    measured: xr.Dataset | None = None,
    published: Sequence[PublishedPoint] = (),
) -> Figure:
    """Draw heater current against lever voltage (paper's Figs. 6a and 10a), with the knees.

    Parameters
    ----------
    sweeps : mapping of str to xarray.Dataset
        By label; those of more than 40 biases as lines alone.
    knees : mapping of str to xarray.Dataset, optional
        By label of a sweep and in their order, the one state returned by `Lever.knee`.
    measured : xarray.Dataset, optional
        From `Measurement.dataset`.
    published : sequence of `hotlever.spieser2017` operating points, optional
    """
    with figure(4.8, 3.6) as (made, axes):
        for (name, sweep), colour in zip(sweeps.items(), COLOURS, strict=False):
            marker: Any = _marker(sweep) or "-"
            axes.plot(sweep.lever_V, sweep.current_mA, marker, color=colour, label=name)
        if measured is not None:
            axes.plot(measured.lever_V, measured.current_mA, **MEASURED)
        for (name, knee), colour in zip((knees or {}).items(), COLOURS, strict=False):
            seen = f"knee{'' if len(sweeps) < 2 else f' in {name}'}: {knee.tip_K.item():.0f} K"
            seen += f", {knee.lever_V.item():.2f} V, {knee.current_mA.item():.2f} mA"
            axes.plot(knee.lever_V, knee.current_mA, "D", ms=6, color=colour, label=seen)
        for place, point in enumerate(published):
            label = None if place else "published operating points"
            ring: Any = {"mfc": "none", "mec": VERMILION, "ms": 9, "ls": "none", "label": label}
            axes.plot(point.lever_V, point.current_mA, "o", **ring)
            at: Any = {"xytext": (-4, -13), "textcoords": "offset points", "ha": "right"}
            axes.annotate(point.name, (point.lever_V, point.current_mA), fontsize=8, **at)
        axes.set(xlabel="lever voltage V$_l$ (V)", ylabel="heater current I$_h$ (mA)")
        shown = [*sweeps.values(), *([] if measured is None else [measured])]
        volts, currents = (
            np.concatenate([one[name].values for one in shown])
            for name in ("lever_V", "current_mA")
        )
        axes.set(xlim=from_zero(volts), ylim=from_zero(currents))
        axes.legend(loc="upper left")
    return made


def temperature_power(
    sweep: xr.Dataset,
    law: PowerLaw = EQ12,
    measured: xr.Dataset | None = None,
    base_temperature_K: float = BASE_TEMPERATURE_K,
) -> Figure:
    """Draw tip temperature against power beside the power law (paper's Fig. 6b)."""

    def expected(power: Any) -> np.ndarray:
        return law.tip_temperature(power, base_temperature_K)

    with figure(4.6, 4.6, 2, 1, sharex=True, height_ratios=(2.2, 1.0)) as (made, (axes, below)):
        power = np.linspace(0, float(sweep.power_mW.max()) * 1.03, 800)
        jump = np.searchsorted(power, law.threshold_mW)
        for part, label in ((slice(0, jump), "power law, Eq. 12"), (slice(jump, None), None)):
            axes.plot(power[part], expected(power[part]), "--", color=ORANGE, label=label)
        style: Any = {"color": BLUE, "marker": _marker(sweep)}
        axes.plot(sweep.power_mW, sweep.tip_K, label="model", **style)
        below.plot(sweep.power_mW, sweep.tip_K - expected(sweep.power_mW), **style)
        if measured is not None:
            axes.plot(measured.power_mW, measured.tip_K, **MEASURED)
            below.plot(measured.power_mW, measured.tip_K - expected(measured.power_mW), **MEASURED)
        below.axhspan(-POWER_LAW_SPREAD_K, POWER_LAW_SPREAD_K, color="0.92", zorder=0)
        below.axhline(0, color="0.4", lw=0.8)
        below.set(xlabel="power P$_l$ (mW)", ylabel="T$_{tip}$ − law (K)", xlim=(0, None))
        axes.set(ylabel="tip temperature (K)")
        axes.legend(loc="upper left")
        where: Any = {"xycoords": "axes fraction", "color": "0.4", "fontsize": 8}
        below.annotate(f"±{POWER_LAW_SPREAD_K:.0f} K", (0.02, 0.06), **where)
    return made


def resistances(sweep: xr.Dataset) -> Figure:
    """Draw heater, leg and total resistance against tip temperature (paper's Fig. 5)."""
    with figure(4.2, 3.4) as (made, axes):
        for name, label, colour, marker in (
            ("lever_ohm", "lever, total", BLACK, "s"),
            ("heater_ohm", "heater R$_h$", VERMILION, "o"),
            ("legs_ohm", "legs R$_{l1}$ + R$_{l2}$", BLUE, "^"),
        ):
            style: Any = {"color": colour, "marker": _marker(sweep, marker), "label": label}
            axes.plot(sweep.tip_K, sweep[name] / 1000, **style)
        axes.set(xlabel="tip temperature (K)", ylabel="resistance (kΩ)", ylim=(0, None))
        axes.legend()
    return made


def doping_profile(profile: xr.Dataset) -> Figure:
    """Draw doping and local inversion temperature along the heater (paper's Fig. 7a)."""
    with figure(4.6, 3.4) as (made, axes):
        axes.semilogy(profile.position, profile.doping, color=BLUE)
        axes.set(xlabel="position along the heater (µm)")
        axes.set_ylabel("doping concentration (cm⁻³)", color=BLUE)
        right = axes.twinx()
        right.plot(profile.position, profile.inversion_temperature, "--", color=VERMILION)
        right.set_ylabel("inversion temperature (K)", color=VERMILION)
        right.spines["right"].set_visible(True)
        right.grid(False)
    return made


def heater_profiles(profiles: Mapping[str, xr.Dataset]) -> Figure:
    """Draw local resistivity and temperature along the heater (paper's Fig. 7b).

    Solid where dρ/dT > 0, dashed where it is negative.

    Parameters
    ----------
    profiles : mapping of str to xarray.Dataset
        From `heater_profile`, by the name of the operating point.
    """
    with figure(5.2, 5.2, 2, 1, sharex=True) as (made, (upper, lower)):
        for (name, profile), colour in zip(profiles.items(), COLOURS, strict=False):
            position, rho = profile.position.values, profile.resistivity.values
            metallic = profile.resistivity_slope.values > 0
            upper.plot(position, np.where(metallic, rho, np.nan), color=colour)
            # let the dashed part reach the solid one
            inverted = ~metallic | ~np.roll(metallic, 1) | ~np.roll(metallic, -1)
            if not metallic.all():
                upper.plot(position, np.where(inverted, rho, np.nan), "--", color=colour)
            seen = f"{profile.attrs['lever_V']:.2f} V, {profile.attrs['current_mA']:.2f} mA"
            lower.plot(position, profile.temperature, color=colour, label=f"{name}: {seen}")
        upper.set(ylabel="resistivity (Ω cm)", ylim=(0, None))
        solid = Line2D([], [], color="0.3", label="dρ/dT > 0")
        dashed = Line2D([], [], color="0.3", ls="--", label="dρ/dT < 0")
        upper.legend(handles=[solid, dashed], loc="upper right")
        lower.set(xlabel="position along the heater (µm)", ylabel="temperature (K)")
        low, high = lower.get_ylim()
        lower.set_ylim(low, high + 0.35 * (high - low))
        lower.legend(loc="upper left")
    return made
