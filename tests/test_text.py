"""Numbers with their errors, and tables of text."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hotlever.errors import unknown_name
from hotlever.text import NOT_DETERMINED, aligned, significant, value_with_error

NUMBERS = st.floats(-14, 22).map(lambda power: 10.0**power)
BOUND = re.compile(r"(below|above) |.+ to |not determined$")


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.6862, 0.0049, "0.686(5)"),
        (9.341, 0.15, "9.34(15)"),
        (831.3, 4.4, "831(4)"),
        (2.2e17, 1.3e17, "2.2(1.3)e17"),
        (4.62, 3.1, "4.6(3.1)"),
        (950.0, 400.0, "950(400)"),
        (-0.022, 0.013, "-0.022(13)"),
    ],
)
def test_values_carry_their_error_in_the_last_digits(value, error, text):
    assert value_with_error(value, error) == text


@pytest.mark.parametrize(
    ("value", "error", "bounds", "text"),
    [
        (0.719, 300.0, (0.2, 2.0), "not determined"),  # once 0(300)
        (2.65, 500.0, (1.0, 5.0), "not determined"),  # once 0(500)
        (1000.0, 13000.0, (0.0, math.inf), "not determined"),  # once 1000(13000)
        (1.2e17, 1.5e17, (1e14, 1e20), "below 4.1e17"),
        (1.2e17, math.inf, (1e14, 1e20), "not determined"),
        (12.0, 13.0, (0.0, math.inf), "below 37"),
        (0.1, 0.5, (-1.5, 1.5), "-0.88 to 1.1"),
        (-0.2, 0.5, (-1.5, 0.5), "above -1.2"),
    ],
)
def test_an_error_larger_than_the_value_leaves_a_bound_or_nothing(value, error, bounds, text):
    assert value_with_error(value, error, bounds=bounds) == text


@given(NUMBERS, st.floats(-9, 3), st.sampled_from([1.0, -1.0]))
def test_every_value_with_an_error_can_be_read(size, decades, sign):
    """Two digits of the value are there, and it is read back as near as the last digit printed."""
    value, error = sign * size, size * 10.0**decades
    text = value_with_error(value, error)
    if error >= size:
        assert BOUND.match(text)
        return
    read = re.fullmatch(r"(-?[\d.]+)\(([\d.]+)\)(e-?\d+)?", text)
    assert read is not None, text
    mantissa, last, power = read[1], read[2], read[3] or ""
    assert len(re.sub(r"[-.]", "", mantissa).lstrip("0")) >= 2
    decimals = len(mantissa.partition(".")[2])
    unit = float(f"1e-{decimals}") * float(f"1{power}")
    assert abs(float(mantissa + power) - value) <= 0.5 * unit * (1 + 1e-6)
    stated = float(last + power) if "." in last or not decimals else float(last) * unit
    assert stated == pytest.approx(error, rel=0.26, abs=0.5 * unit * (1 + 1e-6))
    assert float(last) > 0


@given(NUMBERS, st.floats(0, 4), st.floats(0.01, 4))
def test_a_bound_is_one_that_the_quantity_can_have(size, decades, above):
    most = size * 10.0**above
    text = value_with_error(size, size * 10.0**decades, bounds=(0.5 * size, most))
    if text == NOT_DETERMINED:
        assert size * (1 + 1.96 * 10.0**decades) > most * 0.999
    else:
        assert size < float(text.removeprefix("below ")) < most * 1.06


@given(NUMBERS)
def test_two_digits_count(size):
    assert float(significant(size)) == pytest.approx(size, rel=0.051)
    assert float(significant(-size)) == -float(significant(size))


def test_cells_stand_below_each_other():
    assert aligned([["a", "10"], ["bb", "2"]]) == ["a   10", "bb  2"]
    assert aligned([["a", "10"], ["bb", "2"]], right=True) == [" a  10", "bb   2"]


def test_of_many_names_the_nearest_are_named():
    names = [f"length_{index}_um" for index in range(49)] + ["n_d"]
    far = str(unknown_name("name", "kind", names))
    assert "did you mean" not in far
    assert "and 45 more" in far
    near = str(unknown_name("name", "nd", names))
    assert "did you mean 'n_d'? (expected one of: n_d, " in near
