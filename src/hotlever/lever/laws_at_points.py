"""The material laws of a lever at its quadrature points.

Films conduct beside each other: κ and σ of a region are the sums over its films of thickness times
conductivity. The laws are those of the materials (`hotlever.materials.kinds`). Parameters have the
names of probe files: ``n_d`` of the silicon of ``[material]``, ``film.tcr`` of a material ``film``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from hotlever.errors import ComputationError
from hotlever.lever.layers_at_points import PlacedFilm, Rim
from hotlever.lever.space import Space
from hotlever.lever.transport import Motion, Properties
from hotlever.materials import Kind, full_name
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.departures import PROFILE, SmoothFactor, departure_of
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
from hotlever.materials.laws import Evaluated
from hotlever.materials.silicon import Carrier, tapered_doping
from hotlever.probe.surroundings import Physics
from hotlever.types import Array
from hotlever.units import (
    PER_CM2_TO_MILLI_PER_UM2,
    PER_CM3_TO_NANO_PER_UM3,
    PER_CM_TO_MILLI_PER_UM,
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
    carrier : str
        Of high-doped silicon.
    """

    def __init__(
        self,
        film: PlacedFilm,
        materials: Mapping[str, Kind],
        number: int,
        motions: Mapping[str, Motion],
        carrier: Carrier,
    ) -> None:
        self.film, self.kind, self.carrier = film, materials[film.material], carrier
        self.own = names_in_laws(film.material, self.kind)
        self.factors = {
            name: (departing[0], departing[1])
            for name, own in self.own.items()
            if (departing := departure_of(own)) and isinstance(departing[0], SmoothFactor)
        }
        self.thickening = {
            name: motion.thickening_um[number]
            for name, motion in motions.items()
            if motion.thickening_um[number].any()
        }
        self.doping: Array | float = 0.0
        self.doping_by: dict[str, Array | float] = {}
        if not isinstance(self.kind, LowDopedSilicon):
            return
        self.doping = self.kind.n_d
        self.doping_by[full_name(film.material, "n_d")] = 1.0
        if (source := film.dopant_from) is None:
            return
        # what diffusion from another material leaves; a layout has no other tapers
        n_d, delta, beside = self.kind.n_d, self.kind.delta, materials[source]
        assert isinstance(beside, HighDopedSilicon)
        self.doping, by = tapered_doping(
            film.distances, n_d, delta, n_hd=beside.n_hd, front=self.kind.front
        )
        [coefficient] = PROFILE.names
        by[coefficient] = PROFILE.spread_hot * by["front"]
        owners = dict.fromkeys(("n_d", "delta", coefficient), film.material) | {"n_hd": source}
        self.doping_by = {full_name(owner, own): by[own] for own, owner in owners.items()} | {
            name: (by["distances"] * motion.distances[number]).sum(axis=0)
            for name, motion in motions.items()
        }

    def add_to(
        self, total: Properties, by: Mapping[str, Properties], T: Array, surroundings_K: float
    ) -> None:
        """Add the film to properties at temperatures (K), (points of the space, n).

        And to their derivatives, by parameter.
        """
        film, kind, T = self.film, self.kind, T[self.film.points]
        modes = {
            name: (factor.law, factor.modes(T)[number])
            for name, (factor, number) in self.factors.items()
            if name in by
        }
        sheet = PER_CM_TO_MILLI_PER_UM * film.counted_um
        self._add("kappa", kind.thermal_conductivity(T, film.thickness_um), sheet, total, by, modes)
        self._add("sigma", kind.electrical_conductivity(T, self.doping), sheet, total, by, modes)
        if total.beta is not None:
            (beta, gamma), by_own = kind.thermoelectric(T, self.doping, self.carrier)
            for row, (name, value) in enumerate((("beta", beta), ("gamma", gamma))):
                rows = {own: change[row] for own, change in by_own.items()}
                self._add(name, (value, rows), sheet, total, by, modes)
        if total.emission is not None:
            faces = PER_CM2_TO_MILLI_PER_UM2 * film.faces
            emission = kind.emission(T, surroundings_K)
            self._add("emission", emission, faces, total, by, modes, thickens=False)

    def _add(
        self,
        law: str,
        evaluated: Evaluated,
        sheet: float | Array,
        total: Properties,
        by: Mapping[str, Properties],
        modes: Mapping[str, tuple[str, Array]],
        *,
        thickens: bool = True,
    ) -> None:
        """Add a law to the sheet's, and its derivatives to theirs.

        The modes at the temperatures are those of the coefficients asked for, and the law departs.
        """
        film, points, (value, by_own) = self.film, self.film.points, evaluated
        getattr(total, law)[points] += sheet * value
        for name, changes in by.items():
            change, own = getattr(changes, law), self.own.get(name)
            if own in by_own:
                change[points] += sheet * by_own[own]
            if "n" in by_own and name in self.doping_by:
                change[points] += sheet * (by_own["n"] * self.doping_by[name])
            if name in modes and modes[name][0] in by_own:
                departing, mode = modes[name]
                change[points] += sheet * (by_own[departing] * mode)
            if thickens and name in self.thickening:
                more = PER_CM_TO_MILLI_PER_UM * self.thickening[name]
                by_thickness = film.thickness_um * by_own.get("thickness_um", 0.0)
                change[points] += more * (value + by_thickness)


