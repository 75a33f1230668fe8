"""Lever: a probe file or a drawing as fields, with its picture while they are set."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app import probe_fields
from hotlever.app.pages.frame import (
    ErrorBanner,
    caption,
    drop_zone,
    figure,
    flat_button,
    hand_over,
    opened_dialog,
    small_button,
    table,
    two_columns,
)
from hotlever.app.pages.task_page import JobView, TaskPage
from hotlever.app.probe_fields import (
    ROLES,
    LayerRow,
    Sections,
    has_section,
    typed,
    with_layer,
    with_material_renamed,
    with_value,
)
from hotlever.app.project import DATA, DRAWINGS, safe_name
from hotlever.app.session import Job, Session, Task
from hotlever.errors import HotleverError, InputError
from hotlever.files import FIGURE_TYPES


class LeverPage(TaskPage):
    """One tab of the page."""

    name = "lever"
    #: Of each probe file that was edited and not saved its sections, and the probe file that a
    #: drawing is to become.
    first: ClassVar = {"edited": {}, "awaited": "", "mesh": False}

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self._sections: Sections = {}
        self._turn = 0
        self._opened_for: str | None = None
        with two_columns("live") as (left, right):
            with left:
                drop_zone(
                    session,
                    banner,
                    "Drop a drawing here (GDSII, OASIS, DXF) or a probe file, and tables of "
                    "materials",
                    self._dropped,
                )
                self.lever_choice()
                self._drawings = ui.select([], label="Propose a probe for the drawing")
                self._drawings.classes("w-full").on_value_change(self._drawing_chosen)
                small_button("New: two legs (U)", self._take_u_shape)
                self._fields = ProbeFields(self, self._edit)
            with right:
                JobView(session, self.name, self._proposed)
                mesh = ui.switch("mesh", value=self.chosen["mesh"], on_change=self._set_mesh)
                mesh.tooltip("The triangles that the lever is solved on")
                self._picture = ui.column().classes("w-full gap-1")
                self._holds = ui.expansion("What the drawing holds")
                self._holds.set_visibility(False)
                with ui.column().classes("w-full gap-3 last"):
                    self._show_saving()
        self._offer_drawings()

    def _show_saving(self) -> None:
        """Ask what to save the probe as, where to go on with it, and what to have of it."""
        with ui.row().classes("items-center w-full"):
            self._name = ui.input("Save as", on_change=self.show_command)
            ui.button("Save", icon="save", on_click=self._save)
            for page, icon in {"simulate": "tune", "measurements": "query_stats"}.items():
                go = ui.button(page.capitalize(), icon=icon)
                go.props("outline").on_click(partial(self._go_on, page))
            for suffix in FIGURE_TYPES:
                flat_button(suffix[1:].upper(), partial(self._give, suffix))
        caption(
            "What is set is saved as a new file; comments of the file that was opened are not "
            "in it. Other pages take the lever as its file says."
        )
        self._edited = ui.label().classes("remark").props("role=status")
        self.command()

    async def open(self) -> None:
        """Show the lever; the one of a drawing, if that was awaited and is there."""
        awaited = self.chosen["awaited"]
        if awaited and not self.session.jobs.running(self.name):
            self._take(awaited)
        await self._show_lever()

    async def changed(self) -> None:
        """Show another lever."""
        await self._show_lever()

    async def _set_mesh(self, event: Any) -> None:
        self.chosen["mesh"] = event.value
        await self._draw()

    # --- the lever --------------------------------------------------------------------------------

    async def _show_lever(self) -> None:
        """Open the lever that is chosen, with what was set in it and not saved."""
        probe, self._sections = self.probe, {}
        if probe != self._opened_for:
            self._opened_for = probe
            self._name.set_value(f"{self.session.project.free(self.stem, '.toml')}.toml")
            self._picture.clear()
            self._fields.clear()
            self._show_drawing()
        with self.banner.caught():
            edited = self.chosen["edited"].get(probe)
            sections = edited or await self.session.ask("quick", probe_fields.opened, probe)
            if probe == self.probe:
                self._sections = sections
                await self._draw()
            return

    def _show_drawing(self) -> None:
        """Show what the drawing holds that the lever was proposed for, whoever asked for it."""
        jobs = [job for job in self.session.jobs.of(self.name) if job.standing == "done"]
        job = next((job for job in jobs if job.task.options["output"] == self.probe), None)
        self._holds.clear()
        self._holds.set_visibility(False)
        if job is None or not (plot := job.task.options.get("plot")):
            return
        outlines = self.session.project.path(plot)
        if not outlines.is_file():  # it is the user's to delete
            return
        self._holds.set_visibility(True)
        with self._holds:
            ui.label(job.contents["result"]).classes("lines")
            drawn = outlines.read_text(encoding="utf-8")
            figure(drawn, "All outlines of the drawing, by layer")

    async def _edit(self, sections: Sections) -> None:
        """Take sections in which something was set."""
        self._sections = self.chosen["edited"][self.probe] = sections
        await self._draw()

    async def _draw(self) -> None:
        """Draw what is open, and show its fields; only what was asked for last counts."""
        self._turn += 1
        turn, drawn, sections = self._turn, None, self._sections
        own = (self._name.value if self._is_edited else self.probe) or "lever"
        title, mesh = own, self.chosen["mesh"]
        try:
            request = probe_fields.drawn, sections, title, mesh
            drawn = await self.session.ask("quick", *request)
            fault = drawn["fault"]
        except HotleverError as error:
            fault = str(error)
        if turn != self._turn or self._picture.is_deleted:
            return
        self.banner.say(fault)
        self._picture.clear()
        if drawn is not None:  # there is no picture of what cannot be drawn
            with self._picture:
                figure(
                    drawn["figure"], "The lever from above: regions, terminals and tip", wide=True
                )
                if not fault:
                    table(("region", "part", "area"), drawn["rows"])
                    if mesh:
                        caption(f"mesh: {drawn['triangles']} triangles")
        words = "Something is set that is not saved." if self._is_edited else ""
        self._edited.set_text(words)
        self.show_command()
        await self._fields.show(sections, fault)

    @property
    def _is_edited(self) -> bool:
        return self.probe in self.chosen["edited"]

    def task(self) -> Task:
        """Return the command that draws the probe, as it is or as it will be saved."""
        name = self._name.value if self._is_edited else self.probe
        options = {"mesh": self.chosen["mesh"]}
        stem = self.session.project.free(Path(name or "reference").stem, ".svg")
        return Task("probe show", (name,) if name else (), {**options, "plot": f"{stem}.svg"})

    # --- files ------------------------------------------------------------------------------------

    def _offer_drawings(self) -> None:
        drawings = self.session.project.drawings
        self._drawings.set_options(drawings, value=None)
        self._drawings.set_visibility(bool(drawings))

    async def _dropped(self, names: list[str]) -> None:
        self._offer_drawings()
        known = [name for name in names if name.lower().endswith((".toml", *DRAWINGS))]
        if known and known[-1].lower().endswith(".toml"):
            self._take(known[-1])
        elif known:
            self._propose(known[-1])
        elif names[-1].lower().endswith(DATA):
            await self._draw()
            self.banner.say(f"{names[-1]}: kept in the folder; a material's property may name it")
        else:
            raise InputError(
                f"{names[-1]}: unknown type of file, expected a probe file or a drawing"
            )

    def _take(self, name: str) -> None:
        """Have another lever, on all pages."""
        self.chosen["awaited"] = ""
        self.session.choose_lever(name)

    def _drawing_chosen(self, event: Any) -> None:
        if event.value:
            self._propose(event.value)
            self._drawings.set_value(None)

    def _propose(self, drawing: str) -> None:
        """Have a probe file proposed for a drawing, which is then the lever."""
        if self.run(proposal(self.session, drawing)):
            self.chosen["awaited"] = self.session.jobs.of(self.name)[0].task.options["output"]

    async def _proposed(self, job: Job) -> None:
        """Show what was proposed, if nothing else was chosen meanwhile."""
        name = job.task.options["output"]
        if job.standing != "done":
            return
        if self.chosen["awaited"] != name:
            ui.notify(f"{name} is written")
            return
        self._take(name)

    def _take_u_shape(self) -> None:
        """Write the probe file of a lever of two legs, and have it be the lever."""
        name = f"{self.session.project.free('u-shape', '.toml')}.toml"
        self.chosen["awaited"] = name
        self.run(Task("probe new", (), {"shape": "u-shape", "output": name}))

    async def _save(self) -> bool:
        """Write what is set as a new probe file, which is then the lever; return whether it is."""
        if not self._is_edited:
            return True
        with self.banner.caught():
            name = safe_name(self._name.value or "")
            name = name if name.endswith(".toml") else f"{name}.toml"
            text = await self.session.ask("quick", probe_fields.written, self._sections, name)
            self.session.project.write(name, text)
            del self.chosen["edited"][self.probe]
            self._take(name)
            ui.notify(f"{name} is written", type="positive")
            return True
        return False

    async def _go_on(self, page: str) -> None:
        """Go on with the probe on another page."""
        if await self._save():
            ui.navigate.to(f"/{page}")

    async def _give(self, suffix: str) -> None:
        with self.banner.caught():
            name, mesh = self._name.value or "lever", self.chosen["mesh"]
            request = probe_fields.drawn_file, self._sections, name, mesh, suffix
            await hand_over(self.session.ask("quick", *request), f"{Path(name).stem}{suffix}")


def proposal(session: Session, drawing: str) -> Task:
    """Return the task that proposes a probe file for a drawing."""
    stem = session.project.free(Path(drawing).stem, ".toml", ".svg")
    return Task("probe import", (drawing,), {"output": f"{stem}.toml", "plot": f"{stem}.svg"})


class ProbeFields:
    """What can be set in the probe that is open; `edited` is told its sections with it set."""

    def __init__(self, page: TaskPage, edited: Callable[[Sections], Awaitable[None]]) -> None:
        self._session, self._banner, self._edited = page.session, page.banner, edited
        self._sections: Sections = {}
        self._turn = 0
        self._built: Any = None
        self._inputs: dict[tuple[tuple[str, ...], str], ui.input] = {}
        self._cards: dict[tuple[str, ...], ui.element] = {}
        self._column = ui.column().classes("w-full gap-1")

    def clear(self) -> None:
        """Show nothing, nor what is still asked for."""
        self._turn += 1
        self._built, self._inputs = None, {}
        self._column.clear()

    async def show(self, sections: Sections, fault: str) -> None:
        """Show what can be set in some sections, and what is wrong; nothing if nothing is open."""
        self._turn += 1
        turn, is_own = self._turn, sections is self._sections
        self._sections = sections
        settable = await self._session.ask("quick", probe_fields.settable, sections)
        if turn != self._turn or self._column.is_deleted:
            return
        cards, rows = settable.get("cards", []), settable.get("layers", [])
        built = rows, [(card["place"], card["title"]) for card in cards]
        # fields in which somebody types stay
        if not is_own or built != self._built:
            self._built = built
            self._build(settable, rows)
        for card in cards:
            for field in card["fields"]:
                key = field["place"], field["key"]
                if key not in self._inputs:
                    with self._cards[card["place"]]:
                        self._field(field)
                self._inputs[key].set_visibility(field["used"])
        self._mark(fault)

    def _build(self, settable: dict[str, Any], rows: list[LayerRow]) -> None:
        self._column.clear()
        self._inputs, self._cards = {}, {}
        with self._column:
            if rows:
                ui.label("Layers of the drawing").classes("text-bold")
            materials = {
                "": "silicon of [material]",
                **{name: name for name in settable.get("materials", [])},
            }
            for row in rows:
                self._row(row, materials | settable["new"])
            for card in settable.get("cards", []):
                with ui.row().classes("w-full items-center gap-2"):
                    ui.label(card["title"]).classes("text-bold")
                    if card["place"][0] == "materials":
                        name = card["place"][1]
                        rename = partial(self._ask_name, name)
                        flat_button("", rename, icon="edit", label=f"Rename {name}")
                self._cards[card["place"]] = ui.element("div").classes("w-full fields")
            if settable.get("materials"):
                caption(
                    "A property is a number, a formula of T in K such as 0.032*(T/300)**-1.2, or "
                    "the name of a table (CSV) in the folder; drop tables above. Grey: what counts "
                    "where nothing is said."
                )

    def _row(self, row: LayerRow, materials: dict[str, str]) -> None:
        """Show what a layer is, what it is made of, and how thick it is if it lies on the body."""
        with ui.row().classes("w-full items-center gap-1"):
            roles = ROLES if row.role in ROLES else {**ROLES, row.role: row.role}
            role = ui.select(roles, label=f"layer {row.label}", value=row.role)
            role.classes("col min-w-36")
            role.on_value_change(lambda event: self._set_layer(row, event.value, row.material))
            if row.part == "terminals":
                return
            options = materials if row.role else {**materials, "": "–"}
            made_of = ui.select(options, label="made of", value=row.material, with_input=True)
            made_of.classes("col min-w-36").props(f'aria-label="layer {row.label} is made of"')
            role_then = row.role or "film"
            made_of.on_value_change(lambda event: self._set_layer(row, role_then, event.value))
            if row.role in ("heater", "film") and row.material:
                thickness = self._sections["layers"][row.name].get("thickness_um")
                key, words = "thickness_um", f"{row.label}: thickness (µm)"
                shown = "" if thickness is None else f"{thickness:.12g}"
                field = self._input(("layers", row.name), key, "thickness (µm)", words, shown)
                field.props('placeholder="a part of the body" stack-label').classes("w-full")

    def _set_layer(
        self, row: LayerRow, role: str | None, material: str | None
    ) -> Awaitable[None] | None:
        if role is None or material is None:
            return None
        return self._edit(with_layer(self._sections, row, role, material))

    def _ask_name(self, old: str) -> None:
        """Ask for another name of a material."""
        with opened_dialog("Another name", "24rem") as (dialog, _):
            name = ui.input("Name of the material", value=old).props("autofocus")

            async def rename() -> None:
                dialog.close()
                if name.value.strip() != old:
                    with self._banner.caught():
                        await self._edit(with_material_renamed(self._sections, old, name.value))

            name.on("keydown.enter", rename)
            ui.button("Rename", on_click=rename)

    def _field(self, field: dict[str, Any]) -> None:
        """Show a value in its field."""
        value = field["value"]
        own = self._input(
            field["place"], field["key"], field["label"], field["meaning"], value or ""
        )
        if value is None:
            own.props('readonly placeholder="as the probe file says" stack-label')
        elif field["default"]:
            own.props(f'placeholder="{field["default"]}" stack-label')

    def _input(
        self, place: tuple[str, ...], key: str, label: str, meaning: str, value: str
    ) -> ui.input:
        files = self._session.project.data if place[0] == "materials" else None
        field = ui.input(label, value=value, autocomplete=files)
        field.props(f'debounce=300 hide-bottom-space aria-label="{meaning}"')
        field.tooltip(f"{'.'.join((*place, key))}: {meaning}")
        field.on_value_change(partial(self._typed, place, key))
        self._inputs[place, key] = field
        return field

    def _typed(self, place: tuple[str, ...], key: str, event: Any) -> Awaitable[None] | None:
        if len(place) > 1 and not has_section(self._sections, place):
            return None  # it went meanwhile with the layer or the material that it was of
        value = typed(key, event.value or "")
        sections = with_value(self._sections, place, key, value)
        if sections == with_value(self._sections, place, "", None):
            return None  # nobody typed it
        return self._edit(sections)

    def _edit(self, sections: Sections) -> Awaitable[None]:
        # at once: the next field may be set before what this one does is shown
        self._sections = sections
        return self._edited(sections)

    def _mark(self, fault: str) -> None:
        """Say at its field what is wrong: at the first that a line about its section names."""
        about, _, reason = fault.partition("]: ")
        words = re.findall(r"\w+", reason)
        at_fault = [
            (words.index(key), field)
            for (place, key), field in self._inputs.items()
            if about.endswith(f"[{'.'.join(place)}") and key in words
        ]
        wrong = min(at_fault, key=lambda pair: pair[0], default=(0, None))[1]
        for field in self._inputs.values():
            field.error = reason if field is wrong else None
