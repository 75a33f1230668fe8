"""All of hotlever's figures on one shelf, each drawn from what the package returns.

Nothing is solved here: datasets and results go in, a matplotlib figure comes out. `save_figure`
writes one as PNG, SVG or PDF. What a dataset shows follows from what it holds, since each quantity
has one name everywhere.
"""
# ruff: noqa: F401 (what is imported here is what the shelf offers)

from __future__ import annotations

from collections.abc import Callable
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.errors import InputError
from hotlever.figures.claim_figures import (
    disc_between_planes,
    knee_carried,
    layouts_by_length,
    linear_branches,
    parameter_deviations,
    predicted_and_published,
    printed_statements,
    radiated_shares,
    residuals_of_current,
    scale_factor,
    thermoelectric_shift,
)
from hotlever.figures.estimate_figures import (
    calibrated_levers,
    calibration_curves,
    correlation_matrix,
    data_and_model,
    judged_calibrations,
    lever_parameters,
    planned_measurements,
    posterior_corner,
    profile_curves,
    tip_band,
)
from hotlever.figures.lever_figures import (
    contact_overview,
    doping_profile,
    harmonics,
    heater_profiles,
    held_states,
    history_overview,
    iv_curves,
    material_curves,
    reader_overview,
    resistances,
    small_signals,
    sweep_overview,
    temperature_power,
)
from hotlever.figures.maps import (
    air_loss,
    field_maps,
    pulse_film,
    save_film,
    temperature_map,
    temperature_slices,
)
from hotlever.figures.probe_figures import (
    design_optimum,
    design_study,
    outlines_drawing,
    probe_drawing,
)
from hotlever.figures.raman_figures import one_spectrum, raman_check, thermometry
from hotlever.figures.style import COLOURS, entitle, figure, save_figure, some_of
from hotlever.lever import probe_of

if TYPE_CHECKING:
    import xarray as xr


def figure_of(data: xr.Dataset) -> Figure:
    """Draw a dataset that the package has made; ``data.hotlever.plot()`` does the same.

    Parameters
    ----------
    data : xarray.Dataset
        A sweep, a history, a spectrum, a study, … has the figure that the command line draws. Of
        any other each quantity is drawn along its dimension.

    Raises
    ------
    InputError
        If it holds no curve.
    """
    # the first counts for which a dataset holds all that is named
    figure_by_names = {
        "apex_K current_change_mA": lambda data: contact_overview(data, probe_of(data)),
        "state set_ohm tip_K": held_states,
        "state set_mW tip_K": held_states,
        "supplied_nJ air_stored_nJ bias_V lever_V reader_V tip_K": history_overview,
        "bias_V current_mA lever_V reader_V tip_K heater_ohm": sweep_overview,
        "dlnR_dz_per_um source_V_per_rtHz": reader_overview,
        "impedance_real_ohm tip_per_bias_deg": small_signals,
        "first_harmonic_V third_harmonic_V": harmonics,
        "doping inversion_temperature": doping_profile,
        "knee_K knee_mW knee_bias_V inversion_K": design_study,
        "temperature along_um z_um": temperature_slices,
        "paper_error reads_at_hottest": raman_check,
        "loss near far": disc_between_planes,
        "moved_nm share_nm": thermoelectric_shift,
        "effective_sample_size quantity": posterior_corner,
        "delta_chi_square parabola": lambda profile: profile_curves([profile]),
        "described birge_ratio": lever_parameters,
        "coverage largest_K": judged_calibrations,
        "current_mA tip_K tip_stderr_K lever_V": tip_band,
    }
    for names, draw in figure_by_names.items():
        if all(name in data.variables for name in names.split()):
            return draw(data)
    return _every_quantity(data)


def _every_quantity(data: xr.Dataset) -> Figure:
    """Draw each quantity along its dimension, with a curve for each value of another one."""
    drawn = {
        str(name): values
        for name, values in data.data_vars.items()
        if values.dtype.kind in "fi" and 1 <= values.ndim <= 2 and values.notnull().any()
    }
    drawn = dict(list(drawn.items())[:12])
    if not drawn:
        raise InputError("found a dataset without curves, expected one of the package")
    columns = min(len(drawn), 3)
    rows = -(-len(drawn) // columns)
    size = 3.2 * columns, 2.4 * rows
    with figure(*size, rows, columns, squeeze=False, letters=True) as (fig, grid):
        for axes, (name, values) in zip(grid.ravel(), drawn.items(), strict=False):
            _panel(axes, name, values)
        for axes in grid.ravel()[len(drawn) :]:
            axes.remove()
        entitle(fig, data)
    return fig


def _panel(axes: Axes, name: str, values: xr.DataArray) -> None:
    # the longest dimension is that of the curve
    along, *others = sorted(map(str, values.dims), key=lambda dim: -values.sizes[dim])
    curves = values.transpose(*others, along).values.reshape(-1, values.sizes[along])
    x = values[along] if values[along].dtype.kind in "fi" else np.arange(values.sizes[along])
    drawn = curves[:8]
    for number, curve in enumerate(drawn):
        label = f"{others[0]} {values[others[0]].values[number]}" if others else None
        axes.plot(x, curve, ".-", label=label, color=COLOURS[number % len(COLOURS)])
    axes.set(xlabel=_label(along, values[along]), ylabel=_label(name, values))
    if others:
        axes.legend(title=some_of(len(drawn), len(curves), "curves"))


def _label(name: str, values: xr.DataArray) -> str:
    meaning, unit = values.attrs.get("long_name", name), values.attrs.get("units", "1")
    return fill(meaning if unit == "1" else f"{meaning} ({unit})", 30)
