"""The pages, with NiceGUI's simulated user: bad files, peaks by hand, and where to begin."""

from __future__ import annotations

import asyncio
import contextlib
import csv
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from elements import of, plots, press
from nicegui import ui
from nicegui.testing import User
from test_app_pages import Here, drop, text_of, until, visited

from app_in_browser import bad_files
from hotlever.app import showing
from hotlever.app.pages.measurements import MeasurementsPage
from hotlever.app.pages.start import QUESTIONS, choose_file
from hotlever.app.project import DRAWINGS, EXAMPLES, Project, safe_name
from hotlever.app.session import Task
from hotlever.probe import Probe

#: Measurements, which only a fit or a calibration will refuse.
POOR = ("one-row.csv", "negative.csv")


def _imported(name: str) -> Task:
    stem = Path(name).stem
    return Task("probe import", (name,), {"output": f"{stem}.toml", "plot": f"{stem}.svg"})


@pytest.mark.parametrize("address", ["/measurements", "/", "/lever", "/raman"])
@visited
async def test_bad_files_are_a_line_each_and_the_page_goes_on(user, session, tmp_path, address):
    # what a command will refuse, and is no mistake of the page
    accepted_suffixes = {"/": (*POOR, *DRAWINGS), "/measurements": POOR, "/lever": DRAWINGS}

    tasks: list[Task] = []
    session.jobs.start = lambda page, task: tasks.append(task)  # type: ignore
    await user.open(address)
    for name, content in bad_files():
        client = user.client
        for one in user.client.elements.values():
            if one.props.get("role") == "alert":
                one.set_text("")  # what was said of the file before
        await drop(user, name, content)
        if name.endswith(accepted_suffixes.get(address, ())):
            if address == "/":
                await until(lambda c=client: user.client is not c)  # it went on
                await user.open(address)
            elif address == "/lever":
                await until(lambda n=name: tasks[-1:] == [_imported(n)])
            assert not text_of(user, "role=alert").strip(), name
            continue
        await until(lambda: bool(text_of(user, "role=alert").strip()))
        line = text_of(user, "role=alert")
        assert Path(safe_name(name)).stem in line, name
        assert "internal error" not in line, name
        assert "Traceback" not in line
    good = {
        "/lever": ("good.toml", Probe.reference().to_toml().encode()),
        "/raman": ("good.txt", (EXAMPLES / "raman" / "tip" / "tip_00.txt").read_bytes()),
    }
    name, content = good.get(address, ("good.csv", (EXAMPLES / "lever-a.csv").read_bytes()))
    await drop(user, name, content)
    if address != "/":
        await until(lambda: not text_of(user, "role=alert").strip())


