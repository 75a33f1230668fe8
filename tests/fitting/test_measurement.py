"""Reading measurement files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hotlever.errors import InputError
from hotlever.fitting import read_measurement

PLAIN = "V_b (V),I_h (mA),V_r (mV),T_tip (K),dT_tip (K)\n1,0.1,50,,\n2,0.2,100,300,5\n"


def read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "data.csv"
    path.write_text(text, encoding=encoding)
    return read_measurement(path)


def test_example_has_all_observables_and_its_circuit():
    from importlib.resources import as_file, files

    with as_file(files("hotlever") / "examples" / "lever-a.csv") as path:
        data = read_measurement(path)
    assert data.observables == ("current", "reader", "tip")
    assert len(data.bias_V) == 25
    assert (data.series_resistance_ohm, data.base_temperature_K) == (5600.0, 293.0)
    assert data.reader_V[0] == pytest.approx(0.06012)
    assert np.isnan(data.tip_K[0])
    assert len(data.sha256) == 64


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        "# a comment\n\nI_h [uA],V_b [mV],T_tip [degC],V_r [V],dT_tip [mK]\n"
        "100,1000,,0.05,\n200,2000,26.85,0.1,5000\n",
        "V_b (V);I_h (mA);V_r (mV);T_tip (K);dT_tip (K)\n1,0;0,1;50;;\n2,0;0,2;100;300,0;5\n",
        "V_b (V)\tI_h (µA)\tV_r (mV)\tT_tip (K)\tdT_tip (degC)\n"
        "1\t1e2\t50\t\t\n2\t200\t100\t300\t5\n",
        '"V_b (V)","I_h (A)","V_r (mV)","T_tip (K)","dT_tip (K)","time (s)"\n'
        "1,1e-4,50,nan,,0\n2,2e-4,100,300,5,1\n",
        "\ufeff" + PLAIN.replace("\n", "\r\n"),
    ],
    ids=["plain", "other units and order", "semicolons", "tabs", "extra column", "bom, crlf"],
)
def test_all_ways_to_write_the_same_data(tmp_path, text):
    data = read(tmp_path, text)
    np.testing.assert_allclose(data.bias_V, [1, 2])
    np.testing.assert_allclose(data.current_mA, [0.1, 0.2])
    np.testing.assert_allclose(data.reader_V, [0.05, 0.1])
    np.testing.assert_allclose(data.tip_K, [np.nan, 300])
    np.testing.assert_allclose(data.tip_error_K, [np.nan, 5])


@pytest.mark.parametrize(
    ("comment", "ohm", "kelvin"),
    [
        ("# R_s (kOhm): 5.6\n# base temperature (K): 295\n", 5600, 295),
        ("# R_s (Ω): 910\n# base temperature (°C) = 20\n", 910, 293.15),
        ("#R_s [ohm]: 5,6e3\n# something (else): entirely\n", 5600, None),
    ],
)
def test_comments_may_give_the_circuit(tmp_path, comment, ohm, kelvin):
    data = read(tmp_path, comment + PLAIN)
    assert data.series_resistance_ohm == pytest.approx(ohm)
    assert data.base_temperature_K == (None if kelvin is None else pytest.approx(kelvin))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"data.csv: no header row"),
        ("# only\n# comments\n", r"no header row"),
        ("V_b (V),I_h (mA)\n", r"no data rows"),
        ("a,b\n1,2\n", r"line 1: the header names 'a', 'b'; expected 'V_b \(V\)'"),
        ("V_b (V),time (s)\n1,2\n", r"at least one of 'I_h \(mA\)'"),
        ("V_b,I_h (mA)\n1,2\n", r"column 'V_b' has no unit, expected 'V_b \(V\)'"),
        ("V_b (V),V_b (V),I_h (mA)\n1,1,1\n", r"column 'V_b' stands twice"),
        ("V_b (V),I_h (mV)\n1,2\n", r"I_h \(mV\): unit 'mV' is not understood here.*like mA"),
        ("V_b (V),I_h (foo)\n1,2\n", r"unit 'foo' is not understood"),
        ("V_b (V),I_h (mA)\n1,x\n", r"line 2: I_h: found 'x', expected a number"),
        ("V_b (V),I_h (mA)\n1,2\n1,2,3\n", r"line 3: 3 cells, expected 2"),
        ("V_b (V),I_h (mA)\n,2\n", r"line 2: V_b is '', expected a bias of 0 or more"),
        ("V_b (V),I_h (mA)\n-1,2\n", r"line 2: V_b is '-1'"),
        ("V_b (V),I_h (mA)\n1,inf\n", r"found 'inf', expected a number"),
        ("V_b (V),I_h (mA)\n1,\n", r"no values in any of the columns"),
        ("# R_s (kV): 5\n" + PLAIN, r"line 1: R_s: unit 'kV' is not understood here"),
        ("# R_s (kOhm): many\n" + PLAIN, r"line 1: R_s: found 'many', expected a number"),
    ],
)
def test_errors_name_line_and_column(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_binary_and_missing_files_are_one_line(tmp_path):
    (tmp_path / "data.csv").write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file"):
        read_measurement(tmp_path / "data.csv")
    with pytest.raises(InputError, match="no such file"):
        read_measurement(tmp_path / "none.csv")


@given(st.text(max_size=200))
def test_any_text_is_read_or_refused_in_one_line(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("any") / "data.csv"
    path.write_text(text, encoding="utf-8")
    try:
        read_measurement(path)
    except InputError as error:
        message = str(error)  # either outcome is fine, a crash is not
        assert path.name in message


@pytest.mark.parametrize(
    ("comment", "medium"),
    [
        ("# medium: air, 21 °C", "air"),
        ("# Medium: Vacuum, 1e-2 mbar", "vacuum"),
        ("# medium: helium", None),
        ("# taken in air", None),
    ],
)
def test_a_comment_gives_the_medium(tmp_path, comment, medium):
    path = tmp_path / "data.csv"
    path.write_text(f"{comment}\nV_b (V),I_h (mA)\n1,0.1\n", encoding="utf-8")
    assert read_measurement(path).medium == medium
