"""Measurement files on the command line: columns that are told, and what was understood."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from hotlever.lever import Lever
from hotlever.probe import Probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")

HELD = tuple(word for name in ("delta", "p", "a0", "a1") for word in ("--fix", name))
NAMES = ("--column", "I_h (uA)=Strom", "--column", "V_b=U")


@pytest.fixture(scope="module")
def curve(coarse: Lever):
    """A sweep of the reference lever."""
    return coarse.sweep(np.linspace(1.0, 9.0, 12))


@pytest.fixture
def data(curve, run) -> Path:
    """The sweep in a file with its laboratory's names, in the folder of the command."""
    rows = zip(curve.bias_V.values, 1e3 * curve.current_mA.values, strict=True)
    text = "".join(f"{bias:.5f};{current:.5f}\n".replace(".", ",") for bias, current in rows)
    path = Path("data.txt")
    path.write_bytes(f"Rs [kΩ];5,6\nU/V;Strom\n{text}".encode())
    return path


def test_fit_shows_what_it_understood_before_it_fits(run, data):
    status, out, err = run("fit", data, *NAMES, *HELD, "-o", "fit.json")
    assert status == 0, err
    table = err.splitlines()[:6]
    assert [line.split()[0] for line in table] == [
        *("data.txt", "V_b", "I_h", "R_s", "T_base", "medium"),
    ]
    assert "semicolons, decimal comma" in table[0]
    assert table[2].endswith("heater current, 'Strom' in uA")
    assert table[3].split() == ["R_s", "5600", "ohm", "line", "1"]
    assert "Strom" not in out
    truth = Probe.reference().material.n_d
    values = json.loads(Path("fit.json").read_text())["parameters"]
    assert values["n_d"]["value"] == pytest.approx(truth, rel=0.01)


def test_a_file_of_names_is_an_input(run, data):
    Path("names.txt").write_text("I_h (uA) = Strom\nV_b = U\n")
    status, _, err = run("fit", data, "--column", "names.txt", *HELD, "-o", "names.txt")
    assert (status, err) == (
        2,
        "hotlever: names.txt: is an input of this command, expected another name\n",
    )
    status, out, err = run("fit", data, "--column", "names.txt", *HELD)
    assert status == 0, err
    assert "inversion temperature" in out


def test_calibrate_takes_names_and_lever_voltages(run, curve):
    rows = zip(curve.lever_V.values, curve.current_mA.values, strict=True)
    text = "".join(f"{lever:.6f},{current:.6f}\n" for lever, current in rows)
    Path("data.csv").write_text(f"U (V),I (mA)\n{text}")
    status, _, err = run("calibrate", "data.csv", "--column", "V_l=U", "-o", "cal.json")
    assert status == 0, err
    assert re.search("^R_s +5600 ohm +of the probe$", err, re.M)
    table = json.loads(Path("cal.json").read_text())["table"]
    found = np.interp(
        curve.bias_V, *zip(*((row["bias_V"], row["tip_K"]) for row in table), strict=True)
    )
    np.testing.assert_allclose(found, curve.tip_K, atol=15)


@pytest.mark.slow
def test_many_files_have_the_same_names_and_a_fit_by_other_names_is_made_anew(run, data):
    Path("other.txt").write_bytes(data.read_bytes())
    Path("other.txt").write_text(data.read_text().replace("5,6", "5,60"))
    arguments = ("fit", data, "other.txt", *HELD, "-o", "fits")
    status, _, err = run(*arguments, *NAMES)
    assert status == 0, err
    assert "data.txt: up (12 rows); V_b 1 to 9 V; I_h " in err
    assert "2 of 2 levers have their fits from before" in run(*arguments, *NAMES)[2]
    status, _, err = run(*arguments, "--column", "I_h (nA)=Strom", "--column", "V_b=U")
    assert "from before" not in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--column", "I_h"), "I_h: no such file"),
        (("--column", "I_h (uA)=Storm"), "line 2: unknown column 'Storm': did you mean 'Strom'"),
        (("--column", "I_x (uA)=Strom"), "unknown quantity 'I_x': did you mean 'I_h'"),
        (("--column", "I_h (uA)=Strom", "--column", "Ih (A)=2"), "I_h is given twice"),
        ((), "line 2: column 'Strom' has no unit, expected 'I_h (mA)' or another unit"),
    ],
)
@pytest.mark.parametrize("command", ["fit", "calibrate"])
def test_columns_that_are_not_there_are_one_line(refused, data, command, arguments, message):
    assert message in refused(command, data, *arguments)


# --- values of a probe file -----------------------------------------------------------------


def rows_of(out: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(out)))


@pytest.mark.parametrize(
    "settings",
    [
        ("n_d=5e17", "material.a0=9e-4"),
        ("circuit.series_resistance_ohm=5e3",),
        ("medium=air", "chip=true", "surface_gap_um=none"),
        ("medium=air", "surroundings.gas_conductivity=1.1"),
        ("tip.height_um=0.7", "half_angle_deg=15"),
        ("prior.n_d=±15%", "prior.dimensions=±2%"),
        ("shape=three-leg", "probe.gap_um=3.5", "reader_centre_um=none"),
        ("shape='u-shape'", "leg_width_um=6", "gap_um=6"),
    ],
)
def test_every_key_of_a_probe_file_can_be_set(run, settings):
    words = [word for setting in settings for word in ("--set", setting)]
    status, out, err = run("sweep", "--bias", "5:5:1", *words)
    assert (status, err) == (0, "")
    assert 290 < float(rows_of(out)[0]["tip_K"]) < 700


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("chip=yes", "--set chip: found 'yes', expected true or false"),
        ("medium=water", "medium = 'water': expected 'vacuum' or 'air'"),
        ("shape=v", "unknown shape 'v'"),
        ("shape=u-shape", "[probe]: leg_width_um is missing"),
        ("n_d=none", "--set n_d: found 'none', expected a number"),
        ("n_d=true", "--set n_d: found 'true', expected a number"),
        ("tip.hight_um=1", "unknown name 'hight_um': did you mean 'height_um'"),
        ("tpi.height_um=1", "unknown section 'tpi': did you mean 'tip'"),
        ("material.gap_um=1", "unknown name 'gap_um'"),
        ("half_angle_deg=15", "[tip]: height_um is missing"),
        ("prior.n_d=15", "n_d = '15', expected a value and its spread"),
        ("prior.nd=±15%", "unknown prior 'nd': did you mean 'n_d'"),
        ("leg_width_um=6", "unknown key 'leg_width_um'"),
        ("a.b.c=1", "unknown section 'a.b'"),
        ("=1", "unknown name ''"),
    ],
)
def test_settings_that_cannot_be_are_one_line(refused, setting, message):
    assert message in refused("sweep", "--bias", "5:5:1", "--set", setting)
