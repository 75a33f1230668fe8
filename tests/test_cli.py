"""The command line: the contract's commands, exit statuses and one-line errors."""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from hotlever import __version__
from hotlever.errors import ComputationError
from hotlever.probe import Probe
from hotlever.tasks.parsing import parse_bias, parse_frequencies, parse_settings
from of_materials import p_type_probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")

EXAMPLE = Path(__file__).parents[1] / "src" / "hotlever" / "examples" / "lever-a.csv"


def test_the_module_is_the_command():
    done = subprocess.run([sys.executable, "-m", "hotlever", "--version"], capture_output=True)
    assert (done.returncode, done.stdout.decode()) == (0, f"{__version__}\n")


def test_help_and_version(run):
    status, out, _ = run("--help")
    assert status == 0
    for command in ("probe", "sweep", "fit", "reproduce"):
        assert command in out
    assert run("--version")[:2] == (0, f"{__version__}\n")
    assert run()[0] == 0


def test_probe_new_writes_the_reference_probe(run, tmp_path):
    assert run("probe", "new", "-o", "probe.toml")[0] == 0
    assert Probe.from_file(tmp_path / "probe.toml") == Probe.reference()
    status, out, _ = run("probe", "new", "--shape", "u-shape")
    assert status == 0
    assert 'shape = "u-shape"' in out


def test_probe_show_describes_and_draws(run, tmp_path):
    run("probe", "new", "-o", "probe.toml")
    status, out, _ = run("probe", "show", "probe.toml", "--plot", "probe.svg")
    assert status == 0
    assert "three-leg, 0.4 µm thick" in out
    assert "831.3 K" in out
    plain = (tmp_path / "probe.svg").stat().st_size
    assert plain > 1000
    run("probe", "show", "probe.toml", "--plot", "probe.svg", "--mesh")
    assert (tmp_path / "probe.svg").stat().st_size > 1.5 * plain


def test_probe_show_says_all_that_a_probe_file_says(run, tmp_path):
    probe = Probe.u_shape().with_(
        **{"tip.height_um": 0.7, "tip.apex_radius_um": 0.03},
        medium="air",
        surface_gap_um=0.7,
        sample="glass",
        radiation=True,
    )
    (tmp_path / "lever.toml").write_text(f'{probe.to_toml()}[prior]\nn_d = "×/ 3"\n')
    _, out, _ = run("probe", "show", "lever.toml")
    for line in (
        *("tip: height_um 0.7, half_angle_deg 20, apex_radius_um 0.03,", "contact: sample glass"),
        *("surroundings: medium air, surface_gap_um 0.7", "physics: ", "prior: n_d ×/ 3"),
    ):
        assert f"\n{line}" in out
    assert "surroundings" not in run("probe", "show")[1]


def test_materials_are_listed_and_drawn(run, refused, tmp_path):
    status, out, _ = run("materials", "--plot", str(tmp_path / "materials.svg"))
    assert status == 0
    for word in ("p-silicon", "lorenz_ratio", "Ω cm", "Thurber", "290 to 1300 K", "SiO2", "Matula"):
        assert word in out
    assert "W m" in (tmp_path / "materials.svg").read_text(encoding="utf-8")
    assert "did you mean 'materials'" in refused("material")


def test_materials_of_a_probe_are_listed_as_they_stand(run, tmp_path):
    (tmp_path / "rho.csv").write_text("T (K),resistivity (Ohm cm)\n250,1e-5\n900,3e-5\n")
    text = EXAMPLE.with_name("palladium-on-nitride.toml").read_text(encoding="utf-8")
    for number, law in {
        "resistivity = 2e-5": 'resistivity = "rho.csv"',
        "tcr = 2e-3": "seebeck = -9.5",
        'preset = "SiN"': 'kappa = "k300 * (T/300)**0.33"\nk300 = 0.031',
    }.items():
        assert number in text
        text = text.replace(number, law)
    (tmp_path / "p.toml").write_text(text, encoding="utf-8")
    plot = tmp_path / "m.svg"
    status, out, err = run("materials", str(tmp_path / "p.toml"), "--plot", str(plot))
    assert status == 0, err
    nitride, film = out.split("film: metal-film\n")
    assert nitride.startswith("nitride: dielectric\n")
    (seebeck,) = [line.split() for line in film.splitlines() if "seebeck" in line]
    assert seebeck[:6] == ["seebeck", "µV", "K⁻¹", "-100", "100", "-9.5"]
    assert "resistivity (Ω cm), table rho.csv, monotone cubic (PCHIP); 250 to 900 K" in film
    assert "kappa (W cm⁻¹ K⁻¹), formula k300 * (T/300)**0.33; " in nitride
    (constant,) = [line.split() for line in nitride.splitlines() if line.startswith("  k300 ")]
    assert constant[2:4] == ["0.0062", "0.155"]
    assert "0.031" in constant
    assert "p-silicon" not in out
    assert "film" in plot.read_text(encoding="utf-8")


