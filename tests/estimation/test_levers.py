"""What several fits say together."""

from __future__ import annotations

import csv
import re
from dataclasses import replace

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate.many import (
    Batch,
    compare_levers,
    lever_rows,
    levers_csv,
    statements,
)
from hotlever.materials import PARAMETERS, PUBLISHED
from made_up import fit_of


def wafer(count: int, scatter: float, stderr: float, seed: int = 0):
    """Levers that differ in c_kappa by `scatter` and are measured within `stderr`."""
    rng = np.random.default_rng(seed)
    base = PUBLISHED["option III"].material.model_dump()
    fits = {}
    for number in range(count):
        found = base["c_kappa"] + rng.normal(0, np.hypot(scatter, stderr))
        fits[f"lever-{number}"] = fit_of({**base, "c_kappa": found}, {"c_kappa": stderr})
    return fits


def test_the_published_levers():
    """Table II: n_d scatters by far more than the other parameters."""
    fits = {
        name: fit_of(PUBLISHED[name].material.model_dump(), {})
        for name in ("lever 1", "lever 2", "lever 3", "lever 4")
    }
    data = compare_levers(fits)
    n_d = data.sel(quantity="n_d")
    assert n_d["mean"].item() == pytest.approx((5.75 + 3.64 + 3.50 + 5.93) / 4 * 1e17)
    share = data.scatter / data["mean"]
    assert share.sel(quantity="n_d") > 0.25
    assert (share.drop_sel(quantity=["n_d"]) < 0.125).all()
    assert np.isnan(data.mean_stderr).all()
    assert data.counts.all()
    assert statements(data) == []


def test_levers_that_differ_are_told_from_levers_that_do_not():
    differ = statements(compare_levers(wafer(20, scatter=0.02, stderr=0.005)))
    assert re.fullmatch(
        r"the levers differ in c_kappa: they scatter by 2\.\d%, χ² is \d\d\d for 19 degrees of "
        r"freedom \(Birge ratio 3\.\d\)",
        differ[0],
    )
    alike = statements(compare_levers(wafer(20, scatter=0.0, stderr=0.005)))
    assert alike == [
        "the scatter of c_kappa between the levers is no larger than the standard errors explain"
    ]


def test_equal_levers_are_rarely_said_to_differ():
    alarms = [
        statements(compare_levers(wafer(10, 0.0, 0.005, seed)))[0].startswith("the levers differ")
        for seed in range(100)
    ]
    assert sum(alarms) <= 5  # 1 % expected; more than 5 has a probability below 1e-3


def test_a_lever_that_stands_apart_is_named():
    fits = wafer(12, scatter=0.01, stderr=0.005)
    parameters = fits["lever-7"].parameters
    away = parameters["c_kappa"].value + 0.3
    parameters["c_kappa"] = replace(parameters["c_kappa"], value=away)
    assert "lever lever-7 stands apart from the other levers in c_kappa" in statements(
        compare_levers(fits)
    )


def test_the_mean_is_weighted_and_its_error_that_of_the_scatter():
    fits = wafer(3, scatter=0.0, stderr=0.005)
    for fit, value, stderr in zip(fits.values(), (0.7, 0.72, 0.9), (0.01, 0.02, 0.05), strict=True):
        changed = replace(fit.parameters["c_kappa"], value=value, stderr=stderr)
        fit.parameters["c_kappa"] = changed
    data = compare_levers(fits).sel(quantity="c_kappa")
    weights = np.array([1e4, 2.5e3, 4e2])
    mean = (weights @ [0.7, 0.72, 0.9]) / weights.sum()
    assert data["mean"].item() == pytest.approx(mean)
    chi_square = weights @ (np.array([0.7, 0.72, 0.9]) - mean) ** 2
    assert data.birge_ratio.item() == pytest.approx(np.sqrt(chi_square / 2))
    assert data.birge_ratio > 1
    assert data.mean_stderr.item() == pytest.approx(np.sqrt(chi_square / 2 / weights.sum()))
    # levers that scatter by less than their errors do not make these smaller
    alike = {f"lever-{k}": fits["lever-0"] for k in range(4)}
    equal = compare_levers(alike).sel(quantity="c_kappa")
    assert equal.birge_ratio < 1e-6
    assert equal.mean_stderr.item() == pytest.approx(0.005)


def test_a_lever_that_determines_nothing_spoils_neither_mean_nor_verdict():
    """c_kappa = 0.719 ± 300 was written as 0(300), and all levers were said to be alike."""
    fits = wafer(4, scatter=0.05, stderr=0.005)
    before = compare_levers(fits)
    fits["dull"] = fit_of(
        {**PUBLISHED["option III"].material.model_dump(), "c_kappa": 0.719}, {"c_kappa": 300.0}
    )
    data = compare_levers(fits)
    for name in ("mean", "mean_stderr", "scatter", "chi_square"):
        assert data[name].sel(quantity="c_kappa") == before[name].sel(quantity="c_kappa")
    rows = {row[0]: row for row in lever_rows(data)}
    assert rows["dull"][1] == "not determined"
    assert statements(data) == [
        "lever dull is left out of the mean of c_kappa, which its data do not determine",
        *statements(before),
    ]
    assert statements(before)[0].startswith("the levers differ in c_kappa")


@pytest.mark.parametrize("answer", [None, False])
def test_a_lever_that_is_not_described_is_left_out_and_named(answer):
    fits = wafer(3, scatter=0.0, stderr=0.005)
    before = compare_levers(fits)
    values = dict.fromkeys(PARAMETERS, 1.0)
    fits["other"] = fit_of(values, {"c_kappa": 0.001}, described=answer)
    data = compare_levers(fits)
    assert data["mean"].equals(before["mean"])
    assert "lever other is left out: its data are not described" in statements(data)
    assert set(next(row for row in lever_rows(data) if row[0] == "other")[1:]) == {""}
    (*_, last) = csv.DictReader(levers_csv(data).splitlines())
    assert last["reason"] == fits["other"].doubt
    said = ("lever", "describes_data", "reason", "file")
    assert not any(cell for name, cell in last.items() if name not in said)
    only = compare_levers({"other": fits["other"]})
    assert np.isnan(only["mean"]).all()
    assert statements(only) == ["lever other is left out: its data are not described"]
    batch = Batch(fits)
    assert batch.exit_status == 1
    assert list(batch.undescribed) == ["other"]
    assert "current differs by 5%" in batch.undescribed["other"]


def test_one_lever_has_no_scatter():
    data = compare_levers(wafer(1, 0.0, 0.01))
    assert np.isnan(data.scatter).all()
    assert statements(data) == []


def test_csv_has_empty_cells_for_what_is_not_known():
    text = levers_csv(compare_levers(wafer(2, 0.01, 0.005))).splitlines()
    assert text[0].startswith("lever,c_kappa,c_kappa_stderr,delta,delta_stderr")
    assert "inversion_temperature_K,inversion_temperature_stderr_K,describes_data" in text[0]
    cells = text[1].split(",")
    assert cells[0] == "lever-0"
    assert cells[2] == "0.005"
    assert cells[4] == ""


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(InputError, match="no levers to compare"):
        compare_levers({})
    fits = wafer(2, 0.01, 0.005)
    del fits["lever-1"].parameters["n_d"]
    with pytest.raises(InputError, match="lever-1: n_d is missing, expected a lever of the same"):
        compare_levers(fits)
