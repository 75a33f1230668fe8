"""An experiment: the forward map from a lever's parameters to what is measured, with derivatives.

A lever is measured at rest or in time (`hotlever.estimate.experiment_in_time`). Either solves a
lever that is fast, and can be corrected by the full one at the probe of a prediction. Parameters
are what `hotlever.probe.probe_parameters` names: of the material, dimensions, the series
resistance.

At rest the fast lever is a reduced one where the geometry has been reduced before, or else the same
lever on a coarse mesh. Where the full lever is solved too, the difference of the two branches is
added to the fast one's from then on.

Over a sample one lever is measured in several positions, with all parameters in common: in contact,
as the probe states it; and away from the sample, where no heat passes the interface, and in air the
surface is further away. In vacuum all distances are one position. In air a few are solved, and the
rows between them are interpolated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from typing import Any, Protocol, Self

import numpy as np
from scipy.interpolate import BSpline

from hotlever.contact.law import INTERFACE
from hotlever.errors import ComputationError
from hotlever.estimate.surrogate import CurveSurrogate, Rows, Surrogate
from hotlever.lever.branch import TIP_RISE, Branch, Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.observables import Linearised, by_parameter
from hotlever.lever.reduced_lever import (
    ReducedLever,
    cached_reduction,
    can_be_reduced,
    known_reduction,
)
from hotlever.lever.similar import SimilarLevers
from hotlever.piecewise import spline_through
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.probe.tip import OUT_OF_CONTACT
from hotlever.quantities import FITTED
from hotlever.types import Array, Mask, Progress
from hotlever.units import MOST_BIAS
from hotlever.work import one_blas_thread

#: Where predictions have the tip temperature.
TIP = list(FITTED).index("tip")


@dataclass(frozen=True)
class Prediction:
    """What an instrument and a thermometer would show of a probe.

    Attributes
    ----------
    probe : Probe
    values : ndarray, shape (observables, n)
        `hotlever.quantities.OBSERVABLES` at the rows of the measurement, and behind them those of
        a contact, if there is one.
    slopes : ndarray, shape (observables, n, k)
        Derivatives by the experiment's parameters.
    surrogate : Surrogate
        Predictions for similar probes.
    columns : dict of str to ndarray, shape (m,)
        What it shows where it was solved, by the names that a sweep or a history has, first that of
        the bias or the time; ``bias_V``, ``current_mA`` and ``tip_K`` among them.
    tip_slopes : ndarray, shape (m, k)
        Derivatives of the last.
    """

    probe: Probe
    values: Array
    slopes: Array
    surrogate: Surrogate
    columns: dict[str, Array]
    tip_slopes: Array

    @property
    def light(self) -> Self:
        """The same without factorised matrices, which only the next lever is solved with."""
        return self

    @property
    def without_state(self) -> Mask:
        """Which rows, (n,), the lever has no state for, so that the nearest one stands there."""
        return np.zeros(self.values.shape[1], dtype=bool)


def named(values: Array) -> dict[str, Array]:
    """Return what is shown, (observables, n), by the names that a sweep or a history has."""
    return {column.name: row for column, row in zip(FITTED.values(), values, strict=False)}


class Experiment(Protocol):
    """Predicts a measurement for any probe that is similar to the one it was made of."""

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters of the derivatives, (k,)."""
        ...

    def predict(self, probe: Probe, near: Any = None) -> Prediction:
        """Predict the measurement of a probe, starting from the prediction for a similar one.

        Raises
        ------
        ComputationError
            If the lever cannot be solved.
        """
        ...

    def confirmed(self, at: Any) -> Self:
        """Return an experiment that is exact at the probe of a prediction.

        Raises
        ------
        ComputationError
            If the full lever cannot be solved there.
        """
        ...


# Makes the forward model of a probe at some biases (V) or, in time, times (µs).
Model = Callable[[Probe, Array], Experiment]
# Called with each prediction on the way of a search, which comes nearer and nearer to the data.
Seen = Callable[[Prediction], None]


