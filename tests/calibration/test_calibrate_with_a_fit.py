"""Calibrations after a fit, as users ask for them: by the function and by the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hotlever.estimate import fit, read_fit
from hotlever.probe.parts import PriorTexts
from hotlever.probe.priors import Prior, published_material

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.fixture(scope="module")
def example():
    return Path(__file__).parents[2] / "src" / "hotlever" / "examples" / "lever-a.csv"


@pytest.fixture(scope="module")
def shared_fit(tmp_path_factory, example):
    """A fit file of an example measurement."""
    path = tmp_path_factory.mktemp("fit") / "fit.json"
    fit(example).write(path)
    return path


def test_calibrate_command_with_a_fit(run, tmp_path, shared_fit, example):
    status, out, err = run(
        "calibrate", example, "--fit", shared_fit, "-o", "cal.json", "--table", "t.csv",
        "--plot", "cal.png", "--prior", "dimensions=±1%", "--at", "8.05V",
    )  # fmt: skip
    assert status == 0, err
    assert "based on a fit of this lever in vacuum" in out
    content = json.loads((tmp_path / "cal.json").read_text())
    assert content["k"] == pytest.approx(1.0, abs=1e-6)
    # the data of the fit are those calibrated, and know the material
    sources = {"measurement", "electronics", "base temperature", "geometry", "material", "laws"}
    assert set(content["uncertainty_budget_K"]) == sources | {"model"}
    assert content["priors"]["heater_length_um"]["spread"] == pytest.approx(0.04)
    (stderr,) = (row["tip_stderr_K"] for row in content["table"] if row["bias_V"] == 8.05)
    parts = [row["contribution_K"] for row in content["gum"]]
    assert (content["gum_bias_V"], np.linalg.norm(parts)) == (8.05, pytest.approx(stderr, rel=1e-6))
    assert content["tip_temperature_uncertainty_K"] < 40
    assert (tmp_path / "t.csv").read_text().startswith("bias_V,lever_V,current_mA,power_mW,tip_K")
    assert (tmp_path / "cal.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--fit", "a", "--probe", "b"), "--fit and --probe: expected only one of them"),
        (("--medium", "vacum"), "--medium vacum: expected vacuum or air"),
        (("--table", "t.txt"), "unknown file type '.txt'"),
        (("--prior", "n_d"), "--prior n_d: expected NAME=VALUE±SPREAD"),
        (("--prior", "n_d=3e17"), "expected a value and its spread"),
        (("--prior", "n_d=3e17×/0.5"), "--prior: n_d = '3e17×/0.5': a factor of 0.5, expected"),
        (("--prior", "edge_bias_um=0.1x/2"), "edge_bias_um may be negative: expected a spread"),
        (("--prior", "heater=±3%"), "unknown prior 'heater'"),
        (("--fit", "none.json"), "none.json: no such file"),
        (("--budget-of", "peak"), "an uncertainty budget of 'peak': expected tip or apex"),
    ],
)
def test_calibrate_command_errors_are_one_line(refused, example, arguments, message):
    assert message in refused("calibrate", example, *arguments)


def test_a_file_without_current_is_refused(refused, tmp_path):
    (tmp_path / "iv.csv").write_text("V_b (V),T_tip (K)\n1,300\n2,310\n")
    assert "no values of I_h" in refused("calibrate", "iv.csv", below_notes=True)


def test_what_was_known_before_a_fit_is_not_what_it_found(shared_fit):
    """The published levers, the probe file, what the fit was asked and what is asked now."""
    fitted = read_fit(shared_fit)
    usual = fitted.known_before(None)
    assert usual["n_d"] == published_material()["n_d"]
    stated = {"n_d": "3e17 ± 10%", "p": "2.7 ± 1%"}
    probe = fitted.probe.model_copy(update={"prior": PriorTexts.from_values(stated, "here")})
    of_file = replace(fitted, probe=probe).known_before(None)
    assert (of_file["n_d"], of_file["p"]) == (Prior(3e17, 0.1), Prior(2.7, 0.01))
    now = replace(fitted, probe=probe).known_before({"p": "2.8 ± 1%"})
    assert now["p"] == Prior(2.8, 0.01)
    assert fitted.known_before({}) == {}
