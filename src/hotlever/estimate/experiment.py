"""An experiment: the forward map from a lever's parameters to what is measured, with derivatives.

A lever is measured at rest or in time (`hotlever.estimate.experiment_in_time`). Either solves a
lever that is fast, and can be corrected by the full one at the probe of a prediction.

At rest the fast lever is a reduced one where the geometry has been reduced before, or else the same
lever on a coarse mesh. Where the full lever is solved too, the difference of the two branches is
added to the fast one's from then on. Parameters are what `hotlever.probe.probe_parameters` names:
of the material, dimensions, the series resistance.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from scipy.interpolate import BSpline

from hotlever.errors import ComputationError
from hotlever.estimate.surrogate import CurveSurrogate, Rows, Surrogate
from hotlever.lever.branch import TIP_RISE, Branch, Reach, shifted
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.observables import Linearised, by_parameter
from hotlever.lever.reduced.reduced_lever import ReducedLever
from hotlever.lever.reduced.training import cached_reduction, can_be_reduced, known_reduction
from hotlever.lever.similar import SimilarLevers
from hotlever.piecewise import spline_through
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import usual_parameters
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


@dataclass(frozen=True)
class PredictionAtRest(Prediction):
    """What an instrument and a thermometer would show at some biases.

    Attributes
    ----------
    surrogate : CurveSurrogate
    linearised : Linearised
        What it was read from, not corrected.
    away : tuple of PredictionAtRest
        Of levers away from a sample, see `hotlever.estimate.over_a_sample`; then what it was read
        from is the lever in contact.
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
        return shifted(branch, changes, slopes)


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

        Distances count over a sample, see `hotlever.estimate.over_a_sample`.
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
) -> ExperimentAtRest:
    """Return the fastest forward model of a probe.

    Parameters
    ----------
    probe : Probe
    bias : ndarray, shape (n,)
    names : tuple of str
        Parameters of the derivatives; by default what a fit usually varies. A reduced lever does
        not serve all, see `hotlever.lever.reduced.training.can_be_reduced`.
    reduce : bool
        Make and keep a reduced lever (some seconds) if the geometry has none yet: it pays where
        more than one fit is to come.
    """
    lever, reduced = Lever(probe), None
    names = usual_parameters(probe) if names is None else names
    if can_be_reduced(probe, names):
        reduced = cached_reduction(lever, names=names) if reduce else known_reduction(lever, names)
    fast = reduced or SimilarLevers(Lever(probe, COARSE))
    return ExperimentAtRest(fast, SimilarLevers(lever), bias, names)
