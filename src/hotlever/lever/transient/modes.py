"""Time constants of a lever at an operating point, and how long it takes to heat and to cool.

A small change of a state obeys M dx/dt + J x = 0, with M and J the derivatives of what is stored
and of the rest, the circuit's row among them. It is a sum of modes; each decays with a time
constant τ, J⁻¹ M x = τ x. Heating changes the resistance that heats, so that the time constants
depend on what the source holds. A negative one is the runaway beyond a fold.

Air without an end has no modes of its own: its answer has a cut where the modes of the lever lie.
A time constant in air is where the lever would resonate, with the heat capacity of the air that
goes along, to second order in what leaks into the cut; the last per cent of a lever's rise follow
no exponential.

All this is faster than the holder of a chip, which stays as warm as it is at rest.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.linalg import LinearOperator, eigs

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, unknown_name
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import State
from hotlever.lever.space import LEVER
from hotlever.lever.transient.history import integrate
from hotlever.lever.transient.transient_problem import InCircuit
from hotlever.lever.transient.waveform import Waveform, step, switched_off
from hotlever.types import Array
from hotlever.work import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.lever import Lever

#: What the source holds: the bias behind the series resistor, or at the lever itself.
Source = Literal["bias", "voltage", "current", "power"]


@one_blas_thread
def slowest_modes(state: State, source: Source = "bias", count: int = 4) -> tuple[Array, Array]:
    """Return the slowest modes of a state.

    Parameters
    ----------
    state : State
    source : {"bias", "voltage", "current", "power"}
        What is held while the lever changes; `power` needs some.
    count : int

    Returns
    -------
    time_constants : ndarray, shape (count,)
        µs, the slowest first; negative for a mode that grows.
    changes : ndarray, shape (size + 1, count)
        The modes, in the unknowns of the lever's space.

    Raises
    ------
    InputError
        If there is no such source.
    ComputationError
        If they are not found.
    """
    if source not in get_args(Source):
        raise unknown_name("source", source, get_args(Source))
    equations, x = state.lever.in_pulses().equations, state.x
    held = {
        "bias": (1.0, state.lever.circuit.series_kohm),
        "voltage": (1.0, 0.0),
        "current": (0.0, 1.0),
        "power": (state.current_mA, state.lever_V),
    }[source]
    gradient = equations.observed_gradient(x)
    row = held[0] * gradient[..., 0] + held[1] * gradient[..., 1]
    if not np.any(row):
        raise ComputationError("without power nothing is held where the source holds the power")
    factors = InCircuit(equations.factorised(x, LEVER), row)
    # one that is symmetric as the lever is would hold none of the modes that are not
    uneven = np.random.default_rng(0).uniform(-1.0, 1.0, len(x)) / len(x) ** 0.5
    uneven[~equations.space.is_temperature] = 0.0
    times, modes = _modes(equations, x, factors, count, uneven)
    if not equations.heat_in_air.size:
        return times, modes
    return _in_air(equations, x, row, factors, times, modes)


def _modes(
    equations: LeverEquations, x: Array, factors: InCircuit, count: int, begin: Array
) -> tuple[Array, Array]:
    """Return the slowest modes of a lever without what the air takes up.

    Their search begins with a change (size + 1,).
    """

    def relaxed(change: Array) -> Array:
        return factors.solve(equations.storage_change(x, change.reshape(-1, 1)))[:, 0]

    size = len(x)
    operator: Any = LinearOperator((size, size), matvec=relaxed, dtype=float)
    try:
        constants, changes = eigs(operator, count, v0=begin, ncv=2 * count + 1, tol=1e-6)
    except RuntimeError as error:
        raise ComputationError(f"no time constants were found: {error}") from error
    order = np.argsort(-np.abs(constants))
    return constants.real[order], changes.real[:, order]


def _in_air(
    equations: LeverEquations,
    x: Array,
    row: Array,
    factors: InCircuit,
    times: Array,
    modes: Array,
    accuracy: float = 1e-5,
    most: int = 60,
) -> tuple[Array, Array]:
    """Return time constants and modes of a lever with the air, from those without.

    The heat in the air that goes along with the lever depends on how fast it goes: a nonlinear
    eigenvalue problem. All modes are looked for in one space, to which what each of them lacks is
    added (Arnoldi's method; H. Voss, BIT Numer. Math. 44, 387 (2004)): at most so many directions,
    until that is a small share of it.
    """
    air = equations.heat_in_air

    def products(changes: Array) -> tuple[Array, Array]:
        """Return the Jacobian, and the heat capacity of the lever, times changes."""
        lost = equations.balance_change(x, changes[:, None])[:, 0]
        lost[-1] = row[:, 0] @ changes
        return lost, equations.storage_change(x, changes[:, None])[:, 0]

    space = np.linalg.qr(modes)[0]
    lost, stored = products(space)
    constants, found = np.empty_like(times), np.empty_like(modes)
    for mode, last in enumerate(times.tolist()):
        while True:
            rate = 1.0 / abs(last)
            bound = air.bound(rate) if last > 0.0 else air.taken_up(rate) / rate
            together = stored + air.coordinates.T @ (bound @ (air.coordinates @ space))
            values, shares = np.linalg.eig(np.linalg.solve(space.T @ lost, space.T @ together))
            chosen = np.argsort(-np.abs(values))[mode]
            time, share = float(values[chosen].real), shares[:, chosen].real
            lacking = factors.solve((together @ share - time * (lost @ share))[:, None])[:, 0]
            size = np.linalg.norm(lacking) / (abs(time) * np.linalg.norm(share))
            is_steady, last = abs(time / last - 1.0) < 1e-4, time
            if is_steady and size < accuracy:
                break
            if space.shape[1] == most:
                raise ComputationError("no time constants were found in air")
            for _ in range(2):  # once leaves rounding errors
                lacking = lacking - space @ (space.T @ lacking)
            new = (lacking / np.linalg.norm(lacking))[:, None]
            more = new, *products(new)
            space, lost, stored = (
                np.append(each, column, axis=1)
                for each, column in zip((space, lost, stored), more, strict=True)
            )
        constants[mode], found[:, mode] = time, space @ share
    return constants, found


def time_constants(
    lever: Lever, bias: ArrayLike, source: Source = "bias", count: int = 4
) -> xr.Dataset:
    """Return the slowest time constants of a lever at some biases (V).

    Returns
    -------
    xarray.Dataset
        ``time_constant_us`` on the dimensions ``bias`` and ``mode``, and the tip temperature.

    Raises
    ------
    InputError, ComputationError
        See `slowest_modes` and `Lever.solve`.

    Examples
    --------
    >>> from hotlever import Lever, Probe
    >>> lever = Lever(Probe.reference())
    >>> found = time_constants(lever, [1.0, 8.0])
    >>> found.time_constant_us.sel(mode=1).values.round().tolist()
    [21.0, 72.0]
    """
    states = lever.solve(bias)
    constants = np.array([slowest_modes(state, source, count)[0] for state in states])
    return labelled(
        {
            "time_constant_us": (("bias", "mode"), constants),
            "tip_K": [state.tip_K for state in states],
        },
        coordinates={"bias": np.atleast_1d(bias), "mode": np.arange(1, count + 1)},
        source=source,
        lever=lever.probe.title,
    )


def with_times(
    history: xr.Dataset, start: State, end: State, *, resolved: bool = True
) -> xr.Dataset:
    """Return a history with how fast it is, as attributes.

    Parameters
    ----------
    history : xarray.Dataset
    start, end : State
        At its beginning and end.
    resolved : bool
        Whether its times are those of the solver, or as dense.

    Returns
    -------
    xarray.Dataset
        With the slowest ``time_constants_us_at_start`` and ``time_constants_us_at_end``, in the
        circuit; and, of a resolved one, the highest temperature of the tip, when it has that, and
        its mean over the whole time, ``tip_highest_K``, ``tip_highest_at_us`` and ``tip_mean_K``;
        ``heating_us`` and ``cooling_us``: from 10 to 90 % of the way from the colder of its ends to
        its hottest tip, NaN where there is no such time, or no rise.
    """
    attributes: dict[str, Any] = {}
    if resolved and history.time.size > 1:
        time, tip = history.time.values, history.tip_K.values
        low, high = min(tip[0], tip[-1]), tip.max()
        # less than this is no heating: beside it count errors of steps and of a state at rest
        heats = high - low > 1e-4
        attributes["tip_highest_K"], attributes["tip_highest_at_us"] = high, time[tip.argmax()]
        attributes["tip_mean_K"] = np.trapezoid(tip, time) / (time[-1] - time[0])
        attributes["heating_us"], attributes["cooling_us"] = (
            _swing(time, (tip - low) / (high - low)) if heats else (np.nan, np.nan)
        )
    for name, state in (("start", start), ("end", end)):
        with suppress(ComputationError):  # none are known, such as where silicon melts
            attributes[f"time_constants_us_at_{name}"] = slowest_modes(state)[0]
    return history.assign_attrs(attributes)


def _swing(time: Array, share: Array) -> tuple[float, float]:
    """Return how long the first rise from 0.1 to 0.9, and the last fall, take; NaN without one."""

    def rise(time: Array, share: Array) -> float:
        top = int(share.argmax())
        if share[0] > 0.1 or share[top] < 0.9:
            return float("nan")
        early, late = np.interp([0.1, 0.9], np.maximum.accumulate(share), time)
        return float(late - early)

    return rise(time, share), rise(-time[::-1], share[::-1])


def rise_times(lever: Lever, bias: ArrayLike) -> xr.Dataset:
    """Return how long heating and cooling take between 10 and 90 % of the tip's rise.

    The bias is switched on, and, when the lever has come to rest, off; the holder of a chip stays
    cold meanwhile.

    Returns
    -------
    xarray.Dataset
        ``heating_us`` and ``cooling_us``, and the tip temperature at rest, by ``bias`` (V).

    Raises
    ------
    InputError, ComputationError
        See `Lever.solve` and `hotlever.lever.transient.history.integrate`.

    Examples
    --------
    >>> from hotlever import Lever, Probe
    >>> found = rise_times(Lever(Probe.reference()), [4.0])
    >>> found.heating_us.values.round().tolist(), found.cooling_us.values.round().tolist()
    ([50.0], [43.0])
    """
    lever = lever.in_pulses()
    states = lever.solve(bias)
    base, columns = lever.circuit.base_temperature_K, np.empty((3, len(states)))
    for row, state in enumerate(states):
        until = 20.0 * float(slowest_modes(state)[0][0])
        rise = state.tip_K - base

        def shares(waveform: Waveform, until: float = until, rise: float = rise) -> Any:
            history = integrate(lever, waveform, until, per_step=8)
            return history.time.values, (history.tip_K.values - base) / rise

        heating, _ = _swing(*shares(step(state.bias_V)))
        _, cooling = _swing(*shares(switched_off(state.bias_V)))
        columns[:, row] = state.tip_K, heating, cooling
    names = ("tip_K", "heating_us", "cooling_us")
    return labelled(
        dict(zip(names, columns, strict=True)),
        coordinates={"bias": np.atleast_1d(bias)},
        lever=lever.probe.title,
    )
