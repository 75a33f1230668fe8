"""Calibration, temperatures and their errors, and the paper's check."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import synthetic_spectra as synthetic
from hotlever.errors import InputError
from hotlever.raman import anharmonic, lineshape
from hotlever.raman.line_fit import fit_peak
from hotlever.raman.series import calibrate_from, measure, read_lines
from hotlever.raman.spectrum import Spectrum
from hotlever.raman.spectrum_reading import read_spectra
from hotlever.raman.spectrum_tables import read_temperatures
from hotlever.raman.thermometer import (
    Point,
    Thermometer,
    calibrate_raman,
    laser_heating,
    published_raman_calibration,
    read_raman_calibration,
)
from hotlever.spieser2017 import RAMAN_CONSTANT_K, RAMAN_SLOPE_K_CM


def points(temperatures, reference=521.0, noise=0.0, seed=0, stderr=0.04):
    shift, _ = anharmonic.shift(temperatures, float(np.min(temperatures)))
    rng = np.random.default_rng(seed)
    return [
        Point(
            file=f"{t:g}K",
            temperature_K=float(t),
            centre_cm=float(reference + d + noise * rng.normal()),
            centre_stderr_cm=stderr,
        )
        for t, d in zip(temperatures, shift, strict=True)
    ]


PLATE = np.arange(295.0, 896.0, 25.0)


# --- the law -------------------------------------------------------------------------------


def test_a_spectrum_without_noise_is_known_as_well_as_its_numbers_are_rounded():
    """As one that was computed: its line had no error at all, and no weight as a reference."""
    x = np.arange(440.0, 600.0, 0.5)
    peak = fit_peak(x, 1000.0 * lineshape.line(x, 520.0, 4.0)[0])
    assert 0.0 < peak.centre_stderr < 1e-12
    published = Thermometer(published_raman_calibration(), reference=521.0)
    assert published.with_reference([(peak, None)]).reference == pytest.approx(520.0, abs=1e-9)


@given(st.floats(30.0, 1600.0))
def test_derivative_of_the_anharmonic_law(temperature):
    h = 1e-3
    _, slope = anharmonic.shift(temperature, 293.0)
    plus, _ = anharmonic.shift(temperature + h, 293.0)
    minus, _ = anharmonic.shift(temperature - h, 293.0)
    assert slope == pytest.approx((plus - minus) / (2 * h), rel=1e-5, abs=1e-9)


def test_law_gives_balkanskis_line_and_the_slope_the_paper_quotes():
    # Balkanski et al. 1983, table and fig. 3: 524.9 cm⁻¹ at 5 K, near 520 at room temperature
    assert synthetic.line_centre(5.0) == pytest.approx(524.866, abs=1e-3)
    assert synthetic.line_centre(300.0) == pytest.approx(521.8, abs=0.2)
    # "approximately −0.022 cm⁻¹/K"
    _, slope = anharmonic.shift(400.0, 293.0)
    assert slope == pytest.approx(-0.022, abs=0.002)


@given(st.floats(120.0, 1650.0), st.floats(280.0, 320.0))
def test_inverse_of_the_law_returns_the_temperature(temperature, room):
    law = published_raman_calibration().anharmonic
    shift, _ = law.shift(np.array([temperature]), room)
    assert law.temperature(shift, room)[0] == pytest.approx(temperature, abs=0.02)


# --- calibration ---------------------------------------------------------------------------


def test_calibration_recovers_the_law_without_noise():
    found = calibrate_raman(points(PLATE))
    assert found.reference_cm == pytest.approx(521.0)
    assert found.anharmonic.three_phonon_cm == pytest.approx(anharmonic.THREE_PHONON)
    assert found.anharmonic.four_phonon_cm == pytest.approx(anharmonic.FOUR_PHONON)
    assert found.linear.slope_K_cm == pytest.approx(-40.6, abs=0.5)


def test_errors_of_extrapolated_temperatures_are_honest():
    """Above the plate the covariance, not the photon noise, rules; pulls must still be one."""
    targets = np.array([500.0, 800.0, 1000.0, 1150.0])
    pulls = []
    for seed in range(300):
        found = calibrate_raman(points(PLATE, noise=0.06, seed=seed, stderr=0.06))
        rng = np.random.default_rng(10_000 + seed)
        shift, _ = anharmonic.shift(targets, 295.0)
        centre = 521.0 + shift + 0.1 * rng.normal(size=4)
        reading = Thermometer(found).read(centre, np.full(4, 0.1))
        # the model's error is no noise: leave it out of the pull
        _, slope = found.anharmonic.shift(reading.temperature, 295.0)
        model = Thermometer(found)._model_error(reading.temperature, slope)
        pulls.append((reading.temperature - targets) / np.sqrt(reading.error**2 - model**2))
    width = np.std(pulls, axis=0)
    assert np.all((width > 0.85) & (width < 1.15)), width


def test_error_grows_outside_the_calibrated_range_and_is_flagged():
    found = calibrate_raman(points(PLATE, noise=0.05, stderr=0.05))
    temperatures = np.array([300.0, 600.0, 890.0, 1000.0, 1150.0, 1400.0])
    centre = found.reference_cm + found.anharmonic.shift(temperatures, 295.0)[0]
    for law in ("anharmonic", "linear"):
        reading = Thermometer(found, law=law).read(centre, np.full(6, 0.05))
        assert np.all(np.diff(reading.error[2:]) > 0.0)
        np.testing.assert_array_equal(reading.outside[[1, 3, 4, 5]], [False, True, True, True])
    # the linear law owns up to what it is wrong by
    assert np.all(reading.error[3:] >= np.abs(reading.temperature - temperatures)[3:] - 3.0)


def test_offset_of_the_axis_cancels():
    one = calibrate_raman(points(PLATE, reference=520.2))
    other = calibrate_raman(points(PLATE, reference=523.9))
    a = Thermometer(one).read([520.2 - 12.0], [0.05])
    b = Thermometer(other).read([523.9 - 12.0], [0.05])
    assert a.temperature[0] == pytest.approx(b.temperature[0], abs=1e-6)


def test_reference_of_the_day_replaces_the_calibrations(hot_plate):
    spectra = read_spectra([hot_plate])
    found, lines = calibrate_from(spectra)
    room = lines[0].peak
    shifted_spectra = [Spectrum(s.x + 1.5, s.y, s.name) for s in spectra]
    shifted = measure(shifted_spectra)
    thermometer = Thermometer(found).with_reference([(shifted[0].peak, 295.0)])
    reading = thermometer.read([shifted[20].peak.centre], [shifted[20].peak.centre_stderr])
    assert reading.temperature[0] == pytest.approx(795.0, abs=4 * reading.error[0])
    assert thermometer.reference_stderr == pytest.approx(room.centre_stderr, rel=0.02)
    wrong = Thermometer(found).read([shifted[20].peak.centre], [0.1])
    assert abs(wrong.temperature[0] - 795.0) > 40.0


def test_references_that_differ_by_more_than_their_noise_say_how_sure_they_are():
    """As on an axis that comes back to 0.1 cm⁻¹: three of them are known to 0.06."""
    peak = fit_peak(*synthetic.spectrum(295.0, np.random.default_rng(3)))
    lines = [(replace(peak, centre=520.0 + d, centre_stderr=0.01), None) for d in (-0.1, 0.0, 0.1)]
    thermometer = Thermometer(calibrate_raman(points(PLATE)))
    assert thermometer.with_reference(lines).reference_stderr == pytest.approx(0.1 / np.sqrt(3.0))
    assert thermometer.with_reference(lines[:1]).reference_stderr == pytest.approx(0.01)


@pytest.mark.parametrize("scatter", [0.0, 0.04, 0.3])
def test_what_lines_of_the_series_scatter_beyond_their_noise_others_do_too(scatter):
    """Places known to 0.04 cm⁻¹, on an axis that comes back to so much."""
    pulls = []
    for seed in range(60):
        *series, line = points(np.append(PLATE, 700.0), noise=np.hypot(0.04, scatter), seed=seed)
        reading = Thermometer(calibrate_raman(series)).read([line.centre_cm], [0.04])
        assert reading.noise <= reading.error
        pulls.append((reading.temperature - 700.0).item() / reading.error.item())
    # some of the scatter by chance seems to be none
    assert 0.7 < np.std(pulls) < 1.3


def test_reference_at_another_temperature_is_brought_to_room_temperature():
    found = calibrate_raman(points(PLATE))
    x, y = synthetic.spectrum(330.0, np.random.default_rng(3))
    warm = fit_peak(x, y)
    reference = Thermometer(found).with_reference([(warm, 330.0)]).reference
    expected = synthetic.true_line(295.0)[0]
    assert reference == pytest.approx(expected, abs=4 * warm.centre_stderr)


def test_few_temperatures_fix_the_ratio_of_the_terms():
    found = calibrate_raman(points(np.array([295.0, 400.0, 500.0])))
    assert found.anharmonic.ratio_fixed
    assert found.anharmonic.four_phonon_cm / found.anharmonic.three_phonon_cm == pytest.approx(
        anharmonic.FOUR_PHONON / anharmonic.THREE_PHONON
    )
    reading = Thermometer(found).read([521.0 + anharmonic.shift(480.0, 295.0)[0]], [0.03])
    assert reading.temperature[0] == pytest.approx(480.0, abs=1.0)


@pytest.mark.parametrize(
    ("series", "words"),
    [
        (points(np.array([295.0, 400.0])), "2 different temperatures"),
        (points(np.arange(400.0, 900.0, 50.0)), "coldest spectrum is at 400 K"),
        (
            [p.model_copy(update={"centre_cm": 1042.0 - p.centre_cm}) for p in points(PLATE)],
            r"moves by \+0\.\d+ cm⁻¹/K",
        ),
        ([p.model_copy(update={"centre_stderr_cm": 0.0}) for p in points(PLATE)], "above 0"),
    ],
)
def test_series_that_cannot_calibrate(series, words):
    with pytest.raises(InputError, match=words):
        calibrate_raman(series)


def test_calibration_survives_its_file(tmp_path):
    found = calibrate_raman(points(PLATE, noise=0.05), line_shape="voigt", resolution_cm=1.2)
    found.save(tmp_path / "cal.json")
    assert read_raman_calibration(tmp_path / "cal.json") == found


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.pop("linear"), "linear is missing"),
        (lambda d: d.update(format="other"), "format = "),
        (lambda d: d["linear"].update(slope_K_cm=5), "linear.slope_K_cm = "),
        (lambda d: d["linear"].update(slope_K_cm=-1e13), "linear.slope_K_cm = "),
        (lambda d: d["linear"].update(error_fraction=-1), "linear.error_fraction = "),
        (lambda d: d["linear"].update(error_fraction=1e300), "linear.error_fraction = "),
        (lambda d: d["linear"].update(slop=5), "linear.slop = "),
        (lambda d: d["anharmonic"].update(covariance=[[1.0]]), "3 × 3"),
        (lambda d: d["anharmonic"].update(four_phonon_cm=1.0), "must fall with temperature"),
        (lambda d: d["anharmonic"].update(three_phonon_cm=-1e-9, four_phonon_cm=0), "must fall"),
        (lambda d: d["anharmonic"]["covariance"][0].__setitem__(0, 1e308), "covariance.0.0 = "),
        (lambda d: d.update(room_temperature_K=1e-300), "room_temperature_K = "),
    ],
)
def test_broken_calibration_file_names_the_key(tmp_path, change, words):
    file = tmp_path / "cal.json"
    calibrate_raman(points(PLATE)).save(file)
    data = json.loads(file.read_text())
    change(data)
    file.write_text(json.dumps(data))
    with pytest.raises(InputError, match=words) as caught:
        read_raman_calibration(file)
    assert str(file) in str(caught.value)


def test_file_that_is_no_calibration(tmp_path):
    for text, words in {"520.0\t100\n": "not valid JSON", "{}": "not a Raman calibration"}.items():
        (tmp_path / "cal.json").write_text(text)
        with pytest.raises(InputError, match=words):
            read_raman_calibration(tmp_path / "cal.json")
    with pytest.raises(InputError, match="no such file"):
        read_raman_calibration(tmp_path / "none.json")


# --- the published laws and the paper's error model ----------------------------------------


def test_published_line_and_its_error():
    thermometer = Thermometer(published_raman_calibration(), law="linear", reference=520.7)
    reading = thermometer.read([520.7 - 14.0], [0.0])
    above = RAMAN_CONSTANT_K - RAMAN_SLOPE_K_CM * 14.0
    assert reading.temperature[0] - 293.0 == pytest.approx(above)
    assert reading.error[0] == pytest.approx(5.0 + 0.02 * above, rel=1e-9)


def test_published_laws_need_a_reference():
    with pytest.raises(InputError, match="holds no room-temperature line"):
        Thermometer(published_raman_calibration())


def test_no_temperature_where_silicon_has_no_such_line():
    thermometer = Thermometer(published_raman_calibration(), reference=520.7)
    reading = thermometer.read([540.0, 470.0], [0.05, 0.05])
    assert np.all(np.isnan(reading.temperature))
    assert np.all(np.isnan(reading.error))


def test_stress_and_laser_heating_enter_the_error():
    found = calibrate_raman(points(PLATE))
    centre, stderr = [521.0 - 12.0], [0.05]
    plain = Thermometer(found).read(centre, stderr).error[0]
    stressed = Thermometer(found, stress=20.0).read(centre, stderr).error[0]
    # the paper: stress below 20 MPa, from its simulation, is worth less than 1 K
    assert 0.3 < np.sqrt(stressed**2 - plain**2) < 1.0
    heated = Thermometer(found, laser_heating=7.0).read(centre, stderr).error[0]
    assert np.sqrt(heated**2 - plain**2) == pytest.approx(7.0)
    # the paper: 100 µW, a tenth absorbed, some 860 K at 4 mW
    assert laser_heating(0.1, 860.0 / 4.0) == pytest.approx(2.15)
    for arguments in ((-1.0, 200.0), (1.0, float("nan")), (1.0, 1.0, 2.0)):
        with pytest.raises(InputError, match="expected"):
            laser_heating(*arguments)
    with pytest.raises(InputError, match="stress"):
        Thermometer(found, stress=-1.0)
    with pytest.raises(InputError, match="did you mean 'linear'"):
        Thermometer(found, law="liner")


# --- whole series --------------------------------------------------------------------------


def test_made_up_series_to_1150_kelvin(hot_plate):
    found, _ = calibrate_from(read_spectra([hot_plate]))
    assert found.anharmonic.residual_rms_K < 3.5
    rng = np.random.default_rng(77)
    true = np.linspace(300.0, 1150.0, 18)
    spectra = [Spectrum(*synthetic.spectrum(t, rng), name=f"{t:.0f}") for t in true]
    table = read_lines(measure(spectra), Thermometer(found))
    error = table.temperature_K.values - true
    assert np.all(np.abs(error) < 12.0)
    assert np.mean((error / table.temperature_error_K.values) ** 2) < 2.0
    assert [("extrapolated" in flags) for flags in table.flags.values] == list(true > 895.0)


def test_virtual_lab_hot_plate_meets_the_targets(hot_plate_files):
    found, lines = calibrate_from(read_spectra(hot_plate_files))
    assert len(lines) == 25
    assert abs(found.linear.slope_K_cm + 41.0) < 0.03 * 41.0
    assert found.anharmonic.residual_rms_K < 3.0
    residuals = found.residuals()
    temperature = residuals["temperature_K"]
    # no trend left: slope, curvature and cubic term all within two standard errors
    scaled = (temperature - temperature.mean()) / np.ptp(temperature)
    design = np.vander(scaled, 4)
    coefficients, *_ = np.linalg.lstsq(design, residuals["anharmonic_K"], rcond=None)
    noise = found.anharmonic.residual_rms_K
    errors = noise * np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
    assert np.all(np.abs(coefficients) < 2.0 * errors)
    # the line does leave the paper's band, cold, in the middle and at the top
    outside = temperature[np.abs(residuals["linear_K"]) > residuals["band_K"]]
    assert outside.min() == 295.0
    assert np.any((outside > 500.0) & (outside < 700.0))
    # photon noise alone explains what the anharmonic law leaves
    assert 0.4 < found.anharmonic.reduced_chi_square < 1.8


def test_virtual_lab_tips_agree_with_the_published_constants(hot_plate_files, tip_files):
    """Their temperatures are not given; the published constants are an independent witness."""
    found, _ = calibrate_from(read_spectra(hot_plate_files))
    table = read_lines(measure(read_spectra(tip_files)), Thermometer(found))
    assert table.sizes == {"spectrum": 12}
    law = published_raman_calibration().anharmonic
    other = law.temperature(table.shift_per_cm.values, found.room_temperature_K)
    np.testing.assert_allclose(table.temperature_K, other, atol=6.0)
    assert table.temperature_error_K.max() < 12.0
    assert "extrapolated" in table.flags.values[-1]
    assert np.all(np.diff(table.temperature_K) > 0.0)


def test_series_without_temperatures_or_line_is_refused(hot_plate, silicon):
    x, y = silicon
    with pytest.raises(InputError, match=r"a\.txt: no temperature in its header or name"):
        calibrate_from([Spectrum(x, y, "a.txt")])
    flat = np.random.default_rng(0).poisson(100.0, x.size).astype(float)
    with pytest.raises(InputError, match=r"a\.txt: no silicon line"):
        calibrate_from([Spectrum(x, flat, "a.txt", temperature=300.0)])
    clipped = np.minimum(y, 400.0)
    with pytest.raises(InputError, match="a saturated line"):
        calibrate_from([Spectrum(x, clipped, "a.txt", temperature=300.0)])


def test_table_of_temperatures(tmp_path, hot_plate):
    spectra = read_spectra([hot_plate])
    table = tmp_path / "plate.csv"
    rows = "".join(f"{s.name};{s.temperature - 273.15:.2f}\n" for s in spectra)
    table.write_text("file;temperature (°C)\n" + rows.replace(".", ",").replace(",txt", ".txt"))
    bare = [Spectrum(s.x, s.y, s.name) for s in spectra]
    found, _ = calibrate_from(bare, temperatures=read_temperatures(table))
    expected, _ = calibrate_from(spectra)
    assert found.linear.slope_K_cm == pytest.approx(expected.linear.slope_K_cm)
    with pytest.raises(InputError, match=r"unknown spectrum .* 'other.txt'"):
        calibrate_from(
            [Spectrum(bare[0].x, bare[0].y, "other.txt")], temperatures=read_temperatures(table)
        )


@pytest.mark.parametrize(
    ("text", "kelvin"),
    [
        ("a.txt,300\n", 300.0),
        ("# plate\nfile\ttemperature [°C]\na.txt\t26,85\n", 300.0),
        ("a.txt   300.0\n", 300.0),
        ("file  temperature (°C)\na.txt  26.85\n", 300.0),
        ("a.txt;300,0\nb.txt;400,0\n", 300.0),
        ("a.txt,300,good\nb.txt,400,bad\n", 300.0),
        ("file;T_C\na.txt;26,85\n", 300.0),
        ("file,temperature\nfolder/a.txt,300\n", 300.0),
    ],
)
def test_tables_of_temperatures_as_people_write_them(tmp_path, text, kelvin):
    (tmp_path / "t.csv").write_text(text)
    assert read_temperatures(tmp_path / "t.csv")["a.txt"] == pytest.approx(kelvin)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no rows"),
        ("a.txt\n", "expected a file name and a temperature"),
        ("a.txt,295\nb.txt,hot\n", "line 2: temperature: found 'hot'"),
        ("a.txt,-5\n", "line 1: '-5' is no sample temperature"),
        ("a.txt,\n", "expected a file name and a temperature"),
        ("a.txt,295\nb.txt\n", "line 2: 1 cell, expected 2 as in line 1"),
        ("file,temperature (F)\na.txt,77\n", "line 1: temperature .F.: unit 'F' is not understood"),
        ("a.txt,300\na.txt,400\n", "line 2: 'a.txt' has another temperature above"),
        ('a.txt,"300\n', "line 1: .* expected quotes in pairs"),
    ],
)
def test_broken_table_of_temperatures(tmp_path, text, words):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_temperatures(tmp_path / "t.csv")
