"""Derivatives by parameters of what a lever shows in time, exact for the steps that are taken.

Every stage of a step is differentiated as it stands, so that derivatives obey the same matrices:
with those of a stage factorised, each parameter costs a solution. Steps end where something is
reported, for between them cubics would have derivatives of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import HistoryEndError, InputError, unknown_name
from hotlever.lever.dataset import probe_attributes
from hotlever.lever.newton import refined
from hotlever.lever.observables import observed, observed_by
from hotlever.lever.transient.history import checked_times, time_steps
from hotlever.lever.transient.runge_kutta import ARK436L2SA, INSTANT_RATE, StageSolver, TimeStep
from hotlever.lever.transient.transient_problem import TransientProblem
from hotlever.lever.transient.waveform import Piece, Waveform
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import dimensions_of, parameters_of
from hotlever.quantities import OBSERVABLES
from hotlever.types import Array
from hotlever.work import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.lever import Lever


def derivable(probe: Probe, name: str) -> bool:
    """Whether there are derivatives in time by a parameter of a probe.

    Examples
    --------
    >>> from hotlever import Probe
    >>> derivable(Probe.reference(), "n_d"), derivable(Probe.reference(), "thickness_um")
    (True, False)
    """
    # these move all temperatures or an air operator, and dimensions a mesh
    return name not in ("base_temperature_K", "surface_gap_um") and name not in dimensions_of(probe)


@one_blas_thread
def with_sensitivities(
    lever: Lever,
    waveform: Waveform,
    at: ArrayLike,
    names: Sequence[str],
    *,
    tolerance_K: float = 0.1,
) -> xr.Dataset:
    """Follow a cold lever, with the derivatives of what it shows.

    Parameters
    ----------
    lever : Lever
    waveform : Waveform
    at : array_like
        Times (µs) to report.
    names : sequence of str
        Parameters: of materials, such as ``heat_capacity_scale``, ``series_resistance_ohm`` and
        ``gas_conductivity``.
    tolerance_K : float
        Largest error of a step (K).

    Returns
    -------
    xarray.Dataset
        ``bias_V`` and the observables that the probe has on the dimension ``time``; and
        ``sensitivity`` on (observable, time, parameter), NaN of observables that it has not.

    Raises
    ------
    InputError
        If a time is out of bounds, the wave form begins at a bias, something else than the swept
        supply heats the lever, or there are no derivatives by a parameter.
    HistoryEndError, ComputationError
        If silicon melts, or a step fails.
    """
    lever, times = lever.in_pulses(), checked_times(at)
    if waveform.before_V != 0.0:
        raise InputError(f"found a wave form that begins at {waveform.before_V:g} V, expected 0 V")
    # how the parameters move the state before it is left out
    lever.circuit.need_cold_start("a derivative in time")
    if not names:
        raise InputError("found no parameter, expected one by which there are derivatives")
    declared = parameters_of(lever.probe, anywhere=True)
    for name in names:
        if name not in declared:
            raise unknown_name("parameter", name, declared)
        if not derivable(lever.probe, name):
            raise InputError(
                f"no derivatives in time by {name} are known, expected parameters of materials, "
                "series_resistance_ohm or gas_conductivity"
            )
    rows, along, stops = [], _SensitivitiesAlong(lever, names), times.tolist()
    for piece, step in time_steps(lever, waveform, float(times[-1]), tolerance_K, stops=stops):
        first = along.time is None
        along.add(piece, step)
        if first and stops[0] == 0.0:
            rows.append((piece.bias(0.0), along.observables(step.x[:, :1]), along.slopes_at_start))
        limit_K, end = lever.equations.laws.limit
        x = step.x[:, 1:]
        if lever.circuit.base_temperature_K + along.hottest(x) > limit_K:
            raise HistoryEndError(f"{end} before {step.end:.6g} µs", step.start, None)
        if step.end in stops:
            rows.append((piece.bias(step.end), along.observables(x), along.slopes(x)))
    bias, observables, slopes = zip(*rows, strict=True)
    values = dict(zip(OBSERVABLES, np.array(observables).T, strict=True))
    table = np.array(slopes).transpose(1, 0, 2)
    return labelled(
        {
            "bias_V": list(bias),
            **{OBSERVABLES[name].name: values[name] for name in lever.probe.observables},
            "sensitivity": (("observable", "time", "parameter"), table),
        },
        "time",
        {"time": times, "observable": list(OBSERVABLES), "parameter": list(names)},
        **probe_attributes(lever.probe),
        waveform=waveform.text,
    )


class _SensitivitiesAlong:
    """Derivatives of the unknowns (rows, 1, k) that go along with the steps."""

    def __init__(self, lever: Lever, names: Sequence[str]) -> None:
        self._lever, self._names = lever, tuple(names)
        self._piece: Piece | None = None
        self.time: float | None = None
        self.slopes_at_start = np.empty((len(OBSERVABLES), len(self._names)))

    def add(self, piece: Piece, step: TimeStep) -> None:
        """Go on over the next step."""
        x = step.x[:, :1]
        problem = TransientProblem(self._lever.equations, self._lever.circuit, piece.bias)
        if piece is not self._piece:
            self._piece = piece
            if self.time is None:
                # cold, whatever the parameters are
                self._stored = np.zeros((*x.shape, len(self._names)))
            self._make_consistent(problem, x)
            if self.time is None:
                self.slopes_at_start = self.slopes(x)
        self._over(problem, step)
        self.time = step.end

    def _make_consistent(self, problem: TransientProblem, x: Array) -> None:
        """Fulfil the algebraic rows, nothing that is stored being changed."""
        stored, residual = problem.by_parameter(x, self._names)
        explicit = INSTANT_RATE * (self._stored - stored) - residual
        factors = problem.factorised(x, INSTANT_RATE)
        self._changes = self._solved(problem, x, explicit, INSTANT_RATE, factors)
        self._flow = -problem.change(x, self._changes, 0.0) - residual
        self._stored = problem.storage_change(x, self._changes) + stored

    def _over(self, problem: TransientProblem, step: TimeStep) -> None:
        """Differentiate each stage of a step."""
        length = step.end - step.start
        rate, flows = 1.0 / (ARK436L2SA.diagonal * length), [self._flow]
        begin, stored = self._stored, self._stored
        changes = self._changes
        for stage in range(1, len(ARK436L2SA.times)):
            x = step.stages[:, [stage]]
            explicit = begin + length * np.tensordot(
                ARK436L2SA.stages[stage, :stage], flows, axes=1
            )
            by_stored, by_rest = problem.by_parameter(x, self._names)
            right = rate * (explicit - by_stored) - by_rest
            changes = self._solved(problem, x, right, rate, step.factors)
            stored = problem.storage_change(x, changes) + by_stored
            flows.append(rate * (stored - explicit))
        self._changes, self._stored, self._flow = changes, stored, flows[-1]

    def _solved(
        self, problem: TransientProblem, x: Array, right: Array, rate: float, factors: StageSolver
    ) -> Array:
        """Solve with factors of a state nearby."""
        return refined(
            factors.solve,
            lambda changes: right - problem.change(x, changes, rate),
            right,
            problem.scale[..., None],
            1e-8,
        )

    # --- what is seen -----------------------------------------------------------------------------

    def hottest(self, x: Array) -> float:
        """Return the highest rise of the temperature (K)."""
        return float(self._lever.space.rises(x[: self._lever.space.size + 1]).max())

    def observables(self, x: Array) -> Array:
        """Return the observables, (observables,)."""
        return observed(self._lever.circuit, self._of_lever(x))[:, 0]

    def _of_lever(self, x: Array) -> Array:
        """Return V_l, I_h, V_r and the rise of the tip, (4, 1)."""
        own = x[: self._lever.space.size + 1]
        rise = self._lever.space.tip_rise(own)
        return np.concatenate([self._lever.equations.observed(own), rise[None]])

    def slopes(self, x: Array) -> Array:
        """Return their derivatives by the parameters, (observables, k)."""
        size, equations = self._lever.space.size + 1, self._lever.equations
        own, own_changes = x[:size], self._changes[:size]
        change = equations.observed_change(own, own_changes)
        change[1] += equations.by_parameter(own, self._names)[-1]
        change = np.concatenate([change, self._lever.space.tip_rise(own_changes)[None]])
        return observed_by(self._lever.circuit, self._of_lever(x), change, self._names)[:, 0]
