"""What to measure next: the rows that lessen the error of a tip temperature most.

Of each measurement that could be made it is known before how much smaller it makes the standard
error that the next calibration states, and how hot the tip may get there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
import xarray as xr
from scipy.special import ndtri

from hotlever.datasets import frame_text, labelled
from hotlever.errors import InputError, unknown_name
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.linearised_lever import LinearisedLever
from hotlever.estimate.optimal_design import Candidate, Information, best_first
from hotlever.estimate.surrogate import Rows
from hotlever.estimate.tip_table import BUDGETS, budgets_of
from hotlever.estimate.tip_temperature import error_of_model
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.quantities import FITTED
from hotlever.text import aligned
from hotlever.types import Array

#: What can be measured, and what that shows beside the current.
KINDS = {"bias": (), "reader": ("reader",), "spectra": ("tip",)}
#: Of these several at one bias are proposed; a sweep does not return to one.
REPEATED = ("spectra",)
#: With this probability the tip is no hotter than is said.
SURE = 0.99
#: Measurements after which the error is shown.
SHOWN_AFTER = (0, 1, 2, 5)
#: Of biases that are compared unless some are stated: how far beyond the measured ones they go,
#: from which share of the highest on, how many of them are even, and by how many the others are
#: found. So often what lies between the last that is safe and the next one is halved.
_BEYOND, _LOWEST, _EVEN, _FINE, _HALVED = 1.5, 0.02, 21, 1001, 4


@dataclass(frozen=True)
class Plan:
    """What to measure next.

    Attributes
    ----------
    proposals : xarray.Dataset
        On the dimension ``proposal``, best first: ``what`` of `KINDS`, ``bias_V``, ``gain``, the
        tip temperature ``tip_K`` expected there, ``tip_limit_K``, which it does not exceed with a
        probability of 99 %, and ``stderr_now_K`` and ``stderr_then_K``, the standard errors of the
        tip temperature at ``at_K`` now and after this and all proposals before. The gain is how
        many kelvins (per unit of cost, if there are costs) this one takes off.
    errors : xarray.Dataset
        ``tip_K`` and ``tip_limit_K`` on ``bias``, and ``tip_stderr_K``, the standard errors after
        so many proposals, on (``added``, ``bias``).
    at_K : float
        Where the error counts.
    stay_below_K : float or None
    safe_V, safe_then_V : float
        The highest bias at which the tip is not too hot with that certainty, now and, as expected,
        after all proposals; NaN if there is none.
    lever : str
    notes : list of str
    """

    proposals: xr.Dataset
    errors: xr.Dataset
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
            [f"{value:.{digits}f}" for value in self.proposals[name].values.tolist()]
            for name, digits in numbers.items()
        ]
        rows = zip(self.proposals.what.values.tolist(), *columns, strict=True)
        now = (
            f"The tip at {self.at_K:.0f} K is known to ± "
            f"{self.proposals.stderr_now_K.values[0]:.1f} K now (standard error)."
        )
        return "\n".join([now, "", *aligned([head, *rows], right=True), "", self._safety])

    @property
    def _safety(self) -> str:
        """How far the bias may go now, and will be allowed to go then, in words."""
        limit = (
            "leaves all below melting"
            if self.stay_below_K is None
            else f"keeps the tip below {self.stay_below_K:.0f} K"
        )
        text = f"A bias of up to {self.safe_V:.3g} V {limit} with a certainty of {SURE:.0%}"
        then = f"{self.safe_then_V:.3g} V"
        if then == f"{self.safe_V:.3g} V":
            return f"{text}."
        return (
            f"{text}; after these measurements probably one of up to {then}: "
            "calibrate and ask again before going there."
        )


def plan_next(
    calibration: Estimate | None = None,
    *,
    probe: Probe | None = None,
    priors: Mapping[str, Prior | str] | None = None,
    allowed: Mapping[str, int | None] | None = None,
    count: int = 5,
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
    probe : Probe, optional
        In its place, of a lever that was not measured yet; the reference probe by default.
    priors : mapping of str to Prior or str, optional
        Of that lever, in place of some of the usual ones.
    allowed : mapping of str to int or None, optional
        Which of `KINDS` may be measured, and at most how many of each; by default all but the
        reader, and spectra where the heater is no silicon; these count where the data have them.
    count : int
        Proposals, at most.
    at_K : float, optional
        The tip temperature whose error counts; by default the hottest measured one, or without data
        the hottest that is allowed.
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
        data at hand, or else 0.1 % of a current or voltage, and 2 % of the rise of the tip.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        If a kind does not exist or its observable has no sense, data are not described, no bias is
        safe, or none leads to the temperature.
    ComputationError
        If the lever cannot be solved.

    Examples
    --------
    >>> plan = plan_next(read_calibration("calibration.json"), at_K=800.0)  # doctest: +SKIP
    >>> plan.proposals.bias_V.values[0]  # doctest: +SKIP
    8.25
    """
    lever = (
        LinearisedLever.of_priors(probe or Probe.reference(), priors)
        if calibration is None
        else LinearisedLever.of_calibration(calibration)
    )
    most = _allowed(lever, allowed)
    limit = np.inf if stay_below_K is None else stay_below_K
    bias, highest_K, safe = _safe_biases(lever, bias, limit)
    tip_K, by_unknowns = lever.tip(bias)
    if at_K is None:
        tips = tip_K[:safe] if calibration is None else calibration.table.tip_K.values
        at_K = float(np.nanmax(tips))
    aim = lever.bias_for(at_K)
    _, (gradient,) = lever.tip(np.array([aim]))
    candidates = _candidates(lever, most, bias[:safe], costs or {}, noise or {})
    limited = {kind: number for kind, number in most.items() if number is not None}
    chosen = best_first(lever.information, candidates, gradient, count, limited)
    if not chosen:
        raise InputError("what to measure next: nothing is allowed, expected a measurement or more")
    each = (candidates[number].rows for number in chosen)
    after = list(accumulate(each, Information.with_rows, initial=lever.information))
    stays, notes = _errors_that_stay(lever, calibration, np.append(bias, aim))
    of_tip = np.array([information.stderr(gradient) for information in after])
    stderr = np.hypot(of_tip, stays[-1])
    cost = np.array([candidates[number].cost for number in chosen])
    rows = np.array(chosen) % safe
    columns = {
        "what": [candidates[number].kind for number in chosen],
        "bias_V": bias[rows],
        "gain": -np.diff(stderr) / cost,
        "tip_K": tip_K[rows],
        "tip_limit_K": highest_K[rows],
        "stderr_now_K": np.full(rows.size, stderr[0]),
        "stderr_then_K": stderr[1:],
    }
    counts = sorted({n for n in (*SHOWN_AFTER, len(chosen)) if n <= len(chosen)})
    along = np.array([np.hypot(after[n].stderr(by_unknowns), stays[:-1]) for n in counts])
    errors = {"tip_K": tip_K, "tip_limit_K": highest_K}
    return Plan(
        labelled(columns, "proposal", {"proposal": np.arange(1, rows.size + 1)}),
        labelled(
            {**errors, "tip_stderr_K": (("added", "bias"), along)},
            "bias",
            {"bias": bias, "added": counts},
        ),
        at_K,
        stay_below_K,
        float(bias[safe - 1]),
        _safe_then(lever, bias, safe, after[-1], limit),
        lever.probe.title,
        notes,
    )


