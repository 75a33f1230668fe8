"""A reduced lever in time: modes of histories of the full one, and the same equations on them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from hotlever.lever.equations import LeverEquations
from hotlever.lever.laws_at_points import LawsAtPoints
from hotlever.lever.lever import State
from hotlever.lever.reduced_space import ReducedSpace, empirical_cubature
from hotlever.lever.space import Space
from hotlever.lever.transport import Motion, Properties
from hotlever.materials import Kind
from hotlever.probe.surroundings import Physics
from hotlever.types import Array
from hotlever.work import one_blas_thread

if TYPE_CHECKING:
    from hotlever.lever.lever import Lever


@one_blas_thread
def reduced_in_time(lever: Lever, snapshots: Array) -> Lever:
    """Return the lever on modes of its states in time.

    Parameters
    ----------
    lever : Lever
        The full one.
    snapshots : ndarray, shape (size + 1, n)
        States of it, some with power.

    Returns
    -------
    Lever
        Its space is a `hotlever.lever.reduced_space.ReducedSpace` on few points.
    """
    every = space_of_modes(lever, snapshots)
    weights = lever.space.weights[:, 0]
    points, few = empirical_cubature(_integrands(lever, every, snapshots), weights, 1e-5)
    other = copy(lever)
    space = every.at_points(points, few)
    other.space = cast("Any", space)
    other.equations = LeverEquations.of_probe(space, lever.probe, laws=TabulatedLaws)
    return other


def space_of_modes(lever: Lever, snapshots: Array, origin: Array | None = None) -> ReducedSpace:
    """Return the space of the modes of some states, at all points.

    Where an origin (size + 1, 1) is given, differences from it count as much as it does itself.
    """
    full, hot = lever.space, lever.space.is_temperature
    first, _ = lever.equations.cold()
    lift = np.where(hot[:, None], 0.0, first / first[-1])
    vectors = snapshots
    if origin is not None:
        own, away = (x - lift * x[-1:] for x in (origin, snapshots - origin))
        vectors = np.hstack([away, own])
        for rows in (hot, ~hot):
            size = max(float(np.linalg.norm(own[rows])), 1e-300)
            vectors[rows, -1] /= size
            vectors[rows, :-1] /= np.linalg.norm(away[rows], axis=0).max()
    # a lever that cools is hottest elsewhere
    hottest = np.where(hot[:-1, None], snapshots[:-1], 0.0)
    # so many places of each snapshot are looked at for the highest temperature
    hottest = np.unique(np.argsort(-hottest, axis=0)[:20])
    return ReducedSpace.of_snapshots(full, lift[:-1, 0], vectors, least=1e-5, hot=hottest)


def on_all_nodes(lever: Lever, state: State) -> State:
    """Return the state of a full lever that one of its reduced lever stands for."""
    space = cast("ReducedSpace", state.lever.space)
    in_air = state.unknowns[len(state.x) :]
    return State(lever, space.expanded(state.x), space.air.expanded(in_air))


class TabulatedLaws(LawsAtPoints):
    """The laws of each point, looked up by its temperature.

    In thousands of steps with one material the laws would take most of the time. Each piece is the
    parabola through its ends and its middle: within 1e-6, and 2e-4 at the step in the slope of κ.
    """

    def __init__(
        self,
        space: Space,
        materials: Mapping[str, Kind],
        base_temperature_K: float,
        physics: Physics,
        motions: Mapping[str, Motion],
    ) -> None:
        super().__init__(space, materials, base_temperature_K, physics, motions)
        self._looked_up: tuple[Array, Array, Array] | None = None
        # on pieces of so many kelvins from the coldest temperature (K) on
        self._piece, self._coldest = 2.0, 250.0
        T = np.arange(self._coldest, 1751.0, 0.5 * self._piece)
        T = np.broadcast_to(T, (space.weights.size, T.size))
        laws = super().properties(T, ())[0].named
        self._laws = tuple(laws)
        values = np.stack([*laws.values(), super().heat_density(T)[0]])
        low, middle, high = values[..., :-2:2], values[..., 1::2], values[..., 2::2]
        # Newton's method may stray beyond the pieces, where the outermost go on, straight
        for piece in (0, -1):
            middle[..., piece] = 0.5 * (low + high)[..., piece]
        table = low, 4.0 * middle - 3.0 * low - high, 2.0 * (low + high) - 4.0 * middle
        # looked up as rows by point and piece: powers, laws
        self._last = low.shape[-1] - 1
        rows = np.stack(table).transpose(2, 3, 0, 1)
        self._table = np.ascontiguousarray(rows).reshape(-1, 3, len(values))
        self._first = low.shape[-1] * np.arange(space.weights.size)[:, None]

    def _look_up(self, T: Array) -> tuple[Array, Array]:
        """Return the properties and the heat (laws, points, n), and their slopes."""
        if self._looked_up is None or self._looked_up[0] is not T:
            position = (T - self._coldest) * (1.0 / self._piece)
            piece = position.clip(0.0, self._last).astype(np.intp)
            off = position - piece
            rows = self._table.take(self._first + piece, axis=0)
            # arrays without gaps are twice as fast
            value, slope, curvature = rows.transpose(2, 3, 0, 1).copy()
            bent = off * curvature
            slope += bent
            value += off * slope
            slope += bent
            slope *= 1.0 / self._piece
            self._looked_up = T, value, slope
        return self._looked_up[1:]

    def properties(
        self, T: Array, names: Sequence[str] = ("T",)
    ) -> tuple[Properties, dict[str, Properties]]:
        """Return the properties; derivatives by parameters are not looked up.

        See `hotlever.lever.laws_at_points.LawsAtPoints.properties`.
        """
        if tuple(names) != ("T",):
            return super().properties(T, names)
        now, by_T = (
            Properties(**dict(zip(self._laws, rows, strict=False))) for rows in self._look_up(T)
        )
        return now, {"T": by_T}

    def heat_density(self, T: Array) -> tuple[Array, Array]:
        """See `hotlever.lever.laws_at_points.LawsAtPoints.heat_density`."""
        values, slopes = self._look_up(T)
        return values[-1], slopes[-1]


def _integrands(lever: Lever, space: ReducedSpace, x: Array) -> Iterator[Array]:
    """Give what the equations integrate at some states, each kind by its largest size."""
    full, equations = lever.space, lever.equations
    weights = space.weights[:, 0]
    T = space.temperature.matrix.reshape(space.temperature.kinds, weights.size, -1)
    V = space.potential.matrix.reshape(space.potential.kinds, weights.size, -1)
    fluxes = equations.fluxes(x)
    stored = equations.heat_density(x)[0]
    power = float(np.max(-fluxes.heat_source.T @ weights))
    heat, volt = float(np.max(stored.T @ weights)), float(np.abs(x[-1]).max())
    ends = full.end_test
    for state in range(x.shape[1]):
        source, flux = fluxes.heat_source[:, state], fluxes.heat[..., state]
        held = stored[:, state] / heat
        yield T[0].T * (source / power)
        yield np.einsum("dqm,dq->mq", T[1:], flux / power)
        yield T[0].T * held
        yield np.einsum("dqm,dq->mq", V, fluxes.charge[..., state] * (volt / power))
        # what the heat balance is told by
        at_ends = source * ends[0] + np.einsum("dq,dq->q", ends[1:], flux)
        yield np.stack([held, held * ends[0], at_ends / power])
