"""Levers of materials whose laws a probe file states: solved, fitted, stored and read back."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from hotlever.errors import BranchEndError, InputError
from hotlever.estimate import Measurement, fit, read_fit
from hotlever.lever import Lever, probe_of, read_sweep, write_sweep
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import pulse, simulate
from hotlever.materials.films import dielectric_conductivity, metal_conductivity
from hotlever.materials.kinds import Dielectric, MetalFilm
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import usual_parameters
from of_materials import FILM, NITRIDE, metal_film_probe, metal_film_sections

BIAS = [0.2, 0.4, 0.6]
LINEAR = {"resistivity": "rho0*(1 + alpha*(T - 293))", "rho0": 2e-5, "alpha": 2e-3}
STATED = {
    "film": {"kind": "metal-film", "preset": "Pd", **LINEAR},
    "nitride": {**NITRIDE, "kappa": "0.032*(T/300)**0.33"},
}


def sweep_of(probe, bias=BIAS):
    return Lever(probe, COARSE).sweep(bias)


def tabled(law, step_K):
    """A law at some temperatures, 250 to 1300 K, as a section holds it."""
    T = np.linspace(250.0, 1300.0, round(1050 / step_K) + 1)
    return {"temperature_K": T.tolist(), "values": law(T).tolist()}


def resistivity(T):
    return 1.0 / metal_conductivity(T, 2e-5, 2e-3)[0]


def conductivity(T):
    return dielectric_conductivity(T, 0.032, 0.33)[0]


def of_tables(step_K):
    film = {**STATED["film"], "resistivity": tabled(resistivity, step_K)}
    film = {key: value for key, value in film.items() if key not in ("rho0", "alpha")}
    nitride = {**NITRIDE, "kappa": tabled(conductivity, step_K)}
    return metal_film_probe(materials={"film": film, "nitride": nitride})


def assert_close(one, other, rtol):
    for column in ("current_mA", "lever_V", "tip_K", "heater_ohm"):
        np.testing.assert_allclose(one[column], other[column], rtol=rtol)


def test_a_formula_is_the_law_in_code():
    assert_close(sweep_of(metal_film_probe(materials=STATED)), sweep_of(metal_film_probe()), 1e-9)


class ScipyMetal(MetalFilm):
    """A metal by SciPy's interpolation of a table."""

    def electrical_conductivity(self, T, n):
        rho = PchipInterpolator(self.resistivity.temperature_K, self.resistivity.values)
        sigma = 1.0 / rho(T)
        return sigma, {"T": -(sigma**2) * rho(T, 1)}

    def thermal_conductivity(self, T, thickness_um):
        sigma, by = self.electrical_conductivity(T, 0.0)
        lorenz = 2.443e-8 * self.lorenz_ratio
        return lorenz * sigma * T, {"T": lorenz * (sigma + T * by["T"])}


class ScipyDielectric(Dielectric):
    """A dielectric by SciPy's interpolation of a table."""

    def thermal_conductivity(self, T, thickness_um):
        kappa = PchipInterpolator(self.kappa.temperature_K, self.kappa.values)
        return kappa(T), {"T": kappa(T, 1)}


def test_a_table_is_the_same_interpolant_in_code():
    probe = of_tables(100.0)
    kinds = {
        "film": ScipyMetal(**probe.materials["film"].model_dump()),
        "nitride": ScipyDielectric(**probe.materials["nitride"].model_dump()),
    }
    assert_close(sweep_of(probe), sweep_of(probe.model_copy(update={"materials": kinds})), 1e-9)


def test_a_table_comes_to_its_law_with_the_square_of_its_step_or_faster():
    exact = sweep_of(metal_film_probe()).tip_K.values - 293.0
    errors = [
        np.abs((sweep_of(of_tables(step)).tip_K.values - 293.0) / exact - 1.0).max()
        for step in (210.0, 105.0, 52.5)
    ]
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 3.5
    assert errors[2] < errors[1] / 3.5


def test_sensitivities_to_scales_are_those_to_the_numbers_they_scale():
    ours, theirs = (
        Lever(probe, COARSE).sweep(BIAS, sensitivities=True).sensitivity
        for probe in (metal_film_probe(materials=STATED), metal_film_probe())
    )
    for scale, number, value in (
        ("film.resistivity_scale", "film.resistivity", 2e-5),
        ("nitride.kappa_scale", "nitride.kappa", 0.032),
    ):
        for observable in ("current", "tip"):
            np.testing.assert_allclose(
                ours.sel(parameter=scale, observable=observable),
                value * theirs.sel(parameter=number, observable=observable),
                rtol=1e-7,
            )


def test_a_scale_is_the_value_it_scales():
    stated = metal_film_probe(materials=STATED).with_(**{"film.resistivity_scale": 1.1})
    number = metal_film_probe(
        materials={"film": {**FILM, "resistivity": 2.2e-5}, "nitride": NITRIDE}
    )
    assert_close(sweep_of(stated), sweep_of(number), 1e-9)


