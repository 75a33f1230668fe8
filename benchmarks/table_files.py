"""Tables of measurements as instruments, spreadsheets and people write them, and how they are read.

    python benchmarks/table_files.py [instruments|odd]

instruments  Ten files in each of eight styles: what is read as it is, what is asked, what is wrong.
             A question is one error that names ``--column``; its answer must be enough.
odd          Cells that say "no value" in the words of many makers, in the first, a middle or the
             last row; minus signs that are dashes; marks of thousands; rows that are too short or
             too long, or of numbers written in another way; lines of totals; encodings; groups of
             TDMS files. Each is written here from a curve, so that its rows are known; some can
             only be refused: its rows are right, it is refused with one line, or it is wrong
             without a word.

The styles are made from what the makers, or programs that read their files, say of them:

- Keithley: columns of a saved buffer in Model 2450 Reference Manual 2450-901-01 Rev. B, page 3-20;
  units as a 2700 writes them in its User's Manual, page 14-3; text of the package keithley2600
  (OE-FET, ``result_table.py``); settings above the table as in KickStart's exports.
- LabVIEW: tables of its express VIs with a German desktop: decimal commas, tabs or semicolons.
- lvm: the headers of LabVIEW measurement files as the packages lvm_read and lvmio describe them.
- B1500: ``TestParameter``, ``DataName`` and ``DataValue`` of EasyEXPERT, and its text with one
  line for each setting, as programs that read them describe both.
- Zurich Instruments: ``chunk;timestamp;value`` and the lines of fields of LabOne's sweeper
  (zhinst-utils, ``load_labone_csv``, and programs that read MFLI files), columns of ziControl.
- oscilloscopes: Tektronix MDO, TBS and TDS, Keysight (``x-axis``, units below), LeCroy 9300C
  Operator's Manual, page E-11.
- Rohde & Schwarz: RTC1000 User Manual 1335.7352.02, page 101; RTM20xx 1317.4726.02, page 228; log
  files of the HMC8012, User Manual, section 6.3.1.
- QCoDeS and Labber: three lines of comment of QCoDeS's ``GNUPlotFormat``; text of pandas.
"""

from __future__ import annotations

import io
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hotlever import InputError, read_measurement
from hotlever.lever.transient.waveform import step
from hotlever.probe import Circuit

BIAS = np.linspace(0.4, 10.0, 25)  # V
LEVER_KOHM = 2.0 + 3.0 * (BIAS / 10.0) ** 2
CURRENT = BIAS / (5.6 + LEVER_KOHM)  # mA
LEVER = LEVER_KOHM * CURRENT  # V
READER = 0.42 * LEVER  # V
TIP = 293.0 + 60.0 * LEVER * CURRENT  # K
AMPS, SECONDS, COUNT = CURRENT / 1e3, np.arange(25.0), np.arange(1.0, 26.0)

#: A pulse of 5 V, and the lever's voltage on its way.
TIME = np.arange(-4.0, 20.5, 0.5)  # µs
PULSE = np.where(TIME > 0.0, 5.0, 0.0)
ANSWER = np.where(TIME > 0.0, 2.0 - 0.5 * np.exp(-np.abs(TIME) / 4.0), 0.0)
AFTER = TIME > 0.0


class InstrumentFile(NamedTuple):
    """A file, the columns to tell where they are asked for, and what it holds."""

    style: str
    name: str
    text: str
    columns: dict[str, str]  #: that a question is answered with
    in_time: bool = False
    driven: bool = False  #: by a step that is told beside the file, which has only the answer
    encoding: str = "utf-8"


def rows(*columns, sep=",", comma=False, form="{:.7g}", start="", last="", end="\n"):
    """Text of columns of numbers or of words."""
    lines = []
    for row in zip(*columns, strict=True):
        cells = [cell if isinstance(cell, str) else form.format(cell) for cell in row]
        cells = [cell.replace(".", ",") if comma else cell for cell in cells]
        lines.append(start + sep.join(cells) + last)
    return end.join(lines) + end


def same_text(text: str) -> list[str]:
    """A column of one text."""
    return [text] * 25


def instrument_file(style, name, text, columns=None, in_time=False, driven=False, encoding="utf-8"):
    """Return a file; read as it is unless it has columns to tell."""
    return InstrumentFile(style, name, text, columns or {}, in_time, driven, encoding)


# --- Keithley, LabVIEW and the B1500 -------------------------------------------------------------


def keithley() -> Iterator[InstrumentFile]:
    """Buffers of the 2450 family, text of a 2600, exports of KickStart."""
    head = (
        "Index,Reading,Unit,Range Digits,Disp Digits,Math,Start Group,Limit1 High,Limit1 Low,"
        "Limit2 High,Limit2 Low,Terminal,Questionable,Origin,Value,Unit,Digits,Output,Sense,"
        "Source Limit,Overtemp,Date,Time,Fractional Seconds\n"
    )
    flags = [
        same_text(cell)
        for cell in [".01", "6.5", "F", "F", "F", "F", "F", "F", "Front", "F", "Main"]
    ]
    after = [
        same_text(cell)
        for cell in ["6.5", "T", "2W", "F", "F", "05/04/2023", "16:20:11", "0.123456"]
    ]

    def buffer(reading, unit, value, of, header=head, preamble="", **options):
        written = [f"{number:.6E}" for number in reading], [f"{number:.6E}" for number in value]
        index = [f"{number:.0f}" for number in COUNT]
        columns = index, written[0], same_text(unit), *flags, written[1], same_text(of), *after
        return preamble + header + rows(*columns, **options)

    preamble = (
        "Model,2450\nSerial Number,04412345\nFirmware,1.7.3b\nBuffer,defbuffer1\n"
        "Start Time,05/04/2023 16:20:11\nR_s (kOhm),5.6\n\n"
    )
    yield instrument_file("Keithley", "defbuffer", buffer(AMPS, "A", BIAS, "V"))
    yield instrument_file(
        "Keithley", "2460, units in words", buffer(AMPS, "Amp DC", BIAS, "Volt DC")
    )
    source = head.replace("Value,Unit,Digits", "Source Value,Source Unit,Source Digits")
    yield instrument_file(
        *("Keithley", "preamble, the source by name"),
        buffer(AMPS, "AMP DC", BIAS, "VOLT DC", source, preamble),
    )
    yield instrument_file("Keithley", "current sourced", buffer(BIAS, "V", AMPS, "A"))
    yield instrument_file(
        "Keithley",
        "Windows in Germany",
        buffer(AMPS, "A", BIAS, "V", head.replace(",", ";"), sep=";", comma=True),
    )
    yield instrument_file(
        "Keithley",
        "KickStart",
        '"Model","2450"\r\n"Serial Number","04412345"\r\n"Project","lever 7"\r\n\r\n'
        "Index,Source (V),Reading (A),Relative Time (s)\r\n"
        + rows(COUNT, BIAS, AMPS, SECONDS, end="\r\n"),
    )
    yield instrument_file(
        "Keithley",
        "KickStart, two channels",
        "Index,SMU-1 Voltage (V),SMU-1 Current (A),SMU-2 Voltage (V)\n"
        + rows(COUNT, BIAS, AMPS, READER),
        {"V_b": "SMU-1 Voltage", "I_h": "SMU-1 Current", "V_r": "SMU-2 Voltage"},
    )
    yield instrument_file(
        "Keithley",
        "keithley2600",
        "# recorded: Thu May  4 16:20:11 2023\n# sweep_type: iv\n# Voltage [V]\tCurrent [A]\n"
        + rows(BIAS, AMPS, sep="\t", form="{:.18e}"),
    )
    yield instrument_file(
        "Keithley",
        "2600, printed buffers",
        rows(BIAS, AMPS, sep="\t", form="{:.5e}"),
        {"V_b (V)": "1", "I_h (A)": "2"},
    )
    yield instrument_file(
        "Keithley",
        "2281S",
        "Index,Current,Unit,Voltage,Unit,Math,Output,Date,Time,Fractional\n"
        + rows(
            COUNT,
            AMPS,
            same_text("A"),
            BIAS,
            same_text("V"),
            *map(same_text, ("F", "CV", "03/01/2019", "16:17:21", ".1923")),
        ),
    )


