"""Small signals: against a direct solution, at rest, and against a history."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.lever.transient import simulate, sine
from hotlever.lever.transient.frequency_domain import SPECTRUM_COLUMNS, spectrum


def impedance(data):
    return data.impedance_real_ohm.values + 1j * data.impedance_imag_ohm.values


def test_all_frequencies_are_those_of_a_direct_solution(coarse):
    (state,) = coarse.solve([10.7])
    frequency = np.array([1.0, 3e3, 1e5, 1e7])
    data = spectrum(state, frequency)
    equations, unit = coarse.equations, np.eye(len(state.x))
    many = np.repeat(state.x, len(unit), axis=1)
    rest, moving = equations.balance_change(many, unit), equations.storage_change(many, unit)
    rest[-1] = unit[-1]
    current = equations.observed_gradient(state.x)[:, 0, 1]
    for place, omega in enumerate(2e-6 * np.pi * frequency):
        answer = np.linalg.solve(1j * omega * moving + rest, unit[:, -1])
        assert impedance(data)[place] == pytest.approx(1000.0 / (current @ answer), rel=1e-6)
        power = state.current_mA + state.lever_V * (current @ answer)
        tip = coarse.space.tip_rise(answer) / power
        assert data.tip_per_power_K_per_mW.values[place] == pytest.approx(abs(tip), rel=1e-6)


def test_a_history_under_a_weak_sine_answers_alike(coarse):
    (state,) = coarse.solve([4.0])
    frequency, amplitude = 10e3, 0.02
    data = spectrum(state, [frequency])
    times = np.linspace(400.0, 500.0, 41)[1:]  # the fifth period
    history = simulate(coarse, sine(4.0, amplitude, frequency), at=times, tolerance_K=1e-3)
    turning = np.exp(-2e-6j * np.pi * frequency * times)
    found = 2j * np.mean((history.tip_K.values - state.tip_K) * turning) / amplitude
    assert abs(found) == pytest.approx(data.tip_per_bias_K_per_V.item(), rel=2e-3)
    assert np.degrees(np.angle(found)) == pytest.approx(data.tip_per_bias_deg.item(), abs=0.2)


def test_what_has_no_answer_is_refused(coarse):
    cold, warm = coarse.solve([0.0, 1.0])
    with pytest.raises(InputError, match="found no current"):
        spectrum(cold, [1.0])
    for wrong in ([], [0.0], [1e12], [np.nan]):
        with pytest.raises(InputError, match="expected frequencies"):
            spectrum(warm, wrong)


def test_the_command_writes_table_and_figure(run, tmp_path):
    status, out, _ = run("spectrum", "--bias", "8", "--frequency", "1Hz:10MHz:8", "--plot", "a.png")
    assert status == 0
    found = list(csv.DictReader(io.StringIO(out)))
    assert tuple(found[0]) == SPECTRUM_COLUMNS
    assert [float(row["frequency_Hz"]) for row in found] == pytest.approx(np.logspace(0, 7, 8))
    assert (tmp_path / "a.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ((), "Missing option '--bias'"),
        (("--bias", "x"), "--bias: found 'x'"),
        (("--bias", "-1"), "found a bias of -1 V"),
        (("--bias", "0"), "found no current"),
        (("--bias", "1", "--frequency", "1:2:3"), "a unit like Hz"),
        (("--bias", "1", "--frequency", "1Hz:2Hz"), "expected START:STOP:COUNT"),
        (("--bias", "1", "--frequency", "2Hz:1Hz:3"), "expected START < STOP"),
        (("--bias", "1", "--frequency", "1Hz:2Hz:0"), "expected a whole number"),
        (("--bias", "1", "--frequency", "1Hz:2THz:5"), "expected frequencies from"),
    ],
)
def test_bad_input_gets_one_line_and_status_two(refused, words, found, tmp_path):
    assert found in refused("spectrum", *words)
    assert list(tmp_path.iterdir()) == []
