"""A second lever in the plots of the page Simulate: another probe or medium, or as it was."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.pages.drawn import sweep_of
from hotlever.app.pages.live_page import texts_of
from hotlever.app.pages.page import Page
from hotlever.app.pages.plots import LivePlots
from hotlever.errors import HotleverError

#: Numbers of a state, as `hotlever.app.pages.live_page.LivePage` shows them.
NUMBERS = {
    "tip_K": ("tip", "{:.1f} K", 1.0),
    "current_mA": ("current I_h", "{:.4f} mA", 1.0),
    "lever_V": ("lever voltage V_l", "{:.4f} V", 1.0),
    "power_mW": ("power P_l", "{:.4f} mW", 1.0),
    "reader_V": ("reader V_r", "{:.4f} V", 1.0),
}
_NONE, NOW, _PROBE = "", "now", "probe:"
_OPTIONS = {
    _NONE: "nothing",
    "vacuum": "the same in vacuum",
    "air": "the same in air",
    NOW: "the lever as it is now",
}


def options_beside(probes: Iterable[str]) -> dict[str, str]:
    """Return which levers may be shown beside the one that is chosen, in words."""
    return {**_OPTIONS, _PROBE: "reference probe", **{f"{_PROBE}{name}": name for name in probes}}


def lever_beside(chosen: dict[str, Any]) -> dict[str, Any] | None:
    """Return the probe and the changes of the lever beside that of the page; None if there is none.

    Examples
    --------
    >>> lever_beside({"beside": "air", "probe": None, "changes": {"n_d": 5e17}})
    {'probe': None, 'changes': {'n_d': 5e+17, 'medium': 'air'}}
    """
    beside = chosen["beside"]
    if beside == _NONE:
        return None
    if beside == NOW:
        return dict(chosen["kept"])
    if beside.startswith(_PROBE):
        return {"probe": beside.removeprefix(_PROBE) or None, "changes": {}}
    return {"probe": chosen["probe"], "changes": {**chosen["changes"], "medium": beside}}


def beside_in_words(chosen: dict[str, Any]) -> str:
    """Return what the lever beside is called."""
    if chosen["beside"] == NOW:
        kept = chosen["kept"]
        changes = ", ".join(f"{name} = {value}" for name, value in kept["changes"].items())
        name = Path(kept["probe"] or "reference probe").stem
        return f"{name} with {changes}" if changes else name
    name = chosen["beside"].removeprefix(_PROBE)
    return _OPTIONS.get(chosen["beside"]) or Path(name or "reference probe").stem


class PlotsWithBeside(LivePlots):
    """The plots of the page Simulate, with what the lever beside shows, once the other rests."""

    def __init__(self, page: Page) -> None:
        self._session, self._chosen = page.session, page.chosen
        self._text = ui.label().classes("text-sm remark").props("data-number=beside")
        super().__init__()

    async def show_beside(self, at: list[float], quick: bool) -> None:
        """Show the lever beside in a state; none beside a quick answer."""
        lever, answer, text = lever_beside(self._chosen), None, ""
        if lever is not None and not quick:
            text = f"Dashed: {beside_in_words(self._chosen)}"
            try:
                asked = sweep_of(lever), *at, False
                answer = await self._session.ask("beside", "live:answer", *asked)
                texts = texts_of(answer["now"], NUMBERS)
                text += ": " + ", ".join(f"{NUMBERS[key][0]} {texts[key]}" for key in texts)
            except HotleverError as error:
                text = f"{text}: {error}"
            if self._text.is_deleted or lever != lever_beside(self._chosen):
                return
        self._text.set_text(text)
        self.beside(answer)
