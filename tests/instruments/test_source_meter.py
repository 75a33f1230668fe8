"""A source meter and a voltmeter by SCPI, at instruments that are twins of real ones."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError, InstrumentError
from hotlever.instruments.source_meter import SourceMeter
from hotlever.instruments.twin import RampCurve, TwinBench

pytest.importorskip("pyvisa")


def resistor(kohm: float = 10.0) -> RampCurve:
    """Return what a resistor shows that melts at 12 V, of which a reader sees a quarter."""
    bias = np.linspace(0.0, 12.0, 13)
    return RampCurve(bias, bias / kohm, 0.25 * bias, 293.0 + 10.0 * bias**2)


@pytest.mark.parametrize("model", ["2450", "2400"])
def test_both_dialects_set_and_read(model):
    with TwinBench(resistor(), noise=0.0, model=model) as twin:
        meter = SourceMeter.open(twin.source, twin.reader)
        assert f"MODEL {model}" in meter.identity
        assert not twin.output_on
        meter.start(2.0)
        assert (twin.output_on, twin.bias_V, twin.limit_mA) == (True, 0.0, 2.0)
        meter.set_bias(4.0)
        assert meter.read() == pytest.approx((4.0, 0.4, 1.0, False))
        assert twin.hottest_K == pytest.approx(293.0 + 160.0)
        assert meter.turn_off()
        assert not twin.output_on
        meter.close()


@pytest.mark.parametrize("model", ["2450", "2400"])
def test_a_current_at_the_limit_is_said(model):
    with TwinBench(resistor(), noise=0.0, model=model) as twin:
        meter = SourceMeter.open(twin.source)
        meter.start(0.5)
        meter.set_bias(8.0)
        reading = meter.read()
        assert reading.at_compliance
        assert reading.current_mA == pytest.approx(0.5)
        assert np.isnan(reading.reader_V)
        meter.close()


def test_an_instrument_that_refuses_a_command_is_an_error():
    with TwinBench(resistor()) as twin:
        meter = SourceMeter.open(twin.source)
        meter.source.write(":SOUR:VOLT:NONSENSE 1")
        with pytest.raises(InstrumentError, match="reports -113"):
            meter.start(1.0)
        meter.close()


def test_another_instrument_is_refused():
    with (
        TwinBench(resistor(), model="DMM6500") as twin,
        pytest.raises(InputError, match=r"DMM6500.*Keithley 2450"),
    ):
        SourceMeter.open(twin.source)


def test_what_names_no_instrument_is_refused():
    with pytest.raises(InputError, match="no VISA resource name"):
        SourceMeter.open("COM")
    with TwinBench(resistor()) as twin:
        gone = twin.source
    with pytest.raises(InstrumentError, match=r"no .*answer"):
        SourceMeter.open(gone, timeout_s=1.0)


def test_a_lost_line_is_an_error():
    with TwinBench(resistor()) as twin:
        meter = SourceMeter.open(twin.source, timeout_s=1.0)
        meter.start(1.0)
        twin.break_lines()
        with pytest.raises(InstrumentError, match="SOCKET"):
            meter.read()
