"""Whether a lever shows what was measured; if none does, the likeliest of some hypotheses.

Each hypothesis changes the rows that were measured, or the probe, by one unknown, and asks one
question. With each the lever is estimated again, on a coarse mesh; the likeliest leaves the least
unexplained. Only data that contradict a probe are examined so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.options import DiagnosisOptions
from hotlever.estimate.residuals import Residuals
from hotlever.estimate.surrogate import CurveSurrogate, Rows
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.observables import Linearised
from hotlever.lever.similar import SimilarLevers
from hotlever.materials.parameters import parameter_named
from hotlever.measurement import Measurement
from hotlever.measurement.data import noise_about_neighbours, resolution_of
from hotlever.measurement.rows import is_level
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, known_beforehand
from hotlever.probe.probe_parameters import parameters_of
from hotlever.quantities import FITTED, OF_A_CONTACT
from hotlever.text import with_unit
from hotlever.types import Array, Mask

# --- whether data are described -----------------------------------------------------------------


def lack_of_fit_text(residuals: Residuals, values: Array) -> str:
    """Return where data are not described by predicted values (m, n); empty if they are.

    Temperatures are left out: a thermometer's scale may be off by more than its readings
    scatter.
    """
    options = residuals.numerics.diagnosis
    usual, run = options.usual_scatter, options.run
    scatter = usual if residuals.errors.measured else options.held_scatter
    difference = residuals.difference(values) / residuals.largest
    in_order = np.argsort(residuals.along, kind="stable")
    for name, whole, down in zip(
        residuals.observables, difference, residuals.errors.down, strict=True
    ):
        present = np.isfinite(whole)
        if FITTED[name].is_temperature or present.sum() < max(options.fewest_rows, run):
            continue
        # what a robust fit has forgotten stands alone, or is seen as a run
        squares = float(np.sum((down * whole)[present] ** 2))
        rms = np.sqrt(squares / present.sum())
        ordered = in_order[present[in_order]]
        # a drift shows in the order of the rows, another lever in that of the bias
        rows = [(down * whole)[order] for order in (present, ordered)]
        together = max(float(row[1:] @ row[:-1]) for row in rows)
        windows = np.lib.stride_tricks.sliding_window_view(whole[ordered], run)
        runs = np.abs(np.median(windows, axis=1))
        if rms > scatter and together > options.correlation * squares:
            worst = int(np.nanargmax(np.abs(whole)))
            return (
                f"{name} differs by {rms:.1%} of its largest value (rms), and not at "
                f"random; most at {residuals.along[worst]:.3g} {residuals.unit}"
            )
        # noise alone has runs too
        noise = noise_about_neighbours(whole[ordered])
        if runs.max() > max(3.0 * usual, options.run_of_noise * noise):
            along = residuals.along[ordered[np.argmax(runs) + np.arange(run)]]
            return (
                f"{name} differs by {runs.max():.1%} of its largest value in neighbouring rows, "
                f"from {along[0]:.3g} to {along[-1]:.3g} {residuals.unit}"
            )
    return _contradiction(residuals, values, options.contact_probability)


def _contradiction(residuals: Residuals, values: Array, probability: float) -> str:
    """Return where temperatures of a contact are off by more than their errors; empty if none are.

    Their errors are stated, or else their own scatter. Few as they are, each has its weight.
    """
    away = residuals.difference(values) / residuals.errors.scale
    for name, row in zip(residuals.observables, away, strict=True):
        present = np.isfinite(row)
        if name in OF_A_CONTACT and chdtrc(present.sum(), np.sum(row[present] ** 2)) < probability:
            worst = int(np.nanargmax(np.abs(row)))
            return (
                f"{name} is off by {abs(row[worst]):.1f} standard errors at "
                f"{residuals.along[worst]:.3g} {residuals.unit}"
            )
    return ""


def run_of_outliers(residuals: Residuals, values: Array) -> str:
    """Return where neighbouring data are off together, as no outliers are; empty if none are."""
    options = residuals.numerics.diagnosis
    run = options.run_of_outliers
    in_order = np.argsort(residuals.along, kind="stable")
    along = residuals.along[in_order]
    for name, row in zip(residuals.observables, residuals.deviations(values), strict=True):
        if FITTED[name].is_temperature or row.size < options.fewest_rows:
            continue
        far = np.append(np.abs(row[in_order]) > options.outlier, True)
        together = np.lib.stride_tricks.sliding_window_view(far, run).all(axis=1)
        if together.any():
            first = int(np.argmax(together))
            last = min(first + run, along.size) - 1
            ends = f"{along[first]:.3g} to {along[last]:.3g} {residuals.unit}"
            return f"{name} is off in neighbouring rows, from {ends}"
    return ""


def outlier_notes(residuals: Residuals, values: Array, robust: bool, most: int = 10) -> list[str]:
    """Name the points that lie far outside the scatter of the others, and no more than `most`."""
    options = residuals.numerics.diagnosis
    advice = "it hardly counts" if robust else "a robust fit would lessen its weight"
    size = np.abs(residuals.deviations(values))
    outliers = np.argwhere(size > options.outlier)
    worst = np.sort(np.argsort(-size[tuple(outliers.T)], kind="stable")[:most])
    named = [
        f"{residuals.observables[row]} at {residuals.along[column]:g} {residuals.unit} is "
        f"{size[row, column]:.0f} standard deviations from the fit; {advice}"
        for row, column in outliers[worst].tolist()
    ]
    more = len(outliers) - len(named)
    return [*named, f"{more} more data are as far from the fit"] if more else named


# --- what may be wrong with data, or with what is said of their lever ---------------------------


@dataclass(frozen=True)
class MeasuredRows:
    """An I-V curve in the order of its file, which of its rows count, and their resistor."""

    bias_V: Array
    current_mA: Array
    series_kohm: float
    included: Mask


@dataclass(frozen=True)
class Hypothesis:
    """One unknown, and what it would mean.

    Attributes
    ----------
    asks : callable
        Return a question for the value of the unknown that was found; empty if it asks nothing.
    rows : callable, optional
        Return the rows as they should have been, for a value of the unknown.
    probe : callable, optional
        Return the probe as it should have been.
    starts : sequence of float
        Values of the unknown to begin from. A change of the probe, which has to be solved, takes
        no others.
    parameter : str
        Of which nothing is known beforehand; then its value is the unknown.
    free : bool
        Whether the unknown takes other values than those.
    far_fetched : bool
        Whether others that explain the data as well come first.
    partial : bool
        Whether it leaves rows out, and is not asked where another one explains all as well.
    """

    asks: Callable[[float], str]
    rows: Callable[[MeasuredRows, float], MeasuredRows] | None = None
    probe: Callable[[Probe, float], Probe] | None = None
    starts: Sequence[float] = (0.0,)
    parameter: str = ""
    free: bool = False
    far_fetched: bool = False
    partial: bool = False


def hypotheses_of(rows: MeasuredRows, probe: Probe, names: Sequence[str]) -> list[Hypothesis]:
    """Return all that may be wrong; names are those of the parameters that have priors."""
    return [
        *_of_another_lever(rows, probe, names),
        *_of_the_meter(rows),
        *_of_the_rows(rows),
        _of_the_base(probe),
    ]


def _of_another_lever(rows: MeasuredRows, probe: Probe, names: Sequence[str]) -> list[Hypothesis]:
    """Return what makes resistances and powers those of another lever, from cold on."""
    dimensions = probe.shape.dimensions()
    return [
        _of_another_drawing(probe),
        _of_the_medium(probe),
        *_of_units(),
        _of_the_resistor(rows),
        # of those that a user states of a lever
        *(_of_a_parameter(probe, name) for name in names if name in ("n_d", *dimensions)),
    ]


def _divided_current(rows: MeasuredRows, factor: float) -> MeasuredRows:
    return replace(rows, current_mA=rows.current_mA / factor)


def _of_units() -> list[Hypothesis]:
    def bias(rows: MeasuredRows, factor: float) -> MeasuredRows:
        return replace(rows, bias_V=factor * rows.bias_V)

    def swapped(rows: MeasuredRows, _: float) -> MeasuredRows:
        return replace(rows, bias_V=rows.current_mA, current_mA=rows.bias_V)

    def of_the_lever(rows: MeasuredRows, _: float) -> MeasuredRows:
        return replace(rows, bias_V=rows.bias_V + rows.series_kohm * rows.current_mA)

    small, large = (
        f"is the unit of the current wrong, so that it is 1000 times too {size} ({example})?"
        for size, example in (
            ("small", "mA labelled µA, or A labelled mA"),
            ("large", "µA labelled mA, or mA labelled A"),
        )
    )
    return [
        Hypothesis(lambda _: small, _divided_current, starts=(1e-3,)),
        Hypothesis(lambda _: large, _divided_current, starts=(1e3,)),
        Hypothesis(lambda _: "is the bias given in mV?", bias, starts=(1e-3,)),
        Hypothesis(lambda _: "are bias and current swapped?", swapped),
        Hypothesis(lambda _: "is V_b the lever's own voltage, not the bias?", of_the_lever),
    ]


def _of_the_meter(rows: MeasuredRows) -> list[Hypothesis]:
    largest = float(np.abs(rows.current_mA).max())
    along = np.linspace(0.0, 1.0, rows.bias_V.size)

    def raised(pattern: Array | float, rows: MeasuredRows, share: float) -> MeasuredRows:
        return replace(rows, current_mA=rows.current_mA - share * largest * pattern)

    def asks(question: str) -> Callable[[float], str]:
        return lambda share: (
            f"{question} by {share:+.1%} of its largest value?" if abs(share) < 0.5 else ""
        )

    def times(factor: float) -> str:
        # or else it is another unit
        of_a_range = 1.0 / 50.0 < factor < 50.0
        return f"is the current {factor:.3g} times what it should be?" if of_a_range else ""

    zero, drift = "is the zero of the current off", "does the zero of the current drift"
    return [
        Hypothesis(times, _divided_current, starts=(1.0,), free=True, far_fetched=True),
        Hypothesis(asks(zero), partial(raised, 1.0), free=True),
        Hypothesis(asks(drift), partial(raised, along), free=True),
    ]


def _of_the_resistor(rows: MeasuredRows) -> Hypothesis:
    stated = rows.series_kohm
    measured = float(np.median(np.abs(rows.bias_V) / np.maximum(np.abs(rows.current_mA), 1e-12)))

    def other(rows: MeasuredRows, kohm: float) -> MeasuredRows:
        return replace(rows, series_kohm=max(kohm, 0.0))

    def asks(kohm: float) -> str:
        if abs(kohm - stated) < 0.01 * stated:
            return ""
        return f"is the series resistance, with contacts, rather {kohm:.3g} than {stated:.3g} kΩ?"

    return Hypothesis(asks, other, starts=(stated, stated / 2, 0.8 * measured), free=True)


def _of_the_rows(rows: MeasuredRows) -> list[Hypothesis]:
    bias, current, number = rows.bias_V, rows.current_mA, np.arange(rows.bias_V.size)
    clipped = []
    level = is_level(current)
    # whether a current that stands at its highest value is clipped is not seen without the lever
    if level.sum() >= 2 and (~level).sum() >= 5:
        text = f"is the current clipped at {current.max():.3g} mA, by the range of its meter?"
        clipped.append(Hypothesis(lambda _: text, lambda rows, _: replace(rows, included=~level)))

    def part(first: bool, rows: MeasuredRows, cut: float) -> MeasuredRows:
        return replace(rows, included=(number < cut) == first)

    # one sweep is no two; but something may have changed on the way. A bias that falls by less is
    # noise of its meter
    back = 0.05 * float(np.ptp(bias))
    falls, rises = (np.maximum.accumulate(way) - way > back for way in (bias, -bias))
    monotonic = not (falls.any() and rises.any())

    def asks(cut: float) -> str:
        where = f"row {cut + 1:.0f} ({bias[int(cut)]:.3g} V) on"
        if monotonic:
            return f"does the current jump, by another lever or another range, from {where}?"
        return f"are there two sweeps, a new one from {where}?"

    if monotonic:
        cuts = _jumps(bias, current)
    else:
        # where the bias goes back, or else at some quarter
        turn = [int(np.argmax(bias[: np.argmax(falls)])) + 1] if falls.any() else []
        cuts = [*turn, *(quarter * number.size // 4 for quarter in (1, 2, 3))]
    both = [
        Hypothesis(asks, partial(part, first), starts=cuts, partial=True)
        for first in (True, False)
        if cuts
    ]
    return [*clipped, *both]


def _jumps(bias: Array, current: Array) -> list[int]:
    """Return rows of one sweep from which on the current may be another one.

    Straight lines through two rows on either side say how far it jumps there; a knee has the
    largest of some levers.
    """
    used = np.flatnonzero(np.append(True, np.diff(bias) != 0.0) & (bias > 0) & (current > 0))
    if used.size < 8:
        return []
    x, y = np.log(bias[used]), np.log(current[used])
    slope = np.diff(y) / np.diff(x)
    middle = 0.5 * (x[1:-2] + x[2:-1])
    before = y[1:-2] + slope[:-2] * (middle - x[1:-2])
    after = y[2:-1] + slope[2:] * (middle - x[2:-1])
    jump = np.abs(after - before)
    # by a share of the current, and by more than it usually changes
    least = max(0.01, 5.0 * float(np.median(jump)))
    largest = np.argsort(-jump, kind="stable")[:3]
    return [int(row) for row in used[largest[jump[largest] > least] + 2]]


def _of_another_drawing(probe: Probe) -> Hypothesis:
    """Return that the lever has the usual shape that the probe has not."""
    usual = Probe.reference().shape, Probe.u_shape().shape
    shape = next(each for each in usual if each.shape != probe.shape.shape)
    return Hypothesis(
        lambda _: f"is the drawing that of another lever, {shape.shape}?",
        probe=lambda probe, _: probe.model_copy(
            update={"shape": shape, "tip": None, "contact": None}
        ),
    )


def _of_the_medium(probe: Probe) -> Hypothesis:
    medium = probe.surroundings.medium
    other = "air" if medium == "vacuum" else "vacuum"
    return Hypothesis(
        lambda _: f"is the lever in {other}, not in {medium}?",
        probe=lambda probe, _: probe.in_medium(other),
    )


def _of_the_base(probe: Probe) -> Hypothesis:
    base = probe.circuit.base_temperature_K
    return Hypothesis(
        lambda warmer: f"is the base temperature rather about {base + warmer:.0f} K?",
        probe=lambda probe, warmer: probe.with_(base_temperature_K=base + warmer),
        starts=(30.0, 60.0, 100.0),
    )


def _of_a_parameter(probe: Probe, name: str) -> Hypothesis:
    (stated,) = probe.values([name]).tolist()
    parameter, whose = parameter_named(name), "doping" if name == "n_d" else "drawing"
    return Hypothesis(
        lambda value: (
            f"is the {whose} another, with {parameter.symbol} rather {value:.3g} than "
            f"{with_unit(f'{stated:.3g}', parameter.unit)}?"
        ),
        parameter=name,
    )


# --- the likeliest of it ------------------------------------------------------------------------


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
    def of(cls, lever: Linearised, priors: Mapping[str, Prior]) -> _Curve:
        """Return the curve of a lever that was solved as far as it goes."""
        probe, names = lever.probe, _with_powers(lever.probe, priors)
        spreads = [priors[name].absolute / abs(priors[name].value) for name in names]
        by = lever.output_slopes[..., [lever.names.index(name) for name in names]]
        surrogate = CurveSurrogate(probe, names, lever.branch, by, Rows(np.zeros(0)))
        u = np.linspace(float(lever.branch.u[1]), lever.branch.end_u, 240)
        outputs = np.maximum(lever.branch.curve(u)[:, :2], 1e-12)
        powers = surrogate.powers(u)[:, :2]
        return cls(probe, np.zeros(len(names)), names, np.array(spreads), np.log(outputs), powers)

    def current(self, away: Array, rows: MeasuredRows) -> Array:
        """Return I_h (mA) at the biases, for logarithms of parameters over the probe's.

        Beyond its end the branch stays level: no lever takes such a bias. Both polarities are taken
        to show the same.
        """
        outputs, bias = self._along(away, rows)
        passed = np.append(0.0, np.maximum.accumulate(bias))
        size = np.interp(np.abs(rows.bias_V), passed, np.append(0.0, outputs[:, 1]))
        return np.asarray(np.copysign(size, rows.bias_V))

    def current_by_logarithm(self, away: Array, rows: MeasuredRows) -> Array:
        """Return the derivatives of `current` by the logarithms, (rows, p)."""
        outputs, bias = self._along(away, rows)
        highest, number = np.maximum.accumulate(bias), np.arange(bias.size)
        # where the bias falls along the branch, that of the highest point before counts
        latest = np.maximum.accumulate(np.where(bias == highest, number, 0))
        changes, cold = outputs[:, :, None] * self.powers, np.zeros((1, away.size))
        current_by = np.concatenate([cold, changes[:, 1]])
        of_bias = changes[:, 0] + rows.series_kohm * changes[:, 1]
        bias_by = np.concatenate([cold, of_bias[latest]])
        passed, current = np.append(0.0, highest), np.append(0.0, outputs[:, 1])
        size = np.abs(rows.bias_V)
        before = np.minimum(np.searchsorted(passed, size, side="right") - 1, bias.size - 1)
        after, beyond = before + 1, size >= passed[-1]
        width = np.where(beyond, 1.0, passed[after] - passed[before])
        share = np.where(beyond, 1.0, (size - passed[before]) / width)[:, None]
        steep = np.where(beyond, 0.0, (current[after] - current[before]) / width)[:, None]
        at_before = current_by[before] - steep * bias_by[before]
        at_after = current_by[after] - steep * bias_by[after]
        sign = np.copysign(1.0, rows.bias_V)[:, None]
        return np.asarray(sign * ((1.0 - share) * at_before + share * at_after))

    def _along(self, away: Array, rows: MeasuredRows) -> tuple[Array, Array]:
        """Return V_l and I_h along the branch, (n, 2), and the bias there, (n,)."""
        outputs = np.exp(self.logarithms + self.powers @ (away - self.at))
        return outputs, outputs @ np.array([1.0, rows.series_kohm])


def _with_powers(probe: Probe, priors: Mapping[str, Prior]) -> tuple[str, ...]:
    """Return the parameters with whose powers the curve of a probe goes."""
    # the resistor is a hypothesis of its own; what is 0 has no logarithm
    return tuple(
        name
        for name in parameters_of(probe)
        if name in priors and name != "series_resistance_ohm" and priors[name].value > 0
    )


@dataclass(frozen=True)
class _Explanation:
    """Where a search with a hypothesis ended.

    Attributes
    ----------
    hypothesis : Hypothesis
    curve : _Curve
        Of the lever that was solved, from which the search went on.
    squares : float
        Sum of squares that is left unexplained.
    unknown : float
        That of the hypothesis, as it was found.
    away : ndarray, shape (p,)
        Logarithms of the lever's parameters over those of the curve's probe.
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


