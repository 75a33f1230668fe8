"""Designs by gradient: derivatives against differences, optima against what they must be."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import Lever, Probe
from hotlever.lever.lever import COARSE
from hotlever.lever.reader import over_surface
from hotlever.lever.similar import SimilarLevers
from hotlever.studies.optimisation import (
    OF_THE_READER,
    QUANTITIES,
    SolvedDesign,
    WorkingPoint,
    optimise,
    optimum_text,
)

pytestmark = pytest.mark.usefixtures("coarse_meshes")

NAMES = ("heater_length_um", "series_resistance_ohm")
#: Of the knee of a curve through states, differences are known less well.
OF_KNEE = {"knee_K": 2e-2, "knee_distance_K": 2e-2, "knee_mA": 1e-2, "knee_mW": 1e-2}


@pytest.fixture(scope="module")
def similar(coarse: Lever) -> SimilarLevers:
    return SimilarLevers(coarse)


@pytest.mark.parametrize("column", ["tip_K", "bias_V", "power_mW"])
def test_derivatives_are_those_of_differences(similar, column):
    probe = similar.drawn
    point = WorkingPoint(column, {"tip_K": 700.0, "bias_V": 6.0, "power_mW": 1.5}[column])
    solved = SolvedDesign(similar, probe, point, NAMES)
    exactly = [name for name in QUANTITIES if name not in OF_THE_READER]
    own = [name for name in exactly if not name.startswith("knee_")]
    quantities = exactly if column == "tip_K" else own
    exact = {quantity: solved.gradient(quantity) for quantity in quantities}
    for number, name in enumerate(NAMES):
        value = float(probe.values([name])[0])
        step = 2e-3 * value
        above, below = (
            SolvedDesign(similar, probe.replace({name: value + way}), point)
            for way in (step, -step)
        )
        for quantity in quantities:
            here = solved.value(quantity)
            change = (above.value(quantity) - below.value(quantity)) / (2.0 * step)
            if quantity == "knee_distance_V":  # a small difference of two large ones
                here = solved.value("knee_bias_V")
            relative = (exact[quantity][number] - change) * value / here
            assert relative == pytest.approx(0.0, abs=OF_KNEE.get(quantity, 3e-3)), quantity
    if column == "bias_V":
        assert exact["bias_V"] == pytest.approx(np.zeros(2), abs=1e-12)


def test_what_a_reader_shows_is_that_of_a_lever_over_a_surface(coarse):
    probe = coarse.probe.with_(medium="air", surface_gap_um=0.5)
    lever = Lever(probe, COARSE)
    solved = SolvedDesign(SimilarLevers(lever), probe, WorkingPoint("bias_V", 9.0))
    read = over_surface(lever, 0.5, 9.0)
    for quantity in OF_THE_READER:
        assert solved.value(quantity) == pytest.approx(read[quantity].item(), rel=1e-6), quantity


@pytest.mark.slow
def test_a_reader_is_most_sensitive_where_others_are_less():
    """Beside levers on meshes and with panels of their own."""
    probe, name = Probe.reference().with_(medium="air", surface_gap_um=0.5), "heater_width_um"
    point, quantity = WorkingPoint("tip_K", 500.0), "dlnR_dz_per_um"
    optimum = optimise(probe, quantity, point, {name: (0.8, 4.5)}, greatest=True)
    best = getattr(optimum.best.probe.shape, name)
    for width in (0.85 * best, 1.15 * best):
        beside = probe.with_(**{name: width})
        other = SolvedDesign(SimilarLevers(Lever(beside)), beside, point)
        assert other.value(quantity) < optimum.best.value(quantity)
    assert (optimum.limits, optimum.reason) == ((), "")


def test_the_greatest_power_is_that_of_a_matched_load():
    """Whatever heats in it, a lever takes at most V_b²/4R_s, where V_l is half the bias."""
    point, bounds = WorkingPoint("bias_V", 8.0), {"heater_length_um": (2.0, 8.0)}
    optimum = optimise(Probe.reference(), "power_mW", point, bounds, greatest=True)
    most = 8.0**2 / (4.0 * Probe.reference().circuit.series_kohm)
    assert optimum.best.value("power_mW") == pytest.approx(most, rel=1e-5)
    assert optimum.best.value("lever_V") == pytest.approx(4.0, rel=1e-3)
    assert optimum.limits == ()
    assert not optimum.reason


def test_a_bound_on_another_quantity_limits_the_design():
    point = WorkingPoint("tip_K", 700.0)
    bounds = {"heater_length_um": (2.0, 8.0), "bias_V": (7.0, None)}
    optimum = optimise(Probe.reference(), "power_mW", point, bounds)
    # without it, the longest heater would take the least power
    assert optimum.limits == ("bias_V at its least, 7",)
    assert optimum.best.value("bias_V") == pytest.approx(7.0, rel=1e-3)
    assert optimum.best.value("power_mW") < optimum.start.value("power_mW")


def test_a_search_that_is_cut_off_has_the_best_that_it_saw():
    """The first step is to a heater that is longer than its lever."""
    point, bounds = WorkingPoint("tip_K", 700.0), {"heater_length_um": (2.0, 60.0)}
    optimum = optimise(Probe.reference(), "power_mW", point, bounds, most_designs=2)
    assert "without coming to rest" in optimum.reason
    assert "limited by no bound\n" in optimum_text(optimum)
    assert optimum.best.value("power_mW") == pytest.approx(optimum.start.value("power_mW"))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--minimise", "powr_mW", "--within", "n_d=1e17:1e18"], "did you mean 'power_mW'?"),
        (["--minimise", "power_mW"], "expected bounds of one at least"),
        (["--minimise", "power_mW", "--within", "n_d=1e17"], "expected LOW:HIGH"),
        (["--minimise", "power_mW", "--within", "n_d=1e17:"], "expected both"),
        (["--minimise", "power_mW", "--within", "n_d=2e17:1e17"], "expected a rising range"),
        (["--minimise", "power_mW", "--maximise", "tip_K"], "expected only one of them"),
        (["--minimise", "power_mW", "--within", "gap_um=-1:5"], "gap_um = -1: expected at least"),
        (["--minimise", "power_mW", "--within", "n_d=0:1e18"], "n_d = 0: expected at least 5e+15"),
        (["--within", "n_d=1e17:1e18"], "goes with --minimise"),
        (["--vary", "heater_length_um=3:5:2", "--at", "8V"], "--at: goes with --minimise"),
        (["--minimise", "bias_V", "--power", "3"], "--power: does not go with --minimise"),
        (["--minimise", "bias_V", "--no-air"], "--no-air: does not go with --minimise"),
        (["--maximise", "dlnR_dz_per_um", "--within", "n_d=1e17:1e18"], "expected surface_gap_um"),
        (["--minimise", "power_mW", "--at", "7kg"], "or a tip temperature as 700K"),
        (["--minimise", "power_mW", "-o", "best.csv"], "expected .toml"),
    ],
)
def test_what_cannot_be_is_one_line(refused, words, expected):
    assert expected in refused("design", *words)


def test_the_command_writes_a_probe_file_and_a_figure(run, tmp_path):
    words = ["--maximise", "power_mW", "--at", "8V", "--within", "heater_length_um=3:5"]
    status, out, err = run("design", *words, "-o", "best.toml", "--plot", "best.png")
    assert status == 0, err
    assert "limited by heater_length_um at its most, 5" in out
    assert Probe.from_file(tmp_path / "best.toml").shape.heater_length_um == pytest.approx(5.0)
    assert (tmp_path / "best.png").stat().st_size > 10_000
