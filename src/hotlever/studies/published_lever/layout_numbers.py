"""What a layout shows of all that the paper says: numbers for every statement and claim."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from hotlever import spieser2017 as paper
from hotlever.errors import ComputationError
from hotlever.estimate.power_law import EQ12
from hotlever.lever import Branch, Lever
from hotlever.lever.branch import Reach
from hotlever.lever.dataset import dataset_of_branch
from hotlever.lever.fields import heater_profile
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import PARAMETERS, published
from hotlever.probe import Probe
from hotlever.studies.air_scaling import error_of_one_factor, find_scale_factor
from hotlever.studies.knee_study import (
    Suspect,
    carried_by,
    described_without,
    reasons_of_the_knee,
    steps_at_the_knee,
    steps_to_the_knee,
)
from hotlever.studies.linear_branch import SPAN_K, BranchLine
from hotlever.studies.published_lever.layout_search import Solver
from hotlever.studies.published_lever.layouts import Layout
from hotlever.studies.published_lever.statements import LAST_V, MAIN, OPTIONS, SEARCHED, Readings
from hotlever.studies.radiation import radiated_heat
from hotlever.studies.thermoelectric_shift import shift_by_heat

#: Power (mW) up to which Eq. 12 has data on the hot branch.
WELL_COVERED_MW = 3.3
#: Groups of parameters that are said to be decoupled.
GROUPS = {"c_kappa": 0, "a0": 1, "a1": 1, "delta": 2, "n_d": 2, "p": 2}


def numbers_of(layout: Layout) -> dict[str, float]:
    """Compute what a layout shows, by the names of `MEANINGS`.

    Raises
    ------
    ComputationError
        If one of its levers cannot be solved.
    """
    levers = {option: Lever(layout.probe(option)) for option in OPTIONS}
    # as far as the resistances of heater and legs are compared
    main, to_K = levers[MAIN], 1600.0
    branch = main.branch(to_K)
    return {
        **_deviations(layout),
        **_points(main),
        **_knee(main, branch),
        **_power(main, branch),
        **_resistances(main, branch, to_K),
        **_options(levers),
        **_errors(layout),
        **_air(main, branch),
        **_beyond(main),
    }


def _deviations(layout: Layout) -> dict[str, float]:
    """Return the largest deviation from each statement, over what it may be off by."""
    readings = Solver(layout.length_um, None).readings(layout.values)
    return {each.name: float(np.abs(each.deviation(readings)[0]).max()) for each in SEARCHED}


def _points(main: Lever) -> dict[str, float]:
    biases = [
        main.circuit.bias(point.lever_V, point.current_mA) for point in paper.OPERATING_POINTS
    ]
    found = main.sweep(biases)
    off = [
        max(abs(row.lever_V / point.lever_V - 1.0), abs(row.current_mA / point.current_mA - 1.0))
        for point, row in zip(
            paper.OPERATING_POINTS, (found.isel(bias=n) for n in range(len(biases))), strict=True
        )
    ]
    return {"points_off": float(max(off)), "hot_bias_V": float(biases[-1])}


def _knee(main: Lever, branch: Branch) -> dict[str, float]:
    reasons = reasons_of_the_knee(main)
    ends, voltage, doping, legs = (step for _, step in steps_to_the_knee(reasons))
    knee = branch.knee
    if knee is None:
        raise ComputationError("the lever has no knee")
    return {
        "knee_K": knee.tip_K,
        "knee_V": knee.lever_V,
        "knee_mW": knee.power_mW,
        "by_ends_K": ends,
        "by_voltage_K": voltage,
        "by_doping_K": doping,
        "by_legs_K": legs,
        **{f"ramp_{name}": value for name, value in steps_at_the_knee(main).items()},
    }


def _power(main: Lever, branch: Branch) -> dict[str, float]:
    power = np.linspace(0.05, paper.HOTTEST_MW, 120)
    off = branch.tip_temperature(power) - EQ12.tip_temperature(power)
    last = main.sweep([LAST_V])
    knee = branch.knee
    assert knee is not None
    line = BranchLine.of(branch, knee.tip_K, knee.tip_K + SPAN_K)
    through = BranchLine.of(branch, knee.tip_K, knee.tip_K + SPAN_K, offset=False)
    return {
        "eq12_covered_K": float(np.abs(off[power <= WELL_COVERED_MW]).max()),
        "eq12_K": float(np.abs(off).max()),
        "eq12_last_K": float(off[-1]),
        "hottest_K": last.tip_K.item(),
        "hottest_mW": last.power_mW.item(),
        "straight_K": line.off_K,
        "proportional_K": through.off_K,
    }


def _resistances(main: Lever, branch: Branch, to_K: float) -> dict[str, float]:
    tip = np.linspace(600.0, min(branch.hottest_K, to_K), 120)
    parts = dataset_of_branch(main.probe, branch, branch.u_at(tip))
    ratio = (parts.legs_ohm / parts.heater_ohm).values
    over = np.flatnonzero(ratio >= 1.0)
    crossing = (
        float(np.interp(1.0, ratio[over[0] - 1 : over[0] + 1], tip[over[0] - 1 : over[0] + 1]))
        if over.size
        else float(tip[-1])
    )
    profile = heater_profile(main.solve([LAST_V])[0])
    lowly = profile.doping < 2.0 * main.probe.material.n_d
    return {
        "legs_prevail_K": crossing,
        "legs_share_1200": float(np.interp(paper.HEATER_PREVAILS_K, tip, ratio)),
        "heater_left": float(lowly.mean())
        * float(np.ptp(profile.position.values))
        / main.space.mesh.layout.heater_taper.length_um,
    }


def _options(levers: dict[str, Lever]) -> dict[str, float]:
    found: dict[str, float] = {}
    main = levers[MAIN].sweep(paper.RAMP)
    hot = main.tip_K.values > paper.MISPREDICTED_FROM_K
    described = hot & (main.tip_K.values <= paper.DESCRIBED_TO_K)
    for option, lever in levers.items():
        if option == MAIN:
            continue
        sweep = lever.sweep(paper.RAMP)
        key = option.replace(" ", "_")
        current = abs(sweep.current_mA.values / main.current_mA.values - 1.0)
        reader = abs(sweep.reader_V.values - main.reader_V.values) / main.reader_V.values.max()
        tip = abs(sweep.tip_K.values - main.tip_K.values)
        found |= {
            f"current_{key}": float(current.max()),
            f"reader_{key}": float(reader.max()),
            f"tip_{key}_K": float(tip[hot].max()),
            f"tip_{key}_described_K": float(tip[described].max()),
        }
    return found


def _errors(layout: Layout) -> dict[str, float]:
    """Errors and correlations of the options' parameters, by one noise for all observables."""
    found: dict[str, float] = {}
    names = tuple(PARAMETERS)
    groups = np.array([GROUPS[name] for name in names])
    apart = groups[:, None] != groups
    for option, rows in (("I", [1]), ("II", [1, 2]), ("III", [1, 2, 3])):
        probe = layout.probe(option)
        similar = SimilarLevers(Lever(probe, COARSE))
        readings = Readings(similar.linearised(probe, Reach(probe.circuit, LAST_V), None, names))
        values, slopes = readings.at_bias(paper.RAMP)
        values[3] += readings.branch.base_temperature_K
        shown = np.concatenate([slopes[row] / values[row].max() for row in rows])
        covariance = np.linalg.inv(shown.T @ shown)
        ours = np.sqrt(np.diag(covariance))
        printed = np.array([published(OPTIONS[option]).standard_error[name] for name in names])
        off = np.log(ours / printed)
        found |= {
            f"errors_{option}": float(np.exp(np.ptp(off) / 2.0)),
            f"noise_{option}": float(np.exp(-off.mean())),
            f"coupling_{option}": float(np.abs(covariance / np.outer(ours, ours))[apart].max()),
        }
    return found


