"""Every page at the widths of a phone, a tablet and a screen, light and dark, and by keyboard."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("playwright", reason="the extra test-app is not installed")

from playwright.sync_api import Page

from app_in_browser import App, browsing, chromium_path, go, running, stand_still
from app_look import furnish, look
from hotlever.app.pages.frame import PAGES

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium_path() is None, reason="no Chromium on this machine"),
]
SCREENSHOTS = Path(__file__).with_name("screenshots")


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[App, Page]]:
    folder = tmp_path_factory.mktemp("project")
    furnish(folder)
    SCREENSHOTS.mkdir(exist_ok=True)
    with running(folder) as app, browsing(app) as (page, seen):
        yield app, page
        assert seen.errors == []
        assert seen.elsewhere == []


@pytest.mark.parametrize("address", PAGES, ids=lambda address: address or "start")
def test_nothing_is_hidden_faint_nameless_or_out_of_reach(opened, address):
    app, page = opened
    seen = look(page, app, address, SCREENSHOTS)
    assert seen.faults == []
    assert seen.controls > 10
    assert seen.lowest("text") >= 4.5


def test_what_is_wrong_is_noticed(opened):
    """A text that is faint, one that is cut off, a box without a name, one beyond the window."""
    app, page = opened
    bad = """() => document.body.insertAdjacentHTML('beforeend',
        `<p style="color: #999; background: #fff">faint</p>
        <p style="width: 2em; overflow: hidden; white-space: nowrap">much too long to be seen</p>
        <p style="position: absolute; left: 3000px; top: 9px">far away</p>
        <button style="outline: none" tabindex="-1">out of reach</button><input>`)"""
    page.add_init_script(f"addEventListener('load', () => setTimeout({bad}, 800))")
    faults = "; ".join(look(page, app, "", SCREENSHOTS).faults)
    for fault in (
        "contrast 2.85 of p faint",
        "cut off: p much too long",
        "scrolls sideways",
        "no Tab reaches button out of reach",
        "a textbox has no name",
    ):
        assert fault in faults


def test_on_a_phone_what_is_measured_is_drawn_before_what_is_asked(opened):
    app, page = opened
    page.set_viewport_size({"width": 390, "height": 844})
    go(page, app, "measurements")
    page.get_by_text("Measure with a source meter").click()
    page.get_by_label("Biases (V), and most rows").fill("1:2:2")
    page.get_by_label("Wait at each").fill("0s")
    command = page.locator("pre", has_text="--bias 1:2:2 --settle 0s")
    command.wait_for()
    page.get_by_role("button", name="Measure", exact=True).click()
    page.get_by_text("Row 1").or_(page.get_by_text("Row 2")).wait_for(timeout=60_000)
    stand_still(page)
    plot, fields = page.get_by_label("Measured current against bias"), page.locator(".controls")
    drawn, asked = plot.bounding_box(), fields.bounding_box()
    assert drawn is not None
    assert asked is not None
    assert drawn["y"] + drawn["height"] < asked["y"]
