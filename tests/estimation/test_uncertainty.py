"""What a posterior and profiles say in words and in the fit file."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from experiments import reduced_experiment
from hotlever.estimate import Measurement, fit
from hotlever.estimate.uncertainty import Uncertainty

BIAS = np.linspace(2, 11, 8)


@pytest.fixture(scope="module")
def fitted(coarse, reduced):
    sweep = coarse.sweep(BIAS)
    rng = np.random.default_rng(5)
    data = [
        column.values * (1 + 2e-3 * rng.normal(size=BIAS.size))
        for column in (sweep.current_mA, sweep.reader_V, sweep.tip_K)
    ]
    return fit(
        Measurement(BIAS, *data, np.full(BIAS.size, np.nan)),
        fixed={"delta": None, "n_d": None, "a0": None, "a1": None},
        model=lambda probe, bias: reduced_experiment(coarse.with_probe(probe), reduced, bias),
    )


def drawn(fitted, shift=0.0, widen=1.0, effective=2000.0, **others) -> xr.Dataset:
    """Normal samples as the fit's standard errors have it, or not."""
    rng = np.random.default_rng(0)
    draws = {}
    for name in fitted.names:
        known = fitted.parameters[name]
        draws[name] = known.value + known.stderr * (shift + widen * rng.normal(size=4000))
    draws |= others
    variables = {name: ("draw", values, {"units": "1"}) for name, values in draws.items()}
    return xr.Dataset(
        {
            **variables,
            "effective_sample_size": ((), effective),
        },
        coords={"quantity": list(draws)},
        attrs={"seed": 0, "noise": "common", "surrogate_error_K": 0.0},
    )


def statements(fitted, **options) -> list[str]:
    return Uncertainty(fitted, drawn(fitted, **options), None, {}).statements()


def test_a_posterior_that_the_standard_errors_describe_needs_no_words(fitted):
    assert statements(fitted) == []


def test_another_posterior_than_the_standard_errors_say_is_named(fitted):
    for options in ({"shift": 1.5}, {"widen": 2.0}):
        texts = statements(fitted, **options)
        assert len(texts) == 2
        assert texts[0].startswith("c_kappa: 95 % of the posterior lies between")


def test_a_parameter_that_is_not_determined_is_named(fitted):
    rng = np.random.default_rng(1)
    at_bound = 1.0 + np.abs(rng.normal(0, 0.3, size=4000))
    assert statements(fitted, p=at_bound) == [
        "p is not determined by these data: its posterior reaches its bound 1"
    ]
    wide = rng.uniform(1.3, 3.7, size=4000)
    assert statements(fitted, p=wide) == [
        "p is not determined by these data: its posterior is about as wide as its bounds"
    ]


def test_too_few_samples_are_said(fitted):
    (text,) = statements(fitted, effective=50.0)
    assert text.startswith("the posterior is not settled: its samples are worth 50")


def test_fit_file_keeps_its_keys_and_gains_the_numbers(fitted):
    posterior = drawn(fitted)
    quantile = [2.5, 16.0, 50.0, 84.0, 97.5]
    tip = 300 + np.array([-4, -2, 0, 2, 4.0])[:, None] * np.array([0.1, 1.0, 0.5])
    band = xr.Dataset(
        {"tip_K": (("quantile", "bias"), tip), "tip_at_power_K": (("quantile", "power_mW"), tip)},
        coords={"quantile": quantile, "bias": [1.0, 2.0, 3.0], "power_mW": [0.1, 0.2, 0.3]},
    )
    profile = xr.Dataset(
        {
            "delta_chi_square": ("point", [4.0, 0.0, 1.0]),
            "interval": (("level", "side"), [[0.6, 0.7], [0.5, np.nan]]),
        },
        coords={"value": ("point", [0.5, 0.65, 0.8]), "level": [0.68, 0.95]},
        attrs={"quantity": "c_kappa", "notes": "c_kappa: the 95 % interval is open"},
    )
    found = Uncertainty(fitted, posterior, band, {"c_kappa": profile})
    content = json.loads(found.to_json())
    own = json.loads(fitted.to_json())
    assert {key: content[key] for key in own} == own
    quantities = content["posterior"]["quantities"]
    assert content["posterior"]["samples"] == 4000
    assert content["posterior"]["effective_sample_size"] == 2000.0
    for name in fitted.names:
        known = fitted.parameters[name]
        assert quantities[name]["mean"] == pytest.approx(known.value, abs=0.1 * known.stderr)
        assert quantities[name]["quantiles"]["97.5"] == pytest.approx(
            known.value + 1.96 * known.stderr, abs=0.2 * known.stderr
        )
    assert content["posterior"]["band"]["tip_K"][4] == [300.4, 304.0, 302.0]
    assert content["profiles"]["c_kappa"]["interval"] == {"68": [0.6, 0.7], "95": [0.5, None]}
    assert content["uncertainty_notes"] == [
        "c_kappa: the 95 % interval is open",
        "the predicted tip temperature is uncertain by at most 4.0 K (half of the 95 % band, at "
        "2 V), the model taken as exact",
    ]
