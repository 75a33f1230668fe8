"""Error budget of a calibration: what each source does to the tip temperature.

No source is given in kelvins: tolerances of dimensions, scatter of materials, covariances of fits
and errors of meters are propagated through the models and through the knee.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import InputError
from hotlever.fitting.fit_file import FitFile
from hotlever.fitting.measurement import Measurement
from hotlever.lever.lever import OBSERVABLE_COLUMNS, Lever
from hotlever.materials import Material
from hotlever.materials.spieser2017 import published
from hotlever.probe import MeshOptions, Probe

Array = NDArray[np.float64]

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
    """A lever that might be the true one.

    Attributes
    ----------
    source, name : str
        What the change belongs to, and what is changed.
    probe : Probe
    share : float
        Weight of its squared effect in the variance.
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
            changed = probe.with_values({name: value * (1.0 + _SMALL)})
        except InputError:  # where that does not fit, smaller
            changed = probe.with_values({name: value * (1.0 - _SMALL)})
        yield Variation("geometry", name, changed, (tolerance / _SMALL) ** 2)


def material_variations(probe: Probe, tolerance: float = 1.0) -> Iterator[Variation]:
    """Yield levers whose material scatters about the probe's as that of the published levers."""
    if tolerance == 0:
        return
    known = [published(name).material for name in MATERIAL_SCATTER]
    names = [name for name in Material.model_fields if name != "n_hd"]
    logarithms = np.log([[getattr(material, name) for name in names] for material in known])
    for name, row in zip(MATERIAL_SCATTER, logarithms - logarithms.mean(axis=0), strict=True):
        values = {
            key: getattr(probe.material, key) * float(np.exp(change))
            for key, change in zip(names, row, strict=True)
        }
        yield Variation(
            "material", name, probe.with_values(values), tolerance**2 / (len(known) - 1)
        )


def fit_variations(fit: FitFile) -> Iterator[Variation]:
    """Yield levers one standard error away along each principal axis of a fit's covariance.

    Raises
    ------
    InputError
        If the fit states no errors.
    """
    if not np.isfinite(fit.covariance).all():
        raise InputError(f"{fit.path}: the fit states no standard errors, which a budget needs")
    material = fit.probe.material
    scale = np.array([getattr(material, name) for name in fit.names])
    variances, axes = np.linalg.eigh(fit.covariance / np.outer(scale, scale))
    for number, (variance, axis) in enumerate(zip(variances, axes.T, strict=True), start=1):
        change = np.sqrt(max(float(variance), 0.0)) * axis
        # relative changes as factors, so that no parameter changes its sign
        values = {
            name: getattr(material, name) * float(np.exp(share))
            for name, share in zip(fit.names, change, strict=True)
        }
        yield Variation("fit", f"axis {number}", fit.probe.with_values(values))


def refitted(fit: FitFile, data: Measurement, changed: Probe, mesh: MeshOptions) -> Probe:
    """Return a changed probe with the material that its fit to the same data would have found.

    So much of an error in a dimension is seen by the data and made up for by the material. Two
    steps of Gauss and Newton from the fit to the unchanged probe, with the fit's weights; a
    direction that the data do not tell stays where it is.

    Parameters
    ----------
    fit : FitFile
        Of the unchanged probe.
    data : Measurement
    changed : Probe
        With the fit's material.
    mesh : MeshOptions
    """
    bias = data.bias_V[np.isfinite([data.observable(name) for name in fit.observables]).any(axis=0)]
    bias = np.unique(bias)

    def seen(probe: Probe, sensitivities: bool) -> tuple[Array, Array]:
        lever = Lever(probe.in_medium(fit.medium), mesh)
        sweep = lever.sweep(bias, sensitivities=sensitivities)
        values = np.stack([sweep[OBSERVABLE_COLUMNS[name]].values for name in fit.observables])
        if not sensitivities:
            return values, np.empty(0)
        slopes = sweep.sensitivity.sel(observable=list(fit.observables), parameter=fit.names)
        return values, slopes.values

    target, _ = seen(fit.probe, False)
    scale = np.abs(target).max(axis=1)[:, None]
    for _ in range(2):
        values, slopes = seen(changed, True)
        size = np.array([getattr(changed.material, name) for name in fit.names])
        rows = (slopes * size / scale[:, :, None]).reshape(-1, size.size)
        system = np.concatenate([rows / _SCATTER, np.eye(size.size) / _SURPRISE])
        wanted = np.concatenate([((target - values) / scale).ravel() / _SCATTER, 0.0 * size])
        step = np.linalg.lstsq(system, wanted, rcond=None)[0]
        moved = dict(zip(fit.names, (size * np.exp(step)).tolist(), strict=True))
        changed = changed.with_values(moved)
    return changed


def combined(parts: dict[str, Array]) -> Array:
    """Add independent standard errors."""
    total: Array = np.sqrt(np.sum([part**2 for part in parts.values()], axis=0))
    return total


def spread(
    variations: list[Variation],
    nominal: Array,
    temperature: Callable[[Probe], Array],
    progress: Callable[[], None],
) -> dict[str, Array]:
    """Return the standard error of temperatures by source.

    Parameters
    ----------
    variations : list of Variation
    nominal : ndarray, shape (n,)
        Temperatures (K) of the unchanged probe.
    temperature : callable
        The same of a changed one.
    progress : callable
        Called after each.
    """
    squares: dict[str, Array] = {}
    for variation in variations:
        change = temperature(variation.probe) - nominal
        squares[variation.source] = (
            squares.get(variation.source, np.zeros_like(change)) + variation.share * change**2
        )
        progress()
    return {source: np.sqrt(square) for source, square in squares.items()}
