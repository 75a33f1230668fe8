"""Files of Keithley, LabVIEW and the B1500; `instrument_files` says what they are made from."""

from __future__ import annotations

from collections.abc import Iterator

from instruments import (
    AMPS,
    BIAS,
    COUNT,
    CURRENT,
    LEVER,
    READER,
    SECONDS,
    TIP,
    InstrumentFile,
    instrument_file,
    rows,
    same_text,
)


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