def labview() -> Iterator[InstrumentFile]:
    """Tables with German headings."""

    def table(name, header, *columns, sep="\t", encoding="cp1252", top="", answer=None):
        text = top + header.replace("|", sep) + "\r\n"
        text += rows(*columns, sep=sep, comma=True, form="{:.9f}", end="\r\n")
        return instrument_file("LabVIEW", name, text, answer or {}, encoding=encoding)

    yield table("tabs", "Zeit (s)|Spannung (V)|Strom (mA)", SECONDS, BIAS, CURRENT)
    yield table("semicolons", "Spannung [V]|Heizstrom [µA]", BIAS, CURRENT * 1e3, sep=";")
    yield table("slashes", "Zeit/s|U/V|I/mA", SECONDS, BIAS, CURRENT)
    yield table(
        "temperature", "Spannung (V)|Strom (A)|Temperatur (°C)", BIAS, AMPS, TIP - 273.15, sep=";"
    )
    yield table("units below", "Spannung|Strom\r\nV|mA", BIAS, CURRENT)
    yield table(
        "all named",
        "Vorspannung (V)|Heizstrom (mA)|Spitzentemperatur (°C)|Zeit (s)",
        *(BIAS, CURRENT, TIP - 273.15, SECONDS),
    )
    yield table(
        "settings",
        "Versorgungsspannung in V|Heizstrom in mA",
        *(BIAS, CURRENT),
        top="Probe: Hebel 7\r\nVorwiderstand: 5,6 kOhm\r\nDatum: 04.05.2023\r\n\r\n",
        encoding="utf-8-sig",
    )
    yield table("over the lever", "Hebelspannung (V)|Heizstrom (mA)", LEVER, CURRENT)
    yield table(
        "two voltages",
        "Spannung 1 (V)|Spannung 2 (mV)|Strom (mA)",
        *(BIAS, READER * 1e3, CURRENT),
        answer={"V_b": "Spannung 1", "V_r": "Spannung 2"},
    )
    yield table(
        "two currents",
        "Spannung (V)|Strom (mA)|Heizstrom (mA)",
        *(BIAS, CURRENT * 1.5, CURRENT),
        answer={"I_h": "Heizstrom"},
    )


def lvm() -> Iterator[InstrumentFile]:
    """LabVIEW measurement files."""
    top = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\t{sep}\n"
        "Decimal_Separator\t{sign}\nMulti_Headings\t{multi}\nX_Columns\t{x}\nTime_Pref\tRelative\n"
        "Operator\tlab\nDate\t2023/05/04\nTime\t16:20:11{sign}1711249351501464844\n"
        "***End_of_Header***\t\n\t\n"
    )
    part = (
        "Channels\t{n}\nSamples{samples}\nDate{date}\nTime{time}\nY_Unit_Label{units}\n"
        "X_Dimension{dimension}\nX0{x0}\nDelta_X{delta}\n***End_of_Header***\n{head}\n"
    )

    def file(
        name, names, units, *columns, x="One", sign=".", sep="\t", answer=None, cut=(), **top_
    ):
        count, comma = len(names), sign == ","
        cells = {"samples": "25", "date": "2023/05/04", "time": f"16:20:11{sign}5", "x0": "0.0E+0"}
        cells |= {"dimension": "Time", "delta": "1.000000"}
        filled = {key: f"\t{cell}" * count for key, cell in cells.items()}
        head = "X_Value\t" + "\t".join(names) + "\tComment"
        if x == "Multi":
            head = "\t".join(f"X_Value\t{name}" for name in names) + "\tComment"
            columns = tuple(each for column in columns for each in (SECONDS, column))
        elif x == "One":
            columns = (SECONDS, *columns)
        written = {key: "".join(f"\t{u}" for u in units) for key in ("units",)}
        segment = part.format(n=count, head=head, **filled, **written)
        text = top.format(sep={"\t": "Tab", ",": "Comma"}[sep], sign=sign, x=x, multi="No")
        for start, stop in zip([0, *cut], [*cut, 25], strict=True):
            start_ = "\t" if x == "No" else ""
            text += segment
            some = [column[start:stop] for column in columns]
            text += rows(*some, sep="\t", comma=comma, form="{:.9f}", start=start_)
            text += "\n" * bool(cut)
        return instrument_file(
            "lvm", name, text.replace("\t", sep), answer or {}, encoding="cp1252"
        )

    names, units, both = ("Bias Voltage", "Heater Current"), ("Volts", "Amps"), (BIAS, AMPS)
    german = ("Spannung", "Strom")
    yield file("points", names, units, *both)
    yield file("decimal commas", names, units, *both, sign=",")
    yield file("commas between cells", names, units, *both, sep=",")
    yield file("no times", names, units, *both, x="No")
    yield file("times for each", names, units, *both, x="Multi")
    yield file("two segments", names, units, *both, cut=(12,))
    yield file("German names", german, ("V", "mA"), BIAS, CURRENT, sign=",")
    yield file("plain names", ("Voltage", "Current"), units, *both)
    yield file(
        "untitled",
        ("Untitled", "Untitled 1"),
        units,
        *both,
        answer={"V_b": "Untitled", "I_h": "Untitled 1"},
    )
    yield file(
        "three voltages",
        ("Voltage_0", "Voltage_1", "Current"),
        ("Volts", "Volts", "Amps"),
        BIAS,
        READER,
        AMPS,
        answer={"V_b": "Voltage_0", "V_r": "Voltage_1"},
    )