def _safe_then(
    lever: LinearisedLever, bias: Array, safe: int, information: Information, limit_K: float
) -> float:
    """Return the highest bias (V) that will be safe when so much is known, of which some are now.

    A bias beyond one that is not safe is none either.
    """
    while safe < bias.size and hottest_tips(lever, bias[[safe]], information)[0] < limit_K:
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
    information = lever.information
    if stated is None:
        bias = _usual_biases(lever)
    else:
        bias = np.unique(stated[(stated > 0.0) & (stated <= lever.highest_V)])
    if not bias.size:
        raise InputError(f"biases: expected some above 0 and up to {lever.highest_V:.4g} V")
    highest = hottest_tips(lever, bias, information)
    safe = int(np.argmin(np.append(highest < limit_K, False)))
    if not safe:
        reached = f"the tip may reach {highest[0]:.0f} K"
        if not np.isfinite(highest[0]):
            reached = "something may melt"
        raise InputError(f"no bias is safe: at {bias[0]:.3g} V {reached}; expected a lower one")
    if stated is not None or safe == bias.size:
        return bias, highest, safe
    low, high = bias[safe - 1 : safe + 1]
    for _ in range(_HALVED):
        middle = np.array([(low + high) / 2.0])
        tip = hottest_tips(lever, middle, information)
        if tip[0] >= limit_K:
            (high,) = middle
            continue
        (low,) = middle
        bias, highest = np.insert(bias, safe, middle), np.insert(highest, safe, tip)
        safe += 1
    return bias, highest, safe


