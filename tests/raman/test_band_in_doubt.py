"""A line alone, or beside a band: noise alone must not decide between two answers."""

from __future__ import annotations

import numpy as np
import pytest

import synthetic_spectra as synthetic
from hotlever.raman import (
    PeakOptions,
    calibrate_from,
    fit_peak,
    measure,
    read_raman_calibration,
    read_spectra,
)
from hotlever.raman.series import band_evidence
from hotlever.raman.spectrum import Spectrum
from synthetic_spectra import Instrument, spectra_of_one_line


@pytest.mark.parametrize("case", synthetic.CASES, ids=lambda case: case.name)
def test_no_odd_spectrum_is_wrong_without_a_word(case, tmp_path):
    answer = synthetic.judge(case, tmp_path)
    assert answer.verdict != synthetic.WRONG, answer


def test_a_strong_line_on_a_coarse_axis_is_found_wherever_its_pixels_lie():
    """A band that shares the line's area makes its area uncertain, not the line."""
    spectra, centre = spectra_of_one_line(30, band=350.0)
    for spectrum in spectra:
        peak = fit_peak(spectrum.x, spectrum.y)
        assert abs(peak.centre - centre) < 4.0 * peak.centre_stderr < 1.5


@pytest.mark.parametrize("band", [0.0, 45.0, 260.0])
def test_errors_are_honest_on_a_coarse_axis_with_and_without_a_band(band):
    spectra, centre = spectra_of_one_line(50, band=band, seed=5)
    peaks = [fit_peak(spectrum.x, spectrum.y) for spectrum in spectra]
    pulls = np.array([(peak.centre - centre) / peak.centre_stderr for peak in peaks])
    # 50 pulls: their root mean square is known to 10 %
    assert 0.75 < np.sqrt(np.mean(pulls**2)) < 1.3
    assert np.mean(np.abs(pulls) < 2.0) > 0.87


def test_spectra_that_are_measured_together_are_fitted_alike():
    """Noise would have some of them beside a band, and others not."""
    spectra, centre = spectra_of_one_line(50, band=45.0, step=3.0, seed=3)
    alone = [fit_peak(spectrum.x, spectrum.y) for spectrum in spectra]
    assert 0 < sum(peak.band is None for peak in alone) < 25
    together = [line.peak for line in measure(spectra)]
    assert all(peak.band is not None for peak in together)
    assert abs(np.mean([peak.centre for peak in together]) - centre) < 0.05


def test_what_other_spectra_say_can_add_a_band_and_not_take_one_away():
    (spectrum,), _ = spectra_of_one_line(1, band=350.0)
    by_itself = fit_peak(spectrum.x, spectrum.y)
    without = PeakOptions(band_evidence=-1e3)
    assert fit_peak(spectrum.x, spectrum.y, without) == by_itself
    assert by_itself.band is not None


def test_an_error_holds_both_answers_by_their_weights():
    (spectrum,), _ = spectra_of_one_line(1, band=0.0, seed=9)
    x, y = spectrum.x, spectrum.y
    own = fit_peak(x, y).band_evidence
    assert own < 0.0
    alone = fit_peak(x, y, PeakOptions(band=False))
    beside = fit_peak(x, y, PeakOptions(band_evidence=1e3))
    apart = beside.centre - alone.centre
    both = fit_peak(x, y, PeakOptions(band_evidence=-own))  # as likely as each other
    mean = 0.5 * (alone.centre_stderr**2 + beside.centre_stderr**2)
    assert both.centre_stderr**2 == pytest.approx(mean + 0.5 * apart**2, rel=1e-6)
    assert both.centre in (alone.centre, beside.centre)


def test_an_answer_that_the_other_model_would_move_is_flagged():
    """A faint shoulder leaves some of 40 spectra in doubt, a strong one none."""
    flagged = {}
    for band in (20.0, 260.0):
        spectra, _ = spectra_of_one_line(40, band=band, step=3.4, seed=4)
        peaks = [fit_peak(spectrum.x, spectrum.y) for spectrum in spectra]
        flagged[band] = sum("band-in-doubt" in peak.flags for peak in peaks)
    assert flagged[20.0] >= 4
    assert flagged[260.0] == 0


def test_the_calibration_decides_for_the_spectra_that_it_measures(tmp_path, hot_plate):
    found, lines = calibrate_from(read_spectra([hot_plate]))
    assert found.band_evidence == pytest.approx(band_evidence(lines))
    assert found.band_evidence > 100.0
    found.save(tmp_path / "cal.json")
    assert read_raman_calibration(tmp_path / "cal.json").options == found.options
    # room temperature and few counts: by itself this line has no band
    rng = np.random.default_rng(3)
    x, y = synthetic.spectrum(300.0, rng, Instrument(counts=300.0, band=4.0, spike_rate=0.0))
    spectrum = Spectrum(x, y, "tip.txt")
    assert measure([spectrum])[0].peak.band is None
    (line,) = measure([spectrum], found.options)
    assert line.peak.band is not None


def test_the_spectra_of_one_line_that_differed_by_noise_agree(shared):
    files = shared(
        "data/field",
        "raman_same_line_plain_no_flag.txt",
        "raman_same_line_with_shoulder.txt",
        "raman_strong_line_no_line_made_up.txt",
    )
    for peaks in (
        [fit_peak(one.x, one.y) for one in read_spectra(files)],
        [line.peak for line in measure(read_spectra(files))],
    ):
        centres = np.array([peak.centre for peak in peaks])
        errors = np.array([peak.centre_stderr for peak in peaks])
        assert np.ptp(centres) < 2.0 * np.sqrt(2.0) * errors.min()
        assert errors.max() < 0.3