def b1500() -> Iterator[InstrumentFile]:
    """EasyEXPERT's text."""
    top = (
        "SetupTitle, I/V Sweep\nPrimitiveTest, I/V Sweep\n"
        "TestParameter, Context.MainFrame, B1500A\n"
        "TestParameter, Channel.UnitType, SMU, SMU\nTestParameter, Channel.Unit, SMU1:HR, SMU2:MP\n"
        "TestParameter, Channel.IName, {i}, I2\nTestParameter, Channel.VName, {v}, V2\n"
        "TestParameter, Channel.Mode, V, COMMON\nTestParameter, Channel.Func, VAR1, CONST\n"
        "TestParameter, Measurement.Primary.Start, 0.4\n"
        "TestParameter, Measurement.Primary.Stop, 10\n"
        "TestParameter, Measurement.Port.SeriesResistance, 0, 0\n"
        "MetaData, TestRecord.RecordTime, 05/04/2023 16:20:11\nMetaData, TestRecord.Remarks, \n"
        "AnalysisSetup, Analysis.Setup.Title, I/V Sweep\nDimension1, 25, 25\nDimension2, 1, 1\n"
    )

    def file(name, v, i, names, *columns, answer=None, end="\n", encoding="utf-8", top=top):
        text = top.format(v=v, i=i) + f"DataName, {names}\n"
        text += rows(*columns, sep=", ", start="DataValue, ")
        return instrument_file(
            "B1500", name, text.replace("\n", end), answer or {}, encoding=encoding
        )

    both = (BIAS, AMPS)
    yield file("own names", "Vb", "Ih", "Vb, Ih", *both)
    yield file("Windows", "Vbias", "Iheater", "Vbias, I", *both, end="\r\n", encoding="utf-8-sig")
    yield file("defaults", "V1", "I1", "V1, I1", *both, answer={"V_b": "V1", "I_h": "I1"})
    yield file("other order", "V1", "I1", "I1, V1", AMPS, BIAS, answer={"V_b": "V1", "I_h": "I1"})
    yield file(
        "transistor",
        "VD",
        "ID",
        "VD, ID, VG",
        BIAS,
        AMPS,
        READER,
        answer={"V_b": "VD", "I_h": "ID", "V_r": "VG"},
    )
    yield file("with time", "Vb", "Ih", "Time, Vb, Ih", SECONDS, BIAS, AMPS)
    yield file("an analysis", "Vb", "Ih", "Vb, Ih, R", BIAS, AMPS, BIAS / AMPS)
    some = top.format(v="Vb", i="Ih") + "DataName, Vb, Ih\n"
    halves = [
        rows(BIAS[part], AMPS[part], sep=", ", start="DataValue, ")
        for part in (slice(12), slice(12, None))
    ]
    yield instrument_file("B1500", "two records", some + halves[0] + some + halves[1])
    single = (
        'Setup title,lever 7\nClassic test name,"I/V Sweep"\nTest date,2023/05/04\n'
        "Test time,16:20:11\nDevice ID,D7\nCount,2\nChannel.UnitType,SMU,SMU\n"
        "Channel.Unit,SMU1:HR,SMU2:MP\nChannel.IName,{i},I2\nChannel.VName,{v},V2\n"
        "AutoAnalysis.Marker.Data.StartCondition,\n"
    )
    yield instrument_file(
        "B1500",
        "one line a setting",
        single.format(v="Vb", i="Ih") + "Vb,Ih\n" + rows(*both),
        {"V_b (V)": "Vb", "I_h (A)": "Ih"},
    )
    yield instrument_file(
        "B1500",
        "one line a setting, defaults",
        single.format(v="V1", i="I1") + "V1,I1,R\n" + rows(*both, BIAS / AMPS),
        {"V_b (V)": "V1", "I_h (A)": "I1"},
    )


# --- lock-ins, oscilloscopes, loggers and programs -----------------------------------------------


def zurich() -> Iterator[InstrumentFile]:
    """LabOne and ziControl."""

    def fields(name, columns, answer, sep=";", pad=0, chunks=1):
        lines = [sep.join(("chunk", "timestamp", "size", "fieldname"))]
        for chunk, part in enumerate(np.array_split(np.arange(25), chunks)):
            for field, values in columns.items():
                cells = [f"{value:.9g}" for value in values[part]] + ["nan"] * pad
                lines.append(
                    sep.join((str(chunk), "11257490332120", str(part.size), field, *cells))
                )
        return instrument_file("Zurich Instruments", name, "\n".join(lines) + "\n", answer)

    grid = {"grid": BIAS, "auxin0": AMPS, "auxin1": READER}
    told = {"V_b (V)": "grid", "I_h (A)": "auxin0", "V_r (V)": "auxin1"}
    yield fields("sweeper", grid, told)
    yield fields("sweeper, commas", grid, told, sep=",")
    yield fields("sweeper, not finished", grid, told, pad=5)
    yield fields("sweeper, two chunks", grid, told, chunks=2)
    yield fields(
        "sweeper, of a demodulator",
        {"grid": BIAS, "r": READER, "x": READER, "y": 0.0 * READER},
        {"V_b (V)": "grid", "V_r (V)": "r"},
    )
    stamp = np.arange(25.0) * 210e6
    columns = (COUNT * 0, stamp, BIAS, READER, COUNT * 0 + 1e3, COUNT * 0)
    head = "chunk;timestamp;auxin0;auxin1;freq;phase\n"
    yield instrument_file(
        "Zurich Instruments",
        "demodulator",
        head + rows(*columns, sep=";", form="{:.12g}"),
        {"V_b (V)": "auxin0", "V_r (V)": "auxin1"},
    )
    yield instrument_file(
        "Zurich Instruments",
        "demodulator, x and y",
        "chunk;timestamp;x;y;auxin0;auxin1\n"
        + rows(COUNT * 0, stamp, READER, 0 * READER, BIAS, AMPS, sep=";", form="{:.12g}"),
        {"V_b (V)": "auxin0", "I_h (A)": "auxin1", "V_r (V)": "x"},
    )
    yield instrument_file(
        "Zurich Instruments",
        "Windows in Germany",
        head + rows(*columns, sep=";", comma=True, form="{:.12g}"),
        {"V_b (V)": "auxin0", "V_r (V)": "auxin1"},
    )
    yield instrument_file(
        "Zurich Instruments",
        "ziControl",
        rows(SECONDS, READER, 0 * READER, COUNT, COUNT, BIAS, AMPS),
        {"V_b (V)": "6", "I_h (A)": "7", "V_r (V)": "2"},
    )
    yield instrument_file(
        "Zurich Instruments",
        "plotter",
        "timestamp;V_b (V);I_h (A)\n" + rows(stamp, BIAS, AMPS, sep=";", form="{:.12g}"),
    )


