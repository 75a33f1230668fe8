"""The inverse problem: what priors and a measurement make most likely of a lever.

The resistance of a cold lever tells its doping and size, whatever it does when hot. So a lever that
is far from the data is first made to show their coldest rows, then more and more of them; each
portion begins where the last has led, and no candidate is asked for biases that it cannot take.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from hotlever import memory
from hotlever.errors import ComputationError, InputError
from hotlever.estimate.experiment import (
    Experiment,
    ExperimentAtRest,
    Prediction,
    PredictionAtRest,
    Predictor,
    experiment_of,
)
from hotlever.estimate.experiment_in_time import ExperimentInTime, known_in_time
from hotlever.estimate.noise import errors_of_scales
from hotlever.estimate.objective import Objective
from hotlever.estimate.optimiser import Optimiser, Optimum, SearchOptions
from hotlever.estimate.options import FitOptions
from hotlever.estimate.over_a_sample import with_distances
from hotlever.estimate.posterior import Posterior
from hotlever.estimate.prior_density import FLAT, PriorDensity
from hotlever.estimate.residuals import Residuals
from hotlever.lever.branch import Branch
from hotlever.measurement import Measurement, with_measured_circuit
from hotlever.measurement.data import check_sample
from hotlever.measurement.rows import averaged, note_on_averages
from hotlever.probe import Probe
from hotlever.probe.chip import CHIP
from hotlever.probe.priors import (
    ALL_DIMENSIONS,
    Prior,
    PriorUse,
    as_known,
    default_priors,
    is_of_laws,
    priors_of,
    updated,
)
from hotlever.probe.probe_parameters import dimensions_of, parameters_of
from hotlever.quantities import FITTED, OF_A_CONTACT
from hotlever.types import Array, Progress

#: The share of the sum of squares that another step would take away, below which a search that has
#: not come to its end has come to a verdict.
_LITTLE = 0.5
#: Why a probe does not show what was measured.
_MISSING = {
    "reader": "the probe has no reader",
    "bridge": "the probe has no bridge (bridge_upper_ohm and bridge_lower_ohm in [circuit])",
}
#: Data that are enough to tell, with priors, which of them are outliers.
_ENOUGH = 15
#: A lever is far from data that differ from what it shows by this share of the largest (median).
_FAR = 0.06
#: Portions by which a lever grows, the last of which is all of the rows; the least rows of one.
_PORTIONS, _FEWEST_ROWS = 6, 3
#: By how much the usual priors are widened, and the spread of what has none, where only the
#: directions are to be closed that a few cold rows leave open.
_WIDENED, _OPEN = 4.0, 0.5
#: Share of a dimension by which a mesh follows it well; edges' bias moves all of them.
_MESH_FOLLOWS = 0.2
#: A portion is to be met within some per cent: the next moves the lever anyway.
_OF_PORTIONS = SearchOptions(
    most_branches=4, decrement=2.0, scatter_rounds=0, first_region=0.7, largest_region=1.2
)


@dataclass(frozen=True)
class Estimate(Optimum):
    """The most likely lever, with the problem that it solves.

    The lever as it was `stated` is in the circuit and medium of the measurement.
    """

    stated: Probe
    measurement: Measurement
    options: FitOptions
    seconds: float
    notes: list[str]

    @cached_property
    def posterior(self) -> Posterior:
        """What is known of its parameters, and of any quantity of it."""
        return Posterior(self.objective, self.prediction)

    def priors(self, before: Mapping[str, Prior]) -> dict[str, PriorUse]:
        """Return what was known before, and what the data made of it."""
        names = self.options.varied
        values = self.probe.values(names).tolist()
        spreads = np.sqrt(np.diag(self.posterior.covariance)).tolist()
        used = {
            name: before[name].used(value, spread)
            for name, value, spread in zip(names, values, spreads, strict=True)
            if name in before
        }
        for error in self.residuals.common:
            size, left = self.posterior.shifts[error.name]
            after = 1.0 + error.share * size, error.share * left
            used[error.name] = PriorUse(1.0, error.share, *after)
        return used

    @property
    def branch(self) -> Branch:
        """The lever at rest, as far as it was measured, corrected by the full one."""
        assert isinstance(self.prediction, PredictionAtRest)
        return self.prediction.surrogate.branch

    def predicted(self, bias: Array) -> PredictionAtRest:
        """Return what a slow ramp shows at other biases (V), as far as the measured ones reach."""
        experiment, prediction = self.predictor.experiment, self.prediction
        assert isinstance(experiment, ExperimentAtRest)
        assert isinstance(prediction, PredictionAtRest)
        return experiment.measuring(bias, None).predict(self.probe, prediction)

    def verdict(self, lack_of_fit: str) -> tuple[bool, str]:
        """Return whether the search came to an end, and why the data are not described, if so.

        One that was ended far from describing the data, where another step would take less than
        half of the sum of squares away, has found that no such lever shows them.
        """
        share = self.decrement / max(self.objective.squares(self.prediction), 1e-300)
        if self.converged or (lack_of_fit and share < _LITTLE):
            return True, lack_of_fit
        refused = self.optimiser.refused
        beyond = f"; a lever on the way could not be solved: {refused}" if refused else ""
        return False, (
            f"the search was ended after {self.predictor.evaluations} levers, before it converged: "
            f"another step would still lower the sum of squares by {share:.1%}{beyond}"
        )


def estimate(
    whole: Measurement,
    nominal: Probe,
    options: FitOptions,
    *,
    before: PriorDensity = FLAT,
    model: Callable[[Probe, Array], Experiment] | None = None,
    progress: Progress | None = None,
    seen: Callable[[Prediction], None] | None = None,
) -> Estimate:
    """Find the parameters that priors and a whole measurement make most likely; see `fit`.

    The probe is as it was given, not yet in the circuit and medium of the measurement.

    What an estimate has left `before` takes the place of priors of these parameters. With priors
    the data of an observable may be wrong together, by the scale of their meter or thermometer.
    """
    began = time.perf_counter()
    memory.give_back()  # what an earlier one used
    measurement = averaged(whole, options.robust)
    in_time = measurement.time_us is not None
    if in_time:
        nominal.circuit.need_cold_start("a fit in time")
    probe, notes = with_measured_circuit(nominal, measurement, options.medium)
    notes += note_on_averages(whole, measurement) + check_sample(measurement, probe)
    if not in_time and (options.usual_priors or CHIP in options.priors):
        # that none is stated says nothing against the usual ones
        probe = as_known(probe, options.priors or None)
    options = options.of(probe, in_time=in_time)
    priors = priors_of(options.priors, probe, "priors", in_time=in_time)
    without_effect = [
        name
        for name in options.priors
        if name not in (*priors, ALL_DIMENSIONS) and not is_of_laws(name)
    ]
    if without_effect:
        notes.append(
            f"priors that do not count in {probe.surroundings.medium}, and have no effect: "
            f"{', '.join(without_effect)}"
        )
    if options.usual_priors:
        usual = updated(default_priors(probe), options.priors, probe, "priors", in_time=in_time)
        priors = {name: usual[name] for name in usual if name not in options.fixed} | priors
    options = replace(options, priors=priors, usual_priors=False)
    if in_time:
        priors, more = known_in_time(probe, measurement, priors, options.varied)
        options, notes = replace(options, priors=priors), notes + more
    informed = bool(priors) or bool(before.names)
    enough = int(np.isfinite(measurement.current(probe.circuit)).sum()) >= _ENOUGH
    options = replace(options, robust=options.robust or (enough and informed))
    observables = _observables(options, measurement, probe, notes)
    # priors are in standard deviations, so the data must be too
    weights = "errors" if informed else options.weights
    base = probe.circuit.base_temperature_K
    common = errors_of_scales(measurement, observables, priors, base) if informed else []
    residuals = Residuals(measurement, observables, weights, common=common)
    if not informed and residuals.different < len(options.varied):
        raise InputError(
            f"{measurement.path or 'measurement'}: {residuals.different} different data for "
            f"{len(options.varied)} parameters; fix some or measure at more "
            f"{'times' if in_time else 'biases'}"
        )
    density = PriorDensity.of_priors(priors)
    likeliest = zip(density.names, density.values.tolist(), strict=True)
    held = {name: value for name, value in options.fixed.items() if value is not None}
    start = probe.replace(dict(likeliest))
    start = start.with_(**held) if held else start
    search = Search(
        residuals, start, options.varied, options.robust, density.beside(before), progress, seen
    )
    if measurement.waveform is not None:
        follow = partial(ExperimentInTime.of, waveform=measurement.waveform, names=options.varied)
        optimum = search.near((model or follow)(probe, residuals.along), start)
    else:
        names = tuple(dict.fromkeys([*options.usual, *options.varied]))
        experiment = (model or partial(experiment_of, names=names))(probe, residuals.bias)
        assert isinstance(experiment, ExperimentAtRest)
        # with priors errors are a matter of standard deviations; the fast lever's slopes do
        experiment = replace(experiment, names=names, first_order=not informed)
        experiment = with_distances(experiment, probe, residuals.distance_um)
        experiment = experiment.measuring(*residuals.at_rest)
        optimum = search.from_anywhere(experiment, measurement)
    seconds = time.perf_counter() - began
    return Estimate(
        **vars(optimum),
        stated=probe,
        measurement=measurement,
        options=options,
        seconds=seconds,
        notes=notes,
    )


def _observables(
    options: FitOptions, measurement: Measurement, probe: Probe, notes: list[str]
) -> tuple[str, ...]:
    """Return what is to be fitted: by default all that has data and that the probe can show."""
    where = measurement.path or "measurement"
    # without a contact there is no such measurement
    can_be = {*probe.observables, *OF_A_CONTACT}
    fittable = tuple(name for name in measurement.observables if name in can_be)
    for name in options.observables or measurement.observables:
        symbol = FITTED[name].symbol
        if name not in measurement.observables:
            raise InputError(
                f"{where}: no values of {name} (column {symbol}); it has "
                f"{', '.join(measurement.observables)}"
            )
        if name in fittable:
            continue
        if options.observables is None and fittable:
            notes.append(f"{symbol}: {_MISSING[name]}, so that these values are not fitted")
        else:
            expected = f"fit {', '.join(fittable)}" if fittable else "there is nothing else to fit"
            raise InputError(f"{where}: {symbol}: {_MISSING[name]}; {expected}")
    return fittable if options.observables is None else tuple(options.observables)


# --- the search ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Search:
    """What is searched for.

    Attributes
    ----------
    residuals : Residuals
    start : Probe
        As the lever is known beforehand.
    varied : list of str
    robust : bool
        Whether the weight of outliers is lessened.
    prior : PriorDensity
    progress, seen : callable, optional
        See `hotlever.estimate.experiment.Predictor`.
    """

    residuals: Residuals
    start: Probe
    varied: list[str]
    robust: bool
    prior: PriorDensity = FLAT
    progress: Progress | None = None
    seen: Callable[[Prediction], None] | None = None

    def near(self, experiment: Experiment, start: Probe, before: int = 0) -> Optimum:
        """Search from a lever that is not far from the one that was measured.

        The levers that were solved `before` count.
        """
        return self._optimiser(experiment, start, before).solve_and_confirm(start, self.robust)

    def from_anywhere(self, experiment: ExperimentAtRest, measurement: Measurement) -> Optimum:
        """Search from a lever of which little may be known.

        If it shows something else than the data, or the search leads to a lever that does, it first
        grows; of two ends the one that describes the data better counts.

        Raises
        ------
        ComputationError
            If the lever cannot be solved at the start.
        """
        ends: list[Optimum] = []
        optimiser = self._optimiser(experiment, self.start)
        with suppress(ComputationError):
            if not _is_far(self.residuals, optimiser.predictor.predict(self.start)):
                ends.append(optimiser.solve_and_confirm(self.start, self.robust))
                if ends[0].describes_data:
                    return ends[0]
        before = optimiser.predictor.evaluations
        grown, nearer, before = self._grown(experiment, measurement, before)
        if ends and nearer == self.start:
            # cold rows say nothing else, and the same search would come to the same end
            return ends[0]
        try:
            ends.append(self.near(grown, nearer, before))
        except ComputationError:
            if not ends:
                raise
        return min(ends, key=lambda end: (not end.describes_data, end.misfit))

    def _optimiser(self, experiment: Experiment, start: Probe, before: int = 0) -> Optimiser:
        residuals = self.residuals.afresh()
        objective = Objective(residuals, start, experiment.names, self.varied, self.prior)
        predictor = Predictor(experiment, self.progress, self.seen, before=before)
        return Optimiser(objective, predictor)

    def _grown(
        self, experiment: ExperimentAtRest, measurement: Measurement, before: int
    ) -> tuple[ExperimentAtRest, Probe, int]:
        """Return a lever that shows nearly what was measured, up to the hottest portion of rows.

        With it the experiment is returned that is to be searched on with, and the levers that were
        solved, with those `before`. Without priors the usual ones close what cold rows leave open.
        """
        experiment, start = experiment.coarse(), self.start
        prior = (
            self.prior if self.prior.names else PriorDensity.of_priors(_closing(start, self.varied))
        )
        bias = np.abs(measurement.bias_V)
        current = measurement.current(start.circuit)
        heated = np.unique(bias[np.isfinite(current) & (bias > 0)])
        for portion in range(1, _PORTIONS):
            count = max(_FEWEST_ROWS, -(-heated.size * portion // _PORTIONS))
            if count >= heated.size:
                break
            part = measurement.part(bias <= heated[count - 1])
            with_data = set(part.observables)
            residuals = Residuals(
                part, [name for name in self.residuals.observables if name in with_data], "errors"
            )
            if _has_moved(experiment.fast.drawn, start):
                experiment = experiment.drawn_anew(start)
            of_part = experiment.measuring(*residuals.at_rest)
            objective = Objective(residuals, start, of_part.names, self.varied, prior)
            # what is seen of a portion is not seen at the rows of the measurement
            predictor = Predictor(of_part, self.progress, before=before)
            try:
                start = Optimiser(objective, predictor, _OF_PORTIONS).solve(start).probe
                before = predictor.evaluations
            except ComputationError:
                if portion == 1:
                    raise
                break
        mesh_is_outdated = _has_moved(experiment.fast.drawn, start)
        return (experiment.drawn_anew(start) if mesh_is_outdated else experiment), start, before


def _is_far(residuals: Residuals, at: Prediction) -> bool:
    """Whether a lever shows something else than the data."""
    share = residuals.difference(at.values) / residuals.largest
    # a few wrong rows are no other lever
    return bool(np.nanmax(np.nanmedian(np.abs(share), axis=1)) > _FAR)


def _has_moved(drawn: Probe, probe: Probe) -> bool:
    """Whether a probe's dimensions are far from those that a mesh was drawn with."""
    names = dimensions_of(probe)
    before, now = drawn.values(names), probe.values(names)
    return bool(np.any(np.abs(now - before) > _MESH_FOLLOWS * np.abs(before)))


def _closing(probe: Probe, varied: Sequence[str]) -> dict[str, Prior]:
    """Return wide priors about a probe for all that is varied."""
    usual, every = default_priors(probe), parameters_of(probe, anywhere=True)
    closing = {}
    for name, value in zip(varied, probe.values(list(varied)).tolist(), strict=True):
        if name in usual:
            prior = usual[name]
            closing[name] = Prior(value, _WIDENED * prior.spread, prior.relative)
        elif every[name].lower > 0:
            closing[name] = Prior(value, _OPEN)
        else:
            closing[name] = Prior(value, _OPEN * every[name].scale, relative=False)
    return closing
