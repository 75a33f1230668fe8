"""The temperature-power law: as published, its inverse, its scaling, and fits of it."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hotlever.errors import InputError
from hotlever.estimate.power_law import EQ12, fit_power_law, law_of_model, read_power_law

pytestmark = pytest.mark.usefixtures("coarse_meshes")

POWER = np.linspace(0.1, 4.0, 80)


def test_eq12_jumps_by_a_few_kelvin_at_its_threshold():
    below, above = EQ12.tip_temperature([2.95, 2.95 + 1e-9])
    assert below == pytest.approx(917, abs=1)
    assert above == pytest.approx(921, abs=1)
    assert EQ12.jump_K == pytest.approx(above - below, abs=1e-5)


def test_no_power_is_the_base_temperature():
    assert EQ12.tip_temperature(0.0, 300.0) == 300.0


@given(st.floats(0.0, 8.0))
def test_the_inverse_returns_the_power(power):
    tip = EQ12.tip_temperature(power)
    assert EQ12.power(tip) == pytest.approx(power, rel=1e-9, abs=1e-12)


def test_temperatures_inside_the_jump_belong_to_the_threshold():
    assert EQ12.power(919.0) == 2.95
    overlapping = EQ12.with_(hot_K_per_mW=200.0)
    assert overlapping.jump_K < 0
    assert overlapping.power(900.0) < 2.95


def test_the_inverse_refuses_temperatures_below_the_base():
    with pytest.raises(InputError, match="290 K, expected 293 K"):
        EQ12.power(290.0)


def test_the_continuous_variant_keeps_the_coefficients_and_does_not_jump():
    meeting = EQ12.meeting()
    assert meeting.jump_K == pytest.approx(0.0, abs=1e-9)
    assert meeting.hot_K_per_mW == EQ12.hot_K_per_mW
    apart = np.abs(POWER - meeting.threshold_mW) > 0.05
    np.testing.assert_array_equal(
        meeting.tip_temperature(POWER)[apart], EQ12.tip_temperature(POWER)[apart]
    )
    with pytest.raises(InputError, match="do not meet"):
        EQ12.with_(hot_K_per_mW=90.0).meeting()


def test_a_scaled_law_needs_that_much_more_power():
    np.testing.assert_allclose(
        EQ12.scaled(1.29).tip_temperature(1.29 * POWER), EQ12.tip_temperature(POWER)
    )


@pytest.mark.parametrize("continuous", [False, True])
def test_a_fit_recovers_the_law_behind_the_data(continuous):
    law = EQ12.meeting() if continuous else EQ12
    fit = fit_power_law(POWER, law.tip_temperature(POWER), continuous=continuous)
    for name in ("linear_K_per_mW", "nonlinear_K", "exponent", "hot_K_per_mW"):
        assert getattr(fit.law, name) == pytest.approx(getattr(law, name), rel=1e-3), name
    assert fit.law.threshold_mW == pytest.approx(law.threshold_mW, abs=0.03)
    assert np.sqrt(np.mean(fit.residual_K**2)) < 0.1
    if continuous:
        assert fit.law.jump_K == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("continuous", [False, True])
def test_standard_errors_match_the_scatter_of_repeated_fits(continuous):
    law = EQ12.meeting()
    rng = np.random.default_rng(0)
    fits = [
        fit_power_law(
            POWER,
            law.tip_temperature(POWER) + 3.0 * rng.standard_normal(POWER.size),
            continuous=continuous,
        )
        for _ in range(30)
    ]
    for name in ("linear_K_per_mW", "nonlinear_K", "exponent", "hot_K_per_mW"):
        scatter = np.std([getattr(fit.law, name) for fit in fits])
        stated = np.median([fit.stderr[name] for fit in fits])
        assert 0.55 < stated / scatter < 1.7, name
    scatter = np.std([fit.law.threshold_mW for fit in fits])
    stated = np.median([fit.stderr["threshold_mW"] for fit in fits])
    assert 0.5 < stated / scatter < (1.6 if continuous else 3.0)


def test_errors_weigh_and_rows_without_a_temperature_are_left_out():
    tip = EQ12.tip_temperature(POWER)
    tip[::7] = np.nan
    tip[10] += 300.0
    error = np.ones_like(tip)
    error[10] = 1e6
    fit = fit_power_law(POWER[::-1], tip[::-1], error[::-1])
    assert fit.law.exponent == pytest.approx(3.1, rel=1e-3)
    assert fit.power_mW.size == np.isfinite(tip).sum()


def test_a_threshold_can_be_held():
    fit = fit_power_law(POWER, EQ12.tip_temperature(POWER), threshold_mW=2.5)
    assert fit.law.threshold_mW == 2.5
    assert fit.stderr["threshold_mW"] == 0.0
    with pytest.raises(InputError, match="above it, expected at least 4 and 2"):
        fit_power_law(POWER, EQ12.tip_temperature(POWER), threshold_mW=4.0)


def test_too_few_points_are_refused():
    with pytest.raises(InputError, match="5 temperatures with a power above zero"):
        fit_power_law(POWER[:5], EQ12.tip_temperature(POWER[:5]))


def test_power_law_files(tmp_path):
    path = tmp_path / "law.json"
    path.write_text(json.dumps(EQ12.values()))
    assert read_power_law(path) == EQ12
    path.write_text(json.dumps({"power_law": EQ12.values(), "k": 1.29}))
    assert read_power_law(path) == EQ12
    assert EQ12.values()["threshold_K"] == pytest.approx(917, abs=1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "not valid JSON"),
        ("[1]", "expected an object"),
        ('{"power_law": 3}', "found no power law"),
        ('{"linear_K_per_mW": 1}', "nonlinear_K is missing"),
        ('{"linear_K_per_mw": 1}', "did you mean 'linear_K_per_mW'"),
        (json.dumps({**EQ12.values(), "exponent": -1}), "exponent = -1, expected a positive"),
    ],
)
def test_a_bad_power_law_file_is_one_line(tmp_path, content, message):
    path = tmp_path / "law.json"
    path.write_text(content)
    with pytest.raises(InputError, match=message):
        read_power_law(path)


def test_a_lever_that_melts_right_above_its_knee_has_a_law(reference):
    """As that does which comes nearest to a clipped current."""
    knee = reference.knee.power_mW
    melting: Any = SimpleNamespace(
        by_power=SimpleNamespace(highest_mW=1.006 * knee),
        base_temperature_K=reference.base_temperature_K,
        tip_temperature=lambda power: np.where(
            power <= 1.006 * knee, reference.tip_temperature(power), np.nan
        ),
    )
    law, residual = law_of_model(melting, knee)
    assert law.threshold_mW == pytest.approx(knee)
    assert residual < 10.0


@pytest.mark.parametrize("described", [False, None])
def test_a_calibration_that_does_not_describe_its_data_is_no_power_law(tmp_path, described):
    path = tmp_path / "refused.json"
    content = {"power_law": EQ12.values(), "describes_data": described, "reason": "it is cold"}
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"refused.json: expected .* this one does not: it is"):
        read_power_law(path)