def test_values_of_materials_are_set_by_name(run, refused, tmp_path):
    p_type_probe().to_file(tmp_path / "p.toml")
    sweep = ("sweep", str(tmp_path / "p.toml"), "--bias", "3:3:1")
    found = []
    for setting in ("hot.n_d=2e18", "hot.n_d=1e18", "legs.c_kappa=thickness"):
        status, out, err = run(*sweep, "--set", setting)
        assert status == 0, err
        found.append(float(out.splitlines()[1].split(",")[4]))
    assert len(set(found)) == 3
    for setting, hint in (("hot.nd=1e18", "'n_d'"), ("hott.n_d=1e18", "'hot'")):
        assert f"did you mean {hint}" in refused(*sweep, "--set", setting)


def test_sweep_prints_csv(run):
    status, out, _ = run("sweep", "--bias", "1:11:3")
    assert status == 0
    rows = list(csv.DictReader(io.StringIO(out)))
    assert [float(row["bias_V"]) for row in rows] == [1, 6, 11]
    assert 1150 < float(rows[-1]["tip_K"]) < 1250


def test_a_range_may_be_a_single_value_and_no_rounding_is_taken_for_a_bias():
    assert parse_bias("200mV").tolist() == [0.2]
    assert parse_bias("-0.3:0.3:7", -np.inf)[3] == 0.0
    assert parse_frequencies("10kHz").tolist() == [1e4]


def test_sweep_writes_files_plot_and_fields(run, tmp_path):
    status, out, _ = run(
        "sweep", "--bias", "5:5:1", "--set", "c_kappa=0.7", "--set", "gap_um=3.5",
        "-o", "a.nc", "--plot", "a.png", "--fields", "fields",
    )  # fmt: skip
    assert (status, out) == (0, "")
    with xr.open_dataset(tmp_path / "a.nc") as data:
        assert json.loads(data.attrs["material"])["c_kappa"] == 0.7
        assert json.loads(data.attrs["probe"])["gap_um"] == 3.5
    assert (tmp_path / "a.png").exists()
    assert [path.name for path in (tmp_path / "fields").iterdir()] == ["bias_005.0000V.vtu"]


def test_sweep_that_ends_early_writes_what_it_reached(run, tmp_path):
    status, _, err = run(
        "sweep", "--bias", "1:5:5", "--set", "series_resistance_ohm=0", "-o", "a.csv"
    )
    assert status == 1
    assert "branch of a slow bias ramp ends at a bias of 3.07" in err
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 4


def test_fit_prints_writes_and_reports(run, tmp_path):
    status, out, err = run(
        "fit", EXAMPLE, "--fix", "n_d=4.6e17", "--fix", "p", "-o", "fit.json", "--report", "report"
    )
    assert status == 0, err
    assert "inversion temperature" in out
    assert "fixed" in out
    content = json.loads((tmp_path / "fit.json").read_text())
    assert content["parameters"]["n_d"] == {
        "value": 4.6e17,
        "stderr": None,
        "unit": "cm⁻³",
        "vary": False,
    }
    page = (tmp_path / "report" / "index.html").read_text()
    assert page.count("<img") == 5


def test_a_fit_is_written_even_if_its_posterior_cannot_be_sampled(run, tmp_path, monkeypatch):
    def fails(*_, **__):
        raise ComputationError("no start found")

    monkeypatch.setattr("hotlever.estimate.uncertainty.sample_posterior", fails)
    options = ("--observables", "current", "--fix", "delta", "--fix", "p", "--fix", "a0")
    status, out, err = run(
        "fit", EXAMPLE, *options, "--posterior", "-o", "fit.json", "--report", "report"
    )
    assert status == 1
    assert err.strip().endswith("hotlever: no start found")
    assert "inversion temperature" in out
    assert "posterior" not in json.loads((tmp_path / "fit.json").read_text())
    assert (tmp_path / "report" / "index.html").exists()