class Predictor:
    """Predicts with an experiment, each lever from the latest one; the latest are at hand.

    Parameters
    ----------
    experiment : Experiment
        Kept as the attribute of this name, as confirmed last.
    progress : callable, optional
        Called with the levers solved and how many there usually are.
    seen : callable, optional
        Called with each prediction that is compared with the data.
    near : Prediction, optional
        Of a lever similar to that at which a search begins.
    before : int
        Levers solved before, by earlier searches of the same estimate.

    Attributes
    ----------
    evaluations : int
        Levers solved, with those.
    """

    def __init__(
        self,
        experiment: Experiment,
        progress: Progress | None = None,
        seen: Seen | None = None,
        near: Prediction | None = None,
        before: int = 0,
    ) -> None:
        self.experiment, self.evaluations = experiment, before
        self._progress, self._seen = progress, seen
        self._at_hand = {} if near is None else {near.probe: near}

    def predict(self, probe: Probe) -> Prediction:
        """Predict from the latest prediction, unless what is asked is at hand."""
        if probe not in self._at_hand:
            self._at_hand[probe] = self._solved(probe)
        self._at_hand[probe] = self._at_hand.pop(probe)  # the latest
        if len(self._at_hand) > 5:
            del self._at_hand[next(iter(self._at_hand))]
        return self._at_hand[probe]

    def _solved(self, probe: Probe) -> Prediction:
        near = next(reversed(self._at_hand.values()), None)
        self._at_hand = {other: each.light for other, each in self._at_hand.items()}
        self.evaluations += 1
        try:
            prediction = self.experiment.predict(probe, near)
        except ComputationError:
            if near is None:
                raise
            # a step too far to be followed from there
            prediction = self.experiment.predict(probe)
        if self._progress is not None:
            # most searches solve eight
            self._progress(self.evaluations, max(8, self.evaluations))
        if self._seen is not None:
            self._seen(prediction)
        return prediction

    def others(self, prediction: Prediction) -> list[Prediction]:
        """Return the predictions at hand beside one."""
        return [other for other in self._at_hand.values() if other is not prediction]

    def confirm(self, at: Prediction) -> bool:
        """Make the experiment exact at a prediction; return whether that makes another one.

        Raises
        ------
        ComputationError
            If the full lever cannot be solved there.
        """
        confirmed = self.experiment.confirmed(at)
        if confirmed is self.experiment:
            return False
        self.experiment = confirmed
        others, self._at_hand = self.others(at), {}
        for other in others:
            # with what the fast lever lacked, it may melt below the highest bias
            with suppress(ComputationError):
                self._at_hand[other.probe] = confirmed.predict(other.probe, other)
        self._at_hand[at.probe] = confirmed.predict(at.probe, at)
        return True


# --- at rest --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PredictionAtRest(Prediction):
    """What an instrument and a thermometer would show at some biases.

    Attributes
    ----------
    surrogate : CurveSurrogate
    linearised : Linearised
        What it was read from, not corrected.
    away : tuple of PredictionAtRest
        Of levers away from a sample, see `ExperimentOverSample`; then what it was read from is the
        lever in contact.
    """

    surrogate: CurveSurrogate
    linearised: Linearised
    away: tuple[PredictionAtRest, ...] = ()

    @property
    def light(self) -> Self:
        """See `Prediction`."""
        away = tuple(each.light for each in self.away)
        return replace(self, linearised=replace(self.linearised, factors=None), away=away)

    @property
    def without_state(self) -> Mask:
        """See `Prediction`."""
        if self.away:  # rows over a sample are weighted sums of what several levers show
            return super().without_state
        return self.surrogate.rows.states(self.surrogate.branch, self.probe.circuit)[1] > 1.0


@dataclass(frozen=True)
class Correction:
    """What a fast lever lacks, exact to first order at one place among the parameters.

    `values` are those of V_l (V), I_h (mA), V_r (V) and the rise of the tip (K) by u; `slopes` of
    their derivatives by the parameters.
    """

    at: Array
    values: BSpline
    slopes: BSpline

    def added(self, branch: Branch, at: Array) -> Branch:
        """Return a branch of the fast lever with what it lacks, for some values of parameters."""
        offset, u = at - self.at, branch.u
        changes, slopes = (self.values(u, n) + self.slopes(u, n) @ offset for n in (0, 1))
        return branch.shifted(changes, slopes)


