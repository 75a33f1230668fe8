"""Wave forms: what they are between their corners, and what is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.lever.transient import pulse, ramp, read_waveform, sine, step
from hotlever.units import setting


def samples(waveform, until=100.0):
    """Ends and values of all pieces; they follow each other without a gap."""
    pieces = list(waveform.pieces(until))
    assert pieces[0].start == 0.0
    assert pieces[-1].end == until
    for one, following in pairwise(pieces):
        assert one.end == following.start
        assert following.jumps == (one.bias(one.end) != following.bias(one.end))
    return [(p.start, p.bias(p.start), p.end, p.bias(p.end)) for p in pieces]


def test_a_step_stays():
    assert samples(step(4.0)) == [(0.0, 4.0, 100.0, 4.0)]


def test_a_pulse_ends():
    assert samples(pulse(10.0, 5.0)) == [(0.0, 10.0, 5.0, 10.0), (5.0, 0.0, 100.0, 0.0)]


def test_pulses_repeat():
    waveform = pulse(10.0, 5.0, 20.0, 3)
    found = samples(waveform, 60.0)
    assert [start for start, volts, _, _ in found if volts] == [0.0, 20.0, 40.0]
    assert waveform.usual_end == 145.0
    assert samples(waveform, 22.0)[-1] == (20.0, 10.0, 22.0, 10.0)


def test_a_ramp_rises():
    assert samples(ramp(8.0, 50.0)) == [(0.0, 0.0, 50.0, 8.0), (50.0, 8.0, 100.0, 8.0)]


def test_a_sine_has_offset_amplitude_and_frequency():
    waveform = sine(3.0, 0.5, 20e3)
    (piece,) = waveform.pieces(50.0)
    assert [piece.bias(t) for t in (0.0, 12.5, 25.0, 37.5)] == pytest.approx([3.0, 3.5, 3.0, 2.5])
    assert waveform.before_V == 3.0
    assert piece.longest < 50.0 / 4


@pytest.mark.parametrize(
    "text",
    [
        "time (us),bias (V)\n0,0\n10,5\n10,2\n30,2\n",
        "t (ms);V_b (mV)\n0;0\n0,01;5000\n0,01;2000\n0,03;2000\n",
        "time_us,current_mA,bias_V\n0,1,0\n10,1,5\n10,1,2\n30,1,2\n",
        "# from a supply\nTime [s]\tV [V]\n0\t0\n1e-5\t5\n1e-5\t2\n3e-5\t2\n",
    ],
)
def test_a_file_is_straight_lines_between_its_rows(tmp_path, text):
    path = tmp_path / "wave.csv"
    path.write_text(text)
    waveform = read_waveform(path)
    expected = [(0, 0, 10, 5), (10, 2, 30, 2), (30, 2, 100, 2)]
    np.testing.assert_allclose(samples(waveform), expected, atol=1e-9)
    assert waveform.usual_end == pytest.approx(30.0)


def test_times_of_a_file_stand_as_they_are(tmp_path):
    path = tmp_path / "wave.csv"
    path.write_text("time (us),bias (V)\n5,1\n15,6\n")
    waveform = read_waveform(path)
    at = np.array([0.0, 4.0, 10.0, 20.0])
    np.testing.assert_allclose(waveform.bias(at), [1.0, 1.0, 3.5, 6.0])
    assert (waveform.before_V, waveform.usual_end) == (1.0, 15.0)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a,b\n1,2\n", "no time column"),
        ("time (us),x\n1,2\n", "no bias column"),
        ("time (us),bias (V),V (V)\n0,1,2\n", "2 bias columns"),
        ("time (V),bias (V)\n1,2\n", "unit"),
        ("time,bias (V)\n1,2\n", "unit"),
        ("time (us),bias (V)\n0,1\n2,1\n1,1\n", "line 4: expected a time not before"),
        ("time (us),bias (V)\n-5,1\n2,1\n", "line 2: expected a time from 0 on"),
        ("time (us),bias (V)\n0,1\n1,\n", "line 3"),
        ("time (us),bias (V)\n0,1\n1,1e9\n", "line 3"),
        ("time (us),bias (V)\n0,1\n1e30,1\n", "lasts"),
        ("time (us),bias (V)\n", "no data rows"),
        ("", "no header row"),
    ],
)
def test_a_file_that_is_none_is_refused_with_its_line(tmp_path, text, found):
    path = tmp_path / "wave.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=found):
        read_waveform(path)


@pytest.mark.parametrize(
    "make",
    [
        lambda: step(np.nan),
        lambda: step(1e6),
        lambda: pulse(1.0, 0.0),
        lambda: pulse(1.0, 5.0, 5.0, 2),
        lambda: pulse(1.0, 5.0, None, 2),
        lambda: pulse(1.0, 5.0, 10.0, 0),
        lambda: ramp(1.0, -1.0),
        lambda: sine(0.0, 1.0, 0.0),
        lambda: sine(0.0, np.inf, 1.0),
    ],
)
def test_impossible_wave_forms_are_refused(make):
    with pytest.raises(InputError, match="expected"):
        make()


@pytest.mark.parametrize(
    ("text", "inside", "value"),
    [
        ("5us", "us", 5.0),
        ("5 µs", "us", 5.0),
        ("0.1ms", "us", 100.0),
        ("250ns", "us", 0.25),
        ("2s", "us", 2e6),
        ("10V", "V", 10.0),
        ("500 mV", "V", 0.5),
        ("1.5MHz", "Hz", 1.5e6),
    ],
)
def test_settings_have_units(text, inside, value):
    assert setting(text, inside, "here") == value


@pytest.mark.parametrize("text", ["5", "5V", "us", "", "5 us us", "5e400us", "5µ"])
def test_a_time_without_its_unit_is_refused(text):
    with pytest.raises(InputError, match="here: found"):
        setting(text, "us", "here")
