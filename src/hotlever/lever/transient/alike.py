"""A train of pulses, followed period by period until one begins as the one before.

From there on each period is a copy of the last, in time and in the energies added up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from hotlever.lever.state import State
from hotlever.lever.transient.history import ENERGIES, followed, history_dataset, kept_in
from hotlever.lever.transient.waveform import Polyline, Waveform
from hotlever.types import Array, Progress

if TYPE_CHECKING:
    from hotlever.lever.lever import Lever

#: Share of the tolerance by which all later periods together may differ from a copy.
_ALIKE = 0.01
#: Parts of the time that progress is told in.
_PARTS = 1000


@dataclass
class Train:
    """What is known of a train, as far as it was followed.

    Attributes
    ----------
    lever : Lever
    waveform : Waveform
    period : float
        µs.
    tolerance_K : float
    asked : ndarray, or None
        Times (µs) to report; None for those at which the solver stepped.
    per_step : int
        See `hotlever.lever.transient.history.followed`.
    begins : list of State
        At the beginning of each period that was followed.
    alike : int or None
        The first period that is a copy, if one is.
    states : list of (float, State)
        At the times reported.
    """

    lever: Lever
    waveform: Waveform
    period: float
    tolerance_K: float
    asked: Array | None
    per_step: int = 1
    begins: list[State] = field(default_factory=list)
    alike: int | None = None
    states: list[tuple[float, State]] = field(default_factory=list)
    _columns: list[dict[str, Array]] = field(default_factory=list)
    _added: dict[str, float] = field(default_factory=lambda: dict.fromkeys(ENERGIES, 0.0))

    def begin(self, number: int) -> State:
        """Return the state at the beginning of a period, counted from 0."""
        return self.begins[number if self.alike is None else min(number, self.alike)]

    def followed(self, end: float, progress: Progress | None = None) -> xr.Dataset:
        """Follow the train to an end (µs).

        Raises
        ------
        ComputationError
            If silicon melts, or a step fails.
        """
        size = self.lever.space.size + 1
        whole = min(self.waveform.count, int(end / self.period * (1.0 + 1e-9)))
        state, last = State(self.lever, np.zeros((size, 1))), 0.0
        for number in range(whole):
            self.begins.append(state)
            after = self._over(number, state, self.waveform, self.period)
            change = float(np.abs(self.lever.space.rises(after.x - state.x)).max())
            left = change**2 / (last - change) if change < last else np.inf
            state, last = after, change
            if progress is not None:
                progress(int(_PARTS * (number + 1) * self.period / end), _PARTS)
            if left < _ALIKE * self.tolerance_K:
                self.begins.append(state)
                self.alike = number + 1
                self._copy(number + 1, whole)
                break
        rest = end - whole * self.period
        if rest > 1e-9 * end:
            wave = self.waveform
            if whole == wave.count:
                volts = float(wave.bias(np.array([end]))[0])
                wave = Polyline(wave.text, (0.0,), (volts,), rest, volts)
            self._over(whole, state, wave, rest)
        columns = {
            name: np.concatenate([part[name] for part in self._columns])
            for name in self._columns[0]
        }
        return history_dataset(self.lever, self.waveform, columns)

    def _over(self, number: int, start: State, wave: Waveform, length: float) -> State:
        """Go on over a period, or what is left; return the state behind."""
        at, kept = self._within(number, 1, length)
        data, states = self._run(start, wave, length, at)
        self._add(data, states, kept, number)
        return states[-1][1]

    def _within(self, first: int, count: int, length: float) -> tuple[Array | None, Array | None]:
        """Return the times within some periods to report, all as if in one, with its end."""
        if self.asked is None:
            return None, None
        begin = first * self.period
        here = (self.asked > begin) & (self.asked <= begin + (count - 1) * self.period + length)
        here |= (self.asked == 0.0) & (first == 0)
        kept = self.asked[here]
        number = np.clip(np.ceil(kept / self.period - 1e-9) - 1.0, first, first + count - 1)
        return np.union1d(np.clip(kept - number * self.period, 0.0, length), length), kept

    def _run(
        self, start: State, wave: Waveform, length: float, at: Array | None
    ) -> tuple[xr.Dataset, list[tuple[float, State]]]:
        states: list[tuple[float, State]] = []
        options: Any = {"tolerance_K": self.tolerance_K, "per_step": self.per_step}
        data = followed(self.lever, wave, length, at, start=start, seen=kept_in(states), **options)
        return data, states

    def _add(
        self,
        data: xr.Dataset,
        states: list[tuple[float, State]],
        kept: Array | None,
        number: int,
    ) -> None:
        """Add the rows of a period, and its energies to those before."""
        begin, time = number * self.period, data.time.values
        # the first row of a later period is the last one of that before
        rows = np.arange(min(number, 1), time.size)
        shown = begin + time[rows]
        if kept is not None:
            rows = np.abs(time[None, :] - (kept - begin)[:, None]).argmin(axis=1)
            shown = kept
        columns = {str(name): values.values[rows] for name, values in data.data_vars.items()}
        columns["time_us"] = shown
        for name, before in self._added.items():
            columns[name] = before + columns[name]
            self._added[name] = before + float(data[name].values[-1])
        self._columns.append(columns)
        pairs = zip(shown.tolist(), rows.tolist(), strict=True)
        self.states += [(t, states[row][1]) for t, row in pairs]

    def _copy(self, first: int, whole: int) -> None:
        """Add the periods that are alike, up to the last whole one."""
        if first >= whole:
            return
        at, _ = self._within(first, whole - first, self.period)
        data, states = self._run(self.begins[-1], self.waveform, self.period, at)
        for number in range(first, whole):
            _, kept = self._within(number, 1, self.period)
            self._add(data, states, kept, number)
