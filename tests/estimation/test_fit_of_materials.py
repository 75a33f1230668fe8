"""Fits of other materials than the paper's silicon, and of parameters beside the usual ones."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate import Estimate, FitOptions, Measurement, fit, read_fit
from hotlever.estimate.many import compare_levers
from hotlever.estimate.sampling import predictive_band, sample_posterior
from hotlever.estimate.uncertainty import profile_likelihood
from hotlever.lever import Lever
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, default_priors
from hotlever.probe.probe_parameters import of_materials, usual_parameters
from of_materials import of_named_silicon, p_type_probe, strip_probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")

BIAS = np.linspace(0.05, 0.45, 10)
TRUTH = {"film.resistivity": 2.3e-5, "film.tcr": 1.7e-3, "nitride.kappa": 0.027}


def measured(probe: Probe, bias: np.ndarray) -> Measurement:
    """What a lever shows, without noise."""
    return Measurement.of_sweep(Lever(probe).sweep(bias))


@pytest.fixture(scope="module")
def of_film() -> Measurement:
    return measured(strip_probe().with_(**TRUTH), BIAS)


@pytest.fixture(scope="module")
def found(of_film) -> Estimate:
    return fit(of_film, strip_probe())


def test_what_usually_varies_is_what_a_lever_is_made_of():
    assert usual_parameters(Probe.reference()) == tuple(PARAMETERS)
    assert set(usual_parameters(strip_probe())) == set(TRUTH)
    boron = usual_parameters(p_type_probe())
    assert {"hot.n_d", "hot.delta", "legs.a0"} < set(boron)
    by_thickness = of_named_silicon("n-silicon", {"c_kappa": "thickness"}, {})
    assert "legs.c_kappa" not in of_materials(by_thickness)
    assert "hot.c_kappa" in usual_parameters(by_thickness)
    assert of_materials(strip_probe())["film.lorenz_ratio"].upper == 5.0


def test_a_fit_finds_metal_and_dielectric(found):
    assert set(found.names) == set(TRUTH)
    for name, value in TRUTH.items():
        assert found.parameters[name].value == pytest.approx(value, rel=1e-4)
    assert np.isnan(found.inversion_temperature_K)
    assert "inversion" not in repr(found)
    assert "film.tcr" in repr(found)
    # a little more than the mesh is good for: the data are of the same mesh
    assert found.residual_rms["tip_K"] < 0.01


def test_a_fit_file_of_it_is_read_back(found, tmp_path):
    found.write(tmp_path / "fit.json")
    again = read_fit(tmp_path / "fit.json")
    assert again.probe == found.probe
    assert again.options.varied == found.options.varied
    for name, parameter in found.parameters.items():
        read = again.parameters[name]
        # a standard error is that of a correlation in the file
        assert read.stderr == pytest.approx(parameter.stderr, rel=1e-12)
        assert (read.value, read.unit, read.vary) == (parameter.value, parameter.unit, True)
    content = json.loads((tmp_path / "fit.json").read_text())
    assert content["parameters"]["film.tcr"]["unit"] == "K⁻¹"
    assert content["inversion_temperature_K"] is None
    table = compare_levers({"one": found, "other": again})
    assert list(table.quantity.values) == found.names


def test_more_or_less_may_vary(of_film):
    held = fit(of_film, strip_probe(), fixed={"film.tcr": TRUTH["film.tcr"]})
    assert set(held.names) == set(TRUTH) - {"film.tcr"}
    assert held.parameters["nitride.kappa"].value == pytest.approx(0.027, rel=1e-4)
    assert not held.parameters["film.tcr"].vary
    probe = strip_probe().with_(**(TRUTH | {"nitride.kappa": 0.03}))
    freed = fit(of_film, probe, fixed={"film.tcr": None}, free=["nitride.kappa_exponent"])
    assert "nitride.kappa_exponent" in freed.names
    assert freed.parameters["nitride.kappa"].value == pytest.approx(0.027, rel=1e-3)
    assert freed.parameters["nitride.kappa_exponent"].value == pytest.approx(0.33, abs=5e-3)


@pytest.mark.slow
def test_posterior_and_profile_work_for_what_varies(of_film):
    rng = np.random.default_rng(3)
    noise = 1.0 + 1e-3 * rng.standard_normal((2, BIAS.size))
    noisy = replace(
        of_film, current_mA=of_film.current_mA * noise[0], tip_K=of_film.tip_K * noise[1]
    )
    found = fit(noisy, strip_probe())
    for name, value in TRUTH.items():
        one = found.parameters[name]
        assert abs(one.value - value) < 5.0 * one.stderr
    data = sample_posterior(found, samples=400, processes=1)
    assert data.attrs["surrogate_error_K"] < 0.5
    assert list(data.quantity.values) == found.names
    for name in found.names:
        one = found.parameters[name]
        assert abs(float(data[name].mean()) - one.value) < 2.0 * one.stderr
        assert data[name].attrs["units"]
    band = predictive_band(found, data, samples=40)
    assert np.isfinite(band.tip_K).all()
    curve = profile_likelihood(found, "film.tcr", points=9)
    low, high = curve.interval.sel(level=0.6827, method="nearest").values
    one = found.parameters["film.tcr"]
    assert low < one.value < high
    assert high - low == pytest.approx(2.0 * one.stderr, rel=0.5)


def test_a_boron_doped_lever_is_fitted():
    probe = p_type_probe()
    truth = {"hot.n_d": 1.7e18, "hot.p": 2.35, "legs.a0": 1.1e-3}
    data = measured(probe.with_(**truth), np.linspace(1.0, 9.0, 12))
    others = [name for name in usual_parameters(probe) if name not in truth]
    found = fit(data, probe, fixed=dict.fromkeys(others))
    for name, value in truth.items():
        assert found.parameters[name].value == pytest.approx(value, rel=2e-3)
    assert found.inversion_temperature_K == pytest.approx(
        float(probe.with_(**truth).heater_silicon.inversion_temperature()), abs=1.0
    )
    assert found.inversion_temperature_stderr_K >= 0


def test_what_else_the_paper_s_lever_has_may_be_free(coarse):
    """n_hd is declared, and varied if it is asked for."""
    data = measured(Probe.reference().with_(n_hd=1.9e20), np.linspace(1.0, 9.0, 12))
    held = {"c_kappa": None, "p": None, "a0": None, "a1": None, "delta": None}
    found = fit(data, Probe.reference(), fixed=held, free=["n_hd"])
    assert found.parameters["n_hd"].value == pytest.approx(1.9e20, rel=0.02)
    assert list(found.names) == ["n_d", "n_hd"]


def test_usual_priors_are_of_what_a_lever_is_made_of():
    known = default_priors(strip_probe())
    assert set(TRUTH) < set(known)
    assert not set(PARAMETERS) & set(known)
    assert known["film.tcr"].spread == pytest.approx(0.2)
    stated = strip_probe(prior={"film.tcr": "± 3%", "nitride.kappa": "0.03 ± 0.002"})
    assert default_priors(stated)["film.tcr"].spread == pytest.approx(0.03)
    boron = default_priors(p_type_probe())
    assert boron["hot.n_d"].spread == pytest.approx(0.15)
    # what may be off by either sign is the departure of the law, which has the exponent
    assert boron["hot.mobility_1"] == Prior(0.0, 1.0, relative=False)
    assert "hot.impurity_exponent" not in boron


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"free": ["film.lorenz"]}, "unknown parameter 'film.lorenz': did you mean"),
        ({"free": ["n_d"]}, "unknown parameter 'n_d'"),
        ({"fixed": {"film.tc": None}}, "did you mean 'film.tcr'"),
        ({"fixed": {"p": None}}, "unknown parameter 'p'"),
        ({"fixed": dict.fromkeys(TRUTH)}, "all parameters are fixed"),
        ({"fixed": {"film.tcr": 1.0}}, "tcr = 1: expected at most"),
        ({"fixed": {"film.tcr": None}, "free": ["film.tcr"]}, "film.tcr is fixed and is free"),
    ],
)
def test_wrong_names_are_refused_in_one_line(of_film, options, text):
    with pytest.raises(InputError) as error:
        fit(of_film, strip_probe(), FitOptions(**options))
    assert text in str(error.value)
    assert "\n" not in str(error.value)


def test_the_command_takes_free_and_fixed_parameters_by_name(run, refused, tmp_path, of_film):
    strip_probe().to_file(tmp_path / "film.toml")
    rows = zip(of_film.bias_V, of_film.current_mA, of_film.tip_K, strict=True)
    lines = ["V_b (V),I_h (mA),T_tip (K)", *(",".join(f"{x:.9g}" for x in row) for row in rows)]
    (tmp_path / "data.csv").write_text("\n".join([*lines, ""]))
    base = ("fit", str(tmp_path / "data.csv"), "--probe", str(tmp_path / "film.toml"))
    more = ("--fix", "film.tcr=1.7e-3", "--free", "film.lorenz_ratio")
    status, out, err = run(*base, *more, "-o", str(tmp_path / "fit.json"))
    assert status == 0, err
    content = json.loads((tmp_path / "fit.json").read_text())["parameters"]
    assert content["film.lorenz_ratio"]["vary"]
    assert not content["film.tcr"]["vary"]
    assert content["film.resistivity"]["value"] == pytest.approx(2.3e-5, rel=1e-3)
    assert "film.lorenz_ratio" in out
    line = refused(*base, "--free", "film.lorenz_ration", below_notes=True)
    assert "did you mean 'film.lorenz_ratio'" in line