@dataclass(frozen=True)
class ExperimentAtRest:
    """Predicts a measurement at some biases (V, in any order) with a lever that is solved fast.

    The full lever corrects the fast one, unless it is None. What is predicted depends on the
    probe alone: correcting the model makes another one. Derivatives are by ``names``, and
    are corrected too if ``first_order``. Where it is known what was measured, as ``measured``, each
    bias stands for the state nearest to that (`hotlever.estimate.surrogate`), otherwise for that
    of a slow ramp. Branches reach to the highest bias, or ``until_it_melts``.
    """

    fast: SimilarLevers | ReducedLever
    full: SimilarLevers | None
    bias: Array
    names: tuple[str, ...]
    first_order: bool = True
    correction: Correction | None = None
    measured: Array | None = None
    until_it_melts: bool = False

    def measuring(
        self, bias: Array, measured: Array | None, distance_um: Array | None = None
    ) -> ExperimentAtRest:
        """Return the model at other biases (V), with what was measured there, if that is known.

        Distances count over a sample, see `ExperimentOverSample`.
        """
        return replace(self, bias=bias, measured=measured)

    def coarse(self) -> Self:
        """Return the model with a lever that is solved for any parameters, not corrected."""
        fast = self.fast.for_any_parameters()
        return self if fast is self.fast else replace(self, fast=fast, correction=None)

    def until_melting(self) -> Self:
        """Return the model with branches that end where something melts, not corrected."""
        return replace(self, until_it_melts=True, correction=None)

    def drawn_anew(self, probe: Probe) -> Self:
        """Return the model on meshes of a probe's own drawing, not corrected."""
        full = None if self.full is None else SimilarLevers(Lever(probe))
        return replace(self, fast=SimilarLevers(Lever(probe, COARSE)), full=full, correction=None)

    def reach(self, probe: Probe) -> Reach:
        """Return how far the branch of a probe must go: beyond zero if it does not start cold.

        Similar levers have no bias elsewhere.
        """
        lowest, highest = min(float(self.bias.min()), 0.0), max(float(self.bias.max()), 0.0)
        if self.until_it_melts:
            highest = MOST_BIAS
        if not probe.circuit.starts_cold:
            lowest -= 0.05 * (highest - lowest)
        return Reach(probe.circuit, highest, lowest or None)

    @one_blas_thread
    def predict(self, probe: Probe, near: PredictionAtRest | None = None) -> PredictionAtRest:
        """Predict the measurement of a probe, starting from a similar one's.

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of the biases.
        """
        linearised = None if near is None else near.linearised
        if linearised is None or linearised.probe != probe:
            linearised = self.fast.linearised(probe, self.reach(probe), linearised, self.names)
        return self.shown_by(linearised)

    def shown_by(self, linearised: Linearised) -> PredictionAtRest:
        """Return the prediction that is read from the fast lever of a probe."""
        probe = linearised.probe
        branch, by_parameter = linearised.branch, linearised.output_slopes
        if self.correction:
            branch = self.correction.added(branch, probe.values(self.names))
            by_parameter = by_parameter + self.correction.slopes(branch.u)
        rows = Rows(self.bias, self.measured)
        prediction = rows.differentiated(branch, by_parameter, probe.circuit, self.names)
        surrogate = CurveSurrogate(probe, self.names, branch, by_parameter, rows)
        values, slopes = surrogate.contact.differentiated(*prediction, probe.values(self.names))
        lever = probe.circuit.lever_voltage(self.bias, values[0])
        columns = {"bias_V": self.bias, "lever_V": lever, **named(values)}
        return PredictionAtRest(probe, values, slopes, surrogate, columns, slopes[TIP], linearised)

    @one_blas_thread
    def confirmed(self, at: PredictionAtRest) -> Self:
        """Return a model that is exact at the probe of a prediction, if so wanted to first order.

        Raises
        ------
        ComputationError
            If the full lever cannot be solved there.
        """
        if self.full is None:
            return self
        fast, probe = at.linearised.branch, at.probe
        equations = self.full.equations(probe, self.names)
        u, x = self.fast.full_states(fast, equations)
        by_fast, parametrisation = at.linearised.output_slopes_at(u), fast.parametrisation
        values = np.zeros(by_fast.shape[:2])
        values[:, :TIP_RISE] = equations.observed(x).T - fast.curve(u)[:, :TIP_RISE]
        values[:, TIP_RISE] = equations.space.tip_rise(x) - fast.rise(u)
        slopes = np.zeros(by_fast.shape)
        if self.first_order:
            constraint = parametrisation.constraint(u)
            slopes = by_parameter(equations, x, self.names, constraint=constraint) - by_fast
        if fast.starts_cold:
            # without power nothing is lacking
            cold = int(np.searchsorted(u, 0.0))
            u, values, slopes = (np.insert(each, cold, 0.0, axis=0) for each in (u, values, slopes))
        lacking = spline_through(u, values), spline_through(u, slopes)
        return replace(self, correction=Correction(probe.values(self.names), *lacking))

    def exact_at(self, probe: Probe) -> tuple[Self, PredictionAtRest]:
        """Return a model that is exact at a probe, and its prediction there.

        Raises
        ------
        ComputationError
            If the lever cannot be solved.
        """
        uncorrected = self.predict(probe)
        exact = self.confirmed(uncorrected)
        return exact, exact.predict(probe, uncorrected)


