"""Tip temperatures in tables with an error budget, by bias or a pulse's height; and the knee."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hotlever.datasets import columns_text, labelled
from hotlever.errors import InputError, unknown_name
from hotlever.lever.transient import pulse
from hotlever.probe import Circuit
from hotlever.quantities import QUANTITIES
from hotlever.text import BAND
from hotlever.types import Array, Mask

if TYPE_CHECKING:
    import xarray as xr

#: Columns of a calibration's table; the last say how sure it is.
STATED = ("tip_stderr_K", "tip_low_K", "tip_high_K")
TABLE_COLUMNS = ("bias_V", "lever_V", "current_mA", "power_mW", "tip_K", *STATED)
#: More of a tip in contact: its apex and the sample's surface under it, and their standard errors.
OF_THE_CONTACT = ("apex_K", "apex_stderr_K", "surface_K", "surface_stderr_K")
#: What rows may be even in, by the word for it: their column and its unit.
TABLES_BY = {"temperature": ("tip_K", "K"), "power": ("power_mW", "mW"), "bias": ("bias_V", "V")}
#: What is told of a pulse: its highest tip temperature, that at its end, and the mean during it.
MOMENTS = ("peak", "end", "mean")
#: Columns of the table of a pulse.
PULSE_COLUMNS = (
    "height_V",
    *(f"{moment}{of}_K" for moment in MOMENTS for of in ("", "_stderr", "_low", "_high")),
)


@dataclass(frozen=True)
class TipTable:
    """Tip temperatures in rows that rise in ``{along}_V``, with their errors by source.

    What is printed, written and interpolated is read off arrays; users have the same as `dataset`.

    Attributes
    ----------
    columns : mapping of str to ndarray, shape (rows,)
    budgets : mapping of str to mapping of str to ndarray, shape (rows,)
        Standard errors (K) by source, independent of each other: of the tip ``budget_K``, and in
        contact ``apex_budget_K``; both have the same sources.
    along : {"bias", "height"}
    """

    columns: Mapping[str, Array]
    budgets: Mapping[str, Mapping[str, Array]]
    along: str = "bias"

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def rows(self, chosen: slice | Mask) -> TipTable:
        """Return some of the rows."""
        columns = {name: values[chosen] for name, values in self.columns.items()}
        budgets = {
            name: {source: part[chosen] for source, part in parts.items()}
            for name, parts in self.budgets.items()
        }
        return TipTable(columns, budgets, self.along)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The columns on the dimension ``along``, and the budgets by ``source`` too."""
        sources = list(self.budgets["budget_K"])
        errors = {
            name: (("source", self.along), np.array([parts[source] for source in sources]))
            for name, parts in self.budgets.items()
        }
        coordinates = {self.along: self[f"{self.along}_V"], "source": sources}
        return labelled({**self.columns, **errors}, self.along, coordinates)


def total_error(parts: Mapping[str, Array]) -> Array:
    """Return the standard error of which independent ones are the parts."""
    return np.sqrt(np.sum([part**2 for part in parts.values()], axis=0))


def interpolated(
    table: TipTable, values: ArrayLike, along: str, column: str, tip: str = "tip_K"
) -> Array:
    """Return a column of a table at values of another one that rises; NaN outside and in a jump."""
    at = np.asarray(values, dtype=float)
    line = np.interp(at, table[along], table[column])
    return np.where(_no_jump(table, along, at, tip), line, np.nan)


def _no_jump(table: TipTable, along: str, at: Array, tip: str) -> Mask:
    """Return whether values of a column are those of a row, or lie between two near each other."""
    rising, steps = table[along], np.abs(np.diff(table[tip]))
    # a lever jumps between rows that are much further apart than `with_steep_rows` puts them, and
    # than those beside them: tables of 0.1 have no more rows where the tip is steep
    beside = np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    smooth = np.concatenate([[False], steps <= np.maximum(25.0, 2.4 * beside), [False]])
    return np.asarray(smooth[np.searchsorted(rising, at, side="right")] | np.isin(at, rising))


