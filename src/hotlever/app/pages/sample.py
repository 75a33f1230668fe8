"""The layers of a sample, from the top: a material each, and a thickness but for the last."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nicegui import ui

from hotlever.app.pages.following import slider
from hotlever.app.pages.frame import flat_button
from hotlever.errors import InputError
from hotlever.materials.samples import sample_names
from hotlever.probe.contact import parsed_layers

#: Thicknesses of the slider (nm), and that of a layer that is added.
_LEAST, _MOST, _NEW = 1.0, 1e4, 100.0


class SampleLayers:
    """Fields for the layers of a sample; `changed` is called with what they say, as a command does.

    A text that is none is shown as it is.
    """

    def __init__(self, changed: Callable[[str], None]) -> None:
        self._changed = changed
        #: Materials and thicknesses (nm); the last counts for nothing.
        self._layers: list[tuple[str, float]] = []
        self._column = ui.column().classes("w-full gap-1")

    def show(self, text: str) -> None:
        """Show the fields of a text such as ``polymer, 100nm, silicon``."""
        try:
            layers = parsed_layers(text, "")
        except InputError:
            layers = ()
        self._layers = [(layer.material, 1e3 * (layer.thickness_um or 0.0)) for layer in layers]
        self._column.clear()
        with self._column:
            if not layers:
                field = ui.input("Sample", value=text).classes("w-full")
                field.on_value_change(lambda event: self._changed(event.value))
                return
            for number, (material, thickness) in enumerate(self._layers):
                self._layer(number, material, thickness)
            flat_button("A layer on top", self._add, icon="add")

    def _layer(self, number: int, material: str, thickness: float) -> None:
        last = number == len(self._layers) - 1
        where = "substrate" if last else f"layer {number + 1}"
        names = list(dict.fromkeys((*sample_names(), material)))
        with ui.row().classes("w-full items-center no-wrap gap-1"):
            chosen = ui.select(names, label=where, value=material, with_input=True)
            chosen.classes("col").props("new-value-mode=add-unique")
            chosen.tooltip("A material, or its thermal conductivity in W/(m K)")
            chosen.on_value_change(lambda event: self._set(number, material=event.value))
            if not last:
                remove = partial(self._remove, number)
                flat_button("", remove, icon="close", label=f"Remove {where}")
        if not last:
            words = f"thickness of {where}"
            field = slider(words, thickness, _LEAST, _MOST, "nm", by_decades=True)
            field.on_value_change(lambda event: self._set(number, thickness=event.value))

    def _set(
        self, number: int, material: str | None = None, thickness: float | None = None
    ) -> None:
        before = self._layers[number]
        self._layers[number] = material or before[0], thickness or before[1]
        self._tell()

    def _add(self) -> None:
        self._layers.insert(0, (self._layers[0][0], _NEW))
        self._tell()
        self.show(self._text())

    def _remove(self, number: int) -> None:
        del self._layers[number]
        self._tell()
        self.show(self._text())

    def _text(self) -> str:
        *films, (substrate, _) = self._layers
        return ", ".join([*(f"{name}, {thickness:g}nm" for name, thickness in films), substrate])

    def _tell(self) -> None:
        self._changed(self._text())
