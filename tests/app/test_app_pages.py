"""The pages, with NiceGUI's simulated user: what is shown, dropped, and computed."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import csv
import inspect
import io
import sys
from collections.abc import Awaitable, Callable
from functools import partial, wraps
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from elements import all_of, named, until
from nicegui import ui
from nicegui.testing import User, user_simulation
from PIL import Image

from hotlever.app import live
from hotlever.app.pages import plots
from hotlever.app.project import EXAMPLES, Project
from hotlever.app.server import add_pages
from hotlever.app.session import Jobs, Session, Task
from hotlever.app.workers import Report
from hotlever.errors import BranchEndError, HotleverError, InputError
from hotlever.lever import Lever
from hotlever.probe import Probe

#: What is asked here is so on any mesh.
pytestmark = pytest.mark.usefixtures("coarse_meshes")

Run = Callable[..., tuple[int, str, str]]
#: The field of a dimension.
LENGTH = "length (µm)"
#: A sweep of the reference probe.
REFERENCE = Task("sweep")


class Here(Report):
    """Answers calls in this process, where a `Worker` has a process of its own."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, Any]] = []

    def send(self, kind: str, content: Any) -> None:
        self.sent.append((kind, content))

    async def call(self, function: Callable[..., Any], *arguments: Any, heard: Any = None) -> Any:
        self.sent = []
        result = function(self, *arguments)
        for kind, content in self.sent:
            if heard is not None:
                heard(kind, content)
        return result


def visit(folder: Path, story: Callable[[User, Session], Awaitable[None]]) -> None:
    """Let a user visit the app in a folder, in which its workers work."""

    async def run_story() -> None:
        async with user_simulation() as user:
            session = Session(Project(folder))
            session.workers = dict.fromkeys(("quick", "full", "making"), Here())  # type: ignore[arg-type]
            add_pages(session)
            await story(user, session)

    modules = dict(sys.modules)
    try:
        with contextlib.chdir(folder):
            asyncio.run(run_story())
    finally:
        # the simulation takes out those of its pages, this package among them
        sys.modules.update(modules)


