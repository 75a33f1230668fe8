"""Data that no such lever shows: no errors are handed out, in no output."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hotlever import figures
from hotlever.app import showing
from hotlever.cli import main
from hotlever.errors import InputError
from hotlever.estimate import Estimate, estimator, read_calibration
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.summary import calibration_text
from hotlever.files import json_text
from hotlever.lever import Branch
from hotlever.measurement import Measurement
from hotlever.report.result_pages import calibration_page
from synthetic_curves import measured_curve, measurement_of

ERRORS = ("tip_stderr_K", "tip_low_K", "tip_high_K")


@pytest.fixture(scope="module")
def saturated(reference: Branch) -> Measurement:
    """A current of which its meter shows a tenth beyond some value."""
    data = measurement_of(measured_curve(reference, np.random.default_rng(4)))
    beyond = np.maximum(data.current_mA - 0.8 * data.current_mA.max(), 0.0)
    return replace(data, current_mA=data.current_mA - 0.9 * beyond)


@pytest.fixture(scope="module", params=["said", pytest.param("searched", marks=pytest.mark.slow)])
def folder(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    reference: Branch,
    saturated: Measurement,
) -> Path:
    """What ``hotlever calibrate`` writes of data that no lever shows.

    It takes long to find that none does; it may as well be said of data that a lever shows.
    """
    folder = tmp_path_factory.mktemp("refused")
    data = saturated
    if request.param == "said":
        data = measurement_of(measured_curve(reference, np.random.default_rng(4)))
    rows = [f"{v:.6g},{i:.6g}" for v, i in zip(data.bias_V, data.current_mA, strict=True)]
    (folder / "saturated.csv").write_text(
        "\n".join(["# R_s (kOhm): 5.6", "V_b (V),I_h (mA)", *rows])
    )
    files = {"-o": "cal.json", "--table": "table.csv", "--plot": "cal.png"}
    options = [word for key, name in files.items() for word in (key, str(folder / name))]
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "said":
            patch.setattr(estimator, "verdict_on", lambda *_: (True, "current differs by 5 %"))
            patch.setattr(Diagnosis, "named", lambda *_: "is the current clipped?")
        with pytest.raises(SystemExit) as ended:
            main(["calibrate", str(folder / "saturated.csv"), *options, "--pulse", "5us"])
    assert ended.value.code == 1
    return folder


@pytest.fixture(scope="module")
def refused(folder: Path, saturated: Measurement) -> Estimate:
    return replace(read_calibration(folder / "cal.json"), measurement=saturated)


def numbers(content: Any, key: str) -> list[Any]:
    """Return the values of all entries of a name."""
    if isinstance(content, dict):
        here = content.get(key, [])
        here = here if isinstance(here, list) else [here]
        return here + [number for value in content.values() for number in numbers(value, key)]
    if isinstance(content, list):
        return [number for value in content for number in numbers(value, key)]
    return []


def test_files_have_no_errors(folder):
    content = json.loads((folder / "cal.json").read_text())
    assert content["describes_data"] is False
    assert content["reason"]
    errors = (*ERRORS, "k_stderr", "posterior_spread", "power_mW_stderr", "tip_K_stderr")
    for key in (*errors, "tip_temperature_uncertainty_K"):
        values = numbers(content, key)
        assert values, key
        assert set(values) == {None}, key
    assert {error for part in content["budget_K"].values() for error in part} == {None}
    assert set(content["uncertainty_budget_K"].values()) == {None}
    # of the nearest lever
    assert all(row["tip_K"] > 290 for row in content["table"])
    assert "pulse" not in content
    assert any("the pulse was not followed" in note for note in content["notes"])
    rows = list(csv.DictReader((folder / "table.csv").read_text().splitlines()))
    assert all(row[key] == "" for row in rows for key in ERRORS)
    assert all(float(row["tip_K"]) > 290 for row in rows)


def test_words_say_whose_the_numbers_are(refused):
    first, second, *_ = calibration_text(refused).splitlines()
    assert first.startswith("no lever like this one shows these data: ")
    assert "of the lever that comes nearest, and no estimate" in second
    assert not re.search(r"\d\(\d|±", calibration_text(refused).removeprefix(first))
    assert not any("95 %" in note for note in refused.notes)


def test_nothing_says_what_to_set(refused, folder):
    with pytest.raises(InputError, match="the bias for a tip temperature: expected data that"):
        refused.bias_for(600.0)
    with pytest.raises(InputError, match="no lever like this one shows these data"):
        refused.tip_temperature(2.0)
    here: Any = None
    with pytest.raises(InputError, match="what to set"):
        showing.settings(here, str(folder / "cal.json"), "tip_K", 600.0)
    assert showing.result(here, str(folder / "cal.json"))["doubt"] == refused.doubt


def test_no_band_is_drawn_and_the_figure_says_so(refused):
    drawn = figures.calibration_curves(refused)
    by_power, by_bias, iv, _ = drawn.axes
    assert not [*by_power.collections, *by_bias.collections]
    assert "the data are not described" in drawn.get_suptitle()
    for axes in (by_power, by_bias):
        assert "the nearest lever" in [line.get_label() for line in axes.lines]
    assert not any("95 %" in text.get_text() for text in iv.get_legend().get_texts())


def test_the_rows_that_no_lever_shows_are_drawn(refused):
    drawn = {line.get_label(): line for line in figures.calibration_curves(refused).axes[3].lines}
    measured = refused.measurement
    saturated = measured.bias_V[measured.current_mA > 0.95 * measured.current_mA.max()]
    assert saturated.size > 3
    assert set(drawn["off"].get_xdata()) & set(saturated)
    assert drawn["measured"].get_xdata().size == measured.bias_V.size


def test_the_page_has_no_errors(refused):
    page = calibration_page(refused)
    table = next(block for block in page.blocks if block["kind"] == "table")
    assert table["caption"] == "Some rows of the table of the nearest lever, not for an instrument."
    assert not any("error" in column for column in table["columns"])
    assert table["columns"][-1] == "tip temperature (K)"
    assert all(cell for row in table["rows"] for cell in row)


def test_a_search_that_did_not_converge_is_a_third_answer(refused, tmp_path):
    path = tmp_path / "cal.json"
    replace(refused, converged=False, reason="ended after 30 s").write(path)
    assert json.loads(path.read_text())["describes_data"] is None
    again = read_calibration(path)
    assert again.describes_data is None
    assert again.doubt == (
        "the search for a lever that shows these data did not converge: ended after 30 s"
    )
    assert np.isnan(again.tip_temperature_uncertainty_K)
    with pytest.raises(InputError, match="did not converge"):
        again.bias_for(600.0)


def test_what_was_written_before_is_read_without_its_errors(folder, tmp_path):
    """Files of former versions have errors, and no word on the search."""
    content = json.loads((folder / "cal.json").read_text())
    del content["describes_data"]
    for row in content["table"]:
        row |= dict(zip(ERRORS, (5.0, 591.0, 610.0), strict=True))
    for use in content["priors"].values():
        use["posterior_spread"] = 0.1
    (tmp_path / "old.json").write_text(json_text(content))
    old = read_calibration(tmp_path / "old.json")
    assert old.describes_data is False
    assert old.table[list(ERRORS)].to_array().isnull().all()
    del content["reason"]
    (tmp_path / "older.json").write_text(json_text(content))
    assert read_calibration(tmp_path / "older.json").describes_data is True
    content["describes_data"] = False
    (tmp_path / "odd.json").write_text(json_text(content))
    assert read_calibration(tmp_path / "odd.json").describes_data is False
