"""The columns of a measurement file as the app shows them."""

from __future__ import annotations

from pathlib import Path

import pytest

from hotlever.errors import InputError
from hotlever.measurement import file_columns, parse_columns, read_measurement


def test_a_preview_shows_what_columns_are_used_as(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("t;V_b (V);Strom;T_tip (K)\n1;0,5;1,5;\n2;1,0;2,5;400\n3;1,5;3,5;\n")
    columns = file_columns(path)
    assert [column.symbol for column in columns] == ["", "V_b", "I_h", "T_tip"]
    assert [column.unit for column in columns] == ["", "V", "", "K"]
    assert columns[2].cells == ("1,5", "2,5", "3,5")
    columns = file_columns(path, {"I_h (mA)": "Strom"})
    assert [column.symbol for column in columns] == ["", "V_b", "I_h", "T_tip"]
    assert read_measurement(path, {"I_h (mA)": "Strom"}).unused == (
        f"{path}: column 't' is not used",
    )


def test_a_column_that_is_recognised_may_be_left_out(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("V_b (V),I_h (mA),V_r (V),T_tip (K)\n1,0.5,7,400\n2,0.9,8,500\n")
    assigned = parse_columns(["unused=V_r (V)", "unused=4"])
    measured = read_measurement(path, assigned)
    assert measured.observables == ("current",)
    assert "'V_r (V)', 'T_tip (K)' are not used" in measured.unused[0]
    assert [column.symbol for column in file_columns(path, assigned)] == ["V_b", "I_h", "", ""]
    with pytest.raises(InputError, match=r"no column 'V_x'.*|V_x"):
        read_measurement(path, parse_columns(["unused=V_x"]))