def experiment_of(
    probe: Probe,
    bias: Array,
    *,
    names: tuple[str, ...] | None = None,
    reduce: bool = False,
    distance_um: Array | None = None,
) -> ExperimentAtRest:
    """Return the fastest forward model of a probe.

    Parameters
    ----------
    probe : Probe
    bias : ndarray, shape (n,)
    names : tuple of str
        Parameters of the derivatives; by default what a fit usually varies. A reduced lever does
        not serve all, see `hotlever.lever.reduced_lever.can_be_reduced`.
    reduce : bool
        Make and keep a reduced lever (some seconds) if the geometry has none yet: it pays where
        more than one fit is to come.
    distance_um : ndarray, shape (n,), optional
        Of the apex from a sample, see `with_distances`.
    """
    lever, reduced = Lever(probe), None
    names = usual_parameters(probe) if names is None else names
    if can_be_reduced(probe, names):
        reduced = cached_reduction(lever, names=names) if reduce else known_reduction(lever, names)
    fast = reduced or SimilarLevers(Lever(probe, COARSE))
    experiment = ExperimentAtRest(fast, SimilarLevers(lever), bias, names)
    return with_distances(experiment, probe, distance_um)


# --- over a sample --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Away:
    """Positions away from the sample, (k,).

    Attributes
    ----------
    changes : tuple of mapping of str to float
        What the probe has there in place of its values in contact.
    height_um : float
        Of the tip.
    places : ndarray, shape (k,)
        Logarithms of the distances from sample to lever; empty in vacuum.
    """

    changes: tuple[Mapping[str, float], ...]
    height_um: float
    places: Array

    @classmethod
    def of(cls, probe: Probe, distance_um: Array, most: int = 7) -> Away:
        """Return those that rows at distances of a probe's apex need, (n,), and `most` in air."""
        assert probe.tip is not None
        change, height = {INTERFACE: OUT_OF_CONTACT}, probe.tip.height_um
        out = distance_um[distance_um > 0.0]
        if probe.surroundings.medium == "vacuum" or not out.size:
            return cls((change,), height, np.empty(0))
        places = np.unique(np.log(height + out))
        if places.size > most:
            # Chebyshev's, between which a polynomial follows a smooth function closely
            turns = np.cos(np.linspace(np.pi, 0.0, most))
            places = (places[-1] + places[0] + turns * np.ptp(places)) / 2.0
        gaps = np.exp(places).tolist()
        return cls(tuple({**change, "surface_gap_um": gap} for gap in gaps), height, places)

    def probes(self, probe: Probe) -> list[Probe]:
        """Return a probe in contact as it is there."""
        return [probe.replace(change) for change in self.changes]

    def weights(self, distance_um: Array) -> Array:
        """Return how much rows, (n,), show of the lever in contact and of these, (1 + k, n)."""
        out = distance_um > 0.0
        if not self.places.size:
            return np.stack([~out, out]).astype(float)
        # Lagrange's polynomials
        at, same = np.log(self.height_um + distance_um[out]), np.eye(self.places.size, dtype=bool)
        away = np.where(same, 1.0, self.places[:, None] - self.places)
        factors = np.where(same, 1.0, (at[:, None, None] - self.places) / away)
        weights = np.zeros((1 + self.places.size, out.size))
        weights[0], weights[1:, out] = ~out, factors.prod(axis=-1).T
        return weights


def _mixed(weights: Array, each: Sequence[Array]) -> Array:
    """Return what rows show, (m, n, ...), of what each lever shows at all of them."""
    return np.asarray(np.einsum("kn,kmn...->mn...", weights, np.stack(each)))


class SurrogateOverSample(CurveSurrogate):
    """What is shown over a sample by levers near one; its branch is that in contact.

    Parameters
    ----------
    touching : CurveSurrogate
    away : sequence of CurveSurrogate
        With fewer parameters.
    weights : ndarray, shape (1 + k, n)
        See `Away`.
    """

    def __init__(
        self, touching: CurveSurrogate, away: Sequence[CurveSurrogate], weights: Array
    ) -> None:
        own = touching
        super().__init__(own.probe, own.names, own.branch, own.by_parameter, own.rows)
        self._away, self._weights = away, weights
        self._columns = [[self.names.index(name) for name in each.names] for each in away]

    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """See `hotlever.estimate.surrogate.Surrogate`."""
        pairs = zip(self._away, self._columns, strict=True)
        others = [each.predict(parameters[columns]) for each, columns in pairs]
        return self.mixed(super().predict(parameters), others)

    def mixed(
        self, touching: tuple[Array, Array], away: Sequence[tuple[Array, Array]]
    ) -> tuple[Array, Array]:
        """Return values and slopes at the rows, of those that each lever has at all of them."""
        values, slopes = [touching[0]], [touching[1]]
        for (each, by_own), columns in zip(away, self._columns, strict=True):
            by_all = np.zeros_like(touching[1])
            by_all[..., columns] = by_own
            values.append(each)
            slopes.append(by_all)
        return _mixed(self._weights, values), _mixed(self._weights, slopes)

    def values_at(self, parameters: Array) -> Array:
        """See `hotlever.estimate.surrogate.Surrogate`."""
        pairs = zip(self._away, self._columns, strict=True)
        others = [each.values_at(parameters[columns]) for each, columns in pairs]
        return _mixed(self._weights, [super().values_at(parameters), *others])


