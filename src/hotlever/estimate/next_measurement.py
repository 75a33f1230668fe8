"""What to measure next: the rows that lessen the error of a tip temperature most, or of the knee's.

Of each measurement that could be made it is known before how much smaller it makes the standard
error that the next calibration states, and how hot the tip may get there. A lever as far as it is
known is linearised about its estimate, up to the bias at which it melts; it is made again from a
calibration, or from priors alone, by one solve on a coarse mesh, whose derivatives are those that
calibrations rest on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from scipy.optimize import nnls
from scipy.special import ndtri

from hotlever.datasets import frame_text, labelled
from hotlever.errors import InputError, unknown_name
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.experiment import TIP
from hotlever.estimate.likely_levers import Knowledge, LikelyLevers
from hotlever.estimate.objective import Coordinates, PriorDensity
from hotlever.estimate.options import FitOptions, SearchOptions
from hotlever.estimate.posterior import standard_errors
from hotlever.estimate.search import Solution
from hotlever.estimate.surrogate import CurveSurrogate, Rows
from hotlever.estimate.tip_temperature import error_of_model
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.observables import knee_by_parameter
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import SCALES, USUAL_SCALES, Prior, as_known, known_beforehand
from hotlever.probe.probe_parameters import dimensions_of
from hotlever.quantities import FITTED
from hotlever.spieser2017 import RAMAN_ERROR_K
from hotlever.text import aligned
from hotlever.types import Array
from hotlever.units import MOST_BIAS

if TYPE_CHECKING:
    import xarray as xr

# --- what rows tell -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Information:
    """The Fisher information of some unknowns.

    Attributes
    ----------
    matrix : ndarray, shape (q, q)
        That of priors and data; positive definite.

    Examples
    --------
    >>> information = Information(np.eye(2)).with_rows(np.array([[1.0, 0.0]]))
    >>> information.stderr(np.array([[1.0, 0.0], [0.0, 2.0]])).round(4).tolist()
    [0.7071, 2.0]
    """

    matrix: Array

    @property
    def covariance(self) -> Array:
        """Covariance of the unknowns, (q, q)."""
        return np.asarray(np.linalg.inv(self.matrix))

    def with_rows(self, rows: Array) -> Information:
        """Return it after data with these derivatives, over their standard errors, (n, q)."""
        return Information(self.matrix + rows.T @ rows)

    def stderr(self, gradients: Array) -> Array:
        """Return standard errors of quantities with gradients (..., q)."""
        return standard_errors(gradients, self.covariance)


@dataclass(frozen=True)
class Candidate:
    """A measurement that could be made.

    Attributes
    ----------
    kind : str
    rows : ndarray, shape (n, q)
        Derivatives of what it shows by the unknowns, over its standard errors.
    cost : float
    again : bool
        Whether it may be made several times.
    what : str
        What is measured.
    bias_V : float
        Where; NaN of a dimension.
    """

    kind: str
    rows: Array
    cost: float = 1.0
    again: bool = True
    what: str = ""
    bias_V: float = np.nan

    def variance_after(self, covariance: Array, gradient: Array) -> float:
        """Return the variance of a quantity after the measurement (Woodbury's identity)."""
        covariances, seen = self.rows @ covariance @ gradient, self.rows @ covariance @ self.rows.T
        reduction = covariances @ np.linalg.solve(np.eye(len(seen)) + seen, covariances)
        return float(gradient @ covariance @ gradient - reduction)


def best_first(
    information: Information,
    candidates: Sequence[Candidate],
    gradient: Array,
    count: int,
    most: Mapping[str, int] | None = None,
) -> list[int]:
    """Return the numbers of the candidates to measure, best first.

    Parameters
    ----------
    information : Information
    candidates : sequence of Candidate
    gradient : ndarray, shape (q,)
        Of the quantity whose standard error is lessened, by as much as possible for its cost.
    count : int
        So many, or fewer if no more are allowed.
    most : mapping of str to int, optional
        How many of a kind are allowed; any number of a kind that is not named.
    """
    chosen: list[int] = []
    left = dict(most or {})
    while len(chosen) < count:
        covariance = information.covariance
        before = float(standard_errors(gradient, covariance))
        gains = {
            number: (before - np.sqrt(each.variance_after(covariance, gradient))) / each.cost
            for number, each in enumerate(candidates)
            if left.get(each.kind, 1) > 0 and (each.again or number not in chosen)
        }
        if not gains:
            break
        best = max(gains, key=gains.__getitem__)
        chosen.append(best)
        kind = candidates[best].kind
        left |= {kind: left[kind] - 1} if kind in left else {}
        information = information.with_rows(candidates[best].rows)
    return chosen


@dataclass(frozen=True)
class NoiseLaw:
    """Noise of an instrument: one part is the same everywhere, one in proportion to what it shows.

    Attributes
    ----------
    constant : float
        In the unit of what is shown.
    share : float
    """

    constant: float
    share: float

    @classmethod
    def of(cls, errors: Array, values: Array) -> NoiseLaw:
        """Return the law of standard errors (n,) of data that show values (n,).

        Examples
        --------
        >>> law = NoiseLaw.of(np.array([0.5, 1.3]), np.array([0.0, 120.0]))
        >>> round(law.constant, 6), round(law.share, 6)
        (0.5, 0.01)
        """
        columns = np.stack([np.ones(values.size), values**2], axis=1) / errors[:, None] ** 2
        unit = np.max(columns, axis=0)
        variances, _ = nnls(columns / np.where(unit > 0, unit, 1.0), np.ones(values.size))
        constant, share = np.sqrt(variances / np.where(unit > 0, unit, 1.0)).tolist()
        return cls(constant, share)

    def at(self, values: Array) -> Array:
        """Return the standard errors of data that show values (n,)."""
        return np.hypot(self.constant, self.share * values)


# --- a lever as far as it is known ----------------------------------------------------------------


def _usual_scales(measured: Iterable[str]) -> dict[str, Prior]:
    """Return the priors of scales of what was not measured yet, by their names."""
    return {
        scale: Prior(1.0, USUAL_SCALES[scale])
        for scale, observable in SCALES.items()
        if observable not in measured
    }


@dataclass(frozen=True)
class LinearisedLever:
    """A lever, and what is known of it.

    Attributes
    ----------
    probe : Probe
        The most likely one.
    names : list of str
        The parameters that are not known exactly, (p,).
    priors : dict of str to Prior
        Of parameters and scales.
    measurement : Measurement or None
    weights : dict of str to ndarray
        See `hotlever.estimate.Estimate`; empty without data.
    solved : CurveSurrogate, optional
        Levers like it, until something melts, if they are at hand.
    """

    probe: Probe
    names: list[str]
    priors: dict[str, Prior]
    measurement: Measurement | None
    weights: dict[str, Array]
    solved: CurveSurrogate | None = None

    @classmethod
    def of_calibration(cls, calibration: Estimate) -> LinearisedLever:
        """Return the lever that was calibrated.

        Raises
        ------
        InputError
            If the data are not described, or the calibration rests on other than priors and data.
        """
        calibration.need_described("what to measure next")
        probe, measurement = calibration.probe, calibration.measurement
        if calibration.weights is None or not calibration.priors:
            raise InputError(
                f"what to measure next: found a calibration by route '{calibration.route}' without "
                "priors or the weights of its data, expected one of a probe with priors (hotlever "
                "calibrate DATA.csv --probe PROBE.toml -o CAL.json) by this version"
            )
        if measurement.out_of_contact.any():
            raise InputError(
                "what to measure next: found rows at a distance from the sample, expected a lever "
                "at one place"
            )
        probe.circuit.need_cold_start("what to measure next")
        priors = {
            name: Prior(use.value, use.spread / use.value, True)
            if use.distribution == "log-normal"
            else Prior(use.value, use.spread, False)
            for name, use in calibration.priors.items()
        }
        names = calibration.names or FitOptions(priors=priors).of(probe).varied
        priors = {**_usual_scales(calibration.weights), **priors}
        return cls(probe, names, priors, measurement, calibration.weights)

    @classmethod
    def of_solution(cls, solution: Solution) -> LinearisedLever:
        """Return the lever that a search came to, on branches that go on until something melts."""
        problem, residuals = solution.problem, solution.residuals
        weights = dict(zip(residuals.observables, residuals.data_weights, strict=True))
        priors, names = {**_usual_scales(weights), **problem.known}, problem.options.varied
        surrogate = solution.prediction.surrogate
        assert isinstance(surrogate, CurveSurrogate)
        return cls(solution.probe, names, priors, problem.measurement, weights, surrogate)

    @classmethod
    def of_priors(
        cls, probe: Probe, stated: Mapping[str, Prior | str] | None = None
    ) -> LinearisedLever:
        """Return a lever that was not measured yet; of priors some may be stated."""
        probe = as_known(probe, stated)
        priors = known_beforehand(probe, stated)
        if not priors:
            raise InputError(
                "what to measure first: expected priors, without which nothing is known"
            )
        probe.circuit.need_cold_start("what to measure next")
        values = {name: prior.value for name, prior in priors.items() if name not in SCALES}
        names = FitOptions(priors=priors).of(probe).varied
        return cls(probe.replace(values), names, {**_usual_scales(()), **priors}, None, {})

    # --- what it shows ----------------------------------------------------------------------------

    @cached_property
    def surrogate(self) -> CurveSurrogate:
        """Levers like it, until something melts."""
        if self.solved is not None:
            return self.solved
        names, fast = tuple(self.names), SimilarLevers(Lever(self.probe, COARSE))
        reach = Reach(self.probe.circuit, MOST_BIAS)
        solved = fast.linearised(self.probe, reach, names=names)
        return CurveSurrogate(
            self.probe, names, solved.branch, solved.output_slopes, Rows(np.empty(0))
        )

    @cached_property
    def highest_V(self) -> float:
        """The bias (V) up to which it has states."""
        branch = self.surrogate.branch
        return branch.highest_bias(self.probe.circuit, MOST_BIAS)

    @property
    def hottest_K(self) -> float:
        """The tip temperature (K) at which something melts."""
        return self.surrogate.branch.hottest_K

    def bias_for(self, tip_K: float) -> float:
        """Return the bias (V) at which a slow ramp has the tip at a temperature.

        Raises
        ------
        InputError
            If there is none.
        """
        branch, circuit = self.surrogate.branch, self.probe.circuit
        at = branch.bias(np.array([tip_K]), circuit)
        reached = branch.tip_K(branch.read(circuit, at).u) if np.isfinite(at[0]) else at
        if not abs(float(reached[0]) - tip_K) < 1.0:
            raise InputError(
                f"no bias of a slow ramp has the tip of this lever at {tip_K:.0f} K; expected a "
                f"temperature from {self.probe.circuit.base_temperature_K:.0f} to "
                f"{self.hottest_K:.0f} K that it does not jump over"
            )
        return float(at[0])

    def tip(self, bias: Array) -> tuple[Array, Array]:
        """Return the tip temperature (n,) at some biases (V), and its derivatives (n, q).

        The scale of a thermometer moves what it shows, not the tip.
        """
        values, slopes = self.predict(Rows(bias))
        slopes[TIP, :, len(self.names) :] = 0.0
        return values[TIP], slopes[TIP]

    def knee(self) -> tuple[float, float, Array]:
        """Return bias (V) and tip temperature (K) of the knee, and the latter's derivatives, (q,).

        Raises
        ------
        InputError
            If the lever has none.
        """
        surrogate, circuit = self.surrogate, self.probe.circuit
        knee = surrogate.branch.knee
        if knee is None:
            raise InputError(
                f"knee: the lever has none below {self.hottest_K:.0f} K; expected a temperature "
                "of the tip"
            )
        slopes = knee_by_parameter(surrogate.branch, surrogate.by_parameter, self.names)
        of_parameters = slopes * self._coordinates.rates(self._point)
        bias = circuit.bias(knee.lever_V, knee.current_mA)
        return bias, knee.tip_K, np.append(of_parameters, np.zeros(len(SCALES)))

    def predict(self, rows: Rows) -> tuple[Array, Array]:
        """Return what rows show (observables, n), and derivatives by the unknowns (…, n, q)."""
        surrogate = self.surrogate.reading(rows)
        values, slopes = surrogate.predict(self.probe.values(self.names))
        of_parameters = slopes * self._coordinates.rates(self._point)
        of_scales = np.zeros((*values.shape, len(SCALES)))
        for number, (scale, observable) in enumerate(SCALES.items()):
            row = list(FITTED).index(observable)
            share = self.priors[scale].spread if scale in self.priors else 0.0
            of_scales[row, :, number] = share * self._size(observable, values)
        return values, np.concatenate([of_parameters, of_scales], axis=-1)

    def _size(self, observable: str, values: Array) -> Array:
        """Return what a scale is one of, of values (observables, n): of a temperature, its rise."""
        base_K = self.probe.circuit.base_temperature_K * FITTED[observable].is_temperature
        return values[list(FITTED).index(observable)] - base_K

    def dimensions(self, share: float) -> dict[str, Array]:
        """Return derivatives (q,) of the uncertain dimensions over errors that are a share of each.

        By their names; without shifts of edges, which are shares of nothing.
        """
        rates, own = self._coordinates.rates(self._point), self.probe.values(self.names)
        rows = np.eye(len(self.names), len(self.names) + len(SCALES))
        return {
            name: rates[number] / (share * own[number]) * rows[number]
            for number, name in enumerate(self.names)
            if name in dimensions_of(self.probe) and own[number] > 0.0
        }

    def parameters(self, away: Array) -> Array:
        """Return the parameters (p,) of a lever so far away in their coordinates, (p,)."""
        return self._coordinates.values(self._point + away)

    # --- what is known of it ----------------------------------------------------------------------

    @cached_property
    def _coordinates(self) -> Coordinates:
        relative = [name for name, prior in self.priors.items() if prior.relative]
        return Coordinates.of(self.probe, self.names, relative)

    @cached_property
    def _point(self) -> Array:
        return self._coordinates.point(self.probe.values(self.names))

    @cached_property
    def _before(self) -> Array:
        """Derivatives of what was known beforehand by the unknowns, in standard deviations."""
        prior = PriorDensity.of_priors(self.priors)
        numbers, count = [self.names.index(name) for name in prior.names], len(self.names)
        rows = np.zeros((len(numbers), count + len(SCALES)))
        slopes = prior.slopes(self.probe.values(prior.names))
        rows[:, numbers] = slopes * self._coordinates.rates(self._point)[numbers]
        low, high = self._coordinates.bounds
        # uniform within its bounds where there is no prior
        uniform = np.where(rows[:, :count].any(axis=0), 0.0, np.sqrt(12.0) / (high - low))
        return np.concatenate([rows, np.diag(np.append(uniform, np.ones(len(SCALES))))])

    @cached_property
    def information(self) -> Information:
        """That of priors and data."""
        information = Information(self._before.T @ self._before)
        if self.measurement is None:
            return information
        _, slopes = self.predict(Rows(self.measurement.bias_V, self._measured))
        for name, weights in self.weights.items():
            counts = weights > 0
            of_data = slopes[list(FITTED).index(name), counts]
            information = information.with_rows(weights[counts, None] * of_data)
        return information

    @cached_property
    def likely(self) -> LikelyLevers:
        """Levers drawn from what is known."""
        return self.likely_after(np.empty((0, len(self.names) + len(SCALES))))

    def likely_after(self, more: Array) -> LikelyLevers:
        """Return levers drawn from what will be known.

        Parameters
        ----------
        more : ndarray, shape (n, q)
            Derivatives over standard errors of rows that are measured as well by then.
        """
        prior, shape = PriorDensity.of_priors(self.priors), (len(FITTED), 0)
        before = np.concatenate([self._before, more])
        deviations = np.zeros(len(before))
        deviations[: len(prior.names)] = prior.deviations(self.probe.values(prior.names))
        bias, measured = np.empty(0), np.empty(shape)
        weights, scales = np.zeros(shape), np.zeros((*shape, len(SCALES)))
        if self.measurement is not None:
            bias, measured = self.measurement.bias_V, self._measured
            _, slopes = self.predict(Rows(bias, measured))
            none = np.zeros(bias.size)
            weights = np.stack([self.weights.get(name, none) for name in FITTED])[: len(slopes)]
            measured, scales = measured[: len(slopes)], slopes[..., len(self.names) :]
        known = Knowledge(before, deviations, bias, measured, weights, scales)
        return LikelyLevers(self.surrogate, self._coordinates, known)

    def noise(self, observable: str, values: Array, share: float | None = None) -> Array:
        """Return the standard errors of rows that show values (observables, n) of an observable.

        They are a share that is stated, or follow those of the data at hand, or else what is usual,
        and no smaller than what models are off by.
        """
        size = self._size(observable, values)
        of_a_tip = FITTED[observable].is_temperature
        law = NoiseLaw(RAMAN_ERROR_K, 0.0) if of_a_tip else NoiseLaw(0.0, 1e-3)
        if share is not None:
            law = NoiseLaw(0.0, share)
        elif (counts := self.weights.get(observable, np.empty(0)) > 0).any():
            errors = 1.0 / self.weights[observable][counts]
            return NoiseLaw.of(errors, self._size(observable, self._measured)[counts]).at(size)
        return np.hypot(law.at(size), SearchOptions.discrepancy * size)

    @property
    def _measured(self) -> Array:
        """All that was measured, (observables, n)."""
        assert self.measurement is not None
        return np.stack([self.measurement.observable(name) for name in FITTED])


# --- proposals ------------------------------------------------------------------------------------

#: What is to be known better.
Aim = Literal["tip", "knee"]
#: What can be measured, and what that shows beside the current; dimensions show themselves.
KINDS = {"bias": (), "reader": ("reader",), "spectra": ("tip",), "dimensions": ()}
#: With this probability the tip is no hotter than is said.
SURE = 0.99


@dataclass(frozen=True)
class Plan:
    """What to measure next.

    Attributes
    ----------
    proposals : xarray.Dataset
        On the dimension ``proposal``, best first: ``what`` of `KINDS` or the name of a dimension,
        ``bias_V``, ``gain``, the tip temperature ``tip_K`` expected there, ``tip_limit_K``, which
        it does not exceed with a probability of 99 %, and ``stderr_now_K`` and ``stderr_then_K``,
        the standard errors of the ``quantity`` now and after this and all proposals before. The
        gain is how many kelvins (per unit of cost, if there are costs) this one takes off.
    errors : xarray.Dataset
        ``tip_K`` and ``tip_limit_K`` on ``bias``, and ``tip_stderr_K``, the standard errors after
        so many proposals, on (``added``, ``bias``).
    quantity : {"tip", "knee"}
        Whose error counts: of the tip temperature at the bias where it is ``at_K``, or of that at
        the knee, wherever the knee is.
    at_K : float
        What it is as far as is known.
    stay_below_K : float or None
    safe_V, safe_then_V : float
        The highest bias at which the tip is not too hot with that certainty, now and, as expected,
        after all proposals; NaN if there is none.
    lever : str
    notes : list of str
    """

    proposals: xr.Dataset
    errors: xr.Dataset
    quantity: Aim
    at_K: float
    stay_below_K: float | None
    safe_V: float
    safe_then_V: float
    lever: str
    notes: list[str]

    def to_csv(self) -> str:
        """Return the proposals as CSV, one row each, best first."""
        table = self.proposals.to_dataframe().rename(columns={"tip_limit_K": "tip_high_K"})
        return frame_text(table, index=False, float_format="%.6g")

    def text(self) -> str:
        """Return what is proposed as lines of text."""
        head = ["measure", "V_b (V)", "T_tip (K)", f"{SURE:.0%} below (K)", "then ± (K)"]
        numbers = {"bias_V": 3, "tip_K": 0, "tip_limit_K": 0, "stderr_then_K": 1}
        columns = [
            [
                "–" if np.isnan(value) else f"{value:.{digits}f}"
                for value in self.proposals[name].values
            ]
            for name, digits in numbers.items()
        ]
        rows = zip(self.proposals.what.values.tolist(), *columns, strict=True)
        now = (
            f"{self.aim[0].upper()}{self.aim[1:]} is known to ± "
            f"{self.proposals.stderr_now_K.values[0]:.1f} K now (standard error)."
        )
        after = [*self._repeated, self._safety]
        return "\n".join([now, "", *aligned([head, *rows], right=True), "", *after])

    @property
    def aim(self) -> str:
        """What is to be known, in words."""
        return f"the {self.quantity} at {self.at_K:.0f} K"

    @property
    def _repeated(self) -> list[str]:
        """Why some are proposed several times, and what the last of them brings, in words."""
        rows = self.proposals.to_dataframe()
        before = np.append(rows.stderr_now_K.to_numpy()[:1], rows.stderr_then_K.to_numpy()[:-1])
        rows = rows.assign(brings_K=before - rows.stderr_then_K.to_numpy())
        return [
            f"{len(same)} {what} at {bias:.3f} V: no other measurement that is allowed tells more "
            f"of {self.aim}. Each lessens the noise of the mean, but not what all {what} have "
            f"wrong in common; the last takes off {same.brings_K.iloc[-1]:.1f} K."
            for (what, bias), same in rows.groupby(["what", "bias_V"], sort=False)
            if len(same) > 1
        ]

    @property
    def _safety(self) -> str:
        """How far the bias may go now, and will be allowed to go then, in words."""
        limit = (
            "nothing melts"
            if self.stay_below_K is None
            else f"the tip stays below {self.stay_below_K:.0f} K"
        )
        text = f"Up to {self.safe_V:.3g} V {limit}, with a certainty of {SURE:.0%}."
        then = f"{self.safe_then_V:.3g} V"
        if then == f"{self.safe_V:.3g} V":
            return text
        return (
            f"{text} After these measurements that is probably so up to {then}: calibrate and ask "
            "again before you go there."
        )


def check_names(quantity: str, allowed: Iterable[str]) -> None:
    """Refuse a quantity, or kinds of measurement, of which there are none.

    Raises
    ------
    InputError
        If so.
    """
    if quantity not in get_args(Aim):
        raise unknown_name("quantity", quantity, get_args(Aim))
    for kind in allowed:
        if kind == "pulse":
            raise InputError(
                "pulse: a calibration is of rows at rest, to which a pulse adds nothing; expected "
                f"some of {', '.join(KINDS)}"
            )
        if kind not in KINDS:
            raise unknown_name("kind of measurement", kind, KINDS)


def plan_next(
    calibration: Estimate | None = None,
    *,
    known: LinearisedLever | None = None,
    probe: Probe | None = None,
    priors: Mapping[str, Prior | str] | None = None,
    allowed: Mapping[str, int | None] | None = None,
    count: int = 5,
    quantity: Aim = "tip",
    at_K: float | None = None,
    stay_below_K: float | None = None,
    bias: Array | None = None,
    costs: Mapping[str, float] | None = None,
    noise: Mapping[str, float] | None = None,
) -> Plan:
    """Find what to measure next of a lever, or first.

    Parameters
    ----------
    calibration : Estimate, optional
        Of what was measured so far, by a probe with priors.
    known : LinearisedLever, optional
        In its place, of a lever that is being measured.
    probe : Probe, optional
        In their place, of a lever that was not measured yet; the reference probe by default.
    priors : mapping of str to Prior or str, optional
        Of that lever, in place of some of the usual ones.
    allowed : mapping of str to int or None, optional
        Which of `KINDS` may be measured, and at most how many of each; by default all but
        dimensions, the reader, and spectra where the heater is no silicon; the latter two count
        where the data have them.
    count : int
        Proposals, at most.
    quantity : {"tip", "knee"}
        Whose error counts: that of a tip temperature, at the bias that leads to it, or of the tip
        temperature at the knee, whose bias is uncertain too.
    at_K : float, optional
        That tip temperature, but not of a knee; by default the hottest measured one, or without
        data the hottest that is allowed.
    stay_below_K : float, optional
        The tip is to stay below with 99 % probability. What could melt with more than 1 % is never
        proposed.
    bias : ndarray, optional
        Biases (V) that may be taken; by default even ones, to half as much again as the measured
        ones.
    costs : mapping of str to float, optional
        Of one measurement of each kind, such as minutes; all the same by default.
    noise : mapping of str to float, optional
        Standard errors of rows by observable, as shares of what is shown; by default those of the
        data at hand, or else 0.1 % of a current or voltage, and 2 % of the rise of the tip. Of
        ``dimensions`` that of each, 1 % by default.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        If a kind does not exist or its observable has no sense, data are not described, no bias is
        safe, none leads to the temperature, or there is no knee.
    ComputationError
        If the lever cannot be solved.

    Examples
    --------
    >>> plan = plan_next(read_calibration("calibration.json"), at_K=800.0)  # doctest: +SKIP
    >>> plan.proposals.bias_V.values[0]  # doctest: +SKIP
    8.25
    """
    check_names(quantity, allowed or ())
    if calibration is not None:
        known = LinearisedLever.of_calibration(calibration)
    lever = known or LinearisedLever.of_priors(probe or Probe.reference(), priors)
    most = _allowed(lever, allowed)
    limit = np.inf if stay_below_K is None else stay_below_K
    if quantity == "knee" and at_K is not None:
        raise InputError("at_K: the knee has a temperature of its own; leave it out")
    bias, highest_K, safe = _safe_biases(lever, bias, limit)
    tip_K, by_unknowns = lever.tip(bias)
    if quantity == "knee":
        aim_V, at_K, gradient = lever.knee()
    else:
        if at_K is None:
            tips = tip_K[:safe] if calibration is None else calibration.tip_table["tip_K"]
            at_K = float(np.nanmax(tips))
        aim_V = lever.bias_for(at_K)
        _, (gradient,) = lever.tip(np.array([aim_V]))
    candidates = _candidates(lever, most, bias[:safe], costs or {}, noise or {})
    limited = {kind: number for kind, number in most.items() if number is not None}
    chosen = best_first(lever.information, candidates, gradient, count, limited)
    if not chosen:
        raise InputError("what to measure next: nothing is allowed, expected a measurement or more")
    each = (candidates[number].rows for number in chosen)
    after = list(accumulate(each, Information.with_rows, initial=lever.information))
    stays, notes = _errors_that_stay(lever, calibration, np.append(bias, aim_V))
    if lever.likely.first_order:
        notes.append("how hot the tip may get is known to first order alone; take small steps")
    of_aim = np.array([information.stderr(gradient) for information in after])
    stderr = np.hypot(of_aim, stays[-1])
    proposed = [candidates[number] for number in chosen]
    at_V = np.array([each.bias_V for each in proposed])
    columns = {
        "what": [each.what for each in proposed],
        "bias_V": at_V,
        "gain": -np.diff(stderr) / [each.cost for each in proposed],
        "tip_K": np.interp(at_V, bias[:safe], tip_K[:safe]),
        "tip_limit_K": np.interp(at_V, bias[:safe], highest_K[:safe]),
        "stderr_now_K": np.full(at_V.size, stderr[0]),
        "stderr_then_K": stderr[1:],
    }
    counts = sorted({n for n in (0, 1, 2, 5, len(chosen)) if n <= len(chosen)})
    along = np.array([np.hypot(after[n].stderr(by_unknowns), stays[:-1]) for n in counts])
    errors = {"tip_K": tip_K, "tip_limit_K": highest_K}
    return Plan(
        labelled(columns, "proposal", {"proposal": np.arange(1, at_V.size + 1)}),
        labelled(
            {**errors, "tip_stderr_K": (("added", "bias"), along)},
            "bias",
            {"bias": bias, "added": counts},
        ),
        quantity,
        at_K,
        stay_below_K,
        float(bias[safe - 1]),
        _safe_then(lever, bias, safe, np.concatenate([each.rows for each in proposed]), limit),
        lever.probe.title,
        notes,
    )


def _safe_then(
    lever: LinearisedLever, bias: Array, safe: int, rows: Array, limit_K: float
) -> float:
    """Return the highest bias (V) that will be safe after some rows, of which so many are now.

    A bias beyond one that is not safe is none either.
    """
    highest = hottest_tips(lever, bias, lever.likely_after(rows))
    while safe < bias.size and highest[safe] < limit_K:
        safe += 1
    return float(bias[safe - 1])


def _safe_biases(
    lever: LinearisedLever, stated: Array | None, limit_K: float
) -> tuple[Array, Array, int]:
    """Return rising biases (V) to compare, the tips (K) not exceeded there, and how many are safe.

    Raises
    ------
    InputError
        If none is safe.
    """
    likely = lever.likely
    if stated is None:
        bias = _usual_biases(lever)
    else:
        bias = np.unique(stated[(stated > 0.0) & (stated <= lever.highest_V)])
    if not bias.size:
        raise InputError(f"biases: expected some above 0 and up to {lever.highest_V:.4g} V")
    highest = hottest_tips(lever, bias, likely)
    safe = int(np.argmin(np.append(highest < limit_K, False)))
    if not safe:
        reached = f"the tip may reach {highest[0]:.0f} K"
        if not np.isfinite(highest[0]):
            reached = "something may melt"
        raise InputError(f"no bias is safe: at {bias[0]:.3g} V {reached}; expected a lower one")
    if stated is not None or safe == bias.size:
        return bias, highest, safe
    low, high = bias[safe - 1 : safe + 1]
    for _ in range(4):
        middle = np.array([(low + high) / 2.0])
        tip = hottest_tips(lever, middle, likely)
        if tip[0] >= limit_K:
            (high,) = middle
            continue
        (low,) = middle
        bias, highest = np.insert(bias, safe, middle), np.insert(highest, safe, tip)
        safe += 1
    return bias, highest, safe


def hottest_tips(lever: LinearisedLever, bias: Array, likely: LikelyLevers) -> Array:
    """Return the tip temperatures (K) that are not exceeded at some biases (V), for all we know.

    They are infinite where something may melt.

    Parameters
    ----------
    lever : LinearisedLever
    bias : ndarray, shape (n,)
        Up to where the most likely lever has states.
    likely : LikelyLevers
        Drawn from what is known of it.
    """
    (highest,), (tip_K, slopes) = likely.quantiles(bias, np.array([SURE])), lever.tip(bias)
    away, sure = np.maximum(highest - tip_K, 0.0), float(ndtri(SURE))
    if likely.first_order:
        # neither the levers nor the tangent are sure to be the hotter ones
        away = np.maximum(away, sure * lever.information.stderr(slopes))
    highest = tip_K + np.hypot(away, sure * _error_of_model(lever, bias))
    return np.where(highest < lever.hottest_K, highest, np.inf)


def _error_of_model(lever: LinearisedLever, bias: Array) -> Array:
    """Return what the model leaves out of the tip temperature (K) at some biases (V)."""
    fine = np.linspace(0.02, 1.0, 1001) * bias.max()
    rise = lever.tip(fine)[0] - lever.probe.circuit.base_temperature_K
    error = error_of_model(lever.probe.surroundings, fine, rise)
    return np.interp(bias, fine, error)


def _allowed(
    lever: LinearisedLever, allowed: Mapping[str, int | None] | None
) -> dict[str, int | None]:
    """Return what may be measured; by default what was, and what every such lever shows."""
    if allowed is None:
        observables = {*lever.weights, *(["tip"] if lever.probe.heater_silicon else [])}
        usual = {kind: of_kind for kind, of_kind in KINDS.items() if kind != "dimensions"}
        return {kind: None for kind, of_kind in usual.items() if {*of_kind} <= observables}
    if "reader" in allowed and "reader" not in lever.probe.observables:
        raise InputError("reader: the probe has no reader; expected some of bias, spectra")
    return dict(allowed)


def _candidates(
    lever: LinearisedLever,
    kinds: Iterable[str],
    bias: Array,
    costs: Mapping[str, float],
    noise: Mapping[str, float],
) -> list[Candidate]:
    """Return what could be measured: of each kind one at each bias, or each dimension once."""
    values, slopes = lever.predict(Rows(bias))
    electrical = [name for name in ("current", "bridge") if name in lever.weights] or ["current"]
    candidates = []
    for kind in kinds:
        # several spectra at one bias are proposed; a sweep does not return to one
        cost, again = costs.get(kind, 1.0), kind == "spectra"
        if kind == "dimensions":
            candidates += [
                Candidate(kind, row[None], cost, again, name)
                for name, row in lever.dimensions(noise.get(kind, 0.01)).items()
            ]
            continue
        names = (*electrical, *KINDS[kind])
        numbers = [list(FITTED).index(name) for name in names]
        errors = np.array([lever.noise(name, values, noise.get(name)) for name in names])
        rows = slopes[numbers] / errors[..., None]
        candidates += [
            Candidate(kind, rows[:, row], cost, again, kind, at_V)
            for row, at_V in enumerate(bias.tolist())
        ]
    return candidates


def _usual_biases(lever: LinearisedLever) -> Array:
    """Return the biases (V) that are compared unless some are stated.

    Half of them are even, and half at even temperatures of the tip, which is steep near a knee.
    They go to half as much again as the measured ones.
    """
    highest = lever.highest_V
    if lever.measurement is not None:
        highest = min(highest, 1.5 * float(lever.measurement.bias_V.max()))
    even, fine = (np.linspace(0.02 * highest, highest, count) for count in (21, 1001))
    tip_K = np.maximum.accumulate(lever.tip(fine)[0])
    by_tip = np.interp(np.linspace(tip_K[0], tip_K[-1], even.size)[1:-1], tip_K, fine)
    return np.union1d(even, by_tip)


def _errors_that_stay(
    lever: LinearisedLever, calibration: Estimate | None, bias: Array
) -> tuple[Array, list[str]]:
    """Return standard errors (K) at some biases that no such measurement lessens, and notes.

    The last bias (V) is the one where the error counts.
    """
    of_model = _error_of_model(lever, bias)
    if calibration is None:
        return of_model, []
    table, notes = calibration.tip_table, []
    budget = {
        source: np.interp(bias, table["bias_V"], error)
        for source, error in table.budgets["budget_K"].items()
    }
    if "jump" in budget and budget["jump"][-1] > 0.0:
        notes.append(
            "the lever jumps between two measured rows near there, and the errors are without "
            "that: rows between the two tell where"
        )
    return np.hypot(of_model, budget.get("medium", 0.0)), notes
