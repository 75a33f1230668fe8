"""``hotlever pulse``: wave forms from words, files out, and how it ends."""

from __future__ import annotations

import csv
import io
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from experiments import on_coarse_meshes
from hotlever.lever import State
from hotlever.tasks.solving import _Frames


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_a_step_at_some_times(run):
    status, out, err = run("pulse", "--step", "4", "--at", "0.1us,1us,5000ns,0.02ms,100us")
    assert status == 0
    # asked for so few times, it has no heating time
    assert [line.split()[-2:] for line in err.splitlines()] == [["2.43", "µs"], ["2.78", "µs"]]
    assert out.startswith("time_us,bias_V,current_mA,lever_V,reader_V,tip_K,power_mW\n")
    found = rows(out)
    assert [row["time_us"] for row in found] == ["0.1", "1", "5", "20", "100"]
    tip = [float(row["tip_K"]) for row in found]
    assert tip == pytest.approx([296.9, 300.8, 307.6, 321.3, 335.7], abs=0.2)


def test_a_pulse_writes_table_figure_and_fields(run, tmp_path):
    words = ("--pulse", "10V,5us", "--until", "20us", "--set", "c_kappa=0.7", "-o", "a.csv")
    with on_coarse_meshes():
        status, out, err = run("pulse", *words, "--plot", "a.png", "--fields", "fields")
    assert (status, out) == (0, "")
    found = rows((tmp_path / "a.csv").read_text())
    series = ElementTree.parse(tmp_path / "fields" / "fields.pvd").findall(".//DataSet")
    # the rows are where the solver stepped, however smooth the figure is
    assert len(found) == len(series) < 40
    tip = {row["time_us"]: float(row["tip_K"]) for row in found}
    assert f"tip, highest                 {tip['5']:.1f} K at 5 µs" in err
    assert f"tip, at the end              {tip['20']:.1f} K at 20 µs" in err
    mean = float(err.partition("tip, mean ")[2].partition(" K over 20 µs")[0])
    assert min(tip.values()) < mean < max(tip.values())
    assert [float(part.get("timestep", "")) for part in series] == pytest.approx(
        [float(row["time_us"]) for row in found]
    )
    assert all((tmp_path / "fields" / part.get("file", "")).is_file() for part in series)
    assert (tmp_path / "a.png").stat().st_size > 5000


def test_a_film_has_a_frame_for_each_time_asked(run, tmp_path):
    words = ("pulse", "--pulse", "10V,2us", "--at", "1us,2us,2.5us", "-o", "a.csv")
    with on_coarse_meshes():
        assert run(*words, "--film", "a.gif")[0] == 0
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 3
    # what cannot be written is known before anything is solved
    status, _, err = run(*words, "--film", "a.mp4")
    assert (status, err) == (2, "hotlever: a.mp4: unknown file type '.mp4', expected .gif\n")


def test_frames_lie_on_straight_lines_between_the_times_reported(coarse):
    states = [State(coarse, np.full((coarse.space.size + 1, 1), x)) for x in (0.0, 2.0, 3.0)]
    frames = _Frames([0.0, 0.5, 1.0, 4.0])
    for t, state in zip((0.0, 1.0, 5.0), states, strict=True):
        frames.keep(t, state)
    assert [(t, state.x[0, 0]) for t, state in frames.states] == [
        *[(0.0, 0.0), (0.5, 1.0)],
        *[(1.0, 2.0), (4.0, 2.75)],
    ]


def test_a_file_gives_the_bias(run, tmp_path):
    (tmp_path / "wave.csv").write_text("time (us),bias (V)\n0,0\n10,4\n")
    assert run("pulse", "--waveform", "wave.csv", "-o", "a.nc")[0] == 0
    with xr.open_dataset(tmp_path / "a.nc") as data:
        assert data.bias_V.values[-1] == 4.0
        assert data.attrs["waveform"] == "wave form of wave.csv"
        assert float(abs(data.supplied_nJ - data.stored_nJ - data.lost_nJ).max()) < 1e-5
        # the slowest mode is slower when it is warm
        assert 5.0 < data.attrs["heating_us"] < 7.0
        first, last = (data.attrs[f"time_constants_us_at_{end}"] for end in ("start", "end"))
        assert 20.0 < first[0] < last[0] < 26.0
    # as of a table that was written without its first row
    (tmp_path / "later.csv").write_text("time_us,bias_V\n1,4\n")
    assert "rests at its first bias, 4 V" in run("pulse", "--waveform", "later.csv")[2]


def test_ramps_sines_and_trains_in_any_medium(run):
    train = ("--pulse", "5V,1us", "--period", "4us", "--count", "2", "--until", "8us")
    for words in (("--ramp", "4,10us"), ("--sine", "3V+0.5V@200kHz", "--until", "9us"), train):
        with on_coarse_meshes():
            status, out, _ = run("pulse", *words)
        assert status == 0
        assert len(rows(out)) > 5
    with on_coarse_meshes():
        status, _, err = run("pulse", "--step", "3", "--at", "1us", "--medium", "air", "-o", "a.nc")
    assert status == 0
    assert "note" not in err
    with xr.open_dataset("a.nc") as data:
        assert float(data.air_stored_nJ[-1]) > 0.0


def test_what_was_reached_before_silicon_melts_is_written(run, tmp_path):
    status, _, err = run("pulse", "--step", "40", "-o", "a.csv", "--plot", "a.svg")
    assert status == 1
    assert err.splitlines()[-1].startswith("hotlever: silicon melts after 1.25")
    assert 1600 < float(rows((tmp_path / "a.csv").read_text())[-1]["tip_K"]) < 1687
    assert (tmp_path / "a.svg").is_file()


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ((), "found none: expected one of --step, --pulse"),
        (("--step", "1", "--ramp", "1,2us"), "--step and --ramp: expected only one of them"),
        (("--step", "x"), "--step: found 'x', expected a number with a unit like V"),
        (("--step", "1e9"), "--step: found a bias of 1e+09 V"),
        (("--pulse", "10V"), "--pulse: found '10V', expected V,TIME"),
        (("--pulse", "10V,5"), "--pulse: found '5', expected a number with a unit like us"),
        (("--pulse", "10V,5us", "--count", "3"), "without a period"),
        (("--pulse", "10V,5us", "--period", "4us", "--count", "3"), "period of 4 µs"),
        (("--step", "1", "--count", "3"), "--count: goes with --pulse"),
        (("--ramp", "8V,-1us"), "--ramp: found a time of -1 µs"),
        (("--sine", "3V"), "--sine: found '3V', expected V+V@FREQ"),
        (("--sine", "3V+1V@5us"), "--sine: found '5us', expected a number with a unit like Hz"),
        (("--step", "1", "--at", "1"), "--at: found '1', expected a number with a unit like us"),
        (("--step", "1", "--until", "-1us"), "found an end at -1 µs"),
        (("--waveform", "none.csv"), "none.csv: no such file"),
        (("--step", "1", "--medium", "water"), "--medium water"),
        (("--step", "1", "-o", "a.txt"), "unknown file type"),
    ],
)
def test_bad_input_gets_one_line_and_status_two(refused, words, found, tmp_path):
    assert found in refused("pulse", *words)
    assert list(tmp_path.iterdir()) == []
