"""Layouts that what is printed leaves: least squares over the dimensions, from drawn errors.

Of each layout the length is given, since in vacuum nothing printed determines it. Everything else
that is drawn, and the series resistance, is estimated from all that is printed and has derivatives
(`hotlever.studies.published_lever.statements.SEARCHED`) and from what drawings of such levers are
like (`DRAWN`). With printed values off by errors that are drawn within what they may be, and
dimensions expected elsewhere within what is known of them, the layouts so found scatter as the
posterior does (randomise, then optimise; J. M. Bardsley et al., SIAM J. Sci. Comput. 36, A1895
(2014)).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from hotlever import spieser2017 as paper
from hotlever.errors import HotleverError
from hotlever.lever import Branch, Lever
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE
from hotlever.lever.observables import Linearised
from hotlever.lever.similar import SimilarLevers
from hotlever.materials.departures import DEPARTURES
from hotlever.probe import MeshOptions
from hotlever.studies.published_lever.layouts import probe_of
from hotlever.studies.published_lever.statements import LAST_V, OPTIONS, SEARCHED, Readings
from hotlever.types import Array


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
            reach = FarEnough(probe.circuit, LAST_V, hottest_K=self.options.hottest_K)
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
