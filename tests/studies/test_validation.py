"""Published numbers: cases that can be read, what they predict, and how they are judged."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.constants import Boltzmann

from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.studies.validation.case import QUANTITIES, Case, cases, johnson_noise, sought
from hotlever.studies.validation.prediction import (
    OUTSIDE,
    PredictedNumber,
    comparison,
    computed,
    predict,
)

HEAD = """quantity = "{quantity}"
group = "a group"
source = "a source"
stated = "little"
assumed = "much"
"""
LAYER = HEAD.format(quantity="layer_conductivity") + "[given]\ntemperature_K = 300\nscale = 1\n"


@pytest.fixture(scope="module")
def published():
    return {case.name: case for case in cases()}


@pytest.fixture
def case_of(tmp_path):
    def read_case(text):
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        return Case.from_file(path)

    return read_case


def stored(case):
    return PredictedNumber.as_stored(case.prediction, case.definition.is_share)


def test_every_case_is_complete(published):
    assert len(published) >= 12
    assert len({case.group for case in published.values()}) >= 6
    for case in published.values():
        assert case.prediction is not None, case.name
        assert case.published is not None, case.name
        low, high = stored(case).band_95
        assert low == pytest.approx(case.prediction.low_95, rel=2e-3)
        assert high == pytest.approx(case.prediction.high_95, rel=2e-3)
        off = stored(case).verdict(case.published.value, case.published.error) == OUTSIDE
        assert (bool(case.outside), bool(case.variants)) == (off, off), case.name
    assert {case.quantity for case in published.values()} <= set(QUANTITIES)
    assert all(len(row) == 3 and all(row) for row in sought())


@pytest.mark.parametrize(
    "name",
    [
        *("paris-glass-contact", "illinois-share-on-quartz", "philips-resistance"),
        "bulk-at-425-celsius",
    ],
)
def test_cheap_cases_predict_what_was_written_down(published, name):
    now, before = predict(published[name]), stored(published[name])
    assert (now.impossible, now.silent) == (0, 0)
    assert now.median == pytest.approx(before.median, rel=1e-3)
    assert now.spread == pytest.approx(before.spread, rel=1e-2)


def test_a_band_is_that_of_a_product_of_what_is_known_to_a_share(case_of):
    # spreading is 1/(4 κ a): variances of logarithms add up, and 64 draws tell a spread to 9 %
    text = HEAD.format(quantity="spreading_resistance")
    case = case_of(text + '[given]\nradius_um = "0.05 ± 10%"\nkappa = "0.2 ± 20%"\n')
    prediction = predict(case)
    assert prediction.median == pytest.approx(1 / (4 * 0.2 * 0.05e-6), rel=0.01)
    assert prediction.spread == pytest.approx(math.hypot(0.1, 0.2), rel=0.18)


def test_evenly_warm_lever_gives_what_a_strip_gives(published):
    # a long strip of width w in free space is a cylinder of radius w/4; its ends add to that
    case = published["columbia-air-coefficient"]
    length, width = 200.0, 30.0
    strip = 2 * math.pi * 0.0255 * length / math.log(4 * length / width) / (2 * length * width)
    assert 1.0 < computed(case) / (1e6 * strip) < 1.35


def test_noise_of_a_cold_lever_is_that_of_its_resistance():
    probe = Probe.reference()
    branch = Lever(probe, COARSE).branch(294.0)
    ohm = 1e3 * float(branch.lever_voltage(294.0) / branch.current(294.0))
    cold = johnson_noise(probe, tip_K=294.0)
    assert cold == pytest.approx(1e9 * math.sqrt(4.0 * Boltzmann * 293.0 * ohm), rel=2e-3)


def test_shares_stay_between_zero_and_one():
    draws = 1 / (1 + np.exp(-np.linspace(-2.0, 4.0, 31)))
    prediction = PredictedNumber.of(draws, is_share=True)
    assert prediction.median == pytest.approx(1 / (1 + math.exp(-1.0)))
    assert 0 < prediction.band_95[0] < prediction.band_95[1] < 1
    # the error of a published share counts as its logit's
    assert prediction.deviation(0.9, 0.1) < PredictedNumber.of(draws, True).deviation(0.9, 0.001)


def test_verdicts_are_by_prediction_and_published_error():
    tenth = PredictedNumber(math.log(100.0), 0.1)
    assert tenth.verdict(109.0, 1e-6) == "inside 68 %"
    assert tenth.verdict(120.0, 1e-6) == "inside 95 %"
    assert tenth.verdict(130.0, 1e-6) == OUTSIDE
    assert tenth.verdict(130.0, 40.0) == "inside 68 %"


def test_table_has_the_columns_that_scripts_read(published):
    some = [published["tsu-raman-shift"], published["illinois-share-on-glass"]]
    frame = comparison(some).to_dataframe()
    head = ",".join([frame.index.name, *frame.columns])
    assert head == (
        "case,group,quantity,unit,predicted,low_95,high_95,published,published_error,verdict,source"
    )
    assert frame.verdict.tolist() == [OUTSIDE, "inside 68 %"]


def test_a_case_of_a_user_is_predicted_and_judged(run, tmp_path):
    text = LAYER.replace("scale = 1", 'scale = "1 ± 10%"\nthickness_um = 0.4')
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    status, out, _ = run("validate", str(path))
    assert status == 0
    assert out.startswith("[prediction]\nmedian = 105")
    path.write_text(text + f'{out}[published]\nvalue = 140\nerror = 1\nsays = "x"\n', "utf-8")
    assert run("validate", str(path))[1].endswith("# published 140 ± 1: outside\n")
    status, _, err = run("validate", str(path), "-o", "page")
    assert (status, err[:50]) == (2, "hotlever: --output: goes without a case of your own"[:50])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD.format(quantity="knee_temprature"), "unknown quantity 'knee_temprature'"),
        (HEAD.format(quantity="layer_conductivty"), "did you mean 'layer_conductivity'"),
        (LAYER, "[given]: thickness_um is missing"),
        (LAYER + "thicknes_um = 1\n", "unknown key 'thicknes_um': did you mean 'thickness_um'"),
        (LAYER + 'thickness_um = "± 5%"\n', "expected a value before its spread"),
        (LAYER + 'thickness_um = "thin"\n', "expected a value and its spread"),
        (LAYER + "thickness_um = 1\n[probe]\n", "layer_conductivity is of no lever"),
        (HEAD.format(quantity="air_coefficient"), "section [probe] is missing"),
        ('quantity = "air_coefficient"\n', "group is missing"),
    ],
)
def test_what_is_wrong_with_a_case_is_said_in_a_line(case_of, text, message):
    with pytest.raises(InputError) as error:
        case_of(text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_the_page_is_written(run, tmp_path):
    status, out, _ = run("validate", "-o", str(tmp_path / "page"))
    assert (status, out) == (0, f"{tmp_path / 'page' / 'index.html'}\n")
    html = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    assert all(case.name in html for case in cases())
    assert "Predicted anew today, all are the same" in html
    table = (tmp_path / "page" / "validation.csv").read_text(encoding="utf-8")
    assert len(table.splitlines()) == 1 + len(cases())
