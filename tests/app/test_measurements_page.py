"""The page Measurements: what was understood, what is asked of it, and whose the results are."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from elements import all_of, named, of, press, tell_columns, texts
from nicegui import ui
from nicegui.testing import User
from test_app_pages import Here, drop, text_of, until, visit, visited
from test_pages_at_work import at_once, understood

from hotlever.app import showing
from hotlever.app.pages.task_page import MEDIA
from hotlever.app.project import EXAMPLES
from hotlever.app.session import Job, Session, Task
from hotlever.estimate import calibrate
from hotlever.estimate.power_law import EQ12
from hotlever.files import CALIBRATION, TABLE
from hotlever.probe import Probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")
LEVER_A = (EXAMPLES / "lever-a.csv").read_bytes()
FIT: dict[str, Any] = {"kind": "fit"}
OTHER = "Something else is chosen now; this is still the result of:"


def rows(first: str, second: str, count: int = 20) -> str:
    return f"{first},{second}\n" + "".join(f"{n / 2},{n / 9}\n" for n in range(count))


def in_time() -> str:
    return "t (us),I_h (mA)\n" + "".join(f"{0.1 * n},{1.28 - 0.01 * n:.3f}\n" for n in range(20))


@visited
async def test_a_dropped_measurement_is_understood_and_what_is_asked_follows(
    user, session, tmp_path
):
    session.chosen["measurements"] = dict(FIT)
    await user.open("/measurements")
    await drop(user, "mine.csv", LEVER_A)
    await user.should_see("What was understood", retries=50)
    await user.should_see("hotlever fit mine.csv -o mine.fit.json")
    user.find("tip T_tip").click()
    await user.should_see("hotlever fit mine.csv --observables current,reader -o mine.fit.json")
    reader = next(one for one in all_of(user, ui.select) if one.value == "V_r")
    reader.set_value("")
    await user.should_see("--column 'unused=V_r", retries=50)
    # both that are dropped are asked together, into a folder of their own
    (tmp_path / "fits").mkdir()
    await drop(user, "b.csv", (EXAMPLES / "lever-b.csv").read_bytes())
    await until(lambda: of(user, ui.select, "Measurements").value == ["b.csv"])
    of(user, ui.select, "Measurements").set_value(["mine.csv", "b.csv"])
    await until(lambda: "Fit all" in [one.text for one in all_of(user, ui.button)])
    await user.should_see("fits-2-report -o fits-2", retries=50)


@pytest.mark.parametrize("medium", MEDIA)
def test_every_medium_of_the_page_can_be_asked(tmp_path, medium):
    (tmp_path / "mine.csv").write_bytes(LEVER_A)
    with contextlib.chdir(tmp_path):
        found = showing.understood(Here(), "mine.csv", {"medium": medium})
    assert found["observables"] == ["current", "reader", "tip"]


def test_the_circuit_that_a_file_states_counts_in_what_was_understood(tmp_path):
    """Its lever voltage was drawn from -9 to -0.5 V, with the series resistance of the probe."""
    text = LEVER_A.decode().replace("R_s (kOhm): 5.6", "R_s (kOhm): 0.82")
    (tmp_path / "mine.csv").write_text(text)
    found = understood(tmp_path)
    data = found["data"]
    bias, current = data["bias_V"], data["current_mA"]
    expected = [V - 0.82 * mA for V, mA in zip(bias, current, strict=True)]
    assert data["lever_V"] == pytest.approx(expected)
    assert min(data["lever_V"]) > 0.0
    assert (
        "series_resistance_ohm: the data file's 820 is used, not the probe's 5600"
        in (found["notes"])
    )


@visited
async def test_columns_and_pulses_belong_to_the_file_that_they_were_told_for(
    user, session, tmp_path
):
    (tmp_path / "timed.csv").write_text(in_time())

    session.chosen["measurements"] = {**FIT, "free": "n_d, a0"}
    await user.open("/measurements")
    await drop(user, "odd.csv", rows("a", "b").encode())
    await until(lambda: bool(text_of(user, "role=alert").strip()))
    await tell_columns(user)
    words = "odd.csv --column 'V_b (V)=a' --column 'I_h (mA)=b' --free n_d,a0 -o odd.fit.json"
    await user.should_see(f"hotlever fit {words}", retries=50)
    # the next file is another, and of another pulse
    await drop(user, "plain.csv", rows("V_b (V)", "I_h (mA)").encode())
    await user.should_see("hotlever fit plain.csv --free n_d,a0 -o plain.fit.json", retries=50)
    assert not text_of(user, "role=alert").strip()
    assert named(user, "Column a is") is None
    of(user, ui.select, "Measurements").set_value(["timed.csv"])
    await user.should_see("--pulse 10V,5us", retries=50)  # what is missing, and how to say it
    user.find("Pulse of a file in time (10V,20us)").type("9V, 5us")
    words = "fit timed.csv --free n_d,a0 --pulse 9V,5us -o timed.fit.json"
    await user.should_see(f"hotlever {words}", retries=50)
    of(user, ui.select, "Measurements").set_value(["odd.csv"])
    await user.should_see("odd.csv --column 'V_b (V)=a'", retries=50)
    await until(lambda: named(user, "Column a is").value == "V_b")


@visited
async def test_the_group_of_a_tdms_file_is_asked_for_and_kept(user, session, tmp_path):
    nptdms = pytest.importorskip("nptdms")
    bias = np.linspace(0.5, 4.0, 8)
    with nptdms.TdmsWriter(tmp_path / "two.tdms") as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(f"lever {number}", name, values, {"unit_string": unit})
                for number in (1, 2)
                for name, unit, values in (("V_b", "V", bias), ("I_h", "mA", bias / (6 + number)))
            ]
        )

    session.chosen["measurements"] = dict(FIT)
    await user.open("/measurements")
    of(user, ui.select, "Measurements").set_value(["two.tdms"])
    await user.should_see("2 groups, each a measurement of its own", retries=50)
    group = of(user, ui.select, "Group of the file")
    assert group.visible
    assert group.options == ["lever 1", "lever 2"]
    group.set_value("lever 2")
    words = "hotlever fit two.tdms --column 'group=lever 2' -o two.fit.json"
    await user.should_see(words, retries=50)
    await user.open("/measurements")
    await until(lambda: of(user, ui.select, "Group of the file").value == "lever 2")
    # what is told of a column is told beside it
    await until(lambda: named(user, "Column I_h (mA) is") is not None)
    named(user, "Column I_h (mA) is").set_value("")
    await user.should_see("--column 'group=lever 2' --column 'unused=I_h (mA)'", retries=50)


def calibrated(folder: Path, stem: str, probe: str = "", reason: str = "") -> Job:
    """Write a calibration of a measurement, and return the job that has done so."""
    with contextlib.chdir(folder):
        result = replace(calibrate(f"{stem}.csv", law=EQ12), reason=reason)
    output = f"{stem}{CALIBRATION}"
    options = {"probe": probe, "table": f"{stem}{TABLE}", "output": output}
    job = Job(Task("calibrate", (f"{stem}.csv",), options), began=0.0)
    job.end("done")
    result.write(folder / output)
    return job


@visited
async def test_a_result_keeps_its_command_line_and_is_marked_when_something_else_is_chosen(
    user, session, tmp_path
):
    """The numbers of one lever stood above the command line of another."""
    (tmp_path / "mine.csv").write_bytes(LEVER_A)
    (tmp_path / "other.toml").write_text(Probe.u_shape().to_toml())
    job = calibrated(tmp_path, "mine")
    own = "hotlever calibrate mine.csv --table mine.table.csv -o mine.calibration.json"
    job.began = (tmp_path / "mine.csv").stat().st_mtime

    session.jobs.add("measurements", job)
    session.chosen["measurements"] = {"data": ["mine.csv"]}
    await user.open("/measurements")
    await until(lambda: "set a bias of" in text_of(user, "data-answer=tip_K"))
    answer = text_of(user, "data-answer=tip_K")

    def is_marked() -> bool:
        return OTHER in texts(user)

    def origin() -> str:
        return text_of(user, "data-origin=1")

    assert (origin(), is_marked()) == (own, False)
    for label, value in (("Lever", "other.toml"), ("Medium", "air")):
        before = of(user, ui.select, label).value
        of(user, ui.select, label).set_value(value)
        await until(is_marked)
        assert (origin(), text_of(user, "data-answer=tip_K")) == (own, answer)
        await until(lambda: session.jobs.of("measurements") == [job])
        of(user, ui.select, label).set_value(before)
        await until(lambda: not is_marked())
    field = of(user, ui.input, "Known beforehand (n_d=3.3e17±15%)")
    field.set_value("n_d=±5%")
    await until(is_marked)
    field.set_value("")
    await until(lambda: not is_marked())
    # another lever from another page or tab
    session.choose_lever("other.toml")
    await until(is_marked)
    session.choose_lever("")
    await until(lambda: not is_marked())
    # what it was made of has changed since
    (tmp_path / "mine.csv").write_bytes(LEVER_A)
    job.began -= 60.0
    of(user, ui.select, "Medium").set_value("air")
    of(user, ui.select, "Medium").set_value("")
    await asyncio.sleep(0.3)
    assert is_marked()


@visited
async def test_a_result_that_comes_late_goes_to_what_it_was_asked_for(user, session, tmp_path):
    for name in ("mine.csv", "next.csv"):
        (tmp_path / name).write_bytes(LEVER_A)
    job = calibrated(tmp_path, "mine")
    job.standing = "running"

    session.jobs.add("measurements", job)
    session.chosen["measurements"] = {"data": ["mine.csv"]}
    await user.open("/measurements")
    of(user, ui.select, "Measurements").set_value(["next.csv"])
    await user.should_see("hotlever calibrate next.csv", retries=50)
    job.end("done")
    await user.should_see("mine.calibration.json is written, of mine.csv", retries=50)
    await asyncio.sleep(0.3)
    assert text_of(user, "data-answer=tip_K") == text_of(user, "data-origin=1") == ""
    of(user, ui.select, "Measurements").set_value(["mine.csv"])
    await until(lambda: "set a bias of" in text_of(user, "data-answer=tip_K"))
    assert "mine.csv" in text_of(user, "data-origin=1")


def test_a_refused_calibration_of_the_folder_says_nothing_of_what_to_set(tmp_path):
    """It showed 600 K ± 5 K below the line that no such lever shows the data."""
    (tmp_path / "mine.csv").write_bytes(LEVER_A)
    answered: dict[str, str] = {}
    for reason in ("", "current differs by 7%"):
        calibrated(tmp_path, "mine", reason=reason)

        async def story(user: User, session: Session, reason: str = reason) -> None:
            at_once(session)
            await user.open("/measurements")
            of(user, ui.select, "Or open a result of the folder").set_value("mine.calibration.json")
            mark = "data-answer=none" if reason else "data-answer=tip_K"
            await until(lambda: len(text_of(user, mark)) > 10)
            await user.should_see("A result of the folder, made of mine.csv")
            answered[reason] = " ".join(
                text_of(user, f"data-answer={along}")
                for along in ("none", "tip_K", "bias_V", "power_mW")
            )
            if not reason:
                user.find("Propose").click()
                # by the paper's rule there is no posterior to ask
                await user.should_see("expected one of a probe with priors", retries=50)

        visit(tmp_path, story)
    assert answered[""].count("set a bias of") == 3
    assert "This calibration does not tell. No lever like this one shows these data: current " in (
        refusal := answered["current differs by 7%"]
    )
    assert "set a bias" not in refusal
    assert "±" not in refusal


@visited
async def test_a_chosen_file_that_is_gone_gives_no_other_numbers(user, session, tmp_path):
    (tmp_path / "mine.csv").write_bytes(LEVER_A)

    session.probe = "gone.toml"
    session.chosen["measurements"] = {"rests": "fit:gone.json", "data": ["mine.csv"]}
    await user.open("/measurements")
    await until(lambda: "gone.toml: no such file" in text_of(user, "role=alert"))
    assert of(user, ui.select, "Lever").value == "gone.toml"
    await user.should_see("hotlever calibrate mine.csv --fit gone.json", retries=50)


@visited
async def test_the_lever_that_is_chosen_on_one_page_is_that_of_all(user, session, tmp_path):
    (tmp_path / "mine.csv").write_bytes(LEVER_A)
    (tmp_path / "own.toml").write_text(Probe.reference().to_toml())
    lines = {
        "/simulate": "hotlever sweep own.toml",
        "/contact": "hotlever contact own.toml",
        "/reader": "hotlever reader own.toml",
        "/lever": "hotlever probe show own.toml",
    }

    session.workers["quick"] = session.workers["full"] = Resting()  # type: ignore[assignment]
    await user.open("/measurements")
    await until(lambda: of(user, ui.select, "Measurements").value == ["mine.csv"])
    of(user, ui.select, "Lever").set_value("own.toml")
    await user.should_see("hotlever calibrate mine.csv --probe own.toml", retries=50)
    for address, line in lines.items():
        await user.open(address)
        await user.should_see(line, retries=50)
        assert of(user, ui.select, "Lever").value == "own.toml"


class Resting(Here):
    """Solves no lever."""

    async def call(self, function: Callable[..., Any], *arguments: Any, heard: Any = None) -> Any:
        if function.__name__ == "answer":
            await asyncio.sleep(60.0)
        return await super().call(function, *arguments, heard=heard)


# --- measured with a source meter ---------------------------------------------------------------


@visited
async def test_a_lever_is_drawn_while_it_is_measured_and_its_rows_are_taken(
    user, session, tmp_path
):
    pytest.importorskip("pyvisa")

    at_once(session)
    session.chosen["measure"] = {
        "source": "twin:3", "bias": "1.5:5.5:4", "settle": "0s", "stay_below": "500K",
        "reader": "", "compliance": "2mA", "propose": False,
    }  # fmt: skip
    await user.open("/measurements")
    line = (
        "hotlever measure --source twin:3 --bias 1.5:5.5:4 --settle 0s --stay-below 500K "
        "--compliance 2mA -o reference-iv.csv"
    )
    await user.should_see(line)
    press(user, "Measure")
    await until(lambda: of(user, ui.select, "Measurements").value == ["reference-iv.csv"])
    await user.should_see("Dashed: the limit, 500 K.", retries=50)
    await user.should_see("4 rows in reference-iv.csv")
    current, tip = all_of(user, ui.plotly)[:2]
    (measured,) = current.figure["data"]
    band, estimate, before, limit = tip.figure["data"]
    assert len(measured["x"]) == len(before["y"]) == 4
    assert limit["y"] == [500.0, 500.0]
    # what was foretold of the last row, and the band by what is known now
    assert estimate["y"][-1] < before["y"][-1] < 500.0
    low, high = np.reshape([*band["y"]], (2, -1))
    assert (low < estimate["y"]).all()
    assert (high[::-1] > estimate["y"]).all()


@visited
async def test_a_measurement_is_stopped_and_says_that_its_output_is_off(user, session, tmp_path):
    pytest.importorskip("pyvisa")

    options = {"source": "twin:3", "bias": "1:4:7", "settle": "600s", "output": "iv.csv"}
    job = session.jobs.start("measure", Task("measure", (), options))
    await user.open("/measurements")
    await until_file(tmp_path / "iv.csv", "source: KEITHLEY")
    press(user, "Stop")
    for _ in range(600):
        if job.standing != "running":
            break
        await asyncio.sleep(0.1)
    assert job.standing == "failed"
    assert job.message == "iv.csv: 0 rows; stopped by the user, the output is off"
    await user.should_see(job.message, retries=50)


async def until_file(path: Path, text: str) -> None:
    """Wait, a minute at most, until a file holds a text."""
    for _ in range(600):
        if path.exists() and text in path.read_text(encoding="utf-8"):
            return
        await asyncio.sleep(0.1)
    raise AssertionError(f"{path} does not say {text}")
