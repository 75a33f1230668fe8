"""Levers drawn from what is known of one: how hot the tip of any of them may get at a bias.

Errors of priors and data are drawn, and the lever is found that they lead an estimate to, as by
`hotlever.estimate.sampling`: with residuals r in standard deviations and their Jacobian J, the x
at which Jᵀ (r(x) − r(0)) has changed by as much as the drawn errors would change it if all were
linear. Where there are no data yet these are draws from the priors. Each counts by how much more
probable it is than it was drawn. All are solved for at once, on a grid of places along the branch,
at which their curves are those of `hotlever.estimate.surrogate.CurveSurrogate`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hotlever.estimate.objective import Coordinates
from hotlever.estimate.surrogate import CurveSurrogate
from hotlever.lever.branch import TIP_RISE
from hotlever.lever.observables import observed, observed_by
from hotlever.probe import Circuit
from hotlever.types import Array
from hotlever.work import one_blas_thread


@dataclass(frozen=True)
class DrawOptions:
    """How levers are drawn.

    Attributes
    ----------
    count : int
        So many; of as many the share of one in a hundred is off by a quarter of itself by chance.
    count_of_priors : int
        So many where there are no data, since priors alone cost next to nothing to draw from.
    seed : int
        The same levers are drawn each time, so that rows, not chance, move what is said.
    places : int
        Of the grid along the branch. Between two of 200 a tip is off by 0.02 K.
    together : int
        Numbers of one Jacobian that are held at once, which bounds the memory.
    rounds : int
        Steps by which levers are looked for.
    accuracy : float
        Standard deviations within which one has to be found; else it does not count.
    fewest_effective : float
        Levers of equal weight that there have to be; otherwise the linearised ones are taken, and
        `LikelyLevers.first_order` says so.
    """

    count: int = 2000
    count_of_priors: int = 6000
    seed: int = 0
    places: int = 200
    together: int = 1_000_000
    rounds: int = 60
    accuracy: float = 0.05
    fewest_effective: float = 400.0


@dataclass(frozen=True)
class Knowledge:
    """What is known of a lever: priors as they are, data by their residuals.

    Attributes
    ----------
    before : ndarray, shape (m, q)
        Derivatives of what is linear, in standard deviations, by the unknowns: those of priors, and
        of rows that may be measured yet. The unknowns are the coordinates of p parameters, and
        behind them the scales of meters.
    deviations : ndarray, shape (m,)
        How far the most likely lever is from each of these, in standard deviations.
    bias_V : ndarray, shape (n,)
        Of the rows that were measured; none if there are no data.
    measured, weights : ndarray, shape (observables, n)
        What they show, and the weights of that, one over standard errors; 0 where nothing counts.
    scales : ndarray, shape (observables, n, q - p)
        How what is shown changes with the scales.
    """

    before: Array
    deviations: Array
    bias_V: Array
    measured: Array
    weights: Array
    scales: Array


class Drawn(NamedTuple):
    """Levers that were drawn: their points, (count, p), and weights, (count,).

    To first order these are normal where data say something.
    """

    points: Array
    weights: Array
    first_order: bool


class LikelyLevers:
    """Levers that are as likely as what is known says.

    Parameters
    ----------
    surrogate : CurveSurrogate
        Levers like the most likely one.
    coordinates : Coordinates
        Of its parameters, (p,).
    known : Knowledge
    options : DrawOptions, optional
    """

    def __init__(
        self,
        surrogate: CurveSurrogate,
        coordinates: Coordinates,
        known: Knowledge,
        options: DrawOptions | None = None,
    ) -> None:
        self._surrogate, self._coordinates, self._known = surrogate, coordinates, known
        self._options = options or DrawOptions()
        self._point = coordinates.point(surrogate.probe.values(surrogate.names))
        u = np.linspace(0.0, surrogate.branch.end_u, self._options.places + 1)
        self._shown, self._powers = surrogate.branch.curve(u), surrogate.rates_at(u)

    def tips(self, bias_V: Array) -> Array:
        """Return the tips (K) of all of them at some biases (V), (count, n).

        Infinite where something has melted.
        """
        ramp, tip_K = self._ramps
        return np.stack(
            [
                np.interp(bias_V, reached, tip, right=np.inf)
                for reached, tip in zip(ramp.T, tip_K.T, strict=True)
            ]
        )

    @cached_property
    def _ramps(self) -> tuple[Array, Array]:
        """The bias (V) that a slow ramp has reached, and the tip (K), along all of them."""
        values = self._coordinates.values(self._point + self._drawn.points)
        outputs, ramp = self._curves(values)
        return ramp, outputs[TIP_RISE] + self._circuit(values).base_temperature_K

    def quantiles(self, bias_V: Array, shares: Array) -> Array:
        """Return below what (K) shares (m,) of the tips lie at some biases (V), (m, n)."""
        tips, weights = self.tips(bias_V), self._drawn.weights
        order = np.argsort(tips, axis=0)
        share = np.cumsum(weights[order], axis=0) / weights.sum()
        rows = [np.searchsorted(column, shares).clip(max=len(tips) - 1) for column in share.T]
        return np.take_along_axis(np.take_along_axis(tips, order, 0), np.transpose(rows), 0)

    def band(self, bias_V: Array) -> Array:
        """Return between what (K) 95 % of the tips lie at some biases (V), (2, n)."""
        return self.quantiles(bias_V, np.array([0.025, 0.975]))

    @property
    def first_order(self) -> bool:
        """Whether they are likely to first order alone, since too few of those drawn counted."""
        return self._drawn.first_order

    # --- drawing ----------------------------------------------------------------------------------

    @cached_property
    @one_blas_thread
    def _drawn(self) -> Drawn:
        """The levers."""
        options, known, count = self._options, self._known, self._point.size
        size = known.before.shape[1]
        (values,), (jacobian,) = self._residuals(np.zeros((1, size)))
        information = known.before.T @ known.before + jacobian.T @ jacobian
        counts = known.weights > 0.0
        left = values - known.weights[counts] * known.measured[counts]
        # less what another mesh, or the scales of meters, would make of it
        moved = known.before.T @ known.deviations + left @ jacobian
        left -= jacobian @ np.linalg.solve(information, moved)
        # along these axes all that is unknown is independent, and of unit variance
        axes = np.linalg.cholesky(np.linalg.inv(information))
        many = options.count if values.size else options.count_of_priors
        errors = np.random.default_rng(options.seed).standard_normal((many, size))
        linear = Drawn((errors @ axes.T)[:, :count], np.ones(many), bool(values.size))
        if not values.size:
            return linear
        each = max(1, options.together // jacobian.size)
        found = [
            self._found(errors[first : first + each], values, left, jacobian @ axes, axes)
            for first in range(0, many, each)
        ]
        places, logarithms = (np.concatenate(parts) for parts in zip(*found, strict=True))
        if np.isneginf(logarithms).all():
            return linear
        weights = np.exp(logarithms - logarithms.max())
        if weights.sum() ** 2 < options.fewest_effective * float(weights @ weights):
            return linear
        return Drawn((places @ axes.T)[:, :count], weights, False)

    def _found(
        self, errors: Array, values: Array, left: Array, jacobian: Array, axes: Array
    ) -> tuple[Array, Array]:
        """Return the places along the axes that errors (n, q) lead to, and the logarithms of their
        weights: minus infinity where a lever was not found.

        By Newton's method, with shorter steps where they lead farther away.
        """
        options, linear = self._options, np.eye(axes.shape[0]) - jacobian.T @ jacobian
        place, step, open_ = np.zeros_like(errors), errors.copy(), np.arange(len(errors))
        share, away = np.ones(len(errors)), np.linalg.norm(errors, axis=1)
        logarithms = np.full(len(errors), -np.inf)
        for _ in range(options.rounds):
            trial = place[open_] + share[open_, None] * step[open_]
            shown, by = self._residuals(trial @ axes.T)
            changed = shown - values
            missing = errors[open_] - changed @ jacobian - trial @ linear
            distance = np.linalg.norm(missing, axis=1)
            nearer = distance < away[open_]
            share[open_] = np.where(nearer, np.minimum(1.0, 2.0 * share[open_]), share[open_] / 3.0)
            some = open_[nearer]
            place[some], away[some] = trial[nearer], distance[nearer]
            both = jacobian.T @ (by[nearer] @ axes) + linear
            step[some] = np.linalg.solve(both, missing[nearer, :, None])[..., 0]
            squares = np.sum(changed[nearer] ** 2, axis=1)
            squares += np.einsum("ni,ij,nj->n", place[some], linear, place[some])
            # what the data leave over counts where the residuals bend, and not to first order
            squares += 2.0 * (changed[nearer] - place[some] @ jacobian.T) @ left
            logarithms[some] = 0.5 * (np.sum(errors[some] ** 2, axis=1) - squares)
            logarithms[some] -= np.linalg.slogdet(both)[1]
            open_ = open_[away[open_] > options.accuracy]
            if not open_.size:
                break
        logarithms[open_] = -np.inf
        return place, logarithms

    # --- what they show ---------------------------------------------------------------------------

    def _circuit(self, values: Array) -> Circuit:
        """Return the circuits of levers with some parameters (n, p): its own are columns, (n,)."""
        surrogate = self._surrogate
        columns = zip(surrogate.names, values.T, strict=True)
        own = {name: column for name, column in columns if name in Circuit.model_fields}
        return surrogate.probe.circuit.model_copy(update=own)

    def _curves(self, values: Array) -> tuple[Array, Array]:
        """Return what levers with some parameters (n, p) show along their branches.

        V_l, I_h, V_r and the rise of the tip, (4, places, n), and the bias (V) that a slow ramp has
        reached there.
        """
        powers = np.tensordot(self._powers, self._surrogate.distance(values), (2, 1))
        # a step of the search that goes far too far shows something large, which is no nearer
        outputs = np.moveaxis(self._shown[..., None] * np.exp(np.clip(powers, -50.0, 50.0)), 1, 0)
        bias = self._circuit(values).bias(outputs[0], outputs[1])
        return outputs, np.maximum.accumulate(bias, axis=0)

    def _residuals(self, x: Array) -> tuple[Array, Array]:
        """Return what data show of levers with unknowns (n, q), in standard deviations, (n, m).

        And its derivatives by the unknowns, (n, m, q).
        """
        known, size = self._known, self._point.size
        counts = known.weights > 0.0
        if not counts.any():
            return np.zeros((len(x), 0)), np.zeros((len(x), 0, x.shape[1]))
        # a step that goes far too far, by a factor of 10²¹, shows nothing, and is no nearer
        factors = np.where(self._coordinates.positive, x[:, :size], 0.0)
        near = np.asarray(np.isfinite(x).all(axis=1) & (np.abs(factors) < 50.0).all(axis=1))
        x = np.where(near[:, None], x, 0.0)
        point = self._point + x[:, :size]
        values, slopes = self._at_rows(self._coordinates.values(point))
        values[~near] = np.nan
        slopes = slopes * self._coordinates.rates(point)[:, None, None]
        weights, of_scales = known.weights[counts], known.scales[counts]
        shown = values[:, counts] + x[:, size:] @ of_scales.T
        by = np.concatenate(
            [slopes[:, counts], np.broadcast_to(of_scales, (len(x), *of_scales.shape))], axis=-1
        )
        return weights * shown, weights[:, None] * by

    def _at_rows(self, parameters: Array) -> tuple[Array, Array]:
        """Return what levers with parameters (n, p) show at the rows that were measured.

        `hotlever.quantities.FITTED`, (n, observables, rows), and derivatives by the parameters.
        """
        surrogate, bias = self._surrogate, np.abs(self._known.bias_V)
        count, size = parameters.shape
        along_branch, ramp = self._curves(parameters)
        series = np.reshape(self._circuit(parameters).series_kohm, (-1, 1))
        grid = np.arange(len(ramp), dtype=float)
        place = np.stack([np.interp(bias, reached, grid) for reached in ramp.T])
        low = np.minimum(place.astype(int), grid.size - 2)
        part, outputs, along = _reached(along_branch, low, bias, series)
        part = part[..., None, None]
        powers = (1.0 - part) * self._powers[low] + part * self._powers[low + 1]
        by = outputs[..., None] * powers / surrogate.unit
        bias_by = by[..., 0, :] + series[..., None] * by[..., 1, :]
        if "series_resistance_ohm" in surrogate.names:
            bias_by[..., surrogate.names.index("series_resistance_ohm")] += 1e-3 * outputs[..., 1]
        # the circuit moves the state along its branch until the bias is what it was
        least = surrogate.rows.steepness * bias / np.maximum(place, 1.0)
        slope = np.maximum(along[..., 0] + series * along[..., 1], least)
        by -= along[..., None] * (bias_by / slope[..., None])[..., None, :]
        flat = self._circuit(np.repeat(parameters, bias.size, axis=0))
        outputs, by = np.moveaxis(outputs, -1, 0), np.moveaxis(by, 2, 0)
        values = observed(flat, outputs.reshape(4, -1)).reshape(-1, count, bias.size)
        slopes = observed_by(
            surrogate.probe.circuit,
            outputs.reshape(4, -1),
            by.reshape(4, -1, size),
            surrogate.names,
        ).reshape(-1, count, bias.size, size)
        of_each = np.moveaxis(values, 1, 0), np.moveaxis(slopes, 1, 0)
        if not surrogate.contact.there:
            return of_each
        pairs = [
            surrogate.contact.differentiated(*each)
            for each in zip(*of_each, parameters, strict=True)
        ]
        return np.stack([each for each, _ in pairs]), np.stack([each for _, each in pairs])


def _reached(
    curves: Array, low: Array, bias_V: Array, series_kohm: Array
) -> tuple[Array, Array, Array]:
    """Return where between two places levers reach biases, what is shown there, and its slope.

    By the cubic through four places: where chords meet, the search for levers stuck.

    Parameters
    ----------
    curves : ndarray, shape (4, places, n)
        What levers show, V_l and I_h first.
    low : ndarray of int, shape (n, m)
        The places behind which, and before the next, they reach the biases.
    bias_V : ndarray, shape (m,)
    series_kohm : ndarray, shape (n, 1) or (1, 1)

    Returns
    -------
    part : ndarray, shape (n, m)
        How far behind the lower place, of the distance to the next.
    shown, along : ndarray, shape (n, m, 4)
        What is shown, and its change by one place.
    """
    first = np.clip(low - 1, 0, curves.shape[1] - 4)
    lever = np.arange(len(low))[:, None]
    differences, rest = [], np.stack([curves[:, first + place, lever] for place in range(4)])
    for _ in range(4):
        differences.append(rest[0])
        rest = np.diff(rest, axis=0)

    def cubic(away: Array) -> tuple[Array, Array]:
        value, once, twice, thrice = differences
        return (
            value + away * (once + (away - 1.0) / 2.0 * (twice + (away - 2.0) / 3.0 * thrice)),
            once + (away - 0.5) * twice + (away * (away / 2.0 - 1.0) + 1.0 / 3.0) * thrice,
        )

    def bias(shown: Array) -> Array:
        return np.asarray(shown[0] + series_kohm * shown[1])

    start = low - first
    lower, upper = (bias(curves[:, low + one, lever]) for one in (0, 1))
    rise = np.maximum(upper - lower, np.finfo(float).eps)
    part = np.clip((bias_V - lower) / rise, 0.0, 1.0)
    for _ in range(3):
        shown, along = cubic(start + part)
        # the cubic may be flat near a fold, where the chord is not
        steepness = np.maximum(bias(along), 0.1 * rise)
        part = np.clip(part - (bias(shown) - bias_V) / steepness, 0.0, 1.0)
    shown, along = cubic(start + part)
    return part, np.moveaxis(shown, 0, -1), np.moveaxis(along, 0, -1)
