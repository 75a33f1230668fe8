"""A lever that a PI controller brings from one resistance to another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from hotlever.errors import InputError, shown
from hotlever.lever import Lever, State
from hotlever.lever.set_points import hold
from hotlever.lever.transient import Controller
from hotlever.lever.transient.closed_loop import FASTEST, ClosedLoop
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import PulseRequest
from hotlever.tasks.texts import parse_number
from hotlever.units import bias_setting, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Highest bias, where none is given, over that at rest.
_LIMIT = 1.5
#: Most error of a step (K), and the same as a share of the way of the tip.
_TOLERANCE_K, _SHARE, _LEAST_TOLERANCE_K = 0.1, 2e-3, 1e-4
#: Time constants of the closed loop that are simulated if nobody says, and the longest time (µs).
_CONSTANTS, _LONGEST = 10.0, 1e4


@dataclass(frozen=True)
class Control:
    """What brings a lever from one resistance to another.

    Attributes
    ----------
    controller : Controller
    start, end : State
        At rest before and after.
    loop : ClosedLoop
        At the end, where it is stable.
    """

    controller: Controller
    start: State
    end: State
    loop: ClosedLoop

    @property
    def settling(self) -> tuple[float, float]:
        """Time constant (µs) and damping of the closed loop at the end."""
        law = self.controller
        return self.loop.settling(law.proportional, law.integral, law.filter_us)

    @property
    def usual_end(self) -> float:
        """Time (µs) that is simulated if nobody says."""
        return min(_CONSTANTS * self.settling[0], _LONGEST)

    @property
    def tolerance_K(self) -> float:
        """Largest error of a step in time (K)."""
        way = _SHARE * abs(self.end.tip_K - self.start.tip_K)
        return max(min(_TOLERANCE_K, way), _LEAST_TOLERANCE_K)

    def gain_map(self, figures: Any) -> Figure:
        """Draw which gains of this sign are stable."""
        law = self.controller
        data = self.loop.gain_map(float(np.sign(law.integral)), law.filter_us)
        made: Figure = figures.gain_map(data, (law.proportional, law.integral))
        return made

    def notes(self, history: xr.Dataset) -> list[str]:
        """Say that the lever is not held at the end, if its bias is at the limit."""
        if history.bias_V.values[-1] < (1.0 - 1e-6) * self.controller.limit_V:
            return []
        return [
            f"at the end the bias is at its limit of {self.controller.limit_V:.4g} V, and nothing "
            "is held: beyond a highest resistance a lever only gets hotter with these gains"
        ]

    def rows(self, history: xr.Dataset, *, resolved: bool) -> list[list[str]]:
        """Return rows that say what the controller does: of a resolved history its overshoot."""
        time, ratio = self.settling
        way, tip = self.end.tip_K - self.start.tip_K, history.tip_K.values
        over = float(np.max(np.sign(way) * (tip - self.end.tip_K)))
        told = f"{over:.2g} K ({over / abs(way):.0%} of the step)" if over > 0.0 else "none"
        return [
            ["tip, at rest before and after", f"{self.start.tip_K:.1f} K, {self.end.tip_K:.1f} K"],
            *([["tip, overshoot", told]] if resolved else []),
            ["tip, at the end", f"{tip[-1]:.1f} K at {history.time[-1].item():.4g} µs"],
            ["closed loop", f"time constant {time:.3g} µs, damping ratio {ratio:.2g}"],
        ]


def control(reporter: Reporter, lever: Lever, request: PulseRequest) -> Control:
    """Return the controller that is asked for, at the state where it begins.

    Its gains choose the states: above zero those where the resistance rises with the tip
    temperature, below zero those where it falls.

    Raises
    ------
    InputError
        If a resistance has no state that gains of this sign hold, or the loop is not stable.
    """
    proportional, integral = _gains(request)
    resistances = [_resistance(request.hold_resistance, "--hold-resistance")]
    resistances.append(_resistance(request.step, "--step"))
    start, end = _states(lever, resistances, integral)
    at_rest = max(start.bias_V, end.bias_V)
    limit = _LIMIT * at_rest if request.limit is None else bias_setting(request.limit, "--limit")
    filter_us = setting(request.filter, "us", "--filter")
    try:
        law = Controller(
            resistances[1], proportional, integral, start.bias_V, limit, filter_us=filter_us
        )
    except InputError as error:
        raise InputError(f"--controller: {error}") from None
    if limit < at_rest:
        reporter.note(
            f"{resistances[1]:.5g} ohm takes a bias of {end.bias_V:.4g} V, which is above the "
            f"limit of {limit:.4g} V"
        )
    loop = ClosedLoop.at(end)
    _check_stable(loop, law)
    return Control(law, start, end, loop)


def _check_stable(loop: ClosedLoop, law: Controller) -> None:
    """Refuse gains with which what is off grows, or rings faster than anything is known of."""
    P, per_ms = law.proportional, law.integral
    poles, _ = loop.closed(P, per_ms, law.filter_us)
    if (growth := float(poles.real.max())) >= 0.0:
        why = f"is not stable: what is off grows by e in {1.0 / max(growth, 1e-300):.3g} µs"
    elif np.abs(poles.imag).max() > FASTEST:
        why = "rings faster than the lever's answer is known, 100 MHz"
    else:
        return
    better = loop.stable_gains(float(np.sign(per_ms)), law.filter_us)
    expected = "others" if better is None else "stable ones such as {:.2g},{:.2g}".format(*better)
    raise InputError(
        f"--controller: with gains of {P:g},{per_ms:g} the loop at {law.set_ohm:.5g} ohm {why}; "
        f"expected {expected} (--gain-map draws them all)"
    )


def check_control(request: PulseRequest) -> bool:
    """Return whether a controller is asked for, and refuse what does not go with it, or alone."""
    needed = {"--hold-resistance": request.hold_resistance, "--step": request.step}
    if request.controller is None:
        names = "limit", "gain_map", "hold_resistance", "filter"
        request.refuse(names, "goes with --controller P,I")
        return False
    for name in request.drive:
        if name != "--step":
            raise InputError(
                f"{name}: does not go with --controller, expected --step, such as 3kohm"
            )
    for name, value in needed.items():
        if value is None:
            raise InputError(f"--controller: goes with {name} and a resistance, such as 3kohm")
    return True


def _gains(request: PulseRequest) -> tuple[float, float]:
    text = request.controller or ""
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(
            f"--controller: found '{shown(text)}', expected P,I in V/kohm and V/(kohm ms), such as "
            "1,30"
        )
    P, per_ms = (parse_number(part, "--controller") for part in parts)
    return P, per_ms


def _resistance(text: str | None, where: str) -> float:
    return setting(text or "", "ohm", where)


def _states(lever: Lever, resistances: list[float], integral: float) -> tuple[State, State]:
    """Return the states at both resistances that an integral of some sign leads to."""
    try:
        held_states = hold(lever, "resistance", resistances)
    except InputError as error:
        raise InputError(f"--controller: {error}") from None
    chosen: list[State] = []
    for value in resistances:
        here = np.flatnonzero(held_states.data.set_ohm.values == value)
        rises = held_states.data.slope_ohm_per_K.values[here] > 0.0
        held = [held_states.states[k] for k in here[rises == (integral > 0.0)].tolist()]
        if not held:
            tips = ", ".join(f"{held_states.states[k].tip_K:.0f} K" for k in here.tolist())
            other = ("rises", "above") if integral < 0.0 else ("falls", "below")
            raise InputError(
                f"--controller: found I = {integral:g}, expected gains {other[1]} 0: at "
                f"{value:g} ohm (tip at {tips}) the resistance {other[0]} with the temperature"
            )
        before = chosen[0].tip_K if chosen else 0.0
        chosen.append(min(held, key=lambda state: abs(state.tip_K - before)))
    start, end = chosen
    return start, end
