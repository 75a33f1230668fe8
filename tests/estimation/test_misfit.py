"""Whether a model describes data: noise and outliers do, what is smooth does not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hotlever.estimate import Measurement
from hotlever.estimate.diagnosis import lack_of_fit_text, run_of_outliers
from hotlever.estimate.options import DiagnosisOptions, Numerics
from hotlever.estimate.residuals import Residuals

COUNT = 40
BIAS = np.linspace(0.3, 11.0, COUNT)
MODEL = np.stack([0.1 * BIAS, np.full(COUNT, np.nan), 293.0 + 5.0 * BIAS**2])
ALONG = np.linspace(-1.0, 1.0, COUNT)


def compared(
    off: np.ndarray, bias: np.ndarray = BIAS, tip: bool = False, **diagnosis: float
) -> Residuals:
    """Compare the model with data that are off from it, and have some noise."""
    noise = 1e-3 * np.random.default_rng(0).standard_normal(bias.size)
    nothing = np.full(bias.size, np.nan)
    current = 0.1 * bias + (0.0 if tip else off) + noise
    tips = 293.0 + 5.0 * bias**2 + 1e3 * off if tip else nothing
    observables = ["current", "tip"] if tip else ["current"]
    numerics = Numerics(diagnosis=DiagnosisOptions(**diagnosis))
    measured = Measurement(bias, current, nothing, tips, nothing)
    return Residuals(measured, observables, numerics=numerics)


def test_noise_is_described():
    residuals = compared(0.01 * np.random.default_rng(1).standard_normal(COUNT))
    assert lack_of_fit_text(residuals, MODEL) == ""
    assert run_of_outliers(residuals, MODEL) == ""


@pytest.mark.parametrize("seed", range(1, 9))
@pytest.mark.parametrize("size", [0.02, 0.05])
def test_much_noise_is_described_too(seed, size):
    """Once runs of four rows were compared with 1.2 %, whatever the noise."""
    noise = size * 1.1 * np.random.default_rng(seed).standard_normal(COUNT)
    assert lack_of_fit_text(compared(noise), MODEL) == ""


def test_a_smooth_misfit_is_none_of_little_noise():
    noise = 0.003 * np.random.default_rng(1).standard_normal(COUNT)
    assert lack_of_fit_text(compared(noise + 0.05 * ALONG**3), MODEL) != ""


@pytest.mark.parametrize("row", [0, 20, -1])
def test_an_outlier_is_at_random_wherever_it_is(row):
    off = np.zeros(COUNT)
    off[row] = 0.06
    assert lack_of_fit_text(compared(off), MODEL) == ""


def test_perfect_data_are_described():
    data = Measurement(BIAS, MODEL[0], *np.full((3, COUNT), np.nan))
    assert lack_of_fit_text(Residuals(data, ["current"]), MODEL) == ""


def test_what_is_off_smoothly_is_not_and_the_worst_place_is_named():
    text = lack_of_fit_text(compared(0.05 * ALONG**3), MODEL)
    assert text.startswith("current differs by 1.8%")
    assert text.endswith("most at 11 V")


def test_a_drift_over_rows_up_and_down_is_not_described():
    bias = np.concatenate([BIAS[::2], BIAS[::-2]])
    values = np.stack([0.1 * bias, np.full(COUNT, np.nan), np.full(COUNT, 300.0)])
    assert "not at random" in lack_of_fit_text(compared(0.03 * ALONG, bias), values)


def test_another_lever_shows_also_in_shuffled_rows():
    order = np.random.default_rng(2).permutation(COUNT)
    residuals = compared(0.05 * ALONG[order], BIAS[order])
    assert "not at random" in lack_of_fit_text(residuals, MODEL[:, order])


def test_the_scale_of_a_thermometer_is_no_misfit():
    assert lack_of_fit_text(compared(0.05 * ALONG, tip=True), MODEL) == ""


@pytest.mark.parametrize(
    ("rows", "where"),
    [
        ((5, 15, 25, 39), ""),
        ((20, 21, 22, 23), "from 5.79 to 6.34 V"),
        ((10, 11, 39), ""),
        ((38, 39), "from 10.7 to 11 V"),
    ],
)
def test_outliers_stand_alone(rows, where):
    off = np.zeros(COUNT)
    off[list(rows)] = 0.02
    expected = f"current is off in neighbouring rows, {where}" if where else ""
    assert run_of_outliers(compared(off), MODEL) == expected


@pytest.mark.slow
def test_a_fit_says_first_that_its_data_are_not_described(run, tmp_path):
    """The current waves by 10 %, as no lever's does."""
    lines = (
        (Path(__file__).parents[2] / "src" / "hotlever" / "examples" / "lever-a.csv")
        .read_text()
        .splitlines()
    )
    head = next(k for k, line in enumerate(lines) if line.startswith("V_b"))
    cells = [line.split(",") for line in lines[head + 1 :]]
    waves = [float(row[1]) * (1.0 + 0.1 * np.sin(2.0 * float(row[0]))) for row in cells if row[1]]
    rows = [f"{row[0]},{wave:.6g}" for row, wave in zip(cells, waves, strict=True)]
    (tmp_path / "waves.csv").write_text("\n".join([*lines[:head], "V_b (V),I_h (mA)", *rows]))
    status, out, err = run(
        "fit", "waves.csv", "--fix", "a1", "--fix", "p", "--profiles", "-o", "fit.json"
    )
    assert status == 1
    assert "no posterior and no profiles of a lever that does not show these data" in err
    assert out.startswith("no such lever shows these data: current differs by")
    assert "waves.csv: no such lever shows these data" in err
    written = json.loads((tmp_path / "fit.json").read_text())
    assert written["describes_data"] is False
    assert written["reason"] in out
    assert "profiles" not in written
    assert {one["stderr"] for one in written["parameters"].values()} == {None}


def test_what_counts_as_described_is_an_option():
    off = 0.05 * ALONG**3
    assert lack_of_fit_text(compared(off, held_scatter=0.017), MODEL).endswith(" V")
    assert lack_of_fit_text(compared(off, held_scatter=0.02, usual_scatter=0.02), MODEL) == ""
