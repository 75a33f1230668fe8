"""The unknowns of a lever, and the linear maps from them to the quadrature points.

A state of a lever is a vector: the *free values* (rises of the temperature above the base
temperature, and potentials), and last the lever voltage V_l. Several states stand side by side,
one column each. A space knows where things are, not which laws hold there: the full lever, flat
or solid, and the reduced one differ in their maps and in how they put a Jacobian together, and in
nothing else.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.elements import FiniteElements, LinearMap
from hotlever.lever.layers_at_points import PlacedFilm, Rim
from hotlever.lever.transport import Fields, Fluxes, Tangent
from hotlever.types import Array, Index, Mask

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


class Factors(Protocol):
    """Factorised Jacobians of some states, the last row being that of the constraint."""

    def solve(self, right_hand_side: Array, states: Index, *, transposed: bool = False) -> Array:
        """Solve for right-hand sides (size + 1, n) or (size + 1, n, k) of these n states."""
        ...

    def replaced(self, states: Index, other: Any) -> Any:
        """Return the same factors, those of some states taken from others, in their order."""
        ...

    def followed_by(self, other: Any) -> Any:
        """Return the same, and those of other states after them."""
        ...

    def among(self, states: Mask | Index) -> Any:
        """Return those of some states, by a mask or in an order."""
        ...


@dataclass(frozen=True)
class SurfaceTangent:
    """How the heat that leaves at points of the surface changes with the temperatures.

    Attributes
    ----------
    kappa : ndarray, shape (sites, n)
        κ of the air at the sites (mW/(K µm)).
    taken_up : ndarray, shape (m, m), or None
        What the air takes up itself, see `hotlever.air.stores`; None at rest.
    at_points : dict of str to ndarray, shape (points, n)
        Slopes of what leaves at each point of ``rim`` or ``footprint`` (mW/K); those that count.
    left : float
        Share of a right-hand side that solves with the air may leave.
    """

    kappa: Array
    taken_up: Array | None
    at_points: Mapping[str, Array]
    left: float


@dataclass(frozen=True)
class Constraint:
    """The condition that selects a state: ``tip × rise of the tip + lever × V_l = value``.

    All states have the same one, or each has its own: numbers, or arrays of shape (n,).
    """

    tip: float | Array
    lever: float | Array

    def of(self, space: Space, x: Array) -> Array:
        """Return the left side for states or for changes of them, shape (n, ...)."""
        tip, lever = (
            np.reshape(factor, (-1, *(1,) * (x.ndim - 2))) for factor in (self.tip, self.lever)
        )
        return np.asarray(tip * space.tip_rise(x) + lever * x[-1])

    def among(self, states: Index | int) -> Constraint:
        """Return that of some of the states."""
        if np.ndim(self.tip) == 0:
            return self
        return Constraint(np.asarray(self.tip)[states], np.asarray(self.lever)[states])


#: A given tip temperature, which selects one state wherever there is power; and a given lever
#: voltage, which does so without.
TIP, LEVER = Constraint(1.0, 0.0), Constraint(0.0, 1.0)


class Space(ABC):
    """Unknowns and maps of a lever; see the module's text.

    Attributes
    ----------
    size : int
        Number of free values; a state has one more entry, V_l.
    temperature, potential : LinearMap
        The first gives values and slopes, the second slopes only.
    weights : ndarray, shape (points, 1)
    thickness_um : float or ndarray, shape (points, 1)
        Of all that lies on one another.
    plate_um : float or ndarray, shape (points, 1)
        Of the plate as the air sees it: that of the thickest stack.
    films : tuple of PlacedFilm
        What lies where.
    is_temperature : ndarray of bool, shape (size + 1,)
    tip : tuple of (ndarray of int, ndarray)
        Unknowns and weights that give the rise of the tip temperature.
    reader : tuple of (ndarray of int, ndarray), or None
        The same for the reader voltage V_r; None without a reader.
    held : dict of str to int
        The unknowns that are potentials of held terminals, see `hotlever.lever.equations`.
    chip : tuple of (ndarray of int, ndarray), or None
        Unknowns and weights that give the rise of leg ends on the chip; None if it stays cold.
    end_test : ndarray, shape (1 + dimension, points)
        Values and slopes of the function that is one at the leg ends.
    end_tests : dict of str to ndarray
        The same of each terminal by itself, where leg ends may differ.
    elements : FiniteElements
        Of the nodes; see `hotlever.lever.elements`.
    air : AirLoss or ReducedAir
        The air around the lever; see `hotlever.air.coupling`.
    """

    #: Whether its states are combinations of modes, which are good so far as they were made for.
    is_reduced: ClassVar[bool] = False

    size: int
    temperature: LinearMap
    potential: LinearMap
    weights: Array
    thickness_um: float | Array
    plate_um: float | Array
    films: tuple[PlacedFilm, ...]
    is_temperature: NDArray[np.bool_]
    tip: tuple[Index, Array]
    reader: tuple[Index, Array] | None
    held: Mapping[str, int]
    chip: tuple[Index, Array] | None
    end_test: Array
    end_tests: Mapping[str, Array]
    elements: FiniteElements
    air: Any

    @property
    @abstractmethod
    def full(self) -> Any:
        """That of the full lever."""

    @property
    @abstractmethod
    def rim(self) -> Rim:
        """The surface at which the mesh ends."""

    @property
    @abstractmethod
    def footprint(self) -> Rim:
        """Points of the circle on which the tip stands, whose weights are shares of its area."""

    def fields(self, x: Array) -> Fields:
        """Return the fields of states or of changes of them, (size + 1, n): T is the rise."""
        T = self.temperature.at_points(x)
        return Fields(T[0], T[1:], self.potential.at_points(x))

    def weak_form(self, fluxes: Fluxes) -> Array:
        """Return the weak equations of the free values and last the current I_h, (size + 1, n).

        The current (mA) is the consistent flux: the charge equation tested with the function that
        is one on the supply contact.
        """
        heat = self.weighted(np.concatenate([fluxes.heat_source[None], fluxes.heat]))
        charge = self.weighted(fluxes.charge)
        weak = np.zeros((self.size + 1, *heat.shape[2:]))
        weak[self.temperature.columns] += self.temperature.tested(heat)
        weak[self.potential.columns] += self.potential.tested(charge)
        return weak

    def weighted(self, samples: Array) -> Array:
        """Return samples (kinds, points, ...) times the quadrature weights."""
        weights = self.weights.reshape(-1, *(1,) * (samples.ndim - 2))
        return np.asarray(weights * samples)

    def tip_rise(self, x: Array) -> Array:
        """Return the rise of the tip temperature (K) of states or of changes of them."""
        return _combined(x, *self.tip)

    def reader_voltage(self, x: Array) -> Array:
        """Return V_r (V) of states or of changes of them; NaN without a reader."""
        if self.reader is None:
            return np.full(x.shape[1:], np.nan)
        return _combined(x, *self.reader)

    def expanded(self, x: Array) -> Array:
        """Return states of the full lever: those of modes in terms of its own unknowns."""
        return x

    @abstractmethod
    def combined(self, rises: csr_matrix, potentials: csr_matrix) -> Any:
        """Return the map from the unknowns to combinations of what is at the nodes.

        Parameters
        ----------
        rises, potentials : csr_matrix, shape (k, nodes)
            Weights of the rises (K) and of the potentials (V) of the full lever's nodes.

        Returns
        -------
        csr_matrix or ndarray, shape (k, size + 1)
        """

    @abstractmethod
    def rises(self, x: Array) -> Array:
        """Return rises of the temperature (K), the highest among them, (places, n), of states."""

    @abstractmethod
    def nodal_rises(self, x: Array, end_rises: Mapping[str, float] | None = None) -> Array:
        """Return the rises of the temperature (K) of states at all nodes, (nodes, n).

        Some leg ends may be warmer than the base temperature.
        """

    @abstractmethod
    def factorised(
        self, tangent: Tangent, surface: SurfaceTangent, constraint: Constraint, conductance: Array
    ) -> Factors:
        """Put the Jacobians of all states together, the constraint last, and factorise.

        Behind each held terminal is a conductance (mA/V), and last that of the chip (mW/K), if
        there is one.
        """


def _combined(x: Array, unknowns: Index, weights: Array) -> Array:
    return np.asarray(np.tensordot(weights, x[unknowns], axes=1))
