"""States of levers that are held at a resistance or a power."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from hotlever.errors import InputError
from hotlever.figures import held_states as held_states_figure
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.set_points import hold
from hotlever.probe import Probe
from of_materials import metal_film_probe

READER = {
    "circuit.reader.kind": "supply",
    "circuit.reader.bias_V": 2.0,
    "circuit.reader.series_resistance_ohm": 500.0,
}


def resistances(data):
    return 1000.0 * data.lever_V.values / data.current_mA.values


@pytest.fixture(scope="module")
def levers(coarse, in_air):
    """Levers of several kinds, with resistances and powers that they have."""
    reference = coarse.probe
    return {
        "vacuum": coarse,
        "air": in_air,
        "thermoelectric": coarse.with_probe(reference.with_physics(("thermoelectric",), "test")),
        "held reader": Lever(reference.with_(**READER), COARSE),
        "u-shape": Lever(Probe.u_shape(), COARSE),
        "drawn film": Lever(metal_film_probe(), COARSE),
    }


@pytest.mark.parametrize(
    ("name", "held", "values", "count"),
    [
        ("vacuum", "resistance", [1500.0, 3000.0, 3360.0], 5),
        ("vacuum", "power", [0.1, 2.5], 2),
        ("air", "resistance", [3000.0], 2),
        ("thermoelectric", "resistance", [3000.0], 2),
        ("held reader", "resistance", [3000.0], 3),
        ("held reader", "power", [1.0], 1),
        ("u-shape", "resistance", [3000.0], 2),
        ("drawn film", "resistance", [150.0], 1),
    ],
)
def test_states_are_those_that_are_solved_at_their_bias(levers, name, held, values, count):
    lever = levers[name]
    found = hold(lever, held, values)
    data = found.data
    held_values = resistances(data) if held == "resistance" else data.power_mW.values
    assert len(found.states) == data.sizes["bias"] == count
    assert held_values == pytest.approx(
        data[f"set_{'ohm' if held == 'resistance' else 'mW'}"], rel=1e-9
    )
    solved = lever.solve(data.bias_V.values)
    assert [state.tip_K for state in solved] == pytest.approx(data.tip_K.values, rel=1e-9)
    assert [state.tip_K for state in found.states] == pytest.approx(data.tip_K.values, rel=1e-12)


def test_both_states_are_where_a_search_over_the_bias_finds_them(coarse):
    def missed(bias):
        (state,) = coarse.solve([bias])
        return 1000.0 * state.lever_V / state.current_mA - 2800.0

    data = hold(coarse, "resistance", [2800.0]).data
    truth = [brentq(missed, low, high, xtol=1e-10) for low, high in ((7.0, 8.1), (8.2, 10.0))]
    assert data.bias_V.values == pytest.approx(truth, rel=1e-8)
    tips = [state.tip_K for state in coarse.solve(truth)]
    assert data.tip_K.values == pytest.approx(tips, rel=1e-6)
    assert data.state.values.tolist() == [1, 2]


def test_the_series_resistor_changes_the_bias_alone(coarse):
    bare = coarse.with_probe(coarse.probe.with_(series_resistance_ohm=0.0))
    with_it, without = (hold(lever, "resistance", [3000.0]).data for lever in (coarse, bare))
    assert without.tip_K.values == pytest.approx(with_it.tip_K.values, rel=1e-9)
    assert without.bias_V.values == pytest.approx(with_it.lever_V.values, rel=1e-9)


@pytest.mark.parametrize(("held", "value"), [("resistance", 2500.0), ("power", 2.0)])
def test_slopes_are_differences_of_neighbours(coarse, held, value):
    data = hold(coarse, held, value * np.array([0.9995, 1.0, 1.0005])).data
    unit = "ohm" if held == "resistance" else "mW"
    for number in np.unique(data.state):
        state = data.isel(bias=data.state.values == number)
        below, _, above = state.tip_K.values
        slope = state[f"slope_{unit}_per_K"].values[1]
        assert slope == pytest.approx(1e-3 * value / (above - below), rel=1e-4)


def test_what_tells_little_is_noted(coarse):
    data = hold(coarse, "resistance", [1330.0, 2500.0, 3366.9]).data
    notes = data.attrs["notes"].split("\n")
    assert len(notes) == 3
    assert notes[0].startswith("1330 ohm tells little of the tip in state 1 (297 K): the swept")
    for number, note in enumerate(notes[1:], start=1):
        assert f"3366.9 ohm tells little of the tip in state {number}" in note
        assert "it turns at 3367" in note


def test_up_to_the_highest_resistance_the_states_are_two(coarse):
    highest = resistances(hold(coarse, "power", [2.0]).curve).max()
    near = hold(coarse, "resistance", [highest * (1.0 - 1e-5)]).data
    assert near.sizes["bias"] == 2
    assert np.ptp(near.tip_K.values) < 3.0
    assert resistances(near) == pytest.approx(near.set_ohm.values, rel=1e-9)
    with pytest.raises(InputError, match="expected one that the lever has"):
        hold(coarse, "resistance", [highest * (1.0 + 1e-3)])


@pytest.mark.parametrize("value", [900.0, 9000.0])
def test_a_resistance_that_it_never_has_names_those_that_it_has(coarse, value):
    with pytest.raises(InputError, match=r"from 1323 ohm \(tip at 293 K\) to 3367\.3 ohm \(tip"):
        hold(coarse, "resistance", [3000.0, value])


@pytest.mark.parametrize("values", [[], [-1.0], [np.nan], [0.0]])
def test_set_points_are_above_zero(coarse, values):
    with pytest.raises(InputError, match="expected finite set points above 0 mW"):
        hold(coarse, "power", values)


def test_a_quantity_that_cannot_be_held(coarse):
    with pytest.raises(InputError, match="did you mean 'power'"):
        hold(coarse, "powr", [1.0])


def test_a_figure_shows_all_of_the_branch(coarse):
    held_states = hold(coarse, "power", [0.5])
    quantity, _ = held_states_figure(held_states.data, held_states.curve).axes
    assert quantity.get_ylim()[1] > held_states.curve.power_mW.max().item()
