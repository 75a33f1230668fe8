"""Levers of similar probes: what solves them all, and one mesh that moves with their dimensions."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np
from scipy.optimize import linear_sum_assignment

from hotlever.air.coupling import AirLoss
from hotlever.lever.branch import Branch, Reach
from hotlever.lever.continuation import ContinuationOptions, continued
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.layers_at_points import PlacedFilm, thickness_at
from hotlever.lever.lever import Lever
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.observables import Linearised
from hotlever.lever.solved_states import solve_at
from hotlever.lever.transport import Motion
from hotlever.probe import Probe
from hotlever.probe.layout import BorderTaper, Layout, Taper
from hotlever.probe.moving import Movement, MovingMesh
from hotlever.probe.probe_parameters import dimensions_of, usual_parameters
from hotlever.types import Array, Index
from hotlever.work import one_blas_thread


class SimilarLevers:
    """A lever, and what it would be with other parameters.

    What is solved changes smoothly with the parameters, dimensions included, since the mesh stays
    the same but for being moved.

    Parameters
    ----------
    lever : Lever
        Flat, if dimensions are to change.
    """

    def __init__(self, lever: Lever) -> None:
        self._lever = lever
        self._moving = MovingMesh(lever.space.mesh, lever.probe)

    @property
    def drawn(self) -> Probe:
        """The probe whose drawing has the mesh."""
        return self._lever.probe

    def lever(self, probe: Probe) -> Lever:
        """Return the lever of a similar probe, on the same mesh moved."""
        return Lever(probe, space=self._space(probe))

    def equations(self, probe: Probe, names: tuple[str, ...] = ()) -> LeverEquations:
        """Return the equations of a probe, with the motions of the dimensions among some names."""
        space = self._space(probe)
        dimensions = [name for name in names if name in dimensions_of(probe)]
        motions = {
            name: motion_of(space, self._moving.movement(probe, name)) for name in dimensions
        }
        return LeverEquations.of_probe(space, probe, motions=motions)

    def for_any_parameters(self) -> Self:
        """Return what solves levers far away too, for which this may not be made."""
        return self

    def full_states(self, branch: Branch, equations: LeverEquations) -> tuple[Array, Array]:
        """Return u of states of a branch of this lever, (k,), and those of a finer mesh there.

        These, (size + 1, k), are as many as it takes to see by how much the branches differ.

        Raises
        ------
        NewtonError
            If a state was not found.
        """
        newton, places = ContinuationOptions().newton, branch.u[branch.solved]
        coarse = equations.space.full.prolonged(branch.equations.space, branch.x[:, branch.solved])
        # what a coarse mesh lacks changes smoothly along the branch, so that the last states tell
        # that of the next one; where they did, to 5e-5 of the lever voltage, a state is passed over
        done: list[int] = []
        lacking, foretold = np.zeros_like(coarse), False
        potentials, lines = ~equations.space.is_temperature, branch.parametrisation
        for k, place in enumerate(places):
            if foretold and k < places.size - 1:
                foretold = False
                continue
            one, behind = slice(k, k + 1), done[-3:]
            # of a parabola through three, or what fewer tell
            here = np.vander([place], len(behind)).T
            weights = np.linalg.solve(np.vander(places[behind]).T, here)
            guess = coarse[:, one] + lacking[:, behind] @ weights
            roots = solve_at(equations, places[one], guess, newton, parametrisation=lines)
            lacking[:, one] = roots.x - coarse[:, one]
            off = np.abs(roots.x - guess)[potentials].max()
            foretold = bool(off < 5e-5 * np.abs(roots.x[-1, 0]))
            done.append(k)
        return places[done], coarse[:, done] + lacking[:, done]

    def tip_error_K(self, probe: Probe, branch: Branch) -> float:
        """Return by how much tips on a branch of it may be off its equations' at a fixed bias.

        Its states are solved.
        """
        return 0.0

    def _space(self, probe: Probe) -> FullSpace:
        """Return mesh, operators and air of a similar probe."""
        space = self._lever.space
        if (probe.shape, probe.tip) != (self.drawn.shape, self.drawn.tip):
            space = space.moved(self._moving.mesh_of(probe))
        # air takes up from a place nearly what it took before the place moved a little
        return space.with_air(self._air(probe))

    def _air(self, probe: Probe) -> AirLoss:
        """Return the air around a similar probe."""
        air, around = self._lever.space.air, probe.surroundings
        if around.gas_conductivity != air.gas_conductivity:
            air = air.in_gas(around.gas_conductivity)
        if around.surface_gap_um != self.drawn.surroundings.surface_gap_um:
            air = air.in_gap(around.surface_gap_um)
        return air

    @one_blas_thread
    def linearised(
        self,
        probe: Probe,
        reach: Reach,
        near: Linearised | None = None,
        names: tuple[str, ...] | None = None,
    ) -> Linearised:
        """Solve the branch of a probe, with its derivatives.

        Parameters
        ----------
        probe : Probe
        reach : Reach
        near : Linearised, optional
            Of a similar probe on this mesh, to start from.
        names : tuple of str
            Parameters of the derivatives, see `hotlever.probe.probe_parameters`; by default what a
            fit usually varies.

        Raises
        ------
        ComputationError
            If a state was not found.
        """
        names = usual_parameters(probe) if names is None else names
        equations, factors = self.equations(probe, names), None
        if near is None:
            branch = continued(equations, reach)
        else:
            parametrisation, solved = near.branch.parametrisation, near.branch.solved
            u, guess = near.branch.u[solved], near.states(probe)[:, solved]
            newton = ContinuationOptions().newton
            # one Jacobian serves a last step and the slopes along the branch and by parameters; the
            # step squares what is left before it
            nearly = NewtonOptions(tolerance=float(np.sqrt(newton.tolerance)))
            roots = solve_at(equations, u, guess, nearly, near.factors, parametrisation)
            factors = equations.factorised(roots.x, parametrisation.constraint(u))
            roots = solve_at(equations, u, roots.x, newton, factors, parametrisation, fresh=True)
            branch = Branch.whole(equations, u, roots, parametrisation, fresh=True)
        return Linearised.of(probe, names, branch, reach, factors=factors)


def motion_of(space: FullSpace, movement: Movement) -> Motion:
    """Return what changes at the points of a flat lever as it moves with a dimension."""
    elements, mesh = space.elements, space.mesh
    corners = movement.velocity[:, mesh.elements.t]
    sides = corners[:, 1:] - corners[:, :1]
    # the velocity is linear in each triangle
    strain = np.einsum("irm,mra->iam", sides, elements.inverse)
    start = corners[:, 0, :, None]
    velocity = (start + np.einsum("irm,rq->imq", sides, elements.basis.X)).reshape(2, -1)
    strain = np.repeat(strain, elements.per_element, axis=2)

    layout = mesh.layout
    body = _thickening(layout, movement, elements.positions, velocity)
    region = np.repeat(mesh.region, elements.per_element)
    (element,), _, slopes = elements.at_points(np.array([layout.tip]))
    reference = elements.on_reference(np.array(layout.tip), element)
    at_tip = corners[:, 0, element] + sides[:, :, element] @ reference
    return Motion(
        strain,
        np.asarray(strain[0, 0] + strain[1, 1])[:, None],
        tuple(_of_film(film, movement, body, region) for film in space.films),
        body + movement.films,
        tuple(_from_borders(space, film, movement, velocity, region) for film in space.films),
        tip=(movement.tip - at_tip) @ slopes[:, 0],
        rim=_of_rim(space, movement),
    )


def _of_film(film: PlacedFilm, movement: Movement, body: Array, region: Index) -> Array:
    """Return how a film thickens at its points, (k, 1), from the rate of the body at all points."""
    if not film.level:
        return body[film.points]
    return movement.thickness_of_films(film.level)[region[film.points], None]


def _of_rim(space: FullSpace, movement: Movement) -> tuple[Array, ...]:
    """Return how surface at the points of a rim grows, over their weights (as its heights)."""
    longer, velocity = _along_rim(space, movement)
    points = space.rim.facet_points
    body = _thickening(space.mesh.layout, movement, points.positions, velocity)
    region = space.mesh.region[points.elements]
    return tuple(
        longer[film.points, None] * film.counted_um + _of_film(film, movement, body, region)
        for film in space.rim.films
    )


def _along_rim(space: FullSpace, movement: Movement) -> tuple[Array, Array]:
    """Return how edges of the rim grow, relative, and the velocity, at its points."""
    mesh, points = space.mesh.elements, space.rim.facet_points
    vertices = mesh.facets[:, points.facets]
    start, end = mesh.p[:, vertices].swapaxes(0, 1)
    start_velocity, end_velocity = movement.velocity[:, vertices].swapaxes(0, 1)
    side, stretch = end - start, end_velocity - start_velocity
    square = (side**2).sum(axis=0)
    share = ((points.positions - start) * side).sum(axis=0) / square
    return (side * stretch).sum(axis=0) / square, start_velocity + share * stretch


def _thickening(layout: Layout, movement: Movement, at: Array, velocity: Array) -> Array:
    """Return how the body thickens at points (2, points) that move, (points, 1)."""

    def thickness(way: float) -> float | Array:
        there = tuple((layout.tip + way * movement.tip).tolist())
        thick = layout.thickness_um + way * movement.thickness
        displaced_layout = replace(layout, tip=there, thickness_um=thick, cone=movement.cone(way))
        return thickness_at(displaced_layout, at + way * velocity)

    # a small change of a dimension (µm), by which the thickness of a cone is differenced
    small_um = 1e-4
    thicker = (thickness(small_um) - thickness(-small_um)) / (2 * small_um)
    return np.broadcast_to(thicker, (at.shape[1], 1))


def _from_borders(
    space: FullSpace, film: PlacedFilm, movement: Movement, velocity: Array, region: Index
) -> Array:
    """Return how the distances of a film's points from the borders of their regions change."""
    changes = np.zeros_like(film.distances)
    at, film_velocity = space.elements.positions[:, film.points], velocity[:, film.points]
    step = movement.step
    ends = ((movement.before, -step), (movement.after, step))
    for number in np.unique(region[film.points]) if film.distances.size else ():
        here = region[film.points] == number
        distances = film.distances[:, here, 0]
        low, high = (
            _as_ordered(
                layout.regions[number].taper, at[:, here] + way * film_velocity[:, here], distances
            )
            for layout, way in ends
        )
        changes[: len(low), here, 0] = movement.rate(low, high)
    return changes


def _as_ordered(taper: Taper | BorderTaper | None, points: Array, before: Array) -> Array:
    """Return the distances of points from borders, each border where it was before."""
    # a film with distances lies on tapered regions only
    assert taper is not None
    distances = taper.distances(points)
    apart = np.abs(before[:, None] - distances).sum(axis=2)
    return np.asarray(distances[linear_sum_assignment(apart)[1]])
