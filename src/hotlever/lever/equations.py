"""The coupled electro-thermal equations of a lever in its circuit.

Heat (paper's first equation, with the sign corrected) and charge:

    −∇·(κ ∇T) = σ |∇V|²,    ∇·(σ ∇V) = 0,

with T = base temperature at all terminals, V = 0 at ground, V = V_l on the supply contact,
no current into the reader, and V_l + R_s I_h = V_b. A state is the vector of the free nodal
values, then V_l, then V_b; one more condition, the *pin*, selects a state on the branch: a
given bias, or a point along the arc. Units are µm, V, mA, mW and K.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from hotlever.lever.newton import LinearSolve
from hotlever.lever.space import Fields, LeverSpace, SparseJacobian, Tangent, factorised
from hotlever.materials import PARAMETERS, Material
from hotlever.materials.doping import tapered_doping
from hotlever.materials.silicon import (
    conductivity_high_doped,
    conductivity_low_doped,
    thermal_conductivity,
)
from hotlever.probe.layout import Part
from hotlever.probe.probe import Circuit

Array = NDArray[np.float64]

#: S/cm to mA/(V µm), and W/(cm K) to mW/(K µm).
PER_CM_TO_MILLI_PER_UM = 0.1

#: The laws that the equations use.
LAWS = (thermal_conductivity, conductivity_low_doped, conductivity_high_doped)

#: What a fit compares, by the name users give it.
OBSERVABLES = ("current", "reader", "tip")


@dataclass(frozen=True)
class Conductivities:
    """Sheet conductivities (thickness included) at the quadrature points, with derivatives.

    Attributes
    ----------
    kappa, sigma : ndarray, shape (elements, points)
        mW/K and mA/V.
    kappa_by, sigma_by : dict of str to ndarray
        Derivatives by ``T`` and by fit parameter.
    """

    kappa: Array
    sigma: Array
    kappa_by: dict[str, Array]
    sigma_by: dict[str, Array]


class Pin(NamedTuple):
    """The condition ``bias V_b + tip T_tip = value`` that selects a state on the branch."""

    bias: float
    tip: float


class LeverEquations:
    """Residual, Jacobian and observables of one lever with one material in one circuit.

    Parameters
    ----------
    space : LeverSpace
    circuit : Circuit
    material : Material
    """

    def __init__(self, space: LeverSpace, circuit: Circuit, material: Material) -> None:
        self.space, self.circuit, self.material = space, circuit, material
        self._sheet = PER_CM_TO_MILLI_PER_UM * space.mesh.layout.thickness_um
        self._doping = [
            tapered_doping(
                region.along,
                material.n_d,
                material.delta,
                length=region.length_um,
                n_hd=material.n_hd,
            )
            for region in space.tapered
        ]
        temperature = space.is_temperature()
        self.scale = np.where(temperature, 1.0, 0.01)
        self.step_limit = np.where(temperature, 60.0, 5.0)

    # --- the laws at the quadrature points --------------------------------------------------

    def conductivities(self, T: Array) -> Conductivities:
        """Evaluate κ and σ with their derivatives.

        Parameters
        ----------
        T : ndarray, shape (elements, points)
            Temperature (K).
        """
        material, sheet = self.material, self._sheet
        kappa, kappa_by = thermal_conductivity(T, material.c_kappa)
        sigma, sigma_by = conductivity_high_doped(T, material.a0, material.a1)
        sigma_by |= {name: np.zeros_like(sigma) for name in ("n_d", "delta", "p")}
        for region, (n, n_by) in zip(self.space.tapered, self._doping, strict=True):
            here = region.elements
            value, by = conductivity_low_doped(T[here], n, material.p)
            sigma[here] = value
            sigma_by["T"][here] = by["T"]
            sigma_by["p"][here] = by["p"]
            for name in ("n_d", "delta"):
                sigma_by[name][here] = by["n"] * n_by[name]
            for name in ("a0", "a1"):
                sigma_by[name][here] = 0.0
        return Conductivities(
            sheet * kappa,
            sheet * sigma,
            {name: sheet * values for name, values in kappa_by.items()},
            {name: sheet * values for name, values in sigma_by.items()},
        )

    def per_cm(self, sheet_conductivity: Array) -> Array:
        """Return a conductivity in S/cm or W/(cm K) of a sheet conductivity in mA/V or mW/K."""
        return sheet_conductivity / self._sheet

    def at(self, x: Array) -> tuple[Fields, Conductivities]:
        """Return the fields of a state, and κ and σ, at the quadrature points."""
        fields = self.space.fields(x, self.circuit.base_temperature_K)
        return fields, self.conductivities(fields.T)

    # --- Newton's method and continuation ----------------------------------------------------

    def pinned(self, pin: Pin, value: float) -> PinnedEquations:
        """Return square equations: these and the condition that `pin` has this value."""
        return PinnedEquations(self, pin, value)

    def residual(self, x: Array) -> Array:
        """Return the residual without the pin, shape (size + 1,)."""
        fields, laws = self.at(x)
        weak = self.space.weak_form(
            -laws.sigma * _square(fields.grad_V),
            laws.kappa * fields.grad_T,
            laws.sigma * fields.grad_V,
        )
        weak[-1] = x[-2] + self._series * weak[-1] - x[-1]
        return weak

    def tangent(self, fields: Fields, laws: Conductivities) -> Tangent:
        """Linearise the equations at the quadrature points."""
        return Tangent(
            heat_source_T=-laws.sigma_by["T"] * _square(fields.grad_V),
            heat_flux_T=laws.kappa_by["T"] * fields.grad_T,
            kappa=laws.kappa,
            heat_source_V=-2.0 * laws.sigma * fields.grad_V,
            charge_flux_T=laws.sigma_by["T"] * fields.grad_V,
            sigma=laws.sigma,
        )

    def jacobian(self, x: Array) -> SparseJacobian:
        """Return the Jacobian of the free values and of the current, ready to be completed."""
        return self.space.jacobian(self.tangent(*self.at(x)))

    def completed(self, jacobian: SparseJacobian, pin: Pin) -> csc_matrix:
        """Add the circuit equation and the pin to a Jacobian."""
        return jacobian.completed(self._series, pin.bias, pin.tip)

    @property
    def _series(self) -> float:
        return self.circuit.series_resistance_ohm / 1000.0

    def tip_temperature(self, x: Array) -> float:
        """Return T_tip (K)."""
        unknowns, weights = self.space.tip
        return float(weights @ x[unknowns])

    def start(self) -> Array:
        """Return the exact state at zero bias."""
        return self.space.start(self.circuit.base_temperature_K)

    def highest_temperature(self, x: Array) -> float:
        """Return the highest nodal temperature (K)."""
        return float(x[self.space.is_temperature()].max())

    # --- what is measured ------------------------------------------------------------------------

    def observe(self, x: Array) -> dict[str, float]:
        """Return the observables of a solved state.

        Returns
        -------
        dict
            ``current_mA``, ``lever_V``, ``reader_V`` (NaN without a reader), ``tip_K``,
            ``power_mW``, resistances ``heater_ohm``, ``leg1_ohm``, ``leg2_ohm`` (Joule heat of
            the part over I_h²; they add up to V_l / I_h; NaN without current), ``max_K``, and
            for the balances ``ground_current_mA`` and ``end_heat_mW``.
        """
        fields, laws = self.at(x)
        source, heat = laws.sigma * _square(fields.grad_V), laws.kappa * fields.grad_T
        charge = laws.sigma * fields.grad_V
        current = float(self.space.weak_form(-source, heat, charge)[-1])
        end_heat, ground_current = self.space.end_fluxes(-source, heat, charge)
        reader = self.space.reader_weights()
        lever = float(x[-2])

        def resistance(part: Part) -> float:
            if current == 0.0:
                return float("nan")
            return 1000.0 * self.space.integral(source, part) / current**2

        return {
            "current_mA": current,
            "lever_V": lever,
            "reader_V": float("nan") if reader is None else float(reader[1] @ x[reader[0]]),
            "tip_K": self.tip_temperature(x),
            "power_mW": lever * current,
            "heater_ohm": resistance("heater"),
            "leg1_ohm": resistance("leg 1"),
            "leg2_ohm": resistance("leg 2"),
            "max_K": self.highest_temperature(x),
            "ground_current_mA": ground_current,
            "end_heat_mW": end_heat,
        }

    def sensitivities(self, x: Array) -> Array:
        """Return derivatives of I_h, V_r and T_tip by the six parameters, at a fixed bias.

        Parameters
        ----------
        x : ndarray
            A solved state.

        Returns
        -------
        ndarray, shape (3, 6)
            In the order of `OBSERVABLES` and of `PARAMETERS`; mA, V and K per unit of the
            parameter. The row of V_r is NaN without a reader.
        """
        fields, laws = self.at(x)
        square = _square(fields.grad_V)
        columns = []
        for name in PARAMETERS:
            sigma = laws.sigma_by.get(name, np.zeros_like(laws.sigma))
            kappa = laws.kappa_by.get(name, np.zeros_like(laws.kappa))
            columns.append(
                self.space.weak_form(-sigma * square, kappa * fields.grad_T, sigma * fields.grad_V)
            )
        by_parameter = np.column_stack(columns)
        right_hand_side = np.zeros((x.size, len(PARAMETERS)))
        right_hand_side[:-1] = -by_parameter
        right_hand_side[-2] *= self._series
        jacobian = self.jacobian(x)
        change = factorised(self.completed(jacobian, Pin(1.0, 0.0))).solve(right_hand_side)
        unknowns, slopes = jacobian.current_gradient
        current = by_parameter[-1] + slopes @ change[unknowns]
        tip_unknowns, tip_weights = self.space.tip
        tip = tip_weights @ change[tip_unknowns]
        reader = self.space.reader_weights()
        if reader is None:
            return np.stack([current, np.full_like(current, np.nan), tip])
        return np.stack([current, reader[1] @ change[reader[0]], tip])


class PinnedEquations:
    """The lever's equations and one condition on V_b and T_tip; see `newton.Equations`."""

    def __init__(self, lever: LeverEquations, pin: Pin, value: float) -> None:
        self._lever, self._pin, self._value = lever, pin, value
        self.scale, self.step_limit = lever.scale, lever.step_limit

    def residual(self, x: Array) -> Array:
        """Return the residual, shape (size + 2,)."""
        pinned = self._pin.bias * x[-1] + self._pin.tip * self._lever.tip_temperature(x)
        return np.append(self._lever.residual(x), pinned - self._value)

    def factorised(self, x: Array) -> LinearSolve:
        """Return the factorised Jacobian."""
        return factorised(self._lever.completed(self._lever.jacobian(x), self._pin))


def _square(gradient: Array) -> Array:
    return np.einsum("deq,deq->eq", gradient, gradient)
