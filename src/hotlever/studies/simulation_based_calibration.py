"""Simulation-based calibration: how wrong calibrations are, and whether the stated errors hold.

A lever is drawn from the priors and solved with more physics than the model that calibrates it has,
so that its tip temperature is known. It differs from that model by `DEPARTURES`, in its material,
and in what its data suffer on the way. The calibration knows the drawing, the nominal doping, the
usual priors (`hotlever.probe.priors`), and the measured data. Beside it stand the paper's ways.

Over many levers the share of true temperatures inside a stated band, its coverage, is to be the
band's level of confidence (Talts et al., arXiv:1804.06788).

Do levers of one material give the same parameters (the paper's Table II)? Twins of different
geometry and one material are measured as the paper's levers were (current, reader voltage and Raman
temperatures over a ramp of the bias), and each is fitted by itself with the drawing's dimensions.
What they have and the model has not (`ERRORS`) is taken up by the parameters, by each in its own
way.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.errors import BranchEndError, HotleverError
from hotlever.estimate import Measurement, fit
from hotlever.estimate.estimator import calibrate
from hotlever.estimate.experiment import ExperimentAtRest
from hotlever.estimate.knee import IVCurve, curve_of_law, curve_of_model, find_knee
from hotlever.estimate.power_law import EQ12
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import LOW_DOPED, PARAMETERS, Material
from hotlever.materials.kinds import NSilicon
from hotlever.materials.laws import Evaluated
from hotlever.materials.silicon import (
    conductivity_low_doped,
    inversion_temperature,
    minimos_mobility,
)
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.priors import default_priors, draw_values, updated
from hotlever.probe.tip import Tip
from hotlever.spieser2017 import HOTTEST_TIP_K, NOMINAL_DOPING, PUBLISHED_VALUES, RAMP
from hotlever.text import BAND
from hotlever.types import Array, Progress
from hotlever.work import each

#: What a simulated lever has and the model that calibrates it has not; each can be left out.
DEPARTURES = {
    "mesh": "elements 1.3 times finer",
    "tip": "a cone on the heater",
    "drawing": "every dimension off by its tolerance",
    "jump": "in air, a temperature jump at the surface (accommodation 0.9)",
    "mobility": "carriers as in MINIMOS, scattered less by impurities when hot, instead of Eq. 8",
    "drift": "a gain that drifts by 0.05 % over the ramp",
    "outliers": "in a third of the levers, one or two currents off by 10 to 50 times the noise",
    "thermometer": "Raman temperatures off together, by 2 % of the rise",
}
#: Ways of calibrating; all but the estimate need the knee.
ESTIMATE = "estimate with priors"
WAYS = (ESTIMATE, "model of the drawing at k", "Eq. 12 at k", "knee at T_i")
#: Levels of confidence, and their limits in standard deviations.
LEVELS = {0.68: 0.994, 0.95: BAND}


@dataclass(frozen=True)
class LaboratoryOptions:
    """How levers are measured in the virtual laboratory.

    Attributes
    ----------
    points : int
        Biases of a ramp.
    drift : float
        Share by which a gain drifts over the ramp.
    outlier_share : float
        Share of the levers that have outliers.
    outlier : tuple of float
        How far these are off, from and to, in standard deviations.
    raman_points : int
        Raman temperatures.
    noise : float
        Of meters, as a share of what they show.
    raman_errors : tuple of float
        Of Raman temperatures, as shares of the rise: of each, and common to all.
    highest_V : mapping of str to float
        Where ramps end, by medium.
    hot_K : float
        Tip temperature above which errors count, and Raman temperatures are taken.
    mesh : MeshOptions
        Of levers that have elements other than those of the model.
    """

    points: int = 40
    drift: float = 5e-4
    outlier_share: float = 1 / 3
    outlier: tuple[float, float] = (10.0, 50.0)
    raman_points: int = 5
    noise: float = 2e-3
    raman_errors: tuple[float, float] = (0.01, 0.02)
    highest_V: Mapping[str, float] = field(default_factory=lambda: {"vacuum": 11.0, "air": 13.0})
    hot_K: float = 400.0
    mesh: MeshOptions = field(default_factory=lambda: MeshOptions(refinement=1.3))


class MinimosSilicon(NSilicon):
    """Silicon doped with phosphorus whose carriers move as in MINIMOS."""

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `hotlever.materials.kinds.Kind`."""
        return conductivity_low_doped(T, n, mobility_law=minimos_mobility, **self.of_carriers)


