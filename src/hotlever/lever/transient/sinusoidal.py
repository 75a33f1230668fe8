"""Harmonics of a lever under a sinusoidal drive: the 3ω method, at any operating point.

The bias is V_b = V_0 + V_1 cos ωt. The periodic answer is found at once, by harmonic balance: at
some times of a period the equations of the lever are evaluated side by side, their Fourier
coefficients are the residual, and each of these is corrected by the equations linearised about the
mean state. Modes are those of steps up and down from the operating point: such a step holds all
times from the shortest to the longest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import State
from hotlever.lever.transient.history import integrate
from hotlever.lever.transient.modes import slowest_modes
from hotlever.lever.transient.reduced import space_of_modes
from hotlever.lever.transient.small_signals import checked_frequencies
from hotlever.lever.transient.waveform import step
from hotlever.probe import Circuit
from hotlever.threads import one_blas_thread
from hotlever.types import Array, Progress

Complex = NDArray[np.complexfloating[Any, Any]]

if TYPE_CHECKING:
    from hotlever.lever.lever import Lever

#: Harmonics that are told, and columns of a file.
HARMONICS = ("first", "second", "third")
HARMONIC_COLUMNS = (
    "frequency_Hz",
    *(f"{name}{kind}" for name in HARMONICS for kind in ("_harmonic_V", "_harmonic_deg")),
    "mean_tip_K",
)
#: Times of a period; corrections at most, and how small (relative) the last one is.
_TIMES, _MOST, _ACCURATE = 16, 200, 1e-9
#: Slowest time constants that steps are followed for.
_SETTLED = 12.0


@one_blas_thread
def harmonics(
    lever: Lever,
    offset_V: float,
    amplitude_V: float,
    frequency_Hz: ArrayLike,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return the harmonics of the lever voltage under a bias that is a sine about an offset.

    Parameters
    ----------
    lever : Lever
        In its circuit: with a large series resistance the current is what is driven.
    offset_V, amplitude_V : float
        Of the bias.
    frequency_Hz : array_like, shape (n,)
    progress : callable, optional
        Called with frequencies done and their number.

    Returns
    -------
    xarray.Dataset
        On the dimension ``frequency``: amplitude (V) and phase (degrees, against the bias) of the
        first three harmonics of V_l, and the mean tip temperature.

    Raises
    ------
    InputError
        If a frequency or the amplitude is out of bounds.
    ComputationError
        If the lever has no such operating point, or the drive is too strong for a periodic answer
        to be found.

    Notes
    -----
    Amplitudes have the errors of the modes, some 1e-4 of each.
    """
    frequency = checked_frequencies(frequency_Hz)
    if not 0.0 < amplitude_V < np.inf:
        raise InputError(f"found an amplitude of {amplitude_V:g} V, expected a positive one")
    if not lever.circuit.is_plain:
        raise InputError(
            "[circuit]: harmonics are of levers with one supply, grounds and sense contacts"
        )
    (rest,) = lever.solve([offset_V])
    space = space_of_modes(lever, _steps(lever, rest, amplitude_V), rest.x)
    equations = LeverEquations(space, lever.probe.kinds, lever.circuit)
    start = space.coordinates(rest.x)
    balance = HarmonicBalance(equations, lever.circuit, start, offset_V, amplitude_V)
    found = []
    for done, one in enumerate(frequency.tolist(), start=1):
        found.append(balance.solved(one))
        if progress is not None:
            progress(done, frequency.size)
    lever_V, mean = np.array([one[0] for one in found]), [one[1] for one in found]
    columns: dict[str, ArrayLike] = {"frequency_Hz": frequency, "mean_tip_K": mean}
    for place, name in enumerate(HARMONICS):
        columns[f"{name}_harmonic_V"] = np.abs(lever_V[:, place])
        columns[f"{name}_harmonic_deg"] = np.degrees(np.unwrap(np.angle(lever_V[:, place])))
    shown = {"bias_V": offset_V, "amplitude_V": amplitude_V}
    return labelled(columns, "frequency", {"frequency": frequency}, **shown)


