"""Numbers with their errors, and tables of text."""

from __future__ import annotations

import pytest

from hotlever.text import aligned, value_with_error


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [(0.6862, 0.0049, "0.686(5)"), (9.341, 0.15, "9.34(15)"), (831.3, 4.4, "831(4)")],
)
def test_values_carry_their_error_in_the_last_digits(value, error, text):
    assert value_with_error(value, error) == text


def test_cells_stand_below_each_other():
    assert aligned([["a", "10"], ["bb", "2"]]) == ["a   10", "bb  2"]
    assert aligned([["a", "10"], ["bb", "2"]], right=True) == [" a  10", "bb   2"]