def visited(story: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    """Make a test of what a user does in the app, who visits it in the folder of the test."""

    @wraps(story)
    def test(tmp_path: Path, **fixtures: Any) -> None:
        visit(tmp_path, partial(story, tmp_path=tmp_path, **fixtures))

    _user, _session, *asked = inspect.signature(story).parameters.values()
    test.__signature__ = inspect.Signature(asked)  # type: ignore[attr-defined]
    return test


async def drop(user: User, name: str, content: bytes, zone: int = 0) -> None:
    """Drop a file in a page."""
    zones = [one for one in user.client.elements.values() if isinstance(one, ui.upload)]
    upload = sorted(zones, key=lambda one: one.id)[zone]
    await upload.handle_uploads([ui.upload.SmallFileUpload(name, "", content)])


def text_of(user: User, mark: str) -> str:
    """Return the text of the element that has an attribute."""
    key, _, value = mark.partition("=")
    found = [one for one in user.client.elements.values() if one.props.get(key) == value]
    return " ".join(one.text for one in found if getattr(one, "visible", True))


def drawn(user: User) -> str:
    """Return the last figure of a page."""
    images = [one for one in user.client.elements.values() if one.tag == "img"]
    return base64.b64decode(images[-1].props["src"].partition(",")[2]).decode()


@visited
async def test_every_page_opens_in_an_empty_folder(user, session, tmp_path):
    for address, words in {
        "/": "Try it",
        "/lever": "heater (low-doped)",
        "/raman": "Measure",
        "/measurements": "Try the example",
    }.items():
        await user.open(address)
        if address != "/lever":
            await user.should_see(words)
        assert text_of(user, "role=alert").strip() == ""


@visited
async def test_simulate_shows_the_numbers_of_the_sweep(user, session, tmp_path, run):
    _, out, _ = run("sweep", "--bias", "8:8:1", "--set", "n_d=5e17")
    row = next(csv.DictReader(out.splitlines()))

    session.chosen["simulate"] = {
        "probe": "",
        "changes": {"n_d": 5e17},
        "bias": 8.0,
        "most": 12.0,
    }
    session.reduced["", ()] = False  # it is not what is tested, and takes long
    await user.open("/simulate")
    await until(lambda: "full lever" in text_of(user, "aria-live=polite"))
    for key, form in (("tip_K", "{:.1f} K"), ("current_mA", "{:.4f} mA")):
        assert text_of(user, f"data-number={key}") == form.format(float(row[key]))
    answer = await session.ask(
        "full",
        live.answer,
        Task("sweep", (), {"set": ["n_d=5e17"]}),
        *(8.0, 12.0, False),
    )
    for key in ("tip_K", "current_mA", "lever_V", "reader_V", "power_mW"):
        assert f"{answer['now'][key]:.10g}" == row[key]
    line = "hotlever sweep --bias 0:12:49 --set n_d=5e+17 -o reference.sweep.csv"
    await user.should_see(line)
    fields = {one.props.get("label"): one for one in user.client.elements.values()}
    fields["A table of states"].set_value("resistance")
    fields["Set points"].set_value("2.9kohm")
    line = "hotlever sweep --hold-resistance 2.9kohm --set n_d=5e+17 -o reference.sweep.csv"
    await user.should_see(line)
    await user.should_see('hold(lever, "resistance", [2900.0]).data  # ohm')


def test_simulate_goes_as_far_as_the_lever(tmp_path):
    """Beyond the slider's end too, where only the curves shown at first ended."""
    resistance, here = 8000.0, Here()
    task = Task("sweep", (), {"set": [f"series_resistance_ohm={resistance}"]})
    found = live.answer(here, task, 14.0, 12.0, quick=False)
    probe = Probe.reference().with_(series_resistance_ohm=resistance)
    tip_K = Lever(probe).sweep([14.0]).tip_K.item()
    assert found["now"]["tip_K"] == pytest.approx(tip_K, abs=1e-6)
    with pytest.raises(BranchEndError, match=r"^silicon melts at a bias of 13\.2"):
        live.answer(here, REFERENCE, 14.0, 12.0, quick=False)


def test_where_the_reduced_lever_ends_another_answers(tmp_path, monkeypatch, coarse, reduced):
    monkeypatch.setattr(live, "_reduced", lambda probe: (coarse, reduced))
    live._quick.cache_clear()
    for bias, model in ((8.0, "reduced lever"), (13.0, "coarse lever")):
        found = live.answer(Here(), REFERENCE, bias, 12.0, quick=True, reduced=True)
        assert found["model"] == model
        assert found["now"]["tip_K"] == pytest.approx(coarse.sweep([bias]).tip_K.item(), abs=0.2)
    live._quick.cache_clear()


@visited
async def test_numbers_of_another_bias_are_not_shown(user, session, tmp_path):
    session.chosen["simulate"] = {"probe": "", "changes": {}, "bias": 8.0, "most": 12.0}
    session.reduced["", ()] = False
    await user.open("/simulate")
    await until(lambda: "full lever" in text_of(user, "aria-live=polite"))
    assert "K" in text_of(user, "data-number=tip_K")
    number = named(user, "Bias V_b", ui.number)
    number.set_value(14.0)
    await until(lambda: "silicon melts" in text_of(user, "role=alert"))
    for key in ("tip_K", "current_mA", "lever_V", "power_mW", "reader_V", "knee"):
        assert text_of(user, f"data-number={key}") == "–"
    assert "full lever" not in text_of(user, "aria-live=polite")
    number.set_value(13.0)
    await until(lambda: "full lever" in text_of(user, "aria-live=polite"))
    assert "silicon melts" not in text_of(user, "role=alert")


def test_a_lever_that_moves_shows_nearly_what_it_shows_at_rest(tmp_path):
    task = Task("sweep", (), {"set": ["n_d=5e17"]})
    coarse, full = (live.answer(Here(), task, 8.0, 12.0, quick) for quick in (True, False))
    assert coarse["model"] == "coarse lever"
    assert abs(coarse["now"]["tip_K"] - full["now"]["tip_K"]) < 2.0
    assert np.abs(coarse["now"]["line"] - full["now"]["line"]).max() < 5.0
    # the map and the profile hold the tip's temperature
    picture = np.asarray(Image.open(io.BytesIO(full["now"]["picture"])))
    left, right, bottom, top = full["box"]
    assert picture.shape[1] / picture.shape[0] == pytest.approx((right - left) / (top - bottom))
    inside = picture[..., 3] > 0
    area = inside.mean() * (right - left) * (top - bottom)
    drawn = sum(region.area for region in Probe.reference().layout().regions)
    assert area == pytest.approx(drawn, rel=0.02)
    bright = np.where(inside, picture[..., :3].sum(axis=2, dtype=int), 0)
    hottest = np.unravel_index(bright.argmax(), bright.shape)[1]
    at = left + (hottest + 0.5) / picture.shape[1] * (right - left)
    assert at == pytest.approx(48.6, abs=1.0)
    assert full["now"]["line"].max() == pytest.approx(full["now"]["hottest_K"], abs=2.0)


@visited
async def test_plots_follow_a_lever_that_is_hotter_beside_its_tip(user, session, tmp_path, run):
    """The hottest parts of the profile were beyond its axis, and those of a lever beside."""
    run("probe", "import", str(EXAMPLES / "reference-probe.gds"), "-o", "drawn.toml")
    text = Path("drawn.toml").read_text()
    Path("off.toml").write_text(text.replace("tip_um = [48.58, 0.0]", "tip_um = [53.0, 0.0]"))
    off, usual = (
        live.answer(Here(), Task("sweep", files), 12.0, 12.0, False)
        for files in (("off.toml",), ())
    )
    assert off["now"]["line"].max() > off["curves"]["tip_K"].max()
    await user.open("/")
    with user.client:
        shown = plots.LivePlots()
    (profile,) = (plot for plot in all_of(user, ui.plotly) if "along" in plot.props["aria-label"])
    for answer in (off, usual):
        shown.show(answer)
        shown.beside(usual, "")
        low, high = profile.figure["layout"]["yaxis"]["range"]
        drawn = np.concatenate([trace["y"] for trace in profile.figure["data"]])
        assert low - 0.1 < drawn.min()
        assert drawn.max() <= high


@visited
async def test_the_outline_of_the_map_follows_a_dimension(user, session, tmp_path):
    """It stayed that of before where neither the lever's ends nor the scale of colours moved."""
    first, second = (
        live.answer(
            Here(), Task("sweep", (), {"set": [f"heater_width_um={width}"]}), 4.0, 6.0, True
        )
        for width in (1.6, 1.7)
    )
    assert first["box"] == second["box"]
    assert first["now"]["scale_K"] == second["now"]["scale_K"]
    await user.open("/")
    with user.client:
        shown = plots.LivePlots()
    sent: list[Any] = []
    heat = named(user, "Map of the temperature", ui.plotly)
    shown.show(first)
    shown._ready.add(heat)  # as once a browser has drawn it
    heat.run_plot_method = lambda *what: sent.append(what)
    shown.show(first)
    assert [name for name, _ in sent] == ["relayout"]
    shown.show(second)
    assert len(sent) == 1  # more than the picture has changed: the whole figure is sent
    paths = [shape["path"] for shape in heat.figure["layout"]["shapes"]]
    assert paths == [plots.outlined(ring)["path"] for ring in second["outline"]]


def test_a_negative_bias_is_refused_in_words_that_are_true(tmp_path):
    """It was said that no steady state lies there, of levers that the command sweeps there."""
    held = {"set": ["circuit.reader.kind=supply", "circuit.reader.bias_V=2"]}
    with pytest.raises(InputError, match="found a bias of -4 V, expected 0 or more"):
        live.answer(Here(), Task("sweep", (), held), -4.0, 12.0, True)


def test_commands_run_in_processes_that_can_be_ended(tmp_path):
    (tmp_path / "lever-a.csv").write_bytes((EXAMPLES / "lever-a.csv").read_bytes())

    async def story() -> None:
        jobs = Jobs(tmp_path)
        job = jobs.start("fit", Task("fit", ("nothing.csv",)))
        with pytest.raises(HotleverError, match="cancel it first"):
            jobs.start("fit", Task("fit", ("nothing.csv",)))
        while jobs.running("fit"):
            await asyncio.sleep(0.02)
        assert (job.standing, job.message) == ("failed", "nothing.csv: no such file")
        job = jobs.start(
            "fit", Task("fit", ("lever-a.csv",), {"posterior": True, "output": "fit.json"})
        )
        while not job.done:
            await asyncio.sleep(0.02)
        # a posterior takes minutes
        await asyncio.wait_for(jobs.cancel("fit"), 15)
        assert job.standing == "cancelled"
        assert [path.name for path in tmp_path.iterdir()] == ["lever-a.csv"]
        job = jobs.start("fit", Task("sweep", (), {"bias": "0:12:4000"}))
        # a process that dies before it is called is started again
        while jobs._workers["fit"]._answer is None:
            await asyncio.sleep(0)
        jobs._workers["fit"].kill()
        while jobs.running("fit"):
            await asyncio.sleep(0.02)
        assert "died" in job.message
        # an answer that nobody waits for any more is not the next one's
        worker = jobs._spare
        assert worker is not None
        first = asyncio.create_task(worker.call(live.described, ""))
        await asyncio.sleep(0.05)
        first.cancel()
        assert await worker.call(isinstance, object) is True
        worker.kill()

    asyncio.run(story())


def test_a_command_is_shown_as_a_shell_takes_it():
    assert Task("fit", ("my data.csv",)).line == "hotlever fit 'my data.csv'"
