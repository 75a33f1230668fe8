"""Igor's binary waves are read as the tables that they hold."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from hotlever import InputError, read_measurement
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


def test_without_its_library_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "igor2", None)
    path = tmp_path / "curve.ibw"
    path.write_bytes(b"\0\5" + bytes(400))
    with pytest.raises(InputError, match=r"curve\.ibw: .*pip install 'hotlever\[igor\]'") as error:
        read_measurement(path)
    assert "\n" not in str(error.value)
