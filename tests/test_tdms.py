"""LabVIEW's TDMS files are read as the tables that they hold."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import InputError, read_measurement
from hotlever.lever.transient.waveform import read_waveform
from hotlever.measurement import file_groups

BIAS = np.array([0.1, 1.0, 2.0 / 3.0, 8.25])
CURRENT = BIAS / 7e3


def written(path, *groups, **root_properties):
    """Write groups of channels: each their name, unit, values and further properties."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        objects = [nptdms.RootObject(root_properties)]
        for number, channels in enumerate(groups):
            for name, unit, values, *properties in channels:
                all_properties = {"unit_string": unit} | dict(*properties)
                objects.append(
                    nptdms.ChannelObject(f"sweep {number}", name, values, all_properties)
                )
        writer.write_segment(objects)
    return path


def test_channels_are_columns_with_their_units(tmp_path):
    channels = [("Bias", "V", BIAS), ("Current", "A", CURRENT), ("flag", "", np.arange(4))]
    path = written(tmp_path / "iv.tdms", channels, **{"R_s (kOhm)": 5.6, "author": "a\tb"})
    data = read_measurement(path)
    # each number is the one that was written
    assert data.bias_V.tolist() == BIAS.tolist()
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)
    assert data.series_resistance_ohm == 5600.0
    assert f"{path}: column 'flag' is not used" in data.unused


def test_of_several_groups_the_one_that_is_told_is_read(tmp_path):
    one = [("V_b", "V", BIAS), ("I_h", "Amps", CURRENT)]
    other = [("V_b", "V", BIAS), ("I_h", "Amps", 1.3 * CURRENT)]
    path = written(tmp_path / "iv.tdms", one, other)
    with pytest.raises(
        InputError, match=r"2 groups, .*: 'sweep 0', 'sweep 1'; .* --column 'group=sweep 0'"
    ):
        read_measurement(path)
    data = read_measurement(path, {"group": "sweep 1"})
    np.testing.assert_allclose(data.current_mA, 1.3e3 * CURRENT, rtol=1e-15)
    with pytest.raises(InputError, match="unknown group 'sweep 2': did you mean 'sweep 1'"):
        read_measurement(path, {"group": "sweep 2"})
    assert file_groups(path) == ["sweep 0", "sweep 1"]


def test_long_names_of_groups_can_be_told_apart_and_copied(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    path, title = tmp_path / "iv.tdms", "07/09/2012 06:58:23 PM - Analogue input - "
    with nptdms.TdmsWriter(path) as writer:
        channels = [nptdms.ChannelObject(f"{title}{name}", "V_b", BIAS) for name in ("all", "some")]
        writer.write_segment(channels)
    with pytest.raises(InputError, match=f"'{title}all', '{title}some'; .*'group={title}all'"):
        read_measurement(path)


def test_a_group_of_settings_is_asked_for_too(tmp_path):
    one = [("V_b", "V", BIAS), ("I_h", "Amps", CURRENT)]
    path = written(tmp_path / "iv.tdms", one, [("T_stage", "°C", BIAS)])
    with pytest.raises(InputError, match="expected one, which --column 'group=sweep 0' says"):
        read_measurement(path)
    assert read_measurement(path, {"group": "sweep 0"}).bias_V.tolist() == BIAS.tolist()


def test_other_files_have_no_groups(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("V_b (V),I_h (mA)\n1,0.14\n")
    assert file_groups(path) == []
    with pytest.raises(InputError, match=r"iv\.csv: has no groups, .* no group 'up'"):
        read_measurement(path, {"group": "up"})


def test_channels_of_other_times_are_no_rows(tmp_path):
    fast, slow = ({"wf_start_offset": 0.0, "wf_increment": step} for step in (1e-3, 2e-3))
    channels = [("V_b", "V", BIAS, fast), ("I_h", "A", CURRENT[::2], slow)]
    path = written(tmp_path / "iv.tdms", channels)
    with pytest.raises(InputError, match=r"every 0\.001 s .* every 0\.002 s .* the same times"):
        read_measurement(path)


def test_waveforms_have_their_times(tmp_path):
    times = {"wf_start_offset": 1e-6, "wf_increment": 2e-6}
    pulse = [("V_b", "V", BIAS, times), ("I_h", "mA", 1e3 * CURRENT, times)]
    data = read_measurement(written(tmp_path / "pulse.tdms", pulse))
    assert data.time_us is not None
    np.testing.assert_allclose(np.diff(data.time_us), 2.0)


def test_a_damaged_file_is_one_line(tmp_path):
    path = written(tmp_path / "iv.tdms", [("V_b", "V", BIAS), ("I_h", "A", CURRENT)])
    raw = path.read_bytes()
    for end in (5, 40, 100):
        path.write_bytes(raw[:end])
        with pytest.raises(InputError, match=r"iv\.tdms: "):
            read_measurement(path)
    # a length that no file could have
    path.write_bytes(raw.replace((4).to_bytes(8, "little"), (2**40).to_bytes(8, "little")))
    with pytest.raises(InputError, match=r"iv\.tdms: "):
        read_measurement(path)


def test_where_a_group_cannot_be_named_a_file_of_one_is_asked_for(tmp_path):
    pulse = [("t", "us", np.sort(BIAS)), ("V_b", "V", np.sort(BIAS))]
    path = written(tmp_path / "wave.tdms", pulse, pulse)
    with pytest.raises(InputError, match=r"'sweep 1'; expected a file of one group$"):
        read_waveform(path)
    assert read_waveform(written(tmp_path / "one.tdms", pulse)).volts[-1] == 8.25
