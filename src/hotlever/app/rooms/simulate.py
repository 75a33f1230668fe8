"""Simulate: a slider for the bias and one for each parameter; the lever follows while they move."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from pathlib import Path
from typing import Any

from nicegui import background_tasks, ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, command_shown, framed, two_columns
from hotlever.app.rooms.plots import LivePlots
from hotlever.app.session import Session
from hotlever.errors import HotleverError

_LIVE = "hotlever.app.live"
#: Seconds that sliders rest before the full lever is asked.
_REST_S = 0.35
#: Highest bias of the slider (V), and biases of a sweep that is written.
_MOST_V, _BIASES = 12.0, 49
_REFERENCE = "reference probe"
#: What surrounds a lever: each combination gets a reduced lever of its own.
_AROUND = {"medium", "surface_gap_um"}
_GROUPS = {"material": "Material", "dimensions": "Dimensions", "circuit": "Circuit"}
_SAID = {
    "full lever": "full lever: the numbers of hotlever sweep",
    "reduced lever": "moving: reduced lever, within some 0.1 K",
    "coarse lever": "moving: coarse lever, within some 2 K",
}


async def fill(session: Session) -> None:
    """Fill the page."""
    with framed(session, "/simulate") as complaint:
        room = _Room(session, complaint)
    await room.open()


class _Room:
    """One tab of the room."""

    def __init__(self, session: Session, complaint: Complaint) -> None:
        self._session, self._complaint = session, complaint
        self._chosen = session.chosen.setdefault(
            "simulate", {"probe": None, "changes": {}, "bias": 8.0, "most": _MOST_V}
        )
        self._wanted: dict[str, Any] | None = None
        self._settled: Any = None
        self._rests = 0
        self._busy = False
        self._free: set[str] = set()
        self._last_command: list[str] = []
        with two_columns() as (left, right):
            with left:
                self._controls()
            with right:
                self._numbers()
                self._plots = LivePlots()
                self._downloads()

    # --- what is on the page ----------------------------------------------------------------------

    def _controls(self) -> None:
        names = {"": _REFERENCE} | {name: name for name in self._session.project.probes}
        chosen = self._chosen["probe"] or ""
        ui.select(
            names,
            label="Probe",
            value=chosen if chosen in names else "",
            on_change=lambda event: self._take_probe(event.value or None),
        ).classes("w-full").props("dense outlined")
        with ui.row().classes("items-center w-full no-wrap"):
            ui.label("in")
            medium = self._chosen["changes"].get("medium", "vacuum")
            self._medium = ui.toggle(
                ["vacuum", "air"],
                value=medium,
                on_change=lambda event: self._change("medium", event.value),
            ).props("no-caps dense unelevated")
            self._gap = ui.number(
                "surface (µm)",
                min=0.01,
                max=1e4,
                on_change=lambda event: self._change("surface_gap_um", event.value),
            ).props("dense outlined clearable placeholder=none stack-label")
            self._gap.bind_visibility_from(self._medium, "value", value="air")
        with ui.column().classes("w-full gap-0"):
            with ui.row().classes("w-full items-center no-wrap justify-between"):
                ui.label("Bias V_b").classes("text-bold")
                self._bias_number = ui.number(format="%.3f", min=0.0, step=0.05).props(
                    'dense outlined suffix=V aria-label="Bias in volts"'
                )
                self._bias_number.classes("w-28")
            self._bias = ui.slider(
                min=0.0, max=self._chosen["most"], step=0.01, value=self._chosen["bias"]
            ).props('aria-label="Bias"')
            self._bias_number.bind_value(self._bias)
            self._bias.on_value_change(lambda event: self._move_bias(event.value))
        self._sliders = ui.column().classes("w-full gap-1")

    def _numbers(self) -> None:
        with ui.row().classes("w-full items-end gap-6"):
            self._shown = {}
            for key, title in (
                ("tip_K", "tip"),
                ("current_mA", "current I_h"),
                ("lever_V", "lever voltage V_l"),
                ("power_mW", "power P_l"),
                ("reader_V", "reader V_r"),
                ("knee", "knee of the I-V curve"),
            ):
                with ui.column().classes("gap-0"):
                    ui.label(title).classes("text-xs opacity-70")
                    self._shown[key] = ui.label("…").classes("number")
                    self._shown[key].props(f"data-number={key}")
        self._model = ui.label("starting").classes("text-xs opacity-70").props("aria-live=polite")
        self._notes = ui.label().classes("text-sm remark")

    def _downloads(self) -> None:
        with ui.card().classes("w-full").props("flat bordered"):
            ui.label("Take it with you").classes("text-bold")
            with ui.row().classes("items-center"):
                for kind in ("CSV", "NetCDF", "SVG", "PNG", "PDF"):
                    ui.button(kind, on_click=lambda _, to=kind: self._write(to)).props(
                        "outline dense no-caps"
                    ).classes("q-px-sm")
            self._work = Work(self._session, "simulate", self._written)
            self._command = ui.column().classes("w-full gap-0")

    async def open(self) -> None:
        """Ask for the sliders of the probe, and for the first state."""
        try:
            found = await self._session.full.call(
                f"{_LIVE}:described", self._session.project.folder, self._chosen["probe"]
            )
        except HotleverError as error:
            self._complaint.say(str(error))
            return
        if "medium" not in self._chosen["changes"]:
            self._medium.set_value(found["medium"])
        if found["gap_um"] is not None and "surface_gap_um" not in self._chosen["changes"]:
            self._gap.set_value(found["gap_um"])
        self._sliders.clear()
        with self._sliders:
            for group, title in _GROUPS.items():
                with (
                    ui.expansion(title, value=group == "material")
                    .classes("w-full")
                    .props("dense dense-toggle header-class=text-bold")
                ):
                    for slider in found["sliders"]:
                        if slider[0] == group:
                            self._slider(*slider[1:])
            ui.button("All as in the probe file", on_click=self._reset).props(
                "flat dense no-caps icon=restart_alt"
            )
        of_material = [slider[1] for slider in found["sliders"] if slider[0] == "material"]
        self._free = {*of_material, "series_resistance_ohm"} if found["reduced"] else set()
        self._ask()

    def _slider(
        self, name: str, value: float, low: float, high: float, unit: str, meaning: str
    ) -> None:
        """Show the slider of a parameter, and its number."""
        now = self._chosen["changes"].get(name, value)
        unit = "" if unit == "1" else unit
        with ui.column().classes("w-full gap-0"):
            with ui.row().classes("w-full items-center no-wrap justify-between"):
                ui.label(name).classes("text-sm").tooltip(meaning)
                number = ui.number(format="%.4g").classes("w-36")
                number.props(f'dense borderless suffix="{unit}" input-class=text-right')
                number.props(f'aria-label="{name}, {meaning}"')
            slider = ui.slider(min=low, max=high, step=(high - low) / 400, value=now)
            slider.props(f'dense aria-label="{meaning}"')
            number.bind_value(slider)
            slider.on_value_change(lambda event: self._change(name, event.value, value))

    # --- what moves -------------------------------------------------------------------------------

    async def _take_probe(self, name: str | None) -> None:
        self._chosen |= {"probe": name, "changes": {}}
        self._settled = None
        await self.open()

    async def _reset(self) -> None:
        self._chosen["changes"] = {}
        await self.open()

    def _move_bias(self, value: float | None) -> None:
        if value is not None:
            self._chosen["bias"] = float(value)
            self._ask()

    def _change(self, name: str, value: Any, of_probe: Any = None) -> None:
        if value is None and name != "surface_gap_um":
            return
        changes = dict(self._chosen["changes"])
        if value == of_probe:
            changes.pop(name, None)
        else:
            changes[name] = value
        self._chosen["changes"] = changes
        self._ask()

    def _ask(self) -> None:
        """Have the lever follow; while it does, only what is wanted last counts."""
        chosen = self._chosen
        self._wanted = {key: chosen[key] for key in ("probe", "changes", "bias", "most")}
        if not self._busy:
            self._busy = True
            background_tasks.create(self._follow(), name="live lever")

    async def _follow(self) -> None:
        try:
            while self._wanted is not None and not self._bias.is_deleted:
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
        if this != self._rests or self._wanted is not None or self._bias.is_deleted:
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
            answer = await desk.call(f"{_LIVE}:answer", folder, wanted["probe"], changes, ask)
        except HotleverError as error:
            if not self._bias.is_deleted:
                self._complaint.say(str(error))
            return False
        if self._bias.is_deleted:  # the tab was closed meanwhile
            return False
        if any(wanted[key] != self._chosen[key] for key in ("probe", "changes")) and not quick:
            return False  # parameters have moved on while the full lever was solved
        self._complaint.clear()
        now, knee = answer["now"], answer["curves"]["knee"]
        for key, form in (
            ("tip_K", "{:.1f} K"),
            ("current_mA", "{:.4f} mA"),
            ("lever_V", "{:.4f} V"),
            ("power_mW", "{:.4f} mW"),
            ("reader_V", "{:.4f} V"),
        ):
            value = now[key]
            self._shown[key].set_text("none" if value != value else form.format(value))
        self._shown["knee"].set_text(
            "none" if knee is None else f"{knee['tip_K']:.0f} K, {knee['lever_V']:.3f} V"
        )
        self._model.set_text(_SAID[answer["model"]])
        self._notes.set_text("; ".join(now["notes"]))
        self._plots.show(answer)
        self._show_command()
        return True

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
            call = f"{_LIVE}:prepare"
            reduced = self._session.reduced
            reduced[geometry] = False
            reduced[geometry] = await self._session.making.call(
                call, folder, wanted["probe"], dict(geometry[1])
            )

    # --- what leaves ------------------------------------------------------------------------------

    def _arguments(self, kind: str = "CSV") -> list[str]:
        """Return the command that writes a sweep of what is shown."""
        chosen = self._chosen
        stem = Path(chosen["probe"] or "reference.toml").stem
        arguments = ["sweep", *([named(chosen["probe"])] if chosen["probe"] else [])]
        arguments += ["--bias", f"0:{chosen['most']:g}:{_BIASES}"]
        for name, value in sorted(chosen["changes"].items()):
            text = "none" if value is None else f"{value!r}" if value != str(value) else value
            arguments += ["--medium", text] if name == "medium" else ["--set", f"{name}={text}"]
        if kind in ("CSV", "NetCDF"):
            return [*arguments, "-o", f"{stem}.sweep.{'csv' if kind == 'CSV' else 'nc'}"]
        return [*arguments, "-o", f"{stem}.sweep.csv", "--plot", f"{stem}.sweep.{kind.lower()}"]

    def _show_command(self) -> None:
        arguments = self._arguments()
        if self._last_command != arguments:
            self._last_command = arguments
            self._command.clear()
            with self._command:
                command_shown(arguments, str(self._session.project.folder))

    def _write(self, kind: str) -> None:
        with self._complaint.caught():
            self._session.jobs.start("simulate", self._arguments(kind))

    async def _written(self, job: Job) -> None:
        if job.standing == "done" or job.message.startswith("silicon"):
            ui.download.file(self._session.project.path(job.arguments[-1]))
