"""Tables for instruments: even in what is asked, dense where the tip is steep, empty at jumps."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate.tip_table import TipTable, even_rows, interpolated, with_steep_rows

NAMES = ("bias_V", "power_mW", "tip_K")


def tip(bias):
    """A rise that is steep about 7.5 V."""
    return 300.0 + bias**2 + 400.0 / (1.0 + np.exp(-10.0 * (bias - 7.5)))


def table_of(bias, tip_K, power=None):
    power = bias**2 / 20.0 if power is None else power
    columns = {"bias_V": bias, "power_mW": power, "tip_K": tip_K}
    return TipTable(columns, {"budget_K": {"measurement": np.ones(bias.size)}})


@pytest.fixture
def steep():
    even, fine = np.linspace(1.0, 10.0, 91), np.linspace(1.0, 10.0, 9001)
    bias = with_steep_rows(even, fine, tip(fine))
    assert set(even) <= set(bias)
    return table_of(bias, tip(bias))


def test_rows_are_dense_where_the_tip_is_steep(steep):
    even = np.linspace(1.0, 10.0, 91)
    assert np.diff(tip(even)).max() > 90.0
    assert np.diff(steep["tip_K"]).max() < 10.1


@pytest.mark.parametrize(
    ("along", "step"), [("tip_K", 10.0), ("power_mW", 0.05), ("bias_V", 0.1), ("tip_K", 7.5)]
)
def test_rows_are_even_and_hold_at_the_lever_s_own_curve(steep, along, step):
    rows = even_rows(steep, NAMES, along, step)
    inside = rows[along][1:-1]
    np.testing.assert_allclose(inside / step, np.round(inside / step), atol=1e-9)
    np.testing.assert_allclose(np.diff(inside), step, rtol=1e-6)
    np.testing.assert_allclose(rows["bias_V"][[0, -1]], [1.0, 10.0])
    # straight lines between rows ten kelvins apart, of a curve with sharper bends than a lever's
    np.testing.assert_allclose(rows["tip_K"], tip(rows["bias_V"]), atol=0.6)


def test_the_usual_step_is_round_and_gives_fifty_rows_or_more(steep):
    for along, step in (("tip_K", 5.0), ("power_mW", 0.05), ("bias_V", 0.1)):
        rows = even_rows(steep, NAMES, along)
        assert np.diff(rows[along][1:-1]).min() == pytest.approx(step)
    cold = steep.rows(slice(0, 5))
    assert even_rows(cold, NAMES, "tip_K")["tip_K"].size > 50


def test_between_the_ends_of_a_jump_there_are_no_rows():
    even, fine = np.linspace(1.0, 10.0, 91), np.linspace(1.0, 10.0, 9001)

    def jumping(bias):
        return 300.0 + bias**2 + np.where(bias > 7.53, 400.0, 0.0)

    bias = with_steep_rows(even, fine, jumping(fine))
    np.testing.assert_array_equal(bias, even)
    table = table_of(bias, jumping(bias))
    rows = even_rows(table, NAMES, "tip_K", 10.0)
    cold, hot = 300.0 + 7.5**2, 700.0 + 7.6**2
    for along, at in (("tip_K", [cold + 1.0, 500.0, hot - 1.0]), ("bias_V", [7.52, 7.54, 7.58])):
        assert np.isnan(interpolated(table, at, along, "bias_V")).all()
    ends = interpolated(table, [cold - 1.0, cold, hot, hot + 1.0], "tip_K", "bias_V")
    assert interpolated(table.rows(slice(-1, None)), [1.0, 10.0], "bias_V", "bias_V")[1] == 10.0
    np.testing.assert_allclose(ends, [7.4329, 7.5, 7.6, 7.6654], atol=1e-3)
    assert not np.any((rows["tip_K"] > cold) & (rows["tip_K"] < hot))
    assert {350.0, 760.0} <= set(rows["tip_K"])


def test_tables_that_cannot_be_are_refused(steep):
    bias = steep["bias_V"]
    turned = table_of(bias, tip(bias), power=np.sin(bias / 4.0))
    with pytest.raises(InputError, match="does not rise all along, expected by bias"):
        even_rows(turned, NAMES, "power_mW", 0.1)
    with pytest.raises(InputError, match="expected at most 10000 rows"):
        even_rows(steep, NAMES, "tip_K", 1e-3)
