"""An experiment in time: histories of a lever, corrected by the full one.

As at rest (`hotlever.estimation.experiment_at_rest`) the lever on a coarse mesh tells how its
history changes with the parameters; at the optimum the full one is followed, and the difference
added from then on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from hotlever.datasets import observables_of
from hotlever.errors import InputError
from hotlever.estimation.surrogate import LinearSurrogate
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.transient.history import integrate
from hotlever.lever.transient.sensitivities import derivable, with_sensitivities
from hotlever.lever.transient.waveform import Piece, Waveform
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.types import Array, Index

#: Times per decade since the last corner at which a lever is followed for very many rows.
_PER_DECADE = 12
#: Error of a step (K): some parts in a hundred thousand of the current.
_TOLERANCE_K = 0.05


class _Times:
    """Times (µs) at which a lever is followed, and what is seen at the rows of a measurement.

    Where rows are many they lie on a spline of third degree over the logarithm of the time since
    the last corner of the wave form, in which histories are smooth.
    """

    def __init__(self, waveform: Waveform, rows: Array) -> None:
        self._count = rows.size
        parts: list[tuple[Index, Array, float | None]] = []
        # where a lever is hottest, as a rule
        ends: list[float] = []
        for piece in waveform.pieces(float(rows[-1]) * (1.0 + 1e-9)):
            here = (rows > piece.start) | ((rows == 0.0) & (piece.start == 0.0))
            place = np.flatnonzero(here & (rows <= piece.end))
            ends.append(min(piece.end, float(rows[-1])))
            if place.size:
                parts.append((place, *_few(rows[place], piece)))
        self.at = np.unique(np.concatenate([ends, *(at for _, at, _ in parts)]))
        self._parts = [
            (place, np.searchsorted(self.at, at), None if start is None else (rows[place], start))
            for place, at, start in parts
        ]

    def at_rows(self, found: Array) -> Array:
        """Return what is seen at the rows, (3, n, ...), of that at the times, (3, m, ...)."""
        seen = np.empty((len(found), self._count, *found.shape[2:]))
        for place, node, between in self._parts:
            seen[:, place] = (
                found[:, node]
                if between is None
                else _smooth(self.at[node], found[:, node], *between)
            )
        return seen


def _few(rows: Array, piece: Piece) -> tuple[Array, float | None]:
    """Return times at which to follow within a piece, and its start if these are not all rows."""
    first = rows[rows > piece.start][:1]
    if not first.size or np.isfinite(piece.longest):
        return rows, None
    decades = np.log10((rows[-1] - piece.start) / (first[0] - piece.start))
    few = piece.start + np.geomspace(
        first[0] - piece.start, rows[-1] - piece.start, 4 + int(_PER_DECADE * decades)
    )
    if few.size >= rows.size or rows[0] == piece.start:
        return rows, None
    # without what the logarithm has rounded
    few[[0, -1]] = rows[[0, -1]]
    return few, piece.start


def _smooth(at: Array, found: Array, rows: Array, start: float) -> Array:
    along = np.log(rows - start)
    return np.asarray(make_interp_spline(np.log(at - start), found, 3, axis=1)(along))


@dataclass(frozen=True)
class PredictionInTime:
    """What an instrument and a thermometer would show in time.

    Attributes
    ----------
    probe : Probe
        That it is for.
    values : ndarray, shape (3, n)
        I_h (mA), V_r (V) and T_tip (K) at the rows.
    slopes : ndarray, shape (3, n, p)
        Their derivatives by the parameters.
    names : tuple of str
        The parameters.
    at : ndarray, shape (m,)
        Times (µs) at which the lever was followed.
    seen, seen_by : ndarray, shapes (3, m) and (3, m, p)
        The same there.
    uncorrected : ndarray, shape (3, m)
        What the coarse lever itself shows.
    """

    probe: Probe
    values: Array
    slopes: Array
    names: tuple[str, ...]
    at: Array
    seen: Array
    seen_by: Array
    uncorrected: Array

    def columns(self) -> dict[str, Array]:
        """Return what it shows, by the names that a history has, each (m,)."""
        current, reader, tip = self.seen
        return {"time_us": self.at, "current_mA": current, "reader_V": reader, "tip_K": tip}

    @property
    def surrogate(self) -> LinearSurrogate:
        """Predictions for similar probes."""
        return LinearSurrogate(self.probe.values(self.names), self.values, self.slopes)


@dataclass(frozen=True)
class ExperimentInTime:
    """Predicts histories of levers similar to one; see `hotlever.estimation.experiment`.

    Attributes
    ----------
    names : tuple of str
        Parameters; see `hotlever.lever.transient.sensitivities.with_sensitivities`.
    waveform : Waveform
    fast : SimilarLevers
        On a coarse mesh.
    full : SimilarLevers or None
        What it is corrected by; None where it is right as it is.
    times : _Times
        When it is followed, and how rows are read off that.
    offset : ndarray, shape (3, m), or float
        That correction.
    """

    names: tuple[str, ...]
    waveform: Waveform
    fast: SimilarLevers
    full: SimilarLevers | None
    times: _Times
    offset: Array | float = 0.0

    @classmethod
    def of(
        cls,
        probe: Probe,
        rows: Array,
        waveform: Waveform,
        names: Sequence[str],
        *,
        lever: Lever | None = None,
    ) -> ExperimentInTime:
        """Return the model of a probe at the times (µs) of some rows.

        A `lever` that is given is taken as it is; else a coarse one is corrected by the full one.
        """
        fast = SimilarLevers(Lever(probe, COARSE) if lever is None else lever)
        full = SimilarLevers(Lever(probe)) if lever is None else None
        return cls(tuple(names), waveform, fast, full, _Times(waveform, rows))

    def predict(self, probe: Probe, near: PredictionInTime | None = None) -> PredictionInTime:
        """Follow the lever of a probe, unless it was followed for the prediction nearby.

        Raises
        ------
        ComputationError
            If silicon melts, or a step fails.
        """
        if near is not None and near.probe == probe:
            seen, seen_by = near.uncorrected, near.seen_by
        else:
            found = with_sensitivities(
                self.fast.lever(probe),
                self.waveform,
                self.times.at,
                self.names,
                tolerance_K=_TOLERANCE_K,
            )
            seen = observables_of(found)
            seen_by = found.sensitivity.values
        right = seen + self.offset
        rows = self.times.at_rows(right), self.times.at_rows(seen_by)
        return PredictionInTime(probe, *rows, self.names, self.times.at, right, seen_by, seen)

    def confirmed(self, at: PredictionInTime) -> ExperimentInTime:
        """Return a model that is that of the full lever at the probe of a prediction.

        Raises
        ------
        ComputationError
            If the full lever cannot be followed.
        """
        if self.full is None:
            return self
        found = integrate(
            self.full.lever(at.probe), self.waveform, at=at.at, tolerance_K=_TOLERANCE_K
        )
        right = observables_of(found)
        return replace(self, offset=right - at.uncorrected)


def known_in_time(
    probe: Probe, measurement: Measurement, priors: Mapping[str, Prior], varied: Sequence[str]
) -> tuple[dict[str, Prior], list[str]]:
    """Return the priors of what a fit in time can vary, and a note on those of the probe file left.

    Raises
    ------
    InputError
        If there are no derivatives by what is varied otherwise, or the bias does not begin at 0.
    """
    before = 0.0 if measurement.waveform is None else measurement.waveform.before_V
    if before != 0.0:
        raise InputError(
            f"found a wave form that begins at {before:g} V, expected one of a lever that is cold"
        )
    stated = probe.stated_priors
    without = [name for name in varied if not derivable(probe, name)]
    # what a probe file says of a dimension is no request to vary it here
    held = [name for name in without if name in stated or "dimensions" in stated]
    for name in without:
        if name not in held:
            raise InputError(
                f"{name}: cannot be varied in time, for there are no derivatives by it; expected "
                "parameters of materials, series_resistance_ohm or gas_conductivity"
            )
    notes = [f"held, since there are no derivatives in time by them: {', '.join(held)}"]
    return {name: one for name, one in priors.items() if name not in held}, notes * bool(held)
