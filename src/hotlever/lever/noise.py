"""How a voltage of a lever at rest responds to small changes, and its noise, source by source.

One adjoint solve answers for every change, of a parameter or of what fluctuates at each point.

What fluctuates at each point is known, independent of all other points; the voltage is their sum,
each weighted by the adjoint (`Response`), of temperature τ and potential φ. So the
electro-thermal feedback of the circuit counts, as at all frequencies that the lever follows (J. C.
Mather, Appl. Opt. 21, 1125 (1982)). One-sided spectral densities (V²/Hz):

- Johnson noise (H. Nyquist, Phys. Rev. 32, 110 (1928)), current densities of 4 k_B T σ, which heat
  as well: 4 k_B ∫ T σ (∇φ − τ ∇V)² dV, for a resistor alone 4 k_B ∫ T ρ j² dV / I². Resistors of
  the circuit are at room temperature.
- Fluctuations of the temperature, heat fluxes of 4 k_B T² κ: 4 k_B ∫ T² κ (∇τ)² dV over lever and
  air; of one thermal conductance 4 k_B T² G.
- 1/f noise (F. N. Hooge, Phys. Lett. A 29, 139 (1969)), conductivities of α σ²/(n f):
  α/f ∫ σ²/n (∇V·(∇φ − τ ∇V))² dV, for a resistor of N carriers α V²/(N f).
- Of the amplifier, and of the lever's own vibration, as stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from scipy.constants import Boltzmann

from hotlever.errors import InputError
from hotlever.lever.equations import ELECTRICAL_OUTPUTS, LeverEquations
from hotlever.lever.space import Constraint
from hotlever.lever.transport import dot
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM

#: Where noise comes from.
SOURCES = (
    *("Johnson noise of the lever", "Johnson noise of resistors", "temperature fluctuations"),
    *("1/f noise", "amplifier", "vibration of the lever"),
)
#: 4 k_B in the units of kK, kΩ and mW, for V²/Hz.
_FOUR_K = 4e3 * Boltzmann


@dataclass(frozen=True)
class NoiseOptions:
    """What is known of noise beside the lever.

    Attributes
    ----------
    low_Hz, high_Hz : float
        The band, over which the density of 1/f noise is a mean.
    amplifier_V : float
        Density of the amplifier's noise at its input (V/√Hz).
    hooge : float
        Hooge's parameter α of the silicon; 0: no 1/f noise.
    vibration_nm : float
        Density of the lever's own motion in the band (nm/√Hz).

    Raises
    ------
    InputError
        If a value makes no sense.
    """

    low_Hz: float = 1.0
    high_Hz: float = 1000.0
    amplifier_V: float = 5e-9
    hooge: float = 0.0
    vibration_nm: float = 0.0

    def __post_init__(self) -> None:
        highest = {"amplifier_V": 1.0, "hooge": 1.0, "vibration_nm": 1e3}
        for each in fields(self):
            value, most = getattr(self, each.name), highest.get(each.name, 1e12)
            if not 0.0 <= value <= most:
                raise InputError(
                    f"{each.name}: found {value:g}, expected a number from 0 to {most:g}"
                )
        if not 0 < self.low_Hz < self.high_Hz:
            raise InputError(
                f"bandwidth: found {self.low_Hz:g}Hz:{self.high_Hz:g}Hz, expected LOW:HIGH, such "
                "as 1Hz:1kHz, with 0 < LOW < HIGH"
            )

    @property
    def mean_inverse_frequency(self) -> float:
        """Mean of 1/f over the band (s)."""
        return math.log(self.high_Hz / self.low_Hz) / (self.high_Hz - self.low_Hz)


@dataclass(frozen=True)
class Response:
    """The response of one of `ELECTRICAL_OUTPUTS` in the lever's circuit.

    Attributes
    ----------
    equations : LeverEquations
    x : ndarray, shape (size + 1, 1)
        The state at rest.
    adjoint : ndarray, shape (size + 1, 1)
        The response to a change of `LeverEquations.balance` is less their product. At the points it
        is a temperature by which added heat counts (V/mW) and a potential by which a current does
        (V/mA).
    by_bias : float
        The response to the bias of the swept supply (V/V).
    power_by_bias : float
        How the power P_l of that supply responds (mW/V).
    change : callable
        The change of the state by a change of the balance, (size + 1, 1).
    """

    equations: LeverEquations
    x: Array
    adjoint: Array
    by_bias: float
    power_by_bias: float
    change: Callable[[Array], Array]

    @classmethod
    def of(
        cls, equations: LeverEquations, x: Array, constraint: Constraint, output: str
    ) -> Response:
        """Find the response of a state; the constraint is one that selects it on its branch."""
        circuit, number = equations.circuit, ELECTRICAL_OUTPUTS.index(output)
        factors = equations.factorised(x, constraint)
        by_state = factors.solve(equations.observed_gradient(x), np.arange(1), transposed=True)
        branch = equations.along(x, factors, constraint)
        along = equations.observed_change(x, branch)[:, 0]
        # along its branch the state goes back to where the bias is what it was
        per_V = circuit.bias(along[0], along[1])
        along, branch = along / per_V, branch / per_V
        lever_V, current_mA, _ = np.moveaxis(by_state, 2, 0)
        adjoint = by_state[..., number] - along[number] * circuit.bias(lever_V, current_mA)
        # a change of the current at the same state is the last of the balance
        adjoint[-1] = along[number] * circuit.series_kohm
        by_power = float(x[-1, 0] * along[1] + equations.balance(x)[-1, 0] * along[0])

        def change(of_balance: Array) -> Array:
            held = np.concatenate([-of_balance[:-1], np.zeros((1, 1))])
            state_change = equations.solve_linear(x, factors, held, constraint)
            lever_V, current_mA, _ = equations.observed_change(x, state_change)[:, 0]
            missing = circuit.bias(lever_V, current_mA + of_balance[-1, 0])
            return np.asarray(state_change - missing * branch)

        return cls(equations, x, adjoint, float(along[number]), by_power, change)

    def by_parameter(self, name: str) -> tuple[float, float]:
        """Return the response to a parameter of the equations, per unit, and its delay (µs).

        By the delay, the first moment of its answer to a step, it follows slow changes: the lever's
        own heat counts, not that of the air.
        """
        of_balance = self.equations.by_parameter(self.x, [name])[..., 0]
        response = -float((self.adjoint * of_balance).sum())
        stored = self.equations.storage_change(self.x, self.change(of_balance))
        return response, float((self.adjoint * stored).sum()) / response


def spectral_densities(response: Response, options: NoiseOptions, volts_per_um: float) -> Array:
    """Return the densities (V²/Hz) of the noise from each of `SOURCES`.

    Parameters
    ----------
    response : Response
        Of the voltage.
    options : NoiseOptions
    volts_per_um : float
        How it changes with the distance to a surface, by which the lever's vibration counts.
    """
    vibration = volts_per_um * 1e-3 * options.vibration_nm
    return np.array(
        [
            johnson(response),
            of_resistors(response),
            of_temperature(response),
            options.hooge * options.mean_inverse_frequency * per_hooge(response),
            options.amplifier_V**2,
            vibration**2,
        ]
    )


def johnson(response: Response) -> float:
    """Return the density (V²/Hz) of the Johnson noise of the lever."""
    equations = response.equations
    fields_, properties, _ = equations.at(response.x)
    weight = _by_current(response)
    return _FOUR_K * _integral(equations, fields_.T * properties.sigma * dot(weight, weight))


def johnson_without_feedback(equations: LeverEquations, x: Array, current_mA: float) -> float:
    """Return the density (V²/Hz) of the Johnson noise of the lever as a resistor alone.

    That is what it shows with no circuit about it, faster than its temperature follows.
    """
    fields_, properties, _ = equations.at(x)
    heat = properties.sigma * dot(fields_.grad_V, fields_.grad_V)
    return _FOUR_K * _integral(equations, fields_.T * heat) / current_mA**2


def of_resistors(response: Response) -> float:
    """Return the density (V²/Hz) of the Johnson noise of the circuit's resistors."""
    terminals, circuit = response.equations.terminals, response.equations.circuit
    by_held = response.adjoint[list(response.equations.space.held.values()), 0]
    held = terminals.conductance @ by_held**2
    # the resistors are in a room of 293 K
    return _FOUR_K * 293.0 * float(held + circuit.series_kohm * response.by_bias**2)


