"""What was made of measurements: the page of a result, what to set by it, what to measure next."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app import showing
from hotlever.app.pages.frame import (
    ErrorBanner,
    caption,
    download_button,
    figure,
    flat_button,
    hand_over,
    small_button,
    table,
    text_shown,
)
from hotlever.app.pages.task_page import DrawnPage
from hotlever.app.session import Session, Task
from hotlever.errors import HotleverError
from hotlever.files import FIGURE_TYPES
from hotlever.materials.parameters import sentence
from hotlever.text import value_with_error


async def show_result(session: Session, banner: ErrorBanner, name: str, result: Any) -> None:
    """Show what a fit or a calibration file says, as `hotlever.app.showing.result` has it."""
    stem = Path(name).name.split(".")[0]

    async def give(function: Callable[..., Any], file: str, *arguments: str) -> None:
        with banner.caught():
            await hand_over(session.ask("full", function, name, *arguments), file)

    with ui.row().classes("items-center"):
        ui.label(name).classes("text-lg text-bold")
        download_button(session, name, f"{result['kind'].capitalize()} (JSON)")
        if result["kind"] == "calibration":
            budget = partial(give, showing.budget, f"{stem}-budget.html")
            small_button("Uncertainty budget (one sheet)", budget, icon="print")
    questions = list[Callable[[], Awaitable[None]]]()
    if result["kind"] == "calibration":
        with ui.card().classes("w-full").props("flat bordered"):
            ui.label("What do I set?").classes("text-bold")
            if doubt := result["doubt"]:
                refusal = f"This calibration does not tell. {sentence(doubt)}"
                ui.label(refusal).classes("remark").props("data-answer=none")
            else:
                quantities = {
                    "tip_K": ("tip temperature", "K", 600.0),
                    "bias_V": ("bias", "V", 8.0),
                    "power_mW": ("power", "mW", 2.0),
                }
                first = {along: value for along, (*_, value) in quantities.items()}
                targets = session.choices("asked", first)
                questions = [
                    _question(session, name, along, title, unit, targets)
                    for along, (title, unit, _) in quantities.items()
                ]
        if questions:
            Proposals(session, banner, name, stem)
    for answer in questions:
        await answer()
    with ui.row().classes("w-full gap-3 items-start"):
        for block in result["blocks"]:
            if block["kind"] == "heading":
                ui.label(block["text"]).classes("w-full text-lg text-bold")
            elif block["kind"] == "text":
                text_shown(block["text"])
            elif block["kind"] == "table":
                table(block["columns"], block["rows"])
                caption(block["caption"]).classes("w-full")
            else:
                with ui.column().classes("gap-0"):
                    figure(block["figure"], block["caption"])
                    with ui.row().classes("items-center w-full no-wrap"):
                        caption(block["caption"]).classes("remark caption col")
                        for suffix in FIGURE_TYPES:
                            own, kind = block["name"], suffix[1:].upper()
                            click = partial(
                                give, showing.drawn, f"{stem}-{own}{suffix}", own, suffix
                            )
                            flat_button(kind, click, label=f"{own} as {kind}").props("size=sm")


def _question(
    session: Session, name: str, along: str, title: str, unit: str, targets: dict[str, float]
) -> Callable[[], Awaitable[None]]:
    """Ask a number here; return what answers from the calibration for the one that stands there."""
    with ui.row().classes("w-full items-center"):
        number = ui.number(f"For a {title} of", value=targets[along])
        number.props(f"suffix={unit} debounce=150").classes("w-60")
        said = ui.label().classes("remark col min-w-60").props("aria-live=polite")
        said.props(f"data-answer={along}")

    async def answer() -> None:
        value, text = number.value, ""
        if value is not None:
            targets[along] = value
            try:
                row = await session.ask("full", showing.settings, name, along, value)
                text = (
                    "outside of what was calibrated, or in a jump" if row is None else _answer(row)
                )
            except HotleverError as error:
                text = str(error)
        if value == number.value:  # nothing else was typed meanwhile
            said.set_text(text)

    number.on_value_change(answer)
    return answer


def _answer(row: dict[str, float]) -> str:
    low, high = row["tip_low_K"], row["tip_high_K"]
    apex = ""
    if "apex_K" in row:
        apex = f", apex {value_with_error(row['apex_K'], row['apex_stderr_K'])} K"
    return (
        f"set a bias of {row['bias_V']:.3f} V: lever {row['lever_V']:.3f} V, "
        f"{row['current_mA']:.4f} mA, {row['power_mW']:.3f} mW; tip "
        f"{value_with_error(row['tip_K'], row['tip_stderr_K'])} K "
        f"(95 %: {low:.0f} to {high:.0f} K){apex}"
    )


class Proposals(DrawnPage):
    """A card in the element that is open, of a calibration file; what it makes begins with a stem.

    Each calibration has proposals of its own.
    """

    alt = "Error by temperature now and after more measurements; tip temperature by bias"
    kinds: ClassVar = {kind: text for kind, text in DrawnPage.kinds.items() if kind != "NetCDF"}
    #: Where the error counts, and what the tip is to stay below: what counts where nothing is said.
    temperatures: ClassVar = {
        "at": ("Sure at", "hottest measured"),
        "stay_below": ("Stay below", "what melts"),
    }
    first: ClassVar = dict.fromkeys(temperatures)

    def __init__(self, session: Session, banner: ErrorBanner, calibration: str, stem: str) -> None:
        self.name, self._calibration, self._stem = f"next {calibration}", calibration, stem
        super().__init__(session, banner)
        with ui.card().classes("w-full").props("flat bordered data-proposals"):
            ui.label("What do I measure next?").classes("text-bold")
            with ui.row().classes("w-full items-center"):
                for key, (title, empty) in self.temperatures.items():
                    self.number(key, title, "K", empty).classes("w-44", remove="w-36")
                ui.space()
                ui.button("Propose", icon="add_location_alt", on_click=self.start)
            self.show_result()
        self.show_command()

    def task(self) -> Task:
        """Return the task that writes the proposals as a table and a figure."""
        temperatures = {key: self.chosen[key] for key in self.temperatures}
        kelvins = {key: "" if T is None else f"{T:.12g}K" for key, T in temperatures.items()}
        files = self.outputs(self._stem, "next", "SVG")
        return Task("next", (self._calibration,), {**kelvins, **files})
