"""Probe files: round trip, defaults, and errors that name the key."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hotlever.errors import InputError
from hotlever.materials.kinds import MetalFilm
from hotlever.probe import Probe, ThreeLeg
from of_materials import metal_film_probe, metal_film_sections

CONTRACT = """
[probe]
shape = "three-leg"            # "u-shape" too; more later
length_um = 54.4                # base to front edge
centre_leg_width_um = 6.44
outer_leg_width_um = 3.46
gap_um = 3.2
bridge_width_um = 3.82
heater_length_um = 4.0
heater_width_um = 1.645
thickness_um = 0.4
reader_length_um = 4.0

[circuit]
series_resistance_ohm = 5600
base_temperature_K = 293

[material]
c_kappa = 0.686
delta = 0.647
n_d = 5.75e17
p = 2.65
a0 = 9.34e-4
a1 = 1.11e-6
n_hd = 2.2e20
"""


def read(tmp_path, text):
    path = tmp_path / "probe.toml"
    path.write_text(text, encoding="utf-8")
    return Probe.from_file(path)


def test_the_file_of_the_contract_is_the_reference_probe(tmp_path):
    assert read(tmp_path, CONTRACT) == Probe.reference()


@pytest.mark.parametrize("probe", [Probe.reference(), Probe.u_shape()], ids=["three", "u"])
def test_written_file_reads_back_the_same_and_comments_every_key(tmp_path, probe):
    text = probe.to_toml()
    assert read(tmp_path, text) == probe
    entries = [line for line in text.splitlines() if "=" in line and not line.startswith("#")]
    assert all("#" in line for line in entries if "shape" not in line)
    assert set(tomllib.loads(text)) == {"probe", "circuit", "material", "surroundings"}


def test_left_out_sections_take_the_reference_values(tmp_path):
    text = CONTRACT.split("[circuit]")[0] + "[material]\nn_d = 4e17\n"
    probe = read(tmp_path, text)
    assert probe.circuit == Probe.reference().circuit
    assert probe.material == Probe.reference().material.with_(n_d=4e17)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "gap_um",
            "gapp_um",
            r"probe.toml: \[probe\]: unknown key 'gapp_um': did you mean 'gap_um'",
        ),
        ("gap_um = 3.2", "", r"\[probe\]: gap_um is missing"),
        (
            "gap_um = 3.2",
            "gap_um = -1",
            r"\[probe\]: gap_um = -1: expected at least 0.05",
        ),
        ("gap_um = 3.2", 'gap_um = "a"', r"gap_um = 'a': expected a number"),
        ('"three-leg"', '"three-legs"', r"unknown shape 'three-legs': did you mean 'three-leg'"),
        ("[circuit]", "[circus]", r"unknown section 'circus': did you mean 'circuit'"),
        (
            "heater_length_um = 4.0",
            "heater_length_um = 60",
            r"heater_length_um = 63.82 must be less",
        ),
        ("reader_length_um = 4.0", "reader_length_um = 40", r"the reader .* must lie between"),
        ("heater_width_um = 1.645", "heater_width_um = 20", r"must be less than the 12.84 µm"),
        ("= 293", "= 20", r"base_temperature_K = 20: expected at least 250"),
        (
            "= 5600",
            "= -5",
            r"series_resistance_ohm = -5: expected at least 0",
        ),
        ("= 3.2", "= = 3.2", r"probe.toml: not valid TOML: .*line 7"),
        ("n_d = 5.75e17", "n_d = nan", r"n_d = nan: expected a finite number"),
        ("gap_um = 3.2", "gap_um = true", r"gap_um = True: expected a number"),
    ],
)
def test_errors_name_the_place_and_what_is_expected(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, CONTRACT.replace(old, new, 1))
    assert "\n" not in str(caught.value)


def test_missing_file_is_one_line(tmp_path):
    with pytest.raises(InputError, match=r"nothing.toml: no such file"):
        Probe.from_file(tmp_path / "nothing.toml")


def test_a_resistivity_stays_above_zero_down_to_the_base():
    metallic = {"a0": 1e-4, "a1": 1e-5}
    assert Probe.reference().with_(**metallic, base_temperature_K=300).material.a1 == 1e-5
    with pytest.raises(InputError, match=r"resistivity of -0.0004 Ω cm at 250 K, expected more"):
        Probe.reference().with_(**metallic, base_temperature_K=250)


def test_with_values_reaches_every_section_and_answers_a_typo():
    probe = Probe.reference().with_(
        a0=1e-3, series_resistance_ohm=0, gap_um=4.0, reader_centre_um=30.0
    )
    assert isinstance(probe.shape, ThreeLeg)
    assert (probe.material.a0, probe.circuit.series_resistance_ohm) == (1e-3, 0)
    assert (probe.shape.gap_um, probe.shape.reader_centre_um) == (4.0, 30.0)
    with pytest.raises(InputError, match="did you mean 'c_kappa'"):
        probe.with_(ckappa=1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = " + "[\n" * 5000, "not valid TOML: nested too deeply"),
        (".".join("a" * 50_000) + " = 1", "line 1: 100003 characters, expected at most 1000"),
        ("probe = " + "9" * 900, r"\[probe\] must be a section, found 9999.*…"),
        (CONTRACT.replace("gap_um", "length_um"), "not valid TOML: .*overwrite"),
        (CONTRACT.replace("[probe]", "[[probe]]"), r"\[probe\] must be a section, found \["),
        ("#" * 999 + "\n" + "#\n" * 1_000_000, "larger than the 1 MB"),
        ('"\\ud800" = 1', "not valid TOML"),
    ],
)
def test_files_made_to_break_a_reader_are_one_short_line(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, text)
    assert len(str(caught.value)) < 300


@given(st.data())
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_changed_in_a_file_it_is_a_probe_or_one_line_says_why(tmp_path, data):
    text = Probe.reference().to_toml()
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        stop = start + data.draw(st.integers(0, 12))
        wild = st.text(max_size=8) | st.sampled_from(["=", "[", "1e400", "nan", '"""', "{"])
        text = text[:start] + data.draw(wild) + text[stop:]
    path = tmp_path / "probe.toml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))

    def outcome() -> str:
        try:
            return str(Probe.from_file(path).shape.shape)
        except InputError as error:
            return str(error)

    assert 0 < len(outcome()) < 500


