"""Whether a lever shows what was measured; if none does, the likeliest of some hypotheses.

With each hypothesis (`hotlever.estimate.hypotheses`) the lever is estimated again, on a coarse
mesh; the likeliest leaves the least unexplained. Only data that contradict a probe are examined so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.hypotheses import (
    Hypothesis,
    MeasuredRows,
    hypotheses_of,
    of_another_lever,
)
from hotlever.estimate.residuals import Residuals
from hotlever.estimate.surrogate import CurveSurrogate, Rows
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.measurement.data import noise_about_neighbours
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, known_beforehand
from hotlever.probe.probe_parameters import parameters_of
from hotlever.quantities import FITTED, OF_A_CONTACT
from hotlever.types import Array

#: Data are not described where they differ from the model by more than this share of the largest
#: (rms), and neighbours together: the product of two is this share of the square, of white noise 0.
#: Neither are they where so many neighbours differ by three times as much in their median.
USUAL_SCATTER, _TOGETHER, _RUN = 0.004, 0.4, 4
#: Of noisier data so many neighbours differ by chance by up to so many times their scatter.
_NOISY_RUN = 2.5
#: The share for fits whose weights are no errors, which hold dimensions and whatever else is fixed.
_HELD_SCATTER = 0.01
#: Outliers stand alone: so many neighbours that are off by more than so many standard deviations
#: are none; nor are one fewer at the end, with nothing beyond.
_NEIGHBOURS, _FAR = 3, 8.0
#: Temperatures of a contact are off where by chance one lever in so many is.
_UNLIKELY = 2e-4
#: Fewer rows tell nothing of their neighbours.
_ROWS = 7
#: A datum is named as an outlier beyond this many standard deviations, and so many of those
#: furthest off.
_OUTLYING, _OUTLIERS_NAMED = 8.0, 10
#: What a coarse lever may differ by from what was measured: of each current and of the largest.
_OWN, _LARGEST = 3e-3, 1e-3
#: Differences beyond this many of those count less and less, so that no single datum decides.
_SOFT = 3.0
#: Each row that a hypothesis leaves out counts as much as this, each unknown that it finds as that.
_LEFT_OUT, _UNKNOWN = 1.2, 2.0
#: A hypothesis has to lower the sum of squares to this share of what it is without, and to no more
#: than so much for each row and altogether.
_BETTER, _EACH, _ALTOGETHER = 0.5, 2.0, 10.0
#: Data that leave so many times that, with all that is known of a lever, are those of another: of
#: right levers of which little is known the farthest left twice.
_ANOTHER = 4.0
_ANOTHER_LEVER = (
    "is it another lever, or in another medium, or known less well than its priors say?"
)
#: Hypotheses within a factor or a difference of the best are as likely; so many are named.
_AS_LIKELY, _AS_LIKELY_BY, _CAUSES_NAMED = 1.3, 4.0, 2
#: The most promising are solved anew where they lead.
_AGAIN = 4
#: Points along a branch, and steps of a search.
_POINTS, _STEPS = 240, 40
#: A parameter of which nothing is known is within this factor of what was stated.
_WIDEST = 30.0


def lack_of_fit_text(residuals: Residuals, values: Array) -> str:
    """Return where data are not described by predicted values (m, n); empty if they are.

    Temperatures are left out: a thermometer's scale may be off by more than its readings
    scatter.
    """
    scatter = USUAL_SCATTER if residuals.errors.measured else _HELD_SCATTER
    difference = residuals.difference(values) / residuals.largest
    in_order = np.argsort(residuals.along, kind="stable")
    for name, whole, down in zip(
        residuals.observables, difference, residuals.errors.down, strict=True
    ):
        present = np.isfinite(whole)
        if FITTED[name].unit == "K" or present.sum() < _ROWS:
            continue
        # what a robust fit has forgotten stands alone, or is seen as a run
        squares = float(np.sum((down * whole)[present] ** 2))
        rms = np.sqrt(squares / present.sum())
        ordered = in_order[present[in_order]]
        # a drift shows in the order of the rows, another lever in that of the bias
        rows = [(down * whole)[order] for order in (present, ordered)]
        together = max(float(row[1:] @ row[:-1]) for row in rows)
        windows = np.lib.stride_tricks.sliding_window_view(whole[ordered], _RUN)
        runs = np.abs(np.median(windows, axis=1))
        if rms > scatter and together > _TOGETHER * squares:
            worst = int(np.nanargmax(np.abs(whole)))
            return (
                f"{name} differs by {rms:.1%} of its largest value (rms), and not at "
                f"random; most at {residuals.along[worst]:.3g} {residuals.unit}"
            )
        # noise alone has runs too
        noise = noise_about_neighbours(whole[ordered])
        if runs.max() > max(3.0 * USUAL_SCATTER, _NOISY_RUN * noise):
            run = residuals.along[ordered[np.argmax(runs) + np.arange(_RUN)]]
            return (
                f"{name} differs by {runs.max():.1%} of its largest value in neighbouring rows, "
                f"from {run[0]:.3g} to {run[-1]:.3g} {residuals.unit}"
            )
    return _contradiction(residuals, values)


def _contradiction(residuals: Residuals, values: Array) -> str:
    """Return where temperatures of a contact are off by more than their errors; empty if none are.

    Their errors are stated, or else their own scatter. Few as they are, each has its weight.
    """
    away = residuals.difference(values) / residuals.errors.scale
    for name, row in zip(residuals.observables, away, strict=True):
        present = np.isfinite(row)
        if name in OF_A_CONTACT and chdtrc(present.sum(), np.sum(row[present] ** 2)) < _UNLIKELY:
            worst = int(np.nanargmax(np.abs(row)))
            return (
                f"{name} is off by {abs(row[worst]):.1f} standard errors at "
                f"{residuals.along[worst]:.3g} {residuals.unit}"
            )
    return ""


def run_of_outliers(residuals: Residuals, values: Array) -> str:
    """Return where neighbouring data are off together, as no outliers are; empty if none are."""
    in_order = np.argsort(residuals.along, kind="stable")
    along = residuals.along[in_order]
    for name, row in zip(residuals.observables, residuals.deviations(values), strict=True):
        if FITTED[name].unit == "K" or row.size < _ROWS:
            continue
        far = np.append(np.abs(row[in_order]) > _FAR, True)
        together = np.lib.stride_tricks.sliding_window_view(far, _NEIGHBOURS).all(axis=1)
        if together.any():
            first = int(np.argmax(together))
            last = min(first + _NEIGHBOURS, along.size) - 1
            ends = f"{along[first]:.3g} to {along[last]:.3g} {residuals.unit}"
            return f"{name} is off in neighbouring rows, from {ends}"
    return ""


def outlier_notes(residuals: Residuals, values: Array, robust: bool) -> list[str]:
    """Name the points that lie far outside the scatter of the others."""
    advice = "it hardly counts" if robust else "a robust fit would lessen its weight"
    size = np.abs(residuals.deviations(values))
    outliers = np.argwhere(size > _OUTLYING)
    worst = np.sort(np.argsort(-size[tuple(outliers.T)], kind="stable")[:_OUTLIERS_NAMED])
    named = [
        f"{residuals.observables[row]} at {residuals.along[column]:g} {residuals.unit} is "
        f"{size[row, column]:.0f} standard deviations from the fit; {advice}"
        for row, column in outliers[worst].tolist()
    ]
    more = len(outliers) - len(named)
    return [*named, f"{more} more data are as far from the fit"] if more else named


# --- what may be behind it -----------------------------------------------------------------------


@dataclass(frozen=True)
class _Curve:
    """V_l and I_h at many points along the branch of a coarse lever, from its surrogate.

    Attributes
    ----------
    probe : Probe
        As it is said to be.
    at : ndarray, shape (p,)
        Where the lever was solved: logarithms of its parameters over the probe's.
    names : tuple of str
    spreads : ndarray, shape (p,)
        Standard deviations of the logarithms of the parameters.
    logarithms : ndarray, shape (n, 2)
    powers : ndarray, shape (n, 2, p)
    """

    probe: Probe
    at: Array
    names: tuple[str, ...]
    spreads: Array
    logarithms: Array
    powers: Array

    @classmethod
    def of(cls, probe: Probe, priors: Mapping[str, Prior]) -> _Curve:
        """Solve a probe as far as it goes."""
        # the resistor is a hypothesis of its own; what is 0 has no logarithm
        names = tuple(
            name
            for name in parameters_of(probe)
            if name in priors and name != "series_resistance_ohm" and priors[name].value > 0
        )
        spreads = [priors[name].absolute / abs(priors[name].value) for name in names]
        whole = Reach(probe.circuit, np.inf)
        lever = SimilarLevers(Lever(probe, COARSE)).linearised(probe, whole, names=names)
        rows = Rows(np.zeros(0))
        surrogate = CurveSurrogate(probe, names, lever.branch, lever.output_slopes, rows)
        u = np.linspace(float(lever.branch.u[1]), lever.branch.end_u, _POINTS)
        outputs = np.maximum(lever.branch.curve(u)[:, :2], 1e-12)
        powers = surrogate.powers(u)[:, :2]
        return cls(probe, np.zeros(len(names)), names, np.array(spreads), np.log(outputs), powers)

    def current(self, away: Array, rows: MeasuredRows) -> Array:
        """Return I_h (mA) at the biases, for logarithms of parameters over the probe's.

        Beyond its end the branch stays level: no lever takes such a bias.
        """
        lever, current = np.exp(self.logarithms + self.powers @ (away - self.at)).T
        bias = np.maximum.accumulate(lever + rows.series_kohm * current)
        return np.interp(rows.bias_V, np.append(0.0, bias), np.append(0.0, current))


@dataclass(frozen=True)
class _Explanation:
    """Where a search with a hypothesis ended: what is left unexplained, and with what.

    These are logarithms over the values of the curve's probe.
    """

    hypothesis: Hypothesis
    curve: _Curve
    squares: float
    unknown: float
    away: Array

    @property
    def question(self) -> str:
        """What the hypothesis asks; empty if nothing."""
        return self.hypothesis.asks(self.unknown)


_squares = attrgetter("squares")


class Diagnosis:
    """What may be behind data that contradict a probe.

    Parameters
    ----------
    measured : Measurement
    probe : Probe
        In the circuit and the medium that it is said to be in.
    priors : mapping of str to Prior or str, optional
        In place of some of the usual ones.
    """

    def __init__(
        self, measured: Measurement, probe: Probe, priors: Mapping[str, Prior | str] | None = None
    ) -> None:
        current = measured.current(probe.circuit)
        here = np.isfinite(current) & np.isfinite(measured.bias_V)
        data = measured.bias_V[here], current[here]
        self._rows = MeasuredRows(*data, probe.circuit.series_kohm, np.ones(here.sum(), dtype=bool))
        self._probe, self._stated = probe, priors or None

    def named(self, fitted: bool = False) -> str:
        """Return the likeliest cause in words, or that there is no single one.

        The probe may be that of a fit, which another lever would not share.
        """
        alone = self._probe.circuit.starts_cold
        if fitted and alone and self._explains(self._without):
            return "is it the fit of another lever?"
        return self.likeliest() or "no single cause that is known explains it"

    def likeliest(self) -> str:
        """Return questions after the likeliest hypotheses; empty if none explains the data.

        With held supplies no hypothesis is examined: curves of other levers are known from cold.
        """
        if not self._probe.circuit.starts_cold:
            return ""
        hypotheses = hypotheses_of(self._rows, self._probe, self._curve.names)
        explanations = self._searched(hypotheses)
        return self._questions(sorted(map(self._again, explanations[:_AGAIN]), key=_squares))

    def of_another_lever(self) -> str:
        """Return a question if no lever like the probe is near the data; empty otherwise.

        Asked before a lever is searched for, since it takes a second or two. Another drawing comes
        first, with what else makes resistances and powers those of another lever, if it explains
        them as well; then what may be behind data in general.
        """
        if not self._probe.circuit.starts_cold:
            return ""
        # most data are near the lever as stated, and no other one is solved for them
        if self._is_near(self._as_stated) or self._is_near(self._without):
            return ""
        drawing, *others = of_another_lever(self._rows, self._probe, self._curve.names)
        explanations = self._searched([drawing])
        if explanations and self._explains(explanations[0]):
            explanations += self._searched(others)
            if question := self._questions(sorted(explanations, key=_squares)):
                return question
        return self.likeliest() or _ANOTHER_LEVER

    def _searched(self, hypotheses: Sequence[Hypothesis]) -> list[_Explanation]:
        """Return where searches with hypotheses end, the likeliest first."""
        explanations = []
        for hypothesis in hypotheses:
            with suppress(ComputationError, InputError):  # there may be no such lever
                explanations.append(self._search(hypothesis))
        return sorted(explanations, key=_squares)

    def _questions(self, explanations: Sequence[_Explanation]) -> str:
        """Return what the likeliest explanations ask; empty if they explain nothing."""
        explanations = [explained for explained in explanations if explained.question]
        best = explanations[0] if explanations else self._without
        if best.squares > _BETTER * self._without.squares or not self._explains(best):
            return ""
        limit = max(_AS_LIKELY * best.squares, best.squares + _AS_LIKELY_BY)
        as_likely = [explained for explained in explanations if explained.squares <= limit]
        as_likely.sort(key=lambda explained: explained.hypothesis.far_fetched)
        questions = dict.fromkeys(explained.question for explained in as_likely)
        return " or: ".join(list(questions)[:_CAUSES_NAMED])

    @cached_property
    def _without(self) -> _Explanation:
        """What is left unexplained without a hypothesis."""
        return self._again(self._as_stated)

    @cached_property
    def _as_stated(self) -> _Explanation:
        """The same, from the lever that was stated alone."""
        return self._estimated(Hypothesis(lambda _: ""), 0.0, self._curve)

    @cached_property
    def _curve(self) -> _Curve:
        return self._solved(self._probe)

    def _solved(self, probe: Probe) -> _Curve:
        return _Curve.of(probe, known_beforehand(probe, self._stated))

    def _explains(self, explained: _Explanation) -> bool:
        return explained.squares < self._least_unexplained

    def _is_near(self, explained: _Explanation) -> bool:
        """Whether a search may explain the data that a coarse lever does not quite."""
        return explained.squares < _ANOTHER * self._least_unexplained

    @property
    def _least_unexplained(self) -> float:
        return _EACH * self._rows.included.size + _ALTOGETHER

    def _search(self, hypothesis: Hypothesis) -> _Explanation:
        """Estimate the lever with a hypothesis, from each of its starts; return the best."""
        ends = []
        for start in hypothesis.starts:
            # as stated, and as near to the data as priors let a lever come
            curves = [self._curve, self._without.curve]
            if hypothesis.probe is not None:
                curves = [self._solved(hypothesis.probe(self._probe, start))]
            ends += [self._estimated(hypothesis, start, curve) for curve in curves]
        return min(ends, key=_squares)

    def _again(self, explained: _Explanation) -> _Explanation:
        """Solve the lever where a search has led, and go on from there."""
        curve = explained.curve
        values = curve.probe.values(curve.names) * np.exp(explained.away)
        try:
            estimate = curve.probe.with_(**dict(zip(curve.names, values.tolist(), strict=True)))
            curve = replace(self._solved(estimate), probe=curve.probe, at=explained.away)
        except (InputError, ComputationError):
            return explained
        again = self._estimated(explained.hypothesis, explained.unknown, curve)
        return min(explained, again, key=_squares)

    def _estimated(self, hypothesis: Hypothesis, start: float, curve: _Curve) -> _Explanation:
        """Return the lever that priors and rows make most likely.

        The search is for logarithms of parameters in units of their spreads, and for the unknown.
        """
        spreads, count = curve.spreads, curve.spreads.size
        informed = np.array([name != hypothesis.parameter for name in curve.names])

        def weighted(point: Array) -> Array:
            value = start + point[-1] if hypothesis.free else start
            rows = self._rows if hypothesis.rows is None else hypothesis.rows(self._rows, value)
            size = np.abs(rows.current_mA)
            missing = curve.current(point[:count] * spreads, rows) - rows.current_mA
            missing /= _OWN * size + _LARGEST * size.max()
            soft = _SOFT * np.sqrt(np.log1p((missing / _SOFT) ** 2)) * np.sign(missing)
            residuals = np.where(rows.included, soft, np.sqrt(_LEFT_OUT))
            return np.concatenate([residuals, point[:count][informed]])

        begin = np.append(curve.at / spreads, [0.0] * hypothesis.free)
        widest = np.append(np.log(_WIDEST) / spreads, [np.inf] * hypothesis.free)
        end = least_squares(weighted, begin, bounds=(-widest, widest), max_nfev=_STEPS)
        away, value = end.x[:count] * spreads, start
        if hypothesis.free:
            value += float(end.x[-1])
        if hypothesis.parameter:
            number = curve.names.index(hypothesis.parameter)
            value = float(curve.probe.values(curve.names)[number] * np.exp(away[number]))
        unknowns = hypothesis.free + bool(hypothesis.parameter)
        squares = 2.0 * float(end.cost) + _UNKNOWN * unknowns
        return _Explanation(hypothesis, curve, squares, value, away)