def hottest_tips(lever: LinearisedLever, bias: Array, information: Information) -> Array:
    """Return the tip temperatures (K) that are not exceeded at some biases (V), for all we know.

    They are infinite where something may melt.
    """
    deviations, (tip_K, _) = float(ndtri(SURE)), lever.tip(bias)
    away = lever.highest_tip(bias, information.covariance, deviations) - tip_K
    highest = tip_K + np.hypot(away, deviations * _error_of_model(lever, bias))
    return np.where(highest < lever.hottest_K, highest, np.inf)


def _error_of_model(lever: LinearisedLever, bias: Array) -> Array:
    """Return what the model leaves out of the tip temperature (K) at some biases (V)."""
    fine = np.linspace(_LOWEST, 1.0, _FINE) * bias.max()
    rise = lever.tip(fine)[0] - lever.probe.circuit.base_temperature_K
    error = error_of_model(lever.probe.surroundings, fine, rise)
    return np.interp(bias, fine, error)


def _allowed(
    lever: LinearisedLever, allowed: Mapping[str, int | None] | None
) -> dict[str, int | None]:
    """Return what may be measured; by default what was, and what every such lever shows."""
    if allowed is None:
        observables = {*lever.weights, *(["tip"] if lever.probe.heater_silicon else [])}
        return {kind: None for kind, of_kind in KINDS.items() if {*of_kind} <= observables}
    for kind in allowed:
        if kind == "pulse":
            raise InputError(
                "pulse: a calibration is of rows at rest, to which a pulse adds nothing; expected "
                f"some of {', '.join(KINDS)}"
            )
        if kind not in KINDS:
            raise unknown_name("kind of measurement", kind, KINDS)
        if kind == "reader" and kind not in lever.probe.observables:
            raise InputError("reader: the probe has no reader; expected some of bias, spectra")
    return dict(allowed)


def _candidates(
    lever: LinearisedLever,
    kinds: Iterable[str],
    bias: Array,
    costs: Mapping[str, float],
    noise: Mapping[str, float],
) -> list[Candidate]:
    """Return what could be measured: of each kind one at each bias, kind after kind."""
    values, slopes = lever.predict(Rows(bias))
    electrical = [name for name in ("current", "bridge") if name in lever.weights] or ["current"]
    candidates = []
    for kind in kinds:
        names = (*electrical, *KINDS[kind])
        numbers = [list(FITTED).index(name) for name in names]
        errors = np.array([lever.noise(name, values, noise.get(name)) for name in names])
        rows = slopes[numbers] / errors[..., None]
        cost = costs.get(kind, 1.0)
        again = kind in REPEATED
        candidates += [Candidate(kind, rows[:, row], cost, again) for row in range(bias.size)]
    return candidates


def _usual_biases(lever: LinearisedLever) -> Array:
    """Return the biases (V) that are compared unless some are stated.

    Half of them are even, and half at even temperatures of the tip, which is steep near a knee.
    """
    highest = lever.highest_V
    if lever.measurement is not None:
        highest = min(highest, _BEYOND * float(lever.measurement.bias_V.max()))
    even, fine = (np.linspace(_LOWEST * highest, highest, count) for count in (_EVEN, _FINE))
    tip_K = np.maximum.accumulate(lever.tip(fine)[0])
    by_tip = np.interp(np.linspace(tip_K[0], tip_K[-1], _EVEN)[1:-1], tip_K, fine)
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
    table, notes = calibration.table, []
    budget = {
        source: np.interp(bias, table.bias_V, error)
        for source, error in budgets_of(table)[BUDGETS[0]].items()
    }
    if "jump" in budget and budget["jump"][-1] > 0.0:
        notes.append(
            "the lever jumps between two measured rows near there, and the errors are without "
            "that: rows between the two tell where"
        )
    return np.hypot(of_model, budget.get("medium", 0.0)), notes