def _likeliest_first(explanations: Iterable[_Explanation]) -> list[_Explanation]:
    return sorted(explanations, key=lambda explained: explained.squares)


class Diagnosis:
    """What may be behind data that contradict a probe.

    Parameters
    ----------
    measured : Measurement
    probe : Probe
        In the circuit and the medium that it is said to be in.
    priors : mapping of str to Prior or str, optional
        In place of some of the usual ones.
    options : DiagnosisOptions, optional
    names : sequence of str
        What a search for the lever wants to know derivatives by; see `stated`.
    """

    def __init__(
        self,
        measured: Measurement,
        probe: Probe,
        priors: Mapping[str, Prior | str] | None = None,
        options: DiagnosisOptions | None = None,
        names: Sequence[str] = (),
    ) -> None:
        self.options = options or DiagnosisOptions()
        current = measured.current(probe.circuit)
        here = np.isfinite(current) & np.isfinite(measured.bias_V)
        data = measured.bias_V[here], current[here]
        self._rows = MeasuredRows(*data, probe.circuit.series_kohm, np.ones(here.sum(), dtype=bool))
        self._probe, self._priors, self._names = probe, priors or None, names
        self._curves: dict[Probe, _Curve] = {}
        largest = np.abs(self._rows.current_mA).max(initial=1e-300)
        # a current of few steps is off by half of one, whatever lever it is of
        self._coarseness = 0.5 * resolution_of(self._rows.current_mA) / float(largest)

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
        # the most promising are solved anew where they lead
        return self._questions(_likeliest_first(map(self._again, explanations[:4])))

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
        drawing, *others = _of_another_lever(self._rows, self._probe, self._curve.names)
        explanations = self._searched([drawing])
        if explanations and self._explains(explanations[0]):
            # what takes no other lever to be solved may explain them as well
            explanations += self._searched([each for each in others if each.probe is None])
        nothing, explanations = self._from_cold_rows, _likeliest_first(explanations)
        least = min((explained.squares for explained in explanations), default=np.inf)
        if self._explains(nothing) and nothing.squares < least + self.options.as_likely_difference:
            return ""
        question = self._questions(explanations) or self.likeliest()
        return question or (
            "is it another lever, or in another medium, or known less well than its priors say?"
        )

    def _searched(self, hypotheses: Sequence[Hypothesis]) -> list[_Explanation]:
        """Return where searches with hypotheses end, the likeliest first."""
        explanations = []
        for hypothesis in hypotheses:
            with suppress(ComputationError, InputError):  # there may be no such lever
                explanations.append(self._search(hypothesis))
        return _likeliest_first(explanations)

    def _questions(self, explanations: Sequence[_Explanation]) -> str:
        """Return what the likeliest explanations ask; empty if they explain nothing."""
        explanations = [explained for explained in explanations if explained.question]
        best = explanations[0] if explanations else self._without
        options, squares = self.options, best.squares
        if squares > options.improvement * self._without.squares or not self._explains(best):
            return ""
        limit = max(options.as_likely_factor * squares, squares + options.as_likely_difference)
        as_likely = [explained for explained in explanations if explained.squares <= limit]
        # what explains all rows displaces what leaves some out
        whole = [explained for explained in as_likely if not explained.hypothesis.partial]
        as_likely = whole or as_likely
        as_likely.sort(key=lambda explained: explained.hypothesis.far_fetched)
        questions = dict.fromkeys(explained.question for explained in as_likely)
        return " or: ".join(list(questions)[:2])

    @cached_property
    def _without(self) -> _Explanation:
        """What is left unexplained without a hypothesis."""
        return self._again(self._as_stated)

    @cached_property
    def _from_cold_rows(self) -> _Explanation:
        """The same, from what the colder half of the rows makes of the lever.

        All rows at once lead away from a lever of which little is known; cold ones tell its doping.
        """
        size = np.abs(self._rows.bias_V)
        cold = size <= np.median(size)
        colder = Hypothesis(lambda _: "", lambda rows, _: replace(rows, included=cold))
        of_cold_rows = self._again(self._estimated(colder, 0.0, self._curve))
        nothing = self._as_stated.hypothesis
        return self._again(replace(of_cold_rows, hypothesis=nothing, squares=np.inf))

    @cached_property
    def _as_stated(self) -> _Explanation:
        """The same, from the lever that was stated alone."""
        return self._estimated(Hypothesis(lambda _: ""), 0.0, self._curve)

    @cached_property
    def stated(self) -> Linearised:
        """The lever as it is stated, on a coarse mesh, as far as it goes."""
        return self._linearised(self._probe, self._names)

    @cached_property
    def _curve(self) -> _Curve:
        return _Curve.of(self.stated, known_beforehand(self._probe, self._priors))

    def _linearised(self, probe: Probe, names: Sequence[str] = ()) -> Linearised:
        """Solve a probe as far as it goes."""
        own = _with_powers(probe, known_beforehand(probe, self._priors))
        every, whole = tuple(dict.fromkeys([*names, *own])), Reach(probe.circuit, np.inf)
        return SimilarLevers(Lever(probe, COARSE)).linearised(probe, whole, names=every)

    def _solved(self, probe: Probe) -> _Curve:
        if probe not in self._curves:
            priors = known_beforehand(probe, self._priors)
            self._curves[probe] = _Curve.of(self._linearised(probe), priors)
        return self._curves[probe]

    def _explains(self, explained: _Explanation) -> bool:
        return explained.squares < self._least_unexplained

    def _is_near(self, explained: _Explanation) -> bool:
        """Whether a search may explain the data that a coarse lever does not quite."""
        return explained.squares < self.options.another_lever * self._least_unexplained

    @property
    def _least_unexplained(self) -> float:
        options = self.options
        return options.squares_per_row * self._rows.included.size + options.squares

    def _search(self, hypothesis: Hypothesis) -> _Explanation:
        """Estimate the lever with a hypothesis, from each of its starts; return the best."""
        ends = []
        for start in hypothesis.starts:
            # as stated, and as near to the data as priors let a lever come
            curves = [self._curve, self._without.curve]
            if hypothesis.probe is not None:
                curves = [self._solved(hypothesis.probe(self._probe, start))]
            ends += [self._estimated(hypothesis, start, curve) for curve in curves]
        return _likeliest_first(ends)[0]

    def _again(self, explained: _Explanation) -> _Explanation:
        """Solve the lever where a search has led, and go on from there."""
        curve = explained.curve
        stated, every = curve.probe.values(curve.names), parameters_of(curve.probe)
        # no lever is where a search went beyond what a parameter may be: the nearest one serves
        bounds = np.array([every[name].bounds for name in curve.names]).T
        values = np.clip(stated * np.exp(explained.away), *bounds)
        try:
            estimate = curve.probe.with_(**dict(zip(curve.names, values.tolist(), strict=True)))
            curve = replace(self._solved(estimate), probe=curve.probe, at=np.log(values / stated))
        except (InputError, ComputationError):
            return explained
        again = self._estimated(explained.hypothesis, explained.unknown, curve)
        return _likeliest_first([explained, again])[0]

    def _estimated(self, hypothesis: Hypothesis, start: float, curve: _Curve) -> _Explanation:
        """Return the lever that priors and rows make most likely.

        The search is for logarithms of parameters in units of their spreads, and for the unknown.
        """
        options, spreads, count = self.options, curve.spreads, curve.spreads.size
        beyond, of_largest = options.robust_beyond, options.error_of_largest + self._coarseness
        informed = np.array([name != hypothesis.parameter for name in curve.names])

        def rows_at(point: Array) -> tuple[MeasuredRows, Array]:
            """Return the rows as they should have been, and their errors."""
            value = start + point[-1] if hypothesis.free else start
            rows = self._rows if hypothesis.rows is None else hypothesis.rows(self._rows, value)
            size = np.abs(rows.current_mA)
            return rows, options.error * size + of_largest * size.max()

        def away_in_errors(point: Array, rows: MeasuredRows, errors: Array) -> Array:
            missing = curve.current(point[:count] * spreads, rows) - rows.current_mA
            return np.asarray(missing / (errors * beyond))

        def weighted(point: Array) -> Array:
            rows, errors = rows_at(point)
            missing = away_in_errors(point, rows, errors)
            soft = beyond * np.sqrt(np.log1p(missing**2)) * np.sign(missing)
            residuals = np.where(rows.included, soft, np.sqrt(options.excluded_row))
            return np.concatenate([residuals, point[:count][informed]])

        def by_point(point: Array) -> Array:
            rows, errors = rows_at(point)
            missing = away_in_errors(point, rows, errors)
            root = np.sqrt(np.log1p(missing**2))
            # soft residuals grow as the others where these are small
            less = np.divide(np.abs(missing), root, out=np.ones_like(root), where=root > 0.0)
            weight = rows.included * less / (1.0 + missing**2) / errors
            by = weight[:, None] * curve.current_by_logarithm(point[:count] * spreads, rows)
            jacobian = np.concatenate([by * spreads, np.eye(count)[informed]])
            if not hypothesis.free:
                return jacobian
            # what the unknown does to the rows is not differentiated
            moved = point.copy()
            moved[-1] += 1e-7 * max(1.0, abs(point[-1]))
            change = (weighted(moved) - weighted(point)) / (moved[-1] - point[-1])
            return np.column_stack([jacobian, change])

        begin = np.append(curve.at / spreads, [0.0] * hypothesis.free)
        # a parameter of which nothing is known is within a factor of thirty of what was stated
        widest = np.append(np.log(30.0) / spreads, [np.inf] * hypothesis.free)
        end = least_squares(weighted, begin, by_point, (-widest, widest), max_nfev=40)
        away, value = end.x[:count] * spreads, start
        if hypothesis.free:
            value += float(end.x[-1])
        if hypothesis.parameter:
            number = curve.names.index(hypothesis.parameter)
            value = float(curve.probe.values(curve.names)[number] * np.exp(away[number]))
        unknowns = hypothesis.free + bool(hypothesis.parameter)
        squares = 2.0 * float(end.cost) + options.unknown * unknowns
        return _Explanation(hypothesis, curve, squares, value, away)