def with_steep_rows(even: Array, bias: Array, tip: Array, steep_K: float = 10.0) -> Array:
    """Return biases (V), and more between them where the tip rises by more than `steep_K`.

    Where a ramp of the bias jumps there are none: no bias leads to what lies between.

    Parameters
    ----------
    even : ndarray
        Rising biases (V).
    bias, tip : ndarray, shape (n,)
        Rising biases (V) over the same range, many more of them, and the tip temperature there (K).
    """
    rows = [even]
    for low, high in pairwise(even):
        inside = (bias >= low) & (bias <= high)
        here, rises = tip[inside], np.diff(tip[inside])
        if rises.sum() > steep_K and np.all((rises > 0.0) & (rises < steep_K)):
            between = np.linspace(here[0], here[-1], int(np.ceil(rises.sum() / steep_K)) + 1)
            rows.append(np.interp(between[1:-1], here, bias[inside]))
    return np.unique(np.concatenate(rows))


def even_rows(
    table: TipTable,
    names: Sequence[str],
    along: str,
    step: float | None = None,
    tip: str = "tip_K",
    fewest: int = 50,
    most: int = 10_000,
) -> dict[str, Array]:
    """Return columns of a table at even values of one of them, and at its ends.

    Between rows whose tip temperatures are far apart, as a ramp of the bias jumps over some, there
    are none.

    Parameters
    ----------
    table : TipTable
        From the coldest row on.
    names : sequence of str
    along : str
        The column that the rows are even in.
    step : float, optional
        In its unit; by default the largest of 1, 2 and 5 times a power of ten that gives enough.
    tip : str
        The column of tip temperatures.
    fewest, most : int
        So many rows are enough, and no more are allowed.

    Raises
    ------
    InputError
        If the column does not rise, or there would be more than `most`.
    """
    values, unit, meaning = table[along], QUANTITIES[along].unit, QUANTITIES[along].meaning
    if not np.all(np.diff(values) > 0.0):
        raise InputError(f"a table by {meaning}: it does not rise all along, expected by bias")
    if step is None:
        largest = np.ptp(values) / fewest
        power = 10.0 ** np.floor(np.log10(largest))
        step = float(power * max(digit for digit in (1, 2, 5) if digit * power <= largest))
    if np.ptp(values) > most * step:
        raise InputError(
            f"a table by {meaning}: found a step of {step:g} {unit} over {np.ptp(values):.4g} "
            f"{unit}, expected at most {most} rows"
        )
    even = step * np.arange(np.floor(values[0] / step) + 1.0, np.ceil(values[-1] / step))
    # steps such as 0.1 are no binary numbers
    even = even[(even > values[0]) & (even < values[-1])]
    even = even[_no_jump(table, along, even, tip)]
    at = np.concatenate([values[:1], even, values[-1:]])
    return {name: np.interp(at, values, table[name]) for name in names}


def table_by_bias(
    circuit: Circuit,
    bias: Array,
    current: Array,
    tip: Array,
    budgets: Mapping[str, Mapping[str, Array]],
    limits: tuple[Array, Array] | None = None,
    more: Mapping[str, Array] | None = None,
) -> TipTable:
    """Return the table of bias (V), current (mA) and tip temperature (K), with its errors.

    95 % lie between the limits, or as far away as the errors say. There may be `more` columns.
    """
    stderr, lever = total_error(budgets["budget_K"]), circuit.lever_voltage(bias, current)
    low, high = limits or (tip - BAND * stderr, tip + BAND * stderr)
    values = (bias, lever, current, lever * current, tip, stderr, low, high)
    columns = dict(zip(TABLE_COLUMNS, values, strict=True))
    return TipTable({**columns, **(more or {})}, budgets)


def rms(difference: Array) -> float:
    """Return the root mean square of what is known of a difference; NaN if nothing is."""
    present = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(present**2))) if present.size else float("nan")


