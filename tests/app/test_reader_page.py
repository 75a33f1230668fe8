"""The page Reader: what a lever reads at a distance that is none of those that are solved."""

from __future__ import annotations

import csv
import shlex
from collections.abc import Callable

import numpy as np
import pytest
from elements import plots, texts
from test_app_pages import text_of, until, visited

from hotlever.app import approaching
from hotlever.app.pages import reader_page as reader
from hotlever.probe import Probe

Run = Callable[..., tuple[int, str, str]]
pytestmark = pytest.mark.usefixtures("coarse_meshes")
#: Of a lever of 120 µm, at a bias at which its voltage turns with the distance.
LONG, BIAS, DISTANCE = "length_um = 120.0", 12.0, 0.9


@visited
async def test_reader_shows_the_numbers_and_notes_of_the_command(
    user, session, tmp_path, run, monkeypatch
):
    """They were 1.6 % off in voltage and 2.9 % in resistance, without the note on an extremum."""
    text = Probe.reference().to_toml()
    (tmp_path / "long.toml").write_text(text.replace("length_um = 54.4", LONG, 1))
    distances = "0.2um:1.6um:3"  # the middle one is that of the page
    words = ["--medium", "air", "--bias", f"{BIAS}V", "--amplifier", "5nV"]
    _, out, err = run("reader", str(tmp_path / "long.toml"), "--distance", distances, *words)
    row = next(
        row
        for row in csv.DictReader(out.splitlines())
        if float(row["surface_gap_um"]) == pytest.approx(DISTANCE)
    )
    assert f"at a bias of {BIAS:g} V the voltage has an extremum between " in err
    monkeypatch.setattr(reader.ReaderPage, "distances", 4)

    session.probe = "long.toml"
    session.chosen["reader"] = {"distance_um": DISTANCE, "bias": BIAS}
    await user.open("/reader")
    await until(lambda: "coarse lever, while" in text_of(user, "aria-live=polite"))
    coarse = float(text_of(user, "data-number=reader_V").split()[0])
    await until(lambda: "full lever: the numbers" in text_of(user, "aria-live=polite"))
    assert text_of(user, "data-number=reader_V") == f"{float(row['reader_V']):.4f} V"
    assert text_of(user, "data-number=reader_ohm") == f"{float(row['reader_ohm']):.1f} Ω"
    slope = f"{10.0 * float(row['dlnR_dz_per_um']):.3g}·10⁻⁴/nm"
    assert text_of(user, "data-number=dlnR_dz_per_um") == slope
    said = " ".join(texts(user))
    assert f"at a bias of {BIAS:g} V the voltage has an extremum between " in said
    assert "it is taken as 1" in said
    # the sensitivity passes through zero there, and is not joined
    titles = {one["layout"]["yaxis"]["title"]["text"]: one["data"][0]["y"] for one in plots(user)}
    (drawn,) = (y for title, y in titles.items() if "d ln R" in title)
    assert np.isnan(drawn).any()
    off = f"{100 * (coarse / float(row['reader_V']) - 1):+.1f}"
    stated = said.partition("coarse lever, here ")[2].partition(" % in voltage")[0]
    assert float(stated) == pytest.approx(float(off), abs=0.1)


@visited
async def test_the_command_of_a_tilted_surface_does_what_the_page_shows(
    user, session, tmp_path, run
):
    """It was refused: it stated a distance twice, without which a tilt means nothing."""
    chosen = {"distance_um": 0.4, "tilt_deg": 1.5, "accommodation": 0.9}
    session.chosen["reader"] = chosen
    await user.open("/reader")
    await until(lambda: "full lever: the numbers" in text_of(user, "aria-live=polite"))
    line = next(text for text in texts(user) if text.startswith("hotlever reader"))
    words = shlex.split(line)[1:]
    assert "surface_tilt_deg=1.5" in words
    # at the distance of the page, whose curves begin nearer
    at = words.index("--distance") + 1
    words[at] = words[at].partition(":")[0] + ":0.4um:2"
    status, out, _ = run(*words[: words.index("-o")])
    assert status == 0
    row = [*csv.DictReader(out.splitlines())][-1]
    assert text_of(user, "data-number=reader_V") == f"{float(row['reader_V']):.4f} V"


def test_a_tilted_surface_is_asked_for_only_where_it_is_below_the_lever():
    described = [
        approaching.described(None, "", tilt)["nearest_um"]  # type: ignore[arg-type]
        for tilt in (0.0, 2.0, -2.0)
    ]
    front, base = np.tan(np.radians(2.0)) * np.array([54.4 - 48.58, 48.58])
    assert described[0] == 0.2
    assert front < described[1] < front + 0.2
    assert base < described[2] < base + 0.3
