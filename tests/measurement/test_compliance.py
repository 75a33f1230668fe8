"""Rows at the limit of an instrument are left out and named; what stands still otherwise stays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hotlever import Lever, Probe, fit
from hotlever.lever.lever import COARSE
from hotlever.measurement import Measurement, read_measurement
from hotlever.measurement.rows import without_rows_at_compliance
from hotlever.types import Array

#: A lever whose current has a maximum and rises again, from a source that is limited to 0.95 mA:
#: bias (V) and current (A) at every second row.
LIMITED = """V_b (V),I_h (A)
0.5,7.223397e-05\n1,0.0001444028\n1.5,0.0002165672\n2,0.0002880275\n2.5,0.0003598299
3,0.0004308226\n3.5,0.000501004\n4,0.0005709174\n4.5,0.0006400177\n5,0.0007068038
5.5,0.0007726296\n6,0.0008357143\n6.5,0.0008886822\n7,0.000936305\n7.25,0.0009500057
7.5,0.0009500266\n7.75,0.0009245583\n8,0.0008979869\n8.25,0.0009234277\n8.5,0.0009500304
8.75,0.0009500313\n9,0.0009500323
"""
#: A current at its maximum, digitised in steps of 4 µA (`uiuc-lever.csv`, from its tenth row on).
DIGITISED = """V_b (V),I_h (mA)
5.349,0.6632\n5.842,0.6880\n6.327,0.7045\n6.817,0.7169\n7.309,0.7251
7.795,0.7293\n8.286,0.7334\n8.779,0.7334\n9.262,0.7334\n9.754,0.7293
"""


def measurement(bias: Array, current: Array, **columns: Array) -> Measurement:
    nothing = np.full(bias.size, np.nan)
    return Measurement(bias, current, columns.pop("reader_V", nothing), nothing, nothing, **columns)


@pytest.fixture(scope="module")
def branch():
    return Lever(Probe.reference(), COARSE).branch(1200.0)


def curve(branch, rows: int, noise: float, kohm: float = 5.6) -> tuple[Array, Array]:
    """The bias and current of a sweep, whose current has a maximum behind a small resistance."""
    u = np.linspace(1.0, branch.end_u, 4000)
    lever, current = branch.curve(u)[:, :2].T
    bias = np.maximum.accumulate(lever + kohm * current)
    at = np.linspace(0.05 * bias[-1], bias[-1], rows)
    rng = np.random.default_rng(rows)
    return at, np.interp(at, bias, current) * (1.0 + noise * rng.standard_normal(rows))


def test_a_file_of_a_source_at_compliance_loses_these_rows_and_says_which(tmp_path):
    path = tmp_path / "limited.csv"
    path.write_text(LIMITED)
    measured = read_measurement(path)
    assert measured.bias_V.size == LIMITED.count("\n") - 1 - 5
    (note,) = measured.notes
    assert "I_h is clipped at 0.95 mA" in note
    assert "5 rows at 7.25, 7.5, 8.5, 8.75, 9 V left out" in note


def test_a_digitised_current_at_its_maximum_stays(tmp_path):
    path = tmp_path / "digitised.csv"
    path.write_text(DIGITISED)
    assert read_measurement(path).bias_V.size == 10


WAYS: dict[str, Callable[[Array], Array]] = {
    "up": lambda rows: rows,
    "down": lambda rows: rows[::-1],
    "up and down": lambda rows: np.concatenate([rows, rows[::-1]]),
    "each three times": lambda rows: np.repeat(rows, 3),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("noise", [0.0, 2e-3])
@pytest.mark.parametrize("rows", [25, 300])
def test_a_clipped_current_is_found_in_any_order_of_the_rows(branch, rows, noise, way):
    bias, current = map(WAYS[way], curve(branch, rows, noise))
    assert without_rows_at_compliance(measurement(bias, current)).bias_V.size == bias.size
    limit = 0.85 * current.max()
    clipped = without_rows_at_compliance(measurement(bias, np.minimum(current, limit)))
    np.testing.assert_array_equal(clipped.bias_V, bias[current < limit * (1.0 - 1e-4)])


def test_both_polarities_are_at_the_same_limit(branch):
    bias, current = curve(branch, 30, 1e-3)
    bias, current = np.append(-bias[::-1], bias), np.append(-current[::-1], current)
    limit = 0.9 * current.max()
    clipped = without_rows_at_compliance(measurement(bias, np.clip(current, -limit, limit)))
    np.testing.assert_array_equal(clipped.bias_V, bias[np.abs(current) < limit])


def test_the_limits_of_both_polarities_may_be_apart_by_an_offset(branch):
    bias, current = curve(branch, 30, 1e-3)
    bias, current = np.append(-bias[::-1], bias), np.append(-current[::-1], current)
    limit = 0.9 * current.max()
    low, high = -0.9995 * limit, limit
    clipped = without_rows_at_compliance(measurement(bias, np.clip(current, low, high)))
    np.testing.assert_array_equal(clipped.bias_V, bias[(low < current) & (current < high)])


def test_a_voltage_at_compliance_is_found_by_the_current_that_goes_on(branch):
    current = np.linspace(0.05, 1.4, 28)
    lever = np.interp(current, *branch.curve(np.linspace(1.0, 30.0, 2000))[:, 1::-1].T)
    bias = np.minimum(lever + 5.6 * current, 8.0)
    clipped = without_rows_at_compliance(measurement(bias, current))
    np.testing.assert_array_equal(clipped.current_mA, current[bias < 8.0])
    assert "V_b is clipped at 8 V" in clipped.notes[0]


@pytest.mark.parametrize("share", [0.9, 0.5])
def test_a_bias_set_in_regular_steps_is_clipped_where_the_current_goes_on(branch, share):
    """The range of its voltmeter ended while the bias rose; it was taken for one that is held."""
    bias, current = curve(branch, 40, 5e-4)
    limit = share * bias.max()
    clipped = without_rows_at_compliance(measurement(np.minimum(bias, limit), current))
    np.testing.assert_array_equal(clipped.current_mA, current[bias < limit])
    assert "V_b is clipped" in clipped.notes[0]


def test_of_a_voltmeter_that_heats_nothing_its_value_goes_alone(branch):
    bias, current = curve(branch, 30, 1e-3)
    reader = np.minimum(0.02 * bias + 0.004 * bias**2, 0.35)
    clipped = without_rows_at_compliance(measurement(bias, current, reader_V=reader))
    np.testing.assert_array_equal(np.isnan(clipped.reader_V), reader == 0.35)
    assert clipped.bias_V.size == 30


@pytest.mark.parametrize("rows", [20, 100, 1000])
@pytest.mark.parametrize("kohm", [0.0, 5.6])
def test_a_maximum_stays_however_finely_it_was_measured(branch, rows, kohm):
    flat = measurement(*curve(branch, rows, 1e-5, kohm))
    assert without_rows_at_compliance(flat) is flat


@pytest.mark.parametrize("steps", [20, 250, 4000])
def test_a_coarse_current_stays(branch, steps):
    bias, current = curve(branch, 120, 0.0)
    step = current.max() / steps
    coarse = measurement(bias, np.round(current / step) * step)
    assert without_rows_at_compliance(coarse) is coarse


def test_a_bias_that_is_held_while_the_current_drifts_stays(branch):
    bias, current = curve(branch, 40, 0.0)
    held = np.append(bias, np.full(10, bias[-1]))
    drifting = measurement(held, np.append(current, current[-1] * np.linspace(1.0, 1.01, 10)))
    assert without_rows_at_compliance(drifting) is drifting


@pytest.mark.usefixtures("coarse_meshes")
def test_a_fit_of_clipped_data_made_in_memory_is_that_of_the_other_rows(branch):
    bias, current = curve(branch, 30, 5e-4)
    limit = 0.9 * current.max()
    options = {"fixed": dict.fromkeys(("p", "a0", "a1"))}
    clipped = fit(measurement(bias, np.minimum(current, limit)), **options)
    without = fit(measurement(bias, current).part(current < limit), **options)
    assert clipped.describes_data
    n_d = without.parameters["n_d"].value
    assert clipped.parameters["n_d"].value == pytest.approx(n_d, rel=1e-9)
    assert "I_h is clipped" in clipped.measurement.notes[0]
