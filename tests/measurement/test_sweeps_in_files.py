"""What a file drives and how: several sweeps, polarities, lever voltage or current, the gas."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from test_lab_files import write

from hotlever.errors import InputError
from hotlever.estimate import fit, read_measurement
from hotlever.measurement import parse_columns, with_measured_circuit
from hotlever.measurement.rows import disagreements, sweeps_of
from hotlever.probe import Circuit, Probe

IV = "V_b (V),I_h (mA)\n"
# κ of nitrogen over that of air
NITROGEN = 0.975
RAMP = np.linspace(0.0, 8.0, 17)


def current_at(bias):
    return 0.15 * bias - 0.002 * bias * np.abs(bias)


def read(tmp_path, head, *columns, **options):
    lines = [",".join(f"{value:.7g}" for value in row) for row in zip(*columns, strict=True)]
    return read_measurement(write(tmp_path, head + "\n".join(lines) + "\n"), **options)


def messages(data):
    return [note.split(": ", 1)[1] for note in data.notes]


# --- sweeps ----------------------------------------------------------------------------------

BOTH_WAYS = np.concatenate((RAMP, RAMP[-2::-1]))


@pytest.mark.parametrize(
    ("bias", "lengths"),
    [
        (RAMP, [17]),
        (RAMP[::-1], [17]),
        (BOTH_WAYS, [17, 16]),
        (np.tile(RAMP, 3), [17, 17, 17]),
        (np.concatenate((RAMP - 4.0, RAMP[::-1] - 4.0)), [9, 9, 8, 8]),
        (np.concatenate((RAMP, -RAMP)), [18, 16]),
        (np.repeat(RAMP, 2), [34]),
        (np.concatenate((RAMP, [0.0])), [18]),
        (np.random.default_rng(2).permutation(RAMP), [17]),
        (np.array([3.0]), [1]),
        (np.zeros(4), [4]),
        (RAMP + 0.02 * np.random.default_rng(1).normal(size=17), [17]),
    ],
    ids=[
        *("up", "down", "up and down", "again and again", "both polarities", "one after the other"),
        *("each twice", "back to 0", "in no order", "one row", "no bias", "noisy"),
    ],
)
def test_sweeps_are_told_apart(bias, lengths):
    found = sweeps_of(bias)
    assert [part.stop - part.start for part in found] == lengths
    assert found[0].start == 0
    assert all(one.stop == other.start for one, other in pairwise(found))


def test_all_sweeps_are_used_and_said(tmp_path):
    data = read(tmp_path, IV, BOTH_WAYS, current_at(BOTH_WAYS))
    assert data.bias_V.size == 33
    assert messages(data) == ["2 sweeps, all of them used: up (17 rows), down (16 rows)"]
    assert data.understood[0][2] == "up (17 rows), down (16 rows)"


def test_a_repeated_header_begins_another_sweep(tmp_path):
    text = "\n".join(f"{bias},{current_at(bias):.5f}" for bias in RAMP)
    data = read_measurement(write(tmp_path, f"{IV}{text}\n\n{IV}{text}\n"))
    assert messages(data) == ["2 sweeps, all of them used: up (17 rows), up (17 rows)"]


@pytest.mark.parametrize(
    ("noise", "shift", "count"), [(0.0, 0.02, 1), (3e-3, 0.0, 0), (0.0, 0.0, 0)]
)
def test_sweeps_that_differ_beyond_noise_are_told(tmp_path, noise, shift, count):
    rng = np.random.default_rng(7)
    current = current_at(BOTH_WAYS) + noise * rng.normal(size=33)
    current[17:] += shift * np.sin(np.pi * BOTH_WAYS[17:] / 8.0)
    notes = messages(read(tmp_path, IV, BOTH_WAYS, current))
    assert len(notes) == 1 + count
    if count:
        assert (
            "I_h of sweep 2 differs from that of sweep 1 by 1.3% of its largest value" in notes[1]
        )


@pytest.mark.parametrize(("share", "least"), [(0.0, 0), (0.003, 34), (0.005, 40)])
def test_a_hysteresis_of_three_times_the_noise_is_told(share, least):
    rng, up = np.random.default_rng(3), np.linspace(0.0, 8.0, 41)
    bias = np.concatenate((up, up[-2::-1]))
    largest = current_at(8.0)
    detections = 0
    for _ in range(40):
        current = current_at(bias) + 1e-3 * largest * rng.normal(size=bias.size)
        current[41:] += share * largest * np.sin(np.pi * bias[41:] / 8.0)
        detections += bool(disagreements(bias, sweeps_of(bias), {"I_h": current}))
    assert detections >= least
    assert detections <= 2 or share > 0.0


# --- polarities --------------------------------------------------------------------------------


def test_both_polarities_are_one_lever(tmp_path):
    bias = np.concatenate((-RAMP[:0:-1], RAMP))
    data = read(tmp_path, "V_b (V),I_h (mA),V_r (V)\n", bias, current_at(bias), 0.06 * bias)
    np.testing.assert_allclose(data.bias_V, np.abs(bias))
    np.testing.assert_allclose(data.current_mA, current_at(np.abs(bias)), rtol=1e-6)
    np.testing.assert_allclose(data.reader_V, 0.06 * np.abs(bias), rtol=1e-6)
    assert (
        "V_b is negative, and counts as positive with I_h and V_r, and in 15 more"
        in messages(data)[0]
    )
    assert "negative, down (17 rows), up (16 rows)" in messages(data)[1]


def test_an_offset_near_zero_keeps_its_sign(tmp_path):
    data = read(tmp_path, IV, [-2.0, -0.1, 0.1, 2.0], [-0.3, 0.004, 0.02, 0.3])
    np.testing.assert_allclose(data.current_mA, [0.3, -0.004, 0.02, 0.3])


# --- lever voltage, and current driven ----------------------------------------------------------


def test_the_bias_follows_from_the_lever_voltage(tmp_path):
    lever, current = [0.2, 0.4, 0.5], [0.14, 0.29, 0.4]
    head = "# R_s = 5.6 kOhm\nV_l (V),I_h (mA)\n"
    data = read(tmp_path, head, lever, current)
    np.testing.assert_allclose(data.bias_V, np.array(lever) + 5.6 * np.array(current))
    assert ("V_b", "0.984 to 2.74 V", "bias, V_l + R_s I_h") in data.understood


def test_the_probe_gives_the_series_resistance_that_the_file_lacks(tmp_path):
    head, columns = "V_l (V),I_h (mA)\n", ([0.2, 0.4], [0.14, 0.29])
    data = read(tmp_path, head, *columns, circuit=Circuit(series_resistance_ohm=2000))
    np.testing.assert_allclose(data.bias_V, [0.48, 0.98])
    assert data.series_resistance_ohm == 2000
    assert ("R_s", "2000 ohm", "of the probe") in data.understood


def test_a_curve_that_folds_without_a_resistor_is_told_apart_along_another(tmp_path):
    current = np.linspace(0.1, 1.6, 16)
    lever = 3.0 * np.sin(np.pi * current / 2.0)
    data = read(tmp_path, "# R_s = 0 ohm\nI_h (mA),V_l (V)\n", current, lever)
    kohm = data.series_resistance_ohm / 1000.0
    assert np.all(np.diff(data.bias_V) > 0)
    np.testing.assert_allclose(data.bias_V - kohm * data.current_mA, lever, rtol=1e-6, atol=1e-6)
    assert "9.3 kOhm are reckoned with instead, which changes nothing" in messages(data)[0]


def test_a_current_driven_measurement_is_fitted_as_a_voltage_driven_one(tmp_path, coarse):
    probe = coarse.probe.with_(series_resistance_ohm=5600)
    sweep = coarse.sweep(np.linspace(1.0, 9.0, 12))
    head = "# R_s = 0 ohm\nI_h (mA),V_l (V)\n"
    data = read(tmp_path, head, sweep.current_mA.values, sweep.lever_V.values)
    assert data.series_resistance_ohm > 5000
    fixed = {"delta": None, "p": None, "a0": None, "a1": None}
    values = fit(data, probe, fixed=fixed).parameters
    truth = coarse.probe.material
    assert values["n_d"].value == pytest.approx(truth.n_d, rel=0.01)
    assert values["c_kappa"].value == pytest.approx(truth.c_kappa, rel=0.01)


# --- gas and pressure ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("comment", "medium", "gas", "pressure"),
    [
        ("medium: nitrogen", "air", NITROGEN, None),
        ("100 mbar N2", "air", NITROGEN, 100.0),
        ("medium: N2, 100 mbar", "air", NITROGEN, 100.0),
        ("air, 100 mbar", "air", None, 100.0),
        ("medium: air, 1 atm", "air", None, 1013.25),
        ("gas: dry air\n# pressure (Torr): 760", "air", None, 1013.25),
        ("medium: 1e-5 mbar", "vacuum", None, None),
        ("chamber pressure = 2x10^-6 mbar", "vacuum", None, None),
        ("p = 10⁻⁴ Pa", "vacuum", None, None),
        ("medium: helium, 1e-6 mbar", "vacuum", None, None),
        ("vacuum (3 · 10^-6 Torr)", "vacuum", None, None),
        ("medium: vacuum; 10 s settling per point", "vacuum", None, None),
    ],
)
def test_gas_and_pressure_count(tmp_path, comment, medium, gas, pressure):
    data = read(tmp_path, f"# {comment}\n{IV}", [1.0], [0.14])
    assert (data.medium, data.gas_conductivity) == (medium, gas)
    assert data.pressure_mbar == (None if pressure is None else pytest.approx(pressure, rel=1e-3))


def test_a_gas_that_is_only_mentioned_is_noted(tmp_path):
    data = read(tmp_path, f"# taken in N2 by hand\n{IV}", [1.0], [0.14])
    assert "line 1: '# taken in N2 by hand' does not set the medium" in messages(data)[0]
    data = read(tmp_path, f"# medium: nitrogen; 5 % helium\n{IV}", [1.0], [0.14])
    assert "line 1: '5 % helium' does not set the medium" in messages(data)[0]
    with pytest.raises(InputError, match="medium is 'nitrogen, 5 % helium', expected"):
        read(tmp_path, f"# medium: nitrogen, 5 % helium\n{IV}", [1.0], [0.14])


def test_the_probe_takes_gas_and_pressure_of_the_data(tmp_path):
    data = read(tmp_path, f"# medium: nitrogen, 100 mbar\n{IV}", [1.0], [0.14])
    probe = Probe.reference().with_(medium="air", accommodation=0.9)
    around = with_measured_circuit(probe, data)[0].surroundings
    assert (around.medium, around.gas_conductivity, around.pressure_mbar) == ("air", NITROGEN, 100)
    with pytest.raises(InputError, match="the pressure is 100 mbar, expected accommodation in"):
        with_measured_circuit(Probe.reference(), data)
    dense = read(tmp_path, f"# medium: air, 960 hPa\n{IV}", [1.0], [0.14])
    assert with_measured_circuit(Probe.reference(), dense)[0].surroundings.medium == "air"
    # whoever asks for vacuum knows
    assert with_measured_circuit(probe, data, "vacuum")[0].surroundings.gas_conductivity == 1.0


def test_the_pressure_of_a_vacuum_is_shown_and_is_no_matter(tmp_path):
    data = read(tmp_path, f"# medium: vacuum, 1e-2 mbar\n{IV}", [1.0], [0.14])
    assert ("medium", "vacuum", "line 1, 0.01 mbar") in data.understood
    assert data.notes == ()
    data = read(tmp_path, f"# medium: helium, 1e-6 mbar\n{IV}", [1.0], [0.14])
    assert messages(data) == ["line 1: 1e-06 mbar of any gas count as vacuum"]


# --- what is told ---------------------------------------------------------------------------------


def test_a_file_of_column_names_may_be_kept(tmp_path):
    names = tmp_path / "our-setup.txt"
    names.write_text("# our 2450\nI_h (uA) = Current\n\nV_b=Source (V)\n")
    found = parse_columns([names, "T_tip (K)=3"])
    assert found == {"I_h (uA)": "Current", "V_b": "Source (V)", "T_tip (K)": "3"}


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["I_h (uA)="], "--column I_h .uA.=: found .* expected one like 'I_h .uA.=Current'"),
        (["I_x=a"], "--column I_x=a: unknown quantity 'I_x': did you mean 'I_h'"),
        (["I_h (K)=a"], "--column I_h .K.=a: I_h: unit 'K' is not understood here"),
        (["I_h=a", "Ih (A)=b"], "I_h is given twice, expected once"),
        (["names.txt"], "names.txt: no such file"),
    ],
)
def test_columns_that_cannot_be_are_refused(texts, message):
    with pytest.raises(InputError, match=message):
        parse_columns(texts)


def test_what_was_understood_says_column_unit_and_line(tmp_path):
    head = "# R_s: 5.6 kOhm\n# medium: N2, 1 bar\nBias;Strom;T_tip (°C)\n"
    text = f"{head}1,0;143,4;20\n2,0;284,9;\n"
    data = read_measurement(write(tmp_path, text), {"I_h (uA)": "Strom", "V_b (V)": "1"})
    assert data.understood[1:] == (
        ("V_b", "1 to 2 V", "bias, 'Bias' in V"),
        ("I_h", "0.1434 to 0.2849 mA", "heater current, 'Strom' in uA"),
        ("T_tip", "293.15 to 293.15 K, 1 value", "tip temperature, 'T_tip (°C)'"),
        ("R_s", "5600 ohm", "line 1"),
        ("T_base", "not said", "the probe's counts"),
        ("medium", "air", "line 2"),
        ("pressure", "1000 mbar", "line 2"),
        ("gas conductivity", "0.975 of air's", "line 2, nitrogen"),
    )
