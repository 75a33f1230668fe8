"""The probe file that is open: its text, its file, and what can be set in it as fields."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Awaitable, Callable
from functools import cache, partial
from typing import Any

from nicegui import ui

from hotlever.app.edits import (
    FILM,
    TERMINALS,
    LayerRow,
    Section,
    has_section,
    same,
    typed,
    with_layer,
    with_material_renamed,
    with_value,
)
from hotlever.app.pages.frame import caption, confirm, flat_button
from hotlever.app.pages.page import Page
from hotlever.app.project import LARGEST_PROBE, safe_name
from hotlever.errors import InputError
from hotlever.files import read_text
from hotlever.probe import Probe
from hotlever.tasks.planning_requests import NEW_PROBES

_ROLES = {"": "not used", "body": "outline of the lever", FILM: "film or part"}
_ROLES |= {name: f"terminal: {name}" for name in TERMINALS}
_SILICON = "silicon of [material]"
_LAWS = (
    "A property is a number, a formula of T in K such as 0.032*(T/300)**-1.2, or the name of a "
    "table (CSV) in the folder; drop tables above. Grey: what counts where nothing is said."
)


class ProbeFile:
    """The text of a probe file that is edited, and the file of its name: no edits are lost.

    What is chosen of it on the page is told by `hotlever.app.state.Lever`.
    """

    def __init__(self, page: Page) -> None:
        self._session, self._chosen = page.session, page.chosen

    @property
    def _is_saved(self) -> bool:
        return _digest(self._chosen["text"]) == self._chosen["saved"]

    def open(self, name: str) -> str:
        """Read a file of the project; return its text.

        Raises
        ------
        InputError
            If it is no text file, or too large for a probe file.
        """
        text = read_text(self._session.project.path(name), largest=LARGEST_PROBE)
        self._chosen |= {"name": name, "text": text, "saved": _digest(text)}
        return text

    def take_up(self) -> None:
        """Take the file as it is now, unless it was edited here: others may have changed it.

        Raises
        ------
        InputError
            As `open`.
        """
        name = self._chosen["name"]
        if self._chosen["text"] and self._is_saved and self._session.project.stamp(name):
            self.open(name)

    async def may_go(self) -> bool:
        """Ask whether edits that are not saved may go, if there are any."""
        text = self._chosen["text"]
        if not text or self._is_saved or text in map(new_probe, NEW_PROBES):
            return True
        question = "The probe file that is open here has edits that are not saved."
        return await confirm(question, "Drop them", "Go on with it")

    async def save(self, name: str, text: str) -> str | None:
        """Write a text; ask before another file of its name is replaced.

        Returns
        -------
        str or None
            The name that it has now; None if it was not to be written.

        Raises
        ------
        InputError
            If there is nothing to be written, or what is there is no probe file.
        """
        if not text.strip():
            raise InputError("there is no probe here yet: drop a drawing, or choose a shape")
        project = self._session.project
        name = safe_name(name)
        name = name if name.endswith(".toml") else f"{name}.toml"
        path = project.path(name)
        there = read_text(path, largest=LARGEST_PROBE) if path.exists() else None
        if there not in (None, text):
            is_own = name == self._chosen["name"] and _digest(there) == self._chosen["saved"]
            question = f"{name} is there already, and holds something else than was opened here."
            if not is_own and not await confirm(question, "Replace it", "Keep it"):
                return None
        if there != text:
            project.write(name, text, f"saved {name}")
        self._chosen |= {"name": name, "saved": _digest(text)}
        return name


@cache
def new_probe(shape: str) -> str:
    """Return the probe file that a parametric shape begins with."""
    probe: Probe = getattr(Probe, NEW_PROBES[shape])()
    return probe.to_toml()


def _digest(text: str | None) -> str:
    """Return what tells whether a text is as it was."""
    return "" if text is None else hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()


class ProbeText:
    """The field in which the text of a probe file is edited; `typed` is told what somebody typed.

    Attributes
    ----------
    text : str
        What stands there.
    """

    def __init__(self, typed: Callable[[str], Awaitable[None]]) -> None:
        self._typed, self.text = typed, ""
        with ui.expansion("The probe file"):
            self._area = ui.textarea(on_change=self._changed).classes("w-full")
            self._area.props('outlined autogrow debounce=400 aria-label="Probe file"')
            self._area.props("input-class=font-mono input-style=font-size:.8rem")

    def put(self, text: str) -> None:
        """Show a text that nobody typed."""
        self.text = text
        self._area.set_value(text)

    def _changed(self, event: Any) -> Awaitable[None] | None:
        if event.value == self.text:
            return None
        self.text = event.value
        return self._typed(event.value)


class ProbeFields:
    """What can be set in the probe file that is open; `edited` is told its new text."""

    def __init__(self, page: Page, edited: Callable[[str], Awaitable[None]]) -> None:
        self._session, self._banner, self._edited = page.session, page.banner, edited
        self._text, self._turn = "", 0
        self._built: Any = None
        self._inputs: dict[tuple[Section, str], ui.input] = {}
        self._field_values: dict[tuple[Section, str], str] = {}
        self._cards: dict[Section, ui.element] = {}
        self._column = ui.column().classes("w-full gap-1")

    async def show(self, text: str, fault: str) -> None:
        """Show what can be set in a text, and what is wrong; nothing if nothing is open."""
        self._turn += 1
        turn, self._text = self._turn, text
        settable = await self._session.ask("quick", "probe_files:settable", text) if text else {}
        if turn != self._turn:
            return
        rows = settable.get("layers", [])
        layers = [(row.label, row.name, row.role, row.material) for row in rows]
        built = layers, [(card["section"], card["title"]) for card in settable.get("cards", [])]
        if built != self._built:
            self._built = built
            self._build(settable, rows)
        for card in settable.get("cards", []):
            for field in card["fields"]:
                self._show_field(field, card["section"])
        for row in rows:
            if row.role == FILM and row.material:
                thickness = "" if row.thickness_um is None else f"{row.thickness_um:.12g}"
                self._set(("layers", row.name), "thickness_um", thickness)
        self._mark(fault)

    def _build(self, settable: dict[str, Any], rows: list[LayerRow]) -> None:
        self._column.clear()
        self._inputs, self._cards = {}, {}
        with self._column:
            if rows:
                ui.label("Layers of the drawing").classes("text-bold")
            materials = {"": _SILICON, **{name: name for name in settable.get("materials", [])}}
            for row in rows:
                self._row(row, materials | settable["new"])
            for card in settable.get("cards", []):
                with ui.row().classes("w-full items-center gap-2"):
                    ui.label(card["title"]).classes("text-bold")
                    if card["section"][0] == "materials":
                        name = card["section"][1]
                        rename = partial(self._rename, name)
                        flat_button("", rename, icon="edit", label=f"Rename {name}")
                self._cards[card["section"]] = ui.element("div").classes("w-full fields")
            if settable.get("materials"):
                caption(_LAWS)

    def _row(self, row: LayerRow, materials: dict[str, str]) -> None:
        """Show what a layer is, what it is made of, and how thick it is if it lies on the body."""
        with ui.row().classes("w-full items-center gap-1"):
            roles = _ROLES if row.role in _ROLES else {**_ROLES, row.role: row.role}
            role = ui.select(roles, label=f"layer {row.label}", value=row.role)
            role.classes("col min-w-36")
            role.on_value_change(lambda event: self._set_layer(row, event.value, row.material))
            if row.role in (*TERMINALS, *({row.name} if row.part == "terminals" else ())):
                return
            options = materials if row.role else {**materials, "": "–"}
            made_of = ui.select(options, label="made of", value=row.material, with_input=True)
            made_of.classes("col min-w-36").props(f'aria-label="layer {row.label} is made of"')
            role_then = row.role or FILM
            made_of.on_value_change(lambda event: self._set_layer(row, role_then, event.value))
            if row.role == FILM and row.material:
                section = ("layers", row.name)
                label = "thickness (µm)"
                field_input = self._input(section, "thickness_um", label, f"{row.label}: {label}")
                field_input.props('placeholder="a part of the body" stack-label').classes("w-full")

    def _set_layer(
        self, row: LayerRow, role: str | None, material: str | None
    ) -> Awaitable[None] | None:
        if role is None or material is None:
            return None
        return self._edit(with_layer(self._text, row, role, material))

    async def _rename(self, old: str) -> None:
        """Ask for another name of a material."""
        dialog = ui.dialog(value=True).props('aria-label="Another name"')
        with dialog, ui.card():
            name = ui.input("Name of the material", value=old).props("autofocus")
            with ui.row().classes("w-full justify-end"):
                ui.button("Cancel", on_click=dialog.close).props("flat")
                ui.button("Rename", on_click=lambda: dialog.submit(name.value))
            name.on("keydown.enter", lambda: dialog.submit(name.value))
        new = await dialog
        dialog.delete()
        if new is not None and new.strip() != old:
            with self._banner.caught():
                await self._edited(with_material_renamed(self._text, old, new))

    # --- values -----------------------------------------------------------------------------------

    def _show_field(self, field: dict[str, Any], card: Section) -> None:
        """Show a value in its field, which is made if it is not there."""
        section, key, value = field["section"], field["key"], field["value"]
        if (section, key) not in self._inputs:
            with self._cards[card]:
                field_input = self._input(section, key, field["label"], field["meaning"])
                if field["default"]:
                    field_input.props(f'placeholder="{field["default"]}" stack-label')
                if value is None:
                    field_input.props('readonly placeholder="as the probe file says" stack-label')
        self._inputs[section, key].set_visibility(field["used"])
        self._set(section, key, value or "")

    def _input(self, section: Section, key: str, label: str, meaning: str) -> ui.input:
        files = self._session.project.data if section[0] == "materials" else None
        field_input = ui.input(label, autocomplete=files)
        field_input.props(f'debounce=300 hide-bottom-space aria-label="{meaning}"')
        field_input.tooltip(f"{'.'.join((*section, key))}: {meaning}")
        field_input.on_value_change(partial(self._typed, section, key))
        self._inputs[section, key] = field_input
        return field_input

    def _set(self, section: Section, key: str, value: str) -> None:
        field_input = self._inputs[section, key]
        self._field_values[section, key] = value
        if typed(key, field_input.value or "") != typed(key, value):
            field_input.set_value(value)

    def _typed(self, section: Section, key: str, event: Any) -> Awaitable[None] | None:
        if (event.value or "") == self._field_values.get((section, key)):
            return None  # nobody typed it
        if len(section) > 1 and not has_section(self._text, section):
            return None  # it went meanwhile with the layer or the material that it was of
        self._field_values[section, key] = event.value or ""
        value = typed(key, event.value or "")
        text = with_value(self._text, section, key, value)
        return None if same(text, self._text) else self._edit(text)

    def _edit(self, text: str) -> Awaitable[None]:
        # at once: the next field may be set before what this one does is shown
        self._text = text
        return self._edited(text)

    def _mark(self, fault: str) -> None:
        """Say at its field what is wrong: at the first that a line about its section names."""
        folder = f"{self._session.project.folder}/"
        about, _, reason = fault.replace(folder, "").partition("]: ")
        words = re.findall(r"\w+", reason)
        at_fault = [
            (words.index(key), field_input)
            for (section, key), field_input in self._inputs.items()
            if about.endswith(f"[{'.'.join(section)}") and key in words
        ]
        wrong = min(at_fault, key=lambda pair: pair[0], default=(0, None))[1]
        for field_input in self._inputs.values():
            field_input.error = reason if field_input is wrong else None