@pytest.mark.slow
def test_fit_samples_and_profiles(run, tmp_path):
    rows = EXAMPLE.read_text().splitlines()
    (tmp_path / "data.csv").write_text("\n".join(rows[:5] + rows[5::3]) + "\n")
    status, out, err = run(
        "fit", "data.csv", "--fix", "delta", "--fix", "n_d", "--fix", "a1",
        "--posterior", "--samples", "100", "--profiles", "--report", "report", "-o", "fit.json",
    )  # fmt: skip
    assert status == 0, err
    assert "profile likelihood" in out
    assert "is not settled" in err
    content = json.loads((tmp_path / "fit.json").read_text())
    for name in ("c_kappa", "p"):
        low, high = content["profiles"][name]["interval"]["95"]
        assert low < content["parameters"][name]["value"] < high
        # with noise of its own for each observable it lies beside the optimum of the fit
        quantiles = content["posterior"]["quantities"][name]["quantiles"]
        assert low < quantiles["97.5"]
        assert quantiles["2.5"] < high
    assert "inversion_temperature" in content["posterior"]["quantities"]
    assert len(content["posterior"]["band"]["tip_K"]) == 5
    assert (tmp_path / "report" / "index.html").read_text().count("<img") == 8


def test_fit_notes_where_data_and_probe_differ(run, tmp_path):
    text = EXAMPLE.read_text().replace("5.6", "5.5", 1)
    (tmp_path / "data.csv").write_text(text)
    status, _, err = run(
        "fit", "data.csv", "--observables", "current",
        "--fix", "delta", "--fix", "p", "--fix", "a0", "--fix", "a1",
    )  # fmt: skip
    assert status == 0
    assert "the data file's 5500 is used, not the probe's 5600" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sweeep",), "unknown command 'sweeep': did you mean 'sweep'"),
        (("probe", "shwo"), "unknown command 'shwo': did you mean 'show'"),
        (("probe", "new", "--shape", "v"), "unknown shape 'v'"),
        (("probe", "show", "none.toml"), "none.toml: no such file"),
        (("probe", "show", "--plot", "a.txt"), "a.txt: unknown file type '.txt'"),
        (("probe", "new", "-o", "no/such/folder/a.toml"), "the folder no/such/folder does not"),
        (("sweep", "--bias", "1:11"), "expected START:STOP:COUNT"),
        (("sweep", "--bias", "x"), "found 'x', expected a number"),
        (("sweep", "--bias", "1:x:3"), "found 'x', expected a number"),
        (("sweep", "--bias", "1:11:0"), "COUNT is '0'"),
        (("sweep", "--bias", "1:11:1"), "expected START < STOP, or START = STOP with COUNT 1"),
        (("sweep", "--bias", "5:1:3"), "expected START < STOP"),
        (("sweep", "--set", "ckappa=1"), "did you mean 'c_kappa'"),
        # none of sixty names is alike: those that it ends come first
        (("sweep", "--set", "kind=x"), "'kind' (expected one of: circuit.supply.kind, circuit."),
        (("sweep", "--set", "c_kappa"), "expected NAME=VALUE"),
        (
            ("sweep", "--set", "c_kappa=high"),
            "--set c_kappa: found 'high', expected a number or thickness",
        ),
        (("sweep", "--set", "c_kappa=-1"), "expected at least 0.05"),
        (("sweep", "--medium", "water"), "--medium water: expected vacuum or air"),
        (("sweep", "-o", "a.xls"), "expected .csv or .nc"),
        (("sweep", "-o", "none/a.csv"), "the folder none does not exist"),
        (("sweep", "--plot", "a.bmp"), "unknown file type '.bmp'"),
        (("sweep", "--frobnicate"), "No such option: --frobnicate"),
        (("fit", "none.csv"), "none.csv: no such file"),
        (("fit",), "Missing argument"),
        (("fit", EXAMPLE, "--observables", "tpi"), "did you mean 'tip'"),
        (("fit", EXAMPLE, "--fix", "nd"), "did you mean 'n_d'"),
        (
            ("calibrate", EXAMPLE, "--samples", "200"),
            "--samples: goes with --posterior",
        ),
        (
            ("calibrate", EXAMPLE, "--table-by", "power"),
            "--table-by: goes with --table",
        ),
        (
            ("calibrate", EXAMPLE, "--table", "t.csv", "--table-by", ""),
            "unknown quantity ''",
        ),
        (
            ("design", "--minimise", "knee_K", "--within", "heater_length_um=3:6", "--at", ""),
            "--at",
        ),
        (
            ("fit", EXAMPLE, "--posterior", "--samples", "0"),
            "--samples 0: expected a number from 1",
        ),
        (("fit", EXAMPLE, "--weights", "error"), "did you mean 'errors'"),
        (("fit", EXAMPLE, "--scheduler", "tcp://a:1"), "--scheduler: expected several data"),
        (("fit", EXAMPLE, EXAMPLE, "--profiles"), "expected a single data file"),
        (("fit", EXAMPLE, "--fix", "n_d=a"), "--fix n_d: found 'a', expected a number"),
        (
            ["sweep", "--physics", "thermoelectrc"],
            "--physics: unknown effect 'thermoelectrc': did you mean 'thermoelectric'?",
        ),
        (
            ["sweep", "--physics", "radiation", "--set", "emissivity=2"],
            "emissivity = 2: expected at most 1",
        ),
        (["sweep", "--physics", "radiation", "--bias=-8:8:3"], "expected 0 <= START <= STOP"),
        (["contact", "--sample", "polimer"], "did you mean 'polymer'"),
        (["contact", "--sample", "polymer,100nm"], "--sample: nothing under 100nm of polymer"),
        (["contact", "--sample", "silicon", "--radius", "5m"], "--radius: found '5m'"),
        (["contact"], "--sample: found none"),
    ],
)
def test_bad_input_gets_one_line_and_status_two(refused, tmp_path, arguments, message):
    assert message in refused(*arguments)
    assert list(tmp_path.iterdir()) == []


