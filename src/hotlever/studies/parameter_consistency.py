"""Do levers of one material give the same parameters? The paper's Table II, on simulated twins.

Levers of different geometry and one material are measured as the paper's were (current, reader
voltage and Raman temperatures over a ramp of the bias), and each is fitted by itself with the
drawing's dimensions. What the levers have and the model has not (`ERRORS`) is taken up by the
parameters, by each lever in its own way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.estimate import Measurement, fit
from hotlever.estimate.experiment import ExperimentAtRest
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.spieser2017 import HOTTEST_TIP_K, NOMINAL_DOPING, PUBLISHED_VALUES, RAMP
from hotlever.studies.simulation_based_calibration import (
    LaboratoryOptions,
    MinimosMaterial,
    some_tip,
    values_from_priors,
)
from hotlever.types import Array, Progress
from hotlever.work import each

#: What each twin has in place of the reference probe's dimensions (µm).
GEOMETRIES: dict[str, dict[str, float]] = {
    "reference probe": {},
    "70 µm long": {"length_um": 70.0},
    "legs 4.5 and 5 µm wide": {"centre_leg_width_um": 4.5, "outer_leg_width_um": 5.0},
    "heater of 5 µm": {"heater_length_um": 5.0},
    "heater 2.5 µm wide": {"heater_width_um": 2.5},
    "42 µm long": {"length_um": 42.0},
}
#: Of `simulation_based_calibration.DEPARTURES`, by what is said of them; all of them come last.
ERRORS: dict[str, tuple[str, ...]] = {
    "none": (),
    "mobility": ("mobility",),
    "tip": ("tip",),
    "drawing": ("drawing",),
    "thermometer": ("thermometer",),
    "all": ("mobility", "tip", "drawing", "thermometer"),
}
#: Ways of fitting the doping.
FREE, HELD = "n_d free", "n_d held"


def consistency_study(
    probe: Probe,
    geometries: Mapping[str, Mapping[str, float]] = GEOMETRIES,
    errors: Sequence[str] = tuple(ERRORS),
    *,
    laboratory: LaboratoryOptions | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Fit twins of a probe, each by itself, with errors of the model and without.

    Parameters
    ----------
    probe : Probe
        Three-legged, of the material that all twins have.
    geometries : mapping of str to mapping of str to float
        Dimensions of each twin that differ from the probe's.
    errors : sequence of str
        Of `ERRORS`.
    laboratory : LaboratoryOptions, optional
        How twins are measured.
    progress : callable, optional
        Called with the fits done and their number.

    Returns
    -------
    xarray.Dataset
        ``value`` on ``error``, ``doping`` (`FREE`, `HELD` at the wafer's nominal one, as the paper
        has it too), ``lever`` and ``parameter``; ``true_value`` on ``parameter``.

    Raises
    ------
    ComputationError
        If a lever could not be solved or fitted.
    """
    ways: dict[str, dict[str, Any]] = {FREE: {}, HELD: {"fixed": {"n_d": NOMINAL_DOPING}}}
    shape = len(errors), len(ways), len(geometries), len(PARAMETERS)
    values, cases = np.empty(shape), list(np.ndindex(shape[0], shape[2]))
    for error, number in each(cases, progress):
        nominal = probe.with_(**list(geometries.values())[number])
        lever = SimilarLevers(Lever(nominal, COARSE))
        random = np.random.default_rng(number)
        data = twin_measurement(nominal, ERRORS[errors[error]], random, laboratory)
        for way, choice in enumerate(ways.values()):
            fitted = fit(data, nominal, model=partial(_experiment, lever), **choice).probe.material
            values[error, way, number] = [getattr(fitted, name) for name in PARAMETERS]
    return labelled(
        {
            "value": (("error", "doping", "lever", "parameter"), values),
            "true_value": ("parameter", [getattr(probe.material, name) for name in PARAMETERS]),
        },
        coordinates={
            "error": list(errors),
            "doping": list(ways),
            "lever": list(geometries),
            "parameter": list(PARAMETERS),
        },
    )


def _experiment(lever: SimilarLevers, _: Probe, bias: Array) -> ExperimentAtRest:
    """Return a lever as forward model, as it is, on the mesh of what is measured."""
    return ExperimentAtRest(lever, None, bias, tuple(PARAMETERS))


def twin_measurement(
    nominal: Probe,
    departures: Sequence[str],
    rng: np.random.Generator,
    laboratory: LaboratoryOptions | None = None,
) -> Measurement:
    """Return what is measured of a lever that departs from its nominal one.

    All levers are heated to the temperature of the paper's hottest tip.
    """
    true = nominal
    if "drawing" in departures:
        own = values_from_priors(nominal, rng)
        true = true.with_(**{name: own[name] for name in nominal.shape.dimensions() if name in own})
    if "tip" in departures:
        true = true.model_copy(update={"tip": some_tip(rng)})
    if "mobility" in departures:
        true = true.with_material("material", MinimosMaterial)
    lever = Lever(true, COARSE)
    highest = float(lever.branch().bias(HOTTEST_TIP_K, true.circuit))
    sweep = lever.sweep(np.linspace(RAMP[0], highest, len(RAMP)))

    def noisy(values: Array, share: float) -> Array:
        return np.asarray(values * (1.0 + share * rng.standard_normal(len(RAMP))))

    laboratory, base = laboratory or LaboratoryOptions(), true.circuit.base_temperature_K
    alone, common = laboratory.raman_errors
    scale = 1.0 + common * rng.standard_normal() * ("thermometer" in departures)
    return Measurement(
        sweep.bias.values,
        noisy(sweep.current_mA.values, laboratory.noise),
        noisy(sweep.reader_V.values, laboratory.noise),
        base + scale * noisy(sweep.tip_K.values - base, alone),
        np.full(len(RAMP), np.nan),
    )


def published_levers() -> xr.Dataset:
    """Return the parameters of the paper's four levers (Table II), as `consistency_study` does."""
    suffixes = {FREE: "", HELD: ", n_d fixed"}
    levers = [f"lever {number}" for number in range(1, 5)]
    values = [
        [list(PUBLISHED_VALUES[lever + suffix].values()) for lever in levers]
        for suffix in suffixes.values()
    ]
    coordinates = {"doping": list(suffixes), "lever": levers, "parameter": list(PARAMETERS)}
    return labelled({"value": (("doping", "lever", "parameter"), values)}, coordinates=coordinates)


def largest_deviation(study: xr.Dataset) -> xr.DataArray:
    """Return how far the levers are at most from their mean, as a share of it, by parameter."""
    return (abs(study.value / study.value.mean("lever") - 1.0)).max("lever")