def scopes() -> Iterator[InstrumentFile]:
    """Tektronix, Keysight, LeCroy."""
    t = TIME * 1e-6
    told = {"t (s)": "TIME", "V_b (V)": "CH1", "V_l (V)": "CH2"}

    def file(name, text, answer, driven=False):
        return instrument_file("oscilloscopes", name, text, answer, in_time=True, driven=driven)

    mdo = (
        "Model,MDO3014\nFirmware Version,1.26\n\nWaveform Type,ANALOG,,\nPoint Format,Y,,\n"
        "Horizontal Units,s,,\nHorizontal Scale,4e-06,,\nHorizontal Delay,0,,\n"
        "Sample Interval,5e-07,,\nRecord Length,49,,\nGating,0.0% to 100.0%,,\n"
        "Probe Attenuation,10,10,\nVertical Units,V,V\nVertical Offset,0,0\nVertical Scale,1,1\n"
        "Vertical Position,0,0\n,,\n,,\n,,\nLabel,,\nTIME,CH1,CH2\n"
    )
    mso = (
        "Model,MSO44\nLabel,\nWaveform Type,ANALOG\nHorizontal Units,s\nSample Interval,5e-07\n"
        "Record Length,49\nZero Index,8\nVertical Units,V,V\n,\nLabels,,\nTIME,CH1,CH2\n"
    )
    tbs = (
        "Model,TBS1052C\nFirmware Version,v1\n\nPoint Format,Y\nHorizontal Units,S\n"
        "Sample Interval,5e-07\nRecord Length,49\nVertical Units,V,V\nVertical Scale,1,1\n"
        "Label,,\nTIME,CH1,CH2\n"
    )
    lecroy = (
        "LECROY9354,935412345\nSegments,1,SegmentSize,49\n"
        "Segment,Trig Time,TimeSinceFirstSegment\n#1,21 Mar 1990 9:37:08,0.0\nTime,Ampl\n"
    )
    both = rows(t, PULSE, ANSWER)
    yield file("MDO", mdo + both, told)
    yield file("MDO, marked", "".join(f"#{line}\n" for line in mdo.splitlines()) + both, told)
    yield file(
        "MSO",
        mso + both,
        told,
    )
    yield file(
        "TBS",
        tbs + both,
        told,
    )
    left = [
        "Record Length,49",
        "Sample Interval,5.000000e-07",
        "Trigger Point,8.000000000000e+00",
        "",
        "",
        "",
        "Source,CH1",
        "Vertical Units,V",
        "Vertical Scale,1.000000e+00",
        "Vertical Offset,0.000000e+00",
        "Horizontal Units,s",
        "Horizontal Scale,4.000000e-06",
        "Pt Fmt,Y",
        "Yzero,0.000000e+00",
        "Probe Atten,1.000000e+00",
        "Model Number,TDS2014B",
        "Serial Number,C061073",
        "Firmware Version,FV:v22.11",
    ]
    left += [""] * (int(AFTER.sum()) - len(left))
    text = "".join(
        f"{key or ','},,{at:+.9f},{volts:+.5f},\n"
        for key, at, volts in zip(left, t[AFTER], ANSWER[AFTER], strict=True)
    )
    yield file("TDS", text, {"t (s)": "TIME", "V_l (V)": "CH1"}, True)
    yield file(
        "Keysight",
        "x-axis,1,2\nsecond,Volt,Volt\n" + both,
        {"t (s)": "x-axis", "V_b (V)": "1", "V_l (V)": "2"},
    )
    yield file(
        "Keysight, one channel",
        "x-axis,1\nsecond,Volt\n" + rows(t[AFTER], ANSWER[AFTER]),
        {"t (s)": "x-axis", "V_l (V)": "1"},
        True,
    )
    yield file(
        "LeCroy",
        lecroy + rows(t[AFTER], ANSWER[AFTER]),
        {"t (s)": "Time", "V_l (V)": "Ampl"},
        True,
    )
    yield file(
        "Rigol",
        "X,CH1,CH2\ns,Volt,Volt\n" + both,
        {"t (s)": "X", "V_b (V)": "CH1", "V_l (V)": "CH2"},
    )
    yield file(
        "spreadsheet", rows(t[AFTER], ANSWER[AFTER], last=","), {"t (s)": "1", "V_l (V)": "2"}, True
    )


def rohde_schwarz() -> Iterator[InstrumentFile]:
    """Oscilloscopes and log files."""
    t = TIME * 1e-6

    def scope(name, header, answer, *columns, driven=False, **options):
        some = [column[AFTER if driven else slice(None)] for column in (t, *columns)]
        text = header + "\r\n" + rows(*some, form="{:.5E}", end="\r\n", **options)
        return instrument_file("Rohde & Schwarz", name, text, answer, in_time=True, driven=driven)

    told = {"V_b": "CH1", "V_l": "CH2"}
    yield scope("RTC", "in s,CH1 in V,CH2 in V", {"t (s)": "in s", **told}, PULSE, ANSWER)
    yield scope(
        "RTC, one channel", "in s,CH1 in V", {"t (s)": "in s", "V_l": "CH1"}, ANSWER, driven=True
    )
    yield scope("RTM", "[s],CH1[V],CH2[V]", {"t": "[s]", **told}, PULSE, ANSWER)
    yield scope("RTM, one channel", "[s],CH1[V]", {"t": "[s]", "V_l": "CH1"}, ANSWER, driven=True)
    yield scope(
        "RTB", "in s,C1 in V,C2 in V", {"t (s)": "in s", "V_b": "C1", "V_l": "C2"}, PULSE, ANSWER
    )
    yield scope("RTE", "", {"t (s)": "1", "V_b (V)": "2", "V_l (V)": "3"}, PULSE, ANSWER, sep=" ")
    log = (
        "Rohde&Schwarz {} -Log-File\nDate: 2016-02-08\nStart Time: 00:02:53\nStop Time: 00:03:11\n"
        "Measurement Settings:\n#ADC Rate: Fast\n#AC Filter: ------\n#Input Imp.: 10M\n"
        "Logging Settings:\n#Mode;Unlimited\n#Logging Interval[s];1.000\nActual Count: 25\n"
    )
    clock = [f"00:02:{second:02d}:974" for second in range(25)]

    def logged(name, header, answer, *columns, sep=";", quote='"', model="HMC8012"):
        text = log.format(model) + f"{quote}{header}{quote}\n".replace(";", sep)
        return instrument_file(
            "Rohde & Schwarz", name, text + rows(*columns, sep=sep, comma=sep == ";"), answer
        )

    flag = same_text(" ")
    yield logged(
        "multimeter",
        "DCV[V];DCI[A];Flag;Timestamp",
        {"V_b": "DCV", "I_h": "DCI"},
        BIAS,
        AMPS,
        flag,
        clock,
    )
    yield logged(
        "multimeter, commas",
        "DCV[V];DCI[A];Flag;Timestamp",
        {"V_b": "DCV", "I_h": "DCI"},
        BIAS,
        AMPS,
        flag,
        clock,
        sep=",",
    )
    yield logged(
        "supply",
        "Voltage[V];Current[A];Timestamp",
        {},
        BIAS,
        AMPS,
        clock,
        quote="",
        model="HMC8043",
    )
    yield logged(
        "supply, two channels",
        "U1[V];I1[A];U2[V];I2[A];Timestamp",
        {"V_b": "U1", "I_h": "I1", "V_r": "U2"},
        BIAS,
        AMPS,
        READER,
        AMPS,
        clock,
        quote="",
        model="HMC8043",
    )


