"""Kinds of material: laws against their sources, exact derivatives, calm beyond their range."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from test_silicon import BEYOND, TEMPERATURES, numerical_derivative

from hotlever.errors import InputError
from hotlever.materials import KINDS, PARAMETERS, published
from hotlever.materials.departures import DEPARTURES, PROFILE, SmoothFactor, departure_of
from hotlever.materials.heat import thermal_conductivity_of_layer
from hotlever.materials.kinds import LowDopedSilicon, PSilicon
from hotlever.materials.presets import PRESETS, material_of
from hotlever.materials.silicon import (
    band_gap,
    band_gap_p,
    conductivity_p,
    hole_mobility,
    inversion_temperature,
)
from hotlever.studies.simulation_based_calibration import MinimosSilicon

OPTION_III = published("option III").material
#: One material of each kind, and of each choice that a kind offers.
SECTIONS = {
    "n-silicon": {"kind": "n-silicon", "impurity_exponent": 0.4, "intrinsic_scale": 1.2},
    "n-silicon, thin": {"kind": "n-silicon", "c_kappa": "thickness"},
    "n-silicon, departing": {
        "kind": "n-silicon",
        "kappa_1": 1.0,
        "kappa_3": -1.0,
        "n_i_1": -1.0,
        "n_i_2": 0.5,
        "intrinsic_scale": 1.2,
        "mobility_1": 0.8,
        "mobility_2": -1.3,
        "mobility_3": 0.4,
    },
    "p-silicon, departing": {"kind": "p-silicon", "n_i_2": 1.0, "mobility_1": -1.0},
    "high-doped-silicon, departing": {
        "kind": "high-doped-silicon",
        "kappa_2": 1.0,
        "legs_1": -0.7,
        "legs_3": 1.5,
    },
    "p-silicon": {"kind": "p-silicon", "impurity_exponent": 0.4, "intrinsic_scale": 0.8},
    "high-doped-silicon": {"kind": "high-doped-silicon"},
    "metal-film": {"kind": "metal-film", "preset": "Pd", "tcr": 2.1e-3},
    "metal-film, given κ": {"kind": "metal-film", "preset": "NiCr", "kappa": 0.11},
    "dielectric": {"kind": "dielectric", "preset": "SiN"},
}
MATERIALS = {name: material_of(values, name) for name, values in SECTIONS.items()}
DOPING, THICKNESS = 5.75e17, 0.3


def of_row(row, evaluated):
    """One of the two properties that a law of thermoelectricity gives."""
    values, partials = evaluated
    return values[row], {name: each[row] for name, each in partials.items()}


def off(found, expected, rel, absolute):
    """By how much each value is off, as a share of what it may be."""
    allowed = np.maximum(rel * np.abs(expected), absolute)
    return np.abs(found - expected) / np.maximum(allowed, 1e-300)


@pytest.mark.parametrize("name", MATERIALS)
def test_all_properties_have_exact_derivatives_by_all_that_they_depend_on(name):
    kind, T = MATERIALS[name], np.array([*TEMPERATURES, *BEYOND])
    laws = {
        "heat": lambda kind, T, n, t: kind.thermal_conductivity(T, t),
        "charge": lambda kind, T, n, t: kind.electrical_conductivity(T, n),
        "held": lambda kind, T, n, t: kind.enthalpy(T),
        "beta": lambda kind, T, n, t: of_row(0, kind.thermoelectric(T, n, "electron")),
        "gamma": lambda kind, T, n, t: of_row(1, kind.thermoelectric(T, n, "hole")),
        "radiated": lambda kind, T, n, t: kind.emission(T, 293.0),
    }
    found, at = set(), (DOPING, THICKNESS)
    for law in laws.values():
        value, partials = law(kind, T, *at)
        found |= set(partials)
        slope = numerical_derivative(lambda T, law=law: law(kind, T, *at)[0], T, 1e-3)
        assert (off(partials["T"], slope, 2e-6, 1e-9 * np.abs(value)) < 1.0).all()
        for parameter in kind.parameters:
            number = getattr(kind, parameter)

            def varied_law(x, law=law, parameter=parameter):
                return law(kind.model_copy(update={parameter: x}), T, *at)[0]

            slope = numerical_derivative(varied_law, number, 1e-3 * (number or 1.0))
            expected = partials.get(parameter, 0.0)
            departure, mode = departure_of(parameter) or (None, 0)
            if isinstance(departure, SmoothFactor):
                expected = partials.get(departure.law, 0.0) * departure.modes(T)[mode]
            assert (off(expected, slope, 1e-6, 1e-12 * np.abs(value)) < 1.0).all(), parameter
        for place, other in enumerate(("n", "thickness_um")):
            step = 1e-3 * at[place]

            def away(x, law=law, place=place):
                return law(kind, T, *(*at[:place], x, *at[place + 1 :]))[0]

            slope = numerical_derivative(away, at[place], step)
            assert (off(partials.get(other, 0.0), slope, 1e-5, 1e-12) < 1.0).all(), other
    # what counts in the taper alone is no argument of a law
    in_taper = {"n_d", "delta", "n_hd", *PROFILE.names}
    depends = found | {name for law in found & set(DEPARTURES) for name in DEPARTURES[law].names}
    assert set(kind.parameters) - depends <= in_taper


@pytest.mark.parametrize("name", MATERIALS)
def test_every_law_states_range_and_source(name):
    for law in MATERIALS[name].laws:
        low, high = law.temperature_range
        assert 100 < low < 300 < 700 < high
        assert len(law.source) > 4


@given(st.floats(-1e9, 1e9), st.sampled_from(sorted(MATERIALS)))
@example(5e-324, sorted(MATERIALS)[0])
def test_laws_are_finite_and_not_negative_at_any_temperature(T, name):
    kind, T = MATERIALS[name], np.array([T])
    for value, partials in (
        kind.thermal_conductivity(T, THICKNESS),
        kind.electrical_conductivity(T, DOPING),
    ):
        assert np.isfinite(value).all()
        assert np.all(value > 0) or not kind.conducts
        assert all(np.isfinite(partial).all() for partial in partials.values())


@given(st.floats(-5e-4, 5e-3), st.floats(100.0, 1800.0))
def test_a_metal_keeps_a_positive_resistivity_with_any_coefficient(tcr, T):
    film = material_of({"kind": "metal-film", "resistivity": 2e-5, "tcr": tcr}, "here")
    assert film.electrical_conductivity(np.array([T]), 0.0)[0] > 0
    assert film.thermal_conductivity(np.array([T]), 0.0)[0] > 0


# --- boron ------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", np.geomspace(1e15, 1e20, 26))
def test_resistivity_of_boron_doped_silicon_gives_back_the_doping(n):
    """ASTM F723 states doping by resistivity too, a fit of its own to the data of Thurber et al.

    Both agree within 3 %, by the standard.
    """
    rho = 1.0 / conductivity_p(296.0, n, 2.2)[0]
    doping = 1.330e16 / rho + 1.082e17 / (rho * (1.0 + (54.5 * rho) ** 1.105))
    assert doping == pytest.approx(n, rel=0.03)


@pytest.mark.parametrize("T", [300.0, 400.0, 500.0])
@pytest.mark.parametrize("n", [1e16, 1e17, 1e18, 1e19, 1e20])
def test_hole_mobility_goes_with_the_temperature_as_aroras(T, n):
    """Arora et al. state 13 % from 250 to 500 K; boron that is not ionised adds to the difference.

    J. C. Arora, J. R. Hauser and D. J. Roulston, IEEE Trans. Electron Devices 29, 292 (1982).
    """
    hot = T / 300.0
    impurities = 0.88 * n / (2.35e17 * hot**2.4) * hot**-0.146
    arora = 54.3 * hot**-0.57 + 1.36e8 * T**-2.23 / (1.0 + impurities)
    assert hole_mobility(T, n, 2.23)[0] == pytest.approx(arora, rel=0.21)


def test_the_gap_of_boron_doped_silicon_narrows_by_what_was_published():
    """6.92 meV (ln 2.04 + √(ln² + 0.5)) at 10¹⁸ cm⁻³, nothing at low doping."""
    narrowing = band_gap(300.0, 0.0)[0] - band_gap_p(300.0, np.array([1e13, 1.3e17, 1e18]))[0]
    log = np.log(1e18 / 1.3e17)
    assert narrowing[0] == pytest.approx(0.0, abs=2e-4)
    assert narrowing[1] == pytest.approx(6.92e-3 * np.sqrt(0.5))
    assert narrowing[2] == pytest.approx(6.92e-3 * (log + np.hypot(log, np.sqrt(0.5))))


def test_boron_doped_silicon_has_an_inversion_temperature():
    T = np.linspace(500.0, 1200.0, 70001)
    found = inversion_temperature(5e17, 2.5, conductivity=conductivity_p)
    assert found == pytest.approx(T[conductivity_p(T, 5e17, 2.5)[0].argmin()], abs=0.02)
    assert MATERIALS["p-silicon"].inversion_temperature() == pytest.approx(
        inversion_temperature(OPTION_III.n_d, 2.23, 0.4, 0.8, conductivity_p)
    )


def test_a_law_of_ones_own_has_its_own_inversion_temperature():
    """It was that of the kind that the class is made of, two kelvins off here."""
    silicon = MinimosSilicon(**MATERIALS["n-silicon"].model_dump(exclude={"kind"}))
    T, n = np.linspace(500.0, 1200.0, 70001), np.array([silicon.n_d, 2e17])
    coldest = [T[silicon.electrical_conductivity(T, each)[0].argmin()] for each in n]
    assert silicon.inversion_temperature(n) == pytest.approx(coldest, abs=0.02)
    # of samples of a posterior, all at once
    several = silicon.model_copy(update={"p": np.array([2.4, 2.65]), "n_d": n})
    one = silicon.model_copy(update={"p": 2.65, "n_d": 2e17})
    assert several.inversion_temperature()[1] == pytest.approx(one.inversion_temperature())


# --- thin layers, metals, dielectrics ---------------------------------------------------------


def test_a_layer_conducts_as_the_integral_of_fuchs_and_sondheimer_says():
    """Averaged over the layer: carriers that leave a surface count less within a mean free path."""
    from scipy.integrate import dblquad

    from hotlever.materials.heat import thermal_conductivity

    depth = 0.4 / 0.3

    def lost(z, cosine):
        both = np.exp(-z / cosine) + np.exp(-(depth - z) / cosine)
        return 0.75 * (1 - cosine**2) * both / depth

    missing, _ = dblquad(lost, 0.0, 1.0, 0.0, depth)
    bulk = thermal_conductivity(300.0)[0]
    found = thermal_conductivity_of_layer(300.0, 0.4)[0]
    assert found == pytest.approx(bulk * (1 - missing), rel=1e-6)
    assert thermal_conductivity_of_layer(300.0, 300.0)[0] == pytest.approx(bulk, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "at_400", "kappa"),
    [("Pt", 14.6, 71.6), ("Pd", 14.48, 71.8), ("Cr", 15.8, 93.9), ("Au", 3.107, 318.0)],
)
def test_presets_give_back_the_table(name, at_400, kappa):
    metal = material_of({"kind": "metal-film", "preset": name}, "here")
    rho = 1e6 / metal.electrical_conductivity(np.array([400.0]), 0.0)[0]
    assert rho == pytest.approx(at_400, rel=1e-4)
    found = 100 * metal.thermal_conductivity(np.array([300.0]), 0.0)[0]
    assert found == pytest.approx(kappa, rel=1e-3)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_makes_a_material_and_names_its_source(name):
    material = material_of({"kind": PRESETS[name].kind, "preset": name}, "here")
    for parameter, known in material.parameters.items():
        assert known.lower <= getattr(material, parameter) <= known.upper
    assert len(PRESETS[name].source) > 20


# --- sections of a probe file -----------------------------------------------------------------


def test_what_a_silicon_leaves_out_is_that_of_the_reference_probe():
    assert MATERIALS["n-silicon"].p == OPTION_III.p
    assert MATERIALS["high-doped-silicon"].a1 == OPTION_III.a1
    for kind, material in OPTION_III.kinds.items():
        assert material_of({"kind": material.kind}, kind) == material


def test_what_a_film_or_a_dielectric_leaves_out_of_its_emissivity_is_its_own():
    usual = {
        "metal-film": ({"resistivity": 1e-5, "tcr": 1e-3}, 0.1),
        "dielectric": ({"kappa": 0.03}, 0.15),
        "n-silicon": ({}, 0.2),
    }
    for kind, (values, emissivity) in usual.items():
        assert material_of({"kind": kind, **values}, "here").emissivity == emissivity
    assert material_of({"kind": "metal-film", "preset": "Pt"}, "here").emissivity == 0.1


def test_the_papers_material_has_each_parameter_of_its_two_kinds():
    kinds = OPTION_III.kinds.values()
    assert set(type(OPTION_III).model_fields) == {name for kind in kinds for name in kind.declared}
    for kind in kinds:
        assert {name: getattr(OPTION_III, name) for name in kind.declared} == {
            name: getattr(kind, name) for name in kind.declared
        }


def test_the_paper_varies_six_parameters_and_every_kind_its_own():
    assert list(PARAMETERS) == ["c_kappa", "delta", "n_d", "p", "a0", "a1"]
    for material in MATERIALS.values():
        assert set(material.usual) <= set(material.declared)
        assert isinstance(material, KINDS[material.kind])
    assert isinstance(MATERIALS["p-silicon"], PSilicon)
    assert isinstance(MATERIALS["n-silicon"], LowDopedSilicon)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({}, "here: kind is missing (one of: n-silicon, p-silicon"),
        ({"kind": "metal film"}, "unknown kind 'metal film': did you mean 'metal-film'?"),
        ({"kind": 3}, "unknown kind '3'"),
        ({"kind": "metal-film"}, "here: resistivity is missing"),
        ({"kind": "metal-film", "preset": "PT"}, "unknown preset 'PT': did you mean 'Pt'?"),
        ({"kind": "metal-film", "preset": "SiN"}, "unknown preset 'SiN'"),
        ({"kind": "metal-film", "preset": ["Pt"]}, "unknown preset"),
        ({"kind": "n-silicon", "preset": "Pt"}, "n-silicon has no presets"),
        ({"kind": "metal-film", "preset": "Pt", "tcrr": 1e-3}, "unknown key 'tcrr': did you mean"),
        ({"kind": "metal-film", "preset": "Pt", "tcr": 0.1}, "tcr = 0.1: expected at most"),
        ({"kind": "dielectric", "kappa": -1.0}, "kappa = -1: expected at least"),
        ({"kind": "n-silicon", "n_d": 1e25}, "n_d = 1e+25: expected at most"),
        ({"kind": "p-silicon", "a0": 1e-3}, "unknown key 'a0'"),
        (
            {"kind": "n-silicon", "c_kappa": "thicknes"},
            "c_kappa = 'thicknes': expected a number",
        ),
        ({"kind": "n-silicon", "c_kappa": -1.0}, "here: c_kappa = -1: expected at least"),
    ],
)
def test_bad_sections_are_refused_in_one_line(values, text):
    with pytest.raises(InputError) as error:
        material_of(values, "here")
    assert text in str(error.value)
    assert "\n" not in str(error.value)
