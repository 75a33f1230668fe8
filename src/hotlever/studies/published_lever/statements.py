"""What the paper prints of its lever, as data: a value, and half the width of where it may lie.

A printed digit may be half a unit off, a spread is what the paper says, and where it says "about"
half a unit of the last digit that it gives counts. Between the limits nothing is likelier than
anything else (JCGM 100:2008, 4.3.7). A statement that is a curve, or several points, counts once.
A branch is read where a statement asks for it, with derivatives by dimensions and parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever import spieser2017 as paper
from hotlever.errors import ComputationError
from hotlever.estimate.power_law import EQ12
from hotlever.lever.branch import Branch, branch_end
from hotlever.lever.observables import Linearised, knee_by_parameter
from hotlever.piecewise import Piecewise
from hotlever.probe.circuit import Circuit
from hotlever.types import Array


@dataclass(frozen=True)
class Readings:
    """Reads a branch by tip temperature, bias or power, at its knee, or nearest to a point.

    Derivatives are those at a fixed rise of the tip, and what moves the state along the branch
    until the condition holds again.

    Attributes
    ----------
    linearised : Linearised
        The branch, and how it changes with some parameters.
    """

    linearised: Linearised

    @property
    def branch(self) -> Branch:
        """The branch."""
        return self.linearised.branch

    @property
    def circuit(self) -> Circuit:
        """The circuit that biases are of."""
        return self.linearised.probe.circuit

    def at_tip(self, tip_K: ArrayLike) -> tuple[Array, Array]:
        """Return what the lever shows at tip temperatures (K).

        Returns
        -------
        values : ndarray, shape (4, n)
            V_l (V), I_h (mA), V_r (V) and the rise of the tip (K).
        slopes : ndarray, shape (4, n, p)
            Derivatives by the parameters.

        Raises
        ------
        ComputationError
            If the branch ends before.
        """
        u = self.branch.u_at(np.atleast_1d(tip_K))
        if np.isnan(u).any():
            raise ComputationError(f"the branch ends at {self.branch.hottest_K:.0f} K")
        return self._at(u, np.zeros((u.size, len(self.linearised.names))))

    def at_bias(self, bias_V: ArrayLike) -> tuple[Array, Array]:
        """Return the same at biases (V), as a slow ramp meets them.

        Raises
        ------
        BranchEndError
            If the ramp does not reach one of them.
        """
        reading = self.branch.read(self.circuit, np.atleast_1d(np.asarray(bias_V, dtype=float)))
        u = reading.u
        if np.isnan(u).any():
            raise branch_end(self.branch, reading)
        current = self.branch.curve(u)[:, 1]
        names, along = self.linearised.names, self.branch.curve(u, 1)
        slopes = self.linearised.output_slopes_at(u)
        missing = self.circuit.bias(slopes[:, 0], slopes[:, 1])
        missing = missing + np.stack([self.circuit.bias_by(n, current) for n in names], axis=1)
        return self._at(u, -missing / self.circuit.bias(along[:, 0], along[:, 1])[:, None])

    def at_power(self, power_mW: ArrayLike) -> tuple[Array, Array]:
        """Return the same at powers (mW).

        Raises
        ------
        ComputationError
            If one of them has no state, or several.
        """
        u = self.branch.by_power.u(np.atleast_1d(np.asarray(power_mW, dtype=float)))
        if np.isnan(u).any():
            raise ComputationError("a power has no state on the branch, or several")
        lever_V, current = self.branch.curve(u)[:, :2].T[..., None]
        along, slopes = self.branch.curve(u, 1), self.linearised.output_slopes_at(u)
        missing = lever_V * slopes[:, 1] + current * slopes[:, 0]
        return self._at(u, -missing / (lever_V * along[:, [1]] + current * along[:, [0]]))

    def _at(self, u: Array, u_by_parameter: Array) -> tuple[Array, Array]:
        """Return the same at places that move with the parameters, by (n, p)."""
        moved = self.branch.curve(u, 1)[..., None] * u_by_parameter[:, None]
        slopes = self.linearised.output_slopes_at(u) + moved
        return self.branch.curve(u).T, np.moveaxis(slopes, 1, 0)

    def knee_K(self) -> tuple[float, Array]:
        """Return the tip temperature (K) where V_l is highest, and its derivatives, (p,).

        Raises
        ------
        ComputationError
            If V_l rises to the end of the branch.
        """
        knee, solved = self.branch.knee, self.linearised
        if knee is None:
            raise ComputationError("the lever has no knee")
        return knee.tip_K, knee_by_parameter(self.branch, solved.output_slopes, solved.names)

    def off_point(
        self, point: tuple[float, float], unit: tuple[float, float]
    ) -> tuple[float, Array]:
        """Return how far the I-V curve passes a point of V_l (V) and I_h (mA) by.

        Parameters
        ----------
        point, unit : tuple of float
            Distances are counted in units of their own.

        Returns
        -------
        distance : float
            With a sign: positive on the left of the curve, seen in the direction of rising tips.
        slopes : ndarray, shape (p,)
            Derivatives by the parameters.
        """
        curve = self.branch.curve
        away = [
            (Piecewise(curve.c[..., axis], curve.x) - value) * (1.0 / size)
            for axis, (value, size) in enumerate(zip(point, unit, strict=True))
        ]
        square = Piecewise((away[0] * away[0]).c + (away[1] * away[1]).c, curve.x)
        level = self.branch.turns(square)
        u = float(level[np.argmin(square(level))])
        along = np.array([each(u, 1) for each in away]).ravel()
        normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        slopes = self.linearised.output_slopes_at(np.array([u]))[0, :2]
        distance = normal @ [each(u).item() for each in away]
        return float(distance), normal @ (slopes / np.reshape(unit, (2, 1)))


# --- what is printed -----------------------------------------------------------------------------

#: The published parameter sets that describe the measured ramp of lever 1, by what they are called
#: here; the first is that of the simulations that are printed.
OPTIONS = {
    "III": "option III",
    "I": "option I",
    "II": "option II",
    "n_d held": "lever 1, n_d fixed",
}
MAIN = next(iter(OPTIONS))
#: Half a unit of the last digit of printed voltages (V) and currents (mA).
HALF_DIGIT = 0.005
#: A reading of the knee off the ramp: half of what its neighbours there are apart (K).
KNEE_READ_K = 25.0
#: Power (mW) up to which Eq. 12 has data on the hot branch.
WELL_COVERED_MW = 3.3
#: Groups of parameters that are said to be decoupled.
GROUPS = {"c_kappa": 0, "a0": 1, "a1": 1, "delta": 2, "n_d": 2, "p": 2}

# What is off, in units of what it may be off by, (n,), with derivatives by parameters, (n, p).
Deviation = tuple[Array, Array]


@dataclass(frozen=True)
class Printed:
    """A statement of the paper that a layout meets or not, with what the search needs of it.

    Attributes
    ----------
    name : str
    where : str
        Table, figure, equation or section of the paper.
    words : str
        What is printed, and how far it may be off.
    deviation : callable
        From the readings of the published options, by their names in `OPTIONS`.
    """

    name: str
    where: str
    words: str
    deviation: Callable[[Mapping[str, Readings]], Deviation]


def _printed_point(name: str) -> paper.PublishedPoint:
    """Return a published operating point: the plateau, the knee or the hot one."""
    return next(point for point in paper.OPERATING_POINTS if point.name == name)


def _operating_point(options: Mapping[str, Readings]) -> Deviation:
    values, slopes = options[MAIN].at_tip(paper.KNEE_PREDICTED_K)
    knee = _printed_point("knee")
    off = (values[:2, 0] - [knee.lever_V, knee.current_mA]) / HALF_DIGIT
    return off, slopes[:2, 0] / HALF_DIGIT


def _passes(point: paper.PublishedPoint, options: Mapping[str, Readings]) -> Deviation:
    at = (point.lever_V, point.current_mA)
    distance, slopes = options[MAIN].off_point(at, (HALF_DIGIT, HALF_DIGIT))
    return np.array([distance]), slopes[None]


def _on_the_ramp(options: Mapping[str, Readings]) -> Deviation:
    circuit, names = options[MAIN].circuit, options[MAIN].linearised.names
    hot = _printed_point("hot")
    beyond = circuit.bias(hot.lever_V, hot.current_mA) - paper.RAMP[-1]
    unit = circuit.bias(HALF_DIGIT, HALF_DIGIT)
    by = np.array([circuit.bias_by(name, hot.current_mA) for name in names])
    return np.array([max(beyond, 0.0)]) / unit, by[None] * (beyond > 0.0) / unit


def _knee(options: Mapping[str, Readings]) -> Deviation:
    knee_K, slopes = options[MAIN].knee_K()
    return np.array([knee_K - paper.KNEE_PREDICTED_K]) / KNEE_READ_K, slopes[None] / KNEE_READ_K


def _power_law(options: Mapping[str, Readings]) -> Deviation:
    power_mW = np.array([1.0, 2.0, 2.75, 3.3, paper.HOTTEST_MW])
    values, slopes = options[MAIN].at_power(power_mW)
    off = options[MAIN].branch.base_temperature_K + values[3] - EQ12.tip_temperature(power_mW)
    return off / paper.POWER_LAW_SPREAD_K, slopes[3] / paper.POWER_LAW_SPREAD_K


def _hottest(options: Mapping[str, Readings]) -> Deviation:
    values, slopes = options[MAIN].at_bias(paper.RAMP[-1])
    rise = paper.HOTTEST_TIP_K - options[MAIN].branch.base_temperature_K
    spread = raman_error(rise)
    return (values[3] - rise) / spread, slopes[3] / spread


def raman_error(rise_K: Any) -> Any:
    """Return the stated error of the paper's thermometer (K) at a rise above room temperature."""
    return paper.RAMAN_ERROR_K + paper.RAMAN_ERROR_SHARE * rise_K


