"""The design of a lever that makes a quantity least or greatest, by exact derivatives.

Sequential quadratic programming (SciPy's SLSQP; D. Kraft, DFVLR-FB 88-28 (1988)) over dimensions,
material parameters and the series resistor, each within bounds, and with bounds on other
quantities too. One branch is solved for each design that is tried; where it is asked how
sensitively distances are read, of a coarse lever with panels of its own, and two for each
derivative. Start and best are always solved on the usual mesh.

Quantities are of a working point or of the knee. At a fixed rise of the tip the derivatives of V_l,
I_h and T_tip by a dimension or a material parameter are exact (`hotlever.lever.observables`); the
state then moves along the branch until it is a working point, or the knee, again:
dq = ∂q + q' du with g' du = −∂g, where g = 0 says which state it is. How sensitively a lever reads
its distance to a surface depends on the air, which moves with every dimension, so that it is
differentiated by levers beside it, each with a mesh and panels of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hotlever.errors import ComputationError, HotleverError, InputError, unknown_name
from hotlever.lever.branch import TIP_RISE, Branch, Reach
from hotlever.lever.continuation import continued
from hotlever.lever.lever import COARSE, Lever, State
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.observables import by_parameter
from hotlever.lever.reader import Reader, Signal
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.solved_states import solve_at
from hotlever.lever.transient.modes import slowest_modes
from hotlever.probe import Circuit, Probe
from hotlever.probe.probe import field_of
from hotlever.probe.probe_parameters import parameters_of
from hotlever.types import Array, Progress
from hotlever.work import one_blas_thread

#: Quantities of the knee, and what they are of any state.
OF_THE_KNEE = {
    "knee_K": "tip_K",
    "knee_mW": "power_mW",
    "knee_bias_V": "bias_V",
    "knee_V": "lever_V",
    "knee_mA": "current_mA",
}
#: From the working point up to the knee.
DISTANCES = {"knee_distance_K": "knee_K", "knee_distance_V": "knee_bias_V"}
#: Of a lever in air over a surface, see `hotlever.lever.reader`.
OF_THE_READER = ("dV_dz_V_per_um", "dlnR_dz_per_um", "resolution_nm_per_rtHz")
#: All that may be made least or greatest, or bounded.
QUANTITIES = (*OF_THE_KNEE.values(), "time_constant_us", *OF_THE_READER, *OF_THE_KNEE, *DISTANCES)


@dataclass(frozen=True)
class WorkingPoint:
    """Where a lever works: the state of a tip temperature, a bias or a power.

    Attributes
    ----------
    column : str
        ``tip_K``, ``bias_V`` or ``power_mW``.
    value : float
        K, V or mW.
    """

    column: str
    value: float

    def is_reached(self, branch: Branch, circuit: Circuit) -> bool:
        """Return whether a branch goes as far."""
        if self.column == "bias_V":
            return Reach(circuit, self.value)(branch)
        if self.column == "power_mW":
            return bool(np.any(branch.values[:, 0] * branch.values[:, 1] >= self.value))
        return branch.values[-1, TIP_RISE] >= self.value - branch.base_temperature_K

    def u(self, branch: Branch, circuit: Circuit) -> float:
        """Return its place on a branch; NaN if that has none."""
        value = np.array([self.value])
        if self.column == "bias_V":
            return float(branch.read(circuit, value).u[0])
        if self.column == "power_mW":
            return float(branch.by_power.u(value)[0])
        return float(branch.u_at(value)[0])

    def __str__(self) -> str:
        unit = self.column.rpartition("_")[2]
        return f"{self.value:g} {unit}"


class SolvedDesign:
    """A probe solved up to its working point, or past its knee.

    Parameters
    ----------
    similar : SimilarLevers
        With a mesh that can follow the probe's dimensions.
    probe : Probe
    point : WorkingPoint
    names : sequence of str
        Parameters of the derivatives, see `hotlever.probe.probe_parameters`.

    Raises
    ------
    ComputationError
        If the lever has no such working point, or the mesh cannot follow.
    """

    def __init__(
        self, similar: SimilarLevers, probe: Probe, point: WorkingPoint, names: Sequence[str] = ()
    ) -> None:
        self.probe, self._similar, self._point, self._names = probe, similar, point, tuple(names)
        self._equations = similar.equations(probe, self._names)
        self.branch = continued(self._equations, self._is_long_enough)
        self.u = point.u(self.branch, probe.circuit)
        if not np.isfinite(self.u):
            raise ComputationError(
                f"the lever has no single state at {point}: its branch ends with the tip at "
                f"{self.branch.hottest_K:.0f} K"
            )

    def _is_long_enough(self, branch: Branch) -> bool:
        past_knee = np.any(np.diff(branch.values[:-1, 0]) < 0)
        return bool(past_knee) and self._point.is_reached(branch, self.probe.circuit)

    # --- values and derivatives -------------------------------------------------------------------

    def value(self, quantity: str) -> float:
        """Return a quantity; NaN of a knee, or a surface below, that does not exist."""
        if quantity == "time_constant_us":
            return self._time_constant
        if quantity in OF_THE_READER:
            return getattr(self._signal, quantity, float("nan"))
        return sum(sign * self._read(own, u)[0] for sign, own, u in self._terms(quantity))

    def gradient(self, quantity: str) -> Array:
        """Return its derivatives by the parameters, (p,)."""
        if quantity == "time_constant_us":
            return np.array([self._time_constant_by(name) for name in self._names])
        if quantity in OF_THE_READER:
            return np.array([self._reader_by(quantity, name) for name in self._names])
        terms = self._terms(quantity)
        return np.sum([sign * self._gradient_of(own, u) for sign, own, u in terms], axis=0)

    def _terms(self, quantity: str) -> list[tuple[float, str, float]]:
        """Return the quantities of states, with their signs and places, that one is made of."""
        at_knee = DISTANCES.get(quantity, quantity)
        if at_knee not in OF_THE_KNEE:
            return [(1.0, quantity, self.u)]
        own, knee_u = OF_THE_KNEE[at_knee], self.branch.knee_u
        terms = [(1.0, own, float("nan") if knee_u is None else knee_u)]
        return [*terms, (-1.0, own, self.u)] if quantity in DISTANCES else terms

    def _gradient_of(self, own: str, u: float) -> Array:
        """Return the derivatives of a quantity of the working point's or the knee's state."""
        _, by_shown, by_circuit = self._read(own, u)
        partial = self._partials(np.array([u]))[0][0]
        along_branch = self._along(u)[:, None] * self._place_by(u, partial)
        return np.asarray(by_shown @ (partial + along_branch) + by_circuit)

    def _read(self, own: str, u: float) -> tuple[float, Array, Array]:
        """Return a quantity, and its derivatives by V_l, I_h and T_tip, and by the circuit."""
        circuit = self.probe.circuit
        lever_V, current_mA = self.branch.curve(u)[:2].tolist()
        value, by_shown = {
            "tip_K": (float(self.branch.tip_K(u)), (0.0, 0.0, 1.0)),
            "lever_V": (lever_V, (1.0, 0.0, 0.0)),
            "current_mA": (current_mA, (0.0, 1.0, 0.0)),
            "power_mW": (lever_V * current_mA, (current_mA, lever_V, 0.0)),
            "bias_V": (circuit.bias(lever_V, current_mA), (1.0, circuit.series_kohm, 0.0)),
        }[own]
        by_circuit = [
            circuit.bias_by(name, current_mA) if own == "bias_V" else 0.0 for name in self._names
        ]
        return value, np.array(by_shown), np.array(by_circuit)

    def _along(self, u: float, derivative: int = 1) -> Array:
        """Return derivatives of V_l, I_h and T_tip along the branch, (3,)."""
        return np.asarray(self.branch.curve(u, derivative)[[0, 1, TIP_RISE]])

    def _partials(self, u: Array) -> tuple[Array, Array]:
        """Return derivatives of V_l, I_h and T_tip by the parameters at fixed rises, (n, 3, p).

        And those of V_l by u, (n,), of the states themselves, not of the curve through them.
        """
        parametrisation = self.branch.parametrisation
        constraint = parametrisation.constraint(u)
        roots = solve_at(
            self._equations,
            u,
            self.branch.states(u),
            NewtonOptions(),
            parametrisation=parametrisation,
        )
        derivatives = by_parameter(self._equations, roots.x, self._names, roots.factors, constraint)
        along = self._equations.along(roots.x, roots.factors, constraint)[-1]
        return derivatives[:, [0, 1, TIP_RISE]], along * parametrisation.rate(
            u, self._equations.space, roots.x
        )

    def _place_by(self, u: float, partial: Array) -> Array:
        """Return how the place u of the working point or of the knee moves, (p,)."""
        if u == self.branch.knee_u:
            # the knee is where V_l stops rising; states beside it tell how derivatives change
            partials, slopes = self._partials(u + 0.3 * np.array([-1.0, 1.0]))
            return np.asarray(-np.diff(partials[:, 0], axis=0)[0] / np.diff(slopes))
        _, by_shown, by_circuit = self._read(self._point.column, u)
        missing = by_shown @ partial + by_circuit
        return np.asarray(-missing / (by_shown @ self._along(u)))

    # --- in time ----------------------------------------------------------------------------------

    @cached_property
    def _time_constant(self) -> float:
        """The slowest time constant at the working point (µs), the source holding the bias."""
        return self._slowest(self.probe, self._rise_K)

    def _time_constant_by(self, name: str) -> float:
        """Return its derivative by a parameter: from levers beside this one, on its mesh moved."""
        value = float(self.probe.values([name])[0])
        step = 1e-3 * (abs(value) or 1.0)
        rise_by = self._gradient_of("tip_K", self.u)[self._names.index(name)]
        above, below = (
            self._slowest(self.probe.replace({name: value + way}), self._rise_K + way * rise_by)
            for way in (step, -step)
        )
        return (above - below) / (2.0 * step)

    @property
    def _rise_K(self) -> float:
        return float(self.branch.rise(np.array([self.u]))[0])

    def _slowest(self, probe: Probe, rise_K: float) -> float:
        lever = self._similar.lever(probe)
        u, guess = np.sqrt([rise_K]), self.branch.states(np.array([self.u]))
        root = solve_at(lever.equations, u, guess, NewtonOptions())
        return float(slowest_modes(State(lever, root.x), count=1)[0][0])

    # --- over a surface ---------------------------------------------------------------------------

    @cached_property
    def _signal(self) -> Signal | None:
        """What the reader shows at the working point; None without a surface below."""
        if not reads_distance(self.probe):
            return None
        lever, bias = self._similar.lever(self.probe), self.value("bias_V")
        return Reader(self.probe).signal(lever, self.branch, self.u, bias)

    def _reader_by(self, quantity: str, name: str) -> float:
        """Return a derivative of what the reader shows, from coarse levers beside this one."""
        value = float(self.probe.values([name])[0])
        # levers that are meshed anew differ by some per cent
        step = 0.05 * (abs(value) or 1.0)
        above, below = (
            SolvedDesign(SimilarLevers(Lever(probe, COARSE)), probe, self._point).value(quantity)
            for probe in (self.probe.with_(**{name: value + way}) for way in (step, -step))
        )
        return (above - below) / (2.0 * step)


def reads_distance(probe: Probe) -> bool:
    """Return whether a probe is in air over a surface."""
    around = probe.surroundings
    return around.medium == "air" and around.surface_gap_um is not None


# --- the search ---------------------------------------------------------------------------------

# From and to; None where there is no bound.
Bounds = tuple[float | None, float | None]


@dataclass(frozen=True)
class OptimalDesign:
    """A design, and the best within bounds.

    Attributes
    ----------
    quantity : str
        What was made least or greatest.
    point : WorkingPoint
    bounds : mapping of str to tuple
        Of numbers of the design and of quantities.
    start, best : SolvedDesign
        Each on a mesh of its own.
    limits : tuple of str
        The bounds that the best design is at, of those whose removal would make it better.
    designs : int
        How many were tried, a branch each.
    reason : str
        Why it may not be the optimum; empty if it is one.
    """

    quantity: str
    point: WorkingPoint
    bounds: Mapping[str, Bounds]
    start: SolvedDesign
    best: SolvedDesign
    limits: tuple[str, ...]
    designs: int
    reason: str

    def values(self, solved: SolvedDesign) -> dict[str, float]:
        """Return the numbers that were varied, and all quantities, of one of both designs."""
        names = [name for name in self.bounds if name not in QUANTITIES]
        varied = dict(zip(names, solved.probe.values(names).tolist(), strict=True))
        return varied | {quantity: solved.value(quantity) for quantity in QUANTITIES}


@one_blas_thread
def optimise(
    probe: Probe,
    quantity: str,
    point: WorkingPoint,
    bounds: Mapping[str, Bounds],
    *,
    greatest: bool = False,
    most_designs: int = 30,
    progress: Progress | None = None,
) -> OptimalDesign:
    """Find the design within bounds whose quantity is least, or greatest.

    Parameters
    ----------
    probe : Probe
        The design to start from. A number of it outside its bounds starts at the nearer one.
    quantity : str
        One of `hotlever.studies.optimisation.QUANTITIES`.
    point : WorkingPoint
    bounds : mapping of str to tuple of float
        From and to, of numbers of the design, see `hotlever.probe.probe_parameters`, of which there
        must be one, and of quantities, where either may be None.
    greatest : bool
    most_designs : int
        Tried at most.
    progress : callable, optional
        Called with the designs tried and how many there may be.

    Raises
    ------
    InputError
        If a name does not exist, or bounds are none.
    ComputationError
        If the design to start from cannot be solved, or has no such quantity.

    Notes
    -----
    In air, what it takes up from a place is taken as fixed where derivatives by dimensions are
    concerned; the values themselves are not. The optimum is a local one.
    """
    from scipy.optimize import minimize  # heavy for what else imports this

    probe.circuit.need_cold_start("a study of a design")
    _check(probe, quantity, bounds)
    search = _Search(probe, quantity, point, bounds, greatest, most_designs, progress)
    search.solved(search.start)  # whatever is wrong with the first design is an error
    reason = ""
    try:
        result: Any = minimize(
            search.objective,
            search.start,
            jac=search.objective_by,
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(search.names),
            constraints=search.constraints,
            options={"ftol": search.accuracy, "maxiter": most_designs},
        )
        reason = "" if result.success else result.message[:1].lower() + result.message[1:]
    except _EnoughDesigns:
        reason = f"{most_designs} designs were tried without coming to rest"
    if search.best is None:
        raise InputError(
            f"no design was found within {_bounds_text(search.limited)}; expected wider bounds, "
            "or more numbers that may change"
        )
    improved = search.probe_at(search.best)
    best = SolvedDesign(SimilarLevers(Lever(improved)), improved, point, search.names)
    limits = search.limits(search.best, best)
    first = SolvedDesign(SimilarLevers(Lever(probe)), probe, point)
    return OptimalDesign(quantity, point, bounds, first, best, limits, search.designs, reason)


def _check(probe: Probe, quantity: str, bounds: Mapping[str, Bounds]) -> None:
    if quantity not in QUANTITIES:
        raise unknown_name("quantity", quantity, QUANTITIES)
    reader = [name for name in (quantity, *bounds) if name in OF_THE_READER]
    if reader and not reads_distance(probe):
        raise InputError(
            f"{reader[0]}: found no surface below the lever, expected surface_gap_um and medium = "
            '"air" in [surroundings] of the probe file'
        )
    # the temperature of the base is of the experiment
    numbers = [name for name in parameters_of(probe) if name != "base_temperature_K"]
    for name, (low, high) in bounds.items():
        if name not in (*numbers, *QUANTITIES):
            raise unknown_name("name", name, (*numbers, *QUANTITIES))
        if name in QUANTITIES and low is None and high is None:
            raise InputError(f"{name}: found no bound, expected one at least")
        if name not in QUANTITIES and (low is None or high is None):
            raise InputError(f"{name}: found one bound, expected both of a number that may change")
        if low is not None and high is not None and not low < high:
            raise InputError(f"{name}: found {low:g} to {high:g}, expected a rising range")
        for end in (low, high) if name in numbers else ():
            if end is not None:
                _, key, record = field_of(probe, name)
                record.check_value(key, end, f"{name} = {end:g}")
    if not any(name not in QUANTITIES for name in bounds):
        raise InputError("found no number that may change, expected bounds of one at least")


def _bounds_text(bounds: Mapping[str, Bounds]) -> str:
    texts = [
        f"{name} from {low:g} to {high:g}"
        if low is not None and high is not None
        else f"{name} {'above' if high is None else 'below'} {low if high is None else high:g}"
        for name, (low, high) in bounds.items()
    ]
    return " and ".join(texts)


class _EnoughDesigns(Exception):
    """So many designs were tried as may be."""


class _Search:
    """Designs as the optimiser sees them: shares of the ranges of their numbers."""

    #: How near a bound is met: over its range, or over the bound of a quantity.
    at_bound = 1e-3

    def __init__(
        self,
        probe: Probe,
        quantity: str,
        point: WorkingPoint,
        bounds: Mapping[str, Bounds],
        greatest: bool,
        most_designs: int,
        progress: Progress | None,
    ) -> None:
        self._most_designs = most_designs
        self._probe, self._point, self._progress = probe, point, progress
        self._quantity, self._sign = quantity, -1.0 if greatest else 1.0
        self.names = tuple(name for name in bounds if name not in QUANTITIES)
        ranges: Any = [bounds[name] for name in self.names]
        self._low, self._high = np.array(ranges, dtype=float).T
        shares = (probe.values(self.names) - self._low) / (self._high - self._low)
        self.start = np.clip(shares, 0.0, 1.0)
        self.limited = {name: both for name, both in bounds.items() if name in QUANTITIES}
        # of what, where, and 1 for the least and −1 for the most
        self._bounds = [
            (name, bound, sign)
            for name, both in self.limited.items()
            for bound, sign in zip(both, (1.0, -1.0), strict=True)
            if bound is not None
        ]
        self._reads_distance = not {quantity, *bounds}.isdisjoint(OF_THE_READER)
        # what the objective may still change by, over its first value; what a reader shows changes
        # a little with each mesh
        self.accuracy = 5e-4 if self._reads_distance else 1e-6
        self.designs, self._scale, self._least = 0, 1.0, np.inf
        self.best: Array | None = None
        self._similar: SimilarLevers | None = None
        self._last: tuple[Array, SolvedDesign | None] | None = None

    def probe_at(self, share: Array) -> Probe:
        """Return the probe of a design."""
        values = self._low + share * (self._high - self._low)
        return self._probe.with_(**dict(zip(self.names, values.tolist(), strict=True)))

    # --- what the optimiser asks ------------------------------------------------------------------

    def objective(self, share: Array) -> float:
        """Return the quantity in units of the first design's, to be made small."""
        solved = self.solved_or_none(share)
        value = np.nan if solved is None else self._sign * solved.value(self._quantity)
        # from where there is no such lever the search steps back
        return value / self._scale if np.isfinite(value) else 1e3

    def objective_by(self, share: Array) -> Array:
        """Return its derivatives by the shares, (p,)."""
        return self._by_share(self.solved_or_none(share), self._quantity, self._sign / self._scale)

    @property
    def constraints(self) -> list[dict[str, Any]]:
        """The bounds on quantities, each as what must not be negative."""
        return [
            {
                "type": "ineq",
                "fun": lambda share, *bound: self._room(self.solved_or_none(share), *bound),
                "jac": lambda share, *bound: self._room_by(self.solved_or_none(share), *bound),
                "args": bound,
            }
            for bound in self._bounds
        ]

    def _room(self, solved: SolvedDesign | None, name: str, bound: float, sign: float) -> float:
        if solved is None:
            return 0.0
        return sign * (solved.value(name) - bound) / (abs(bound) or 1.0)

    def _room_by(self, solved: SolvedDesign | None, name: str, bound: float, sign: float) -> Array:
        return self._by_share(solved, name, sign / (abs(bound) or 1.0))

    def _by_share(self, solved: SolvedDesign | None, quantity: str, scale: float) -> Array:
        if solved is None:
            return np.zeros(len(self.names))
        return scale * np.nan_to_num(solved.gradient(quantity) * (self._high - self._low))

    # --- solving ----------------------------------------------------------------------------------

    def solved_or_none(self, share: Array) -> SolvedDesign | None:
        """Return a design solved, None if there is no such lever."""
        if self._last is None or not np.array_equal(self._last[0], share):
            try:
                self.solved(share)
            except HotleverError:
                self._last = share.copy(), None
        return self._last[1] if self._last else None

    def solved(self, share: Array) -> SolvedDesign:
        """Return a design solved, on the last mesh moved if that can follow."""
        if self.designs == self._most_designs:
            raise _EnoughDesigns
        self.designs += 1
        if self._progress is not None:
            self._progress(self.designs, self._most_designs)
        probe = self.probe_at(share)
        if self._reads_distance:
            self._similar = SimilarLevers(Lever(probe, COARSE))
        elif not self._follows(probe):
            self._similar = SimilarLevers(Lever(probe))
        assert self._similar is not None
        solved = SolvedDesign(self._similar, probe, self._point, self.names)
        value = solved.value(self._quantity)
        if self.designs == 1:
            self._scale = abs(value) or 1.0
        self._last = share.copy(), solved
        within = all(self._room(solved, *bound) >= -self.at_bound for bound in self._bounds)
        if within and self._sign * value < self._least:
            self._least, self.best = self._sign * value, share.copy()
        return solved

    def _follows(self, probe: Probe) -> bool:
        if self._similar is None:
            return False
        drawn, now = (each.values(self.names) for each in (self._similar.drawn, probe))
        # the lever is meshed anew from such a change of a dimension on
        return bool(np.all(np.abs(now - drawn) <= 0.25 * np.abs(drawn)))

    # --- what limits a design ---------------------------------------------------------------------

    def limits(self, share: Array, solved: SolvedDesign) -> tuple[str, ...]:
        """Return the bounds that a design is at and would be better beyond.

        Of a number, as far as the bounds on quantities that are met leave it free: the objective's
        derivatives without what these hold, by least squares.
        """
        met = [bound for bound in self._bounds if self._room(solved, *bound) < self.at_bound]
        by = self._by_share(solved, self._quantity, self._sign / self._scale)
        if met:
            held = np.array([self._room_by(solved, *bound) for bound in met])
            by = by - np.linalg.lstsq(held.T, by, rcond=None)[0] @ held
        texts = []
        for name, here, slope, *ends in zip(
            self.names, share, by, self._low, self._high, strict=True
        ):
            if here < self.at_bound and slope > 0:
                texts.append(f"{name} at its least, {ends[0]:g}")
            elif here > 1.0 - self.at_bound and slope < 0:
                texts.append(f"{name} at its most, {ends[1]:g}")
        quantities = [
            f"{name} at its {'least' if sign > 0 else 'most'}, {bound:g}"
            for name, bound, sign in met
        ]
        return (*texts, *quantities)


def optimum_text(optimum: OptimalDesign) -> str:
    """Return start and best of a design, and what limits it, as lines of text."""
    start, best = optimum.values(optimum.start), optimum.values(optimum.best)
    width = max(map(len, start))
    at_rest = "no bound" if optimum.reason else "no bound: the derivatives vanish"
    limits = "; ".join(optimum.limits) or at_rest
    lines = [
        f"{optimum.quantity} at {optimum.point}: {start[optimum.quantity]:.4g} -> "
        f"{best[optimum.quantity]:.4g}, in {optimum.designs} designs",
        f"limited by {limits}",
        "",
        f"{'':<{width}}  {'start':>10}  {'best':>10}",
    ]
    for name in start:
        pair = (values[name] for values in (start, best))
        cells = [f"{value:.4g}" if np.isfinite(value) else "-" for value in pair]
        lines.append(f"{name:<{width}}  {cells[0]:>10}  {cells[1]:>10}")
    return "\n".join(lines)
