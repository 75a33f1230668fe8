"""Error budget of a calibration: what each source does to the tip temperature.

No source is given in kelvins: tolerances of dimensions, scatter of materials, covariances of fits
and errors of meters are propagated through the models and through the knee.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from hotlever.calibration.knee import IVCurve, Knee, find_knee
from hotlever.calibration.transfer import TemperatureCurve
from hotlever.errors import InputError
from hotlever.fitting import Fit, Measurement
from hotlever.fitting.models import ForwardModel, full_model
from hotlever.lever import Branch, Lever
from hotlever.lever.dataset import OBSERVABLES
from hotlever.lever.lever import COARSE
from hotlever.materials import PARAMETERS, Material
from hotlever.probe import Probe
from hotlever.spieser2017 import published
from hotlever.types import Array

#: Levers whose scatter stands for that of any lever of unknown material (Table II).
MATERIAL_SCATTER = ("lever 1", "lever 2", "lever 3", "lever 4")
#: Relative change of a dimension by which its effect is found.
_SMALL = 0.02
#: Scatter of scaled data, and changes (relative) of a parameter for a change of a dimension by
#: `_SMALL`, that surprise nobody: a balance for directions which the data hardly tell.
_SCATTER, _SURPRISE = 3e-3, 0.2
#: Dimensions that do not matter to the tip.
_HARMLESS = ("reader_length_um", "reader_centre_um")


@dataclass(frozen=True)
class Tolerances:
    """Standard errors that no data tell, all relative.

    Attributes
    ----------
    geometry : float
        Of every dimension of the lever, independently.
    material : float
        Of the material, in units of the scatter of the published levers (`MATERIAL_SCATTER`);
        for levers without a fit.
    series_resistance, voltage, current : float
        Of R_s, and of the calibration of the meters.
    """

    geometry: float = 0.05
    material: float = 1.0
    series_resistance: float = 1e-3
    voltage: float = 1e-3
    current: float = 1e-3

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name != "material" and not 0 <= value < 0.5:
                raise InputError(f"{name} = {value:g}, expected a relative error of 0 to 0.5")


@dataclass(frozen=True)
class Variation:
    """A lever that might be the true one: what is changed (`name`), and which source it counts to.

    Its squared effect has the weight ``share`` in the variance.
    """

    source: str
    name: str
    probe: Probe
    share: float = 1.0


def geometry_variations(probe: Probe, tolerance: float) -> Iterator[Variation]:
    """Yield levers with one dimension a little larger, by ``_SMALL`` of it."""
    for name in probe.shape.description():
        if name in _HARMLESS or tolerance == 0:
            continue
        value = getattr(probe.shape, name)
        try:
            changed = probe.with_(**{name: value * (1.0 + _SMALL)})
        except InputError:  # where that does not fit, smaller
            changed = probe.with_(**{name: value * (1.0 - _SMALL)})
        yield Variation("geometry", name, changed, (tolerance / _SMALL) ** 2)


def material_variations(probe: Probe, tolerance: float = 1.0) -> Iterator[Variation]:
    """Yield levers whose material scatters about the probe's as that of the published levers."""
    if tolerance == 0:
        return
    known = [published(name).material for name in MATERIAL_SCATTER]
    names = [name for name in Material.model_fields if name != "n_hd"]
    logarithms = np.log([[getattr(material, name) for name in names] for material in known])
    nominal = np.array([getattr(probe.material, name) for name in names])
    for lever, row in zip(MATERIAL_SCATTER, logarithms - logarithms.mean(axis=0), strict=True):
        changed = probe.with_(**dict(zip(names, (nominal * np.exp(row)).tolist(), strict=True)))
        yield Variation("material", lever, changed, tolerance**2 / (len(known) - 1))


def fit_variations(fit: Fit) -> Iterator[Variation]:
    """Yield levers one standard error away along each principal axis of a fit's covariance.

    Raises
    ------
    InputError
        If the fit states no errors.
    """
    if not np.isfinite(fit.covariance).all():
        raise InputError("the fit states no standard errors, which an error budget needs")
    scale = np.array([getattr(fit.probe.material, name) for name in fit.names])
    variances, axes = np.linalg.eigh(fit.covariance / np.outer(scale, scale))
    for number, (variance, axis) in enumerate(zip(variances, axes.T, strict=True), start=1):
        # relative changes as factors, so that no parameter changes its sign
        values = scale * np.exp(np.sqrt(max(float(variance), 0.0)) * axis)
        changed = fit.probe.with_(**dict(zip(fit.names, values.tolist(), strict=True)))
        yield Variation("fit", f"axis {number}", changed)


