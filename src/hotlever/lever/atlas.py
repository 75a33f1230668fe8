"""Known branches of a reduced lever, from which those of any material are guessed.

At every node of the branches, the same for all, states and current are quadratic functions of the
parameters, fitted to known states and their exact derivatives. The conductivity scale c_κ of the
paper's silicon needs no fit in vacuum: scaling κ scales V² at the same temperatures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.box import Box
from hotlever.lever.equations import SHOWN
from hotlever.probe import Probe
from hotlever.types import Array


@dataclass(frozen=True)
class Atlas:
    """Quadratic functions of the parameters that give a branch at its nodes.

    Attributes
    ----------
    box : Box
        The parameters.
    u : ndarray, shape (k,)
        √(T_tip − T_base) (K^½) of the nodes, the first zero.
    surface : ndarray, shape (terms, k, size + 4)
        Coefficients, for the terms of `_terms`, of the states and of V_l (V), I_h (mA), V_r (V).
    grows : ndarray of bool, shape (size + 4,)
        What grows with the root of the box's scale: all but temperatures.
    scale : float or ndarray, shape ()
        Of all known branches, if the box has a scale; 1 without.
    """

    box: Box
    u: Array
    surface: Array
    grows: NDArray[np.bool_]
    scale: float | Array

    @classmethod
    def fitted(
        cls,
        box: Box,
        u: Array,
        probes: list[Probe],
        values: Array,
        slopes: Array,
        grows: NDArray[np.bool_],
    ) -> Atlas:
        """Fit the coefficients to known branches of m probes with the same scale.

        Of the values, (m, k, size + 4), the slopes are the derivatives by the parameters of the
        box, (m, k, size + 4, p).
        """
        terms, gradients = zip(*(_terms(box.place(probe)) for probe in probes), strict=True)
        matrix = np.concatenate([np.stack(terms), *(gradient.T for gradient in gradients)])
        units = np.stack([box.slopes(probe) for probe in probes])
        by_share = slopes * units[:, None, None, :]
        rows = np.concatenate([values, *np.moveaxis(by_share, 3, 1)])
        surface = np.linalg.lstsq(matrix, rows.reshape(len(rows), -1))[0]
        scale = _scale(box, probes[0])
        return cls(box, u, surface.reshape(-1, *values.shape[1:]), grows, scale)

    def states(self, probe: Probe) -> Array:
        """Return the states of a probe at the nodes, (size + 1, k), to some ten kelvin."""
        return self._at(probe)[:, : -len(SHOWN)].T

    def shown(self, probe: Probe) -> Array:
        """Return V_l (V), I_h (mA) and V_r (V) of a probe at the nodes, shape (k, 3)."""
        return self._at(probe)[:, -len(SHOWN) :]

    def _at(self, probe: Probe) -> Array:
        found = np.tensordot(_terms(self.box.place(probe))[0], self.surface, axes=1)
        found[:, self.grows] *= np.sqrt(_scale(self.box, probe) / self.scale)
        return np.asarray(found)


def _scale(box: Box, probe: Probe) -> float:
    return float(probe.values([box.scale])[0]) if box.scale else 1.0


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
