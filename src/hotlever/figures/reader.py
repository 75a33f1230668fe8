"""Figures of a lever that reads its distance to a surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from hotlever.figures.style import COLOURS, axis_label, entitle, figure, marker

if TYPE_CHECKING:
    import xarray as xr

#: Curves of one panel, evenly chosen where there are more.
_CURVES = 6
#: What a curve is of, by its dimension.
_LABELS = {"distance": "{:.3g} µm", "bias": "{:.4g} V", "pressure": "{:.3g} mbar"}
#: A share of the noise that is drawn.
_COUNTS = 1e-3


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
    others = [name for name in _LABELS if name in data.sizes and name != along]
    points = [
        dict(zip(others, indices, strict=True))
        for indices in np.ndindex(*(data.sizes[name] for name in others))
    ]
    chosen = np.unique(np.linspace(0, len(points) - 1, min(_CURVES, len(points))).round())
    curves = [data.isel(points[int(number)]) for number in chosen]
    best = data.isel(data.resolution_nm_per_rtHz.argmin(...))
    of_best = data.sel({name: best[name].item() for name in others})
    mark = f"{marker(data, along)}-"
    with figure(8.2, 5.6, 2, 2, letters=True) as (made, ((voltage, slope), (noise, resolution))):
        for curve, colour in zip(curves, COLOURS, strict=False):
            label = ", ".join(_LABELS[name].format(curve[name].item()) for name in others)
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
            if (part**2 > _COUNTS * of_best.noise_V_per_rtHz**2).any():
                noise.plot(of_best[x_name], 1e9 * part, mark, label=source)
        at = ", ".join(_LABELS[name].format(best[name].item()) for name in others)
        noise.set(ylabel=f"noise at {at} (nV/√Hz)", yscale="log")
        noise.legend(fontsize=7)
        if len(curves) > 1:
            slope.legend(fontsize=7)
        for axes in (voltage, slope, noise, resolution):
            axes.set(xlabel=axis_label(x_name))
        for axes in (slope, noise, resolution):
            for which in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
                which(_Plain(minor_thresholds=(2, 0.5)))
        entitle(made, data, more=f"read at the terminal {data.attrs['read_at']}")
    return made