def qcodes() -> Iterator[InstrumentFile]:
    """QCoDeS and Labber."""

    def file(name, text, answer=None):
        return instrument_file("QCoDeS, Labber", name, text, answer or {})

    def gnuplot(ids, labels):
        return f"# {ids}\n# {labels}\n# 25\n".replace("|", "\t")

    both = rows(BIAS, AMPS, sep="\t")
    yield file("gnuplot", gnuplot("smua_volt_set|smua_curr", '"Voltage (V)"|"Current (A)"') + both)
    yield file(
        "gnuplot, own labels",
        gnuplot("dac_ch1_set|dmm_i", '"Bias voltage (V)"|"Heater current (A)"') + both,
    )
    yield file(
        "gnuplot, three",
        gnuplot("dac_ch1_set|dmm_i|dmm_v", '"Bias (V)"|"Current (A)"|"Reader voltage (V)"')
        + rows(BIAS, AMPS, READER, sep="\t"),
    )
    yield file(
        "gnuplot, channels",
        gnuplot("dac_ch1_set|dmm_v1|dmm_v2", '"Gate ch1 (V)"|"Gate v1 (V)"|"Gate v2 (V)"')
        + rows(BIAS, LEVER, READER, sep="\t"),
        {"V_b (V)": "1", "V_l (V)": "2", "V_r (V)": "3"},
    )
    yield file("dat", both, {"V_b (V)": "1", "I_h (A)": "2"})
    yield file(
        "csv", "dac_ch1,dmm_v1\n" + rows(BIAS, AMPS), {"V_b (V)": "dac_ch1", "I_h (A)": "dmm_v1"}
    )
    yield file("csv, names with units", "bias_voltage (V),heater_current (A)\n" + rows(BIAS, AMPS))
    yield file(
        "Labber",
        "Keithley - Source voltage (V)\tKeithley - Current (A)\n" + both,
        {"V_b": "Keithley - Source voltage", "I_h": "Keithley - Current"},
    )
    yield file(
        "Labber, own names",
        "Bias (V)\tCurrent (A)\tReader voltage (V)\n" + rows(BIAS, AMPS, READER, sep="\t"),
    )
    yield file(
        "xarray",
        ",voltage,current\n" + rows(SECONDS, BIAS, AMPS),
        {"V_b (V)": "voltage", "I_h (A)": "current"},
    )


# --- how files of instruments are understood -----------------------------------------------------

STYLES = (keithley, labview, lvm, b1500, zurich, scopes, rohde_schwarz, qcodes)


def _holds(file: InstrumentFile, data) -> bool:
    """Whether what was read is what was written, as far as it was."""
    if file.in_time:
        known = ((PULSE - ANSWER) / 5.6)[AFTER if file.driven else slice(None)]
        return data.time_us is not None and np.allclose(data.current_mA, known, atol=1e-5)
    known = {"bias_V": BIAS, "current_mA": CURRENT, "reader_V": READER, "tip_K": TIP}
    read = {name: getattr(data, name) for name in known}
    there = {name: values for name, values in read.items() if np.isfinite(values).any()}
    return len(there) > 1 and all(np.allclose(v, known[n], rtol=1e-5) for n, v in there.items())


def understood(file: InstrumentFile, folder: Path) -> tuple[str, str]:
    """Return how a file is understood: 'read', 'asked', 'wrong' or 'refused'; and what is said."""
    path = folder / "data.csv"
    path.write_bytes(file.text.encode(file.encoding))
    circuit = Circuit(series_resistance_ohm=5600.0)
    waveform = step(5.0) if file.driven else None
    try:
        data = read_measurement(path, None, circuit, waveform)
        return ("read" if _holds(file, data) else "wrong"), "; ".join((*data.notes, *data.unused))
    except InputError as error:
        said = str(error)
    if "--column" not in said or not file.columns:
        return "refused", said
    try:
        data = read_measurement(path, file.columns, circuit, waveform)
    except InputError as error:
        return "refused", f"{said} -> {error}"
    return ("asked" if _holds(file, data) else "wrong"), said


def instruments() -> None:
    """Print the table."""
    total = Counter[str]()
    print(f"{'style':20}{'files':>6}{'read':>6}{'asked':>7}{'wrong':>7}{'refused':>9}")
    problems = []
    with tempfile.TemporaryDirectory() as folder:
        for style in STYLES:
            files = list(style())
            counts = Counter[str]()
            for file in files:
                how, said = understood(file, Path(folder))
                counts[how] += 1
                if how in ("wrong", "refused"):
                    problems.append(f"{file.style}, {file.name}: {how}: {said}")
            total += counts + Counter(files=len(files))
            print(
                f"{files[0].style:20}{len(files):6}{counts['read']:6}{counts['asked']:7}"
                f"{counts['wrong']:7}{counts['refused']:9}"
            )
    print(
        f"{'together':20}{total['files']:6}{total['read']:6}{total['asked']:7}"
        f"{total['wrong']:7}{total['refused']:9}"
    )
    print(*problems, sep="\n")


# --- odd tables ----------------------------------------------------------------------------------

#: Both polarities, the negative one first: half of the rows begin with a sign.
BOTH = np.concatenate((-BIAS[::-1], BIAS))
BOTH_CURRENT = np.concatenate((-CURRENT[::-1], CURRENT))
#: Columns by their numbers, for tables without headings.
NUMBERED = {"V_b (V)": "1", "I_h (mA)": "2"}
HEADER = "V_b (V),I_h (mA)\n"


