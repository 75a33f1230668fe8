"""Calibrations of many levers: one command, a table of all, and a page."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hotlever.estimate import calibrate, read_calibration
from hotlever.estimate.many import (
    Setting,
    compare_levers,
    levers_csv,
    statements,
    tips_along,
)
from hotlever.estimate.power_law import EQ12
from hotlever.files import json_text

NAMES = ("a", "b", "c")
COMMAND = ("calibrate", "a.csv", "b.csv", "none.csv", "--power-law", "law.json")


@pytest.fixture(scope="module")
def texts(coarse):
    """Data of levers whose doping differs."""
    contents = []
    for n_d in (5.5e17, 5.75e17, 6e17):
        sweep = coarse.with_material(coarse.probe.material.with_(n_d=n_d)).sweep(
            np.linspace(0.5, 10.0, 40)
        )
        rows = zip(sweep.bias_V.values, sweep.current_mA.values, strict=True)
        lines = [f"{bias:.4f},{current:.6f}" for bias, current in rows]
        contents.append("\n".join(["V_b (V),I_h (mA)", *lines, ""]))
    return contents


@pytest.fixture(scope="module")
def calibrations(texts, tmp_path_factory):
    """Their calibrations by the paper's rule."""
    folder = tmp_path_factory.mktemp("levers")
    for name, text in zip(NAMES, texts, strict=True):
        (folder / f"{name}.csv").write_text(text)
    return {name: calibrate(folder / f"{name}.csv", law=EQ12) for name in NAMES}


def test_one_command_calibrates_all_and_the_same_again_nothing(texts, calibrations, run):
    for name, text in zip(NAMES, texts, strict=True):
        Path(f"{name}.csv").write_text(text)
    Path("law.json").write_text(json_text(EQ12.model_dump()))
    more = ("--processes", "1", "--report", "page", "--at", "2mW")
    status, printed, err = run(*COMMAND, *more)
    assert status == 2
    assert err.count("none.csv: no such file") == 1
    assert "T_tip at 2 mW (K)" in printed
    folder = Path("page/calibrations")
    again = read_calibration(folder / "b.calibration.json")
    alone = calibrations["b"]
    np.testing.assert_array_equal(again.table.tip_K, alone.table.tip_K)
    assert (folder / "b.table.csv").read_text() == alone.table_csv()
    rows = list(csv.DictReader((folder / "calibrations.csv").read_text().splitlines()))
    assert [row["lever"] for row in rows] == ["a", "b", "none.csv"]
    assert [row["describes_data"] for row in rows] == ["true", "true", ""]
    assert rows[2]["reason"] == "none.csv: no such file"
    assert float(rows[1]["tip_K"]) == pytest.approx(float(alone.tip_temperature(2.0)), rel=1e-6)
    assert float(rows[1]["knee_power_mW"]) == pytest.approx(alone.knee.power_mW, rel=1e-6)
    assert float(rows[1]["hot_K_per_mW"]) == pytest.approx(EQ12.hot_K_per_mW)
    assert "none.csv: no such file" in Path("page/index.html").read_text()
    # another setting to compare at needs no other calibrations
    _, printed, err = run(*COMMAND, "-o", folder)
    assert "2 of 3 levers have their calibrations from before" in err
    assert "T_tip at 10 V (K)" in printed


def test_levers_are_compared_where_all_were_measured(calibrations):
    shorter = calibrations["c"].tip_table.rows(slice(0, 60))
    levers = {**calibrations, "c": replace(calibrations["c"], tabulated=shorter)}
    highest = float(shorter["bias_V"][-1])
    table = compare_levers(levers)
    assert table.bias_V.values.tolist() == [highest] * 3
    tip = table.value.sel(quantity="tip_K")
    for name, each in calibrations.items():
        expected = np.interp(highest, each.table.bias_V, each.table.tip_K)
        assert tip.sel(lever=name).item() == pytest.approx(expected)
    tips = tips_along(levers, "bias_V")
    # beyond its range a lever is not drawn, and the mean is that of the others
    assert np.isnan(tips.tip_K.sel(lever="c").values[-1])
    assert np.isfinite(tips.tip_K.mean("lever").values).all()
    beyond = compare_levers(levers, Setting("bias_V", 9.0))
    said = statements(beyond)
    assert any("c: 9 V is out of its range, 0.5 to" in text for text in said)
    assert beyond.counts.sel(quantity="tip_K").values.tolist() == [True, True, False]


def test_many_levers_do_not_make_what_is_wrong_with_all_smaller(calibrations):
    table = compare_levers({f"{number}": calibrations["a"] for number in range(9)})
    alone, mean = table.stderr.isel(lever=0), table.mean_stderr
    assert mean.sel(quantity="tip_K") == pytest.approx(alone.sel(quantity="tip_K"))
    # what was measured of each is another matter
    measured = {"quantity": "knee_lever_V"}
    assert mean.sel(measured) == pytest.approx(alone.sel(measured) / 3.0)


@pytest.mark.parametrize("converged", [True, False])
def test_a_lever_that_is_not_described_has_no_numbers(calibrations, converged):
    refused = replace(calibrations["a"], reason="current differs by 5%", converged=converged)
    table = compare_levers({**calibrations, "a": refused})
    assert np.isnan(table.value.sel(lever="a")).all()
    assert "lever a is left out: its data are not described" in statements(table)
    row = levers_csv(table, {}).splitlines()[1]
    answer = "false" if converged else "unknown"
    assert row.endswith(f"{answer},{refused.doubt},{refused.measurement.path}")
    assert "a" not in tips_along({"a": refused, "b": calibrations["b"]}, "bias_V").lever


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("a.csv", "b.csv", "--fit", "f.json", "-o", "out"), "--fit: expected a single data file"),
        (("a.csv", "b.csv"), "expected -o FOLDER or --report DIR to write their calibrations to"),
        (
            ("a.csv", "--at", "2mW"),
            "found '2mW', expected a bias such as 8V of one data file",
        ),
        (("a.csv", "b.csv", "-o", "out", "--at", "3K"), "expected a bias such as 8V or a power"),
    ],
)
def test_what_does_not_go_together_is_refused(refused, arguments, message):
    for name in ("a.csv", "b.csv"):
        Path(name).write_text("V_b (V),I_h (mA)\n1,0.1\n")
    assert message in refused("calibrate", *arguments, below_notes=True)