@dataclass(frozen=True)
class ExperimentOverSample(ExperimentAtRest):
    """Predicts a measurement over a sample.

    Attributes
    ----------
    positions : Away
    away : tuple of ExperimentAtRest
        One for each position, without the parameters that do not matter there.
    weights : ndarray, shape (1 + k, n)
        See `Away`.
    """

    positions: Away = field(kw_only=True)
    away: tuple[ExperimentAtRest, ...] = field(kw_only=True)
    weights: Array = field(kw_only=True)

    @classmethod
    def of(cls, touching: ExperimentAtRest, probe: Probe, distance_um: Array) -> Self:
        """Return that of a lever in contact, at rows with distances of its apex (µm)."""
        positions = Away.of(probe, distance_um)
        own = {field.name: getattr(touching, field.name) for field in fields(touching)}
        names = tuple(name for name in touching.names if name not in positions.changes[0])
        away = tuple(
            replace(touching.drawn_anew(each), names=names) for each in positions.probes(probe)
        )
        weights = positions.weights(distance_um)
        return cls(**own, positions=positions, away=away, weights=weights)

    def measuring(
        self, bias: Array, measured: Array | None, distance_um: Array | None = None
    ) -> ExperimentAtRest:
        """Return the model at other rows; of the lever in contact where no distance is said."""
        if distance_um is None:
            names = [field.name for field in fields(ExperimentAtRest)]
            own = ExperimentAtRest(**{name: getattr(self, name) for name in names})
            return own.measuring(bias, measured)
        away = tuple(each.measuring(bias, measured) for each in self.away)
        weights = self.positions.weights(distance_um)
        return replace(self, bias=bias, measured=measured, away=away, weights=weights)

    def coarse(self) -> Self:
        """See `ExperimentAtRest.coarse`."""
        return replace(super().coarse(), away=tuple(each.coarse() for each in self.away))

    def until_melting(self) -> Self:
        """See `ExperimentAtRest.until_melting`."""
        away = tuple(each.until_melting() for each in self.away)
        return replace(super().until_melting(), away=away)

    def drawn_anew(self, probe: Probe) -> Self:
        """See `ExperimentAtRest.drawn_anew`."""
        pairs = zip(self.away, self.positions.probes(probe), strict=True)
        away = tuple(each.drawn_anew(there) for each, there in pairs)
        return replace(super().drawn_anew(probe), away=away)

    def predict(self, probe: Probe, near: PredictionAtRest | None = None) -> PredictionAtRest:
        """See `ExperimentAtRest.predict`."""
        own = super().predict(probe, near)
        nearby = (None,) * len(self.away) if near is None else near.away
        trios = zip(self.away, self.positions.probes(probe), nearby, strict=True)
        away = tuple(each.predict(there, other) for each, there, other in trios)
        surrogate = SurrogateOverSample(
            own.surrogate, [each.surrogate for each in away], self.weights
        )
        every = [(each.values, each.slopes) for each in (own, *away)]
        values, slopes = surrogate.mixed(every[0], every[1:])
        lever = probe.circuit.lever_voltage(self.bias, values[0])
        columns = {**own.columns, "lever_V": lever, **named(values)}
        return PredictionAtRest(
            probe, values, slopes, surrogate, columns, slopes[TIP], own.linearised, away
        )

    def confirmed(self, at: PredictionAtRest) -> Self:
        """See `ExperimentAtRest.confirmed`."""
        if self.full is None:
            return self
        pairs = zip(self.away, at.away, strict=True)
        away = tuple(each.confirmed(there) for each, there in pairs)
        return replace(super().confirmed(at), away=away)


def with_distances(
    experiment: ExperimentAtRest, probe: Probe, distance_um: Array | None
) -> ExperimentAtRest:
    """Return an experiment with its rows at distances from a sample (µm), if they have some."""
    if probe.contact is None or distance_um is None or not (distance_um > 0.0).any():
        return experiment
    return ExperimentOverSample.of(experiment, probe, distance_um)