class OddTable(NamedTuple):
    """A file, what to tell of its columns, and its rows; None where it can only be refused."""

    name: str
    raw: bytes
    columns: dict[str, str]
    bias: np.ndarray | None
    current: np.ndarray | None


def odd(
    name: str,
    text: str | bytes,
    columns: dict[str, str] | None = None,
    missing: Sequence[int] = (),
    encoding: str = "utf-8",
    *,
    bias: np.ndarray | None = BIAS,
    current: np.ndarray | None = CURRENT,
) -> OddTable:
    """Return a table, whose current is not known in the rows of these numbers."""
    if current is not None:
        current = current.copy()
        current[list(missing)] = np.nan
    raw = text if isinstance(text, bytes) else text.encode(encoding)
    return OddTable(name, raw, columns or {}, bias, current)


def cells(values: np.ndarray, form: str = "{:.7g}") -> list[str]:
    """Return numbers as text."""
    return [form.format(value) for value in values]


def told(values: np.ndarray, words: dict[int, str], form: str = "{:.7g}") -> list[str]:
    """Return numbers as text, with words in place of some."""
    text = cells(values, form)
    for row, word in words.items():
        text[row] = word
    return text


def respelt(values: np.ndarray, spell: Callable[[str], str], form: str = "{:.7g}") -> list[str]:
    """Return numbers as text that is written in another way."""
    return [spell(cell) for cell in cells(values, form)]


def no_values() -> Iterator[OddTable]:
    """Tables with cells that say that there is none."""
    spelt = (
        ("Keithley 2400, not a number", "+9.910000E+37", ","),
        ("Keithley 2400, overflow", "9.9E37", ","),
        ("Keithley 2600", "nan", "\t"),
        ("Keithley 6517", "OVERFLOW", "\t"),
        ("KickStart", "Overflow", ","),
        ("B1500", "199.999E+99", ","),
        ("Fluke", "OL", ";"),
        ("Gossen", "O.L", ";"),
        ("Hioki", "OVER", ";"),
        ("Yokogawa", "-OVER", ","),
        ("Graphtec, above", "+++++++", ","),
        ("Graphtec, below", "-------", ","),
        ("Graphtec, open", "BURNOUT", ","),
        ("LabVIEW", "-Inf", "\t"),
        ("PicoScope", "∞", ","),
        ("Visual C", "-1.#IND", ","),
        ("dashes", "---", " "),
        ("an em dash", "—", ","),
        ("Fortran", "*******", " "),
        ("a database", "NULL", ";"),
        ("R", "NA", ","),
        ("Python", "None", ","),
        ("Excel", "#N/A", ";"),
        ("Excel in Germany", "#ZAHL!", ";"),
    )
    for index, (maker, word, sep) in enumerate(spelt):
        comma = sep == ";"
        where = ((0,), (0, 1, 2), (12,), (24,))[index % 4]
        text = rows(BIAS, told(CURRENT, dict.fromkeys(where, word)), sep=sep)
        if comma:
            text = text.replace(".", ",").replace("O,L", "O.L")
        place = {0: "first", 12: "a middle", 24: "the last"}[where[0]]
        more = " three rows" if len(where) > 1 else " row"
        yield odd(f"{maker}, headerless, {place}{more}", text, NUMBERED, where)
        if index % 2:
            head = HEADER.replace(",", "  " if sep == " " else sep)
            yield odd(f"{maker}, with a header, {place}{more}", head + text, None, where)
    resistance = ["+9.910000E+37"] * 25
    number = {"V_b (V)": "1", "I_h (A)": "2"}
    elements = rows(BIAS, CURRENT / 1e3, resistance, SECONDS, ["+4.921E+04"] * 25, form="{:+.6E}")
    yield odd("Keithley 2400, five elements", elements, number)
    volts = told(BIAS, {0: "#DIV/0!", 5: "#N/A"})
    table = "V_r (V);V_b (V);I_h (mA)\n" + rows(volts, BIAS, CURRENT, sep=";")
    yield odd("Excel, errors in the first cell", table)
    table = rows(volts, BIAS, CURRENT, sep=";")
    yield odd("Excel, errors, headerless", table, {"V_b (V)": "2", "I_h (mA)": "3"})
    yield odd(
        "no bias in the first row",
        HEADER + rows(told(BIAS, {0: "OVERFLOW"}), told(CURRENT, {0: "---"})),
        bias=None,
    )
    first = rows(told(BIAS, {0: "ERR"}), ["F"] * 25, CURRENT)
    third = {"V_b (V)": "1", "I_h (mA)": "3"}
    yield odd("an unknown word first, and a flag", first, third, bias=None)
    blanks = rows(volts, BIAS, CURRENT, sep="  ")
    yield odd("Excel, errors and blanks", "V_r (V)  V_b (V)  I_h (mA)\n" + blanks)
    point = rows(BIAS, told(CURRENT, {24: "9@91E+37"}), sep=";", comma=True).replace("@", ".")
    yield odd("decimal commas, no value with a point", point, NUMBERED, (24,))
    clipped = told(CURRENT, {0: "COMPL"})
    yield odd("a word that nobody knows", rows(BIAS, clipped), NUMBERED, bias=None)
    yield odd(
        "such a word in a sweep", rows(BIAS, told(CURRENT, {9: "COMPL"})), NUMBERED, bias=None
    )


