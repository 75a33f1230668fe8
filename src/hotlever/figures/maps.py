"""Maps of a lever and of the air around it: fields, heat flux, and temperature in time as a film.

States come from `hotlever.lever.lever.Lever.solve`, or from the ``callback`` of
`hotlever.lever.transient.simulate`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection, TriMesh
from matplotlib.colors import LogNorm, SymLogNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from PIL import Image

from hotlever.air.panels import Panels
from hotlever.errors import InputError
from hotlever.figures.probe_figures import outlines
from hotlever.figures.style import (
    BLACK,
    COLOURS,
    HEAT,
    STYLE,
    VERMILION,
    axis_label,
    beside,
    curve,
    entitle,
    figure,
    settled,
)
from hotlever.files import FILM_TYPES, whole_file
from hotlever.lever.fields import Surface, mapped_fields, seen_from_above
from hotlever.probe import Layout
from hotlever.types import Array, Progress

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.lever import Lever, State

#: Frames of a film per second.
_PER_SECOND = 20


def field_maps(state: State) -> Figure:
    """Draw temperature, potential and current density, whole lever and magnified heater.

    Parameters
    ----------
    state : State
        Of a flat lever.

    Raises
    ------
    InputError
        If it is one of a `SolidLever`.
    """
    (fields,), layout = mapped_fields(state.lever, [state]), state.lever.probe.layout()
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
    # no more than this of the lever is magnified
    most = 0.3 * np.ptp(layout.box, axis=0).max()
    if size > most:  # where all of the conductor heats
        what, size, centre = "tip", most, np.array(layout.tip)
    with figure(7.0, 6.8, 3, 2, width_ratios=(1.75, 1.0)) as (fig, grid):
        for row, (label, values, colours, norm) in zip(grid, maps, strict=True):
            shading = "gouraud" if values.size == len(fields.points) else "flat"
            style: Any = {"cmap": colours, "norm": norm, "shading": shading, "rasterized": True}
            for axes in row:
                image = axes.tripcolor(mesh, values, **style)
                outlines(axes, layout)
            row[1].set_xlim(centre[0] + np.array([-0.85, 0.85]) * size)
            row[1].set_ylim(centre[1] + np.array([-0.65, 0.65]) * size)
            fig.colorbar(image, ax=row[1], label=label, extend="min" if norm else "neither")
        grid[0, 1].set_title(f"{what}, magnified")
        fig.suptitle(_title(state), x=0.01, ha="left")
    return fig


def temperature_map(state: State) -> Figure:
    """Draw the temperature of a lever from above, with its tip and its hottest place.

    Parameters
    ----------
    state : State
        Of a flat lever, or of a `SolidLever`, whose upper side is drawn.
    """
    surface = seen_from_above(state.lever)
    T = surface.sampling @ state.nodal[0]
    hottest = surface.points[T.argmax()]
    with figure(7.0, _height(state.lever) + 0.4) as (fig, axes):
        _map(axes, state.lever, surface, T, (state.lever.circuit.base_temperature_K, T.max()))
        style: Any = {"ls": "none", "marker": "x", "color": "black", "ms": 5}
        axes.plot(*hottest, label=f"hottest, {T.max():.0f} K", **style)
        fig.legend(loc="outside lower center", ncols=2)
        fig.suptitle(_title(state), x=0.01, ha="left")
    return fig


def air_loss(
    layout: Layout, panels: Panels, flux: Array, shares: xr.Dataset, title: str = ""
) -> Figure:
    """Draw the heat flux from the top face, and heat into air by region along a sweep.

    Parameters
    ----------
    layout : Layout
    panels : Panels
    flux : ndarray, shape (len(panels),)
        mW/µm², of one state.
    shares : xarray.Dataset
        See `hotlever.lever.fields.AirFields.shares`.
    title : str
        Of the map.
    """
    heights = panels.corners[..., 2]
    top = heights.min(axis=1) > heights.max() * (1 - 1e-9)
    values = 1e3 * flux[top]
    strongest = float(np.abs(values).max())
    with figure(7.0, 6.0, 2, 1, height_ratios=(1.5, 1.0), letters=True) as (fig, (upper, lower)):
        scale = SymLogNorm(0.01 * strongest, vmin=-strongest, vmax=strongest)
        style: Any = {"cmap": "RdBu_r", "norm": scale, "edgecolors": "face", "linewidths": 0.2}
        cells = PolyCollection(list(panels.corners[top][:, :, :2]), array=values, **style)
        cells.set_rasterized(True)
        upper.add_collection(cells)
        outlines(upper, layout)
        upper.autoscale_view()
        label = "heat flux from the top (µW/µm²)"
        # powers of ten that the linear middle of the scale does not press together
        powers = 10.0 ** np.arange(np.ceil(np.log10(0.02 * strongest)), np.log10(strongest))
        ticks = [*-powers[::-1], 0.0, *powers]
        bar: dict[str, Any] = {"location": "bottom", "shrink": 0.8, "aspect": 40, "ticks": ticks}
        fig.colorbar(cells, ax=upper, label=label, **bar)
        upper.set_title(title, loc="right")
        colours = [colour for colour in COLOURS if colour != BLACK] + ["0.5"]
        names = shares.region.values.tolist()
        for name, colour in zip(names, cycle(colours), strict=False):
            share = 100 * shares.air_heat_mW.sel(region=name) / shares.power_mW
            lower.plot(shares.tip_K, share, label=name, color=colour, marker=".")
        whole = 100 * shares.air_heat_mW.sum("region") / shares.power_mW
        lower.plot(shares.tip_K, whole, color=BLACK, ls="--", label="whole lever")
        lower.axhline(0.0, color="0.6", lw=0.6)
        lower.set(xlabel=axis_label("tip_K"), ylabel="share of the power\nlost to air (%)")
        beside(lower)
        entitle(fig, shares)
    return fig


def temperature_slices(slices: xr.Dataset) -> Figure:
    """Draw the temperature of the air along and across a lever, far and near.

    Parameters
    ----------
    slices : xarray.Dataset
        From `hotlever.lever3d.temperature_slices`.
    """
    base, tip = slices.attrs["base_K"], slices.attrs["tip_K"]
    # isotherms at these rises above the base temperature, as shares of the tip's
    shares = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)
    levels = [base + share * (tip - base) for share in shares]
    with figure(7.2, 6.4, 2, 2, letters=True) as (fig, grid):
        for axes, name in zip(grid.ravel(), slices.slice.values, strict=True):
            cut = slices.sel(slice=name)
            at: Any = (cut.along_um, cut.z_um, cut.temperature)
            image = axes.pcolormesh(*at, cmap=HEAT, vmin=base, vmax=tip, rasterized=True)
            lines = axes.contour(*at, levels=levels, colors="white", linewidths=0.5)
            axes.clabel(lines, fmt="%.0f", fontsize=6)
            axes.set(aspect="equal", xlabel=f"{cut.axis.item()} (µm)", ylabel="z (µm)")
            axes.grid(False)
            axes.set_title(name, loc="center")
        fig.colorbar(image, ax=grid, label="temperature (K)", shrink=0.7)
        entitle(fig, slices, more=f"bias {slices.attrs['bias_V']:.3g} V, tip at {tip:.0f} K")
    return fig


def pulse_film(history: xr.Dataset, states: Sequence[tuple[float, State]]) -> FuncAnimation:
    """Animate a lever in time: a map of its temperature above the trace of the tip.

    Parameters
    ----------
    history : xarray.Dataset
        From `hotlever.lever.transient.simulate`.
    states : sequence of (float, State)
        A frame each: the time (µs) and the state there, such as its ``callback`` is given.

    Returns
    -------
    matplotlib.animation.FuncAnimation
        For `save_film`, or for a notebook (``to_jshtml``).

    Raises
    ------
    InputError
        If there are no states.

    Examples
    --------
    >>> from hotlever import Lever, Probe, simulate
    >>> from hotlever.lever.transient import pulse
    >>> states = []
    >>> history = simulate(
    ...     Lever(Probe.reference()),
    ...     pulse(10.0, 5.0),
    ...     at=[2.0, 5.0, 8.0],
    ...     callback=lambda t, state: states.append((t, state)),
    ... )
    >>> save_film(pulse_film(history, states), "pulse.gif")  # doctest: +SKIP
    """
    if not states:
        raise InputError("found no states, expected one for each frame of a film")
    lever = states[0][1].lever
    surface = seen_from_above(lever, 1)
    frames = np.array([surface.sampling @ state.nodal[0] for _, state in states], dtype=np.float32)
    limits = lever.circuit.base_temperature_K, float(frames.max())
    data = history.isel(time=history.time > 0) if settled(history) else history
    bias = np.interp([t for t, _ in states], history.time, history.bias_V)
    high = _height(lever), 2.2
    with figure(7.0, sum(high), 2, 1, height_ratios=high) as (fig, (above, below)):
        image = _map(above, lever, surface, frames[-1], limits)
        curve(below, data, "time", "tip_K", color=VERMILION)
        if settled(history):
            below.set_xscale("log")
        (now,) = below.plot([], [], "o", color="black", ms=6)
        fig.suptitle(f"{lever.probe.title}, {history.attrs['waveform']}", x=0.01, ha="left")
        at = above.set_title(f"{states[-1][0]:.4g} µs")
        fig.set_dpi(100)
        fig.draw_without_rendering()
        fig.set_layout_engine("none")  # from here on nothing but the state changes
        # outlines are over the temperature
        for artist in (image, *above.patches, *above.lines, at, now):
            artist.set_animated(True)

    def show(frame: int) -> tuple[Any, ...]:
        t, state = states[frame]
        image.set_array(frames[frame])
        now.set_data([t], [state.tip_K])
        at.set_text(f"{t:.4g} µs: bias {bias[frame]:.3g} V, tip at {state.tip_K:.1f} K")
        return image, now, at

    return FuncAnimation(fig, show, frames=len(states), interval=1000 / _PER_SECOND)


def save_film(
    film: FuncAnimation, path: str | os.PathLike[str], progress: Progress | None = None
) -> None:
    """Write a film as GIF, whole or not at all.

    Parameters
    ----------
    film : FuncAnimation
        From `pulse_film`.
    path : path
    progress : callable, optional
        Called with the frames drawn and their number.

    Raises
    ------
    InputError
        If the suffix is another, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FILM_TYPES:
        raise InputError(f"{path}: unknown film type '{suffix}', expected {FILM_TYPES[0]}")

    def report_frame(frame: int, frames: int) -> None:
        if progress is not None:
            progress(frame + 1, frames)

    with mpl.rc_context(STYLE), whole_file(path) as temporary:
        dpi: Any = "figure"  # that of its own
        film.save(temporary, _Writer(_PER_SECOND), dpi=dpi, progress_callback=report_frame)


