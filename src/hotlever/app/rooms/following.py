"""A lever that follows sliders: its numbers and plots, quickly while they move, then exactly."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any

from nicegui import background_tasks, ui

from hotlever.app.page import Complaint, number_shown
from hotlever.app.rooms.plots import LivePlots
from hotlever.app.rooms.sliders import LIVE, Sliders
from hotlever.app.session import Session
from hotlever.errors import HotleverError

#: Seconds that sliders rest before the full lever is asked.
_REST_S = 0.35
#: What surrounds a lever: each combination gets a reduced lever of its own.
_AROUND = {"medium", "surface_gap_um"}
_SAID = {
    "full lever": "full lever: the numbers of hotlever sweep",
    "reduced lever": "moving: reduced lever, within some 0.1 K",
    "coarse lever": "moving: coarse lever, within some 2 K",
}
_NUMBERS = {
    "tip_K": ("tip", "{:.1f} K"),
    "current_mA": ("current I_h", "{:.4f} mA"),
    "lever_V": ("lever voltage V_l", "{:.4f} V"),
    "power_mW": ("power P_l", "{:.4f} mW"),
    "reader_V": ("reader V_r", "{:.4f} V"),
}


class Following:
    """What the lever that is chosen shows at the bias that is chosen."""

    def __init__(self, session: Session, complaint: Complaint, chosen: dict[str, Any]) -> None:
        self._session, self._complaint, self._chosen = session, complaint, chosen
        self._wanted: dict[str, Any] | None = None
        self._settled: Any = None
        self._rests = 0
        self._busy = False
        self._free: set[str] = set()
        with ui.row().classes("w-full items-end gap-6"):
            self._shown = {key: number_shown(key, title) for key, (title, _) in _NUMBERS.items()}
            self._knee = number_shown("knee", "knee of the I-V curve")
        self._model = ui.label("starting").classes("text-xs opacity-70").props("aria-live=polite")
        self._notes = ui.label().classes("text-sm remark")
        with ui.column().classes("w-full") as self._around:
            self._plots = LivePlots()

    def follow(self, sliders: Sliders) -> None:
        """Have the lever follow; while it does, only what is wanted last counts."""
        self._free = sliders.free
        self._ask()

    def _ask(self) -> None:
        chosen = self._chosen
        self._wanted = {key: chosen[key] for key in ("probe", "changes", "bias", "most")}
        if not self._busy:
            self._busy = True
            background_tasks.create(self._follow(), name="live lever")

    async def _follow(self) -> None:
        try:
            while self._wanted is not None and not self._model.is_deleted:
                wanted, self._wanted = self._wanted, None
                settled = (wanted["probe"], wanted["changes"]) == self._settled
                await self._show(wanted, quick=not settled)
                if not settled and self._wanted is None:
                    self._rests += 1
                    background_tasks.create(self._settle(wanted, self._rests), name="full lever")
        finally:
            self._busy = False

    async def _settle(self, wanted: dict[str, Any], this: int) -> None:
        """Ask the full lever once sliders have rested; they may move on meanwhile."""
        await asyncio.sleep(_REST_S)
        if this != self._rests or self._wanted is not None or self._model.is_deleted:
            return
        if await self._show(wanted, quick=False):
            self._settled = (wanted["probe"], wanted["changes"])
            background_tasks.create(self._prepare(), name="reduced lever")
            if wanted["bias"] != self._chosen["bias"]:
                self._ask()

    async def _show(self, wanted: dict[str, Any], quick: bool) -> bool:
        desk = self._session.quick if quick else self._session.full
        ask = {"bias": wanted["bias"], "most": wanted["most"], "quick": quick}
        ask["reduced"] = self._session.reduced.get(self._geometry(wanted), False)
        folder, changes = self._session.project.folder, wanted["changes"]
        try:
            answer = await desk.call(f"{LIVE}:answer", folder, wanted["probe"], changes, ask)
        except HotleverError as error:
            if not self._model.is_deleted:
                self._blank()
                self._complaint.say(str(error))
            return False
        if self._model.is_deleted:  # the tab was closed meanwhile
            return False
        if any(wanted[key] != self._chosen[key] for key in ("probe", "changes")) and not quick:
            return False  # parameters have moved on while the full lever was solved
        self._complaint.clear()
        self._around.set_visibility(True)
        now, knee = answer["now"], answer["curves"]["knee"]
        for key, (_, form) in _NUMBERS.items():
            value = now[key]
            self._shown[key].set_text("none" if value != value else form.format(value))
        said = "none" if knee is None else f"{knee['tip_K']:.0f} K, {knee['lever_V']:.3f} V"
        self._knee.set_text(said)
        self._model.set_text(_SAID[answer["model"]])
        self._notes.set_text("; ".join(now["notes"]))
        self._plots.show(answer)
        return True

    def _blank(self) -> None:
        """Show no numbers where there are none: the last ones were of another state."""
        for label in (*self._shown.values(), self._knee):
            label.set_text("–")
        self._model.set_text("no state is shown")
        self._notes.set_text("")
        self._around.set_visibility(False)

    def _geometry(self, wanted: dict[str, Any]) -> Any:
        """Return what a reduced lever belongs to, in what is wanted."""
        kept = {name: value for name, value in wanted["changes"].items() if name not in self._free}
        return wanted["probe"], tuple(sorted(kept.items(), key=str))

    async def _prepare(self) -> None:
        """Have the reduced lever of the geometry made, so that sliders are answered by it."""
        wanted = {"probe": self._chosen["probe"], "changes": dict(self._chosen["changes"])}
        geometry = self._geometry(wanted)
        shape = {name for name, _ in geometry[1]}
        if not self._free or geometry in self._session.reduced or shape - _AROUND:
            return
        folder = self._session.project.folder
        with suppress(HotleverError):
            call = f"{LIVE}:prepare"
            reduced = self._session.reduced
            reduced[geometry] = False
            reduced[geometry] = await self._session.making.call(
                call, folder, wanted["probe"], dict(geometry[1])
            )
