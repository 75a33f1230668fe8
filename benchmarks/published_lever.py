"""The lever of the paper from all that is printed of it: data of hotlever.studies.published_lever.

python benchmarks/published_lever.py search     layouts.toml: layouts that suit what is printed
python benchmarks/published_lever.py numbers    numbers.csv: what each of them shows of it
python benchmarks/published_lever.py knee       knee.csv: what carries how much of the 50 K that
                                                the knee is off, in those with a weight

Layouts are found by least squares over the dimensions, from drawn errors. Of each the length is
given, since in vacuum nothing printed determines it. Everything else that is drawn, and the series
resistance, is estimated from all that is printed and has derivatives
(`hotlever.studies.published_lever.statements.SEARCHED`) and from what drawings of such levers are
like (`DRAWN`). With printed values off by errors that are drawn within what they may be, and
dimensions expected elsewhere within what is known of them, the layouts so found scatter as the
posterior does (randomise, then optimise; J. M. Bardsley et al., SIAM J. Sci. Comput. 36, A1895
(2014)).
"""

from __future__ import annotations

import csv
import io
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares, minimize_scalar

from hotlever import spieser2017 as paper
from hotlever.errors import ComputationError, HotleverError
from hotlever.estimate.power_law import EQ12
from hotlever.files import write_text
from hotlever.lever import Branch, Lever
from hotlever.lever.branch import Reach
from hotlever.lever.dataset import dataset_of_branch
from hotlever.lever.fields import heater_profile
from hotlever.lever.lever import COARSE
from hotlever.lever.observables import Linearised
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import PARAMETERS, published
from hotlever.materials.departures import DEPARTURES
from hotlever.probe import MeshOptions, Probe
from hotlever.studies import published_lever
from hotlever.studies.air_scaling import error_of_one_factor, find_scale_factor
from hotlever.studies.knee_study import (
    Suspect,
    carried_by,
    described_without,
    knee_K,
    reasons_of_the_knee,
    steps_at_the_knee,
    steps_to_the_knee,
)
from hotlever.studies.linear_branch import SPAN_K, BranchLine
from hotlever.studies.published_lever.ensemble import (
    REFERENCE,
    CandidateLayout,
    probe_of,
    stored_ensemble,
    stored_layouts,
)
from hotlever.studies.published_lever.statements import (
    GROUPS,
    MAIN,
    OPTIONS,
    SEARCHED,
    WELL_COVERED_MW,
    Readings,
)
from hotlever.studies.radiation import radiated_heat
from hotlever.studies.thermoelectric_shift import shift_by_heat
from hotlever.types import Array

# --- the search ---------------------------------------------------------------------------------


class Drawn(NamedTuple):
    """What is known of a dimension beforehand: a factor to either side of a likely value.

    Attributes
    ----------
    likely : float
        In µm or Ω, or as a share of the length.
    spread : float
        Standard deviation of the logarithm; of the value itself if none is likelier than zero.
    of_length : bool
    """

    likely: float
    spread: float
    of_length: bool = False

    def value(self, z: float, length_um: float) -> float:
        """Return the value that is so many standard deviations from the likely one."""
        if self.likely == 0.0:
            return self.spread * z
        return self.likely * (length_um if self.of_length else 1.0) * float(np.exp(self.spread * z))

    def rate(self, z: float, length_um: float) -> float:
        """Return the derivative of the value by these."""
        return self.spread * (self.value(z, length_um) if self.likely else 1.0)

    def standard(self, value: float, length_um: float) -> float:
        """Return how many standard deviations a value is from the likely one."""
        if self.likely == 0.0:
            return value / self.spread
        return float(np.log(value / self.value(0.0, length_um))) / self.spread


#: What is estimated. Thickness and heater are nominal values of the paper, the others what its
#: picture of the lever and its text on the circuit leave: parts of some micrometres, legs several
#: times as long as they are wide, and a resistor like those that other such levers have.
DRAWN: dict[str, Drawn] = {
    "centre_leg_width_um": Drawn(0.11, 0.5, of_length=True),
    "outer_leg_width_um": Drawn(0.07, 0.5, of_length=True),
    "gap_um": Drawn(3.0, 0.25),
    "bridge_width_um": Drawn(4.0, 0.25),
    "heater_length_um": Drawn(paper.HEATER_LENGTH_UM, 0.06),
    "heater_width_um": Drawn(2.0, 0.4),
    "thickness_um": Drawn(paper.THICKNESS_UM, 0.025),
    "series_resistance_ohm": Drawn(5600.0, 0.1),
}


