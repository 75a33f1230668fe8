"""What pages show of tasks: fits on their way, pulses, and the files that leave."""

from __future__ import annotations

import contextlib
import csv
import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from elements import plots
from nicegui import ui
from test_app_pages import Here, text_of, until, visited

from hotlever.app import showing
from hotlever.app.pages.frame import ErrorBanner
from hotlever.app.pages.simulate import Pulses
from hotlever.app.project import EXAMPLES
from hotlever.app.session import Job, Session, Task, run
from hotlever.cache import CACHE_VARIABLE
from hotlever.errors import HotleverError


class Hearing(Here):
    """Hears a task in this process, for its job."""

    def __init__(self, job: Job) -> None:
        super().__init__()
        self._job = job

    def send(self, kind: str, content: Any) -> None:
        super().send(kind, content)
        self._job.hear(kind, content)


def done(task: Task, folder: Path) -> tuple[Job, list[Any]]:
    """Do a task as a worker does; return the job, and the curves that it has shown."""
    job = Job(task)
    here = Hearing(job)
    try:
        with contextlib.chdir(folder):
            run(here, task)
        job.end("failed" if job.message else "done")
    except HotleverError as error:
        job.end("failed", str(error))
    return job, [content for kind, content in here.sent if kind == "curve"]


def at_once(session: Session) -> None:
    """Have tasks of pages done in this process, before the page goes on."""

    def start(page: str, task: Task) -> Job:
        return session.jobs.add(page, done(task, session.project.folder)[0])

    session.jobs.start = start  # type: ignore[method-assign]


def understood(folder: Path) -> dict[str, Any]:
    """Return what a measurement is understood as, in this process."""
    here: Any = Here()
    with contextlib.chdir(folder):
        return showing.understood(here, "mine.csv", {})


@visited
async def test_the_lever_that_is_fitted_is_drawn_beside_the_data(
    user, session, tmp_path, monkeypatch
):
    # where the geometry has been reduced before, a fit begins near its end
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    (tmp_path / "mine.csv").write_bytes((EXAMPLES / "lever-a.csv").read_bytes())
    job, curves = done(Task("fit", ("mine.csv",), {"output": "mine.fit.json"}), tmp_path)
    assert job.standing == "done"
    data = understood(tmp_path)["data"]

    def off(curve: dict[str, list[float]]) -> float:
        model = np.interp(data["bias_V"], curve["bias_V"], curve["current_mA"])
        return float(np.sqrt(np.mean((model - data["current_mA"]) ** 2)))

    # it comes nearer, down to the noise
    assert len(curves) > 2
    assert off(curves[0]) > 5 * off(curves[-1])
    assert off(curves[-1]) < 0.005

    session.jobs.add("measurements", job)
    session.chosen["measurements"] = {"kind": "fit", "data": ["mine.csv"]}
    await user.open("/measurements")
    await user.should_see("Line: the lever as the fit has it", retries=50)
    measured, model = plots(user)[0]["data"]
    assert len(measured["x"]) == len(model["x"]) == len(data["bias_V"])
    assert model["y"] == pytest.approx(curves[-1]["current_mA"], rel=1e-4)


@pytest.mark.slow
@visited
async def test_pulses_in_the_page_are_those_of_the_command_and_of_python(user, session, tmp_path):
    chosen = {"kind": "train", "height": 6.0, "length": 1.0, "period": 2.5, "count": 2}
    lever = {"probe": "", "changes": {"c_kappa": 0.7}, "view": "time"}

    session.reduced["", ()] = False
    session.chosen |= {"simulate": lever, "pulse": {**chosen, "until": 4.0}}
    await user.open("/simulate")
    words = "pulse --set c_kappa=0.7 --pulse 6V,1us --period 2.5us --count 2 --until 4us"
    words += " -o reference.pulse.csv --plot reference.pulse.svg"
    await user.should_see(f"hotlever {words}", retries=50)
    with user:
        task = Pulses(session, ErrorBanner(""), session.chosen["simulate"]).task()
    assert task.line == f"hotlever {words}"
    job = session.jobs.add("pulse", done(task, tmp_path)[0])
    await user.open("/simulate")
    labels = [one.text for one in user.client.elements.values() if isinstance(one, ui.label)]
    assert f"hotlever {words}" in labels  # of the result
    lines = next(text for text in labels if "simulate(lever, " in text)
    found: dict[str, Any] = {}
    exec(lines, found)
    history = found["history"]
    tip, time_us = history.tip_K.values, history.time.values
    highest, at = tip.max(), time_us[tip.argmax()]
    assert text_of(user, "data-number=tip, highest") == f"{highest:.1f} K at {at:.4g} µs"
    assert at == 3.5
    mean = np.trapezoid(tip, time_us) / 4.0
    stated_mean_K = float(text_of(user, "data-number=tip, mean").split()[0])
    assert stated_mean_K == pytest.approx(mean, abs=0.5)
    rows = list(csv.DictReader((tmp_path / "reference.pulse.csv").read_text().splitlines()))
    assert [float(row["tip_K"]) for row in rows] == pytest.approx(tip)
    assert job.standing == "done"


@visited
async def test_fields_leave_as_one_file(user, session, tmp_path):
    await user.open("/simulate")
    job = Job(Task("pulse", (), {"fields": "a.fields"}))
    (tmp_path / "a.fields").mkdir()
    for name in ("1.vtu", "2.vtu"):
        (tmp_path / "a.fields" / name).write_text(name)
    with user:
        lever = {"probe": "", "changes": {}, "beside": ""}
        await Pulses(session, ErrorBanner(""), lever).give(job)
        await until(lambda: bool(user.download.http_responses))
    packed = zipfile.ZipFile(io.BytesIO(user.download.http_responses[-1].content))
    assert packed.namelist() == ["1.vtu", "2.vtu"]


def test_what_was_measured_in_time_is_drawn_against_time(tmp_path):
    rows = "".join(f"{0.1 * n},9,{1.28 - 0.01 * n:.3f}\n" for n in range(20))
    (tmp_path / "mine.csv").write_text(f"t (us),V_b (V),I_h (mA)\n{rows}")
    found = understood(tmp_path)
    assert found["data"]["time_us"] == pytest.approx([0.1 * n for n in range(20)])
    assert len(found["data"]["current_mA"]) == 20
