"""What sliders share: how one looks, and how what is shown follows them."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import background_tasks, ui

#: Seconds that sliders rest before what follows is asked in full.
_REST_S = 0.35
#: Steps of a slider.
_STEPS = 400


def slider(
    words: str,
    value: float,
    low: float,
    high: float,
    unit: str = "",
    hint: str = "",
    *,
    by_decades: bool = False,
    from_zero: bool = False,
) -> ui.number:
    """Show a slider with its number, which is returned, and may be beyond the slider's ends.

    `by_decades` it is even in the logarithm; `from_zero` its lowest position is then 0.
    """
    ends = (math.log10(low), math.log10(high)) if by_decades else (low, high)

    def position(value: float | None) -> float:
        if not by_decades:
            return ends[0] if value is None else value
        return math.log10(max(value or low, low))

    def number_at(position: float) -> float:
        if not by_decades:
            return position
        return 0.0 if from_zero and position <= ends[0] else float(f"{10.0**position:.3g}")

    with ui.column().classes("w-full gap-0"):
        with ui.row().classes("w-full items-center no-wrap justify-between"):
            name = ui.label(words).classes("text-sm remark")
            if hint:
                name.tooltip(hint)
            number = ui.number(value=value, format="%.4g").classes("w-36 shrink-0")
            number.props(remove="outlined").props(f'aria-label="{words}"')
            number.props(f'borderless suffix="{unit}" input-class=text-right')
        step = (ends[1] - ends[0]) / _STEPS
        bar = ui.slider(min=ends[0], max=ends[1], step=step, value=position(value))
        bar.props(f'dense aria-label="{words}"')

    # each follows the other unless it is there already: what is typed has more digits than places
    def typed() -> None:
        if number.value != number_at(bar.value):
            bar.set_value(position(number.value))

    def slid() -> None:
        if bar.value != position(number.value):
            number.set_value(number_at(bar.value))

    number.on_value_change(typed)
    bar.on_value_change(slid)
    return number


class Follower:
    """Has what is shown follow sliders: quickly while they move, in full when they rest.

    Parameters
    ----------
    element : ui.element
        Of the page; when it is gone nothing follows any more.
    show : callable
        Shows a state of a lever, quickly or in full, and returns whether it did.
    rested : callable, optional
        Called when a lever has been shown in full.
    """

    def __init__(
        self,
        element: ui.element,
        show: Callable[[Any, Any, bool], Awaitable[bool]],
        rested: Callable[[], Awaitable[None]] | None = None,
    ) -> None:
        self._element, self._show, self._rested = element, show, rested
        self._wanted: tuple[Any, Any] | None = None
        self._last: tuple[Any, Any] | None = None
        self._settled: Any = None
        self._rests = 0
        self._busy = False

    def follow(self, lever: Any, at: Any) -> None:
        """Have a state of a lever shown; only what is wanted last counts."""
        self._wanted = self._last = lever, at
        if not self._busy:
            self._busy = True
            background_tasks.create(self._follow(), name="live lever")

    def is_wanted(self, lever: Any) -> bool:
        """Return whether this is still the lever that is wanted."""
        return self._last is not None and self._last[0] == lever

    async def _follow(self) -> None:
        try:
            while self._wanted is not None and not self._element.is_deleted:
                (lever, at), self._wanted = self._wanted, None
                settled = lever == self._settled
                await self._show(lever, at, not settled)
                if not settled and self._wanted is None:
                    self._rests += 1
                    background_tasks.create(self._settle(lever, at, self._rests), name="full lever")
        finally:
            self._busy = False

    async def _settle(self, lever: Any, at: Any, turn: int) -> None:
        """Ask for all once sliders have rested; they may move on meanwhile."""
        await asyncio.sleep(_REST_S)
        if turn != self._rests or self._wanted is not None or self._element.is_deleted:
            return
        if await self._show(lever, at, False):
            self._settled = lever
            if self._rested is not None:
                background_tasks.create(self._rested(), name="reduced lever")
            if self._last is not None and self._last != (lever, at):
                self.follow(*self._last)