@dataclass(frozen=True)
class SearchOptions:
    """How layouts are searched for.

    Attributes
    ----------
    hottest_K : float
        Up to where branches are followed at least.
    most : tuple of int
        Layouts that a search solves at most on the coarse mesh, and then on the usual one.
    tolerance : float
        Change of the sum of squares, relative, at which a search ends.
    refused : float
        Deviation that a layout has which cannot be solved.
    emphasis : float
        By how much deviations from the statement count more that comes first.
    """

    hottest_K: float = 1300.0
    most: tuple[int, int] = (14, 4)
    tolerance: float = 1e-3
    refused: float = 100.0
    emphasis: float = 10.0


@dataclass(frozen=True)
class FarEnough(Reach):
    """A reach that goes up to a tip temperature (K) at least."""

    hottest_K: float = 0.0

    def __call__(self, branch: Branch) -> bool:
        """Return whether a branch goes far enough."""
        return branch.hottest_K >= self.hottest_K and super().__call__(branch)


@dataclass
class Solver:
    """Solves the published options of a layout, each from the latest one like it."""

    length_um: float
    mesh: MeshOptions | None
    options: SearchOptions = field(default_factory=SearchOptions)
    _similar: dict[str, SimilarLevers] = field(default_factory=dict)
    _latest: dict[str, Linearised] = field(default_factory=dict)

    def readings(self, values: Mapping[str, float]) -> dict[str, Readings]:
        """Return the branches of a layout by option, with derivatives by its values.

        Raises
        ------
        HotleverError
            If it cannot be drawn or solved.
        """
        try:
            return self._solved(values)
        except HotleverError:
            if not self._similar:
                raise
            # too far for the mesh to follow
            self._similar, self._latest = {}, {}
            return self._solved(values)

    def _solved(self, values: Mapping[str, float]) -> dict[str, Readings]:
        found = {}
        for option in OPTIONS:
            probe = probe_of(self.length_um, values, option)
            if option not in self._similar:
                self._similar[option] = SimilarLevers(Lever(probe, self.mesh))
            reach = FarEnough(probe.circuit, paper.RAMP[-1], hottest_K=self.options.hottest_K)
            found[option] = self._similar[option].linearised(
                probe, reach, self._latest.get(option), tuple(values)
            )
        self._latest = found
        return {option: Readings(each) for option, each in found.items()}


@dataclass(frozen=True)
class Found:
    """A layout that was found.

    Attributes
    ----------
    values : dict of str to float
        Of `DRAWN`, and coefficients of laws if they were estimated.
    square : float
        Sum of squares at the optimum, in units of variances.
    evaluations : int
    """

    values: dict[str, float]
    square: float
    evaluations: int


def search(
    length_um: float,
    *,
    rng: np.random.Generator | None = None,
    start: Mapping[str, float] | None = None,
    first: str = "",
    uncertain_laws: bool = False,
    options: SearchOptions | None = None,
) -> Found:
    """Find the layout of a length that suits what is printed best, or that after drawn errors.

    Parameters
    ----------
    length_um : float
    rng : numpy.random.Generator, optional
        Of the errors; without it there are none.
    start : mapping of str to float, optional
        Values of `DRAWN`; by default the likely ones.
    first : str
        A statement that is to be met before the others, by its name.
    uncertain_laws : bool
        Whether the laws may depart from the printed ones, all options' alike.
    options : SearchOptions, optional

    Raises
    ------
    HotleverError
        If the start cannot be solved.
    """
    options = options or SearchOptions()
    unknowns = dict(DRAWN)
    if uncertain_laws:
        # laws are known to within their departures alone
        coefficients = [name for law in DEPARTURES.values() for name in law.names]
        unknowns |= dict.fromkeys(coefficients, Drawn(0.0, 1.0))
    errors, expected = np.zeros(len(SEARCHED)), np.zeros(len(unknowns))
    if rng is not None:
        errors = rng.uniform(-1.0, 1.0, errors.size)
        expected = rng.standard_normal(expected.size)
    goal = Goal(length_um, unknowns, expected, errors, first, options)
    z, count, square = goal.standard(start or {}), 0, np.nan
    for mesh, most in zip((COARSE, None), options.most, strict=True):
        goal.solver, goal.known = Solver(length_um, mesh, options), {}
        best = least_squares(
            lambda z: goal.at(z)[0],
            z,
            jac=lambda z: goal.at(z)[1],
            ftol=options.tolerance,
            xtol=options.tolerance,
            max_nfev=most,
        )
        z, square, count = best.x, 2.0 * float(best.cost), count + best.nfev
    return Found(goal.values(z), square, count)


