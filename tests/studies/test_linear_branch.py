"""Lines above the knee: exact curves, scaling laws, and a thermal resistance by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr

from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.materials.heat import thermal_conductivity
from hotlever.probe import Probe
from hotlever.studies.linear_branch import (
    BranchLine,
    all_cases,
    linear_branch_study,
    reach,
    slope_regression,
    squares,
    with_heater_of,
)


@dataclass
class Curve:
    """A branch of which only T(P) is known: two straight lines that meet."""

    bend_K: float
    steeper: float = 1.0
    hottest_K: float = 1350.0
    base_temperature_K: float = 293.0

    def power(self, tip_K):
        tip = np.asarray(tip_K, dtype=float)
        above = np.maximum(tip - self.bend_K, 0.0)
        return (tip - above - 200.0 + above / self.steeper) / 250.0


def test_a_straight_line_is_recovered_and_one_through_the_base_is_not():
    line = BranchLine.of(Curve(2000.0), 900.0, 1150.0)
    assert line.slope_K_per_mW == pytest.approx(250.0)
    # at 200 K there is no power
    assert line.offset_K == pytest.approx(200.0 - 293.0)
    assert line.off_K == pytest.approx(0.0, abs=1e-9)
    through = BranchLine.of(Curve(2000.0), 900.0, 1150.0, offset=False)
    assert through.offset_K == 0.0
    # of lines through the base the best one touches the curve in between
    assert 5.0 < through.off_K < 20.0


def test_a_line_reaches_to_a_bend_or_to_where_the_laws_end():
    assert reach(Curve(2000.0), 900.0) == 400.0
    near = reach(Curve(1000.0, steeper=2.0), 900.0)
    assert 100.0 < near < 200.0
    assert reach(Curve(1000.0, steeper=1.1), 900.0) > near


@pytest.mark.parametrize("probe", [Probe.reference(), Probe.u_shape()], ids=["three-leg", "u"])
def test_the_thermal_resistance_by_squares_is_that_of_a_lever_heated_in_its_heater(probe):
    material = probe.material
    cold_legs = {"a0": 1e-3 * material.a0, "a1": 1e-3 * material.a1, "delta": 1e-3}
    ideal = probe.model_copy(update={"material": material.model_copy(update=cold_legs)})
    tip = 295.0
    solved = (tip - 293.0) / Lever(ideal, COARSE).branch(600.0).power(tip).item()
    kappa = thermal_conductivity(294.0, material.c_kappa)[0]  # W/(cm K)
    by_hand = squares(probe.shape) / (0.1 * kappa * probe.shape.thickness_um)
    assert by_hand == pytest.approx(solved, rel=0.05)


def test_a_drawn_heater_of_the_same_silicon_makes_the_same_lever(coarse):
    probe = coarse.probe
    own = {name: getattr(probe.material, name) for name in ("c_kappa", "n_d", "p", "delta")}
    drawn = Lever(with_heater_of(probe, kind="n-silicon", **own), COARSE).branch_past_knee()
    assert drawn.knee.tip_K == pytest.approx(coarse.branch_past_knee().knee.tip_K, abs=1.0)


def test_the_levers_are_of_both_shapes_and_types():
    kinds = [(case.shape.shape, case.dopant) for case in all_cases().values()]
    assert len(kinds) > 30
    assert min(kinds.count(kind) for kind in set(kinds)) >= 5
    assert len(set(kinds)) == 4


@pytest.fixture(scope="module")
def study():
    names = ("three-leg", "three-leg, thickness_um = 0.2", "three-leg, heater_length_um = 3")
    cases = all_cases()
    return linear_branch_study({name: cases[name] for name in names})


def test_half_the_thickness_doubles_the_slope_and_bends_nothing(study):
    whole, half = (study.isel(case=number) for number in (0, 1))
    assert half.slope_K_per_mW.item() == pytest.approx(2 * whole.slope_K_per_mW.item(), rel=1e-6)
    assert half.resistance_K_per_mW.item() == pytest.approx(2 * whole.resistance_K_per_mW.item())
    assert half.straight_K.item() == pytest.approx(whole.straight_K.item(), abs=1e-4)
    assert whole.straight_K < whole.proportional_K


def test_a_lever_without_a_knee_has_no_line(study):
    assert np.isnan(study.knee_K.values).tolist() == [False, False, True]
    assert np.isnan(study.slope_K_per_mW.values[2])


def test_the_regression_recovers_a_power_law_and_leaves_out_what_has_no_slope():
    rng = np.random.default_rng(0)
    resistance, share = rng.uniform(100, 900, 12), rng.uniform(0.4, 0.9, 12)
    slope = 0.8 * resistance**0.9 * share**1.5
    slope[3] = np.nan
    columns = {"resistance_K_per_mW": resistance, "knee_share": share, "slope_K_per_mW": slope}
    made_up = xr.Dataset({name: ("case", column) for name, column in columns.items()})
    regression = slope_regression(made_up)
    assert regression.exponents == pytest.approx({"resistance_K_per_mW": 0.9, "knee_share": 1.5})
    assert regression.factor == pytest.approx(0.8)
    assert regression.determination == pytest.approx(1.0)
    assert regression.scatter == pytest.approx(0.0, abs=1e-9)
