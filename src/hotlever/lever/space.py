"""The unknowns of a lever: which nodal values are free, and how they couple.

The unknowns are the temperature and the potential at the nodes, without those held at the
base temperature or at ground; the nodes of the supply contact share one more unknown, the
lever voltage V_l. This module knows where things are, not which laws hold there.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu
from skfem import Mesh

from hotlever.air.operator import AirOperator
from hotlever.lever.air_loss import AirLoss, SurfaceOperator
from hotlever.lever.operators import FiniteElements, sums_by_index
from hotlever.probe.layout import Layout, Part

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class MeshedLever(Protocol):
    """What the unknowns need of a mesh, in two or three dimensions; see `ProbeMesh`."""

    @property
    def layout(self) -> Layout:
        """Regions, terminals and tip."""
        ...

    @property
    def elements(self) -> Mesh:
        """Triangles or tetrahedra."""
        ...

    @property
    def region(self) -> Index:
        """Index into the layout's regions of each element."""
        ...

    @property
    def terminal_facets(self) -> Mapping[str, Index]:
        """Facets of the elements on each terminal."""
        ...


@dataclass(frozen=True)
class Tapered:
    """Elements of one low-doped region, and their quadrature points along its axis.

    Attributes
    ----------
    elements : ndarray of int, shape (k,)
    along : ndarray, shape (k, points)
        Position along the current from the region's centre (µm).
    length_um : float
    """

    elements: Index
    along: Array
    length_um: float


@dataclass(frozen=True)
class Fields:
    """Temperature and potential at the quadrature points.

    Attributes
    ----------
    T : ndarray, shape (elements, points)
        K.
    grad_T, grad_V : ndarray, shape (dimension, elements, points)
        K/µm and V/µm.
    """

    T: Array
    grad_T: Array
    grad_V: Array


@dataclass(frozen=True)
class Tangent:
    """Coefficients of the linearised equations at the quadrature points.

    The names say test function, then trial function: ``heat_V`` is how the heat equation
    changes with the potential. Heat: ∫ φ a ψ + ∇φ·b ψ + κ ∇φ·∇ψ for a temperature ψ and
    ∫ φ c·∇ψ for a potential ψ; charge: ∫ ∇φ·d ψ for a temperature and σ ∇φ·∇ψ for a potential.
    """

    heat_source_T: Array
    heat_flux_T: Array
    kappa: Array
    heat_source_V: Array
    charge_flux_T: Array
    sigma: Array


