"""The posterior of a fit's parameters, and the band of tip temperature that follows from it.

Sampled with emcee on the reduced lever. The likelihood takes the fit's own weighted residuals as
normal, with one unknown noise scale for each observable. With the prior 1/σ the scales are
integrated out exactly: a group of n residuals with the sum of squares Q contributes Q^(−n/2).
In a fit with priors data with stated errors have these, and contribute exp(−Q/2).
A parameter has the prior that the fit gave it, or is uniform within its bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Literal

import emcee
import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError
from hotlever.estimation.ensembles import (
    Chains,
    Gaussian,
    independent_samples,
    rhat_of_ensembles,
    sample,
)
from hotlever.estimation.objective import Objective
from hotlever.estimation.result import Fit
from hotlever.estimation.rough import RoughModel, rough_model
from hotlever.materials import full_name
from hotlever.probe import Probe
from hotlever.probe.parameters import parameters_of, usual_parameters
from hotlever.text import INVERSION
from hotlever.types import Array, Progress

Noise = Literal["each", "common"]

#: Quantiles (%) of a predictive band: median, 68 % and 95 %.
BAND_QUANTILES = (2.5, 16.0, 50.0, 84.0, 97.5)
#: Rounds in which weights and residuals settle that follow from each other.
_WEIGHT_ROUNDS = 50


class Posterior:
    """The density of the parameters of an estimate that its data and priors leave.

    Parameters
    ----------
    objective : Objective
        Residuals of (N,) data and of priors, by the coordinates of the (p,) parameters.
    values : callable
        Return I_h, V_r and T_tip (3, n) of a point; picklable, if it is sampled in processes.
    optimum : ndarray, shape (p,)
        The point about which it is approximated.
    slopes : ndarray, shape (3, n, k)
        Derivatives of the values there.
    noise : {"each", "common"}
        See `sample_posterior`. With priors residuals count standard deviations, and no noise is
        unknown.
    """

    def __init__(
        self,
        objective: Objective,
        values: Callable[[Array], Array],
        optimum: Array,
        slopes: Array,
        noise: Noise = "each",
    ) -> None:
        self.objective, self.optimum = objective, optimum
        self._values, self._slopes = values, slopes
        # the data that share a noise scale
        self._group = np.nonzero(objective.residuals.present)[0] * (noise == "each")
        self._counts = np.bincount(self._group)

    def log_probability(self, point: Array) -> float:
        """Return the logarithm of the density, up to a constant; −∞ where there is no lever."""
        low, high = self.objective.bounds
        if np.any(point <= low) or np.any(point >= high):
            return -math.inf
        try:
            residual = self.objective.residuals.weighted(self._values(point))
        except ComputationError:
            return -math.inf
        unlikely = float(residual @ residual)
        if not self.objective.informed:
            unlikely = float(self._counts @ np.log(self._squares(residual)))
        from_priors = self.objective.from_priors(point)
        return -0.5 * float(unlikely + from_priors @ from_priors) + self.objective.log_volume(point)

    @cached_property
    def approximation(self) -> Gaussian:
        """What it is if the model is linear in the coordinates: a normal density.

        Without priors the weights follow from the residuals and the residuals from the weights; a
        few dozen rounds settle both. What has no prior of its own is uniform within its bounds.
        """
        objective, (low, high) = self.objective, self.objective.bounds
        residual = objective.residuals.weighted(self._values(self.optimum))
        jacobian = objective.of_data(self._slopes, self.optimum)
        of_priors = objective.of_priors(self.optimum)
        pull = of_priors.T @ objective.from_priors(self.optimum)
        uniform = np.where(of_priors.any(axis=0), 0.0, 12.0 / (high - low) ** 2)
        prior = np.diag(uniform) + of_priors.T @ of_priors
        step, weights = np.zeros(self.optimum.size), np.ones(residual.size)
        for _ in range(1 if objective.informed else _WEIGHT_ROUNDS):
            if not objective.informed:
                squares = self._squares(residual + jacobian @ step)
                weights = (self._counts / squares)[self._group]
            covariance = np.linalg.inv(jacobian.T @ (weights[:, None] * jacobian) + prior)
            step = -covariance @ (jacobian.T @ (weights * residual) + pull)
        margin = 1e-3 * (high - low)
        mean = np.clip(self.optimum + step, low + margin, high - margin)
        return Gaussian(mean, np.asarray(covariance, dtype=float))

    def sample(
        self,
        *,
        samples: int,
        walkers: int | None = None,
        processes: int = 1,
        seed: int = 0,
        progress: Progress | None = None,
    ) -> Chains:
        """Sample points; see `hotlever.estimation.ensembles.sample`."""
        return sample(
            self.log_probability,
            self.approximation,
            samples=samples,
            walkers=walkers,
            processes=processes,
            seed=seed,
            progress=progress,
        )

    def _squares(self, residual: Array) -> Array:
        """Return the sum of squares of each group; never zero, for its logarithm."""
        return np.maximum(np.bincount(self._group, residual**2), np.finfo(float).tiny)


def _posterior_at(fit: Fit, probe: Probe, noise: Noise) -> tuple[Posterior, RoughModel]:
    """Return the posterior of a fit's parameters, and the model of the levers near a probe."""
    residuals = fit.residuals()
    model = rough_model(probe, fit.names, residuals.bias)
    objective = Objective(residuals, probe, model.names, fit.names, fit.known_before)
    values = partial(_values_at, model, objective, probe)
    return Posterior(objective, values, objective.point(probe), model.slopes, noise), model


