"""The least-squares problem of a fit: Levenberg-Marquardt, robust weights, confirmation.

A fit goes in rounds. In each, Levenberg-Marquardt finds the optimum among materials near
one whose branch was solved with its exact derivatives; there the branch is solved anew. Since
voltages at a given tip temperature are nearly powers of the parameters, a few rounds suffice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import optimize

from hotlever.errors import ComputationError, InputError
from hotlever.fitting.models import ForwardModel, Prediction
from hotlever.fitting.residuals import Residuals
from hotlever.materials import PARAMETERS, Material
from hotlever.types import Array

#: Scaled residual given to trial parameters for which the lever has no state: far beyond any
#: real one, so that Levenberg-Marquardt turns back.
_UNSOLVED = 10.0
#: How far a round goes from where the branch was solved (relative change of a parameter), and
#: how near the optimum must be not to go on.
_FAR, _NEAR = 0.5, 1e-7
#: Relative changes of squares and parameters at which a round ends.
_EXACT = 1e-10
#: Predictions that are kept.
_AT_HAND = 3
#: Most rounds, and as many as most fits need, for a progress bar to fill.
_MOST_ROUNDS, _USUAL_ROUNDS = 60, 8
#: The optimum is found when a round moves no parameter by more than this share of its standard
#: error.
_FOUND = 0.01
#: A confirmation that moves no parameter by more than these shares of its standard error and of
#: its value ends the fit, since the confirmed model is exact to first order.
_SETTLED, _SETTLED_RELATIVE = 0.5, 0.03
_MOST_CONFIRMATIONS = 5
#: Tukey's biweight gives no weight beyond this many standard deviations.
_TUKEY = 4.685
_HUBER, _HUBER_TURNS = 1.345, 6
_MOST_REWEIGHTINGS = 20
#: A datum that alone decides a parameter says nothing of its own noise.
_LEAST_FREE = 0.05
#: Rounds in which an observable without measurement errors finds its scatter.
_SCATTER_TURNS = 3


@dataclass(frozen=True)
class Optimum:
    """Where Levenberg-Marquardt ended.

    Attributes
    ----------
    material : Material
    prediction : Prediction
    stderr : ndarray, shape (p,)
        From `covariance`; infinite where there is none.
    covariance : ndarray, shape (p, p)
        If all weighted data had the same noise: the paper's assumption. NaN if it
        could not be estimated.
    """

    material: Material
    prediction: Prediction
    stderr: Array
    covariance: Array


class LeastSquares:
    """Finds the material whose prediction is nearest to a measurement.

    It begins at the material `start`, where parameters that are not varied stay, or from a
    prediction for a similar one, `near`; `progress` is called with the branches solved and how
    many there usually are.

    Attributes
    ----------
    model : ForwardModel
        As confirmed last.
    evaluations, steps : int
        Branches solved, and rounds that led nearer to the optimum.
    """

    def __init__(
        self,
        model: ForwardModel,
        residuals: Residuals,
        start: Material,
        varied: list[str],
        progress: Callable[[int, int], None] | None = None,
        near: Prediction | None = None,
    ) -> None:
        self.model, self.residuals, self._varied = model, residuals, varied
        self._start, self._progress = start, progress
        self._columns = [list(PARAMETERS).index(name) for name in varied]
        known = [PARAMETERS[name] for name in varied]
        self._scale = np.array([one.scale for one in known])
        self._bounds = np.array([[one.lower, one.upper] for one in known]).T / self._scale
        self._known = {} if near is None else {near.linearised.branch.equations.material: near}
        self.evaluations, self.steps = 0, 0

    def solve_and_confirm(self, robust: bool) -> Optimum:
        """Find the optimum, make the model exact there, and go on until that matters no more.

        Raises
        ------
        ComputationError
            If the lever cannot be solved at the start, or the fit does not converge.
        """
        found = self.solve(self._start)
        for _ in range(_SCATTER_TURNS if self.residuals.without_errors.any() else 0):
            self.residuals.take_scatter(found.prediction.values)
            found = self.solve(found.material)
        if robust:
            found = self._reweighted(found)
        for _ in range(_MOST_CONFIRMATIONS):
            confirmed = self.model.confirmed(found.prediction)
            if confirmed is self.model:
                return found
            self.model = confirmed
            self._known = {found.material: confirmed.predict(found.material, found.prediction)}
            previous, found = found, self.solve(found.material)
            if self._settled(previous, found):
                return found
        raise ComputationError(
            f"the fit did not settle: after {_MOST_CONFIRMATIONS} confirmations by full solves the "
            f"parameters still move by more than {_SETTLED:g} of their standard errors"
        )

    def _reweighted(self, found: Optimum) -> Optimum:
        """Lessen the weight of outliers until nothing changes."""
        for turn in range(_MOST_REWEIGHTINGS):
            size = np.abs(self.residuals.deviations(found.prediction.values))
            # first Huber's weights, which have one optimum, then Tukey's, which forget outliers
            at_first = turn < _HUBER_TURNS
            self.residuals.down = (
                np.sqrt(_HUBER / np.maximum(size, _HUBER))
                if at_first
                else np.clip(1.0 - (size / _TUKEY) ** 2, 0.0, None)
            )
            # outliers can drive the first fit onto a bound, where it would stay
            origin = self._start if at_first else found.material
            previous, found = found, self.solve(origin)
            if not at_first and self._settled(previous, found):
                break
        return found

    def _settled(self, previous: Optimum, found: Optimum) -> bool:
        """Whether the parameters have moved too little for another confirmation to matter."""
        now, size = self._values(found.material), np.abs(self._values(found.material))
        least = np.minimum(
            _SETTLED * found.stderr, _SETTLED_RELATIVE * np.maximum(size, self._scale)
        )
        return bool(np.all(np.abs(now - self._values(previous.material)) <= least))

    def solve(self, start: Material) -> Optimum:
        """Find the optimum of the present model and weights.

        Raises
        ------
        InputError
            If a parameter starts outside its bounds.
        ComputationError
            See `solve_and_confirm`.
        """
        for name in self._varied:
            known, value = PARAMETERS[name], getattr(start, name)
            if not known.lower < value < known.upper:
                raise InputError(
                    f"{name} = {value:g} to start from, expected a value between "
                    f"{known.lower:g} and {known.upper:g} {known.unit}"
                )
        material, prediction, far = start, self._predict(start), _FAR
        squares = self._squares(prediction.values)
        for _ in range(_MOST_ROUNDS):
            found = self._round(material, prediction, far)
            here = self._values(material)
            near = np.maximum(_FOUND * found.stderr, _NEAR * np.abs(here))
            # the optimum is where the branch was solved
            if far < _NEAR or np.all(np.abs(self._values(found.material) - here) <= near):
                return replace(found, material=material, prediction=prediction)
            try:
                trial = self._predict(found.material)
                better = self._squares(trial.values)
            except ComputationError:
                better = np.inf
            if better > squares * (1.0 + _NEAR):
                far /= 4.0
                continue
            self.steps += 1
            material, prediction, squares = found.material, trial, better
            far = min(_FAR, 2.0 * far)
        raise ComputationError(f"the fit did not converge in {_MOST_ROUNDS} rounds")

    def _round(self, origin: Material, at: Prediction, far: float) -> Optimum:
        """Run Levenberg-Marquardt among materials near the one of a prediction."""
        value, (lower, upper) = self._values(origin) / self._scale, self._bounds
        room = far * np.maximum(np.abs(value), 0.1)
        low, high = np.maximum(lower, value - room), np.minimum(upper, value + room)
        # the search begins within its bounds
        inside = np.clip(value, low + 1e-6 * (high - low), high - 1e-6 * (high - low))
        # asked for twice, for the residuals and their derivatives
        predicted = lru_cache(maxsize=1)(at.nearby.predict)

        def residual(trial: Array) -> Array:
            try:
                return self.residuals.weighted(predicted(self._material(trial))[0])
            except ComputationError:
                return np.full(self.residuals.size, _UNSOLVED)

        def jacobian(trial: Array) -> Array:
            return self._jacobian(predicted(self._material(trial))[1])

        found = optimize.least_squares(
            residual,
            inside,
            jacobian,
            (low, high),
            x_scale="jac",
            ftol=_EXACT,
            xtol=_EXACT,
            gtol=None,
            max_nfev=200,
        )
        free = self.residuals.size - value.size
        covariance = _inverse(found.jac.T @ found.jac) * (2.0 * found.cost / max(free, 1))
        covariance = covariance if free > 0 else np.full_like(covariance, np.nan)
        variance = np.diag(covariance)
        stderr = np.sqrt(np.where(variance > 0, variance, np.inf))
        return Optimum(
            self._material(found.x),
            at,
            stderr * self._scale,
            covariance * np.outer(self._scale, self._scale),
        )

    def covariance(self, optimum: Optimum) -> Array:
        """Return the covariance of the varied parameters in their own units; NaN if singular.

        Noise differs between observables and along each of them by more than the weights know,
        so every datum's variance is taken from its own residual, enlarged by its leverage h
        (MacKinnon and White's HC3, J. Econometrics 29, 305 (1985)): C = A⁻¹ Jᵀ V J A⁻¹ with
        A = JᵀJ and V = r² / (1 − h)².
        """
        residual = self.residuals.weighted(optimum.prediction.values)
        jacobian = self._jacobian(optimum.prediction.slopes)
        inverse = _inverse(jacobian.T @ jacobian)
        if residual.size <= self._scale.size:
            return np.full_like(inverse, np.nan)
        leverage = np.einsum("ij,jk,ik->i", jacobian, inverse, jacobian)
        influence = inverse @ jacobian.T * (residual / np.maximum(1.0 - leverage, _LEAST_FREE))
        return np.asarray(influence @ influence.T * np.outer(self._scale, self._scale))

    def _values(self, material: Material) -> Array:
        return np.array([getattr(material, name) for name in self._varied])

    def _material(self, scaled: Array) -> Material:
        values = (scaled * self._scale).tolist()
        return self._start.model_copy(update=dict(zip(self._varied, values, strict=True)))

    def _jacobian(self, slopes: Array) -> Array:
        """Return the derivatives of the weighted residuals by the scaled parameters."""
        return self.residuals.jacobian(slopes[:, :, self._columns] * self._scale)

    def _squares(self, values: Array) -> float:
        """Return the sum of squares of the weighted residuals."""
        residual = self.residuals.weighted(values)
        return float(residual @ residual)

    def _predict(self, material: Material) -> Prediction:
        """Predict with the model, from the latest prediction; what was asked before is at hand."""
        known = self._known.get(material)
        if known is not None:
            return known
        near = next(reversed(self._known.values()), None)
        self.evaluations += 1
        try:
            prediction = self.model.predict(material, near)
        except ComputationError:
            if near is None:
                raise
            # a step too far to be followed from there
            prediction = self.model.predict(material)
        self._known[material] = prediction
        if len(self._known) > _AT_HAND:
            del self._known[next(iter(self._known))]
        if self._progress is not None:
            self._progress(self.evaluations, max(_USUAL_ROUNDS, self.evaluations))
        return prediction


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a matrix; NaN if it is singular."""
    try:
        return np.asarray(np.linalg.inv(matrix), dtype=float)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)
