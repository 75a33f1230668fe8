"""The material laws of a lever at its quadrature points, and the heat that its states hold.

Films conduct beside each other: κ and σ of a region are the sums over its films of thickness times
conductivity. The laws are those of the materials (`hotlever.materials.kinds`). Parameters have the
names of probe files: ``n_d`` of the silicon of ``[material]``, ``film.tcr`` of a material ``film``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from hotlever.air.stores import HeatInAir
from hotlever.errors import ComputationError
from hotlever.lever.films import PlacedFilm
from hotlever.lever.motion import Motion
from hotlever.lever.space import (
    PER_CM3_TO_NANO_PER_UM3,
    PER_CM_TO_MILLI_PER_UM,
    Fields,
    Fluxes,
    Space,
)
from hotlever.lever.terminals import Terminals
from hotlever.materials import Kind, full_name
from hotlever.materials.air import kirchhoff_variable, thermal_conductivity_of_air
from hotlever.materials.doping import tapered_doping
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
from hotlever.probe.circuit import Circuit
from hotlever.types import Array

#: How many times as well as air the gas conducts, a parameter of no material.
GAS = "gas_conductivity"


@dataclass(frozen=True)
class Conductivities:
    """Sheet conductivities (thickness included) at the quadrature points, with derivatives.

    Attributes
    ----------
    kappa, sigma : ndarray, shape (points, n)
        mW/K and mA/V.
    kappa_by, sigma_by : dict of str to ndarray
        Derivatives by ``T``, or by the parameters and dimensions asked for.
    """

    kappa: Array
    sigma: Array
    kappa_by: dict[str, Array]
    sigma_by: dict[str, Array]

    @classmethod
    def zero(cls, shape: tuple[int, ...], names: Sequence[str]) -> Conductivities:
        """Return those of nothing."""
        return cls(
            np.zeros(shape),
            np.zeros(shape),
            {name: np.zeros(shape) for name in names},
            {name: np.zeros(shape) for name in names},
        )


class FilmLaws:
    """The laws of one film at its points.

    Parameters
    ----------
    film : PlacedFilm
    materials : mapping of str to Kind
    number : int
        Which of the films of the space it is.
    motions : mapping of str to Motion
        Of the dimensions by which derivatives may be asked for.
    """

    def __init__(
        self,
        film: PlacedFilm,
        materials: Mapping[str, Kind],
        number: int,
        motions: Mapping[str, Motion],
    ) -> None:
        self.film, self.kind = film, materials[film.material]
        # what the laws call a parameter, by its name in the probe
        self.own = {"T": "T"}
        self.own |= {full_name(film.material, own): own for own in self.kind.declared}
        self.thickening = {
            name: motion.thickening_um[film.points]
            for name, motion in motions.items()
            if film.is_body
        }
        self.doping: Array | float = 0.0
        self.doping_by: dict[str, Array | float] = {}
        if isinstance(self.kind, LowDopedSilicon):
            self.doping = self.kind.n_d
            self.doping_by[full_name(film.material, "n_d")] = 1.0
            if film.dopant_from is not None:
                self._taper(film.dopant_from, materials, number, motions)

    def _taper(
        self,
        source: str,
        materials: Mapping[str, Kind],
        number: int,
        motions: Mapping[str, Motion],
    ) -> None:
        """Find the doping that diffusion from another material leaves."""
        film, kind, beside = self.film, self.kind, materials[source]
        # a layout has no other tapers
        assert isinstance(kind, LowDopedSilicon)
        assert isinstance(beside, HighDopedSilicon)
        self.doping, by = tapered_doping(film.distances, kind.n_d, kind.delta, n_hd=beside.n_hd)
        owners = {"n_d": film.material, "delta": film.material, "n_hd": source}
        self.doping_by = {full_name(owner, own): by[own] for own, owner in owners.items()} | {
            name: (by["distances"] * motion.distances[number]).sum(axis=0)
            for name, motion in motions.items()
        }

    def add_to(self, total: Conductivities, T: Array, names: Sequence[str]) -> None:
        """Add the film to sheet conductivities at temperatures (K), (points of the space, n)."""
        film, points = self.film, self.film.points
        sheet, T = PER_CM_TO_MILLI_PER_UM * film.counted_um, T[points]
        thermal = self.kind.thermal_conductivity(T, film.thickness_um)
        electrical = self.kind.electrical_conductivity(T, self.doping)
        for (value, by), sum_of, sum_by in (
            (thermal, total.kappa, total.kappa_by),
            (electrical, total.sigma, total.sigma_by),
        ):
            sum_of[points] += sheet * value
            for name in names:
                own = self.own.get(name)
                if own in by:
                    sum_by[name][points] += sheet * by[own]
                if "n" in by and name in self.doping_by:
                    sum_by[name][points] += sheet * (by["n"] * self.doping_by[name])
                if name in self.thickening:
                    more = PER_CM_TO_MILLI_PER_UM * self.thickening[name]
                    by_thickness = film.thickness_um * by.get("thickness_um", 0.0)
                    sum_by[name][points] += more * (value + by_thickness)


class LawsAtPoints:
    """Fields, laws and heat of states of one lever of some materials.

    Parameters
    ----------
    space : Space
    materials : mapping of str to Kind
        What it is made of, by name.
    circuit : Circuit
        What is wired to the terminals, and how warm they are.
    motions : mapping of str to Motion, optional
        Of the dimensions by which derivatives may be asked for.

    Raises
    ------
    ComputationError
        If a law makes no sense at the base temperature: a fit may have moved it there.

    Attributes
    ----------
    terminals : Terminals
        What is wired to the lever, in its equations.
    films : list of FilmLaws
    scale, step_limit : ndarray, shape (size + 1, 1)
        For Newton's method: the size of one unit of each unknown, by which kelvin and volts
        compare, and the largest step.
    """

    def __init__(
        self,
        space: Space,
        materials: Mapping[str, Kind],
        circuit: Circuit,
        motions: Mapping[str, Motion] | None = None,
    ) -> None:
        self.space, self.materials, self.motions = space, materials, motions or {}
        self.circuit, self.base_temperature_K = circuit, circuit.base_temperature_K
        self.terminals = Terminals(space, circuit)
        for name, kind in self.made_of.items():
            if reason := kind.impossible(self.base_temperature_K):
                raise ComputationError(f"{name}: {reason}")
        self.films = [
            FilmLaws(film, materials, number, self.motions)
            for number, film in enumerate(space.films)
        ]
        self._latest: tuple[Array, tuple[Fields, Conductivities]] | None = None
        self.scale = np.where(space.is_temperature, 1.0, 0.01)[:, None]
        self.step_limit = np.where(space.is_temperature, 60.0, 5.0)[:, None]

    @property
    def made_of(self) -> dict[str, Kind]:
        """The materials of which there are films, by name."""
        return {film.material: self.materials[film.material] for film in self.space.films}

    @property
    def limit(self) -> tuple[float, str]:
        """Temperature (K) beyond which no state is meaningful, and what happens there."""
        return min((kind.highest_K, kind.end(name)) for name, kind in self.made_of.items())

    def conductivities(self, T: Array, names: Sequence[str] = ("T",)) -> Conductivities:
        """Evaluate κ and σ at temperatures (K), (points, n), with some of their derivatives."""
        total = Conductivities.zero(T.shape, names)
        for film in self.films:
            film.add_to(total, T, names)
        if self.space.air.filling:
            self._take_off_air(total, T, names)
        return total

    def _take_off_air(self, total: Conductivities, T: Array, names: Sequence[str]) -> None:
        """Take off what air that fills the plate would conduct; see `hotlever.lever.equations`."""
        share = PER_CM_TO_MILLI_PER_UM * self.space.air.filling
        filling = share * self.space.air.gas_conductivity
        kappa, by = thermal_conductivity_of_air(T)
        total.kappa[:] -= filling * self.space.plate_um * kappa
        for name in names:
            if name == "T":
                total.kappa_by[name] -= filling * self.space.plate_um * by["T"]
            elif name == GAS:
                total.kappa_by[name] -= share * self.space.plate_um * kappa
            elif name in self.motions:
                thickening = self.motions[name].thickening_um
                total.kappa_by[name] -= filling * thickening * kappa

    def at(self, x: Array) -> tuple[Fields, Conductivities]:
        """Return the fields of states (size + 1, n), and κ and σ, at the quadrature points."""
        # residual, Jacobian and derivatives are asked for at the same states one by one
        if self._latest is None or not np.array_equal(self._latest[0], x):
            moved = self.space.fields(x)
            T = self.base_temperature_K + moved.T
            T, grad_T = self.terminals.warmed(T, moved.grad_T)
            fields = Fields(T, grad_T, moved.grad_V)
            self._latest = x.copy(), (fields, self.conductivities(fields.T))
        return self._latest[1]

    def nodal_rises(self, x: Array) -> Array:
        """Return the rises of the temperature (K) of states at all nodes, (nodes, n)."""
        return self.space.nodal_rises(x, self.terminals.end_rises)

    def highest_rise(self, x: Array) -> Array:
        """Return the highest rise of the temperature (K) in states, between the nodes too, (n,)."""
        return self.space.elements.highest(self.nodal_rises(x))

    def driven(self, share: float) -> Self:
        """Return the same with held supplies and warmer leg ends at a share of their values."""
        return self._at(self.terminals.scaled(share, share))

    @property
    def mirrored(self) -> Self:
        """The same with held supplies of the other polarity."""
        return self._at(self.terminals.scaled(-1.0, 1.0))

    def _at(self, terminals: Terminals) -> Self:
        other = copy(self)
        other.terminals, other._latest = terminals, None
        return other

    def fluxes(self, x: Array) -> Fluxes:
        """Return what the weak equations test."""
        fields, laws = self.at(x)
        return Fluxes(
            -laws.sigma * square(fields.grad_V),
            laws.kappa * fields.grad_T,
            laws.sigma * fields.grad_V,
        )

    def kirchhoff(self, x: Array) -> tuple[Array, Array]:
        """Return θ (mW/µm) and κ (mW/(K µm)) of the gas at the sites of the air operator."""
        base = self.base_temperature_K
        rise = self.space.air.rise(x)
        if not rise.size:
            return rise, rise
        theta, by = kirchhoff_variable(base + rise, base)
        unit = PER_CM_TO_MILLI_PER_UM * self.space.air.gas_conductivity
        return unit * theta, unit * by["T"]

    def heat_density(self, T: Array) -> tuple[Array, Array]:
        """Return the heat above that at the base temperature (nJ/µm²), and its slope by T.

        Thickness included, at temperatures (K), (points, n).
        """
        held, by = self._enthalpy(T)
        return held - self._cold_heat, by

    def _enthalpy(self, T: Array) -> tuple[Array, Array]:
        """Return the enthalpy (nJ/µm²) at temperatures (K), (points, n), and its slope by T."""
        held, by_T = np.zeros(T.shape), np.zeros(T.shape)
        for film in self.films:
            points, sheet = film.film.points, PER_CM3_TO_NANO_PER_UM3 * film.film.counted_um
            enthalpy, by = film.kind.enthalpy(T[points])
            held[points] += sheet * enthalpy
            by_T[points] += sheet * by["T"]
        return held, by_T

    def _enthalpy_by(self, T: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of the enthalpy by parameters, (points, n, k)."""
        changes = np.zeros((*T.shape, len(names)))
        for film in self.films:
            points, sheet = film.film.points, PER_CM3_TO_NANO_PER_UM3 * film.film.counted_um
            _, by = film.kind.enthalpy(T[points])
            for number, name in enumerate(names):
                if film.own.get(name) in by:
                    changes[points, :, number] += sheet * by[film.own[name]]
        return changes

    @property
    def heat_in_air(self) -> HeatInAir:
        """Heat that the air takes up itself; nothing in vacuum, or where that is not known."""
        stores: HeatInAir = self.space.air.stores
        return stores

    @cached_property
    def _cold_heat(self) -> Array:
        """The enthalpy at the base temperature (nJ/µm²), (points, 1)."""
        return self._enthalpy(np.full_like(self.space.weights, self.base_temperature_K))[0]

    def storage(self, x: Array) -> Array:
        """Return the heat stored in states (nJ), tested as the balance is, (size + 1, n).

        In time the balance is what it loses per µs.
        """
        return self._only_heat(self.heat_density(self.at(x)[0].T)[0])

    def storage_change(self, x: Array, change: Array) -> Array:
        """Return how `storage` changes by one change of each state, or by several."""
        by_T = self.heat_density(self.at(x)[0].T)[1]
        rise = self.space.temperature.at_points(change)[0]
        heat = (by_T if change.ndim == 2 else by_T[..., None]) * rise
        return self._only_heat(heat)

    def storage_by_parameter(self, x: Array, names: Sequence[str]) -> Array:
        """Return how `storage` changes with parameters of materials, (size + 1, n, k)."""
        cold = np.full_like(self.space.weights, self.base_temperature_K)
        by = self._enthalpy_by(self.at(x)[0].T, names) - self._enthalpy_by(cold, names)
        return self._only_heat(by)

    def _only_heat(self, heat: Array) -> Array:
        """Test a heat by area alone."""
        tested = self.space.temperature.values_tested(self.space.weighted(heat[None])[0])
        weak = np.zeros((self.space.size + 1, *heat.shape[1:]))
        weak[self.space.temperature.columns] = tested
        return weak


def square(gradient: Array) -> Array:
    """Return the squared length of vectors (dimension, points, n)."""
    return np.einsum("dpn,dpn->pn", gradient, gradient)