class LeverSpace:
    """Unknowns, operators and matrix structure of one meshed layout.

    Parameters
    ----------
    mesh : MeshedLever
        Of triangles in the lever's plane, or of tetrahedra.
    operators : FiniteElements, optional
        Made on ``mesh.elements`` by default.
    air : AirOperator, optional
        The air around the lever; vacuum by default.

    Attributes
    ----------
    size : int
        Number of free nodal values. Vectors of unknowns have this many entries and then V_l.
    air : AirLoss or None
    tip : tuple of (ndarray of int, ndarray)
        Unknowns and weights that give the tip temperature.
    """

    def __init__(
        self,
        mesh: MeshedLever,
        operators: FiniteElements | None = None,
        air: AirOperator | None = None,
    ) -> None:
        self.mesh = mesh
        self.operators = operators or FiniteElements(mesh.elements)
        terminal_nodes = {
            name: self.operators.facet_nodes(facets)
            for name, facets in mesh.terminal_facets.items()
        }
        self._ends = np.unique(np.concatenate(list(terminal_nodes.values())))
        self._ground, self._supply = terminal_nodes["ground"], terminal_nodes["supply"]
        self._reader = terminal_nodes.get("reader")
        self._number_unknowns()
        self._lay_out_matrix()
        nodes, weights = self._tip_weights()
        self.tip = (self._T[nodes], weights)
        self.tapered = self._tapered_regions()
        self._part_elements = {
            part: np.flatnonzero(
                np.isin(
                    mesh.region, [i for i, r in enumerate(mesh.layout.regions) if r.part == part]
                )
            )
            for part in ("heater", "leg 1", "leg 2", "reader branch")
        }
        self.air = None if air is None else self._air_loss(air)

    def in_air(self, air: AirOperator | None) -> LeverSpace:
        """Return the same space with this air around it, or in vacuum; everything is shared."""
        space = copy(self)
        space.air = None if air is None else space._air_loss(air)
        return space

    def in_air_at_nodes(self, air: SurfaceOperator, surface: Index) -> LeverSpace:
        """Return the same space in air whose sites are these nodes; everything is shared."""
        # any element around a node knows where its diagonal entry is
        count, nodes = self.operators.dofs.shape
        _, first = np.unique(self.operators.dofs, return_index=True)
        element, place = np.divmod(first[surface], nodes)
        slots = self._element_slots.reshape(count, 2 * nodes, 2 * nodes)
        space = copy(self)
        space.air = AirLoss(
            air,
            self._T[surface, None],
            np.ones((surface.size, 1)),
            slots[element, place, place][:, None, None],
            self.size + 2,
        )
        return space

    def _air_loss(self, operator: AirOperator) -> AirLoss:
        elements, shares = self.operators.at_points(operator.sites)
        nodes = self.operators.dofs.shape[1]
        slots = self._element_slots.reshape(len(self._unknowns), 2 * nodes, 2 * nodes)
        return AirLoss(
            operator,
            self._T[self.operators.dofs[elements]],
            shares,
            slots[elements, :nodes, :nodes],
            self.size + 2,
        )

    def _number_unknowns(self) -> None:
        """Give every nodal value its unknown; eliminated ones get -1, the supply V_l."""
        count = self.operators.size
        fixed_T = np.zeros(count, dtype=bool)
        fixed_T[self._ends] = True
        fixed_V = np.zeros(count, dtype=bool)
        fixed_V[self._ground] = True
        fixed_V[self._supply] = True
        free = np.column_stack([~fixed_T, ~fixed_V]).ravel()
        number = np.full(free.size, -1, dtype=np.intp)
        self.size = int(free.sum())
        number[free] = np.arange(self.size)
        self._T, self._V = number[0::2].copy(), number[1::2].copy()
        self._V[self._supply] = self.size

    def _element_unknowns(self) -> Index:
        dofs = self.operators.dofs
        return np.concatenate([self._T[dofs], self._V[dofs]], axis=1)

    def _lay_out_matrix(self) -> None:
        """Find the structure of the Jacobian and an ordering with little fill.

        The matrix has two rows and columns beyond the free values: V_l with the circuit
        equation, and the bias V_b with the condition that pins a state on the branch.
        """
        nodes, _ = self._tip_weights()
        lever, bias = self.size, self.size + 1
        unknowns = self._element_unknowns()
        width = unknowns.shape[1]
        rows = np.repeat(unknowns, width, axis=1).ravel()
        columns = np.tile(unknowns, (1, width)).ravel()
        kept = (rows >= 0) & (columns >= 0)
        tip = self._T[nodes]
        extra = [(lever, lever), (lever, bias), (bias, bias), *((bias, int(k)) for k in tip)]
        all_rows = np.concatenate([rows[kept], [row for row, _ in extra]])
        all_columns = np.concatenate([columns[kept], [column for _, column in extra]])

        order = _fill_reducing_order(all_rows, all_columns, self.size + 2)
        position = np.empty_like(order)
        position[order] = np.arange(order.size)
        self._T = np.where(self._T >= 0, position[self._T], -1)
        self._V = np.where(self._V >= 0, position[self._V], -1)
        self._unknowns = self._element_unknowns()

        shape = (self.size + 2, self.size + 2)
        keys = position[all_columns] * shape[0] + position[all_rows]
        unique, slots = np.unique(keys, return_inverse=True)
        self._matrix_rows = (unique % shape[0]).astype(np.int32)
        self._matrix_starts = np.searchsorted(unique // shape[0], np.arange(shape[0] + 1)).astype(
            np.int32
        )
        self._entries = unique.size
        element_slots = np.full(rows.size, self._entries)  # one past the end: dropped
        element_slots[kept] = slots[: kept.sum()]
        self._element_slots = element_slots
        special = slots[kept.sum() :]
        self._circuit_slots = special[:2]  # (V_l, V_l) and (V_l, V_b)
        self._pin_slots = special[2:]  # (V_b, V_b), then the tip's unknowns
        self._lever_row = np.flatnonzero(self._matrix_rows == lever)
        self._lever_columns = np.repeat(np.arange(shape[0]), np.diff(self._matrix_starts))[
            self._lever_row
        ]

    def _tip_weights(self) -> tuple[Index, Array]:
        """Nodes and weights of the point of the tip, in the middle of the silicon's thickness."""
        point = np.zeros(len(self.operators.positions))
        point[:2] = self.mesh.layout.tip
        return self.operators.point_weights(tuple(point))

    def _tapered_regions(self) -> list[Tapered]:
        found = []
        for index, region in enumerate(self.mesh.layout.regions):
            if region.taper is not None:
                elements = np.flatnonzero(self.mesh.region == index)
                offset = self.operators.positions[:2, elements] - np.reshape(
                    region.taper.centre, (2, 1, 1)
                )
                along = np.tensordot(region.taper.axis, offset, axes=1)
                found.append(Tapered(elements, along, region.taper.length_um))
        return found

    @property
    def thickness_um(self) -> float | Array:
        """Thickness of the silicon (µm); where there is a cone, at the quadrature points.

        One if the elements are solid and have their thickness themselves.
        """
        layout = self.mesh.layout
        if len(self.operators.positions) == 3:
            return 1.0
        if layout.cone is None:
            return layout.thickness_um
        distance = np.linalg.norm(
            self.operators.positions - np.reshape(layout.tip, (2, 1, 1)), axis=0
        )
        return layout.thickness_um + layout.cone.thickening_um(distance)

    @property
    def temperature_unknowns(self) -> Index:
        """Unknown of each node's temperature; -1 where it is held."""
        return self._T

    # --- unknowns to fields -------------------------------------------------------------

    def nodal(self, x: Array, base_temperature_K: float) -> tuple[Array, Array]:
        """Return temperature (K) and potential (V) at all nodes, each of shape (nodes,).

        Parameters
        ----------
        x : ndarray
            Free values, then V_l; anything further is ignored.
        base_temperature_K : float
        """
        T = np.where(self._T >= 0, x[self._T], base_temperature_K)
        V = np.where(self._V >= 0, x[self._V], 0.0)
        return T, V

    def fields(self, x: Array, base_temperature_K: float) -> Fields:
        """Return temperature and gradients at the quadrature points."""
        nodal_T, nodal_V = self.nodal(x, base_temperature_K)
        T, grad_T = self.operators.evaluate(nodal_T)
        _, grad_V = self.operators.evaluate(nodal_V)
        return Fields(T, grad_T, grad_V)

    def start(self, base_temperature_K: float) -> Array:
        """Return the exact state without bias: base temperature, no potential (V_l and V_b 0)."""
        x = np.zeros(self.size + 2)
        x[self._T[self._T >= 0]] = base_temperature_K
        return x

    def tip_temperature(self, x: Array) -> float:
        """Return T_tip (K)."""
        unknowns, weights = self.tip
        return float(weights @ x[unknowns])

    def highest_temperature(self, x: Array) -> float:
        """Return the highest nodal temperature (K) of the free nodes."""
        return float(x[self._T[self._T >= 0]].max())

    def is_temperature(self) -> NDArray[np.bool_]:
        """Return which of the unknowns (V_l and V_b included) are temperatures."""
        mask = np.zeros(self.size + 2, dtype=bool)
        mask[self._T[self._T >= 0]] = True
        return mask

    # --- quadrature points to equations ---------------------------------------------------

    def weak_form(
        self, heat_source: Array | float, heat_flux: Array | float, charge_flux: Array
    ) -> Array:
        """Return the weak equations of the free values, and last the current I_h into V_l.

        The current is the consistent flux (mA): the weak form tested with the function that
        is one on the supply contact.
        """
        heat = self.operators.weak_form(heat_source, heat_flux)
        charge = self.operators.weak_form(0.0, charge_flux)
        # eliminated values (-1) are counted in the first place and dropped
        weak = np.concatenate([heat, charge], axis=1)
        sums = sums_by_index(self._unknowns + 1, weak, self.size + 2)
        return sums[1:]

    def end_fluxes(
        self, heat_source: Array, heat_flux: Array, charge_flux: Array
    ) -> tuple[float, float]:
        """Return the heat (mW) that leaves by the leg ends and the current (mA) to ground.

        Both are consistent fluxes: reactions of the weak form at the held nodes.
        """
        heat = self.operators.gather(self.operators.weak_form(heat_source, heat_flux))
        charge = self.operators.gather(self.operators.weak_form(0.0, charge_flux))
        return -float(heat[self._ends].sum()), -float(charge[self._ground].sum())

    def reader_weights(self) -> tuple[Index, Array] | None:
        """Return unknowns and weights that give the reader voltage V_r; None without reader."""
        if self._reader is None:
            return None
        unknowns = self._V[self._reader]
        return unknowns, np.full(unknowns.size, 1.0 / unknowns.size)

    def integral(self, density: Array, part: Part) -> float:
        """Return the integral of a density (elements, points) over the regions of one part."""
        elements = self._part_elements[part]
        return float(np.sum(density[elements] * self.operators.weights[elements]))

    def jacobian(self, tangent: Tangent) -> SparseJacobian:
        """Assemble the linearised equations."""
        heat_T = self.operators.matrix(
            value_value=tangent.heat_source_T,
            gradient_value=tangent.heat_flux_T,
            gradient_gradient=tangent.kappa,
        )
        heat_V = self.operators.matrix(value_gradient=tangent.heat_source_V)
        charge_T = self.operators.matrix(gradient_value=tangent.charge_flux_T)
        charge_V = self.operators.matrix(gradient_gradient=tangent.sigma)
        element = np.concatenate(
            [
                np.concatenate([heat_T, heat_V], axis=2),
                np.concatenate([charge_T, charge_V], axis=2),
            ],
            axis=1,
        )
        data = sums_by_index(self._element_slots, element, self._entries + 1)
        return SparseJacobian(self, data[: self._entries])


