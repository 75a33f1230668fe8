"""Levers with several supplies, grounds and sense contacts, and leg ends of other temperatures."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import Lever, Probe
from hotlever.errors import ComputationError, InputError
from hotlever.lever.dataset import probe_of, read_sweep, write_sweep
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import simulate, step
from hotlever.lever3d import SolidLever

BIAS = [1.0, 4.0, 7.22, 8.268]


def wired(medium: str = "vacuum", **terminals: dict) -> Probe:
    """The reference probe with something else wired to some terminals."""
    probe = Probe.reference().in_medium(medium)
    changes = {
        f"circuit.{name}.{key}": value
        for name, contact in terminals.items()
        for key, value in contact.items()
    }
    return probe.with_(**changes)


HEATED = {"kind": "supply", "bias_V": 2.0}
CIRCUITS = {
    "second ground": {"reader": {"kind": "ground"}},
    "ground behind a resistor": {"reader": {"kind": "ground", "series_resistance_ohm": 2000.0}},
    "voltage": {"reader": HEATED},
    "other polarity": {
        "reader": {"kind": "supply", "bias_V": -2.0, "series_resistance_ohm": 1000.0}
    },
    "current": {"reader": {"kind": "supply", "current_mA": 0.3}},
    "warm end": {"ground": {"kind": "ground", "base_temperature_K": 350.0}},
}


@pytest.mark.parametrize(
    ("circuit", "medium"),
    [*((name, "vacuum") for name in CIRCUITS), ("voltage", "air"), ("warm end", "air")],
)
def test_charge_and_energy_are_balanced(circuit, medium):
    if (circuit, medium) == ("warm end", "air"):
        with pytest.raises(InputError, match="in air all leg ends have the base temperature"):
            wired(medium, **CIRCUITS[circuit])
        return
    lever = Lever(wired(medium, **CIRCUITS[circuit]), COARSE)
    solved = lever.dataset(lever.solve(BIAS))
    at_reader = solved.get("reader_mA", 0.0 * solved.current_mA)
    ground = solved.ground_current_mA
    if lever.circuit.contact("reader").kind == "ground":
        ground = ground + at_reader  # which counts it among the grounds
    np.testing.assert_allclose(solved.current_mA + at_reader, ground, rtol=1e-9)
    by_reader = at_reader * solved.reader_V.fillna(0.0)
    out = solved.end_heat_mW + solved.air_heat_mW
    np.testing.assert_allclose(solved.power_mW + by_reader, out, rtol=1e-9)
    read = lever.sweep(BIAS)
    np.testing.assert_allclose(read.tip_K, solved.tip_K, rtol=0, atol=0.05)
    np.testing.assert_allclose(read.current_mA, solved.current_mA, rtol=0, atol=5e-5)


def test_the_linear_limit_is_reciprocal():
    """The current at one terminal for a voltage at another is the same either way."""
    small = 1e-5
    held = {"kind": "supply", "bias_V": 0.0}
    probe = wired(reader=held).with_(series_resistance_ohm=0.0)
    by_supply = Lever(probe, COARSE).sweep([small]).reader_mA
    other = Probe.reference().with_(
        series_resistance_ohm=0.0,
        swept="reader",
        **{f"circuit.supply.{key}": value for key, value in held.items()},
    )
    by_reader = Lever(other, COARSE).sweep([small]).supply_mA
    assert by_supply.item() < 0
    np.testing.assert_allclose(by_supply, by_reader, rtol=1e-9)


def test_which_supply_is_swept_changes_nothing():
    held = Lever(wired(reader=HEATED).with_(series_resistance_ohm=0.0), COARSE)
    by_held = held.dataset(held.solve([1.0]))
    changes = {"circuit.supply.kind": "supply", "circuit.supply.bias_V": 1.0}
    probe = Probe.reference().with_(swept="reader", series_resistance_ohm=0.0, **changes)
    swept = Lever(probe, COARSE)
    by_swept = swept.dataset(swept.solve([2.0]))
    np.testing.assert_allclose(by_swept.tip_K, by_held.tip_K, rtol=1e-9)
    np.testing.assert_allclose(by_swept.supply_mA, by_held.current_mA, rtol=1e-8)
    np.testing.assert_allclose(by_swept.current_mA, by_held.reader_mA, rtol=1e-8)


def test_a_current_supply_does_what_a_voltage_supply_of_that_current_does():
    voltage = Lever(wired(reader={**HEATED, "series_resistance_ohm": 500.0}), COARSE)
    first = voltage.dataset(voltage.solve([5.0]))
    drop = 0.5 * first.reader_mA
    np.testing.assert_allclose(first.reader_V + drop, 2.0, rtol=1e-9)
    current = {"kind": "supply", "current_mA": first.reader_mA.item()}
    other = Lever(wired(reader=current), COARSE)
    second = other.dataset(other.solve([5.0]))
    np.testing.assert_allclose(second.tip_K, first.tip_K, rtol=1e-9)
    np.testing.assert_allclose(second.reader_V, first.reader_V, rtol=1e-9)


def test_a_lever_that_melts_without_a_bias_says_so():
    with pytest.raises(ComputationError, match="without a bias silicon melts"):
        Lever(wired(reader={"kind": "supply", "bias_V": 4.0}), COARSE).sweep([1.0])


def test_a_step_ends_where_the_lever_rests_and_its_heat_is_balanced():
    lever = Lever(wired(reader=HEATED), COARSE)
    history = simulate(lever, step(5.0), at=[0.0, 10.0, 5000.0], tolerance_K=0.01)
    (rest,) = lever.solve([5.0])
    assert history.tip_K.values[-1] == pytest.approx(rest.tip_K, abs=0.01)
    (start,) = lever.solve([0.0])

    held = history.stored_nJ - history.stored_nJ[0]
    left = (history.supplied_nJ - held - history.lost_nJ)[1:]
    assert np.abs(left / history.supplied_nJ[1:]).max() < 1e-6
    assert start.tip_K > 400.0


@pytest.mark.slow
def test_a_solid_lever_is_as_warm_as_a_flat_one():
    probe = wired(reader=HEATED)
    flat, solid = Lever(probe).sweep([2.0, 7.0]), SolidLever(probe).sweep([2.0, 7.0])
    np.testing.assert_allclose(solid.tip_K, flat.tip_K, atol=0.3)


def test_supplies_may_hold_all_terminals():
    """Then no current goes to ground, and each has its own."""
    held = {"kind": "supply", "bias_V": -1.0, "series_resistance_ohm": 300.0}
    probe = Probe.u_shape().with_(**{f"circuit.ground.{key}": held[key] for key in held})
    lever = Lever(probe, COARSE)
    solved = lever.dataset(lever.solve([0.0, 2.0]))
    np.testing.assert_allclose(solved.ground_mA, -solved.current_mA, rtol=1e-9)
    np.testing.assert_allclose(solved.ground_V + 0.3 * solved.ground_mA, -1.0, rtol=1e-9)
    assert solved.ground_current_mA.values.tolist() == [0.0, 0.0]


def test_files_keep_circuit_and_columns(tmp_path):
    probe = wired(reader=HEATED)
    probe.to_file(tmp_path / "probe.toml")
    assert Probe.from_file(tmp_path / "probe.toml") == probe
    data = Lever(probe, COARSE).sweep([1.0, 2.0])
    write_sweep(data, tmp_path / "sweep.nc")
    again = read_sweep(tmp_path / "sweep.nc")
    assert probe_of(again) == probe
    write_sweep(again, tmp_path / "again.csv")
    head, *rows = (tmp_path / "again.csv").read_text().splitlines()
    assert head.endswith(",legs_ohm,reader_mA")
    assert len(rows) == 2
    assert again.reader_mA.attrs == {
        "units": "mA",
        "long_name": "current into the lever at terminal reader",
    }


def test_the_plain_circuit_is_written_as_ever():
    assert "swept" not in Probe.reference().to_toml()


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"readr": {"kind": "ground"}}, "unknown terminal 'readr': did you mean 'reader'"),
        ({"reader": {"kind": "suply"}}, r"\[circuit.reader\]: kind = 'suply'"),
        ({"reader": {"kind": "supply"}}, "expected bias_V or current_mA"),
        ({"reader": {"kind": "sense", "bias_V": 1.0}}, "bias_V means nothing with kind"),
        ({"reader": {"kind": "supply", "bias_V": 1.0, "current_mA": 1.0}}, "one of them"),
        ({"reader": {"kind": "sense", "series_resistance_ohm": 5.0}}, "before a sense contact"),
        ({"supply": {"kind": "ground"}}, "it is swept"),
        ({"swept": "reader"}, "leaves the terminal 'supply'"),
        ({"ground": {"kind": "sense"}}, "no terminal is at ground"),
    ],
)
def test_a_circuit_at_fault_is_refused_in_a_line(section, message):
    values = Probe.reference().sections()
    values["circuit"] = {**values["circuit"], **section}
    with pytest.raises(InputError, match=message):
        Probe.from_sections(values, "probe.toml")


def test_a_name_of_a_contact_is_found_by_its_typo():
    with pytest.raises(InputError, match="did you mean 'bias_V'"):
        Probe.reference().with_(**{"circuit.reader.bias": 1.0})
