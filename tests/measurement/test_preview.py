"""The columns of a measurement file as the app shows them."""

from __future__ import annotations

from pathlib import Path

from hotlever.measurement import file_columns


def test_a_preview_shows_what_columns_are_used_as(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("t;V_b (V);Strom;T_tip (K)\n1;0,5;1,5;\n2;1,0;2,5;400\n3;1,5;3,5;\n")
    columns, _ = file_columns(path)
    assert [column.symbol for column in columns] == ["", "V_b", "I_h", "T_tip"]
    assert [column.unit for column in columns] == ["", "V", "", "K"]
    assert columns[2].cells == ("1,5", "2,5", "3,5")
    columns, notes = file_columns(path, {"I_h (mA)": "Strom"})
    assert [column.symbol for column in columns] == ["", "V_b", "I_h", "T_tip"]
    assert notes == [f"{path}: column 't' is not used"]
