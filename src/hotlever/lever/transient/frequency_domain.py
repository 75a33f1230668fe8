"""What a lever answers at frequencies: small signals at an operating point, harmonics of a sine.

Small signals: a change of V_l at a frequency ω makes the change (iω M + J) x = e, with M and J the
derivatives of what is stored and of the residual, and e the row of V_l. All frequencies are
answered by one small system: the equations tested with and expanded in what real frequencies
answer, a rational Krylov space from both sides (the answers of a diffusive lever are smooth in ω).

Harmonics (the 3ω method, at any operating point): the bias is V_b = V_0 + V_1 cos ωt. The periodic
answer is found at once, by harmonic balance: at some times of a period the equations of the lever
are evaluated side by side, their Fourier coefficients are the residual, and each of these is
corrected by the equations linearised about the mean state. Modes are those of steps up and down
from the operating point: such a step holds all times from the shortest to the longest.

The holder of a chip, which takes milliseconds and longer, follows the mean alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError
from hotlever.lever.dataset import probe_attributes
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import State
from hotlever.lever.space import LEVER
from hotlever.lever.transient.history import integrate, note_on_holder
from hotlever.lever.transient.modes import slowest_modes
from hotlever.lever.transient.reduced import space_of_modes
from hotlever.lever.transient.waveform import step
from hotlever.probe import Circuit
from hotlever.types import Array, Progress
from hotlever.work import each, one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.lever import Lever

Complex = NDArray[np.complexfloating[Any, Any]]

#: Columns of a file.
SPECTRUM_COLUMNS = (
    *("frequency_Hz", "impedance_real_ohm", "impedance_imag_ohm"),
    *("tip_per_power_K_per_mW", "tip_per_power_deg", "tip_per_bias_K_per_V", "tip_per_bias_deg"),
)


@one_blas_thread
def spectrum(state: State, frequency_Hz: ArrayLike) -> xr.Dataset:
    """Return what a lever answers to small signals at an operating point.

    Parameters
    ----------
    state : State
        With some current.
    frequency_Hz : array_like, shape (n,)

    Returns
    -------
    xarray.Dataset
        On the dimension ``frequency`` (Hz): the impedance dV_l/dI_h, real and imaginary (Ω); the
        change of the tip temperature per change of the power and of the bias, each as size and
        phase (degrees); with a bridge, that of its voltage per change of the bias.

    Raises
    ------
    InputError
        If a frequency is out of bounds, or the state has no current.

    Examples
    --------
    >>> from hotlever import Lever, Probe
    >>> (knee,) = Lever(Probe.reference()).solve([8.268])
    >>> found = spectrum(knee, [1.0, 1e7])
    >>> found.impedance_real_ohm.values.round(-2).tolist()  # nearly level at rest
    [200.0, 3300.0]
    """
    frequency = checked_frequencies(frequency_Hz)
    if state.current_mA == 0.0:
        raise InputError("found no current, expected a bias at which the lever is heated")
    equations, x = state.lever.in_pulses().equations, state.x
    unit = np.zeros_like(x)
    unit[-1] = 1.0
    current = equations.observed_gradient(x)[..., 1]
    tip = np.zeros_like(x)
    unknowns, weights = equations.space.tip
    tip[unknowns, 0] = weights
    answers, tests, single = [], [], np.arange(1)
    # real rates (1/µs) from slower than the slowest mode to faster than all frequencies that are
    # answered, and at rest
    for rate in np.append(0.0, np.geomspace(3e-3, 3e3, 22)):
        factors = equations.factorised(x, LEVER, float(rate))
        answers.append(factors.solve(unit, single))
        answers.append(factors.solve(equations.storage_change(x, answers[-1]), single))
        tests += [factors.solve(column, single, transposed=True) for column in (current, tip)]
    trial, test = (np.linalg.qr(np.hstack(columns))[0] for columns in (answers, tests))
    many = np.repeat(x, trial.shape[1], axis=1)
    residual = equations.balance_change(many, trial)
    residual[-1] = trial[-1]
    moving = test.T @ equations.storage_change(many, trial)
    turns = 2e-6j * np.pi * frequency
    system = turns[:, None, None] * moving + test.T @ residual
    air = equations.heat_in_air
    before, after = test.T @ air.coordinates.T, air.coordinates @ trial
    system = system + np.array([before @ air.taken_up(turn) @ after for turn in turns])
    right = np.broadcast_to(test.T @ unit, (frequency.size, trial.shape[1], 1))
    # rational Krylov spaces are nearly dependent: least squares instead of elimination
    shares = np.stack(
        [np.linalg.lstsq(a, b, rcond=1e-13)[0] for a, b in zip(system, right, strict=True)]
    )[..., 0]
    scale = shares @ trial[-1]
    by_V = {
        name: shares @ (row[:, 0] @ trial) / scale for name, row in (("I", current), ("T", tip))
    }
    power = state.current_mA + state.lever_V * by_V["I"]
    bias = state.lever.circuit.bias(1.0, by_V["I"])
    impedance = 1000.0 / by_V["I"]
    per_power, per_bias = by_V["T"] / power, by_V["T"] / bias
    columns = {
        "frequency_Hz": frequency,
        "impedance_real_ohm": impedance.real,
        "impedance_imag_ohm": impedance.imag,
    }
    columns |= _polar("tip_per_power", "K_per_mW", per_power)
    columns |= _polar("tip_per_bias", "K_per_V", per_bias)
    if state.lever.circuit.has_bridge:
        out = state.lever.circuit.bridge_change(1.0 / bias, 1.0)
        columns |= _polar("bridge_per_bias", "V_per_V", out)
    seen: dict[str, Any] = {
        name: getattr(state, name) for name in ("bias_V", "lever_V", "current_mA", "tip_K")
    }
    seen |= _described(state.lever)
    return labelled(columns, "frequency", {"frequency": frequency}, **seen)


def _described(lever: Lever) -> dict[str, Any]:
    """Return attributes of a lever, and a note if the holder of its chip gets warm at rest."""
    notes = note_on_holder(lever, "does not follow what oscillates")
    return {**probe_attributes(lever.probe), "notes": notes}


def _polar(name: str, unit: str, values: Complex) -> dict[str, Array]:
    """Return columns of sizes and of phases (degrees) without jumps."""
    phases = np.degrees(np.unwrap(np.angle(values)))
    return {f"{name}_{unit}": np.abs(values), f"{name}_deg": phases}


def checked_frequencies(frequency_Hz: ArrayLike) -> Array:
    """Return frequencies (Hz) as an array.

    Raises
    ------
    InputError
        If one is out of bounds, or there is none.
    """
    frequency = np.atleast_1d(np.asarray(frequency_Hz, dtype=float))
    lowest, highest = 1e-3, 1e8  # Hz; the real rates that answers are expanded in reach as far
    if not frequency.size or not ((frequency >= lowest) & (frequency <= highest)).all():
        raise InputError(f"expected frequencies from {lowest:g} to {highest:g} Hz")
    return frequency


#: Columns of a file of harmonics.
HARMONIC_COLUMNS = (
    *("frequency_Hz", "first_harmonic_V", "first_harmonic_deg", "second_harmonic_V"),
    *("second_harmonic_deg", "third_harmonic_V", "third_harmonic_deg", "mean_tip_K"),
)


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
        first three harmonics of V_l, and of a bridge; and the mean tip temperature.

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
    equations = LeverEquations.of_probe(space, lever.probe)
    start = space.coordinates(rest.x)
    in_time = lever.in_pulses().equations.terminals.chip_mW_per_K
    balance = HarmonicBalance(equations, lever.circuit, start, offset_V, amplitude_V, in_time)
    answers = [balance.solved(hertz) for hertz in each(frequency.tolist(), progress)]
    lever_V, mean = np.array([volts for volts, _ in answers]), [kelvin for _, kelvin in answers]
    columns: dict[str, ArrayLike] = {"frequency_Hz": frequency, "mean_tip_K": mean}
    seen = {"": lever_V}
    if lever.circuit.has_bridge:
        # the bias has a first harmonic alone
        driven_V = np.array([amplitude_V, *np.zeros(2)])
        seen["bridge_"] = lever.circuit.bridge_change(lever_V, driven_V)
    for of, volts in seen.items():
        for number, name in enumerate(("first", "second", "third")):
            columns |= _polar(f"{name}_{of}harmonic", "V", volts[:, number])
    attributes: dict[str, Any] = {"bias_V": offset_V, "amplitude_V": amplitude_V}
    attributes |= _described(lever)
    return labelled(columns, "frequency", {"frequency": frequency}, **attributes)


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
    chip_mW_per_K : float
        Of the chip below the leg ends, for what oscillates; infinite if there is none.
    times : int
        Of a period; even.
    """

    def __init__(
        self,
        equations: LeverEquations,
        circuit: Circuit,
        start: Array,
        offset: float,
        amplitude: float,
        chip_mW_per_K: float = np.inf,
        times: int = 16,
    ) -> None:
        self._equations, self._circuit, self._start = equations, circuit, start
        self._chip_mW_per_K = chip_mW_per_K
        self._times = times
        angles = 2.0 * np.pi * np.arange(times) / times
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
        turns = 1j * per_us * np.arange(self._times // 2 + 1)
        turns[-1] = 0.0
        x = np.repeat(self._start, self._times, axis=1)
        taken_up = self._taken_up(turns)
        inverses = None
        for done in range(200):
            if inverses is None or done in (2, 8):
                inverses = self._inverses(x.mean(axis=1, keepdims=True), turns, taken_up)
            stored = self._equations.storage(x)
            rest = self._equations.balance_in(self._circuit, x, self._bias)
            residual = np.fft.rfft(rest, axis=1) + turns * np.fft.rfft(stored, axis=1)
            residual += np.einsum("kij,jk->ik", taken_up, np.fft.rfft(x, axis=1))
            change = -np.einsum("kij,jk->ik", inverses, residual)
            x = x + np.fft.irfft(change, self._times, axis=1)
            if not np.isfinite(x).all():
                break
            if self._small(change, np.fft.rfft(x, axis=1)):
                lever_V = 2.0 * np.fft.rfft(x[-1])[1:4] / self._times
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
            if np.abs(change[rows]).max() > 1e-9 * size.max():
                return False
        return True

    def _taken_up(self, turns: Complex) -> Complex:
        """Return what the air takes up of each harmonic, (harmonics, size + 1, size + 1).

        And the chip, beyond what it does at rest.
        """
        air, terminals = self._equations.heat_in_air, self._equations.terminals
        own = air.coordinates
        by_harmonic = np.array([own.T @ air.taken_up(turn) @ own for turn in turns])
        if np.isfinite(self._chip_mW_per_K):
            unit, more = np.eye(len(self._start)), np.zeros((len(self._start),) * 2)
            terminals.add_heat_into_chip(more, unit, self._chip_mW_per_K - terminals.chip_mW_per_K)
            by_harmonic[1:] += more
        return by_harmonic

    def _inverses(self, x: Array, turns: Complex, taken_up: Complex) -> Complex:
        """Return the inverses of the equations linearised about a state, for each harmonic."""
        unit = np.eye(len(x))
        many = np.repeat(x, len(x), axis=1)
        residual = self._equations.balance_change_in(self._circuit, many, unit)
        moving = self._equations.storage_change(many, unit)
        return np.linalg.inv(turns[:, None, None] * moving + residual + taken_up)


def _steps(lever: Lever, start: State, amplitude: float) -> Array:
    """Return states of a lever at rest whose bias is stepped up, and down.

    If a holder of its chip gets warm, as it does for the mean, then with a cold one as well.
    """
    # after so many of the slowest time constants the lever is at rest
    until = 12.0 * abs(float(slowest_modes(start)[0][0]))
    states, in_time = [start.x], lever.in_pulses()
    for one in [lever] if in_time is lever else [lever, in_time]:
        (begin,) = [start] if one is lever else one.solve([start.bias_V])
        away = start.x - begin.x

        def keep(t: float, state: State, away: Array = away) -> None:
            states.append(state.x + away)

        for bias in (start.bias_V + amplitude, start.bias_V - amplitude):
            integrate(
                one, step(bias), until, start=begin, tolerance_K=1e-2, per_step=2, callback=keep
            )
    return np.hstack(states)
