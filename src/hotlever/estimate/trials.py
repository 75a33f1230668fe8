"""Samples of a posterior: estimates from drawn errors (JCGM 101), weighted.

A trial draws errors of data and priors, ε, and looks for the estimate x that they lead to: with the
residuals r, in standard deviations, and an orthonormal basis Q of what their Jacobian J spans at
the optimum, Qᵀ r(x) = ε. Where r is linear these are samples of the posterior. Where it bends they
have the density ``exp(−½ |Qᵀ r|²) |det Qᵀ J|``, and each counts as much more as the posterior is
larger there (Bardsley, Solonen, Haario and Laine, SIAM J. Sci. Comput. 36, A1895 (2014)). Errors
are drawn from Student's t, whose tails are wider, so that no sample counts for too much.

With priors residuals count standard deviations. Without, their noise is unknown, with the prior
1/σ: trials draw it too. A parameter without a prior is uniform within its bounds; what the data
leave open is drawn from a normal distribution of that width.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from scipy import optimize

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.objective import Subproblem
from hotlever.estimate.options import TrialOptions
from hotlever.processes import local_processes
from hotlever.types import Array, Progress

#: One unknown noise scale for each observable, or one for all.
Noise = Literal["each", "common"]


@dataclass(frozen=True)
class Samples:
    """Points of a posterior that all count the same.

    Attributes
    ----------
    points : ndarray, shape (n, p)
    effective : float
        How many independent ones they are worth: (Σw)² / Σw² of the trials' weights.
    """

    points: Array
    effective: float


class Trials:
    """Estimates from drawn errors near a lever.

    Parameters
    ----------
    near : Subproblem
        What levers near the optimum show.
    noise : {"each", "common"}
        What shares an unknown noise: the data of an observable, or all.
    options : TrialOptions

    Attributes
    ----------
    optimum : ndarray, shape (p,)
        The point about which trials are made: without priors that at which each noise is that of
        its own residuals.
    """

    def __init__(
        self, near: Subproblem, noise: Noise = "each", options: TrialOptions | None = None
    ) -> None:
        self.options = options or TrialOptions()
        self._near, self._objective = near, near.objective
        group = np.nonzero(self._objective.residuals.present)[0] * (noise == "each")
        self._group, self._counts = group, np.bincount(group)
        low, high = self._objective.bounds
        self._margin = 1e-6 * (high - low)
        uniform = ~self._objective.of_priors(near.origin).any(axis=0)
        self._wide = np.diag(math.sqrt(12.0) / (high - low))[uniform]
        self.optimum, self._squares = self._settled()

    def drawn(self, random: Any) -> tuple[Array, float]:
        """Return the estimate from drawn errors, (p,), and the logarithm of its weight."""
        size, tails = self.optimum.size, self.options.tails
        scale, log_density = self._drawn_noise(random)
        basis = np.linalg.qr(self._jacobian(self.optimum, scale))[0]
        errors = random.normal(size=size) * math.sqrt(tails / random.chisquare(tails))
        found = self._least_squares(
            lambda point: basis.T @ self._residual(point, scale) - errors,
            lambda point: basis.T @ self._jacobian(point, scale),
            self.optimum,
        )
        if np.linalg.norm(found.fun) > self.options.accuracy:
            return found.x, -math.inf
        errors = errors + found.fun
        log_density -= 0.5 * (tails + size) * math.log1p(float(errors @ errors) / tails)
        log_density += float(np.linalg.slogdet(found.jac)[1])
        residual = self._residual(found.x, scale)[: -len(self._wide) or None]
        posterior = -0.5 * float(residual @ residual) + self._objective.log_volume(found.x)
        return found.x, posterior + float(np.log(scale).sum()) - log_density

    def _drawn_noise(self, random: Any) -> tuple[Array, float]:
        """Return what residuals of data are multiplied by, and the logarithm of its density."""
        if self._objective.informed:
            return np.ones(self._group.size), 0.0
        # a parameter takes up a share of the noise of all data
        free = 1.0 - min(self.optimum.size / self._group.size, 0.9)
        free_data = np.maximum(self._counts * free, 1.0)
        drawn = random.chisquare(free_data)
        density = 0.5 * float(free_data @ np.log(drawn) - drawn.sum())
        return np.sqrt(drawn / self._squares)[self._group], density

    def _settled(self) -> tuple[Array, Array]:
        """Return the optimum if each noise is that of its own residuals, and their squares."""
        point = self._near.origin
        squares = self._squares_at(point)
        for _ in range(0 if self._objective.informed else self.options.rounds):
            scale, before = np.sqrt(self._counts / squares)[self._group], squares
            point = self._least_squares(
                partial(self._residual, scale=scale),
                partial(self._jacobian, scale=scale),
                point,
            ).x
            squares = self._squares_at(point)
            if np.abs(np.log(squares / before)).max() < self.options.accuracy:
                break
        return point, squares

    def _squares_at(self, point: Array) -> Array:
        """Return the sum of squares of each group; never zero, for its logarithm."""
        residual = self._near.residual(point)[: self._group.size]
        return np.maximum(np.bincount(self._group, residual**2), np.finfo(float).tiny)

    def _residual(self, point: Array, scale: Array) -> Array:
        """Return residuals of data, times a scale, of priors, and from the middle of wide ones."""
        residual = self._near.residual(point)
        residual[: scale.size] *= scale
        return np.concatenate([residual, self._wide @ (point - self._near.origin)])

    def _jacobian(self, point: Array, scale: Array) -> Array:
        """Return the derivatives of `_residual`."""
        jacobian = self._near.jacobian(point)
        jacobian[: scale.size] *= scale[:, None]
        return np.vstack([jacobian, self._wide])

    def _least_squares(
        self, residual: Callable[[Array], Array], jacobian: Callable[[Array], Array], start: Array
    ) -> Any:
        low, high = self._objective.bounds
        return optimize.least_squares(
            residual,
            np.clip(start, low + self._margin, high - self._margin),
            jacobian,
            (low, high),
            x_scale="jac",
            ftol=1e-3,
            xtol=1e-6,
            gtol=None,
            max_nfev=self.options.most_evaluations,
        )


def draw_samples(
    trials: Trials,
    count: int,
    *,
    processes: int = 1,
    seed: int = 0,
    progress: Progress | None = None,
) -> Samples:
    """Make trials, and draw samples that all count the same from them by their weights.

    Parameters
    ----------
    trials : Trials
        Picklable if `processes` is more than one.
    count, processes, seed, progress
        See `hotlever.estimate.sampling.sample_posterior`.

    Raises
    ------
    InputError
        If a number is too small.
    ComputationError
        If no trial finds an estimate or a worker process dies.
    """
    for name, value in (("samples", count), ("processes", processes)):
        if value < 1:
            raise InputError(f"found {name} = {value}, expected 1 or more")
    sizes = [
        len(some) for some in np.array_split(np.arange(count), -(-count // trials.options.block))
    ]
    *seeds, last = np.random.SeedSequence(seed).spawn(len(sizes) + 1)
    with local_processes(min(processes, len(sizes))) as run:
        blocks = run(_block, [(trials, *one) for one in zip(sizes, seeds, strict=True)], progress)
    points, logarithms = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    if not np.isfinite(logarithms).any():
        raise ComputationError(
            f"none of {count} trials of the posterior found a lever within the bounds of the "
            "parameters; fix those that the data do not determine"
        )
    weights = np.exp(logarithms - logarithms.max())
    weights /= weights.sum()
    # systematic resampling: each trial as often as its weight says, but for a fraction
    places = (np.arange(count) + np.random.default_rng(last).random()) / count
    chosen = np.searchsorted(np.cumsum(weights), places).clip(max=count - 1)
    return Samples(points[chosen], float(1.0 / (weights @ weights)))


def _block(trials: Trials, count: int, seed: np.random.SeedSequence) -> tuple[Array, Array]:
    """Make some trials; return their points, (count, p), and the logarithms of their weights."""
    random = np.random.default_rng(seed)
    points, logarithms = zip(*(trials.drawn(random) for _ in range(count)), strict=True)
    return np.array(points), np.array(logarithms)