def names_in_laws(material: str, kind: Kind) -> dict[str, str]:
    """Return what the laws of a material call each parameter, by its name in the probe."""
    own = {full_name(material, name): name for name in kind.parameters}
    return {"T": "T", "base_temperature_K": "surroundings_K"} | own


def carriers_of(film: PlacedFilm, space: Space, materials: Mapping[str, Kind]) -> Carrier:
    """Return the carriers of high-doped silicon: those of the low-doped silicon it dopes.

    Or of any other that the lever has; electrons without any.
    """
    doped = [other for other in space.films if other.dopant_from == film.material]
    kinds = (materials[other.material] for other in (*doped, *space.films))
    return next((kind.carrier for kind in kinds if isinstance(kind, LowDopedSilicon)), "electron")


class LawsAtPoints:
    """The laws of all that lies at the quadrature points, by the temperature there.

    Parameters
    ----------
    space : Space
    materials : mapping of str to Kind
        What it is made of, by name.
    base_temperature_K : float
    physics : Physics
        The effects that count.
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
        physics: Physics,
        motions: Mapping[str, Motion],
    ) -> None:
        self.space, self.base_temperature_K, self.motions = space, base_temperature_K, motions
        self.physics = physics
        self.made_of = {film.material: materials[film.material] for film in space.films}
        for name, kind in self.made_of.items():
            if reason := kind.impossible(base_temperature_K):
                raise ComputationError(f"{name}: {reason}")
        self.films = [
            FilmLaws(film, materials, number, motions, carriers_of(film, space, materials))
            for number, film in enumerate(space.films)
        ]

    def radiated(
        self, rim: Rim, x: Array, end_rises: Mapping[str, float], names: Sequence[str] = ()
    ) -> Evaluated:
        """Return what states (size + 1, n) radiate at each point of a rim (mW), (points, n).

        With derivatives by ``T``, the temperature there, and by parameters or dimensions, the
        rises being the same. Some leg ends may be warmer than the base temperature. What the faces
        of a flat lever radiate is among the `properties` of the sheet.
        """
        T = self.base_temperature_K + rim.rise(x)
        of_base = np.ones_like(T)
        # a rim that does not count has none
        for name in rim.end_tests.keys() & end_rises.keys():
            T += end_rises[name] * rim.end_tests[name][:, None]
            of_base -= rim.end_tests[name][:, None]
        heat, by = np.zeros_like(T), {name: np.zeros_like(T) for name in ("T", *names)}
        for number, film in enumerate(rim.films):
            kind, points = self.made_of[film.material], film.points
            own, unit = names_in_laws(film.material, kind), PER_CM2_TO_MILLI_PER_UM2 * rim.weights
            value, by_own = kind.emission(T[points], self.base_temperature_K)
            heat[points] += unit[points] * film.counted_um * value
            for name, change in by.items():
                if own.get(name) in by_own:
                    change[points] += unit[points] * film.counted_um * by_own[own[name]]
                elif name in self.motions:
                    change[points] += unit[points] * self.motions[name].rim[number] * value
        if "base_temperature_K" in by:
            by["base_temperature_K"] += of_base * by["T"]
        return heat, by

    @property
    def limit(self) -> tuple[float, str]:
        """Temperature (K) beyond which no state is meaningful, and what happens there."""
        return min((kind.highest_K, kind.end(name)) for name, kind in self.made_of.items())

    @property
    def steps_K(self) -> list[float]:
        """The temperatures (K) at which a law steps, each once."""
        laws = [law for kind in self.made_of.values() for law in kind.laws]
        return sorted({T for law in laws for T in law.steps})

    def properties(
        self, T: Array, names: Sequence[str] = ("T",)
    ) -> tuple[Properties, dict[str, Properties]]:
        """Evaluate the laws at temperatures (K), (points, n), and some of their derivatives."""
        total = Properties.zero(T.shape, self.physics)
        by = {name: Properties.zero(T.shape, self.physics) for name in names}
        for film in self.films:
            film.add_to(total, by, T, self.base_temperature_K)
        if self.space.air.filling:
            self._take_off_air(total.kappa, by, T)
        return total, by

    def _take_off_air(self, total: Array, by: Mapping[str, Properties], T: Array) -> None:
        """Take off what air that fills the plate would conduct; see `hotlever.lever.equations`."""
        air = self.space.air
        share = PER_CM_TO_MILLI_PER_UM * air.filling
        filling = share * air.gas_conductivity
        kappa, kappa_by = thermal_conductivity_of_air(T)
        total -= filling * self.space.plate_um * kappa
        for name, changes in by.items():
            change = changes.kappa
            if name == "T":
                change -= filling * self.space.plate_um * kappa_by["T"]
            elif name == "gas_conductivity":
                change -= share * self.space.plate_um * kappa
            elif name == "surface_gap_um":
                share_more = PER_CM_TO_MILLI_PER_UM * air.operator.filling_by_gap
                change -= share_more * air.gas_conductivity * self.space.plate_um * kappa
            elif name in self.motions:
                change -= filling * self.motions[name].plate_um * kappa

    def heat_density(self, T: Array) -> tuple[Array, Array]:
        """Return the heat above that at the base temperature (nJ/µm²), and its slope by T.

        Thickness included, at temperatures (K), (points, n).
        """
        held, by = self.enthalpy(T)
        return held - self._cold_heat, by["T"]

    def enthalpy(self, T: Array, names: Sequence[str] = ("T",)) -> Evaluated:
        """Return the enthalpy (nJ/µm²) at temperatures (K), (points, n), and its derivatives."""
        held, by = np.zeros(T.shape), {name: np.zeros(T.shape) for name in names}
        for laws in self.films:
            points, sheet = laws.film.points, PER_CM3_TO_NANO_PER_UM3 * laws.film.counted_um
            enthalpy, by_own = laws.kind.enthalpy(T[points])
            held[points] += sheet * enthalpy
            for name, change in by.items():
                if laws.own.get(name) in by_own:
                    change[points] += sheet * by_own[laws.own[name]]
        return held, by

    @cached_property
    def _cold_heat(self) -> Array:
        """The enthalpy at the base temperature (nJ/µm²), (points, 1)."""
        return self.enthalpy(np.full_like(self.space.weights, self.base_temperature_K))[0]
