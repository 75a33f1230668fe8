"""Drawn levers of named materials and of stacks: solved as they should be, or refused."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from drawn import box, reference_points
from hotlever.errors import BranchEndError, InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.observables import by_parameter
from hotlever.lever.similar import SimilarLevers
from hotlever.lever3d import SolidLever
from hotlever.materials import HIGH_DOPED, published
from hotlever.probe import Probe
from of_materials import (
    FILM,
    NITRIDE,
    OUTLINE,
    TRACK,
    metal_film_probe,
    metal_film_sections,
    of_named_silicon,
    p_type_probe,
    silicon_with_a_film,
)

pytestmark = pytest.mark.usefixtures("coarse_meshes")

OPTION_III = published("option III").material
BIAS = [2.0, 7.22, 9.0]


# --- silicon ----------------------------------------------------------------------------------


def test_named_silicon_is_the_same_as_the_plain_form():
    plain = Probe.from_sections(reference_points(), "test")
    named = of_named_silicon("n-silicon", {}, {})
    assert not named.has_plain_silicon
    first, second = (Lever(one, COARSE).sweep(BIAS) for one in (plain, named))
    for name in ("current_mA", "reader_V", "tip_K", "heater_ohm", "legs_ohm"):
        np.testing.assert_allclose(second[name], first[name], rtol=1e-12)


def test_derivatives_of_named_silicon_add_up_to_those_of_the_plain_form():
    """c_κ is one number in the plain form, and two here."""
    plain = Lever(Probe.from_sections(reference_points(), "test"), COARSE)
    named = Lever(of_named_silicon("n-silicon", {}, {}), COARSE)
    x = plain.branch(700.0).x[:, 1:]
    pairs = {
        **{name: [f"hot.{name}"] for name in ("n_d", "delta", "p", "impurity_exponent")},
        **{name: [f"legs.{name}"] for name in ("a0", "a1", "n_hd")},
        "c_kappa": ["hot.c_kappa", "legs.c_kappa"],
        "thickness_um": ["thickness_um"],
    }
    dimensions = ("thickness_um",)
    first, second = (SimilarLevers(one).equations(one.probe, dimensions) for one in (plain, named))
    for name, several in pairs.items():
        expected = by_parameter(first, x, [name])[..., 0]
        found = by_parameter(second, x, several).sum(axis=2)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_a_reader_may_have_doping_of_its_own():
    sections = reference_points()
    sections["layers"]["reader"] = {"drawn": [sections["layers"]["reader"]], "material": "light"}
    sections["materials"] = {"light": {"kind": "n-silicon", "n_d": 1e17}}
    probe = Probe.from_sections(sections, "test")
    lever = Lever(probe, COARSE)
    films = {film.material: film for film in lever.space.films}
    assert films["light"].dopant_from == HIGH_DOPED
    laws = lever.equations.laws.films
    doping = {film.film.material: film.doping for film in laws if np.ndim(film.doping)}
    assert doping["light"].min() == pytest.approx(1e17, rel=0.1)
    assert doping["low-doped"].min() == pytest.approx(OPTION_III.n_d, rel=0.1)


def test_p_silicon_heats_and_has_a_knee():
    probe = p_type_probe()
    assert probe.heater_silicon is not None
    knee = Lever(probe, COARSE).knee()
    # above the inversion temperature, as the paper's levers have it
    inversion = float(probe.heater_silicon.inversion_temperature())
    assert 700.0 < inversion < knee.tip_K.item() < inversion + 150.0


def test_kappa_may_follow_from_the_thickness():
    """Thinner silicon conducts less than in proportion; the derivative knows both."""
    probe = of_named_silicon("n-silicon", {"c_kappa": "thickness"}, {"c_kappa": "thickness"})
    lever = Lever(probe, COARSE)
    x = lever.branch(700.0).x[:, -1:]
    equations = SimilarLevers(lever).equations(probe, ("thickness_um",))
    slope = equations.by_parameter(x, ["thickness_um"])[..., 0]
    step = 1e-4
    away = [
        Lever(probe.with_(thickness_um=0.4 + way * step), COARSE).equations.balance(x)
        for way in (1, -1)
    ]
    np.testing.assert_allclose(slope, (away[0] - away[1]) / (2 * step), rtol=1e-6, atol=1e-9)


# --- metal on a dielectric --------------------------------------------------------------------


@pytest.fixture(scope="module")
def film_lever() -> Lever:
    return Lever(metal_film_probe())


def test_where_nothing_conducts_there_is_no_potential(film_lever):
    space = film_lever.space
    layout = space.mesh.layout
    insulated = sum(region.area for region in layout.regions if region.insulates)
    assert insulated == pytest.approx(549.0)
    dofs = space.elements.dofs
    inside = np.setdiff1d(dofs[~space.conducting], dofs[space.conducting])
    assert inside.size > 100
    temperatures = int(space.is_temperature.sum())
    potentials = space.size - temperatures
    held = np.unique(np.concatenate(list(space.end_nodes.values())))
    conducts = np.unique(dofs[space.conducting])
    assert temperatures == space.elements.size - held.size
    assert potentials == conducts.size - np.intersect1d(held, conducts).size


def test_charge_and_energy_are_conserved_beside_an_insulator(film_lever):
    data = film_lever.sweep([0.1, 0.5, 0.8])
    np.testing.assert_allclose(data.ground_current_mA, data.current_mA, rtol=1e-9)
    np.testing.assert_allclose(data.end_heat_mW, data.power_mW, rtol=1e-6)
    # the track is all there is between the terminals
    np.testing.assert_allclose(data.heater_ohm, 1e3 * data.lever_V / data.current_mA, rtol=1e-7)
    assert np.isnan(data.legs_ohm).all()
    assert np.all(np.diff(data.heater_ohm) > 0)


NAMES = (
    *("film.resistivity", "film.tcr", "film.lorenz_ratio"),
    *("nitride.kappa", "nitride.kappa_exponent", "thickness_um"),
)


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_by_parameters_of_films_are_exact(film_lever, name):
    probe = film_lever.probe
    x = film_lever.branch(900.0).x[:, -2:]
    slope = SimilarLevers(film_lever).equations(probe, (name,)).by_parameter(x, [name])[..., 0]
    value = float(probe.values([name])[0])
    step = 1e-4 * value
    away = [
        Lever(probe.replace({name: value + way * step})).equations.balance(x) for way in (1, -1)
    ]
    change = (away[0] - away[1]) / (2 * step)
    np.testing.assert_allclose(slope, change, rtol=1e-6, atol=1e-7 * np.abs(change).max())


def test_a_lever_ends_where_its_film_melts_or_its_laws_do(film_lever):
    with pytest.raises(BranchEndError, match="the laws of 'film' end at a bias of"):
        film_lever.sweep([2.0])
    gold = metal_film_probe(
        materials={"film": {"kind": "metal-film", "preset": "Au"}, "nitride": NITRIDE}
    )
    with pytest.raises(BranchEndError, match="'film' melts at a bias of") as caught:
        Lever(gold, COARSE).sweep([5.0])
    assert caught.value.partial.tip_K.size == 0


def test_a_heater_of_its_own_layer_has_legs():
    sections = metal_film_sections()
    narrow = [[52, -4], [59, -4], [59, 4], [52, 4]]
    sections["layers"]["heater"] = {
        "drawn": [narrow],
        "material": "film",
        "thickness_um": 0.02,
    }
    probe = Probe.from_sections(sections, "test")
    assert [region.part for region in probe.layout().regions].count("heater") >= 1
    data = Lever(probe, COARSE).sweep([0.3])
    assert data.legs_ohm.item() > 0
    assert data.heater_ohm + data.legs_ohm == pytest.approx(
        (1e3 * data.lever_V / data.current_mA).item()
    )


# --- metal on silicon -------------------------------------------------------------------------


def test_a_film_on_a_leg_takes_its_resistance_away():
    plain = Lever(Probe.from_sections(reference_points(), "test"), COARSE).sweep([7.22])
    gilt = Lever(silicon_with_a_film(), COARSE).sweep([7.22])
    assert gilt.leg1_ohm.item() < 0.5 * plain.leg1_ohm.item()
    assert gilt.leg2_ohm.item() == pytest.approx(plain.leg2_ohm.item(), rel=0.1)


def test_a_heater_under_a_film_keeps_its_taper():
    """The film cuts the heater in two; both halves know both borders."""
    probe = silicon_with_a_film(drawn=[box(30, -5, 48.5, 5)])
    tapers = {r.taper for r in probe.layout().regions if r.name.startswith(("heater", "gold"))}
    plain = Probe.from_sections(reference_points(), "test").layout().heater.taper
    assert plain in tapers
    heaters = [r for r in probe.layout().regions if r.part == "heater"]
    assert [len(one.films) for one in heaters] == [0, 1] or [len(one.films) for one in heaters] == [
        1,
        0,
    ]
    assert {one.taper for one in heaters} == {plain}


# --- probe files ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "probe", [metal_film_probe(), p_type_probe(), silicon_with_a_film()], ids=["film", "p", "gilt"]
)
def test_a_probe_file_is_read_back(probe):
    text = probe.to_toml()
    assert Probe.from_sections(tomllib.loads(text), "again") == probe
    assert ("[material]" in text) == probe.has_plain_silicon


def test_values_of_materials_are_changed_by_name():
    probe = metal_film_probe()
    changed = probe.with_(**{"film.tcr": 1e-3, "nitride.kappa": 0.02, "thickness_um": 0.3})
    assert changed.values(["film.tcr", "nitride.kappa", "thickness_um"]).tolist() == [
        1e-3,
        0.02,
        0.3,
    ]
    assert probe.replace({"film.tcr": 1e-3}).materials["film"] == changed.materials["film"]
    with pytest.raises(InputError, match=r"did you mean 'tcr'"):
        probe.with_(**{"film.tcrr": 1e-3})
    with pytest.raises(InputError, match=r"did you mean 'film'"):
        probe.with_(**{"fim.tcr": 1e-3})


def changed(**sections):
    values = metal_film_sections()
    for name, entries in sections.items():
        values[name] = values[name] | entries
        values[name] = {key: one for key, one in values[name].items() if one is not None}
    return values


BODY, TRACKS = metal_film_sections()["layers"].values()
OTHER = {"kind": "metal-film", "preset": "Cr"}


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (changed(layers={"body": None}), r"\[layers\]: silicon is missing"),
        (changed(layers={"silicon": [OUTLINE]}), "silicon and body: expected one of them"),
        (changed(layers={"body": [OUTLINE]}), r"body: expected a section \[layers.body\]"),
        (changed(layers={"body": BODY | {"thickness_um": 0.4}}), r"stands in \[probe\]"),
        (changed(layers={"track": {"drawn": [TRACK]}}), r"\[layers.track\]: material is missing"),
        (changed(layers={"track": {"material": "film"}}), r"\[layers.track\]: drawn is missing"),
        (
            changed(layers={"track": TRACKS | {"material": "fim"}}),
            r"unknown material 'fim': did you mean 'film'",
        ),
        (changed(layers={"track": TRACKS | {"material": 3}}), "material = 3: expected a name"),
        (changed(layers={"track": TRACKS | {"thicknes": 1}}), "did you mean 'thickness_um'"),
        (changed(layers={"track": TRACKS | {"kind": "x"}}), "unknown key 'kind'"),
        (changed(layers={"track": TRACKS | {"thickness_um": 0}}), "thickness_um = 0"),
        (changed(layers={"heater": [TRACK]}), "heater: without a material it is low-doped"),
        (
            changed(layers={"track": TRACKS | {"drawn": [box(5, -24, 60, 24)]}}),
            "terminal 'supply'.*touches no conductor",
        ),
        (
            changed(layers={"track": TRACKS | {"drawn": [box(0, -24, 30, 24)]}}),
            "terminal 'ground'.*no conductor joins it",
        ),
        (
            changed(layers={"heater": {"drawn": [box(41, -1, 45, 1)], "material": "nitride"}}),
            "heater.*it conducts no current",
        ),
        (changed(materials={"other": OTHER}), r"\[materials.other\]: no layer is made of it"),
        (changed(materials={"film": OTHER | {"kind": "metl-film"}}), "did you mean 'metal-film'"),
        (changed(materials={"film": 3}), r"\[materials.film\] must be a section"),
        (changed(materials={"prior": OTHER}), "'prior' cannot be the name of a material"),
        (changed(materials={"a.b": OTHER}), "'a.b' cannot be the name of a material"),
        (changed(materials={"low-doped": OTHER}), "'low-doped' cannot be the name"),
        (metal_film_sections() | {"materials": {}}, r"there is no \[materials\]"),
        (metal_film_sections() | {"materials": 3}, r"\[materials\] must be a section"),
        (metal_film_sections() | {"layers": 3}, r"\[layers\] must be a section"),
        (metal_film_sections() | {"material": {"p": 2.0}}, r"\[material\]: no layer is made of it"),
        (
            {**Probe.reference().sections(), "materials": {"film": FILM}},
            r"\[materials.film\]: no layer is made of it",
        ),
    ],
)
def test_what_is_wrong_with_materials_is_said_in_one_line(sections, message):
    with pytest.raises(InputError, match=message) as caught:
        Probe.from_sections(sections, "probe.toml")
    text = str(caught.value)
    assert text.startswith("probe.toml")
    assert "\n" not in text


def test_low_doping_must_be_below_the_high_doping_beside_it():
    with pytest.raises(InputError, match=r"hot.n_d = 9e\+18 must be below legs.n_hd = 5e\+18"):
        of_named_silicon("p-silicon", {"n_hd": 5e18}, {"n_d": 9e18})


def test_the_full_3d_simulation_refuses_films():
    with pytest.raises(InputError, match=r"\[layers\]: the full 3-D simulation"):
        SolidLever(metal_film_probe())