def of_temperature(response: Response) -> float:
    """Return the density (V²/Hz) by fluctuations of the temperature, of lever and air.

    Those of the air are exact where the response is proportional to θ of the air: it is averaged
    over the air's temperatures between surface and surroundings.
    """
    equations, air = response.equations, response.equations.space.air
    fields_, properties, _ = equations.at(response.x)
    slope = equations.space.fields(response.adjoint).grad_T
    within = _integral(equations, fields_.T**2 * properties.kappa * dot(slope, slope))
    counted = np.sqrt(_mean_noise_of_air(equations, response.x)) * air.rise(response.adjoint)
    return _FOUR_K * (within + float((counted * (air.operator.matrix @ counted)).sum()))


def per_hooge(response: Response) -> float:
    """Return the density times the frequency (V²) of 1/f noise for Hooge's parameter 1.

    Carriers are those of the doping; metal films and dielectrics are taken to have no such noise.
    """
    equations = response.equations
    fields_, _, _ = equations.at(response.x)
    by_carrier = np.zeros_like(fields_.T)
    for laws in equations.laws.films:
        film, kind = laws.film, laws.kind
        if isinstance(kind, LowDopedSilicon):
            doping: Array | float = laws.doping
        elif isinstance(kind, HighDopedSilicon):
            doping = kind.n_hd
        else:
            continue
        sigma, _ = kind.electrical_conductivity(fields_.T[film.points], laws.doping)
        sheet = PER_CM_TO_MILLI_PER_UM * film.counted_um * sigma
        # the doping is stated per cm³, of which 1 µm³ is 1e-12
        by_carrier[film.points] += sheet**2 / (1e-12 * doping * film.thickness_um)
    power = dot(fields_.grad_V, _by_current(response))
    return _integral(equations, by_carrier * power**2)