class MinimosMaterial(Material):
    """The silicon of a lever whose carriers move as in MINIMOS where it is low-doped."""

    classes: ClassVar = {**Material.classes, LOW_DOPED: MinimosSilicon}


def draw(
    rng: np.random.Generator, number: int, medium: str, departures: Collection[str] = DEPARTURES
) -> tuple[Probe, Probe]:
    """Draw a lever from the priors; return its probe, and the one that is known beforehand.

    Levers of even `number` have three legs, the others are U-shaped.
    """
    nominal = (Probe.reference() if number % 2 == 0 else Probe.u_shape()).in_medium(medium)
    values = values_from_priors(nominal, rng)
    if "drawing" not in departures:
        values = {name: values[name] for name in values if name not in nominal.shape.dimensions()}
    true, tip = nominal.with_(**values), some_tip(rng)
    room = tip.base_radius_um < 0.45 * true.shape.layout().heater.sides.min()
    if "tip" in departures and room:
        true = true.model_copy(update={"tip": tip})
    if medium == "air" and "jump" in departures:
        true = true.with_(accommodation=0.9)
    return true, nominal


def values_from_priors(nominal: Probe, rng: np.random.Generator) -> dict[str, float]:
    """Return what a lever may have in place of the nominal values, drawn from the usual priors.

    Its laws do not depart from their formulas.
    """
    lawful = updated(default_priors(nominal), {"laws": "paper"}, nominal, "twins")
    return draw_values(
        {name: prior for name, prior in lawful.items() if name != "series_resistance_ohm"}, rng
    )


def some_tip(rng: np.random.Generator) -> Tip:
    """Return a tip of a plausible size."""
    height = float(rng.uniform(0.3, 0.8))
    return Tip(height_um=height, half_angle_deg=float(rng.uniform(10, 25)))


def measure(
    true: Probe,
    rng: np.random.Generator,
    what: str,
    departures: Collection[str] = DEPARTURES,
    highest: float | None = None,
    laboratory: LaboratoryOptions | None = None,
) -> tuple[Measurement, Array, Lever]:
    """Measure a lever up to a bias (V), or as far as it goes; return its true temperatures (K) too.

    By ``what``, the current is measured alone, with the reader, or with five Raman temperatures,
    with their errors stated; meters have a noise that is a share of what they show.

    Raises
    ------
    ComputationError
        If a state of the lever was not found.
    """
    laboratory = laboratory or LaboratoryOptions()
    points, noise = laboratory.points, laboratory.noise
    if "mobility" in departures:
        true = true.with_material("material", MinimosMaterial)
    lever = Lever(true, laboratory.mesh if "mesh" in departures else None)
    even = np.linspace(1.0 / points, 1.0, points)
    try:
        sweep = lever.sweep((highest or laboratory.highest_V[true.surroundings.medium]) * even)
    except BranchEndError as error:
        sweep = lever.sweep(0.97 * error.bias_reached * even)
    tip, drifting = sweep.tip_K.values, laboratory.drift * ("drift" in departures)

    def noisy(values: Array) -> Array:
        drift = drifting * rng.standard_normal() * np.linspace(0.0, 1.0, points)
        return np.asarray(values * (1.0 + noise * rng.standard_normal(points) + drift))

    nothing = np.full(points, np.nan)
    reader = noisy(sweep.reader_V.values) if what == "reader" else nothing
    tips, errors = nothing.copy(), nothing.copy()
    if what == "raman":
        at = np.linspace(laboratory.hot_K, 0.98 * tip.max(), laboratory.raman_points)
        some = np.searchsorted(tip, at).clip(0, points - 1)
        (alone, common), base = laboratory.raman_errors, true.circuit.base_temperature_K
        scale = 1.0 + common * rng.standard_normal() * ("thermometer" in departures)
        rise = (tip - base)[some] * scale * (1.0 + alone * rng.standard_normal(some.size))
        tips[some], errors[some] = base + rise, alone * (tip[some] - base)
    current = noisy(sweep.current_mA.values)
    if "outliers" in departures and rng.random() < laboratory.outlier_share:
        outliers = rng.choice(points, rng.integers(1, 3), replace=False)
        sizes = rng.uniform(*laboratory.outlier, outliers.size)
        off = rng.choice((-1.0, 1.0), outliers.size) * sizes
        current[outliers] *= 1.0 + noise * off
    stated = laboratory.raman_errors[1] if what == "raman" else None
    data = Measurement(sweep.bias.values, current, reader, tips, errors, raman_scale=stated)
    return data, tip, lever