def _beside_main(
    options: Mapping[str, Readings], option: str
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return what an option and the main one show at some biases of the ramp."""
    bias_V = np.array(paper.RAMP)[[4, 8, 12, 16, 18, 20, 22, 24]]
    return options[option].at_bias(bias_V), options[MAIN].at_bias(bias_V)


def _same_current(option: str, options: Mapping[str, Readings]) -> Deviation:
    (ours, by), (main, main_by) = _beside_main(options, option)
    ratio = ours[1] / main[1]
    slopes = (by[1] - ratio[:, None] * main_by[1]) / main[1][:, None]
    return (ratio - 1.0) / paper.CURRENT_ERROR, slopes / paper.CURRENT_ERROR


def _same_reader(option: str, options: Mapping[str, Readings]) -> Deviation:
    (ours, by), (main, main_by) = _beside_main(options, option)
    # observables are compared over their largest values
    unit = paper.CURRENT_ERROR * main[2].max()
    return (ours[2] - main[2]) / unit, (by[2] - main_by[2]) / unit


def _same_tip(options: Mapping[str, Readings]) -> Deviation:
    (ours, by), (main, main_by) = _beside_main(options, "n_d held")
    unit = raman_error(main[3])
    return (ours[3] - main[3]) / unit, (by[3] - main_by[3]) / unit[:, None]


#: What a search is given: all that has derivatives.
SEARCHED: tuple[Printed, ...] = (
    Printed(
        "knee point",
        "Figs. 6a and 7b",
        "{0.lever_V} V and {0.current_mA} mA at a tip of {1:.0f} K, to half a unit of the last "
        "digits".format(_printed_point("knee"), paper.KNEE_PREDICTED_K),
        _operating_point,
    ),
    *(
        Printed(
            f"{point.name} point",
            "Fig. 7b",
            f"the I-V curve passes {point.lever_V:.2f} V, {point.current_mA} mA",
            partial(_passes, point),
        )
        for point in (_printed_point("plateau"), _printed_point("hot"))
    ),
    Printed(
        "hot point on the ramp",
        "Section IV, Fig. 7b",
        f"the bias of the hot point is at most {paper.RAMP[-1]:.0f} V",
        _on_the_ramp,
    ),
    Printed(
        "knee temperature",
        "Fig. 6a",
        f"the highest V_l at {paper.KNEE_PREDICTED_K:.0f} K, read off the ramp to "
        f"{KNEE_READ_K:.0f} K",
        _knee,
    ),
    Printed(
        "Eq. 12",
        "Eq. 12, Fig. 6b",
        f"T(P) within {paper.POWER_LAW_SPREAD_K:.0f} K of it up to {paper.HOTTEST_MW:.0f} mW",
        _power_law,
    ),
    Printed(
        "hottest tip",
        "Section IV",
        f"{paper.HOTTEST_TIP_K:.0f} K at {paper.RAMP[-1]:.0f} V, to the thermometer's error",
        _hottest,
    ),
    *(
        Printed(
            f"current, {option}",
            f"{where}, Figs. 3 and 4",
            f"{OPTIONS[option]} has the I_h of option III within {paper.CURRENT_ERROR:.0%}",
            partial(_same_current, option),
        )
        for option, where in (("I", "Table I"), ("II", "Table I"), ("n_d held", "Table II"))
    ),
    *(
        Printed(
            f"reader, {option}",
            f"{where}, Figs. 3 and 4",
            f"{OPTIONS[option]} has the V_r of option III, over its largest value within "
            f"{paper.CURRENT_ERROR:.0%}",
            partial(_same_reader, option),
        )
        for option, where in (("II", "Table I"), ("n_d held", "Table II"))
    ),
    Printed(
        "tip, n_d held",
        "Table II",
        f"{OPTIONS['n_d held']} has the T_tip of option III within the thermometer's error",
        _same_tip,
    ),
)
