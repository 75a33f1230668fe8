"""The material laws of a lever at its quadrature points.

Films conduct beside each other: κ and σ of a region are the sums over its films of thickness times
conductivity. The laws are those of the materials (`hotlever.materials.kinds`). Parameters have the
names of probe files: ``n_d`` of the silicon of ``[material]``, ``film.tcr`` of a material ``film``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hotlever.errors import ComputationError
from hotlever.lever.films import PlacedFilm
from hotlever.lever.motion import Motion
from hotlever.lever.space import (
    PER_CM3_TO_NANO_PER_UM3,
    PER_CM_TO_MILLI_PER_UM,
    Space,
)
from hotlever.materials import Kind, full_name
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.doping import tapered_doping
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
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
    """The laws of all that lies at the quadrature points, by the temperature there.

    Parameters
    ----------
    space : Space
    materials : mapping of str to Kind
        What it is made of, by name.
    base_temperature_K : float
    motions : mapping of str to Motion
        Of the dimensions by which derivatives may be asked for.

    Raises
    ------
    ComputationError
        If a law makes no sense at the base temperature: a fit may have moved it there.

    Attributes
    ----------
    made_of : dict of str to Kind
        The materials of which there are films, by name.
    films : list of FilmLaws
    """

    def __init__(
        self,
        space: Space,
        materials: Mapping[str, Kind],
        base_temperature_K: float,
        motions: Mapping[str, Motion],
    ) -> None:
        self.space, self.base_temperature_K, self.motions = space, base_temperature_K, motions
        self.made_of = {film.material: materials[film.material] for film in space.films}
        for name, kind in self.made_of.items():
            if reason := kind.impossible(base_temperature_K):
                raise ComputationError(f"{name}: {reason}")
        self.films = [
            FilmLaws(film, materials, number, motions) for number, film in enumerate(space.films)
        ]

    @property
    def limit(self) -> tuple[float, str]:
        """Temperature (K) beyond which no state is meaningful, and what happens there."""
        return min((kind.highest_K, kind.end(name)) for name, kind in self.made_of.items())

    @property
    def steps_K(self) -> list[float]:
        """The temperatures (K) at which a law steps, each once."""
        laws = [law for kind in self.made_of.values() for law in kind.laws]
        return sorted({T for law in laws for T in law.steps})

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

    def enthalpy_by(self, T: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of the enthalpy by parameters, (points, n, k)."""
        changes = np.zeros((*T.shape, len(names)))
        for film in self.films:
            points, sheet = film.film.points, PER_CM3_TO_NANO_PER_UM3 * film.film.counted_um
            _, by = film.kind.enthalpy(T[points])
            for number, name in enumerate(names):
                if film.own.get(name) in by:
                    changes[points, :, number] += sheet * by[film.own[name]]
        return changes

    @cached_property
    def _cold_heat(self) -> Array:
        """The enthalpy at the base temperature (nJ/µm²), (points, 1)."""
        return self._enthalpy(np.full_like(self.space.weights, self.base_temperature_K))[0]
