"""What several fits say together."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.fitting.levers import INVERSION, compare_levers, levers_csv, statements
from hotlever.materials import PARAMETERS
from hotlever.spieser2017 import PUBLISHED


def content(values: dict[str, float], stderr: dict[str, float | None], inversion=830.0):
    return {
        "parameters": {
            name: {"value": values[name], "stderr": stderr.get(name), "unit": "", "vary": True}
            for name in PARAMETERS
        },
        "inversion_temperature_K": inversion,
        "inversion_temperature_stderr_K": None,
    }


def wafer(count: int, scatter: float, stderr: float, seed: int = 0):
    """Levers that differ in c_kappa by `scatter` and are measured within `stderr`."""
    rng = np.random.default_rng(seed)
    base = PUBLISHED["option III"].material.model_dump()
    fits = {}
    for number in range(count):
        found = base["c_kappa"] + rng.normal(0, np.hypot(scatter, stderr))
        fits[f"lever-{number}"] = content({**base, "c_kappa": found}, {"c_kappa": stderr})
    return fits


def test_the_published_levers():
    """Table II: n_d scatters by far more than the other parameters."""
    fits = {
        name: content(PUBLISHED[name].material.model_dump(), {})
        for name in ("lever 1", "lever 2", "lever 3", "lever 4")
    }
    data = compare_levers(fits)
    n_d = data.sel(quantity="n_d")
    assert n_d["mean"].item() == pytest.approx((5.75 + 3.64 + 3.50 + 5.93) / 4 * 1e17)
    share = data.scatter / data["mean"]
    assert share.sel(quantity="n_d") > 0.25
    assert (share.drop_sel(quantity=["n_d"]) < 0.125).all()
    assert np.isnan(data.mean_stderr).all()
    assert statements(data) == []


def test_levers_that_differ_are_told_from_levers_that_do_not():
    differ = statements(compare_levers(wafer(20, scatter=0.02, stderr=0.005)))
    assert differ[0].startswith("the levers differ in c_kappa: they scatter by")
    alike = statements(compare_levers(wafer(20, scatter=0.0, stderr=0.005)))
    assert alike == [
        "the scatter of c_kappa between the levers is no larger than the standard errors explain"
    ]


def test_equal_levers_are_rarely_said_to_differ():
    said = [
        statements(compare_levers(wafer(10, 0.0, 0.005, seed)))[0].startswith("the levers differ")
        for seed in range(300)
    ]
    assert sum(said) <= 10  # 1 % expected; 10 or more has a probability below 1e-3


def test_a_lever_that_stands_apart_is_named():
    fits = wafer(12, scatter=0.01, stderr=0.005)
    fits["lever-7"]["parameters"]["c_kappa"]["value"] += 0.3
    assert "lever-7 stands apart from the other levers in c_kappa" in statements(
        compare_levers(fits)
    )


def test_one_lever_has_no_scatter():
    data = compare_levers(wafer(1, 0.0, 0.01))
    assert np.isnan(data.scatter).all()
    assert statements(data) == []


def test_csv_has_empty_cells_for_what_is_not_known():
    text = levers_csv(compare_levers(wafer(2, 0.01, 0.005))).splitlines()
    assert text[0].startswith("lever,c_kappa,c_kappa_stderr,delta,delta_stderr")
    assert text[0].endswith(f"{INVERSION}_K,{INVERSION}_stderr_K")
    cells = text[1].split(",")
    assert cells[0] == "lever-0"
    assert cells[2] == "0.005"
    assert cells[4] == ""


@pytest.mark.parametrize("fits", [{}, {"a": {"parameters": {}}}, {"a": []}])
def test_what_is_no_fit_file_is_refused(fits):
    with pytest.raises(InputError, match=r"no fits to compare|not a fit file"):
        compare_levers(fits)
