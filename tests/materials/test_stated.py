"""Laws that a probe file states by a table or a formula: their values, derivatives and refusals."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from hotlever.errors import InputError
from hotlever.materials.films import metal_conductivity
from hotlever.materials.kinds import Dielectric, MetalFilm
from hotlever.materials.presets import material_of, read_law
from hotlever.materials.stated import Formula, Table, parsed
from hotlever.piecewise import monotone_cubic
from hotlever.units import product_conversion

T = np.linspace(300.0, 1200.0, 37)


@given(
    st.lists(st.floats(1.0, 100.0), min_size=1, max_size=12),
    st.lists(st.floats(-10.0, 10.0), min_size=13, max_size=13),
)
def test_the_cubic_is_scipys(widths, values):
    x = np.cumsum([300.0, *widths])
    y = np.array(values[: x.size])
    at = np.linspace(x[0], x[-1], 101)
    ours = monotone_cubic(x, y)
    with np.errstate(over="ignore"):
        theirs = PchipInterpolator(x, y)
    np.testing.assert_allclose(ours(at), theirs(at), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(ours(at[1:-1], 1), theirs(at[1:-1], 1), rtol=1e-7, atol=1e-7)


FORMULAS = {
    "1.5 * (T/300)**-1.2": lambda T, a: 1.5 * (T / 300) ** -1.2,
    "a*exp(-T/500) + log(T)*tanh(T - 680)": lambda T, a: (
        a * np.exp(-T / 500) + np.log(T) * np.tanh(T - 680)
    ),
    "(1 + a*(T-293))**2 - sqrt(T)/3": lambda T, a: (1 + a * (T - 293)) ** 2 - np.sqrt(T) / 3,
    "T**a / (a + T)**3": lambda T, a: T**a / (a + T) ** 3,
    "sin(T/a)*cos(T/100) + atan(T)*pi": lambda T, a: (
        np.sin(T / a) * np.cos(T / 100) + np.arctan(T) * np.pi
    ),
    "-a + +T*log10(a)*sinh(a)/cosh(a)": lambda T, a: -a + T * np.log10(a) * np.tanh(a),
    "2**(T/300) * a**2 + a**(T/1000)": lambda T, a: 2 ** (T / 300) * a**2 + a ** (T / 1000),
}


@pytest.mark.parametrize("text", FORMULAS)
@pytest.mark.parametrize("a", [0.7, 1.9])
def test_a_formula_is_what_python_makes_of_it_with_exact_derivatives(text, a):
    law, code = Formula(formula=text), FORMULAS[text]
    value, by = law(T, {"a": a} if law.names else {})
    np.testing.assert_allclose(value, code(T, a), rtol=1e-13)
    # a complex step has no cancellation
    np.testing.assert_allclose(by["T"], code(T + 1e-30j, a).imag * 1e30, rtol=1e-9, atol=1e-14)
    if law.names:
        slope = code(T + 0j, a + 1e-30j).imag * 1e30
        np.testing.assert_allclose(by["a"], slope, rtol=1e-9, atol=1e-14)


REFUSED = {
    "150*T^2": r"character 6: \^ is no power, expected \*\*",
    "tnh(T)": "character 1: unknown function 'tnh': did you mean 'tanh'",
    "1,5*T": "found a comma, expected decimal points",
    "T +": "not a formula, expected one of T",
    "": "not a formula",
    "1.5": "a number in quotes",
    "T if T else 1": "cannot be in a formula",
    "T.real": "cannot be in a formula",
    "[T for T in T]": "cannot be in a formula",
    "exp(T, T)": "cannot be in a formula",
    "exp": "exp is a function, expected exp",
    "T + 'a'": "cannot be in a formula",
    "T * 1j": "cannot be in a formula",
    "T + 1" + "0" * 400: "too large",
    "__import__('os')": "cannot be in a formula|unknown function",
    "-" * 100 + "T": "nested too deeply",
    "(" * 400 + "T" + ")" * 400: "not a formula",
    "+".join(["T"] * 400): "nested too deeply or too long",
    "T" * 2000: "2000 characters, expected at most 1000",
    "T\0": "not a formula",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_formula_is_refused_in_one_line(text):
    with pytest.raises(ValueError, match=REFUSED[text]) as caught:
        parsed(text)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match=r"here: kappa"):
        material_of({"kind": "metal-film", "preset": "Pt", "kappa": text}, "here")


@given(st.text("T0123456789.+-*/() epxlogsqrt_a", max_size=60))
def test_no_text_does_more_than_be_refused(text):
    try:
        law = Formula(formula=text)
    except ValueError:
        return
    law.fault(dict.fromkeys(law.names, 1.0), (0.0, 1.0), "1", 300.0, 400.0)


@pytest.mark.parametrize(
    ("stated", "says"),
    [
        ({"kappa": "1/(T-500)"}, "kappa, .* is -0.004831 W cm⁻¹ K⁻¹ at 293 K, expected"),
        ({"kappa": "10.0**10.0**T"}, "is inf"),
        ({"kappa": "150*(T/300)"}, "is 146.5 W cm⁻¹ K⁻¹ at 293 K, expected 1e-05 to 50"),
        ({"resistivity": "1e-5*(1 - T/800)"}, "resistivity, .* is 9.394e-08 Ω cm at 792.5 K"),
        ({"resistivity": {"temperature_K": [300, 900], "values": [1e-5, 2e-5]}}, "begins at 300 K"),
        ({"resistivity": {"temperature_K": [200, 290], "values": [1e-5, 2e-5]}}, "ends at 290 K"),
    ],
)
def test_what_cannot_be_in_the_range_is_said(stated, says):
    reason = material_of({"kind": "metal-film", "preset": "Pt", **stated}, "").impossible(293.0)
    assert re.search(says, reason)


def test_one_row_of_a_table_that_cannot_be_is_found():
    """It was looked for at 401 temperatures, between which a wrong row may lie."""
    T = np.arange(290.0, 1291.0)
    values = np.where(T == 790.0, -1e-5, 1e-5)
    law = {"temperature_K": T.tolist(), "values": values.tolist()}
    film = material_of({"kind": "metal-film", "preset": "Pt", "resistivity": law}, "")
    assert "is -1e-05 Ω cm at 790 K" in film.impossible(293.0)


@pytest.mark.parametrize(
    ("section", "says"),
    [
        ({"resistivity": "a*T"}, "resistivity: unknown name 'a'.*other names need a value"),
        ({"resistivity": "1e-8*T", "tcr": 1e-3}, "tcr means nothing where resistivity is a law"),
        ({"kappa_scale": 1.1}, "kappa_scale means nothing where kappa is no law"),
        ({"kappa": 0.5, "lorenz_ratio": 1.2}, "lorenz_ratio means nothing where kappa is stated"),
        ({"kappa": "1e-3*T", "lorenz_ratio": 1.2}, "lorenz_ratio means nothing where kappa is sta"),
        ({"rho0": 1e-5}, "unknown key 'rho0'"),
        ({"kappa": "a0*(T/300)", "a0": 0.03}, "a0: other materials have a parameter of this name"),
        ({"kappa": {"temperature_K": [300.0], "values": [1.0]}}, "1 temperature and 1 value"),
        ({"kappa": {"temperature_K": [300, 300], "values": [1, 2]}}, "300 K follows 300 K"),
        ({"kappa": {"temperature_K": [300, 400], "values": [1]}}, "2 temperatures and 1 value"),
        ({"kappa": {"temperature_K": [300, 400]}}, "values is missing"),
        ({"kappa": {"temperatur_K": [300, 400]}}, "unknown key 'temperatur_K': did you mean"),
        (
            {"kappa": {"temperature_K": "x", "values": [1, 2]}},
            "temperature_K = 'x': expected a list",
        ),
        ({"kappa": {"formula": "0.01*T", "from_K": 900, "to_K": 400}}, "expected rising"),
        ({"melting_point_K": "T"}, "expected a number"),
    ],
)
def test_a_section_that_says_nothing_sensible_is_refused(section, says):
    with pytest.raises(InputError, match=says) as caught:
        material_of({"kind": "metal-film", "preset": "Pt", **section}, "here")
    assert "\n" not in str(caught.value)


def test_numbers_that_a_formula_names_are_parameters():
    values = {"resistivity": "rho0*(1 + alpha*(T - 293))", "rho0": 1e-5, "alpha": 2e-3}
    metal = material_of({"kind": "metal-film", "preset": "Pt", **values}, "")
    assert {"rho0", "alpha", "resistivity_scale"} <= set(metal.parameters)
    assert "tcr" not in metal.parameters
    sigma, by = metal.electrical_conductivity(T, 0.0)
    theirs, theirs_by = metal_conductivity(T, 1e-5, 2e-3)
    np.testing.assert_allclose(sigma, theirs, rtol=1e-13)
    pairs = {"T": "T", "rho0": "resistivity", "alpha": "tcr"}
    for own, other in pairs.items():
        np.testing.assert_allclose(by[own], theirs_by[other], rtol=1e-12)
    np.testing.assert_allclose(by["resistivity_scale"], -sigma, rtol=1e-13)


@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_all_properties_have_exact_derivatives(scale):
    table = {"temperature_K": [250, 500, 900, 1400], "values": [1e-5, 2e-5, 4e-5, 5e-5]}
    metal = MetalFilm(
        resistivity=table,
        resistivity_scale=scale,
        seebeck="-5 + s*T/100",
        emissivity="0.1 + T/1e4",
        heat_capacity="2.5 + T/1000",
        s=0.3,
        lorenz_ratio=1.1,
    )
    oxide = Dielectric(kappa="k*(T/300)**0.3", k=0.02, kappa_scale=scale)
    laws = {
        "kappa": lambda kind, T: kind.thermal_conductivity(T, 0.1),
        "sigma": lambda kind, T: kind.electrical_conductivity(T, 0.0),
        "beta": lambda kind, T: kind.thermoelectric(T, 0.0, "electron"),
        "emission": lambda kind, T: kind.emission(T, 293.0),
        "enthalpy": lambda kind, T: kind.enthalpy(T),
    }
    at, step = T + 3.0, 1e-3
    for kind, named in ((metal, laws), (oxide, {"kappa": laws["kappa"]})):
        for law in named.values():
            value, by = law(kind, at)
            slope = (law(kind, at + step)[0] - law(kind, at - step)[0]) / (2 * step)
            np.testing.assert_allclose(by["T"], slope, rtol=1e-5, atol=1e-9 * np.abs(value).max())
            for name in by.keys() & kind.parameters:
                here = getattr(kind, name)
                more, less = (
                    law(kind.model_copy(update={name: here * factor}), at)[0]
                    for factor in (1 + 1e-6, 1 - 1e-6)
                )
                slope = (more - less) / (2e-6 * here)
                np.testing.assert_allclose(
                    by[name], slope, rtol=1e-6, atol=1e-8 * np.abs(slope).max()
                )


def test_the_heat_held_is_the_integral():
    linear = MetalFilm(resistivity="1e-7*T", heat_capacity="2 + T/1000")
    held, by = linear.enthalpy(T)
    exact = 2 * (T - 298.15) + (T**2 - 298.15**2) / 2000
    np.testing.assert_allclose(held, exact, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(by["T"], 2 + T / 1000, rtol=1e-13)
    values = [2.0, 2.2, 2.9, 3.0]
    tabled = Table(temperature_K=[280.0, 500.0, 900.0, 1400.0], values=values)
    integral = PchipInterpolator(tabled.temperature_K, values).antiderivative()
    np.testing.assert_allclose(tabled.integral(T)[0], integral(T) - integral(298.15), rtol=1e-12)


@given(st.floats(-1e6, 1e6))
def test_beyond_its_ends_a_law_stays_calm(at):
    for law in (
        Table(temperature_K=[300.0, 400.0, 500.0], values=[1.0, 5.0, 0.1]),
        Formula(formula="(T/300)**8"),
    ):
        value, by = law(np.array([at]))
        assert np.isfinite(value[0])
        assert np.isfinite(by["T"][0])
        assert value[0] > 0


def test_what_a_file_holds_makes_the_same_again():
    values = {"kappa": {"formula": "k*T", "to_K": 900}, "k": 1e-3, "preset": "Pt"}
    table = {"file": "rho.csv", "temperature_K": [290.0, 400.0], "values": [1e-5, 2e-5]}
    for stated in (values, {**values, "resistivity": table}, {"preset": "Pt", "kappa": "1e-3*T"}):
        metal = material_of({"kind": "metal-film", **stated}, "")
        again = {key: value for key, value in metal.model_dump().items() if value is not None}
        assert material_of(again, "") == metal
        assert hash(material_of(again, "")) == hash(metal)


# --- files ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "name", "rows", "values"),
    [
        ("T (K),rho (µΩ cm)", "resistivity", "300,10\n400,14", [1e-5, 1.4e-5]),
        ("T (°C);ρ (Ω m)", "resistivity", "20,5;1e-7\n100;1,4e-7", [1e-5, 1.4e-5]),
        ("T [K]\tkappa [W/(m K)]", "kappa", "300\t71.6\n400\t71.8", [0.716, 0.718]),
        ("T (K),kappa (W/mK)", "kappa", "400,71.8\n300,71.6", [0.716, 0.718]),
        ("T (K),kappa (W m^-1 K^-1)", "kappa", "300,71.6\n400,71.8", [0.716, 0.718]),
        ("T (K),c (J/(m³ K))", "heat_capacity", "300,2.8e6\n400,2.9e6", [2.8, 2.9]),
        ("T (K),S (V/K)", "seebeck", "300,-5e-6\n400,-7e-6", [-5.0, -7.0]),
        ("T (K),emissivity", "emissivity", "300,0.1\n400,0.2", [0.1, 0.2]),
        ("# from the handbook\nT (K),emissivity (%)", "emissivity", "300,10\n400,20", [0.1, 0.2]),
    ],
)
def test_tables_are_read_in_any_unit(header, name, rows, values, tmp_path):
    (tmp_path / "law.csv").write_text(f"{header}\n{rows}\n")
    law = read_law(tmp_path / "law.csv", name)
    np.testing.assert_allclose(law.values, values, rtol=1e-12)
    assert law.temperature_range[0] in (300.0, 293.65)
    assert law.file == "law.csv"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("T (K),rho\n300,1e-5\n400,2e-5\n", "law.csv: line 1: column 'rho' has no unit"),
        ("T,rho (Ω cm)\n300,1e-5\n400,2e-5\n", "column 'T' has no unit"),
        ("T (K),rho (W)\n300,1e-5\n400,2e-5\n", "unit 'W' is not understood here, expected"),
        ("T (s),rho (Ω cm)\n300,1e-5\n400,2e-5\n", "unit 's' is not understood"),
        ("T (K),rho (Ω cm)\n300,1e-5\n", "1 temperature and 1 value, expected as many, 2 to"),
        ("T (K),rho (Ω cm)\n300,1e-5\n350,\n400,2e-5\n", "line 3: a cell is empty"),
        ("T (K),rho (Ω cm)\n300,1e-5\n350,x\n400,2e-5\n", "line 3: .*found 'x'"),
        ("T (K),rho (Ω cm)\n300,1e-5\n300,2e-5\n400,2e-5\n", "300 K follows 300 K"),
        ("T (K),rho (Ω cm)\n300,1e-5\n400,-2e-5\n", "line 3: resistivity is -2e-05 Ω cm"),
        ("T (K),rho (Ω cm),x (V)\n300,1e-5,1\n400,2e-5,1\n", "3 columns, expected two"),
        ("", "expected a header row like"),
    ],
)
def test_what_is_no_table_is_refused_with_file_and_line(text, says, tmp_path):
    (tmp_path / "law.csv").write_text(text)
    with pytest.raises(InputError, match=says) as caught:
        read_law(tmp_path / "law.csv", "resistivity")
    assert "\n" not in str(caught.value)


def test_a_pure_number_is_said_without_a_unit(tmp_path):
    (tmp_path / "law.csv").write_text("T (K),emissivity\n300,0.1\n400,1.2\n")
    with pytest.raises(InputError, match=r"line 3: emissivity is 1\.2, expected 0 to 1"):
        read_law(tmp_path / "law.csv", "emissivity")
    film = material_of({"kind": "metal-film", "preset": "Pt", "emissivity": "T/500"}, "here")
    assert re.search(
        r"emissivity, .* is 1\.\d+ at \d+\.?\d* K, expected 0 to 1 ", film.impossible(293.0)
    )


def test_a_file_that_is_missing_is_named(tmp_path):
    with pytest.raises(InputError, match=r"here: .*none\.csv: no such file"):
        material_of({"kind": "metal-film", "preset": "Pt", "kappa": "none.csv"}, "here", tmp_path)


@pytest.mark.parametrize(
    ("unit", "inside", "factor"),
    [
        ("mΩ·cm", "Ω cm", 1e-3),
        ("Ohm*m", "Ω cm", 100.0),
        ("nΩm", "Ω cm", 1e-7),
        ("W/cm/K", "W cm⁻¹ K⁻¹", None),
        ("W/(cm·K)", "W cm⁻¹ K⁻¹", 1.0),
        ("mW/(m K)", "W cm⁻¹ K⁻¹", 1e-5),
        ("µV/K", "µV K⁻¹", 1.0),
        ("mV/K", "µV K⁻¹", 1e3),
        ("J cm^-3 K^-1", "J cm⁻³ K⁻¹", 1.0),
        ("S/m", "Ω cm", None),
        ("apples", "Ω cm", None),
    ],
)
def test_products_of_units(unit, inside, factor):
    assert product_conversion(unit, inside) == (factor and pytest.approx(factor))
