"""What stays of a user's work, in a real browser: edits, a second drawing, a restart."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

pytest.importorskip("playwright", reason="the extra test-app is not installed")

from playwright.sync_api import Page, expect
from test_edited_probe_files import drawing_of
from test_journey import button, drop, picture

from app_in_browser import EXAMPLES, browsing, chromium_path, go, running

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium_path() is None, reason="no Chromium on this machine"),
]
_WORK = 180_000
expect.set_options(timeout=60_000)


def probe_text(page: Page) -> str:
    """Return the probe file that the page Lever shows."""
    return page.get_by_label("Probe file", exact=True).input_value()


def test_a_project_is_what_it_was(tmp_path: Path) -> None:
    folder, drawings = tmp_path / "project", tmp_path / "drawings"
    drawings.mkdir()
    shutil.copy(EXAMPLES / "reference-probe.gds", drawings / "own.gds")
    (drawings / "plate.gds").write_bytes(drawing_of((1, 0, 0, 50, 10)))
    rows = "".join(f"{n / 2},{n / 9}\n" for n in range(20))
    (drawings / "odd.csv").write_text(f"a,b\n{rows}")
    (drawings / "plain.csv").write_text(f"V_b (V),I_h (mA)\n{rows}")
    with running(folder) as app, browsing(app) as (page, seen):
        edits_stay(page, folder, drawings)
        nothing_of_the_first_drawing_stays(page, drawings)
        columns_are_of_their_file(page, drawings)
        page.goto(f"{app.base}/simulate")
        choose(page, "Probe", "own.toml")
        expect(page.get_by_text("hotlever sweep own.toml --bias")).to_be_visible(timeout=_WORK)
        expect(page.get_by_text("full lever:")).to_be_visible(timeout=_WORK)
        n_d = page.get_by_label("doping concentration of the heater, n_d").first
        n_d.fill("5e17")
        bias = page.get_by_role("spinbutton", name="Bias V_b")
        bias.fill("6.5")
        words = "hotlever sweep own.toml --bias 0:12:49 --set n_d=5e+17"
        expect(page.get_by_text(words)).to_be_visible(timeout=_WORK)
        page.wait_for_timeout(1500)
        assert seen.errors == []
    with running(folder) as app, browsing(app) as (page, seen):
        go(page, app, "simulate")
        expect(page.get_by_text(words)).to_be_visible(timeout=_WORK)
        expect(page.get_by_role("spinbutton", name="Bias V_b")).to_have_value("6.5")
        expect(page.get_by_text("full lever:")).to_be_visible(timeout=_WORK)
        picture(page, "after-a-restart")
        go(page, app, "fit")
        expect(page.get_by_text("--column 'V_b (V)=a'")).to_be_visible(timeout=_WORK)
        go(page, app, "lever")
        expect(page.locator("img[alt^='The lever from above']")).to_be_visible()
        assert "thickness_um = 0.31" in probe_text(page)
        assert seen.errors == []


def choose(page: Page, label: str, name: str) -> None:
    """Choose one of the options of a field."""
    page.get_by_label(label, exact=True).click()
    page.get_by_role("option", name=name, exact=True).click()


def edits_stay(page: Page, folder: Path, drawings: Path) -> None:
    """Import a drawing, edit its probe file, and drop it again; then propose anew, and undo."""
    page.goto(page.url.partition("?")[0].rstrip("/") + "/lever")
    drop(page, drawings / "own.gds")
    expect(page.get_by_text("What the drawing holds")).to_be_visible(timeout=_WORK)
    page.get_by_text("The probe file", exact=True).click()
    text = page.get_by_label("Probe file", exact=True)
    edited = text.input_value().replace("thickness_um = 0.4", "thickness_um = 0.31")
    text.fill(edited)
    page.wait_for_timeout(1500)
    button(page, "Save").click()
    expect(page.get_by_text("own.toml is written")).to_be_visible()
    assert (folder / "own.toml").read_text() == edited
    drop(page, drawings / "own.gds")
    expect(page.get_by_text("own.toml is there already, and was kept as it is.")).to_be_visible()
    assert (folder / "own.toml").read_text() == edited
    picture(page, "lever-kept")
    button(page, "Propose anew").click()
    expect(page.get_by_text("What the drawing holds")).to_be_visible(timeout=_WORK)
    assert (folder / "own.toml").read_text() != edited
    page.get_by_label("What the app wrote", exact=True).click()
    expect(page.get_by_role("dialog", name="What the app wrote")).to_be_visible()
    picture(page, "undo")
    with page.expect_navigation():
        page.get_by_role("button", name="Undo: hotlever probe import").first.click()
    expect(page.locator("img[alt^='The lever from above']")).to_be_visible()
    assert probe_text(page) == edited == (folder / "own.toml").read_text()


def nothing_of_the_first_drawing_stays(page: Page, drawings: Path) -> None:
    """Drop a drawing of which no lever can be made, and come back to the first."""
    drop(page, drawings / "plate.gds")
    expect(page.get_by_label("Save as")).to_have_value("plate.toml", timeout=_WORK)
    expect(page.get_by_text("What the drawing holds")).to_have_count(1)
    expect(page.get_by_role("alert").first).to_contain_text("plate.toml")
    expect(page.locator("img[alt^='The lever from above']")).to_have_count(0)
    expect(page.get_by_role("cell")).to_have_count(0)
    picture(page, "lever-second-drawing")
    choose(page, "Open", "own.toml")
    expect(page.get_by_label("Save as")).to_have_value("own.toml")
    expect(page.locator("img[alt^='The lever from above']")).to_be_visible()
    assert "thickness_um = 0.31" in probe_text(page)


def columns_are_of_their_file(page: Page, drawings: Path) -> None:
    """Type columns for a file, and drop another."""
    page.goto(page.url.replace("/lever", "/fit"))
    drop(page, drawings / "odd.csv")
    expect(page.get_by_role("alert").first).to_contain_text("odd.csv")
    for column, quantity, unit in (("a", "V_b: bias", "V"), ("b", "I_h: heater current", "mA")):
        choose(page, f"Column {column} is", quantity)
        choose(page, f"Unit of column {column}", unit)
    expect(page.get_by_text("odd.csv --column 'V_b (V)=a'")).to_be_visible()
    drop(page, drawings / "plain.csv")
    expect(page.get_by_text("hotlever fit plain.csv -o plain.fit.json")).to_be_visible()
    page.get_by_text("Columns of the file").click()
    expect(page.get_by_label("Column I_h (mA) is")).to_have_value("I_h: heater current")
    picture(page, "fit-next-file")
    choose(page, "Measurement", "odd.csv")
    expect(page.get_by_text("odd.csv --column 'V_b (V)=a'")).to_be_visible()
