"""What the app's pages look like: at three widths, light and dark, and by keyboard alone.

``python benchmarks/app_look.py [FOLDER [PAGE …]]`` opens each page in a headless Chromium, and what
can be opened on them (`VIEWS`), prints for each the lowest contrast and what is wrong (cut off,
covered, squeezed, unreachable, without a name), and keeps a picture of each look in the folder.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from playwright.sync_api import Page

from app_in_browser import App, browsing, go, running, stand_still
from hotlever.app.pages.frame import PAGES
from hotlever.app.project import Project
from problems import table

WIDTHS = (390, 1024, 1600)
_HEIGHTS = {390: 844, 1024: 768, 1600: 900}
#: Contrast that a focus must have with what is around it (WCAG 2.2, 1.4.11).
_OF_THE_FOCUS = 3.0
_SCRIPT = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")
#: Roles of the tree of accessibility that must have a name.
_NAMED = (
    *("button", "link", "textbox", "combobox", "checkbox", "switch", "slider", "spinbutton"),
    *("tab", "menuitem", "radio", "image", "img", "dialog"),
)
#: Times that Tab is pressed at most.
_MOST_TABS = 200
#: Milliseconds without a change after which there is nothing more to come.
_ALL_MS = 500
#: Whether nothing is being computed or drawn for a page, which may stand still meanwhile.
_AT_REST = """() => !document.querySelector('.q-spinner')
    && ![...document.querySelectorAll('[aria-live=polite]')].some(
        e => /^(starting|moving)|: \\d+ of \\d+$/.test(e.innerText))"""
#: Milliseconds that a task may take.
_WORK_MS = 120_000


def _choose(page: Page, field: str, option: str) -> None:
    page.get_by_role("combobox", name=field).click()
    page.get_by_role("option", name=option, exact=True).click()


def _drawn(page: Page, alt: str, *buttons: str) -> None:
    """Press buttons, if a figure is not there yet, and wait for it."""
    figure = page.locator(f"img[alt^='{alt}']")
    if not figure.count():
        for button in buttons:
            page.get_by_role("button", name=button, exact=True).click()
    figure.wait_for(timeout=_WORK_MS)


def _in_time(page: Page) -> None:
    _choose(page, "Compare with", "the same in air")
    page.get_by_role("button", name="in time").click()
    _drawn(page, "Voltages", "Follow")
    page.get_by_text("Dashed: the same in air.").wait_for(timeout=_WORK_MS)
    _drawn(page, "The temperature map in time", "film")


def _small_signals(page: Page) -> None:
    page.get_by_role("button", name="small signals").click()
    _drawn(page, "Impedance", "Respond")


def _compared(page: Page) -> None:
    page.get_by_role("button", name="at a bias").click()
    _choose(page, "Compare with", "the same in air")
    page.locator("[data-number=beside]").filter(has_text="tip").wait_for(timeout=_WORK_MS)


def _read(page: Page) -> None:
    page.locator("[aria-live=polite]").filter(has_text="full lever: the").wait_for(timeout=_WORK_MS)


def _opened(page: Page, name: str) -> None:
    _choose(page, "Or open a result of the folder", name)
    page.get_by_text("A result of the folder, made").wait_for(timeout=_WORK_MS)
    stand_still(page, _ALL_MS)


def _proposed(page: Page) -> None:
    _opened(page, "lever-a.calibration.json")
    _drawn(page, "Error by temperature", "Propose")


def _menu(page: Page) -> None:
    page.set_viewport_size({"width": WIDTHS[0], "height": _HEIGHTS[WIDTHS[0]]})
    page.get_by_label("Pages: ").click()


def _script(page: Page) -> None:
    page.get_by_role("button", name="Script: ").first.click()
    page.get_by_role("dialog").wait_for()


#: What is looked at beside the pages, by name: the page, how it is opened there, the widths.
VIEWS: dict[str, tuple[str, Callable[[Page], None], tuple[int, ...]]] = {
    "in time": ("simulate", _in_time, WIDTHS),
    "small signals": ("simulate", _small_signals, WIDTHS),
    "compared": ("simulate", _compared, WIDTHS),
    "read": ("reader", _read, WIDTHS),
    "calibrated": ("measurements", _proposed, WIDTHS),
    "fitted": ("measurements", lambda page: _opened(page, "lever-a.fit.json"), WIDTHS),
    "menu": ("raman", _menu, WIDTHS[:1]),
    "script": ("", _script, WIDTHS),
}


@dataclass
class Look:
    """What was found of a page: contrasts by kind, with what is needed, and what is wrong."""

    page: str
    contrasts: list[tuple[str, float, float, str]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    controls: int = 0

    def lowest(self, kind: str) -> float:
        """Return the lowest contrast of a kind; infinite if there is none."""
        return min((one[1] for one in self.contrasts if one[0] == kind), default=float("inf"))


def furnish(folder: Path) -> None:
    """Fill a project, so that each page has something to show."""
    project = Project(folder)
    for name in ("lever-b.csv", "reference-probe.gds", "lever-a.csv"):
        project.take_example(name)
    project.take_example_folders("raman", "hot-plate", "tip")
    command(folder, "fit lever-a.csv lever-b.csv -o fits")
    # as the fit of one lever is called
    shutil.copy(folder / "fits" / "lever-a.json", folder / "lever-a.fit.json")
    for line in (
        "calibrate lever-a.csv --fit lever-a.fit.json -o lever-a.calibration.json "
        "--table lever-a.table.csv",
    ):
        command(folder, line)


def command(folder: Path, line: str) -> None:
    """Run a command in a folder."""
    words = [sys.executable, "-m", "hotlever", *line.split()]
    subprocess.run(words, cwd=folder, check=True, capture_output=True)


#: Milliseconds that the numbers of a page may take.
_WORK_MS = 60_000


def look(page: Page, app: App, view: str, folder: Path) -> Look:
    """Look at a page, or one of `VIEWS`, at its widths, light and dark, and walk by keyboard."""
    address, opened, widths = VIEWS.get(view, (view, None, WIDTHS))
    made = Look(view or "start")
    for theme in ("light", "dark"):
        page.set_viewport_size({"width": WIDTHS[-1], "height": _HEIGHTS[WIDTHS[-1]]})
        go(page, app, address)
        if (theme == "dark") != page.evaluate("document.body.matches('.body--dark')"):
            page.get_by_label("Light or dark").click()
        _settle(page)
        if opened is not None:
            opened(page)
            stand_still(page)
        for width in widths:
            page.set_viewport_size({"width": width, "height": _HEIGHTS[width]})
            page.evaluate("scrollTo(0, 0)")
            # numbers of before are pale until those of the full lever are there
            page.wait_for_function("!document.querySelector('.of-before')", timeout=_WORK_MS)
            stand_still(page)
            picture = folder / f"{made.page}-{theme}-{width}.png"
            page.screenshot(path=picture, full_page=True)
            seen = page.evaluate(f"(look => [look.colours(), look.faults()])({_SCRIPT})")
            made.contrasts += [tuple(one) for one in seen[0]]
            made.faults += [f"{width} {theme}: {fault}" for fault in seen[1]]
            made.faults += [
                f"{width} {theme}: contrast {value:.2f} of {what}"
                for _, value, least, what in made.contrasts[-len(seen[0]) :]
                if value < least
            ]
            if width != WIDTHS[1]:
                _walk(page, made, f"{width} {theme}")
    made.faults = list(dict.fromkeys(made.faults))
    return made


def _settle(page: Page) -> None:
    """Wait until there is nothing more to come, with all that can be unfolded open."""
    page.wait_for_function(_AT_REST, timeout=_WORK_MS)
    stand_still(page, _ALL_MS)
    while page.evaluate(f"({_SCRIPT}).unfolded()"):
        stand_still(page, _ALL_MS)


def _walk(page: Page, made: Look, where: str) -> None:
    """Press Tab until all controls have been met; note those that were not, or without a name."""
    page.evaluate(f"{{({_SCRIPT}).forget(); document.activeElement.blur(); scrollTo(0, 0)}}")
    reached = 0
    for _ in range(_MOST_TABS):
        page.keyboard.press("Tab")
        met = page.evaluate(f"({_SCRIPT}).focused()")
        if met is None:
            break
        if not met:  # the end of the page, where the browser's own controls would follow
            continue
        reached += 1
        what, contrast, hidden = met
        if contrast < _OF_THE_FOCUS:
            made.faults.append(f"{where}: focus of contrast {contrast:.2f} on {what}")
        if hidden:
            made.faults.append(f"{where}: {what} has the focus, {hidden}")
    made.controls = max(made.controls, reached)
    missed = page.evaluate(f"({_SCRIPT}).unreached()")
    made.faults += [f"{where}: no Tab reaches {what}" for what in missed]
    made.faults += [f"{where}: a {role} has no name" for role in _nameless(page)]


def _nameless(page: Page) -> list[str]:
    """Return the roles of what has no name for who cannot see it."""
    # what Plotly measures its texts with, far outside of the window
    page.evaluate("document.querySelector('#js-plotly-tester')?.setAttribute('aria-hidden', true)")
    session = page.context.new_cdp_session(page)
    nodes: list[dict[str, Any]] = session.send("Accessibility.getFullAXTree")["nodes"]
    session.detach()
    roles = [
        node["role"]["value"]
        for node in nodes
        if not node.get("ignored") and not node.get("name", {}).get("value", "").strip()
    ]
    return [role for role in roles if role in _NAMED]


def main() -> None:
    folder, *pages = sys.argv[1:] or ["benchmarks/results/look"]
    pictures = Path(folder)
    pictures.mkdir(parents=True, exist_ok=True)
    rows = []
    with tempfile.TemporaryDirectory() as name:
        furnish(Path(name))
        with running(Path(name)) as app, browsing(app) as (page, seen):
            for view in pages or (*PAGES, *VIEWS):
                made = look(page, app, view, pictures)
                lowest = [f"{made.lowest(kind):.2f}" for kind in ("text", "icon", "line")]
                rows.append((made.page, made.controls, *lowest, len(made.faults)))
                for fault, times in Counter(made.faults).items():
                    print(made.page, fault, f"({times} times)" if times > 1 else "", flush=True)
        print(*seen.errors, sep="\n")
    table(("page", "controls", "contrast of text", "of icons", "of lines", "faults"), rows)


if __name__ == "__main__":
    main()