def paper_ways(data: Measurement, nominal: Probe) -> list[Callable[[Array], Array]]:
    """Return the tip temperature (K) by power (mW) as the paper's rules have it, as in ``WAYS``.

    Raises
    ------
    HotleverError
        If data or drawing have no knee.
    """
    model, base = _in_vacuum(nominal), nominal.circuit.base_temperature_K
    knee = find_knee(IVCurve.of(data.bias_V, data.current_mA, nominal.circuit), model).power_mW
    inversion = float(inversion_temperature(nominal.material.n_d, nominal.material.p))
    law, drawing = curve_of_law(EQ12, base), curve_of_model(model)
    return [
        lambda power: drawing.at(power, knee),
        lambda power: law.at(power, knee),
        lambda power: base + (inversion - base) * power / knee,
    ]


@lru_cache(maxsize=2)
def _in_vacuum(nominal: Probe) -> Branch:
    return Lever(nominal.in_medium("vacuum")).branch()


def judge(
    number: int,
    medium: str = "vacuum",
    what: str = "iv",
    departures: Collection[str] = DEPARTURES,
    laboratory: LaboratoryOptions | None = None,
    laws: str = "uncertain",
    rows: int = 101,
) -> xr.Dataset:
    """Simulate the lever of a number, calibrate it, and compare with its true temperature.

    The calibration takes the laws of silicon to be uncertain, or the paper's (``laws``), and is
    compared at so many even biases, its rows.

    Returns
    -------
    xarray.Dataset
        ``off_K`` on ``way`` and ``row`` (at even biases), the error above 400 K, NaN
        below, and throughout for a way that gave no answer; ``tip_K``, the truth, and
        ``stated_K``, the error that the estimate states on that side; ``seconds`` of processor; as
        texts ``refused``, why there is no estimate, and ``doubted``, why it says that the data are
        not described; as coordinates ``lever``, the number, and ``other_law``, whether the mobility
        is not Eq. 8's.

    Raises
    ------
    ComputationError
        If the lever could not be solved.
    """
    rng, laboratory = np.random.default_rng(number), laboratory or LaboratoryOptions()
    true, nominal = draw(rng, number, medium, departures)
    data, _, lever = measure(true, rng, what, departures, laboratory=laboratory)
    off, refused, doubted = np.full((len(WAYS), rows), np.nan), "", ""
    tip, stated = off[0], off[0]
    began = time.process_time()
    try:
        calibration = calibrate(data, probe=nominal, priors={"laws": laws})
    except HotleverError as error:
        refused = str(error)
    seconds = time.process_time() - began
    if not refused:
        doubted = calibration.reason
        bias = calibration.table.bias_V.values
        even = np.linspace(bias[0], bias[-1], rows)
        table = calibration.table.sel(bias=even, method="nearest")
        tip = lever.sweep(table.bias_V.values).tip_K.values
        off[0] = table.tip_K.values - tip
        stated = stated_on_that_side(table, off[0])
        with suppress(HotleverError):
            ways = paper_ways(data, nominal)
            off[1:] = [tip_at(table.power_mW.values) - tip for tip_at in ways]
    columns = {
        "off_K": (("way", "row"), np.where(tip > laboratory.hot_K, off, np.nan)),
        "tip_K": ("row", tip),
        "stated_K": ("row", stated),
        "seconds": seconds,
        "refused": refused,
        "doubted": doubted,
    }
    coordinates = {"way": list(WAYS), "lever": number, "other_law": "mobility" in departures}
    return labelled(columns, (), coordinates)


