"""An experiment in time: histories of a lever, corrected by the full one.

As at rest (`hotlever.estimate.experiment`) the lever on a coarse mesh tells how its
history changes with the parameters; at the optimum the full one is followed, and the difference
added from then on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from hotlever.errors import InputError
from hotlever.estimate.experiment import TIP, Prediction, named
from hotlever.estimate.surrogate import ContactTemperatures, LinearSurrogate
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.transient.history import integrate
from hotlever.lever.transient.sensitivities import derivable, with_sensitivities
from hotlever.lever.transient.waveform import Piece, Waveform
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.quantities import observables_of
from hotlever.types import Array, Index


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
            indices = np.flatnonzero(here & (rows <= piece.end))
            ends.append(min(piece.end, float(rows[-1])))
            if indices.size:
                parts.append((indices, *_few(rows[indices], piece)))
        self.at = np.unique(np.concatenate([ends, *(at for _, at, _ in parts)]))
        self._parts = [
            (indices, np.searchsorted(self.at, at), rows[indices], start)
            for indices, at, start in parts
        ]

    def at_rows(self, values: Array) -> Array:
        """Return what is seen at the rows, (k, n, ...), of that at the times, (k, m, ...)."""
        at_rows = np.empty((len(values), self._count, *values.shape[2:]))
        for indices, nodes, rows, start in self._parts:
            part = values[:, nodes]
            if start is not None:
                after = np.log(self.at[nodes] - start)
                # what a lever does not show is NaN, and stays alone so
                spline = make_interp_spline(after, part, 3, axis=1, check_finite=False)
                part = spline(np.log(rows - start))
            at_rows[:, indices] = part
        return at_rows


def _few(rows: Array, piece: Piece) -> tuple[Array, float | None]:
    """Return times at which to follow within a piece, and its start if these are not all rows."""
    first = rows[rows > piece.start][:1]
    if not first.size or np.isfinite(piece.longest):
        return rows, None
    decades = np.log10((rows[-1] - piece.start) / (first[0] - piece.start))
    few = piece.start + np.geomspace(
        first[0] - piece.start, rows[-1] - piece.start, 4 + int(12 * decades)
    )
    if few.size >= rows.size or rows[0] == piece.start:
        return rows, None
    # without what the logarithm has rounded
    few[[0, -1]] = rows[[0, -1]]
    return few, piece.start


@dataclass(frozen=True)
class PredictionInTime(Prediction):
    """What an instrument and a thermometer would show in time.

    Attributes
    ----------
    coarse : ndarray, shape (observables, m)
        What the coarse lever itself shows at the times at which it was followed.
    coarse_slopes : ndarray, shape (observables, m, k)
    """

    coarse: Array
    coarse_slopes: Array


@dataclass(frozen=True)
class ExperimentInTime:
    """Predicts histories of levers similar to one; see `hotlever.estimate.experiment`.

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
    offset : ndarray, shape (observables, m), or float
        That correction.
    tolerance_K : float
        Of a step: some parts in a hundred thousand of the current.
    """

    names: tuple[str, ...]
    waveform: Waveform
    fast: SimilarLevers
    full: SimilarLevers | None
    times: _Times
    offset: Array | float = 0.0
    tolerance_K: float = 0.05

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
            coarse, coarse_slopes = near.coarse, near.coarse_slopes
        else:
            history = with_sensitivities(
                self.fast.lever(probe),
                self.waveform,
                self.times.at,
                self.names,
                tolerance_K=self.tolerance_K,
            )
            coarse, coarse_slopes = observables_of(history), history.sensitivity.values
        corrected = coarse + self.offset
        columns = {
            "time_us": self.times.at,
            "bias_V": self.waveform.bias(self.times.at),
            **named(corrected),
        }
        parameters = probe.values(self.names)
        values, slopes = ContactTemperatures(probe, self.names).differentiated(
            self.times.at_rows(corrected), self.times.at_rows(coarse_slopes), parameters
        )
        surrogate = LinearSurrogate(parameters, values, slopes)
        tip_slopes = coarse_slopes[TIP]
        return PredictionInTime(
            probe, values, slopes, surrogate, columns, tip_slopes, coarse, coarse_slopes
        )

    def confirmed(self, at: PredictionInTime) -> ExperimentInTime:
        """Return a model that is that of the full lever at the probe of a prediction.

        Raises
        ------
        ComputationError
            If the full lever cannot be followed.
        """
        if self.full is None:
            return self
        lever = self.full.lever(at.probe).in_pulses()
        history = integrate(lever, self.waveform, at=self.times.at, tolerance_K=self.tolerance_K)
        return replace(self, offset=observables_of(history) - at.coarse)


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
    return {name: prior for name, prior in priors.items() if name not in held}, notes * bool(held)