def signs() -> Iterator[OddTable]:
    """Tables with other minus signs, and other ways to write a negative number."""
    both = {"bias": BOTH, "current": BOTH_CURRENT}
    for name, minus in (
        ("U+2212", "−"),
        ("en dash", "–"),
        ("non-breaking hyphen", "\u2011"),
        ("full width", "－"),
    ):
        text = rows(BOTH, BOTH_CURRENT).replace("-", minus)
        yield odd(f"minus as {name}, with a header", HEADER + text, **both)
        yield odd(f"minus as {name}, headerless", text, NUMBERED, **both)
    text = rows(BOTH, BOTH_CURRENT, sep=";", comma=True).replace("-", "–")
    head = HEADER.replace(",", ";")
    yield odd("minus of Windows, German", head + text, encoding="cp1252", **both)
    text = rows(BOTH, BOTH_CURRENT, sep="\t").replace("-", "−")
    yield odd("minus in UTF-16", "V_b (V)\tI_h (mA)\n" + text, encoding="utf-16", **both)
    text = rows(BIAS, CURRENT / 1e3, form="{:.6E}").replace("E-", "E−")
    yield odd("minus in the exponent", "V_b (V),I_h (A)\n" + text)
    text = rows(BIAS, CURRENT / 1e3, form="{:.6E}").replace("E-", "E−")
    yield odd("minus in the exponent, headerless", text, {"V_b (V)": "1", "I_h (A)": "2"})
    twice = "−".encode().decode("cp1252")
    text = rows(BOTH, BOTH_CURRENT).replace("-", twice)
    yield odd("minus, UTF-8 read twice", HEADER + text, **both)

    def accounted(cell: str) -> str:
        return f"({cell[1:]})" if cell.startswith("-") else cell

    def behind(cell: str) -> str:
        return f"{cell[1:]}-" if cell.startswith("-") else cell

    for name, spell in (
        ("in parentheses", accounted),
        ("sign behind", behind),
        ("sign apart", lambda cell: cell.replace("-", "- ")),
        ("an apostrophe before", lambda cell: cell.replace("-", "'-")),
        ("as formulas", lambda cell: cell if cell[0] != "-" else f"={cell}"),
        ("dollars", lambda cell: cell.replace("-", "-$")),
        ("about", lambda cell: cell.replace("-", "~-")),
    ):
        text = rows(respelt(BOTH, spell), respelt(BOTH_CURRENT, spell))
        yield odd(f"negative {name}", HEADER + text, **both)
        yield odd(f"negative {name}, headerless", text, NUMBERED, **both)


def spellings() -> Iterator[OddTable]:
    """Tables with thousands, units in cells, and text around numbers."""
    nano = CURRENT * 1e6
    in_nano = {"V_b (V)": "1", "I_h (nA)": "2"}

    def grouped(mark: str, comma: bool = False) -> list[str]:
        text = [f"{value:,.1f}" for value in nano]
        if comma:
            return [cell.replace(",", mark).replace(".", ",") for cell in text]
        return [cell.replace(",", mark) for cell in text]

    yield odd("thousands with blanks", rows(BIAS, grouped("\u00a0", True), sep=";"), in_nano)
    yield odd("thousands with apostrophes", rows(BIAS, grouped("'"), sep=";"), in_nano)
    yield odd("thousands with narrow blanks", rows(BIAS, grouped("\u202f"), sep="\t"), in_nano)
    quoted = [f'"{cell}"' for cell in grouped(",")]
    yield odd("thousands in quotes", "V_b (V),I_h (nA)\n" + rows(BIAS, quoted))
    whole = [f"{value:,.0f}" for value in nano]
    volts = [f"{value:.0f}" for value in BIAS * 1e3]
    yield odd(
        "thousands that may be decimals",
        "V_b (mV);I_h (nA)\n" + rows(volts, whole, sep=";"),
        bias=None,
    )
    decimals = rows(BIAS, CURRENT, form="{:.3f}").replace(".", ",")
    yield odd("decimal commas between commas", decimals, NUMBERED, bias=None)
    decimals = rows(BIAS, CURRENT, sep=" ", comma=True, form="{:.6f}")
    yield odd("decimal commas between blanks", decimals, NUMBERED)
    decimals = rows(BIAS, told(CURRENT, {0: "---"}), sep="\t", comma=True)
    yield odd("decimal commas, no first value", decimals, NUMBERED, (0,))
    with_units = rows([f"{v:.2f} V" for v in BIAS], [f"{i:.6f} mA" for i in CURRENT])
    yield odd("units in cells, with a header", HEADER + with_units)
    yield odd("units in cells, headerless", with_units, NUMBERED)
    milli = rows(BIAS, [f"{i:.6f}m" for i in CURRENT])
    yield odd("prefixes in cells", "V_b (V),I_h (A)\n" + milli)
    some = rows(told(BIAS, {0: "~0.4"}), told(CURRENT, {0: "<0.1"}))
    yield odd("limits in the first row", HEADER + some, bias=None)
    yield odd("limits in the first row, headerless", some, NUMBERED, bias=None)
    formulas = rows([f'="{v:.2f}"' for v in BIAS], [f'="{i:.6f}"' for i in CURRENT])
    yield odd("formulas of text", HEADER + formulas)
    status = rows(["CV+4.0E-01", *cells(BIAS[1:])], ["CI+6.9E-02", *cells(CURRENT[1:])])
    yield odd("HP 4145, status before the first row", HEADER + status, bias=None)
    apart = rows(BIAS, [f"{10 * i:.6f} E-01" for i in CURRENT], sep=" ")
    yield odd("exponents apart", apart, NUMBERED)
    fortran = rows(BIAS, CURRENT, sep="  ", form="{:.8E}").replace("E", "D")
    yield odd("Fortran's exponents", fortran, NUMBERED)
    yield odd(
        "units twice, and other ones",
        "V_b (V),I_h (mA)\nV,A\n" + rows(BIAS, CURRENT / 1e3),
        bias=None,
    )