def _values_at(model: RoughModel, objective: Objective, probe: Probe, point: Array) -> Array:
    return model.predict(objective.at(probe, point))


def sample_posterior(
    fit: Fit,
    *,
    samples: int = 10_000,
    walkers: int | None = None,
    processes: int = 2,
    seed: int = 0,
    noise: Noise = "each",
    progress: Progress | None = None,
) -> xr.Dataset:
    """Sample the posterior of the parameters that a fit varied, with the priors that it had.

    Parameters
    ----------
    fit : Fit
    samples : int
        Kept, at least; rounded up to a whole number of steps of all walkers.
    walkers : int, optional
        Of each of four independent ensembles; by default 24, or three for each parameter.
    processes : int
        Started by spawn: a script that calls this with more than one needs
        ``if __name__ == "__main__"``. The samples do not depend on their number.
    seed : int
    noise : {"each", "common"}
        One unknown noise scale for each observable (they differ by a factor of ten in real
        data), or one for all scaled residuals, which is what the fit's standard errors assume.
    progress : callable, optional
        Called with the steps done and their number.

    Returns
    -------
    xarray.Dataset
        On the dimensions ``chain`` and ``draw``: the varied parameters,
        ``inversion_temperature`` and ``log_probability``; on ``quantity`` (all of these but the
        last): ``effective_sample_size``, ``rhat``; ``acceptance_fraction``; the coordinate
        ``ensemble`` of each chain. Attributes give the fixed parameters, the seed, the noise, and
        by how much the rough lever may be wrong at the outermost samples (``rough_error_K``).

    Raises
    ------
    InputError
        If a number is too small or `noise` unknown, or the fit does not describe its data.
    ComputationError
        If no start is found or a worker process dies.
    """
    if noise not in ("each", "common"):
        raise InputError(f"found noise = {noise!r}, expected 'each' or 'common'")
    fit.need_described("a posterior")
    at_optimum, _ = _posterior_at(fit, fit.probe, noise)
    # with other weights than the fit's, the posterior lies beside the optimum
    middle = at_optimum.objective.at(fit.probe, at_optimum.approximation.mean)
    target, model = _posterior_at(fit, middle, noise)
    chains = target.sample(
        samples=samples, walkers=walkers, processes=processes, seed=seed, progress=progress
    )
    data = _dataset(fit, chains, target.objective.coordinates.values)
    points = chains.points.reshape(-1, target.optimum.size)
    outermost = [target.objective.at(middle, points[row]) for row in _outermost(points)]
    error = max(map(model.error_K, outermost))
    data.attrs |= {"seed": seed, "noise": noise, "rough_error_K": error}
    return data


def _outermost(points: Array) -> list[int]:
    """Return the samples with the smallest and largest value along the widest axis."""
    away = (points - points.mean(axis=0)) / np.maximum(points.std(axis=0), 1e-300)
    along = away @ np.linalg.eigh(away.T @ away)[1][:, -1]
    return [int(np.argmin(along)), int(np.argmax(along))]


