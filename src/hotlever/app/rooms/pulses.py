"""The lever of the room Simulate in time: a pulse, a train of pulses or a step, followed."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, command_line
from hotlever.app.page import Complaint, Work, figure, number_shown
from hotlever.app.rooms.sliders import in_python, options, stem
from hotlever.app.rooms.written import WritingRoom, outputs
from hotlever.app.session import Session
from hotlever.errors import InputError

_KINDS = {"pulse": "one pulse", "train": "several pulses", "step": "a step that stays"}
#: Fields by name: label, unit, kinds that have it, and what it is at first.
_FIELDS: dict[str, tuple[str, str, tuple[str, ...], float | None]] = {
    "height": ("Height", "V", ("pulse", "train", "step"), 10.0),
    "length": ("Length", "µs", ("pulse", "train"), 5.0),
    "period": ("Period", "µs", ("train",), 20.0),
    "count": ("Pulses", "", ("train",), 5),
    "until": ("Follow until", "µs", ("pulse", "train", "step"), None),
}
_FIGURE = ".svg"
_ALT = "Voltages, current, tip temperature and heat in time"


class Pulses(WritingRoom):
    """What the lever shows in time, as `hotlever pulse` computes it."""

    name = "pulse"

    def __init__(self, session: Session, complaint: Complaint, lever: dict[str, Any]) -> None:
        super().__init__(session, complaint)
        self._lever = lever
        self.chosen |= {key: start for key, (*_, start) in _FIELDS.items()} | self.chosen
        with ui.card().classes("w-full").props("flat bordered"):
            with ui.row().classes("w-full items-center"):
                kind = ui.toggle(_KINDS, value=self.chosen.setdefault("kind", "pulse"))
                kind.props('no-caps dense unelevated aria-label="Wave form"')
                kind.on_value_change(lambda event: self._choose("kind", event.value))
                ui.space()
                ui.button("Follow", icon="timeline", on_click=self.start).props("no-caps")
            with ui.row().classes("w-full items-center"):
                self._fields = {key: self._field(key) for key in _FIELDS}
        Work(session, self.name, self._ended)
        self._result = ui.column().classes("w-full gap-3")
        self.command()
        self._offer()
        self._keep(session.jobs.by_room.get(self.name))
        self._show()

    def _field(self, key: str) -> ui.number:
        label, unit, _, start = _FIELDS[key]
        number = ui.number(label, value=self.chosen[key], min=1 if key == "count" else None)
        number.on_value_change(lambda event: self._choose(key, event.value))
        number.props(f"dense outlined debounce=200 suffix={unit}" if unit else "dense outlined")
        if start is None:
            number.props('clearable stack-label placeholder="its end"')
        return number.classes("w-36")

    def _choose(self, key: str, value: Any) -> None:
        self.chosen[key] = value
        self._offer()
        self.show_command()

    def _offer(self) -> None:
        """Show the fields that the wave form has."""
        for key, field in self._fields.items():
            field.set_visibility(self.chosen["kind"] in _FIELDS[key][2])

    def _values(self) -> dict[str, float]:
        """Return what is set of the wave form.

        Raises
        ------
        InputError
            If something is missing.
        """
        asked = [key for key, (*_, kinds, _) in _FIELDS.items() if self.chosen["kind"] in kinds]
        values = {key: self.chosen[key] for key in asked if self.chosen[key] is not None}
        missing = [key for key in asked if key not in values and _FIELDS[key][3] is not None]
        if missing:
            raise InputError(f"{_FIELDS[missing[0]][0]}: expected a number")
        return values

    def writing(self, kind: str) -> list[str]:
        """Return the command that follows the lever, and writes something of it."""
        values = self._values()
        text = {key: f"{value:.12g}" for key, value in values.items()}
        if self.chosen["kind"] == "step":
            words = ["--step", text["height"]]
        else:
            words = ["--pulse", f"{text['height']}V,{text['length']}us"]
        if "period" in text:
            words += ["--period", f"{text['period']}us", "--count", text["count"]]
        if "until" in text:
            words += ["--until", f"{text['until']}us"]
        words = ["pulse", *options(self._lever), *words]
        return [*words, *outputs(f"{stem(self._lever)}.pulse", kind)]

    def arguments(self) -> list[str]:
        """Return the command that writes table and figure; none while a field is empty."""
        try:
            return self.writing("SVG")
        except InputError:
            return []

    def python(self) -> str:
        """Return the lines of Python that follow the lever."""
        values, form = self._values(), "step" if self.chosen["kind"] == "step" else "pulse"
        wave = [f"{values[key]:.12g}" for key in values if key != "until"]
        until = f", until={values['until']:.12g}" if "until" in values else ""
        return "\n".join(
            [
                "from hotlever import Lever, Probe, simulate",
                f"from hotlever.lever.transient import {form}",
                "",
                f"lever = Lever({in_python(self._lever)})",
                f"history = simulate(lever, {form}({', '.join(wave)}){until})",
            ]
        )

    def start(self) -> bool:
        """Follow the lever."""
        with self.complaint.caught():
            self._values()
            return super().start()
        return False

    async def _ended(self, job: Job) -> None:
        if job.arguments[-1].endswith(_FIGURE):
            self._keep(job)
            self._show()
        else:
            await self.give(job)

    def _keep(self, job: Job | None) -> None:
        """Keep what is to be shown of a job, if it followed the lever."""
        if job is not None and job.arguments[-1].endswith(_FIGURE) and self.written(job):
            words = job.arguments[: job.arguments.index("-o")]
            found = {"numbers": job.shown.get("table", []), "words": words}
            self.chosen["found"] = found | {"file": job.arguments[-1].removesuffix(_FIGURE)}

    def _show(self) -> None:
        """Show what was found last, with the figure that was drawn, and give it."""
        self._result.clear()
        found = self.chosen.get("found")
        if found is None or not self.session.project.stamp(f"{found['file']}{_FIGURE}"):
            return
        path = self.session.project.path(f"{found['file']}{_FIGURE}")

        def ask(kind: str) -> None:
            if kind in ("CSV", "SVG"):
                ui.download.file(path.with_suffix(f".{kind.lower()}"))
            else:
                self.run([*found["words"], *outputs(found["file"], kind)])

        with self._result:
            with ui.row().classes("w-full items-end gap-6"):
                for title, value in found["numbers"]:
                    number_shown(title, title, value)
            figure(path.read_text(encoding="utf-8"), _ALT, wide=True)
            with ui.row().classes("w-full items-center"):
                ui.label(command_line(found["words"])).classes("text-xs opacity-70 remark col")
                self.buttons(ask)