class _Writer(PillowWriter):
    """Draws what moves over the rest, and writes frames in the same colours.

    Colours of their own would flicker, and all of a figure takes six times as long.
    """

    _frames: list[Image.Image]

    def setup(self, fig: Figure, outfile: str | Path, dpi: float | None = None) -> None:
        """Draw what stays."""
        super().setup(fig, outfile, dpi)
        before = fig.canvas
        self._canvas = FigureCanvasAgg(fig)
        self._canvas.draw()
        fig.set_canvas(before)  # which draws nothing by itself
        self._rest = self._canvas.copy_from_bbox(fig.bbox)
        self._moving = sorted(fig.findobj(Artist.get_animated), key=Artist.get_zorder)

    def grab_frame(self, **_: Any) -> None:
        """Draw a frame."""
        self._canvas.restore_region(self._rest)
        for artist in self._moving:
            artist.draw(self._canvas.get_renderer())
        self._frames.append(Image.fromarray(np.array(self._canvas.buffer_rgba())).convert("RGB"))

    def finish(self) -> None:
        """Write the film."""
        colours = Image.new("P", (1, 1))
        # those of the scale, and from black and that of the trace to white
        of_film = np.concatenate(
            [
                mpl.colormaps[HEAT](np.linspace(0.0, 1.0, 204))[:, :3],
                np.linspace((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 32),
                np.linspace(to_rgb(VERMILION), (1.0, 1.0, 1.0), 20),
            ]
        )
        colours.putpalette((255 * of_film).round().astype(np.uint8).tobytes())
        self._frames = [
            frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in self._frames
        ]
        super().finish()


def _height(lever: Lever) -> float:
    """Return how high (inches) axes of a lever are, with their labels."""
    length, width = np.ptp(lever.probe.layout().box, axis=0)
    return float(np.clip(5.2 * width / length + 0.9, 1.6, 6.0))


def _map(
    axes: Axes, lever: Lever, surface: Surface, T: Array, limits: tuple[float, float]
) -> TriMesh:
    """Draw temperatures (K) on a lever between some limits, with their scale."""
    mesh = Triangulation(surface.points[:, 0], surface.points[:, 1], surface.triangles)
    style: Any = {"cmap": HEAT, "shading": "gouraud", "rasterized": True}
    image = axes.tripcolor(mesh, T, vmin=limits[0], vmax=limits[1], **style)
    outlines(axes, lever.probe.layout())
    axes.figure.colorbar(image, ax=axes, label="temperature (K)")
    return image


def _title(state: State) -> str:
    return f"{state.lever.probe.title}, bias {state.bias_V:.3g} V, tip at {state.tip_K:.0f} K"