def _air(main: Lever, branch: Branch) -> dict[str, float]:
    lever = main.in_medium("air")
    tips_of_k = (400.0, 600.0, 800.0, paper.KNEE_PREDICTED_K, 1150.0)
    ramp = lever.sweep(paper.RAMP)
    hottest = ramp.tip_K.values[-1].item()
    air = lever.branch(max(hottest, tips_of_k[-1]) + 20.0)
    factor = find_scale_factor(branch, air, hottest)
    tips = np.linspace(330.0, hottest, 120)
    power = air.power(tips)

    def off_law(k: float) -> float:
        return float(np.abs(EQ12.tip_temperature(power / k) - tips).max())

    best = minimize_scalar(off_law, bounds=(1.0, 2.0), method="bounded")
    share = (ramp.air_heat_mW / ramp.power_mW).values
    knee, own = air.knee, branch.knee
    if knee is None or own is None:
        raise ComputationError("the lever has no knee")
    by_knee = knee.power_mW / own.power_mW
    return {
        **{f"k_{tip:.0f}": float(air.power(tip) / branch.power(tip)) for tip in tips_of_k},
        "best_k": factor.best_k.item(),
        "best_k_K": factor.best_error_K.item(),
        "printed_k_K": error_of_one_factor(branch, air, paper.K_IN_AIR, hottest),
        "eq12_air_K": off_law(paper.K_IN_AIR),
        "eq12_k": float(best.x),
        "eq12_k_K": float(best.fun),
        "hottest_air_K": hottest,
        "knee_air_K": knee.tip_K,
        "knee_air_mW": knee.power_mW,
        "k_by_knee": by_knee,
        "k_by_knee_K": error_of_one_factor(branch, air, by_knee, hottest),
        "share_cold": float(share[0]),
        "share_hot": float(share[-1]),
    }


def _beyond(main: Lever) -> dict[str, float]:
    radiated = radiated_heat(main.probe, [paper.HOTTEST_TIP_K], 1.0).squeeze()
    biases = [
        main.circuit.bias(point.lever_V, point.current_mA) for point in paper.OPERATING_POINTS
    ]
    moved = shift_by_heat(main, biases).moved_nm
    near = _one_sided(main.probe)
    return {
        "radiated_uW": 1e3 * radiated.radiated_mW.item(),
        "radiated_share": (radiated.radiated_mW / radiated.power_mW).item(),
        "shift_nm": float(abs(moved).max()),
        "shift_along_nm": float(moved.sel(polarity=1).max()),
        "one_sided_K": near.best_error_K.item(),
        "one_sided_growth": float(near.k.max() / near.k.min() - 1.0),
        "tip_carries_K": carried_by(main.probe, Suspect.IN_VACUUM).shift_K,
        "tip_in_air_K": carried_by(main.probe.in_medium("air"), Suspect.IN_AIR).shift_K,
        "without_heat_carried_K": described_without(main.probe).off_K.max().item(),
    }


def _one_sided(probe: Probe) -> Any:
    lever = Lever(probe, COARSE)
    over = Lever(probe.with_(surface_gap_um=1.0).in_medium("air"), COARSE, space=lever.space)
    return find_scale_factor(lever.branch(), over.branch())
