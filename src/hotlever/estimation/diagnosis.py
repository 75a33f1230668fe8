"""Why no lever like a probe shows what was measured: the likeliest of some hypotheses.

With each hypothesis (`hotlever.estimation.hypotheses`) the lever is estimated again, on a coarse
mesh; the likeliest leaves the least unexplained. Only data that contradict a probe are examined so.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter

import numpy as np
from scipy.optimize import least_squares

from hotlever.errors import ComputationError, InputError
from hotlever.estimation.hypotheses import Hypothesis, MeasuredRows, hypotheses_of
from hotlever.estimation.surrogate import CurveSurrogate, Rows
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.parameters import parameters_of
from hotlever.probe.priors import Prior, known_beforehand
from hotlever.types import Array

#: What a coarse lever may differ by from what was measured: of each current and of the largest.
_OWN, _LARGEST = 3e-3, 1e-3
#: Differences beyond this many of those count less and less, so that no single datum decides.
_SOFT = 3.0
#: Each row that a hypothesis leaves out counts as much as this, each unknown that it finds as that.
_LEFT_OUT, _UNKNOWN = 1.2, 2.0
#: A hypothesis has to lower the sum of squares to this share of what it is without, and to no more
#: than so much for each row and altogether.
_BETTER, _EACH, _ALTOGETHER = 0.5, 2.0, 10.0
#: Hypotheses within a factor or a difference of the best are as likely; so many are named.
_AS_LIKELY, _AS_LIKELY_BY, _NAMED = 1.3, 4.0, 2
#: The most promising are solved anew where they lead.
_AGAIN = 4
#: Points along a branch, and steps of a search.
_POINTS, _STEPS = 240, 40
#: A parameter of which nothing is known is within this factor of what was stated.
_WIDEST = 30.0


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
        surrogate = CurveSurrogate(probe, names, lever.branch, lever.shown, rows)
        u = np.linspace(float(lever.branch.u[1]), lever.branch.end_u, _POINTS)
        shown = np.maximum(lever.branch.curve(u)[:, :2], 1e-12)
        powers = surrogate.powers(u)[:, :2]
        return cls(probe, np.zeros(len(names)), names, np.array(spreads), np.log(shown), powers)

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
        explanations = []
        for hypothesis in hypotheses_of(self._rows, self._probe, self._curve.names):
            with suppress(ComputationError, InputError):  # there may be no such lever
                explanations.append(self._search(hypothesis))
        explanations.sort(key=_squares)
        explanations = sorted(map(self._again, explanations[:_AGAIN]), key=_squares)
        explanations = [explained for explained in explanations if explained.question]
        best = explanations[0] if explanations else self._without
        if best.squares > _BETTER * self._without.squares or not self._explains(best):
            return ""
        limit = max(_AS_LIKELY * best.squares, best.squares + _AS_LIKELY_BY)
        as_likely = [explained for explained in explanations if explained.squares <= limit]
        as_likely.sort(key=lambda explained: explained.hypothesis.far_fetched)
        asked = dict.fromkeys(explained.question for explained in as_likely)
        return " or: ".join(list(asked)[:_NAMED])

    @cached_property
    def _without(self) -> _Explanation:
        """What is left unexplained without a hypothesis."""
        return self._again(self._estimated(Hypothesis(lambda _: ""), 0.0, self._curve))

    @cached_property
    def _curve(self) -> _Curve:
        return self._solved(self._probe)

    def _solved(self, probe: Probe) -> _Curve:
        return _Curve.of(probe, known_beforehand(probe, self._stated))

    def _explains(self, explained: _Explanation) -> bool:
        return explained.squares < _EACH * self._rows.kept.size + _ALTOGETHER

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
            moved = curve.probe.with_(**dict(zip(curve.names, values.tolist(), strict=True)))
            curve = replace(self._solved(moved), probe=curve.probe, at=explained.away)
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
            kept = np.where(rows.kept, soft, np.sqrt(_LEFT_OUT))
            return np.concatenate([kept, point[:count][informed]])

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
