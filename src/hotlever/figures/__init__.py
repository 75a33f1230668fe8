"""All of hotlever's figures on one shelf, each drawn from what the package returns.

Nothing is solved here: datasets and results go in, a matplotlib figure comes out. `save_figure`
writes one as PNG, SVG or PDF.
"""
# ruff: noqa: F401 (what is imported here is what the shelf offers)

from hotlever.figures.air import air_loss, disc_between_planes, scale_factor, temperature_slices
from hotlever.figures.calibration import (
    calibrated_levers,
    calibration_curves,
    judged_calibrations,
)
from hotlever.figures.claims import (
    knee_discrepancy,
    linear_branches,
    parameter_deviations,
    radiated_shares,
    thermoelectric_shift,
)
from hotlever.figures.contact import contact_overview
from hotlever.figures.datasets import figure_of
from hotlever.figures.design import design_optimum, design_study
from hotlever.figures.drawing import outlines_drawing, probe_drawing
from hotlever.figures.fit import (
    correlation_matrix,
    data_and_model,
    lever_parameters,
    posterior_corner,
    profile_curves,
    tip_band,
)
from hotlever.figures.holding import gain_map, held_states
from hotlever.figures.lever import (
    doping_profile,
    heater_profiles,
    iv_curves,
    material_curves,
    resistances,
    sweep_overview,
    temperature_power,
)
from hotlever.figures.maps import field_maps, pulse_film, save_film, temperature_map
from hotlever.figures.planning import planned_measurements
from hotlever.figures.raman import one_spectrum, raman_check, thermometry
from hotlever.figures.reader import reader_overview
from hotlever.figures.style import save_figure
from hotlever.figures.transient import harmonics, history_overview, small_signals
from hotlever.figures.validation import predicted_and_published, residuals_of_current