def test_a_branch_ends_where_the_table_does():
    film = {"kind": "metal-film", "preset": "Pd"}
    rho = {"temperature_K": [290.0, 400.0, 500.0], "values": [2e-5, 2.4e-5, 2.8e-5]}
    probe = metal_film_probe(materials={"film": {**film, "resistivity": rho}, "nitride": NITRIDE})
    with pytest.raises(
        BranchEndError, match=r"the table of film\.resistivity ends at 500 K"
    ) as end:
        sweep_of(probe, np.linspace(0.1, 0.8, 8))
    assert 0 < end.value.partial.sizes["bias"] < 8
    assert end.value.partial.max_K.max() < 500.0


def test_a_table_that_begins_above_the_base_is_refused():
    rho = {"temperature_K": [300.0, 900.0], "values": [2e-5, 3e-5]}
    film = {"kind": "metal-film", "preset": "Pd", "resistivity": rho}
    with pytest.raises(InputError, match=r"film: the table of resistivity begins at 300 K"):
        metal_film_probe(materials={"film": film, "nitride": NITRIDE})


def test_a_table_that_begins_above_the_coldest_leg_end_is_refused():
    """It was taken to go on as it begins."""
    rho = {"temperature_K": [290.0, 900.0], "values": [2e-5, 3e-5]}
    probe = metal_film_probe().with_(**{"film.resistivity": rho, "circuit.ground.kind": "ground"})
    assert probe.with_(**{"circuit.ground.base_temperature_K": 300}).circuit.end_rises()
    with pytest.raises(InputError, match=r"film: the table of resistivity begins at 290 K.* 260 K"):
        probe.with_(**{"circuit.ground.base_temperature_K": 260})


def test_the_probe_of_a_file_with_tables_holds_their_values(tmp_path):
    rows = "\n".join(f"{T},{1e6 * resistivity(T):.9g}" for T in np.linspace(250, 1300, 12))
    (tmp_path / "rho.csv").write_text(f"T (K),rho (µΩ cm)\n{rows}\n")
    film = {"kind": "metal-film", "preset": "Pd", "resistivity": "rho.csv"}
    sections = metal_film_sections() | {"materials": {"film": film, "nitride": STATED["nitride"]}}
    probe = Probe.from_sections(copy.deepcopy(sections), "test", tmp_path)
    assert probe.materials["film"].resistivity.file == "rho.csv"
    (tmp_path / "rho.csv").unlink()
    probe.to_file(tmp_path / "whole.toml")
    assert Probe.from_file(tmp_path / "whole.toml").materials == probe.materials
    sweep = sweep_of(probe)
    write_sweep(sweep, tmp_path / "sweep.nc")
    assert probe_of(read_sweep(tmp_path / "sweep.nc")).materials == probe.materials
    # a change of one value keeps the laws; a law takes the place of a number and what it needs
    changed = probe.with_(**{"film.lorenz_ratio": 1.2, "circuit.series_resistance_ohm": 50.0})
    assert changed.materials["film"].resistivity == probe.materials["film"].resistivity
    lawful = metal_film_probe().with_(**{"film.resistivity": "2e-5*(1 + 2e-3*(T - 293))"})
    assert lawful.materials["film"].tcr is None
    with pytest.raises(InputError, match="did you mean 'lorenz_ratio'"):
        probe.with_(**{"film.lorenz_rato": 1.2})


@pytest.mark.slow
def test_a_fit_finds_a_number_of_a_formula_and_the_scale_of_a_table(tmp_path):
    true = metal_film_probe(materials=STATED).with_(**{"film.alpha": 1.8e-3})
    measurement = Measurement.of_sweep(sweep_of(true, np.linspace(0.1, 0.6, 11)))
    start = metal_film_probe(materials=STATED)
    held = dict.fromkeys(usual_parameters(start))
    result = fit(measurement, start, fixed=held, free=["film.alpha"])
    alpha = pytest.approx(1.8e-3, rel=5e-3)  # on another mesh
    assert result.parameters["film.alpha"].value == alpha
    result.write(tmp_path / "fit.json")
    assert read_fit(tmp_path / "fit.json").probe.materials["film"].alpha == alpha
    scales = {"film.resistivity_scale", "nitride.kappa_scale"}
    assert set(usual_parameters(of_tables(105.0))) == scales


def test_heat_capacity_by_formula_counts_in_time():
    materials = {name: {**section, "heat_capacity": 2.5} for name, section in STATED.items()}
    by_law = copy.deepcopy(materials)
    for section in by_law.values():
        section["heat_capacity"] = "2.5 + 0*T"
    both = [
        simulate(Lever(metal_film_probe(materials=each), COARSE), pulse(0.5, 20.0), at=[5.0, 20.0])
        for each in (materials, by_law)
    ]
    np.testing.assert_allclose(both[0].tip_K, both[1].tip_K, rtol=1e-7)


def test_seebeck_and_emissivity_by_formula_count_with_their_physics():
    numbers = copy.deepcopy(STATED)
    numbers["film"] |= {"seebeck": -20.0, "emissivity": 0.2}
    laws = copy.deepcopy(STATED)
    laws["film"] |= {"seebeck": "-20 + 0*T", "emissivity": "0.2 + 0*T"}
    effects = {"physics": {"thermoelectric": True, "radiation": True}}
    both = [sweep_of(metal_film_probe(materials=each, **effects)) for each in (numbers, laws)]
    assert_close(*both, 1e-9)
    plain = sweep_of(metal_film_probe(materials=laws))
    assert abs(plain.tip_K.values[-1] - both[1].tip_K.values[-1]) > 1e-3
