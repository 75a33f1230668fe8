"""The same curve in files as laboratories have them."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.estimate import read_measurement

BIAS = np.arange(1.0, 9.0)
CURRENT = np.array([0.1434, 0.2849, 0.4233, 0.5577, 0.6874, 0.8120, 0.9306, 1.0415])  # mA
READER = np.array([60.1, 118.0, 174.9, 229.8, 281.6, 330.5, 375.2, 415.6])  # mV
TIP = np.array([298.0, 312.0, 335.0, 368.0, 411.0, 466.0, 535.0, 628.0])  # K
LEVER = BIAS - 5.6 * CURRENT

R_S, BASE = "# R_s (kOhm): 5.6\n", "# base temperature (K): 293\n"


def rows(*columns, sep=",", comma=False, number="{:.6g}", end="\n", start="", last=""):
    """Text of some columns."""
    lines = (
        start + sep.join(number.format(value) for value in row) + last
        for row in zip(*columns, strict=True)
    )
    text = end.join(lines) + end
    return text.replace(".", ",") if comma else text


LVM = (
    "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nReader_Version\t2\r\nSeparator\tTab\r\n"
    "Decimal_Separator\t{}\r\nMulti_Headings\tNo\r\nX_Columns\t{}\r\nTime_Pref\tRelative\r\n"
    "Operator\tlab\r\nDescription\tR_s = 5.6 kOhm\r\nDate\t2023/05/04\r\nTime\t16:20:11,5\r\n"
    "***End_of_Header***\t\r\n\t\r\n"
)
SEGMENT = (
    "Channels\t2\t\t\r\nSamples\t8\t8\t\r\nDate\t2023/05/04\t2023/05/04\t\r\n"
    "Time\t16:20:11,5\t16:20:11,5\t\r\nY_Unit_Label\tVolts\tAmps\t\r\nX_Dimension\tTime\tTime\t\r\n"
    "X0\t0.0E+0\t0.0E+0\t\r\nDelta_X\t1.0\t1.0\t\r\n***End_of_Header***\t\t\t\r\n"
    "X_Value\tV_b\tI_h\tComment\r\n"
)
B1500 = (
    "SetupTitle, I/V Sweep\r\nPrimitiveTest, I/V Sweep\r\n"
    "TestParameter, Channel.UnitType, SMU, SMU\r\nTestParameter, Channel.VName, Vb, Vr\r\n"
    "TestParameter, Measurement.Primary.Start, 1\r\nMetaData, TestRecord.Remarks, \r\n"
    "AnalysisSetup, Analysis.Setup.Title, I/V Sweep\r\nDimension1, 8, 8, 8\r\n"
    "Dimension2, 1, 1, 1\r\nDataName, Vb, Ih, Vr\r\n"
)
KEITHLEY = (
    '"Model","2450"\r\n"Serial Number","04412345"\r\n"Firmware Version","1.7.3b"\r\n'
    '"Start Time","05/04/2023 16:20:11"\r\n"Series resistance","5.6 kOhm"\r\n\r\n'
)
SECONDS = np.arange(8.0)
AMPS, VOLTS = CURRENT / 1000, READER / 1000


def lab(text, encoding="utf-8", columns=None):
    """Text, encoding and names of columns of a file."""
    return text, encoding, columns


#: Each holds bias and current at least.
FILES = {
    "contract": lab("V_b (V),I_h (mA)\n" + rows(BIAS, CURRENT)),
    "brackets": lab("V_b [V],I_h [mA]\n" + rows(BIAS, CURRENT)),
    "slashes": lab("V_b/V\tI_h/µA\n" + rows(BIAS, CURRENT * 1e3, sep="\t")),
    "spaced slashes": lab("V_b / V;I_h / mA\n" + rows(BIAS, CURRENT, sep=";")),
    "German slashes": lab(
        "U_b/V\tI/µA\n" + rows(BIAS, CURRENT * 1e3, sep="\t", comma=True), "cp1252"
    ),
    "braces": lab("V_b {V},I_h <mA>\n" + rows(BIAS, CURRENT)),
    "in": lab("bias in V,current in mA\n" + rows(BIAS, CURRENT)),
    "underscored units": lab("bias_V,current_mA\n" + rows(BIAS, CURRENT)),
    "spelt differently": lab("Vb (V), Ih (mA)\n" + rows(BIAS, CURRENT)),
    "femto": lab("V_b (kV),I_h (fA)\n" + rows(BIAS / 1e3, CURRENT * 1e12)),
    "words": lab("V_b (millivolts),I_h (microamps)\n" + rows(BIAS * 1e3, CURRENT * 1e3)),
    "cp1252 micro": lab("V_b (V);I_h (µA)\r\n" + rows(BIAS, CURRENT * 1e3, sep=";"), "cp1252"),
    "Greek mu": lab("V_b (V),I_h (μA)\n" + rows(BIAS, CURRENT * 1e3)),
    "micro sign": lab("V_b (V),I_h (µA)\n" + rows(BIAS, CURRENT * 1e3)),
    "DOS micro": lab("V_b (V),I_h (µA)\n" + rows(BIAS, CURRENT * 1e3), "cp437"),
    "Chinese micro": lab("V_b (V),I_h (μA)\n" + rows(BIAS, CURRENT * 1e3), "gbk"),
    "Japanese micro": lab("V_b (V),I_h (μA)\n" + rows(BIAS, CURRENT * 1e3), "shift_jis"),
    "Mac micro": lab("V_b (V),I_h (µA)\r" + rows(BIAS, CURRENT * 1e3, end="\r"), "mac_roman"),
    "read twice": lab("V_b (V),I_h (ÂµA)\n" + rows(BIAS, CURRENT * 1e3)),
    "utf-8 with mark": lab("V_b (V),I_h (mA)\n" + rows(BIAS, CURRENT), "utf-8-sig"),
    "utf-16 with mark": lab(
        "V_b (V)\tI_h (µA)\r\n" + rows(BIAS, CURRENT * 1e3, sep="\t"), "utf-16"
    ),
    "utf-16 big": lab("V_b (V)\tI_h (µA)\r\n" + rows(BIAS, CURRENT * 1e3, sep="\t"), "utf-16-be"),
    "Excel": lab(
        "V_b (V);I_h (mA);;\r\n" + rows(BIAS, CURRENT, sep=";", comma=True, last=";;", end="\r\n"),
        "cp1252",
    ),
    "Excel with empty rows": lab(
        "V_b (V);I_h (mA)\r\n" + rows(BIAS, CURRENT, sep=";", comma=True) + ";;\r\n;\r\n",
        "utf-8-sig",
    ),
    "Excel with settings": lab(
        "Lever 7;;\r\nR_s (kOhm);5,6;\r\nBase temperature (K);293;\r\n;;\r\nV_b (V);I_h (mA)\r\n"
        + rows(BIAS, CURRENT, sep=";", comma=True),
        "cp1252",
    ),
    "quoted decimal commas": lab(
        "V_b (V),I_h (mA)\n"
        + "".join(
            f'"{v:.1f}","{i:.4f}"\n'.replace(".", ",").replace('","', '","')
            for v, i in zip(BIAS, CURRENT, strict=True)
        )
    ),
    "all quoted": lab(
        '"V_b (V)","I_h (mA)"\n'
        + "".join(f'"{v}","{i}"\n' for v, i in zip(BIAS, CURRENT, strict=True))
    ),
    "trailing tabs": lab("V_b (V)\tI_h (mA)\t\n" + rows(BIAS, CURRENT, sep="\t", last="\t")),
    "blanks": lab("V_b (V)   I_h (mA)\n" + rows(BIAS, CURRENT, sep="   ", start="  ")),
    "savetxt": lab("# V_b (V) I_h (mA)\n" + rows(BIAS, CURRENT, sep=" ", number="{:.18e}")),
    "savetxt, commas in its header": lab(
        "# V_b (V), I_h (mA)\n" + rows(BIAS, CURRENT, sep=" ", number="{:.18e}")
    ),
    "comment header": lab("# lever 3\n# V_b (V),I_h (mA)\n" + rows(BIAS, CURRENT)),
    "per cent": lab("% lever 3\n% V_b (V), I_h (mA)\n" + rows(BIAS, CURRENT)),
    "units below": lab("V_b,I_h\nV,mA\n" + rows(BIAS, CURRENT)),
    "units below in brackets": lab(
        "V_b;I_h\n(V);(µA)\n" + rows(BIAS, CURRENT * 1e3, sep=";", comma=True), "cp1252"
    ),
    "units below, some": lab("n,V_b,I_h\n,V,A\n" + rows(SECONDS, BIAS, AMPS)),
    "Origin": lab(
        "V_b\tI_h\tT_stage\nV\tµA\t°C\nlever 7\tup\t\n"
        + rows(BIAS, CURRENT * 1e3, SECONDS + 20, sep="\t"),
        "cp1252",
    ),
    "Origin with short names": lab("A(X)\tB(Y)\nV_b\tI_h\nV\tmA\n" + rows(BIAS, CURRENT, sep="\t")),
    "LabVIEW": lab(
        LVM.format(".", "One") + SEGMENT + rows(SECONDS, BIAS, AMPS, sep="\t", end="\r\n"), "cp1252"
    ),
    "LabVIEW with decimal commas": lab(
        LVM.format(",", "One")
        + SEGMENT
        + rows(SECONDS, BIAS, AMPS, sep="\t", end="\r\n", number="{:.9f}", comma=True),
        "cp1252",
    ),
    "LabVIEW without x": lab(
        LVM.format(".", "No") + SEGMENT + rows(BIAS, AMPS, sep="\t", start="\t", last="\t")
    ),
    "LabVIEW, its own names": lab(
        LVM.format(".", "One")
        + SEGMENT.replace("V_b\tI_h", "Untitled\tUntitled 1")
        + rows(SECONDS, BIAS, AMPS, sep="\t"),
        columns={"V_b": "Untitled", "I_h": "Untitled 1"},
    ),
    "LabVIEW in two segments": lab(
        LVM.format(".", "One")
        + SEGMENT
        + rows(SECONDS[:4], BIAS[:4], AMPS[:4], sep="\t")
        + "\n\n"
        + SEGMENT
        + rows(SECONDS[4:], BIAS[4:], AMPS[4:], sep="\t")
    ),
    "plain LabVIEW": lab(
        rows(BIAS, AMPS, sep="\t", comma=True, number="{:.9f}"),
        columns={"V_b (V)": "1", "I_h (A)": "2"},
    ),
    "B1500": lab(B1500 + rows(BIAS, AMPS, VOLTS, sep=", ", start="DataValue, ", end="\r\n")),
    "B1500, other names": lab(
        B1500.replace("DataName, Vb, Ih, Vr", "DataName, V1, I1, V2")
        + rows(BIAS, AMPS, VOLTS, sep=", ", start="DataValue, "),
        columns={"V_b": "V1", "I_h": "I1", "V_r": "V2"},
    ),
    "B1500, two records": lab(
        B1500
        + rows(BIAS[:4], AMPS[:4], VOLTS[:4], sep=", ", start="DataValue, ")
        + B1500
        + rows(BIAS[4:], AMPS[4:], VOLTS[4:], sep=", ", start="DataValue, ")
    ),
    "Keithley": lab(
        KEITHLEY
        + "Index,Source (V),Reading (A),Relative Time (s)\r\n"
        + rows(SECONDS + 1, BIAS, AMPS, SECONDS),
        columns={"V_b": "Source", "I_h": "Reading"},
    ),
    "Keithley with a missing value": lab(
        KEITHLEY
        + "V_b (V),I_h (A),V_r (V)\r\n"
        + rows(BIAS, AMPS, VOLTS).replace("0.0601", "+9.910000E+37")
    ),
    "Keithley 4200": lab(
        "AI,AV\n" + rows(AMPS, BIAS, number="{:.6E}"), columns={"V_b (V)": "AV", "I_h (A)": "AI"}
    ),
    "told by number": lab(
        "V,V,I\n" + rows(BIAS, LEVER, CURRENT), columns={"V_b (V)": "1", "I_h (mA)": "3"}
    ),
    "told with units": lab(
        "Voltage (V);Current (µA)\n" + rows(BIAS, CURRENT * 1e3, sep=";"),
        columns={"V_b": "Voltage", "I_h": "current (µA)"},
    ),
    "a channel in brackets": lab(
        "Volt (CH1),Curr (CH2)\n" + rows(BIAS, CURRENT),
        columns={"V_b (V)": "Volt (CH1)", "I_h (mA)": "Curr (CH2)"},
    ),
    "lever voltage": lab(R_S + "V_l (V),I_h (mA)\n" + rows(LEVER, CURRENT)),
    "current driven": lab(
        R_S + "I_h (uA),V_l (mV)\n" + rows(CURRENT * 1e3, LEVER * 1e3, number="{:.8g}")
    ),
    "both voltages": lab("V_b (V),V_l (V),I_h (mA)\n" + rows(BIAS, LEVER, CURRENT)),
    "own sweep": lab(
        "bias_V,current_mA,lever_V,reader_V,tip_K,power_mW,heater_ohm,legs_ohm\n"
        + rows(BIAS, CURRENT, LEVER, VOLTS, TIP, BIAS, BIAS, BIAS)
    ),
    "negative": lab("V_b (V),I_h (mA)\n" + rows(-BIAS, -CURRENT)),
    "celsius": lab("V_b (V),I_h (mA),T_tip (°C)\n" + rows(BIAS, CURRENT, TIP - 273.15), "cp1252"),
    "no-break blanks": lab("V_b\u00a0(V);I_h\u00a0(mA)\n" + rows(BIAS, CURRENT, sep=";"), "cp1252"),
}


def write(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "data.csv"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize("name", FILES)
def test_the_same_curve_from_every_file(tmp_path, name):
    text, encoding, columns = FILES[name]
    data = read_measurement(write(tmp_path, text, encoding), columns)
    np.testing.assert_allclose(data.bias_V, BIAS, rtol=1e-5)
    np.testing.assert_allclose(data.current_mA, CURRENT, rtol=1e-5)
    for found, known in ((data.reader_V, VOLTS), (data.tip_K, TIP)):
        there = np.isfinite(found)
        np.testing.assert_allclose(found[there], known[there], rtol=1e-5)
    assert data.series_resistance_ohm in (None, pytest.approx(5600, rel=1e-3))
    assert {row[0] for row in data.understood} >= {"V_b", "I_h", "R_s", "T_base", "medium"}


def test_there_are_settings_in_the_headers_of_instruments(tmp_path):
    for name in ("LabVIEW", "Keithley", "Excel with settings", "both voltages", "own sweep"):
        text, encoding, columns = FILES[name]
        data = read_measurement(write(tmp_path, text, encoding), columns)
        assert data.series_resistance_ohm == pytest.approx(5600, rel=1e-3), name
