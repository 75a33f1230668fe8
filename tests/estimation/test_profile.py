"""Profile likelihoods of fits whose optimum is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from experiments import full_experiment
from hotlever.errors import InputError
from hotlever.estimate import Measurement, fit
from hotlever.estimate.uncertainty import profile_likelihood
from hotlever.lever import Lever

# a profile makes its own lever
pytestmark = pytest.mark.usefixtures("coarse_meshes")

BIAS = np.linspace(2, 11, 10)


def fitted(coarse: Lever, bias, fixed, observables=None):
    sweep = coarse.sweep(bias)
    rng = np.random.default_rng(7)
    data = [
        column.values + 2e-3 * column.values.max() * rng.normal(size=bias.size)
        for column in (sweep.current_mA, sweep.reader_V, sweep.tip_K)
    ]
    return fit(
        Measurement(bias, *data, np.full(bias.size, np.nan)),
        fixed=fixed,
        observables=observables,
        model=lambda probe, bias: full_experiment(coarse.with_probe(probe), bias),
    )


@pytest.fixture(scope="module")
def determined(coarse):
    return fitted(coarse, BIAS, {"n_d": None, "a0": None, "a1": None})


def test_a_well_determined_parameter_has_its_parabola(determined):
    profile = profile_likelihood(determined, "c_kappa", points=7)
    np.testing.assert_allclose(profile.delta_chi_square, profile.parabola, atol=0.3)
    known = determined.parameters["c_kappa"]
    for level in (0.68, 0.95):
        reach = known.stderr * np.sqrt(chi2.ppf(level, 1))
        interval = profile.interval.sel(level=level)
        assert interval.sel(side="lower") == pytest.approx(known.value - reach, abs=0.1 * reach)
        assert interval.sel(side="upper") == pytest.approx(known.value + reach, abs=0.1 * reach)
    assert profile.attrs["notes"] == ""
    assert profile.refitted.sel(parameter="p").shape == profile.value.shape


def test_a_parameter_the_data_leave_open_is_said_to_be_open(coarse):
    """Cold currents do not know how the resistivity rises with temperature."""
    result = fitted(
        coarse,
        np.linspace(0.5, 2.5, 6),
        {"delta": None, "n_d": None, "a0": None, "p": None},
        ["current"],
    )
    profile = profile_likelihood(result, "a1", points=5)
    assert np.isnan(profile.interval.sel(level=0.95, side="lower"))
    assert "a1: the 95 % interval is open on the lower side" in profile.attrs["notes"]
    assert "the data do not exclude values down to its bound 0" in profile.attrs["notes"]


@pytest.mark.parametrize(
    ("name", "points", "message"),
    [
        ("ckappa", 7, "did you mean 'c_kappa'"),
        ("a0", 7, r"no profile of a0: .*\(c_kappa, delta, p\)"),
        ("p", 6, "points = 6, expected an odd number of 5 or more"),
    ],
)
def test_impossible_requests_are_refused(determined, name, points, message):
    with pytest.raises(InputError, match=message):
        profile_likelihood(determined, name, points=points)
