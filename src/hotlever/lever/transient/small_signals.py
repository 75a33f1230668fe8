"""Small signals at an operating point: impedance, and how the tip follows power and bias.

A small change of V_l at a frequency ω makes the change (iω M + J) x = e, with M and J the
derivatives of what is stored and of the rest, and e the row of V_l. All frequencies are answered by
one small system: the equations tested with and expanded in what real frequencies answer, a
rational Krylov space from both sides (the answers of a diffusive lever are smooth in ω).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.lever.lever import State
from hotlever.lever.space import LEVER
from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: Frequencies (Hz) that are answered; and the real ones (1/µs) that the answers are expanded in,
#: from slower than the slowest mode to faster than all frequencies asked for.
LOWEST, HIGHEST = 1e-3, 1e8
_RATES = np.append(0.0, np.geomspace(3e-3, 3e3, 22))
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
        phase (degrees).

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
    equations, x = state.lever.equations, state.x
    unit = np.zeros_like(x)
    unit[-1] = 1.0
    current = equations.observed_gradient(x)[..., 1]
    tip = np.zeros_like(x)
    unknowns, weights = equations.space.tip
    tip[unknowns, 0] = weights
    answers, tests, one = [], [], np.arange(1)
    for rate in _RATES:
        factors = equations.factorised(x, LEVER, float(rate))
        answers.append(factors.solve(unit, one))
        answers.append(factors.solve(equations.storage_change(x, answers[-1]), one))
        tests += [factors.solve(column, one, transposed=True) for column in (current, tip)]
    trial, test = (np.linalg.qr(np.hstack(columns))[0] for columns in (answers, tests))
    many = np.repeat(x, trial.shape[1], axis=1)
    rest = equations.balance_change(many, trial)
    rest[-1] = trial[-1]
    moving = test.T @ equations.storage_change(many, trial)
    turns = 2e-6j * np.pi * frequency
    system = turns[:, None, None] * moving + test.T @ rest
    air = equations.heat_in_air
    before, after = test.T @ air.coordinates.T, air.coordinates @ trial
    system = system + np.array([before @ air.taken_up(turn) @ after for turn in turns])
    right = np.broadcast_to(test.T @ unit, (frequency.size, trial.shape[1], 1))
    # rational Krylov spaces are nearly dependent: least squares instead of elimination
    shares = np.stack(
        [np.linalg.lstsq(one, by, rcond=1e-13)[0] for one, by in zip(system, right, strict=True)]
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
        "tip_per_power_K_per_mW": np.abs(per_power),
        "tip_per_power_deg": np.degrees(np.unwrap(np.angle(per_power))),
        "tip_per_bias_K_per_V": np.abs(per_bias),
        "tip_per_bias_deg": np.degrees(np.unwrap(np.angle(per_bias))),
    }
    seen = {name: getattr(state, name) for name in ("bias_V", "lever_V", "current_mA", "tip_K")}
    return labelled(columns, "frequency", {"frequency": frequency}, **seen)


def checked_frequencies(frequency_Hz: ArrayLike) -> Array:
    """Return frequencies (Hz) as an array.

    Raises
    ------
    InputError
        If one is out of bounds, or there is none.
    """
    frequency = np.atleast_1d(np.asarray(frequency_Hz, dtype=float))
    if not frequency.size or not ((frequency >= LOWEST) & (frequency <= HIGHEST)).all():
        raise InputError(f"expected frequencies from {LOWEST:g} to {HIGHEST:g} Hz")
    return frequency
