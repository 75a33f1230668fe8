"""Sheet conductivities of what lies on one another, at the quadrature points, and its heat.

Films conduct beside each other: κ and σ of a region are the sums over its films of thickness times
conductivity. The laws are those of the materials (`hotlever.materials.kinds`). Parameters have the
names of probe files: ``n_d`` of the silicon of ``[material]``, ``film.tcr`` of a material ``film``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hotlever.lever.motion import Motion
from hotlever.lever.space import (
    PER_CM3_TO_NANO_PER_UM3,
    PER_CM_TO_MILLI_PER_UM,
    PlacedFilm,
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
    place : int
        Which of the films of the space it is.
    motions : mapping of str to Motion
        Of the dimensions by which derivatives may be asked for.
    """

    def __init__(
        self,
        film: PlacedFilm,
        materials: Mapping[str, Kind],
        place: int,
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
                self._taper(film.dopant_from, materials, place, motions)

    def _taper(
        self,
        source: str,
        materials: Mapping[str, Kind],
        place: int,
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
            name: (by["distances"] * motion.distances[place]).sum(axis=0)
            for name, motion in motions.items()
        }

    def add_to(self, total: Conductivities, T: Array, names: Sequence[str]) -> None:
        """Add the film to sheet conductivities at temperatures (K), (points of the space, n)."""
        film, here = self.film, self.film.points
        sheet, T = PER_CM_TO_MILLI_PER_UM * film.counted_um, T[here]
        kappa, kappa_by = self.kind.thermal_conductivity(T, film.thickness_um)
        total.kappa[here] += sheet * kappa
        conducts = self.kind.conducts
        if conducts:
            sigma, sigma_by = self.kind.electrical_conductivity(T, self.doping)
            total.sigma[here] += sheet * sigma
        for name in names:
            own = self.own.get(name)
            if own in kappa_by:
                total.kappa_by[name][here] += sheet * kappa_by[own]
            if conducts and own in sigma_by:
                total.sigma_by[name][here] += sheet * sigma_by[own]
            if conducts and "n" in sigma_by and name in self.doping_by:
                total.sigma_by[name][here] += sheet * (sigma_by["n"] * self.doping_by[name])
            if name in self.thickening:
                more = PER_CM_TO_MILLI_PER_UM * self.thickening[name]
                by_thickness = film.thickness_um * kappa_by.get("thickness_um", 0.0)
                total.kappa_by[name][here] += more * (kappa + by_thickness)
                if conducts:
                    total.sigma_by[name][here] += more * sigma


class Stacks:
    """What lies at each point of a lever, and in what gas; see the module's text.

    Parameters
    ----------
    space : Space
    materials : mapping of str to Kind
        By name; at least those of the space's films.
    motions : mapping of str to Motion
    """

    def __init__(
        self, space: Space, materials: Mapping[str, Kind], motions: Mapping[str, Motion]
    ) -> None:
        self._plate_um, self._air, self._motions = space.plate_um, space.air, motions
        self._films = [
            FilmLaws(film, materials, place, motions) for place, film in enumerate(space.films)
        ]

    def conductivities(self, T: Array, names: Sequence[str]) -> Conductivities:
        """Evaluate κ and σ at temperatures (K), (points, n), with some of their derivatives."""
        total = Conductivities.zero(T.shape, names)
        for film in self._films:
            film.add_to(total, T, names)
        if self._air is not None:
            self._take_off_air(total, T, names)
        return total

    def heat(self, T: Array) -> tuple[Array, Array]:
        """Return the enthalpy (nJ/µm²) at temperatures (K), (points, n), and its slope by T."""
        held, by_T = np.zeros(T.shape), np.zeros(T.shape)
        for film in self._films:
            here, sheet = film.film.points, PER_CM3_TO_NANO_PER_UM3 * film.film.counted_um
            enthalpy, by = film.kind.enthalpy(T[here])
            held[here] += sheet * enthalpy
            by_T[here] += sheet * by["T"]
        return held, by_T

    def heat_by(self, T: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of the enthalpy by parameters, (points, n, k)."""
        changes = np.zeros((*T.shape, len(names)))
        for film in self._films:
            here, sheet = film.film.points, PER_CM3_TO_NANO_PER_UM3 * film.film.counted_um
            _, by = film.kind.enthalpy(T[here])
            for place, name in enumerate(names):
                if film.own.get(name) in by:
                    changes[here, :, place] += sheet * by[film.own[name]]
        return changes

    def _take_off_air(self, total: Conductivities, T: Array, names: Sequence[str]) -> None:
        """Take off what the air would conduct that fills the plate, see `LeverEquations`."""
        share = PER_CM_TO_MILLI_PER_UM * self._air.filling
        filling = share * self._air.gas_conductivity
        kappa, by = thermal_conductivity_of_air(T)
        total.kappa[:] -= filling * self._plate_um * kappa
        for name in names:
            if name == "T":
                total.kappa_by[name] -= filling * self._plate_um * by["T"]
            elif name == GAS:
                total.kappa_by[name] -= share * self._plate_um * kappa
            elif name in self._motions:
                thickening = self._motions[name].thickening_um
                total.kappa_by[name] -= filling * thickening * kappa
