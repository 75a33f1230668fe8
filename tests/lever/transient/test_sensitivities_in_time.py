"""Derivatives in time: by the Taylor test, at rest, and what has none."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import HistoryEndError, InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import pulse, simulate, step, switched_off
from hotlever.lever.transient.history import time_steps
from hotlever.lever.transient.sensitivities import with_sensitivities
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import heat_capacities
from hotlever.quantities import observables_of
from of_materials import strip_probe

#: So that every observable is there.
BRIDGE = {"bridge_upper_ohm": 5600.0, "bridge_lower_ohm": 2000.0}
NAMES = ["heat_capacity_scale", "series_resistance_ohm"]
OF_SILICON = [*PARAMETERS, "impurity_exponent", "intrinsic_scale", "n_hd"]
#: What each parameter moves the tip by (K), and the largest share of its value that it moves by.
MOVED_K, MOST = 1.0, 0.2


def values_of(data):
    return observables_of(data)


@pytest.mark.parametrize(
    ("medium", "names"),
    [
        ("vacuum", [*OF_SILICON, *NAMES]),
        pytest.param("air", ["gas_conductivity", *NAMES], marks=pytest.mark.slow),
    ],
)
def test_they_have_taylor_order_two(coarse, in_air, medium, names):
    """All parameters move at once, each by as much as it matters, on the same steps."""
    lever = coarse if medium == "vacuum" else in_air
    lever = lever.with_probe(lever.probe.with_(**BRIDGE))
    wave = pulse(10.0, 0.3)
    ends = [0.0, *(step.end for _, step in time_steps(lever, wave, 0.6, 0.1))]
    # with stops at half of what errors allow nothing but the stops makes steps
    stops = np.union1d(ends[1:], 0.5 * np.add(ends[1:], ends[:-1])).tolist()
    assert [step.end for _, step in time_steps(lever, wave, 0.6, 0.1, stops=stops)] == stops
    base = with_sensitivities(lever, wave, stops, names)
    assert set(base.bias_V.values.tolist()) == {10.0, 0.0}
    plain = simulate(lever, wave, at=stops, tolerance_K=0.05)
    np.testing.assert_allclose(base.tip_K, plain.tip_K, atol=0.1)
    slopes, value = base.sensitivity.values, lever.probe.values(names)
    unit = np.where(value == 0.0, 1.0, value)
    share = np.minimum(MOVED_K / np.abs(slopes[2] * unit).max(axis=0), MOST)
    perturbation = share * unit * np.random.default_rng(0).choice([-1.0, 1.0], len(names))
    rest = []
    for h in (1.0, 0.5):
        changes = dict(zip(names, (value + h * perturbation).tolist(), strict=True))
        other = with_sensitivities(
            lever.with_probe(lever.probe.replace(changes)), wave, stops, names[-1:]
        )
        missed = values_of(other) - values_of(base) - h * (slopes @ perturbation)
        rest.append(np.abs(missed).max(axis=1))
    np.testing.assert_allclose(np.log2(rest[0] / rest[1]), 2.0, atol=0.1)


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


def test_heat_capacities_of_films_stretch_the_time_together():
    """They were no parameters, so that no pulse of such a lever could be fitted."""
    lever = Lever(strip_probe(), COARSE)
    names = heat_capacities(lever.probe)
    assert names == ("nitride.heat_capacity", "film.heat_capacity")
    data = with_sensitivities(lever, step(0.1), [0.95, 1.0, 1.05], names, tolerance_K=1e-3)
    tip = data.tip_K.values
    slopes = data.sensitivity.sel(observable="tip").values[1]
    assert slopes @ lever.probe.values(names) == pytest.approx(-10 * (tip[2] - tip[0]), rel=5e-3)


@pytest.mark.parametrize(
    ("options", "message"),
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
def test_what_has_none_is_refused(coarse, options, message):
    arguments = {"waveform": step(4.0), "at": [1.0], "names": ["n_d"], **options}
    with pytest.raises(InputError, match=message):
        with_sensitivities(coarse, **arguments)


def test_a_lever_that_begins_warm_has_none():
    reader = {"circuit.reader.kind": "supply", "circuit.reader.current_mA": 0.5}
    warm = Lever(Probe.reference().with_(**reader), COARSE)
    with pytest.raises(InputError, match=r"\[circuit.reader\]: a derivative in time takes a lever"):
        with_sensitivities(warm, step(4.0), [1.0], ["n_d"])


def test_where_silicon_melts_there_are_none(coarse):
    with pytest.raises(HistoryEndError, match="silicon melts before"):
        with_sensitivities(coarse, step(40.0), [5.0], ["n_d"])
