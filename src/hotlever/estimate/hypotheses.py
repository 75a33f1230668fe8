"""What may be wrong with data, or with what is said of their lever: one list of hypotheses.

Each changes the rows that were measured, or the probe, by one unknown, and asks one question.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hotlever.materials.parameters import parameter_named
from hotlever.measurement.compliance import is_level
from hotlever.probe import Probe
from hotlever.text import with_unit
from hotlever.types import Array, Mask

#: A current that stands at its highest value in so many rows may be clipped, though that is not
#: seen without the lever, if it is below that in so many.
_LEVEL_ROWS, _BELOW = 2, 5
#: The range of a meter may be off by such a factor, and its zero by such a share.
_FACTOR, _OF_THE_ZERO = 50.0, 0.5
#: A bias that falls by more than this share of its range goes back; less is noise of its meter.
_BACK = 0.05
#: The current of one sweep may jump from row to row: by this share of it, and by so many times as
#: much as usually; rows that tell, and how many jumps are tried.
_JUMP, _OUTSTANDING, _JUMP_ROWS, _JUMPS_TRIED = 0.01, 5.0, 8, 3
#: How much warmer than stated the base may be (K).
_WARMER = (30.0, 60.0, 100.0)


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
    """

    asks: Callable[[float], str]
    rows: Callable[[MeasuredRows, float], MeasuredRows] | None = None
    probe: Callable[[Probe, float], Probe] | None = None
    starts: Sequence[float] = (0.0,)
    parameter: str = ""
    free: bool = False
    far_fetched: bool = False


def hypotheses_of(rows: MeasuredRows, probe: Probe, names: Sequence[str]) -> list[Hypothesis]:
    """Return all that may be wrong; names are those of the parameters that have priors."""
    return [
        *of_another_lever(rows, probe, names),
        *_of_the_meter(rows),
        *_of_the_rows(rows),
        _of_the_base(probe),
    ]


def of_another_lever(rows: MeasuredRows, probe: Probe, names: Sequence[str]) -> list[Hypothesis]:
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
    largest, along = float(rows.current_mA.max()), np.linspace(0.0, 1.0, rows.bias_V.size)

    def raised(pattern: Array | float, rows: MeasuredRows, share: float) -> MeasuredRows:
        return replace(rows, current_mA=rows.current_mA - share * largest * pattern)

    def asks(question: str) -> Callable[[float], str]:
        return lambda share: (
            f"{question} by {share:+.1%} of its largest value?" if abs(share) < _OF_THE_ZERO else ""
        )

    def times(factor: float) -> str:
        # or else it is another unit
        of_a_range = 1.0 / _FACTOR < factor < _FACTOR
        return f"is the current {factor:.3g} times what it should be?" if of_a_range else ""

    zero, drift = "is the zero of the current off", "does the zero of the current drift"
    return [
        Hypothesis(times, _divided_current, starts=(1.0,), free=True, far_fetched=True),
        Hypothesis(asks(zero), partial(raised, 1.0), free=True),
        Hypothesis(asks(drift), partial(raised, along), free=True),
    ]


def _of_the_resistor(rows: MeasuredRows) -> Hypothesis:
    stated = rows.series_kohm
    measured = float(np.median(rows.bias_V / np.maximum(np.abs(rows.current_mA), 1e-12)))

    def other(rows: MeasuredRows, kohm: float) -> MeasuredRows:
        return replace(rows, series_kohm=max(kohm, 0.0))

    return Hypothesis(
        lambda kohm: (
            f"is the series resistance, with contacts, rather {kohm:.3g} than {stated:.3g} kΩ?"
        ),
        other,
        starts=(stated, stated / 2, 0.8 * measured),
        free=True,
    )


def _of_the_rows(rows: MeasuredRows) -> list[Hypothesis]:
    bias, current, number = rows.bias_V, rows.current_mA, np.arange(rows.bias_V.size)
    clipped = []
    level = is_level(current)
    if level.sum() >= _LEVEL_ROWS and (~level).sum() >= _BELOW:
        text = f"is the current clipped at {current.max():.3g} mA, by the range of its meter?"
        clipped.append(Hypothesis(lambda _: text, lambda rows, _: replace(rows, included=~level)))

    def part(first: bool, rows: MeasuredRows, cut: float) -> MeasuredRows:
        return replace(rows, included=(number < cut) == first)

    # one sweep is no two; but something may have changed on the way
    back = _BACK * float(np.ptp(bias))
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
    both = [Hypothesis(asks, partial(part, first), starts=cuts) for first in (True, False) if cuts]
    return [*clipped, *both]


def _jumps(bias: Array, current: Array) -> list[int]:
    """Return rows of one sweep from which on the current may be another one.

    Straight lines through two rows on either side say how far it jumps there; a knee has the
    largest of some levers.
    """
    used = np.flatnonzero(np.append(True, np.diff(bias) != 0.0) & (bias > 0) & (current > 0))
    if used.size < _JUMP_ROWS:
        return []
    x, y = np.log(bias[used]), np.log(current[used])
    slope = np.diff(y) / np.diff(x)
    middle = 0.5 * (x[1:-2] + x[2:-1])
    before = y[1:-2] + slope[:-2] * (middle - x[1:-2])
    after = y[2:-1] + slope[2:] * (middle - x[2:-1])
    jump = np.abs(after - before)
    least = max(_JUMP, _OUTSTANDING * float(np.median(jump)))
    largest = np.argsort(-jump, kind="stable")[:_JUMPS_TRIED]
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
        starts=_WARMER,
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
