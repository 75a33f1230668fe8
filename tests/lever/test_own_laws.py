"""Materials of classes of one's own: solved, fitted, written, and read where the class is."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import quad
from taylor import remainder_orders

from documents import ROOT, blocks
from experiments import on_coarse_meshes
from hotlever.cache import CACHE_VARIABLE
from hotlever.errors import InputError
from hotlever.estimate import FitOptions, Measurement, fit, many, read_fit
from hotlever.estimate.many import fit_many
from hotlever.lever import Lever, probe_of, read_sweep, write_sweep
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import cached_reduction
from hotlever.lever.transient import pulse, simulate
from hotlever.materials import LOW_DOPED, Material, Parameter
from hotlever.materials.kinds import Dielectric, HighDopedSilicon, MetalFilm, NSilicon
from hotlever.materials.parameters import field_of, parameter_named
from hotlever.probe import Probe
from hotlever.probe.priors import default_priors, priors_of
from hotlever.probe.probe_parameters import parameters_of, usual_parameters
from hotlever.studies.simulation_based_calibration import MinimosMaterial
from of_materials import metal_film_probe

BORON = Path(__file__).parents[2] / "src/hotlever/examples/boron-lever.toml"
REFUSED = "follows laws of its own, those of the Python class .*, which no file holds"
SCALE = Parameter(
    *("mobility_scale", "c_µ", "1", 1.0, 0.5, 2.0, "scale of the mobility"),
    spread=0.2,
    usual=True,
    value=1.0,
)


class DoubledSilicon(HighDopedSilicon):
    """High-doped silicon that conducts twice as well."""

    def electrical_conductivity(self, T, n):
        value, by = super().electrical_conductivity(T, n)
        return 2.0 * value, {name: 2.0 * slope for name, slope in by.items()}


class OtherSilicon(NSilicon):
    mobility_scale: float = field_of(SCALE)

    def electrical_conductivity(self, T, n):
        sigma, by = super().electrical_conductivity(T, n)
        scaled = {name: self.mobility_scale * slope for name, slope in by.items()}
        return self.mobility_scale * sigma, {**scaled, "mobility_scale": sigma}


class OtherMaterial(Material):
    classes: ClassVar = {**Material.classes, LOW_DOPED: OtherSilicon}
    mobility_scale: float = field_of(SCALE)


@pytest.fixture
def probe():
    """The lever of the example whose legs follow a law of their own."""
    return Probe.from_file(BORON).with_material("legs", DoubledSilicon)


@pytest.fixture(scope="module")
def how_to():
    """What the how-to defines beside its metal."""
    page = (ROOT / "docs" / "how-to" / "own-material.md").read_text(encoding="utf-8")
    code = next(b.content for b in blocks(page, "python") if "class BlochGruen" in b.content)
    names = {"__name__": "own_material"}
    exec(compile(code, "own-material.md", "exec"), names)
    return names


# --- the law of the how-to ------------------------------------------------------------------------


@pytest.mark.parametrize("u", [0.3, 1.0, 5.0])
def test_bloch_and_grueneisens_integral_is_scipys_and_goes_with_T_when_hot(how_to, u):
    value, slope, second = how_to["phonons"](np.array(u))
    exact = quad(lambda x: x**5 / (4 * np.sinh(x / 2) ** 2), 0, u, epsabs=0, epsrel=1e-12)[0]
    assert value == pytest.approx(exact / u**5, rel=1e-11)
    near = [how_to["phonons"](np.array(u + h)) for h in (1e-4, -1e-4)]
    assert slope == pytest.approx((near[0][0] - near[1][0]) / 2e-4, rel=1e-6)
    assert second == pytest.approx((near[0][1] - near[1][1]) / 2e-4, rel=1e-6)
    hot, _, _ = how_to["phonons"](np.array(1e-2))
    assert hot == pytest.approx(1 / (4 * 1e-2), rel=1e-5)


def test_a_metal_without_phonons_that_freeze_is_the_straight_line(how_to):
    T = np.linspace(250.0, 1200.0, 9)
    values = {"resistivity": 2e-5, "tcr": 2e-3}
    metal = how_to["BlochGrueneisenMetal"].model_construct(**values, debye_K=0.5)
    line = MetalFilm(**values)
    for own, other in zip(
        metal.electrical_conductivity(T, 0.0), line.electrical_conductivity(T, 0.0), strict=True
    ):
        for name in ("T", *values) if isinstance(own, dict) else [...]:
            np.testing.assert_allclose(own[name], other[name], rtol=1e-5)


def test_heat_and_thermoelectricity_of_a_metal_follow_its_own_conductivity(how_to):
    T = np.array([400.0, 900.0])
    values = {"resistivity": 2e-5, "tcr": 2e-3, "seebeck": 10.0}
    metal = how_to["BlochGrueneisenMetal"](**values, debye_K=500.0)
    sigma = metal.electrical_conductivity(T, 0.0)[0]
    assert abs(sigma / MetalFilm(**values).electrical_conductivity(T, 0.0)[0] - 1).min() > 0.003
    np.testing.assert_allclose(metal.thermal_conductivity(T, 0.1)[0], 2.443e-8 * sigma * T)
    beta, gamma = metal.thermoelectric(T, 0.0, "electron")[0]
    np.testing.assert_allclose([beta, gamma], [1e-5 * sigma, 1e-10 * sigma])


def test_its_lever_has_exact_derivatives_by_state_and_by_its_own_parameter(how_to):
    metal_class = how_to["BlochGrueneisenMetal"]
    probe = metal_film_probe().with_material("film", metal_class, debye_K=300.0)
    lever = Lever(probe, COARSE)
    branch = lever.branch(600.0)
    orders = remainder_orders(branch.equations, branch.x[:, -1:], seed=1, steps=(0.2, 0.1, 0.05))
    assert orders.min() > 1.9
    name, (lever_V, mA, *_) = "film.debye_K", branch.values[[4, -2]].T
    bias = lever.circuit.bias(lever_V, mA)

    def tip(lever):
        return lever.dataset(lever.solve(bias)).tip_K.values

    slope = lever.sweep(bias, sensitivities=True).sensitivity.sel(parameter=name, observable="tip")
    rest = [
        tip(lever.with_probe(probe.with_(**{name: 300.0 + h}))) - tip(lever) - h * slope.values
        for h in (80.0, 40.0, 20.0)
    ]
    # higher where the curvature happens to vanish; a wrong slope would make it one
    assert np.log2(np.abs(np.array(rest[:-1]) / rest[1:])).min() > 1.75


# --- parameters -----------------------------------------------------------------------------------


def test_a_parameter_of_its_own_is_one_like_any_other(how_to):
    probe = metal_film_probe().with_material("film", how_to["BlochGrueneisenMetal"])
    assert parameters_of(probe)["film.debye_K"].bounds == (80.0, 700.0)
    assert "film.debye_K" in usual_parameters(probe)
    assert default_priors(probe)["film.debye_K"].value == 275.0
    printed = parameter_named("film.debye_K")
    assert (printed.symbol, printed.unit, printed.scale) == ("Θ (film)", "K", 100.0)
    for wrong in (
        lambda: probe.with_(**{"film.debye": 300.0}),
        lambda: FitOptions(free=["film.debye"]).of(probe),
        lambda: priors_of({"film.debye": "300 ± 10"}, probe, "priors"),
    ):
        with pytest.raises(InputError, match=r"did you mean '(film\.)?debye_K'"):
            wrong()
    # a formula, and the number that it names
    stated = {"nitride.kappa": "k300*(T/300)**0.3", "nitride.k300": 0.03}
    assert probe.with_(**stated).materials["nitride"].k300 == 0.03
    with pytest.raises(InputError, match="did you mean 'kappa'"):
        probe.with_(**{**stated, "nitride.kapa": 1.0})
    with pytest.raises(InputError, match=r"debye_K = 5: expected "):
        probe.with_(**{"film.debye_K": 5.0})


def test_a_name_has_one_unit():
    def another(**others):
        class Another(NSilicon):
            own_length: float = field_of(
                Parameter("own_length", "l", *others.values(), 1.0, 2.0, "", value=1.0)
            )

        return Another

    def elsewhere():
        class Elsewhere(NSilicon):
            own_length: float = field_of(
                Parameter("own_length", "l", "µm", 1.0, 1.0, 2.0, "", value=1.0)
            )

    another(unit="nm", scale=1.0)
    another(unit="µm", scale=1.0)  # the same class again, as in a notebook
    elsewhere()
    with pytest.raises(InputError, match=r"own_length is in 1 nm, and elsewhere in 1 µm"):

        class Third(NSilicon):
            own_length: float = field_of(
                Parameter("own_length", "l", "nm", 1.0, 1.0, 2.0, "", value=1.0)
            )


def test_the_papers_silicon_may_be_of_another_class(tmp_path):
    probe = Probe.reference().with_material("material", OtherMaterial)
    bias, plain = [2.0, 5.0, 8.0], Lever(Probe.reference(), COARSE)
    np.testing.assert_allclose(
        Lever(probe, COARSE).sweep(bias).current_mA, plain.sweep(bias).current_mA, rtol=1e-9
    )
    true = probe.with_(mobility_scale=1.2)
    measured = Measurement.of_sweep(Lever(true, COARSE).sweep(np.linspace(1.0, 8.0, 8)))
    # all that the paper varies is held
    held = dict.fromkeys(["c_kappa", "delta", "n_d", "p", "a0", "a1"])
    with on_coarse_meshes():
        result = fit(measured, probe, fixed=held)
    assert result.parameters["mobility_scale"].value == pytest.approx(1.2, rel=1e-3)
    result.write(tmp_path / "fit.json")
    assert type(read_fit(tmp_path / "fit.json").probe.material) is OtherMaterial
    with pytest.raises(InputError, match="did you mean 'mobility_scale'"):
        fit(measured, probe, fixed={"mobility_scal": None})


@pytest.mark.parametrize(
    ("section", "material_class", "says"),
    [
        ("leg", DoubledSilicon, "unknown material 'leg': did you mean 'legs'"),
        ("legs", Dielectric, "found Dielectric, expected a class made of HighDopedSilicon"),
        ("material", OtherMaterial, "unknown material 'material'"),
    ],
)
def test_what_cannot_be_the_material_is_refused(section, material_class, says):
    with pytest.raises(InputError, match=says):
        Probe.from_file(BORON).with_material(section, material_class)


# --- files ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("of", ["material", "legs"])
def test_a_sweep_is_read_where_the_class_is_and_refused_elsewhere(of, probe, tmp_path):
    if of == "material":
        probe = Probe.reference().with_material(of, MinimosMaterial)
    material_class = {"material": MinimosMaterial, "legs": DoubledSilicon}[of]
    sweep = Lever(probe, COARSE).sweep([1.0, 2.0])
    write_sweep(sweep, tmp_path / "sweep.nc")
    again = read_sweep(tmp_path / "sweep.nc")
    assert probe_of(again) == probe
    assert probe_of(again).classes == {of: material_class}
    again.attrs["laws"] = again.attrs["laws"].replace(material_class.__name__, "Elsewhere")
    with pytest.raises(InputError, match=rf"'{of}' {REFUSED}: expected Python that has imported"):
        probe_of(again)
    # what needs no material is as ever
    write_sweep(again, tmp_path / "again.csv")
    assert len((tmp_path / "again.csv").read_text().splitlines()) == 3
    circuit = probe.circuit
    assert Measurement.of_sweep(again).series_resistance_ohm == circuit.series_resistance_ohm


def test_a_history_names_the_class_too():
    probe = Probe.reference().with_material("material", MinimosMaterial)
    history = simulate(Lever(probe, COARSE), pulse(2.0, 1.0), at=[1.0])
    assert probe_of(history) == probe
    del history.attrs["laws"]
    assert probe_of(history) == Probe.reference()


def test_a_probe_file_is_refused_elsewhere_and_a_changed_probe_keeps_its_laws(probe, tmp_path, run):
    probe.to_file(tmp_path / "own.toml")
    assert Probe.from_file(tmp_path / "own.toml") == probe
    text = (tmp_path / "own.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(text.replace(".DoubledSilicon", ".Elsewhere"), "utf-8")
    with pytest.raises(InputError, match=rf"own\.toml: 'legs' {REFUSED}"):
        Probe.from_file(tmp_path / "own.toml")
    changed = probe.in_medium("air").with_(**{"legs.a0": 1.2e-3})
    assert type(changed.materials["legs"]) is DoubledSilicon
    assert changed.materials["legs"].a0 == 1.2e-3
    assert changed.materials["hot"] == probe.materials["hot"]


def test_a_fit_file_does_not_give_another_lever(probe, tmp_path):
    measurement = Measurement.of_sweep(Lever(probe, COARSE).sweep(np.linspace(0.5, 4.5, 9)))
    held = [name for name in usual_parameters(probe) if name != "legs.a0"]
    with on_coarse_meshes():
        fit(measurement, probe, fixed=dict.fromkeys(held)).write(tmp_path / "fit.json")
    assert type(read_fit(tmp_path / "fit.json").probe.materials["legs"]) is DoubledSilicon
    text = (tmp_path / "fit.json").read_text(encoding="utf-8")
    (tmp_path / "fit.json").write_text(re.sub(r"\w+\.DoubledSilicon", "a.B", text), "utf-8")
    with pytest.raises(InputError, match=REFUSED):
        read_fit(tmp_path / "fit.json")


def test_what_has_the_usual_laws_is_read_back():
    usual = Probe.from_file(BORON)
    assert "laws" not in usual.sections()
    assert probe_of(Lever(usual, COARSE).sweep([1.0])).materials == usual.materials


def test_nothing_is_kept_of_a_class_whose_code_may_change(monkeypatch, tmp_path):
    probe = Probe.reference().with_material("material", OtherMaterial)
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    reduction = SimpleNamespace(arrays=lambda: {"a": np.zeros(2)})
    monkeypatch.setattr("hotlever.lever.reduced_lever.reduce", lambda *_: reduction)
    cached_reduction(Lever(probe, COARSE))
    assert not list(tmp_path.rglob("*.npz"))
    (tmp_path / "a.csv").write_text("V_b (V),I_h (mA)\n1,0.1\n2,0.2\n3,0.3\n")
    # a fit that was written before is not looked for
    monkeypatch.setattr(many, "_written_before", lambda *_: pytest.fail("taken again"))
    monkeypatch.setattr(many, "local_executor", lambda *_: nullcontext())
    monkeypatch.setattr(many, "_not_reduced", lambda *_: {})
    monkeypatch.setattr(many, "run_all", lambda *_: [])
    assert not fit_many([tmp_path / "a.csv"], tmp_path / "out", probe).failures