@dataclass(frozen=True)
class Knee:
    """The knee of a lever, as its points show it or as it was estimated.

    Attributes
    ----------
    lever_V, current_mA, power_mW, bias_V : float
    lever_V_stderr, current_mA_stderr, power_mW_stderr, bias_V_stderr : float
        From the scatter of the points, or of an estimated lever.
    current_noise : float
        Standard deviation of the current over the current, as the points scatter.
    points : int
        How many were used.
    tip_K, tip_K_stderr : float
        Tip temperature there, which points do not show.

    All but the power and the tip are NaN where no point is near enough.
    """

    lever_V: float = np.nan
    current_mA: float = np.nan
    power_mW: float = np.nan
    bias_V: float = np.nan
    lever_V_stderr: float = np.nan
    current_mA_stderr: float = np.nan
    power_mW_stderr: float = np.nan
    bias_V_stderr: float = np.nan
    current_noise: float = np.nan
    points: float = np.nan
    tip_K: float = np.nan
    tip_K_stderr: float = np.nan

    @property
    def measured(self) -> bool:
        """Whether the points show it."""
        return bool(np.isfinite(self.lever_V))

    def without_errors(self) -> Knee:
        """Return the same knee, with standard errors that nobody knows."""
        return Knee(self.lever_V, self.current_mA, self.power_mW, self.bias_V, tip_K=self.tip_K)


# --- of pulses ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class PulseTiming:
    """Length of a rectangular pulse and the period of its repetition (µs), if it is repeated."""

    length_us: float
    period_us: float | None = None

    def __post_init__(self) -> None:
        pulse(1.0, self.length_us, self.period_us)

    @property
    def text(self) -> str:
        """What it is, in words."""
        each = "" if self.period_us is None else f" each {self.period_us:g} µs"
        return f"a pulse of {self.length_us:g} µs{each}"


@dataclass(frozen=True)
class PulseCalibration:
    """Tip temperatures of a calibrated lever in a pulse.

    Attributes
    ----------
    timing : PulseTiming
        A repeated pulse is one in the cyclic steady state of its train.
    tabulated : TipTable
        `PULSE_COLUMNS` over the heights of the calibrated range, and ``budget_K``, the standard
        error of the peak by source.
    """

    timing: PulseTiming
    tabulated: TipTable

    @property
    def table(self) -> xr.Dataset:
        """What is ``tabulated``, on the dimension ``height``; ``budget_K`` by ``source`` too."""
        return self.tabulated.dataset

    def tip_temperature(self, height_V: ArrayLike, moment: str = "peak") -> Array:
        """Return the tip temperature (K) by the height of the pulse (V); NaN out of range.

        Parameters
        ----------
        height_V : array_like
        moment : {"peak", "end", "mean"}
        """
        return interpolated(self.tabulated, height_V, "height_V", _column(moment), tip="peak_K")

    def height_for(self, tip_K: ArrayLike, moment: str = "peak") -> Array:
        """Return the height (V) of the pulse for a tip temperature (K); NaN out of range.

        Parameters
        ----------
        tip_K : array_like
        moment : {"peak", "end", "mean"}
        """
        return interpolated(self.tabulated, tip_K, _column(moment), "height_V", tip="peak_K")

    def table_csv(self, by: str = "temperature", step: float | None = None) -> str:
        """Return the table as CSV, to load into an instrument; see `Estimate.table_csv`.

        Raises
        ------
        InputError
            If there is none by power, which a pulse has no single one of, or the rows are too many.
        """
        along = {"temperature": "peak_K", "bias": "height_V"}.get(by)
        if along is None:
            raise InputError(f"a table of pulses by {by}: expected by temperature or bias")
        rows = even_rows(self.tabulated, PULSE_COLUMNS, along, step, tip="peak_K")
        return columns_text(rows, digits=6)


def _column(moment: str) -> str:
    if moment not in MOMENTS:
        raise unknown_name("moment", moment, MOMENTS)
    return f"{moment}_K"