def shapes() -> Iterator[OddTable]:
    """Tables without a header, with dates and words, short and long rows, and lines below."""
    dates = [f"2023-05-04 16:{minute:02d}:11" for minute in range(25)]
    told_numbers = {"V_b (V)": "2", "I_h (mA)": "3"}
    dated = rows(dates, BIAS, CURRENT)
    yield odd("dates, headerless", dated, told_numbers)
    lines = dated.splitlines(keepends=True)
    lines[9] = lines[9].rpartition(",")[0] + "\n"
    yield odd("dates, headerless, a short row", "".join(lines), told_numbers, (9,))
    own = "when,SMU a,SMU b\n"
    yield odd("dates, own names, a short row", own + "".join(lines), told_numbers, (9,))
    yield odd("dates below a comment", "# when, V_b (V), I_h (mA)\n" + dated)
    yield odd(
        "dates, no first value",
        rows(dates, BIAS, told(CURRENT, {0: "OVERFLOW"})),
        told_numbers,
        (0,),
    )
    words = rows(["SMU1"] * 25, BIAS, CURRENT)
    yield odd("words first, headerless", words, told_numbers)
    count = [str(number) for number in range(1, 26)]
    buffer = rows(count, CURRENT / 1e3, ["A"] * 25, BIAS, ["V"] * 25, ["F"] * 25, ["Front"] * 25)
    yield odd("Keithley's buffer, headerless", buffer, {"V_b (V)": "4", "I_h (A)": "2"})
    points = rows(["DataValue"] * 25, BIAS, told(CURRENT / 1e3, {0: "199.999E+99"}), sep=", ")
    yield odd("B1500, lines of data alone", points, {"V_b (V)": "2", "I_h (A)": "3"}, (0,))
    plain = HEADER + rows(BIAS, CURRENT)
    yield odd("totals below", plain + "Mean,0.61\n")
    yield odd("totals below, after a blank line", plain + "\nMaximum,1.16\nMinimum,0.07\n")
    yield odd("a word below", plain + "END\n")
    yield odd("end of a DOS file", plain + "\x1a")
    lines = plain.splitlines(keepends=True)
    lines[7] = "2.8\n"
    yield odd("a short row", "".join(lines), None, (6,))
    lines[7] = "2.8,0.3,0.4\n"
    yield odd("a long row", "".join(lines), bias=None)
    yield odd(
        "two files joined, with marks",
        ("\ufeff" + plain) * 2,
        bias=np.tile(BIAS, 2),
        current=np.tile(CURRENT, 2),
    )
    yield odd("sep= of Excel", "sep=;\n" + plain.replace(",", ";"))
    yield odd(
        "a repeated header in other units",
        plain + "V_b (V),I_h (A)\n" + rows(BIAS, CURRENT / 1e3),
        bias=None,
    )
    bars = "| V_b (V) | I_h (mA) |\n|---|---|\n" + rows(
        BIAS, CURRENT, sep=" | ", start="| ", last=" |"
    )
    yield odd("Markdown", bars)
    psql = " V_b (V) | I_h (mA) \n---------+----------\n" + rows(BIAS, CURRENT, sep=" | ")
    yield odd("a database's console", psql + "(25 rows)\n")
    underlined = "V_b (V)  I_h (mA)\n-------  --------\n" + rows(BIAS, CURRENT, sep="  ")
    yield odd("underlined headings", underlined)
    page = rows(BIAS, CURRENT, sep="</td><td>", start="<tr><td>", last="</td></tr>")
    yield odd("a page that calls itself .xls", f"<table>\n{page}</table>\n", NUMBERED)
    pairs = ",\n".join(f"[{v:.2f}, {i:.6f}]" for v, i in zip(BIAS, CURRENT, strict=True))
    yield odd("JSON, a row a line", f"[\n{pairs}\n]\n", NUMBERED)
    yield odd(
        "JSON, a column a line",
        f'{{"V_b (V)": {BIAS.tolist()},\n"I_h (mA)": {CURRENT.tolist()}}}\n',
        NUMBERED,
    )
    rigol = "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-3.00e-03,5.0e-07,\n"
    rigol += rows(count, BIAS, CURRENT, last=",,,")
    yield odd("Rigol, times beside the units", rigol, {"V_b (V)": "CH1", "I_h (mA)": "3"})
    yield odd(
        "UTF-16 without a mark",
        rows(BIAS, told(CURRENT, {0: "NaN"}), sep="\t"),
        NUMBERED,
        (0,),
        "utf-16-be",
    )
    yield odd("UTF-32", plain, encoding="utf-32")
    text = rows(BIAS, told(CURRENT, {0: "OVERFLOW"}))
    yield odd("UTF-8 with a mark, headerless", text, NUMBERED, (0,), "utf-8-sig")
    yield odd("numbers above a header", rows(BIAS[:3], CURRENT[:3]) + plain, bias=None)
    yield odd("rows with errors above a header", rows(BIAS[:3], ["ERR"] * 3) + plain, bias=None)


def groups() -> Iterator[OddTable]:
    """TDMS files of one group and several."""
    import nptdms

    def tdms(*channels: tuple[str, str, str, np.ndarray, dict[str, object]]) -> bytes:
        file = io.BytesIO()
        with nptdms.TdmsWriter(file) as writer:
            writer.write_segment(
                [
                    nptdms.ChannelObject(group, name, values, {"unit_string": unit, **more})
                    for group, name, unit, values, more in channels
                ]
            )
        return file.getvalue()

    def sweep(group: str, bias: np.ndarray, current: np.ndarray, **more: object) -> list:
        return [(group, "V_b", "V", bias, more), (group, "I_h", "mA", current, more)]

    yield odd("TDMS, one group", tdms(*sweep("up", BIAS, CURRENT)))
    two = sweep("lever 1", BIAS, CURRENT), sweep("lever 2", BIAS, 1.3 * CURRENT)
    yield odd("TDMS, two groups", tdms(*two[0], *two[1]), bias=None)
    yield odd("TDMS, two groups, one told", tdms(*two[0], *two[1]), {"group": "lever 1"})
    other = [("log", "T_stage", "°C", 0.0 * BIAS + 20.0, {})]
    yield odd("TDMS, a group of something else", tdms(*two[0], *other))
    fast = {"wf_increment": 0.5, "wf_start_offset": 0.0}
    slow = {"wf_increment": 1.0, "wf_start_offset": 0.0}
    rates = tdms(("a", "V_b", "V", BIAS, fast), ("a", "I_h", "mA", CURRENT[::2], slow))
    yield odd("TDMS, channels at two rates", rates, bias=None)
    lengths = tdms(("a", "V_b", "V", BIAS, {}), ("a", "I_h", "mA", CURRENT[:20], {}))
    yield odd("TDMS, a channel that ends early", lengths, None, range(20, 25))
    overflow = CURRENT.copy()
    overflow[0] = np.inf
    yield odd("TDMS, an overflow", tdms(*sweep("up", BIAS, overflow)), None, (0,))


KINDS = (no_values, signs, spellings, shapes, groups)

RIGHT, REFUSED, WRONG = "rows right", "refused with one line", "WRONG WITHOUT A WORD"


def outcome(table: OddTable, folder: Path) -> tuple[str, str]:
    """Return how a table is read, and what is said of it."""
    path = folder / ("data.tdms" if table.raw.startswith(b"TDSm") else "data.csv")
    path.write_bytes(table.raw)
    try:
        data = read_measurement(path, table.columns)
    except InputError as error:
        return REFUSED, str(error)
    said = "; ".join((*data.notes, *data.unused))
    if table.bias is None or data.bias_V.shape != table.bias.shape:
        return WRONG, f"{data.bias_V.size} rows; {said}"
    right = np.allclose(data.bias_V, np.abs(table.bias), rtol=1e-5)
    current = np.abs(table.current)
    right = right and np.allclose(data.current_mA, current, rtol=1e-5, equal_nan=True)
    return (RIGHT if right else WRONG), said


def odd_tables() -> None:
    """Print the table."""
    total = Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for kind in KINDS:
            for table in kind():
                how, said = outcome(table, Path(folder))
                total[how] += 1
                said = "" if how == RIGHT else said.replace(f"{folder}/", "")[:150]
                print(f"{table.name:50} {how:22} {said}")
    print(
        f"\n{total.total()} tables:", *(f"{total[how]} {how}," for how in (RIGHT, REFUSED, WRONG))
    )


if __name__ == "__main__":
    for name in sys.argv[1:] or ["instruments", "odd"]:
        {"instruments": instruments, "odd": odd_tables}[name]()