@visited
async def test_a_line_is_corrected_by_hand_as_by_the_command(
    user, session, tmp_path, run, monkeypatch
):
    for name in ("tip", "hot-plate"):
        shutil.copytree(EXAMPLES / "raman" / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    texts: list[str] = []

    def spectrum_text() -> str:
        return text_of(user, "data-spectrum=1")

    tasks: list[Task] = []
    session.jobs.start = lambda page, task: tasks.append(task)  # type: ignore
    session.chosen["raman"] = {"spectrum": "tip/tip_04.txt"}
    await user.open("/raman")
    await until(lambda: "551.11 ± 2.52 K" in spectrum_text())
    user.find(kind=ui.plotly).trigger("plotly_click", {"points": [{"x": 516.94, "y": 400.0}]})
    await until(lambda: "by-hand" in spectrum_text())
    user.find(kind=ui.plotly).trigger("plotly_selected", {"range": {"x": [545.0, 490.0]}})
    await until(lambda: spectrum_text().endswith("(by-hand)"))
    await user.should_see("--corrections tip.corrections.csv")
    assert not (tmp_path / "tip.corrections.csv").exists()
    press(user, "Measure")
    _, out, _ = run(*shlex.split(tasks[-1].line.partition(" --save")[0])[1:])
    texts.extend((spectrum_text(), out))
    of(user, ui.checkbox).set_value(True)
    await until(lambda: spectrum_text() == "left-out")
    # another correction is another file
    await user.should_see("--corrections tip-2.corrections.csv")
    user.find("As found").click()
    await until(lambda: "551.11 ± 2.52 K" in spectrum_text())
    press(user, "Measure")
    assert "--corrections" not in tasks[-1].line
    # they are those of the file again when that is chosen
    of(user, ui.select, "Corrected by hand in").set_value("tip.corrections.csv")
    await until(lambda: spectrum_text().endswith("(by-hand)"))
    await user.should_see("--corrections tip.corrections.csv")

    row = next(one for one in csv.DictReader(texts[1].splitlines()) if one["file"] == "tip_04.txt")
    line = "{center_cm-1} ± {center_stderr_cm-1} cm⁻¹, width {fwhm_cm-1} cm⁻¹"
    line += ", {temperature_K} ± {temperature_error_K} K ({flags})"
    assert texts[0] == line.format(**row)


def test_a_temperature_beyond_the_calibrated_ones_is_said_to_be_at_its_spectrum(tmp_path):
    """It was said in the table alone."""
    Project(tmp_path).take_example_folders("raman", "hot-plate", "tip")
    with contextlib.chdir(tmp_path):
        task = Task("raman", ("tip",), {"calibrate_from": ["hot-plate"]})
        spectrum = showing.spectrum(Here(), "tip/tip_11.txt", task, {})
    assert spectrum["text"].endswith("K (low-shoulder, extrapolated)")


@visited
async def test_a_measurement_chosen_at_the_start_hides_the_result_of_another(
    user, session, tmp_path
):
    session.chosen["measurements"] = {**MeasurementsPage.first, "opened": "b.fit.json"}
    assert choose_file(session, "a.csv") == "measurements"
    assert session.chosen["measurements"]["data"] == ["a.csv"]
    assert session.chosen["measurements"]["opened"] == ""


@visited
async def test_questions_of_the_gallery_open_pages_or_scripts(user, session, tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert list(QUESTIONS) == re.findall(r"gallery/(\w+)\.png", page)

    for opened in QUESTIONS.values():
        if opened is not None:
            opened.set_up(session)
            assert opened.page in session.chosen
    assert session.probe == "palladium-on-nitride.toml"
    await user.open("/measurements")
    await user.should_see("hotlever fit lever-a.csv --probe palladium", retries=50)
    await user.open("/raman")
    await user.should_see("hotlever raman tip --calibrate-from hot-plate", retries=50)
    await user.open("/")
    for question in re.findall(r"^## (.+)", page, re.MULTILINE):
        await user.should_see(question)
    user.find(kind=ui.button, content="Script").click()
    await user.should_see("knee = lever.knee()")


@visited
async def test_a_page_that_waits_for_a_busy_process_is_shown(user, session, tmp_path):
    asked: list[Callable[..., Any]] = []

    class Busy(Here):
        async def call(
            self, function: Callable[..., Any], *arguments: Any, heard: Any = None
        ) -> Any:
            await asyncio.sleep(3.5 * (not asked))  # longer than a page may take, once
            asked.append(function)
            return await super().call(function, *arguments, heard=heard)

    session.workers["full"] = Busy()  # type: ignore[assignment]
    (tmp_path / "lever-a.csv").write_bytes((EXAMPLES / "lever-a.csv").read_bytes())
    await user.open("/measurements")
    await user.should_see("Measurements")
    await user.should_see("What was understood", retries=200)


def titles(user: User) -> str:
    """Return the titles of what can be unfolded."""
    there = [one for one in user.client.elements.values() if isinstance(one, ui.expansion)]
    return "; ".join(str(one.props["label"]) for one in there)


@visited
async def test_without_a_measurement_an_example_is_shown(user, session, tmp_path):
    """Logs, spectra and results are there, and none of them is taken for a measurement."""
    shutil.copy(EXAMPLES / "raman" / "tip" / "tip_00.txt", tmp_path)
    (tmp_path / "log.csv").write_text("time (s),temperature (K)\n0,293\n1,294\n")
    (tmp_path / "result.csv").write_text(
        "bias_V,current_mA,lever_V,reader_V,tip_K,power_mW,heater_ohm,legs_ohm\n"
        "1,0.144,0.192,0.056,295.4,0.028,753,574\n2,0.288,0.386,0.113,302.7,0.111,763,577\n"
    )

    await user.open("/measurements")
    await until(lambda: "An example, lever-a.csv" in titles(user))
    assert len(plots(user)[0]["data"][0]["x"]) == 25
    assert not text_of(user, "role=alert").strip()
    assert session.chosen["measurements"]["data"] == []
    user.find("Try the example").click()
    await user.should_see("hotlever calibrate lever-a.csv", retries=50)
    assert (tmp_path / "lever-a.csv").is_file()
    # a measurement that is there is taken the next time, whatever is newer
    (tmp_path / "newer.csv").write_text("time (s),temperature (K)\n0,293\n1,294\n")
    session.chosen["measurements"]["data"] = None
    await user.open("/measurements")
    await user.should_see("hotlever calibrate lever-a.csv", retries=50)
    # and all that are there
    (tmp_path / "lever-b.csv").write_bytes((EXAMPLES / "lever-b.csv").read_bytes())
    press(user, "All")
    await user.should_see("hotlever calibrate lever-b.csv lever-a.csv", retries=50)
