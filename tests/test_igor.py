"""Igor's binary waves are read as the tables that they hold."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from hotlever import InputError, read_measurement
from hotlever.measurement import file_groups
from hotlever.measurement.columns import parse_columns

NOTE = "V_b (V): 8\rR_s (kOhm): 5.6\rOperator: Zoë\r"
CURRENT = np.array([1.071, 1.07, 1.0 / 3.0, 1.065])


def written(path, values, name="wave0", unit="", scale=None, labels=(), note=NOTE):
    """Write a wave: the scale is a start, a step and their unit."""
    pytest.importorskip("igor2")
    wave = pytest.importorskip("igorwriter").IgorWave(values, name=name)
    wave.set_datascale(unit)
    if scale is not None:
        wave.set_dimscale("x", *scale)
    for number, label in enumerate(labels):
        wave.set_dimlabel(1, number, label)
    wave.set_note(note)
    wave.save(str(path))
    return path


def test_an_approach_is_a_wave_along_the_distance(tmp_path):
    scale = (300e-9, -100e-9, "m")
    path = written(tmp_path / "approach.ibw", 1e-3 * CURRENT, "I_h", "A", scale)
    data = read_measurement(path, columns=parse_columns(["D=x"]))
    assert data.bias_V.tolist() == [8.0] * 4
    np.testing.assert_allclose(data.current_mA, CURRENT, rtol=1e-15)
    np.testing.assert_allclose(data.distance_um, [0.3, 0.2, 0.1, 0.0], atol=1e-15)
    assert data.series_resistance_ohm == 5600.0


def test_a_force_curve_has_a_column_for_each_channel(tmp_path):
    table = np.stack([[3e-7, 1e-7, 0.0], CURRENT[:3], [1.0, 2.0, 3.0]], axis=1)
    path = written(
        tmp_path / "curve.ibw", table, "LineCurve", "m", labels=("ZSnsr", "UserIn0", "Defl")
    )
    data = read_measurement(path, columns=parse_columns(["D (m)=ZSnsr", "I_h (mA)=UserIn0"]))
    assert data.current_mA.tolist() == CURRENT[:3].tolist()
    np.testing.assert_allclose(data.distance_um, [0.3, 0.1, 0.0])
    assert any("'Defl' is not used" in note for note in data.unused)


def test_a_wave_in_time_has_its_times(tmp_path):
    table, scale = np.stack([np.full(4, 8.0), CURRENT], axis=1), (0.0, 2e-6, "s")
    labels = ("V_b (V)", "I_h (mA)")
    path = written(tmp_path / "pulse.ibw", table, scale=scale, labels=labels, note="")
    data = read_measurement(path)
    assert data.time_us is not None
    np.testing.assert_allclose(np.diff(data.time_us), 2.0)


def test_a_damaged_wave_is_one_line(tmp_path):
    path = written(tmp_path / "curve.ibw", CURRENT, "I_h", "A", (0.0, 1e-9, "m"))
    raw = path.read_bytes()
    for end in (2, 40, 200, 390):
        path.write_bytes(raw[:end])
        with pytest.raises(InputError, match=r"curve\.ibw: not a readable Igor wave") as caught:
            read_measurement(path)
        assert "\n" not in str(caught.value)
    written(path, CURRENT.astype(complex))
    with pytest.raises(InputError, match="type complex128, expected real numbers"):
        read_measurement(path)


def experiment(path, *records):
    """Write records: their kinds, and their contents or the files that have them."""
    with path.open("wb") as file:
        for kind, content in records:
            content = content if isinstance(content, bytes) else content.read_bytes()
            file.write(struct.pack("<HHi", kind, 0, len(content)) + content)
    return path


def test_the_waves_of_a_folder_of_an_experiment_are_a_table(tmp_path):
    bias = written(tmp_path / "bias.ibw", np.array([1.0, 2.0, 4.0, 8.0]), "V_b", "V", note="")
    current = written(tmp_path / "current.ibw", 1e-4 * CURRENT, "I_h", "A")
    other = written(tmp_path / "other.ibw", 5e-5 * CURRENT, "I_h", "A", note="")
    folder = b"second".ljust(32, b"\0")
    path = experiment(
        tmp_path / "all.pxp",
        (2, b"the history"),
        (3, bias),
        (3, current),
        (9, folder),
        (3, bias),
        (3, other),
        (10, b""),
    )
    assert file_groups(path) == ["/", "/second"]
    data = read_measurement(path, {"group": "/"})
    assert data.bias_V.tolist() == [1.0, 2.0, 4.0, 8.0]
    np.testing.assert_allclose(data.current_mA, 0.1 * CURRENT, rtol=1e-14)
    data = read_measurement(path, {"group": "/second"})
    np.testing.assert_allclose(data.current_mA, 0.05 * CURRENT, rtol=1e-14)


def test_waves_of_an_experiment_along_a_scale_have_it(tmp_path):
    scale = (300e-9, -100e-9, "m")
    path = experiment(
        tmp_path / "all.pxp",
        (3, written(tmp_path / "one.ibw", 1e-3 * CURRENT, "I_h", "A", scale)),
        (3, written(tmp_path / "two.ibw", CURRENT, "V_r", "mV", scale, note="")),
    )
    data = read_measurement(path, columns=parse_columns(["D=x"]))
    np.testing.assert_allclose(data.distance_um, [0.3, 0.2, 0.1, 0.0], atol=1e-15)
    np.testing.assert_allclose(data.current_mA, CURRENT, rtol=1e-15)


def test_a_wave_without_values_says_so(tmp_path):
    path = written(tmp_path / "empty.ibw", np.zeros(0))
    with pytest.raises(InputError, match="a wave without values"):
        read_measurement(path)