def test_a_tip_on_the_axis_is_at_zero_and_not_at_minus_zero(run, tmp_path):
    sections = metal_film_sections()
    sections["probe"]["tip_um"] = [56.0, -0.0]
    Probe.from_sections(sections, "test").to_file(tmp_path / "lever.toml")
    assert "tip at (56, 0) µm" in run("probe", "show", tmp_path / "lever.toml")[1]


def test_another_preset_takes_the_place_of_what_the_former_gave():
    """The name changed alone, and the film stayed palladium."""
    sections = metal_film_sections()
    film = {**sections["materials"]["film"], "preset": "Au"}
    sections["materials"] = {**sections["materials"], "film": film}
    gold = Probe.from_sections(sections, "test")
    palladium = metal_film_probe()
    assert palladium.with_(**{"film.preset": "Au"}) == gold
    assert palladium.with_material("film", MetalFilm, preset="Au") == gold
    # what is said with it counts, if it is what palladium has too
    melts = palladium.materials["film"].melting_point_K
    changed = palladium.with_(**{"film.melting_point_K": melts, "film.preset": "Au"})
    assert changed.materials["film"].melting_point_K == melts
    assert changed.materials["film"].heat_capacity == gold.materials["film"].heat_capacity


def test_what_no_drawing_has_is_refused_before_one_is_saved(tmp_path):
    probe = Probe.reference().with_(**{"prior.dimensions": "± 2%"})
    with pytest.raises(InputError, match=r"lever\.toml: \[prior\]: dimensions: edges of a"):
        probe.to_file(tmp_path / "lever.toml", drawing=tmp_path / "lever.gds")
    assert list(tmp_path.iterdir()) == []
