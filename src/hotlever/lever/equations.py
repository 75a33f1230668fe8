"""The coupled electro-thermal equations of a lever in its circuit.

Heat (paper's first equation, with the sign corrected) and charge::

    −∇·(κ ∇T) = σ |∇V|² − heat lost to air,    ∇·(σ ∇V) = 0,

with T = base temperature at all terminals, V = 0 at ground, V = V_l on the supply contact,
no current into the reader, and V_l + R_s I_h = V_b. A state is the vector of the free nodal
values, then V_l, then V_b; one more condition, the *pin*, selects a state on the branch: a
given bias, or a point along the arc. Units are µm, V, mA, mW and K.

The loss to air is linear in θ = ∫κ_air dT on the surface (`hotlever.air.operator`). The air
operator fills the plate itself with air too; κ is therefore κ_Si − κ_air where there is air.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.newton import LinearSolve
from hotlever.lever.space import Fields, LeverSpace, Tangent, Tapered
from hotlever.materials import PARAMETERS, Material
from hotlever.materials.air import kirchhoff_variable, thermal_conductivity_of_air
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


class Jacobian(Protocol):
    """The linearised equations before the circuit equation and the pin are added."""

    current_gradient: tuple[NDArray[np.intp], Array]

    def completed(self, series_resistance_kohm: float, pin_bias: float, pin_tip: float) -> Any:
        """Return the square matrix; the last rows are circuit equation and pin."""
        ...

    def factorised(
        self, series_resistance_kohm: float, pin_bias: float, pin_tip: float
    ) -> LinearSolve:
        """Complete and factorise."""
        ...


class AirTerm(Protocol):
    """Loss to air between the unknowns of a space: linear in θ at some sites.

    Attributes
    ----------
    filling : float
        See `hotlever.air.operator.AirOperator`.
    """

    filling: float

    def temperature(self, x: Array, base_temperature_K: float) -> Array:
        """Return the temperature (K) at the sites."""
        ...

    def weak_form(self, theta: Array) -> Array:
        """Return the heat lost for θ (mW/µm) at the sites, as `Space.weak_form` does."""
        ...

    def heat(self, theta: Array) -> tuple[float, float]:
        """Return the heat lost (mW), and its part that is tested at the leg ends."""
        ...

    def added(self, jacobian: Any, kappa: Array) -> Jacobian:
        """Return the Jacobian with air; κ_air (mW/(K µm)) at the sites."""
        ...


class Space(Protocol):
    """Unknowns and operators of a lever: finite elements, or a reduced basis of them.

    A state has ``size`` values, then V_l, then V_b. See `LeverSpace` for the methods.
    """

    size: int
    tip: tuple[NDArray[np.intp], Array]
    tapered: list[Tapered]
    air: Any  # an AirTerm, or None in vacuum

    @property
    def thickness_um(self) -> float | Array:
        """Thickness of the silicon (µm), where it varies at the quadrature points."""
        ...

    def fields(self, x: Array, base_temperature_K: float) -> Fields:
        """Return temperature and gradients at the quadrature points."""
        ...

    def weak_form(
        self, heat_source: Array | float, heat_flux: Array | float, charge_flux: Array
    ) -> Array:
        """Return the weak equations of the values, and last the current I_h into V_l."""
        ...

    def jacobian(self, tangent: Tangent) -> Jacobian:
        """Assemble the linearised equations."""
        ...

    def start(self, base_temperature_K: float) -> Array:
        """Return the exact state without bias."""
        ...

    def is_temperature(self) -> NDArray[np.bool_]:
        """Return which of the unknowns are temperatures."""
        ...

    def tip_temperature(self, x: Array) -> float:
        """Return T_tip (K)."""
        ...

    def highest_temperature(self, x: Array) -> float:
        """Return the highest temperature (K)."""
        ...

    def reader_weights(self) -> tuple[NDArray[np.intp], Array] | None:
        """Return unknowns and weights that give V_r; None without a reader."""
        ...


class Pin(NamedTuple):
    """The condition ``bias V_b + tip T_tip = value`` that selects a state on the branch."""

    bias: float
    tip: float


class LeverEquations:
    """Residual, Jacobian and observables of one lever with one material in one circuit.

    Parameters
    ----------
    space : Space
    circuit : Circuit
    material : Material
    """

    def __init__(self, space: Space, circuit: Circuit, material: Material) -> None:
        self.space, self.circuit, self.material = space, circuit, material
        self._sheet = PER_CM_TO_MILLI_PER_UM * space.thickness_um
        self._latest: tuple[Array, tuple[Fields, Conductivities]] | None = None
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
        if self.space.air is not None:
            filling = self.space.air.filling
            of_air, of_air_by = thermal_conductivity_of_air(T)
            kappa = kappa - filling * of_air
            kappa_by = {**kappa_by, "T": kappa_by["T"] - filling * of_air_by["T"]}
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
        # residual, Jacobian and sensitivities are asked for at the same state one by one
        if self._latest is None or self._latest[0] is not x:
            fields = self.space.fields(x, self.circuit.base_temperature_K)
            self._latest = (x, (fields, self.conductivities(fields.T)))
        return self._latest[1]

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
        if self.space.air is not None:
            weak += self.space.air.weak_form(self._kirchhoff(x)[0])
        weak[-1] = x[-2] + self.series_kohm * weak[-1] - x[-1]
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

    def jacobian(self, x: Array) -> Jacobian:
        """Return the Jacobian of the free values and of the current, ready to be completed."""
        jacobian = self.space.jacobian(self.tangent(*self.at(x)))
        if self.space.air is None:
            return jacobian
        return self.space.air.added(jacobian, self._kirchhoff(x)[1])

    def _kirchhoff(self, x: Array) -> tuple[Array, Array]:
        """Return θ (mW/µm) and κ_air (mW/(K µm)) at the sites of the air operator."""
        base = self.circuit.base_temperature_K
        theta, by = kirchhoff_variable(self.space.air.temperature(x, base), base)
        return PER_CM_TO_MILLI_PER_UM * theta, PER_CM_TO_MILLI_PER_UM * by["T"]

    @property
    def series_kohm(self) -> float:
        """Series resistance R_s (kΩ), which makes volts of milliamperes."""
        return self.circuit.series_resistance_ohm / 1000.0

    def start(self) -> Array:
        """Return the exact state at zero bias."""
        return self.space.start(self.circuit.base_temperature_K)

    # --- what is measured ------------------------------------------------------------------------

    def measured(self, x: Array) -> Array:
        """Return I_h (mA), V_r (V, NaN without a reader) and T_tip (K), shape (3,)."""
        fields, laws = self.at(x)
        current = self.space.weak_form(0.0, 0.0, laws.sigma * fields.grad_V)[-1]
        return np.array([current, self._reader_voltage(x), self.space.tip_temperature(x)])

    def _reader_voltage(self, x: Array) -> float:
        reader = self.space.reader_weights()
        return float("nan") if reader is None else float(reader[1] @ x[reader[0]])

    def observe(self, x: Array) -> dict[str, float]:
        """Return everything that is observed of a solved state, balances included.

        Returns
        -------
        dict
            ``current_mA``, ``lever_V``, ``reader_V`` (NaN without a reader), ``tip_K``,
            ``power_mW``, resistances ``heater_ohm``, ``leg1_ohm``, ``leg2_ohm`` (Joule heat of
            the part over I_h²; they add up to V_l / I_h; NaN without current), ``max_K``, and
            for the balances ``ground_current_mA``, ``end_heat_mW`` and ``air_heat_mW`` (0 in
            vacuum).

        Raises
        ------
        TypeError
            If the space is not the full finite-element one.
        """
        space = self.space
        if not isinstance(space, LeverSpace):
            raise TypeError("balances and resistances need the full finite-element space")
        fields, laws = self.at(x)
        source, heat = laws.sigma * _square(fields.grad_V), laws.kappa * fields.grad_T
        charge = laws.sigma * fields.grad_V
        current = float(space.weak_form(-source, heat, charge)[-1])
        end_heat, ground_current = space.end_fluxes(-source, heat, charge)
        lever = float(x[-2])
        air_heat = 0.0
        if space.air is not None:
            air_heat, at_ends = space.air.heat(self._kirchhoff(x)[0])
            end_heat -= at_ends

        def resistance(part: Part) -> float:
            if current == 0.0:
                return float("nan")
            return 1000.0 * space.integral(source, part) / current**2

        return {
            "current_mA": current,
            "lever_V": lever,
            "reader_V": self._reader_voltage(x),
            "tip_K": space.tip_temperature(x),
            "power_mW": lever * current,
            "heater_ohm": resistance("heater"),
            "leg1_ohm": resistance("leg 1"),
            "leg2_ohm": resistance("leg 2"),
            "max_K": space.highest_temperature(x),
            "ground_current_mA": ground_current,
            "end_heat_mW": end_heat,
            "air_heat_mW": air_heat,
        }

    def by_parameter(self, x: Array) -> Array:
        """Return derivatives of the weak equations and of I_h by the six parameters.

        Returns
        -------
        ndarray, shape (size + 1, 6)
            At fixed fields, in the order of `PARAMETERS`.
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
        return np.stack(columns, axis=-1)

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
        by_parameter = self.by_parameter(x)
        right_hand_side = np.zeros((x.size, len(PARAMETERS)))
        right_hand_side[:-1] = -by_parameter
        right_hand_side[-2] *= self.series_kohm
        jacobian = self.jacobian(x)
        change = jacobian.factorised(self.series_kohm, 1.0, 0.0).solve(right_hand_side)
        observed = self._observed_change(jacobian, change)
        observed[0] += by_parameter[-1]
        return observed

    def observed_change(self, x: Array, change: Array) -> Array:
        """Return how I_h, V_r and T_tip change with the unknowns, to first order.

        Parameters
        ----------
        x : ndarray, shape (n,)
        change : ndarray, shape (n,) or (n, k)

        Returns
        -------
        ndarray, shape (3,) or (3, k)
            mA, V (NaN without a reader) and K.
        """
        return self._observed_change(self.jacobian(x), change)

    def _observed_change(self, jacobian: Jacobian, change: Array) -> Array:
        unknowns, slopes = jacobian.current_gradient
        current = slopes @ change[unknowns]
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
        pinned = self._pin.bias * x[-1] + self._pin.tip * self._lever.space.tip_temperature(x)
        return np.append(self._lever.residual(x), pinned - self._value)

    def factorised(self, x: Array) -> LinearSolve:
        """Return the factorised Jacobian."""
        return self._lever.jacobian(x).factorised(self._lever.series_kohm, *self._pin)


def _square(gradient: Array) -> Array:
    return np.einsum("deq,deq->eq", gradient, gradient)
