"""Derivatives in time: against moved levers, at rest, and what has none."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import HistoryEndError, InputError
from hotlever.lever.dataset import OBSERVABLES
from hotlever.lever.transient import pulse, step, switched_off
from hotlever.lever.transient.sensitivities import with_sensitivities

#: At a corner of the wave form, before it and behind.
TIMES = [0.0, 2.0, 5.0, 9.0]
NAMES = ["heat_capacity_scale", "series_resistance_ohm"]


def moved(lever, name, share):
    value = float(lever.probe.at([name])[0])
    return lever.with_probe(lever.probe.moved({name: value * (1.0 + share)})), value


@pytest.mark.parametrize(
    ("medium", "names"),
    [
        ("vacuum", NAMES),
        pytest.param("air", ["gas_conductivity"], marks=pytest.mark.slow),
    ],
)
def test_they_are_what_moved_levers_differ_by(coarse, in_air, medium, names):
    lever = coarse if medium == "vacuum" else in_air
    wave = pulse(10.0, 5.0)
    data = with_sensitivities(lever, wave, TIMES, names)
    assert data.bias_V.values.tolist() == [10.0, 10.0, 10.0, 0.0]
    plain = lever.pulse(wave, at=TIMES, tolerance_K=0.01)
    np.testing.assert_allclose(data.tip_K[1:], plain.tip_K[1:], atol=0.1)
    for name in names:
        sides = []
        for share in (0.01, -0.01):
            other, value = moved(lever, name, share)
            sides.append(with_sensitivities(other, wave, TIMES, names[:1]))
        for observable, column in OBSERVABLES.items():
            difference = ((sides[0][column] - sides[1][column]) / (0.02 * value)).values
            found = data.sensitivity.sel(observable=observable, parameter=name).values
            size = np.abs(difference).max()
            # second differences, and steps that differ
            np.testing.assert_allclose(found, difference, atol=2e-3 * size)


def test_after_long_they_are_those_at_rest(coarse):
    names = ["n_d", "a1", "heat_capacity_scale"]
    found = with_sensitivities(coarse, step(4.0), [3000.0], names).sensitivity
    rest = coarse.sweep([4.0], sensitivities=True).sensitivity
    for name in names[:2]:
        np.testing.assert_allclose(
            found.sel(parameter=name)[:, 0], rest.sel(parameter=name)[:, 0], rtol=1e-3
        )
    assert np.abs(found.sel(parameter="heat_capacity_scale", observable="tip")).item() < 1e-3


def test_a_larger_heat_capacity_only_stretches_the_time(coarse):
    """Of a step: x(t, c) = x(t/c), so that ∂x/∂c = −t ∂x/∂t."""
    data = with_sensitivities(coarse, step(4.0), [9.9, 10.0, 10.1], NAMES[:1], tolerance_K=1e-3)
    tip = data.tip_K.values
    expected = -10.0 * (tip[2] - tip[0]) / 0.2
    found = data.sensitivity.sel(observable="tip", parameter="heat_capacity_scale").values[1]
    assert found == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"names": ["heat_capacity_scal"]}, "did you mean 'heat_capacity_scale'"),
        ({"names": ["heater_width_um"]}, "no derivatives in time by heater_width_um"),
        ({"names": ["base_temperature_K"]}, "no derivatives in time by base_temperature_K"),
        ({"names": []}, "found no parameter"),
        ({"at": [-1.0]}, "negative"),
        ({"waveform": switched_off(2.0)}, "begins at 2 V"),
    ],
    ids=str,
)
def test_what_has_none_is_refused(coarse, given, said):
    asked = {"waveform": step(4.0), "at": [1.0], "names": ["n_d"], **given}
    with pytest.raises(InputError, match=said):
        with_sensitivities(coarse, **asked)


def test_where_silicon_melts_there_are_none(coarse):
    with pytest.raises(HistoryEndError, match="silicon melts before"):
        with_sensitivities(coarse, step(40.0), [5.0], ["n_d"])