def _by_current(response: Response) -> Array:
    """Return how a current density at the points counts (V/(mA µm)), (dimension, points, 1)."""
    fields_, properties, _ = response.equations.at(response.x)
    adjoint = response.equations.space.fields(response.adjoint)
    weight = adjoint.grad_V - adjoint.T * fields_.grad_V
    if properties.beta is not None:
        # it carries Peltier heat
        weight = weight + fields_.T * properties.beta / properties.sigma * adjoint.grad_T
    return np.asarray(weight)


def _integral(equations: LeverEquations, density: Array) -> float:
    return float((equations.space.weights * density).sum())


def _mean_noise_of_air(equations: LeverEquations, x: Array) -> Array:
    """Return the mean of T² κ over θ of the air (K mW/µm), from the base to each site, (sites, 1).

    Between parallel plates θ is linear in the distance, so that this is the mean over the gap.
    """
    air, base = equations.space.air, equations.base_temperature_K
    rise = air.rise(x)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    T = base + np.maximum(rise, 1e-9)[..., None] * (1.0 + nodes) / 2.0
    kappa = PER_CM_TO_MILLI_PER_UM * air.gas_conductivity * thermal_conductivity_of_air(T)[0]
    return np.asarray(((T * kappa) ** 2 @ weights) / (kappa @ weights))
