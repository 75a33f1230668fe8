"""What the rim of a lever radiates, in its equations.

It is a loss at each point by the temperature there alone. What the faces of a flat lever radiate
is a law of the sheet, see `hotlever.lever.laws`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hotlever.lever.laws import BASE, names_in_laws
from hotlever.lever.motion import Motion
from hotlever.lever.rim import Rim
from hotlever.materials import Kind
from hotlever.materials.laws import Evaluated
from hotlever.types import Array
from hotlever.units import PER_CM2_TO_MILLI_PER_UM2


class RimRadiation:
    """What each point of a rim radiates, and what that does to the heat balance.

    Parameters
    ----------
    rim : Rim
    materials : mapping of str to Kind
    base_temperature_K : float
        Of the surroundings too.
    motions : mapping of str to Motion
        Of the dimensions by which derivatives may be asked for.
    """

    def __init__(
        self,
        rim: Rim,
        materials: Mapping[str, Kind],
        base_temperature_K: float,
        motions: Mapping[str, Motion],
    ) -> None:
        self._rim, self._base, self._motions = rim, base_temperature_K, motions
        self._films = [
            (film, kind, names_in_laws(film.material, kind))
            for film in rim.films
            for kind in [materials[film.material]]
        ]

    def heat(
        self, x: Array, end_rises: Mapping[str, float], names: Sequence[str] = ()
    ) -> Evaluated:
        """Return what states (size + 1, n) radiate at each point (mW), (points, n).

        With derivatives by ``T``, the temperature there, and by parameters or dimensions, the
        rises being the same. Some leg ends may be warmer than the base temperature.
        """
        rim = self._rim
        T = self._base + rim.rise(x)
        of_base = np.ones_like(T)
        # a rim that does not count has none
        for name in rim.end_tests.keys() & end_rises.keys():
            T += end_rises[name] * rim.end_tests[name][:, None]
            of_base -= rim.end_tests[name][:, None]
        by = {name: np.zeros_like(T) for name in ("T", *names)}
        heat = np.zeros_like(T)
        for number, (film, kind, own) in enumerate(self._films):
            points, unit = film.points, PER_CM2_TO_MILLI_PER_UM2 * rim.weights[film.points]
            value, by_own = kind.emission(T[points], self._base)
            heat[points] += unit * film.height_um * value
            for name, change in by.items():
                if own.get(name) in by_own:
                    change[points] += unit * film.height_um * by_own[own[name]]
                elif name in self._motions:
                    change[points] += unit * self._motions[name].rim[number] * value
        if BASE in by:
            by[BASE] += of_base * by["T"]
        return heat, by
