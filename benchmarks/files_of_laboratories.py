"""Files of lock-ins, oscilloscopes, loggers and programs; `instrument_files` says from what."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from instruments import (
    AFTER,
    AMPS,
    ANSWER,
    BIAS,
    COUNT,
    LEVER,
    PULSE,
    READER,
    SECONDS,
    TIME,
    InstrumentFile,
    instrument_file,
    rows,
    same_text,
)


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
