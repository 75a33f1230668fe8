"""Long trains of pulses, followed on modes where those are certified by the full lever.

Modes are those of the first periods. On them the train is followed, until its periods are alike;
then the full lever is followed from a state late in the train, and tells, as the first periods do,
how far the reduced one departs within a period, and from that to the next. Where it departs too
far, what the full lever did there joins the snapshots, and the train is followed once more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.errors import ComputationError
from hotlever.lever.state import State
from hotlever.lever.transient.alike import Train
from hotlever.lever.transient.history import Seen, checked_times, followed
from hotlever.lever.transient.reduced import on_all_nodes, reduced_in_time
from hotlever.lever.transient.waveform import Waveform
from hotlever.threads import one_blas_thread
from hotlever.types import Array

if TYPE_CHECKING:
    from hotlever.lever.lever import Lever

#: Periods from which modes pay; those that are followed to make them, or to compare; and how
#: often they are made.
FEWEST, _PERIODS, _ROUNDS = 20, 2, 4
#: Points of a history for each step, where levers are compared.
_PER_STEP = 2
#: Most of what a departure within a period grows to, as it is carried on by the next ones.
_LARGEST_RATIO = 0.97


@one_blas_thread
def simulate(
    lever: Lever,
    waveform: Waveform,
    until: float | None = None,
    at: ArrayLike | None = None,
    *,
    tolerance_K: float = 0.1,
    seen: Seen | None = None,
    **options: Any,
) -> xr.Dataset:
    """Simulate a lever in time, on modes if the wave form is repeated often and they suffice.

    Parameters and errors are those of `hotlever.lever.transient.history.followed`; ``notes`` of the
    dataset say whether modes were used, and how far from the full lever they are.

    Examples
    --------
    >>> from hotlever import Lever, Probe
    >>> from hotlever.lever.transient import pulse
    >>> history = simulate(Lever(Probe.reference()), pulse(10.0, 5.0), at=[5.0, 100.0])
    >>> history.tip_K.values.round().tolist()
    [410.0, 293.0]
    """
    given = {"tolerance_K": tolerance_K, **options}
    end, period = waveform.usual_end if until is None else until, waveform.period
    if at is not None and until is None:
        end = float(checked_times(at)[-1])
    often = period is not None and waveform.count >= FEWEST and FEWEST * period <= end < np.inf
    # modes are of levers that only the swept supply drives
    if period is None or not often or lever.space.wired:
        return followed(lever, waveform, until, at, seen=seen, **given)
    try:
        return _Train(lever, waveform, period, end, given).followed(at, seen)
    except ComputationError:
        # it melts, or is like no train that modes are good for
        return followed(lever, waveform, until, at, seen=seen, **given)


class _Train:
    def __init__(
        self, lever: Lever, waveform: Waveform, period: float, end: float, options: dict[str, Any]
    ) -> None:
        self._lever, self._waveform, self._period = lever, waveform, period
        self._end, self._options = end, options
        self._tolerance_K: float = options["tolerance_K"]
        whole = min(waveform.count, int(end / period * (1.0 + 1e-9)))
        self._late = whole - _PERIODS
        self._snapshots: list[Array] = []

    def followed(self, at: ArrayLike | None, seen: Seen | None) -> xr.Dataset:
        """Return the history on modes that are certified.

        Raises
        ------
        ComputationError
            If there are none.
        """
        first = self._full(None)
        asked = None if at is None else checked_times(at)
        for _ in range(_ROUNDS):
            reduced = reduced_in_time(self._lever, np.hstack(self._snapshots))
            train = Train(
                reduced,
                self._waveform,
                self._period,
                self._tolerance_K,
                asked,
                self._options.get("per_step", 1),
            )
            history = train.followed(self._end, self._options.get("progress"))
            late = train.begin(self._late)
            away = max(
                self._departure(first, train.begin(0)),
                self._departure(self._full(on_all_nodes(self._lever, late)), late),
            )
            if away < self._tolerance_K:
                break
        else:
            raise ComputationError(f"modes of the first periods are off by {away:.2g} K")
        if seen is not None:
            for t, state in train.states:
                seen(t, on_all_nodes(self._lever, state))
        note = (
            f"followed on {reduced.space.size} modes, within {away:.1g} K of the full lever as "
            f"compared from periods 1 and {self._late + 1} on"
        )
        if train.alike is not None:
            note += f"; from period {train.alike + 1} on all are alike"
        history.attrs["notes"] = "\n".join(filter(None, [history.attrs["notes"], note]))
        return history

    def _full(self, start: State | None) -> xr.Dataset:
        """Follow the full lever over some periods, and keep its states."""

        def seen(t: float, state: State) -> None:
            self._snapshots.append(state.x)

        return followed(
            self._lever,
            self._waveform,
            _PERIODS * self._period,
            start=start,
            tolerance_K=self._tolerance_K,
            per_step=_PER_STEP,
            seen=seen,
        )

    def _departure(self, full: xr.Dataset, start: State) -> float:
        """Estimate how far (K) the reduced lever departs from the full one in the long run."""
        other = followed(
            start.lever,
            self._waveform,
            _PERIODS * self._period,
            full.time.values,
            start=start,
            tolerance_K=self._tolerance_K,
        )
        away = np.abs(full.tip_K.values - other.tip_K.values)
        first = full.time.values <= self._period
        one, two = away[first], away[~first]
        # what is carried on to a later period decays, at a rate that the ends of two tell
        ratio = min(max(two[-1] / max(one[-1], 1e-12) - 1.0, 0.0), _LARGEST_RATIO)
        return float(max(one.max(), two.max()) + one[-1] * ratio / (1.0 - ratio))