class SparseJacobian:
    """The linearised equations of a lever before circuit and pin are added.

    Attributes
    ----------
    current_gradient : tuple of (ndarray of int, ndarray)
        Unknowns on which the current I_h depends, and its derivatives.
    entries : int
        Of the sparse structure, see `plus`.
    """

    def __init__(self, space: LeverSpace, data: Array) -> None:
        self._space, self._data = space, data
        self.entries = data.size
        self.current_gradient = (space._lever_columns, data[space._lever_row])

    def plus(self, data: Array) -> SparseJacobian:
        """Return the sum with other entries of the same structure."""
        return SparseJacobian(self._space, self._data + data)

    def factorised(self, series_resistance_kohm: float, pin_bias: float, pin_tip: float) -> SuperLU:
        """Complete and factorise; the unknowns are already ordered for little fill."""
        return factorised(self.completed(series_resistance_kohm, pin_bias, pin_tip))

    def completed(
        self, series_resistance_kohm: float, pin_bias: float, pin_tip: float
    ) -> csc_matrix:
        """Return the square matrix with the circuit equation and the pin.

        The last two rows become V_l + R_s I_h - V_b and pin_bias V_b + pin_tip T_tip.
        """
        space, data = self._space, self._data.copy()
        data[space._lever_row] *= series_resistance_kohm
        data[space._circuit_slots] += (1.0, -1.0)
        data[space._pin_slots] = np.concatenate([[pin_bias], pin_tip * space.tip[1]])
        size = space.size + 2
        return csc_matrix((data, space._matrix_rows, space._matrix_starts), shape=(size, size))


def factorised(matrix: csc_matrix) -> SuperLU:
    """Factorise a matrix whose unknowns are already ordered for little fill."""
    return splu(
        matrix,
        permc_spec="NATURAL",
        diag_pivot_thresh=0.01,
        options={"SymmetricMode": True},
    )


def _fill_reducing_order(rows: Index, columns: Index, size: int) -> Index:
    """Order unknowns for little fill; the last two stay last.

    SuperLU's minimum degree ordering of the pattern, found once so that each factorisation
    can take the natural order.
    """
    inner = (rows < size - 2) & (columns < size - 2)
    pattern = csc_matrix(
        (np.ones(inner.sum()), (rows[inner], columns[inner])), shape=(size - 2, size - 2)
    )
    pattern.data[:] = 1.0
    pattern.setdiag(size)
    order = np.argsort(splu(pattern, permc_spec="MMD_AT_PLUS_A").perm_c)
    return np.concatenate([order, [size - 2, size - 1]])