def _dataset(fit: Fit, chains: Chains, values_of: Callable[[Array], Array]) -> xr.Dataset:
    ensembles, walkers, draws, _ = chains.points.shape
    values = values_of(chains.points)
    columns = {name: values[..., place] for place, name in enumerate(fit.names)}
    silicon, material = fit.probe.heater_silicon, fit.probe.layout().heater.stack[0].material
    if silicon is not None:
        at = {own: columns.get(full_name(material, own)) for own in ("n_d", "p")}
        moved = silicon.model_copy(update={own: one for own, one in at.items() if one is not None})
        columns[INVERSION] = np.broadcast_to(moved.inversion_temperature(), values.shape[:3])
    rhat = [rhat_of_ensembles(column) for column in columns.values()]
    chained = {
        name: column.reshape(ensembles * walkers, draws)
        for name, column in (columns | {"log_probability": chains.log_probability}).items()
    }
    size = [independent_samples(column) for column in columns.values()]
    held = [name for name in usual_parameters(fit.probe) if name not in fit.names]
    at_rest = zip(held, fit.probe.at(held).tolist(), strict=True)
    data = labelled(
        {
            **chained,
            "rhat": ("quantity", rhat),
            "effective_sample_size": ("quantity", size),
            "acceptance_fraction": ((), chains.accepted),
        },
        ("chain", "draw"),
        {
            "quantity": list(columns),
            "ensemble": ("chain", np.repeat(np.arange(ensembles), walkers)),
        },
        fixed=", ".join(f"{name} = {value:g}" for name, value in at_rest),
        observables=", ".join(fit.observables),
        sampler=f"emcee {emcee.__version__}",
    )
    for name, known in parameters_of(fit.probe).items():
        if name in fit.names:
            data[name].attrs = {"units": known.unit, "long_name": known.meaning}
    return data


# --- the band of tip temperature ----------------------------------------------------------------


def predictive_band(
    fit: Fit,
    posterior: xr.Dataset,
    *,
    bias: Sequence[float] | Array | None = None,
    samples: int = 300,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Predict the tip temperature, with quantiles, from posterior samples.

    It is the band of the true temperature, given the model; measured ones scatter about it by
    their noise as well.

    Parameters
    ----------
    fit : Fit
    posterior : xarray.Dataset
        From `sample_posterior`.
    bias : sequence of float, optional
        V; by default 81 from zero to the highest measured one.
    samples : int
        Taken evenly from the posterior.
    progress : callable, optional
        Called with the samples done and their number.

    Returns
    -------
    xarray.Dataset
        ``tip_K`` (quantile, bias) and ``tip_at_power_K`` (quantile, power), with the coordinates
        ``quantile`` (%), ``bias_V`` and ``power_mW``. The powers reach to the highest that all
        samples reach; they are NaN where a power does not tell the temperature.

    Raises
    ------
    InputError
        If a bias or the number of samples is impossible.
    ComputationError
        If the lever cannot be solved at a bias.
    """
    if samples < 2:
        raise InputError(f"found samples = {samples}, expected 2 or more")
    measured = fit.measurement.bias_V
    grid = (
        np.linspace(min(float(measured.min()), 0.0), float(measured.max()), 81)
        if bias is None
        else np.unique(np.asarray(bias, float))
    )
    model = rough_model(fit.probe, fit.names, grid)
    flat = np.stack([posterior[name].values.ravel() for name in fit.names], axis=1)
    chosen = flat[np.linspace(0, len(flat) - 1, min(samples, len(flat))).round().astype(int)]
    tips, powers = [], []
    for done, row in enumerate(chosen, start=1):
        probe = fit.probe.moved(dict(zip(fit.names, row.tolist(), strict=True)))
        current, _, tip = model.predict(probe)
        tips.append(tip)
        powers.append(probe.circuit.power(grid, current))
        if progress is not None:
            progress(done, len(chosen))
    power = np.linspace(np.min(powers, axis=1).max(), np.max(powers, axis=1).min(), grid.size)
    if np.diff(powers, axis=1).min() < 0:
        # with held supplies there may be several temperatures at one power
        power = np.full(grid.size, np.nan)
    at_power = [_against(power, x, tip) for x, tip in zip(powers, tips, strict=True)]
    quantiles = partial(np.percentile, q=BAND_QUANTILES, axis=0)
    return labelled(
        {
            "tip_K": (("quantile", "bias"), quantiles(tips)),
            "tip_at_power_K": (("quantile", "power_mW"), quantiles(at_power)),
        },
        coordinates={"quantile": list(BAND_QUANTILES), "bias": grid, "power_mW": power},
        samples=len(chosen),
    )


def _against(power: Array, powers: Array, tip: Array) -> Array:
    """Interpolate a tip temperature, which rises with the power, at given powers."""
    order = np.argsort(powers)
    return np.interp(power, powers[order], tip[order])