def test_a_bad_request_leaves_an_existing_file_as_it_was(run, tmp_path):
    (tmp_path / "a.csv").write_text("mine")
    assert run("sweep", "--bias", "1:5:5", "--set", "heater_width_um=99", "-o", "a.csv")[0] == 2
    assert (tmp_path / "a.csv").read_text() == "mine"


@pytest.mark.slow
def test_reproduce_writes_the_page(run, tmp_path):
    status, out, err = run("reproduce", "--quick", "-o", "page")
    assert status == 0, err
    assert out.strip() == "page/index.html"
    page = (tmp_path / "page" / "index.html").read_text()
    for figure in ("probe", "iv", "temperature_power", "field_maps", "fit_data_and_model"):
        assert (tmp_path / "page" / f"{figure}.pdf").exists()
    assert "Published operating points" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("sweep", "boron-lever.toml", "--set", "n_d=1e17"), "'n_d': did you mean 'hot.n_d'?"),
        (("sweep", "--set", "leg_um=3"), "unknown name 'leg_um': did you mean 'leg_width_um'?"),
        (("sweep", "--set", "surface_gap_um=1"), "--set surface_gap_um: counts in air, and this"),
        (("sweep", "--set", "emissivity=0.3"), "off; expected --physics radiation too"),
        (
            ("sweep", "--set", "scattering_exponent=0", "--physics", "radiation"),
            "--set scattering_exponent: counts with an effect that is off",
        ),
        (("sweep", "--set", "medium=air", "--medium", "vacuum"), "it is what --medium states"),
        (("sweep", "--set", "radiation=true", "--physics", "none"), "it is what --physics states"),
        (("reader", "--set", "surface_gap_um=1"), "it is what --distance states"),
        (
            (
                *("contact", "--sample", "glass", "--set", "contact.sample=polymer"),
                *("--set", "tip.height_um=0.7"),
            ),
            "--set contact.sample: it is what --sample states",
        ),
        (
            ("design", "--minimise", "tip_K", "--at", "700K", "--within", "heater_width_um=1:2"),
            "--minimise tip_K: it is what --at 700K holds, expected another quantity",
        ),
        (
            ("design", "--minimise", "power_mW", "--at", "8V", "--within", "bias_V=1:2"),
            "--within bias_V: it is what --at 8V holds",
        ),
    ],
)
def test_what_would_do_nothing_or_is_not_there_is_refused(refused, arguments, words):
    known = {path.name: str(path) for path in EXAMPLE.parent.glob("*.toml")}
    assert words in refused(*(known.get(word, word) for word in arguments))


def test_a_number_that_may_also_be_a_word_is_set_as_a_number():
    probe = Probe.reference()
    assert parse_settings(["c_kappa=0.7"], probe) == {"c_kappa": 0.7}
    assert parse_settings(["c_kappa=thickness"], probe) == {"c_kappa": "thickness"}
