"""Materials: what levers can be made of, with the curves of their laws over the temperature."""

from __future__ import annotations

from collections.abc import Awaitable

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.chosen_lever import probe_files
from hotlever.app.pages.frame import ErrorBanner, caption, figure, text_shown
from hotlever.app.pages.page import Page
from hotlever.app.session import Session

_ALL = "all that levers can be made of"
_ABOUT = "Materials of your own are set on the page Lever, at the layers of a drawing."


class MaterialsPage(Page):
    """One tab of the page."""

    name = "materials"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        probes = {"": _ALL} | {name: name for name in session.project.probes}
        self.choice("probe", "Materials of", probes, None).classes("max-w-md")
        caption(_ABOUT)
        self._shown_of = ui.column().classes("w-full gap-2")
        self.command()

    def task(self) -> Task | None:
        """Return the command that lists the materials and draws them."""
        return Task("materials", probe_files(self.chosen), {"plot": "materials.svg"})

    def changed(self) -> Awaitable[None]:
        """Show the materials of another probe."""
        return self.open()

    async def open(self) -> None:
        """Show the curves of the laws, and all parameters."""
        self.show_command()
        probe, catalogue = self.chosen["probe"], None
        with self.banner.caught():
            catalogue = await self.session.ask("full", "showing:materials", probe)
        if probe != self.chosen["probe"]:  # another one was chosen meanwhile
            return
        self._shown_of.clear()
        if catalogue is None:
            return
        with self._shown_of:
            alt = "Thermal conductivity and resistivity against the temperature"
            figure(catalogue["figure"], alt, wide=True)
            for head, *lines in catalogue["kinds"].values():
                with ui.expansion(head.removesuffix(":")).props("header-class=text-bold"):
                    text_shown("\n".join(lines))
