"""Known branches of a reduced lever, from which those of any material are guessed.

At every node of the branches, the same for all, states and current are quadratic functions of the
parameters, fitted to known states and their exact derivatives. The conductivity scale c_κ needs no
fit in vacuum: scaling κ scales V² at the same temperatures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.equations import SHOWN
from hotlever.materials import Material
from hotlever.types import Array

#: Parameter ranges that reduced levers are made for. n_d is spread evenly in its logarithm.
BOX: dict[str, tuple[float, float]] = {
    "delta": (0.5, 0.9),
    "n_d": (2.0e17, 9.0e17),
    "p": (2.35, 3.0),
    "a0": (7.5e-4, 1.15e-3),
    "a1": (0.85e-6, 1.5e-6),
}


def material_in_box(material: Material, shares: Array) -> Material:
    """Return the material at a point of the box given by numbers between 0 and 1."""
    values = {}
    for share, (name, (low, high)) in zip(shares, BOX.items(), strict=True):
        even = low * (high / low) ** share if name == "n_d" else low + share * (high - low)
        values[name] = float(even)
    return material.with_(**values)


def place_in_box(material: Material) -> Array:
    """Invert `material_in_box`, beyond the box too."""
    shares = []
    for name, (low, high) in BOX.items():
        value = getattr(material, name)
        if name == "n_d":
            value, low, high = np.log([value, low, high])
        shares.append((value - low) / (high - low))
    return np.array(shares)


def box_slopes(material: Material) -> Array:
    """Return how far each parameter moves per unit of its share of the box, (5,)."""
    return np.array(
        [
            getattr(material, name) * np.log(high / low) if name == "n_d" else high - low
            for name, (low, high) in BOX.items()
        ]
    )


@dataclass(frozen=True)
class Atlas:
    """Quadratic functions of the parameters that give a branch at its nodes.

    Attributes
    ----------
    u : ndarray, shape (k,)
        √(T_tip − T_base) (K^½) of the nodes, the first zero.
    surface : ndarray, shape (terms, k, size + 4)
        Coefficients, for the terms of `_terms`, of the states and of V_l (V), I_h (mA), V_r (V).
    grows : ndarray of bool, shape (size + 4,)
        What grows with √c_κ: all but temperatures.
    c_kappa : float or ndarray, shape ()
        Of all known branches.
    """

    u: Array
    surface: Array
    grows: NDArray[np.bool_]
    c_kappa: float | Array

    @classmethod
    def fitted(
        cls,
        u: Array,
        materials: list[Material],
        values: Array,
        slopes: Array,
        grows: NDArray[np.bool_],
    ) -> Atlas:
        """Fit the coefficients to known branches of m materials with the same c_κ.

        Of the values, (m, k, size + 4), the slopes are the derivatives by the parameters of the
        box, (m, k, size + 4, 5).
        """
        places = [place_in_box(material) for material in materials]
        terms, gradients = zip(*(_terms(place) for place in places), strict=True)
        matrix = np.concatenate([np.stack(terms), *(gradient.T for gradient in gradients)])
        units = np.stack([box_slopes(material) for material in materials])
        by_share = slopes * units[:, None, None, :]
        rows = np.concatenate([values, *np.moveaxis(by_share, 3, 1)])
        surface = np.linalg.lstsq(matrix, rows.reshape(len(rows), -1))[0]
        return cls(u, surface.reshape(-1, *values.shape[1:]), grows, materials[0].c_kappa)

    def states(self, material: Material) -> Array:
        """Return the states of a material at the nodes, (size + 1, k), to some ten kelvin."""
        return self._at(material)[:, : -len(SHOWN)].T

    def shown(self, material: Material) -> Array:
        """Return V_l (V), I_h (mA) and V_r (V) of a material at the nodes, shape (k, 3)."""
        return self._at(material)[:, -len(SHOWN) :]

    def _at(self, material: Material) -> Array:
        found = np.tensordot(_terms(place_in_box(material))[0], self.surface, axes=1)
        found[:, self.grows] *= np.sqrt(material.c_kappa / self.c_kappa)
        return np.asarray(found)


def _terms(place: Array) -> tuple[Array, Array]:
    """Return the terms of a quadratic function, (terms,), and their gradients, (terms, p)."""
    count = len(place)
    first, second = np.triu_indices(count)
    unit = np.eye(count)
    gradient = place[first, None] * unit[second] + place[second, None] * unit[first]
    return (
        np.concatenate([[1.0], place, place[first] * place[second]]),
        np.concatenate([np.zeros((1, count)), unit, gradient]),
    )
