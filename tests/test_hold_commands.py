"""``hotlever sweep --hold-resistance`` and ``pulse --controller``: files, notes, refusals."""

from __future__ import annotations

import csv
import io

import pytest
import xarray as xr
from PIL import Image

pytestmark = pytest.mark.usefixtures("coarse_meshes")

CONTROL = ("--hold-resistance", "2.9kohm", "--controller", "1,100", "--step", "3kohm")


def test_states_at_set_points_are_written_and_drawn(run, tmp_path):
    status, out, err = run(
        *("sweep", "--hold-resistance", "2kohm,3kohm", "-o", "held.nc", "--plot", "held.png"),
        *("--fields", "fields", "--map", "map.png"),
    )
    assert (status, out, err) == (0, "", "")
    data = xr.load_dataset(tmp_path / "held.nc")
    assert data.set_ohm.values.tolist() == [2000.0, 2000.0, 3000.0, 3000.0]
    assert data.state.values.tolist() == [1, 2] * 2
    assert len(list((tmp_path / "fields").glob("*.vtu"))) == 4
    for name in ("held.png", "map.png"):
        with Image.open(tmp_path / name) as image:
            assert image.size[0] > 600
    assert len(data.hotlever.plot().axes) == 2


def test_a_table_has_the_columns_of_a_sweep_and_those_of_set_points(run):
    status, out, _ = run("sweep", "--hold-power", "2.5mW")
    (row,) = csv.DictReader(io.StringIO(out))
    assert status == 0
    assert list(row)[:2] == ["bias_V", "current_mA"]
    assert list(row)[-3:] == ["set_mW", "state", "slope_mW_per_K"]
    assert float(row["power_mW"]) == pytest.approx(2.5)


def test_a_controlled_step_tells_its_overshoot_and_draws_stable_gains(run, tmp_path):
    files = ("-o", "step.csv", "--plot", "step.png", "--gain-map", "gains.svg")
    status, out, err = run("pulse", *CONTROL, "--until", "200us", *files)
    assert (status, out) == (0, "")
    rows = list(csv.DictReader(io.StringIO((tmp_path / "step.csv").read_text())))
    assert list(rows[0])[-2:] == ["set_ohm", "resistance_ohm"]
    assert float(rows[0]["resistance_ohm"]) == pytest.approx(2900.0, abs=0.01)
    assert float(rows[-1]["resistance_ohm"]) == pytest.approx(3000.0, abs=2.0)
    assert "tip, overshoot                 3.7 K (20% of the step)" in err
    assert "closed loop                    time constant 39.4 µs, damping ratio 0.54" in err
    drawn = (tmp_path / "gains.svg").read_text(encoding="utf-8")
    for text in ("not stable", "overshoot 10%", "P, I = 1, 100"):
        assert text in drawn


def test_an_overshoot_between_times_that_are_asked_for_is_not_told_as_none(run):
    status, out, err = run("pulse", *CONTROL, "--at", "1us,60us")
    assert (status, out.count("\n")) == (0, 3)
    assert "tip, at the end" in err
    assert "overshoot" not in err


@pytest.mark.slow
def test_a_loop_that_is_lost_is_told(run):
    status, _, err = run(
        *("pulse", "--hold-resistance", "3.3kohm", "--controller", "0,3000", "--step", "3.36kohm"),
        *("--at", "1us,100us"),
    )
    assert status == 0
    assert "note: at the end the bias is at its limit of 12.09 V, and nothing is held" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sweep", "--hold-resistance", "9kohm"), "expected one that the lever has: from 1323 ohm"),
        (("sweep", "--hold-resistance", "3000"), "expected a number with a unit like ohm"),
        (("sweep", "--hold-resistance", "-3kohm"), "expected more than 0"),
        (("sweep", "--hold-power", "1mW:2mW"), "START:STOP:COUNT, such as 1mW:4mW:7"),
        (
            ("sweep", "--hold-power", "1mW", "--bias", "1:2:2"),
            "--bias and --hold-power: expected only one of them",
        ),
        (("sweep", "--hold-power", "1mW", "--model", "full-3d"), "goes with --model flat"),
        (("pulse", *CONTROL[:2], "--step", "4V"), "--hold-resistance: goes with --controller P,I"),
        (("pulse", *CONTROL[:4]), "--controller: goes with --step"),
        (("pulse", *CONTROL[2:]), "--controller: goes with --hold-resistance"),
        (("pulse", *CONTROL, "--period", "1us"), "--period: does not go with --controller"),
        (("pulse", *CONTROL[:2], "--controller", "1", *CONTROL[4:]), "expected P,I in V/kohm"),
        (
            ("pulse", *CONTROL[:2], "--controller", "1,0", *CONTROL[4:]),
            "I other than 0: by P alone the set point is not met",
        ),
        (
            ("pulse", "--hold-resistance", "1.35kohm", "--controller", "-1,-9", "--step", "2kohm"),
            "expected gains above 0: at 1350 ohm (tip at 309 K) the resistance rises",
        ),
        pytest.param(
            ("pulse", *CONTROL[:2], "--controller", "1e9,1e9", *CONTROL[4:]),
            "rings faster than the lever's answer is known, 100 MHz; expected stable ones such as",
            marks=pytest.mark.slow,
        ),
        (
            ("pulse", *CONTROL[:2], "--controller", "0,1e9", *CONTROL[4:]),
            "the loop at 3000 ohm is not stable: what is off grows by e in 0.02",
        ),
        (("pulse", *CONTROL, "--limit", "3V"), "found a limit of 3 V, expected at least"),
        (("pulse", *CONTROL, "--filter", "0us"), "found a filter of 0 µs, expected 0.001"),
        (("pulse", *CONTROL, "--gain-map", "map.csv"), "map.csv"),
        (("pulse", "--controller", "1,9", "--report", "page"), "does not go with --report"),
        (("pulse", "--limit", "9V", "--report", "page"), "--limit: does not go with --report"),
        (("pulse", "--step", "4V", "--filter", "2us"), "--filter: goes with --controller P,I"),
    ],
)
def test_what_cannot_be_is_one_line(run, arguments, message):
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