def refitted(fit: Fit, changed: Probe) -> Probe:
    """Return a changed probe with the material that its fit to the same data would have found.

    So much of an error in a dimension is seen by the data and made up for by the material. Two
    steps of Gauss and Newton from the fit to the unchanged probe, on a coarse mesh; a direction
    that the data do not tell stays where it is.
    """
    bias = fit.residuals().bias
    rows = [list(OBSERVABLES).index(name) for name in fit.observables]
    columns = [list(PARAMETERS).index(name) for name in fit.names]

    def model(probe: Probe) -> ForwardModel:
        return full_model(Lever(probe.in_medium(fit.medium), COARSE), bias)

    target = model(fit.probe).predict(fit.probe).values[rows]
    of_changed, material = model(changed), changed.material
    scale = np.abs(target).max(axis=1)[:, None]
    seen = None
    for _ in range(2):
        seen = of_changed.predict(changed.model_copy(update={"material": material}), seen)
        size = np.array([getattr(material, name) for name in fit.names])
        slopes = seen.slopes[rows][:, :, columns] * size / scale[:, :, None]
        missing = ((target - seen.values[rows]) / scale).ravel()
        system = np.concatenate(
            [slopes.reshape(-1, size.size) / _SCATTER, np.eye(size.size) / _SURPRISE]
        )
        wanted = np.concatenate([missing / _SCATTER, 0.0 * size])
        step = np.linalg.lstsq(system, wanted, rcond=None)[0]
        moved = dict(zip(fit.names, (size * np.exp(step)).tolist(), strict=True))
        material = material.with_(**moved)
    return changed.with_(**material.model_dump())


# --- effects on the tip temperature ---------------------------------------------------------------


def knee_and_meters(
    curve: IVCurve,
    model: Branch,
    reference: TemperatureCurve,
    knee: Knee,
    bias: Array,
    current: Array,
    tolerances: Tolerances,
) -> dict[str, Array]:
    """Return the effects (K) of the knee's scatter, and of R_s and the meters.

    At bias and current (V, mA), for a measured curve whose knee was found with the help of a model.
    """

    def temperature(series: float, voltage: float, amperes: float, knee_mW: float) -> Array:
        lever = curve.circuit.lever_voltage(voltage * bias, series * amperes * current)
        return reference.at(lever * amperes * current, knee_mW)

    power = knee.power_mW
    nominal = temperature(1.0, 1.0, 1.0, power)
    by_knee = temperature(1.0, 1.0, 1.0, power * (1.0 + knee.power_mW_stderr / power)) - nominal
    shares = tolerances.series_resistance, tolerances.voltage, tolerances.current
    squares = np.zeros_like(nominal)
    for series, voltage, amperes in 1.0 + np.diag(shares):
        ohm = series * curve.circuit.series_resistance_ohm
        changed = IVCurve(
            voltage * curve.bias_V,
            amperes * curve.current_mA,
            curve.circuit.with_(series_resistance_ohm=float(ohm)),
        )
        try:
            moved = find_knee(changed, model).power_mW
        except InputError:
            # estimated or hardly determined: the knee moves as the points do
            moved = power * float(np.median(changed.power_mW / curve.power_mW))
        squares += (temperature(series, voltage, amperes, moved) - nominal) ** 2
    return {"k": np.abs(by_knee), "electronics": np.sqrt(squares)}


def levers(
    probe: Probe,
    fit: Fit | None,
    tolerances: Tolerances,
    temperature: Callable[[Probe], Array],
    step: Callable[[], None],
) -> dict[str, Array]:
    """Return the effects (K) of dimensions, and of the material or its fit, on temperatures.

    The material of a fit makes up for an error in a dimension. `step` is called after each lever.
    """
    variations = []
    for variation in geometry_variations(probe, tolerances.geometry):
        if fit is not None:
            unchanged = replace(fit, probe=probe.in_medium(fit.medium))
            variation = replace(variation, probe=refitted(unchanged, variation.probe))
        variations.append(variation)
        step()
    variations += (
        material_variations(probe, tolerances.material)
        if fit is None
        else fit_variations(replace(fit, probe=probe))
    )
    nominal, squares = temperature(probe), dict[str, Array]()
    for variation in variations:
        square = variation.share * (temperature(variation.probe) - nominal) ** 2
        squares[variation.source] = squares.get(variation.source, 0.0) + square
        step()
    return {source: np.sqrt(square) for source, square in squares.items()}


def thermometer(measurement: Measurement, tip: Array, notes: list[str]) -> Array:
    """Return the stated error (K) of the temperatures that a fit was made with, at some others.

    The whole of it, as if it were common to all points, which a calibration error is. Where the
    measurement states none, a note says so.
    """
    known = np.isfinite(measurement.tip_K) & np.isfinite(measurement.tip_error_K)
    if not known.any():
        notes.append("the fitted measurement states no errors of its temperatures")
        return np.zeros_like(tip)
    order = np.argsort(measurement.tip_K[known])
    at, errors = measurement.tip_K[known][order], measurement.tip_error_K[known][order]
    return np.interp(tip, at, errors)