def stated_on_that_side(table: xr.Dataset, off_K: Array) -> Array:
    """Return the standard errors (K) of a calibration's table on the side it is off to, (n,)."""
    limit = np.where(off_K > 0, table.tip_low_K.values, table.tip_high_K.values)
    return np.asarray(np.abs(limit - table.tip_K.values) / BAND)


def coverage_by_decile(ratios: Sequence[Array]) -> Array:
    """Return the share of rows within the band, by level of confidence and decile of the bias.

    Parameters
    ----------
    ratios : sequence of ndarray
        Error over stated error of each lever, (rows,), rising in bias; all levers count alike.

    Returns
    -------
    ndarray, shape (levels, 10)
    """
    levers = [np.array_split(ratio, 10) for ratio in ratios]
    within = [
        [[np.mean(decile < limit) for decile in lever] for lever in levers]
        for limit in LEVELS.values()
    ]
    return np.mean(within, axis=1)


def concatenated(judged: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return judged calibrations as one dataset, on the dimension ``lever``."""
    return xr.concat(judged, "lever", coords="all", combine_attrs="override")


def summary(judged: xr.Dataset) -> xr.Dataset:
    """Sum judged calibrations up; levers without an answer are left out.

    Returns
    -------
    xarray.Dataset
        ``largest_K`` by ``way`` and ``percentile``; ``coverage``, the share within the stated band,
        by ``level`` and ``decile`` of the bias above 400 K; as attributes ``rms``, the pooled one
        of error over stated error, ``everywhere``, the share of levers within two stated errors at
        every bias, and how many were ``answered``.
    """
    answered = judged.isel(lever=(judged.refused == "").values)
    ratio = abs(answered.off_K.sel(way=ESTIMATE) / answered.stated_K).values
    # of data that are not described no error is stated
    ratio = ratio[np.isfinite(ratio).any(axis=1)]
    largest = abs(answered.off_K).max("row").transpose("way", "lever").values
    percentiles = [50, 90, 100]
    coverage = coverage_by_decile([row[np.isfinite(row)] for row in ratio])
    return labelled(
        {
            "largest_K": (("way", "percentile"), np.nanpercentile(largest, percentiles, axis=1).T),
            "coverage": (("level", "decile"), coverage),
        },
        coordinates={"way": list(WAYS), "percentile": percentiles, "level": list(LEVELS)},
        rms=float(np.sqrt(np.nanmean(ratio**2))),
        everywhere=float(np.mean(np.nanmax(ratio, axis=1) < 2.0)),
        answered=int(answered.sizes["lever"]),
    )


# --- twins of one material ------------------------------------------------------------------------

#: What each twin has in place of the reference probe's dimensions (µm).
GEOMETRIES: dict[str, dict[str, float]] = {
    "reference probe": {},
    "70 µm long": {"length_um": 70.0},
    "legs 4.5 and 5 µm wide": {"centre_leg_width_um": 4.5, "outer_leg_width_um": 5.0},
    "heater of 5 µm": {"heater_length_um": 5.0},
    "heater 2.5 µm wide": {"heater_width_um": 2.5},
    "42 µm long": {"length_um": 42.0},
}
#: Of `DEPARTURES`, by what is said of them; all of them come last.
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
