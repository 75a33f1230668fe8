"""A new user's journey, in a real browser, and what may go wrong on it."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright", reason="the extra test-app is not installed")

from playwright.sync_api import Page, expect

from app_in_browser import (
    EXAMPLES,
    App,
    Seen,
    answer,
    bad_files,
    browsing,
    chromium_path,
    give,
    go,
    running,
    stand_still,
)

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium_path() is None, reason="no Chromium on this machine"),
]
SCREENSHOTS = Path(__file__).with_name("screenshots")
#: Milliseconds that work may take on a busy machine.
_WORK = 600_000
#: Milliseconds after which a cancelled posterior, which would take minutes, is waited for no more.
#: It takes half a second where the machine does nothing else.
_CANCEL = 15_000
expect.set_options(timeout=60_000)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("project")


@pytest.fixture(scope="module")
def app(folder: Path) -> Iterator[App]:
    with running(folder) as one:
        yield one


@pytest.fixture(scope="module")
def browser(app: App) -> Iterator[tuple[Page, Seen]]:
    with browsing(app) as (page, seen):
        yield page, seen
        assert seen.elsewhere == []


@pytest.fixture
def page(browser: tuple[Page, Seen]) -> Iterator[Page]:
    page, seen = browser
    page.set_default_timeout(60_000)
    yield page
    assert seen.errors == []
    seen.errors.clear()


def drop(page: Page, *paths: Any, zone: int = 0) -> None:
    page.locator("input[type=file]").nth(zone).set_input_files(list(paths))


def picture(page: Page, name: str) -> None:
    SCREENSHOTS.mkdir(exist_ok=True)
    page.evaluate("window.scrollTo(0, 0)")
    stand_still(page)
    page.screenshot(path=SCREENSHOTS / f"{name}.png", full_page=True)


def button(page: Page, name: str) -> Any:
    """Return a button of the page, not the one of the same name that leads to it."""
    return page.get_by_role("button", name=name, exact=True).last


def test_from_the_shipped_measurement_to_a_table_in_five_clicks(app, page, folder):
    picture(page, "start")
    drop(page, EXAMPLES / "lever-a.csv")  # 1: press +, and choose
    page.wait_for_url("**/measurements")
    expect(page.get_by_text("heater current, 'I_h (mA)'")).to_be_visible()
    page.get_by_role("button", name="Fit", exact=True).first.click()  # 2
    expect(page.get_by_text("hotlever fit lever-a.csv -o lever-a.fit.json")).to_be_visible()
    button(page, "Fit").click()  # 3
    # the lever comes nearer to the data while it is fitted
    expect(page.get_by_text("Line: the lever as the fit has it")).to_be_visible(timeout=_WORK)
    expect(page.get_by_text("lever-a.fit.json", exact=True)).to_be_visible(timeout=_WORK)
    expect(page.locator("img[alt^='Tip temperature against the power']")).to_be_visible()
    picture(page, "fit")
    button(page, "Calibrate with this fit").click()  # 4
    answer = page.locator("[data-answer=tip_K]")
    expect(answer).to_contain_text("set a bias of", timeout=_WORK)
    expect(page.locator("img[alt^='Tip temperature against']")).to_be_visible()
    picture(page, "calibrate")
    with page.expect_download() as download:
        button(page, "Table (CSV)").click()  # 5
    rows = list(csv.DictReader(Path(download.value.path()).read_text().splitlines()))
    assert len(rows) > 50
    # what is said beside the box is what the calibration file says
    near = min(rows, key=lambda row: abs(float(row["tip_K"]) - 600.0))
    bias_V = float(answer.inner_text().split("set a bias of ")[1].split(" V")[0])
    assert abs(bias_V - float(near["bias_V"])) < 0.1
    with page.expect_download() as download:
        button(page, "calibration as PDF").click()
    assert Path(download.value.path()).read_bytes().startswith(b"%PDF")
    with page.expect_download() as download:
        button(page, "Uncertainty budget (one sheet)").click()
    assert "Monte Carlo method" in Path(download.value.path()).read_text(encoding="utf-8")
    # another lever: the result says that it is of the one before, in this tab and in another
    other = page.context.new_page()
    go(other, app, "measurements")
    expect(other.locator("[data-answer=tip_K]")).to_contain_text("set a bias", timeout=_WORK)
    page.bring_to_front()
    page.get_by_role("combobox", name="Rests on").click()
    page.get_by_role("option", name="the lever, known as usual").click()
    expect(page.locator("[data-other]")).to_be_visible()
    expect(page.locator("[data-origin]")).to_contain_text("--fit lever-a.fit.json")
    picture(page, "something-else-is-chosen")
    other.close()
    # the files are those of the command line
    command = [sys.executable, "-m", "hotlever", "fit", "lever-a.csv", "-o", "again.json"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    ours = json.loads((folder / "lever-a.fit.json").read_text())
    theirs = json.loads((folder / "again.json").read_text())
    assert ours.keys() == theirs.keys()
    assert ours["options"] == theirs["options"]
    for name, parameter in theirs["parameters"].items():
        # a search is faster where another test has reduced the lever meanwhile
        near_to = pytest.approx(parameter["value"], abs=0.05 * parameter["stderr"])
        assert ours["parameters"][name]["value"] == near_to


def test_work_survives_a_reload_is_cancelled_and_may_die(app, page, folder):
    go(page, app, "measurements")
    stand_still(page, 1000.0)
    page.get_by_role("button", name="Fit", exact=True).first.click()
    stand_still(page)
    page.get_by_text("More", exact=True).click()
    stand_still(page)
    page.get_by_role("checkbox", name="posterior").click()
    expect(page.get_by_text("--posterior")).to_be_visible()
    before = _files(folder)
    button(page, "Fit").click()
    expect(button(page, "Cancel")).to_be_visible()
    page.wait_for_timeout(500)
    page.reload()
    expect(button(page, "Cancel")).to_be_visible()
    button(page, "Cancel").click()
    expect(page.get_by_text("cancelled: only what was done")).to_be_visible(timeout=_CANCEL)
    button(page, "Fit").click()
    expect(button(page, "Cancel")).to_be_visible()
    page.wait_for_timeout(500)
    for pid in _children(app.process.pid):
        if _is_worker(pid):
            os.kill(pid, signal.SIGKILL)
    expect(page.get_by_text("the process that worked on this died").first).to_be_visible()
    # the fit may have been done, and is whole; nothing else is there
    for name in set(_files(folder)) ^ set(before):
        assert json.loads((folder / name).read_text())["parameters"]
    # the app goes on, with new processes
    go(page, app, "lever")
    expect(page.locator("img[alt^='The lever from above']")).to_be_visible(timeout=_WORK)


def _files(folder: Path) -> list[str]:
    """Names of files, but for what a process that is killed as it writes may leave beside one."""
    names = (path.name for path in folder.iterdir())
    return sorted(name for name in names if not name.startswith(".hotlever-"))


def _children(pid: int) -> list[int]:
    text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(word) for word in text.split()]


def _is_worker(pid: int) -> bool:
    return b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()


def test_a_drawing_becomes_a_lever_that_sliders_and_pulses_move(app, page, folder):
    go(page, app, "lever")
    drop(page, EXAMPLES / "reference-probe.gds")
    expect(page.get_by_text("What the drawing holds")).to_be_visible(timeout=_WORK)
    thickness = page.get_by_role("textbox", name="thickness")
    expect(page.get_by_text("Layers of the drawing")).to_be_visible(timeout=_WORK)
    thickness.fill("0.41")
    expect(page.get_by_text("Something is set that is not saved.")).to_be_visible()
    picture(page, "lever-drawing")
    button(page, "Simulate").click()
    page.wait_for_url("**/simulate")
    sweep = "hotlever sweep reference-probe-2.toml --bias 0:12:49"
    expect(page.get_by_text(sweep)).to_be_visible(timeout=_WORK)
    expect(page.get_by_text("full lever:")).to_be_visible(timeout=_WORK)
    tip = page.locator("[data-number=tip_K]")
    cold = tip.inner_text()
    bias = page.get_by_role("slider", name="Bias V_b", exact=True).locator("[tabindex]")
    bias.press("ArrowRight")
    expect(tip).not_to_have_text(cold)
    expect(page.locator(".js-plotly-plot image").first).to_be_attached()
    for kind, name in (("NetCDF", "sweep.nc"), ("VTU", "sweep.fields")):
        with page.expect_download(timeout=_WORK) as download:
            page.get_by_role("button", name=kind, exact=True).first.click()
        assert name.split(".")[0] in download.value.suggested_filename or kind == "VTU"
    page.get_by_role("combobox", name="Compare with").click()
    page.get_by_role("option", name="reference probe").click()
    expect(page.locator("[data-number=beside]")).to_contain_text("mA", timeout=_WORK)
    button(page, "in time").click()
    button(page, "Follow").click()
    expect(page.locator("img[alt^='Voltages, current']")).to_be_visible(timeout=_WORK)
    expect(page.get_by_text("Dashed: reference probe.")).to_be_visible(timeout=_WORK)
    picture(page, "simulate-in-time")
    button(page, "film").click()
    expect(page.locator("img[alt^='The temperature map']")).to_be_visible(timeout=_WORK)
    button(page, "small signals").click()
    button(page, "Respond").click()
    expect(page.locator("img[alt^='Impedance']")).to_be_visible(timeout=_WORK)


def test_raman_spectra_become_temperatures(app, page, folder):
    go(page, app, "raman")
    page.get_by_text("Try the example").click()
    expect(page.get_by_text("hot-plate: 7 files")).to_be_visible()
    button(page, "Measure").click()
    expect(page.locator("img[alt^='Spectra']")).to_be_visible(timeout=_WORK)
    page.get_by_role("button", name="tip_04.txt").click()
    spectrum_text = page.locator("[data-spectrum]")
    expect(spectrum_text).to_contain_text("551.11 ± 2.52 K")
    page.evaluate("window.scrollTo(0, 0)")
    stand_still(page)
    box = page.locator(".js-plotly-plot .nsewdrag").first.bounding_box()
    page.mouse.click(box["x"] + box["width"] * 77.0 / 160.0, box["y"] + 100)  # at 517 cm⁻¹
    expect(spectrum_text).to_contain_text("by-hand")
    expect(page.locator("[data-other]")).to_be_visible()
    button(page, "Measure").click()
    expect(page.get_by_role("cell", name="by-hand")).to_be_visible(timeout=_WORK)
    assert (folder / "tip.raman.csv").exists()
    assert (folder / "tip-2.raman.csv").exists()
    picture(page, "raman")


def test_many_levers_fill_a_table(app, page):
    go(page, app, "measurements")
    drop(page, EXAMPLES / "lever-b.csv")
    expect(page.get_by_text("lever-b.csv").first).to_be_visible()
    button(page, "All").click()
    page.get_by_role("button", name="Fit", exact=True).first.click()
    button(page, "Fit all").click()
    expect(button(page, "Page (HTML)")).to_be_visible(timeout=_WORK)
    button(page, "lever-b").click()
    expect(page.get_by_text("fits/lever-b.json")).to_be_visible(timeout=_WORK)
    picture(page, "many-levers")


def test_bad_files_in_every_page_are_a_line(app, page, folder):
    # others are tried without a browser; negative currents are a measurement, which is refused
    # when it is fitted
    files = [
        file
        for number, file in enumerate(bad_files())
        if (number % 6 == 0 and file[0] != "negative.csv") or "a" * 99 in file[0]
    ]
    # files dropped one after another all arrive
    go(page, app, "measurements")
    names = [f"one-of-many-{number}.csv" for number in range(8)]
    for name in names:
        give(page, 0, name, b"V_b (V),I_h (furlongs)\n1,1\n2,2\n")
    # what was said of other files may still be there
    expect(page.get_by_role("alert").filter(has_text="furlongs").first).to_be_visible()
    deadline = time.monotonic() + 10
    while not all((folder / name).exists() for name in names) and time.monotonic() < deadline:
        page.wait_for_timeout(50)
    assert [name for name in names if not (folder / name).exists()] == []
    expect(page.locator(".q-uploader__file")).to_have_count(0)
    for address in ("measurements", "", "lever", "raman"):
        go(page, app, address)
        if address == "measurements":
            button(page, "None").click()
        for file in files:
            assert answer(page, app, address, 0, *file) != "silent", (address, file[0])
        assert "internal error" not in page.inner_text("body")