@dataclass
class Goal:
    """What a search makes small: residuals in standard deviations.

    Its coordinates are how far unknowns are from their likely values, in standard deviations.

    Attributes
    ----------
    length_um : float
    unknowns : mapping of str to Drawn
    expected : ndarray, shape (drawn,)
        What is expected of the coordinates.
    errors : ndarray, shape (searched,)
        Of what is printed, in units of what it may be off by.
    first : str
        The statement that comes first, if one does.
    options : SearchOptions
    solver : Solver
    known : dict
        Residuals and their derivatives by coordinates.
    """

    length_um: float
    unknowns: Mapping[str, Drawn]
    expected: Array
    errors: Array
    first: str
    options: SearchOptions
    solver: Solver = field(init=False)
    known: dict[bytes, tuple[Array, Array]] = field(default_factory=dict)

    def standard(self, values: Mapping[str, float]) -> Array:
        """Return the coordinates of a layout; of what is left out, the likely ones."""
        coordinates = [
            drawn.standard(values[name], self.length_um) if name in values else 0.0
            for name, drawn in self.unknowns.items()
        ]
        return np.array(coordinates)

    def values(self, z: Array) -> dict[str, float]:
        """Return the layout at some coordinates."""
        pairs = zip(self.unknowns.items(), z.tolist(), strict=True)
        return {name: drawn.value(at, self.length_um) for (name, drawn), at in pairs}

    def at(self, z: Array) -> tuple[Array, Array]:
        """Return residuals and their derivatives."""
        key = z.tobytes()
        if key not in self.known:
            try:
                self.known[key] = self._solved(z)
            except HotleverError:
                if not self.known:
                    raise
                # a step that the search takes back
                size = next(iter(self.known.values()))[0].size
                self.known[key] = np.full(size, self.options.refused), np.zeros((size, z.size))
        return self.known[key]

    def _solved(self, z: Array) -> tuple[Array, Array]:
        values = self.values(z)
        pairs = zip(self.unknowns.values(), z.tolist(), strict=True)
        by_coordinate = np.array([drawn.rate(at, self.length_um) for drawn, at in pairs])
        rows, slopes = [z - self.expected], [np.eye(z.size)]
        readings = self.solver.readings(values)
        for printed, error in zip(SEARCHED, self.errors, strict=True):
            off, by = printed.deviation(readings)
            # a rectangle has a third of the square of half its width, and points share a statement
            weight = np.sqrt(3.0 / off.size)
            if printed.name == self.first:
                weight *= self.options.emphasis
            rows.append(weight * (off - error))
            slopes.append(weight * by * by_coordinate)
        return np.concatenate(rows), np.vstack(slopes)


# --- what a layout shows -------------------------------------------------------------------------


def numbers_of(layout: CandidateLayout) -> dict[str, float]:
    """Compute what a layout shows, by the names of its columns.

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


def _deviations(layout: CandidateLayout) -> dict[str, float]:
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
    last = main.sweep([paper.RAMP[-1]])
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
    profile = heater_profile(main.solve([paper.RAMP[-1]])[0])
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


def _errors(layout: CandidateLayout) -> dict[str, float]:
    """Errors and correlations of the options' parameters, by one noise for all observables."""
    found: dict[str, float] = {}
    names = tuple(PARAMETERS)
    groups = np.array([GROUPS[name] for name in names])
    apart = groups[:, None] != groups
    for option, rows in (("I", [1]), ("II", [1, 2]), ("III", [1, 2, 3])):
        probe = layout.probe(option)
        similar = SimilarLevers(Lever(probe, COARSE))
        readings = Readings(
            similar.linearised(probe, Reach(probe.circuit, paper.RAMP[-1]), None, names)
        )
        values, slopes = readings.at_bias(np.array(paper.RAMP))
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


# --- the files -----------------------------------------------------------------------------------

FOLDER = Path(published_lever.__file__).parent


@dataclass(frozen=True)
class Drawing:
    """Which layouts are searched for.

    Attributes
    ----------
    shortest_um, longest_um : float
        Lengths between which levers are drawn, their logarithms evenly: with an air of a sphere of
        60 µm around it a lever is shorter than the sphere is wide.
    drawn : int
        Layouts after drawn errors.
    best_um : tuple of float
        Lengths of the layouts that suit best.
    first : str
        What is printed that another layout meets before all else, of `first_um`.
    """

    shortest_um: float = 25.0
    longest_um: float = 110.0
    drawn: int = 16
    best_um: tuple[float, ...] = (25.0, 31.0, 44.0, 54.4, 90.0)
    first: str = "Eq. 12"
    first_um: float = 54.4
    seed: int = field(default=1, repr=False)

    def lengths(self, rng: np.random.Generator) -> list[float]:
        """Return the lengths (µm) that are drawn, one in each of even strata."""
        share = (np.arange(self.drawn) + rng.random(self.drawn)) / self.drawn
        lengths = self.shortest_um * (self.longest_um / self.shortest_um) ** share
        return [round(length, 2) for length in lengths.tolist()]


