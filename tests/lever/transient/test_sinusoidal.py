"""Harmonics of a lever: small ones as small signals, large ones as followed in time."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import ComputationError, InputError
from hotlever.lever.transient import sine, spectrum
from hotlever.lever.transient.frequency_domain import HARMONIC_COLUMNS, harmonics
from hotlever.lever.transient.trains import cyclic_steady_state

pytestmark = pytest.mark.usefixtures("coarse_meshes")


def test_a_weak_first_harmonic_is_the_small_signal(coarse):
    found = harmonics(coarse, 4.0, 1e-3, [1e2, 2e4, 1e6])
    (state,) = coarse.solve([4.0])
    small = spectrum(state, found.frequency)
    impedance = (small.impedance_real_ohm + 1j * small.impedance_imag_ohm).values / 1000.0
    expected = 1e-3 * impedance / (impedance + coarse.circuit.series_kohm)
    answer = found.first_harmonic_V * np.exp(1j * np.radians(found.first_harmonic_deg))
    np.testing.assert_allclose(answer, expected, rtol=1e-3)


def test_they_grow_as_powers_of_a_weak_drive(coarse):
    once, twice = (harmonics(coarse, 3.0, amplitude, [2e4]) for amplitude in (0.02, 0.04))
    for power, name in enumerate(("first", "second", "third"), start=1):
        ratio = float((twice / once)[f"{name}_harmonic_V"][0])
        assert ratio == pytest.approx(2.0**power, rel=2e-3)


@pytest.mark.slow
def test_a_strong_drive_is_as_followed_in_time(coarse):
    period, count = 10.0, 32
    found = harmonics(coarse, 3.0, 2.0, [1e6 / period])
    times = period * np.arange(1, count + 1) / count
    history, _ = cyclic_steady_state(
        coarse, sine(3.0, 2.0, 1e6 / period), period, tolerance_K=1e-3, at=times
    )
    amplitudes = 2.0 * np.abs(np.fft.rfft(history.lever_V.values)) / count
    for place, name in enumerate(("first", "second", "third"), start=1):
        assert found[f"{name}_harmonic_V"].item() == pytest.approx(amplitudes[place], rel=0.02)
    assert found.mean_tip_K.item() == pytest.approx(history.tip_K.mean().item(), abs=0.1)


def test_what_has_no_harmonics_says_so(coarse):
    with pytest.raises(InputError, match="amplitude of 0 V"):
        harmonics(coarse, 3.0, 0.0, [1e3])
    with pytest.raises(InputError, match="frequencies from"):
        harmonics(coarse, 3.0, 0.1, [-1.0])
    with pytest.raises(ComputationError):
        harmonics(coarse, 5.0, 60.0, [1e3])


def test_the_command_writes_them(run, tmp_path):
    out, plot = tmp_path / "harmonics.csv", tmp_path / "harmonics.png"
    words = ["--bias", "3", "--amplitude", "0.5V", "--frequency", "100Hz:1MHz:3"]
    status, _, _ = run("spectrum", *words, "-o", str(out), "--plot", str(plot))
    assert status == 0
    assert out.read_text().splitlines()[0] == ",".join(HARMONIC_COLUMNS)
    assert plot.stat().st_size > 10_000