class HarmonicBalance:
    """The equations of a lever with few unknowns, at times of a period side by side.

    Parameters
    ----------
    equations : LeverEquations
    circuit : Circuit
    start : ndarray, shape (size + 1, 1)
        The state at rest at the offset.
    offset, amplitude : float
        Of the bias (V).
    """

    def __init__(
        self,
        equations: LeverEquations,
        circuit: Circuit,
        start: Array,
        offset: float,
        amplitude: float,
    ) -> None:
        self._equations, self._circuit, self._start = equations, circuit, start
        angles = 2.0 * np.pi * np.arange(_TIMES) / _TIMES
        self._bias = offset + amplitude * np.cos(angles)

    def solved(self, frequency_Hz: float) -> tuple[Complex, float]:
        """Return the first harmonics of V_l, complex (V), and the mean tip temperature (K).

        Raises
        ------
        ComputationError
            If the corrections do not become small.
        """
        per_us = 2e-6 * np.pi * frequency_Hz
        # of the highest, which there is but half of, no slope is known
        turns = 1j * per_us * np.arange(_TIMES // 2 + 1)
        turns[-1] = 0.0
        x = np.repeat(self._start, _TIMES, axis=1)
        of_air = self._taken_up(turns)
        inverses = None
        for done in range(_MOST):
            if inverses is None or done in (2, 8):
                inverses = self._inverses(x.mean(axis=1, keepdims=True), turns, of_air)
            stored, rest = self._equations.storage(x), self._equations.balance(x)
            rest[-1] = self._circuit.bias(x[-1], rest[-1]) - self._bias
            residual = np.fft.rfft(rest, axis=1) + turns * np.fft.rfft(stored, axis=1)
            residual += np.einsum("kij,jk->ik", of_air, np.fft.rfft(x, axis=1))
            change = -np.einsum("kij,jk->ik", inverses, residual)
            x = x + np.fft.irfft(change, _TIMES, axis=1)
            if not np.isfinite(x).all():
                break
            if self._small(change, np.fft.rfft(x, axis=1)):
                lever_V = 2.0 * np.fft.rfft(x[-1])[1 : len(HARMONICS) + 1] / _TIMES
                rise = self._equations.space.tip_rise(x)
                return lever_V, self._equations.base_temperature_K + float(rise.mean())
        raise ComputationError(
            f"no periodic answer was found at {frequency_Hz:g} Hz; expected a smaller amplitude"
        )

    def _small(self, change: Complex, coefficients: Complex) -> bool:
        """Whether a correction no longer matters, to the oscillation of heat and of V_l."""
        heat = self._equations.space.is_temperature
        for rows in (heat, ~heat):
            size = np.abs(coefficients[rows][:, 1:]).max(axis=1, keepdims=True)
            if np.abs(change[rows]).max() > _ACCURATE * size.max():
                return False
        return True

    def _taken_up(self, turns: Complex) -> Complex:
        """Return what the air takes up of each harmonic, (harmonics, size + 1, size + 1)."""
        air = self._equations.heat_in_air
        own = air.coordinates
        return np.array([own.T @ air.taken_up(turn) @ own for turn in turns])

    def _inverses(self, x: Array, turns: Complex, of_air: Complex) -> Complex:
        """Return the inverses of the equations linearised about a state, for each harmonic."""
        unit = np.eye(len(x))
        many = np.repeat(x, len(x), axis=1)
        rest = self._equations.balance_change(many, unit)
        rest[-1] = self._circuit.bias(unit[-1], rest[-1])
        moving = self._equations.storage_change(many, unit)
        return np.linalg.inv(turns[:, None, None] * moving + rest + of_air)


def _steps(lever: Lever, rest: State, amplitude: float) -> Array:
    """Return states of a lever at rest whose bias is stepped up, and down."""
    until = _SETTLED * abs(float(slowest_modes(rest)[0][0]))
    states = [rest.x]
    for bias in (rest.bias_V + amplitude, rest.bias_V - amplitude):
        integrate(
            lever,
            step(bias),
            until,
            start=rest,
            tolerance_K=1e-2,
            per_step=2,
            callback=lambda t, state: states.append(state.x),
        )
    return np.hstack(states)