def write_layouts(drawing: Drawing) -> None:
    """Search for all, and write them."""
    found: list[tuple[str, float, bool, Found]] = []
    for length in drawing.best_um:
        found.append((f"best of {length:.0f} µm", length, False, search(length)))
        said(found)
    first = search(drawing.first_um, first=drawing.first)
    found.append((f"{drawing.first} first", drawing.first_um, False, first))
    said(found)
    departed = search(drawing.first_um, uncertain_laws=True)
    found.append(("uncertain laws", drawing.first_um, False, departed))
    said(found)
    rng = np.random.default_rng(drawing.seed)
    for number, length in enumerate(drawing.lengths(rng)):
        errors = np.random.default_rng([drawing.seed, number])
        try:
            layout = search(length, rng=errors)
        except HotleverError as error:
            print(f"{length} µm: {error}", flush=True)
            continue
        found.append((f"{length:.1f} µm", length, True, layout))
        said(found)
    head = (
        "# Layouts of the lever of Spieser et al. (2017) that suit what is printed of it, written\n"
        "# by benchmarks/published_lever.py search; dimensions in µm, the series resistance in Ω.\n"
    )
    write_text(FOLDER / "layouts.toml", head + "".join(as_toml(*each) for each in found))


def as_toml(name: str, length: float, drawn: bool, found: Found) -> str:
    """Return a layout as its file has it."""
    return (
        f'\n[[layout]]\nname = "{name}"\nlength_um = {length}\ndrawn = {str(drawn).lower()}\n'
        f"square = {found.square:.2f}\n[layout.values]\n"
        + "".join(f"{key} = {value:.6g}\n" for key, value in found.values.items())
    )


def said(found: list[tuple[str, float, bool, Found]]) -> None:
    """Print the latest."""
    name, _, _, one = found[-1]
    values = ", ".join(f"{key} {value:.4g}" for key, value in one.values.items())
    print(
        f"{time.process_time():6.0f} s  {name}: {one.square:.2f} after {one.evaluations}; {values}",
        flush=True,
    )


def write_numbers() -> None:
    """Compute what each layout shows, and write the table."""
    rows: list[dict[str, Any]] = []
    for name, layout in stored_layouts().items():
        rows.append({"layout": name, **numbers_of(layout)})
        print(f"{time.process_time():6.0f} s  {name}", flush=True)
    write_table(FOLDER / "numbers.csv", rows)


def write_knee() -> None:
    """Compute what each suspect carries in the nearest layout, the reference, and all drawn ones.

    Coefficients of laws in the nearest alone.
    """
    found, chosen = stored_layouts(), stored_ensemble()
    drawn = [name for name, layout in found.items() if layout.drawn]
    coefficients = [name for law in DEPARTURES.values() for name in law.names]
    rows: list[dict[str, Any]] = []
    for name in (chosen.nearest, REFERENCE, *drawn):
        probe = found[name].probe()
        own_K = knee_K(probe)
        for suspect in (*Suspect, *(coefficients if name == chosen.nearest else ())):
            if suspect == Suspect.IN_AIR:
                continue
            try:
                carried = carried_by(probe, suspect, own_K)
            except ComputationError as error:
                print(f"{name}, {suspect}: {error}", flush=True)
                continue
            numbers = {
                key: float(getattr(carried, key)) for key in ("moved_K", "shift_K", "ramp_K")
            }
            parameters = {
                key: float(carried.fitted.material.model_dump()[key]) for key in PARAMETERS
            }
            rows.append({"layout": name, "suspect": str(suspect), **numbers, **parameters})
            print(f"{time.process_time():6.0f} s  {name}, {suspect}: {numbers}", flush=True)
        write_table(FOLDER / "knee.csv", rows)


def write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write rows of one table, numbers to five digits."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(
        {key: f"{value:.5g}" if isinstance(value, float) else value for key, value in row.items()}
        for row in rows
    )
    write_text(path, text.getvalue())


def main(words: Iterable[str]) -> None:
    """Write what is asked for."""
    print(f"{len(SEARCHED)} statements have derivatives")
    for word in words:
        {
            "search": lambda: write_layouts(Drawing()),
            "numbers": write_numbers,
            "knee": write_knee,
        }[word]()


if __name__ == "__main__":
    main(sys.argv[1:])
