"""Temperature and potential made up for the real laws, with the sources that keep them."""

from __future__ import annotations

import numpy as np
from bare import bare_equations
from skfem import MeshTri

from hotlever.lever.equations import LeverEquations
from hotlever.materials import published
from hotlever.materials.heat import thermal_conductivity
from hotlever.materials.silicon import conductivity_low_doped, tapered_doping
from hotlever.probe import Taper, Terminal

LENGTH, WIDTH, BIAS, BASE = 2.0, 1.0, 1.5, 293.0
TAPER = Taper((1.0, 0.5), (1.0, 0.0), 2.0)
MATERIAL = published("option III").material


class Exact:
    """Temperature and potential that satisfy all boundary conditions, with derivatives."""

    def __init__(self, amplitude: float, bias: float = BIAS) -> None:
        self.amplitude, self.bias = amplitude, bias

    def temperature(self, x, y):
        a, kx, ky = self.amplitude, np.pi / LENGTH, np.pi / WIDTH
        s, c, b, d = np.sin(kx * x), np.cos(kx * x), 1 + 0.3 * np.cos(ky * y), np.sin(ky * y)
        value = BASE + a * s * b
        gradient = np.stack([a * kx * c * b, -0.3 * a * ky * s * d])
        laplacian = -a * kx**2 * s * b - 0.3 * a * ky**2 * s * np.cos(ky * y)
        return value, gradient, laplacian

    def potential(self, x, y):
        kx, ky = np.pi / LENGTH, np.pi / WIDTH
        wave, along = np.cos(ky * y), np.sin(kx * x)
        value = self.bias * x / LENGTH + 0.2 * along * wave
        gradient = np.stack(
            [
                self.bias / LENGTH + 0.2 * kx * np.cos(kx * x) * wave,
                -0.2 * ky * along * np.sin(ky * y),
            ]
        )
        return value, gradient, -0.2 * (kx**2 + ky**2) * along * wave

    def loads(self, x, y):
        """Heat and charge sources (W/cm³-like, per cm of the laws) in strong form."""
        T, grad_T, lap_T = self.temperature(x, y)
        _, grad_V, lap_V = self.potential(x, y)
        kappa, kappa_by = thermal_conductivity(T, MATERIAL.c_kappa)
        n, n_by = tapered_doping([2.0 - x, x], MATERIAL.n_d, MATERIAL.delta, n_hd=MATERIAL.n_hd)
        sigma, sigma_by = conductivity_low_doped(T, n, MATERIAL.p)
        grad_sigma = sigma_by["T"] * grad_T
        grad_sigma[0] += sigma_by["n"] * (n_by["distances"][1] - n_by["distances"][0])
        heat = (
            -kappa_by["T"] * (grad_T**2).sum(axis=0)
            - kappa * lap_T
            - sigma * (grad_V**2).sum(axis=0)
        )
        charge = -(grad_sigma * grad_V).sum(axis=0) - sigma * lap_V
        return heat, charge


def silicon_strip(element, count: int) -> LeverEquations:
    """Equations on a mesh of squares cut in two."""
    mesh = MeshTri.init_tensor(
        np.linspace(0, LENGTH, 2 * count + 1), np.linspace(0, WIDTH, count + 1)
    )
    return bare_equations(
        mesh,
        Terminal("supply", (LENGTH, 0.0), (LENGTH, WIDTH)),
        Terminal("ground", (0.0, 0.0), (0.0, WIDTH)),
        (1.0, 0.5),
        MATERIAL,
        taper=TAPER,
        element=element,
        quadrature=10,
    )


def source(space, load) -> np.ndarray:
    """A source per volume (units of the laws), tested with each node's function, (nodes,)."""
    sheet = 0.1 * space.thickness_um * space.weights[:, 0]
    return space.elements.sampling[: space.weights.size].T @ (sheet * load)


def nodal_state(space, exact: Exact) -> np.ndarray:
    """The state with the exact values at the nodes, (size + 1, 1)."""
    x, y = space.elements.nodes
    rise = exact.temperature(x, y)[0] - BASE
    return space.from_nodal(rise, exact.potential(x, y)[0], exact.bias)[:, None]
