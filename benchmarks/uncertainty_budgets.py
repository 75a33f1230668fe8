"""Uncertainty budgets of levers never seen: is linear what they call linear?

The levers are those of which the owner knows little (`twins.py --wild`), whose estimates bend
most; with --known those of `hotlever.studies.simulation_based_calibration`, in vacuum and in air,
of which more budgets are linear. The referee is what the Monte Carlo method is short for: errors of
all data and priors are drawn, and the lever is estimated anew from each set of them, by levers that
are solved. Mean and standard deviation are compared with those of a linear estimate for the same
draws, so that few tell.

Three cases: the budget holds by the tolerance of JCGM 101, clause 8, or "not linear" is said, or
neither, which must not be: the ends of the referee's interval are off by more than the tolerance
and two of their standard errors, and nothing is said. Where "not linear" is said no referee is
asked, unless --all is given.

Run: python benchmarks/uncertainty_budgets.py [LEVERS] [--first K] [--draws N] [--known] [--all]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import Generator

from hotlever.errors import HotleverError
from hotlever.estimate import Estimate, FitOptions
from hotlever.estimate.experiment import TIP, Predictor
from hotlever.estimate.objective import Objective
from hotlever.estimate.options import CalibrationOptions, SearchOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import Optimiser, Solution, solve
from hotlever.estimate.tip_temperature import calibrated
from hotlever.estimate.verdict import verdict_on
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.studies.simulation_based_calibration import draw, measure
from hotlever.text import BAND
from hotlever.types import Array
from problems import table
from twins import little_known_lever

#: Data keep the errors that they had in the first estimate.
_WEIGHTS_STAY = SearchOptions(scatter_rounds=0)
#: Draws of draws, for the standard error of what the referee says.
_BOOTSTRAPS = 200


def lever_of(number: int, known: bool) -> tuple[Measurement, Probe, Callable[[Array], Array]]:
    """Return the data of a lever, the probe that its owner has, and the true tip (K) by bias."""
    if not known:
        little = little_known_lever(number)
        return little.measurement, little.nominal, little.tip_K
    rng = np.random.default_rng(number)
    true, nominal = draw(rng, number, ("vacuum", "air")[number // 2 % 2])
    data, _, lever = measure(true, rng, "iv")
    return data, nominal, lambda bias: lever.sweep(bias).tip_K.values


class _OfDrawnErrors(Objective):
    """An objective whose data and priors are off by errors (N,), in standard deviations."""

    errors: Array

    def residual(self, values: Array, point: Array) -> Array:
        """See `Objective`."""
        return super().residual(values, point) + self.errors


def re_estimated(estimate: Solution, bias_V: float, draws: int, rng: Generator) -> Array:
    """Return changes of the tip (K) by drawn errors: linear ones and estimates anew, (draws, 2)."""
    bias, own = np.array([bias_V]), estimate.objective
    predicted = estimate.predicted(bias)
    point, _, jacobian = own.linearised(estimate.prediction)
    slopes = predicted.slopes[TIP, 0, own.columns] * own.coordinates.rates(point)
    by_errors = -slopes @ np.linalg.pinv(jacobian)
    experiment = estimate.predictor.experiment
    # the data tell on which part of the branch the lever is
    tip_of = experiment.measuring(bias, predicted.values)
    changes = []
    for errors in rng.normal(size=(draws, jacobian.shape[0])):
        off = _OfDrawnErrors(own.residuals, estimate.probe, own.names, own.varied, own.prior)
        off.errors = errors
        search = Optimiser(off, Predictor(experiment, near=estimate.prediction), _WEIGHTS_STAY)
        anew = search.solve(estimate.probe)
        tip_K = tip_of.predict(anew.probe, anew.prediction).values[TIP, 0]
        changes.append((by_errors @ errors, tip_K - predicted.values[TIP, 0]))
    return np.array(changes)


def beyond(changes: Array, other_K: float, tolerance: float, rng: Generator) -> float:
    """Return by how much an end of the interval differs, less two standard errors, in tolerances.

    There are errors beside those of the estimate, of which `other_K` is the standard one.
    """

    def differences(rows: Array) -> Array:
        spread = BAND * np.hypot(rows.std(axis=0, ddof=1), other_K)
        linear, anew = (rows.mean(axis=0) + np.array([[-1.0], [1.0]]) * spread).T
        return anew - linear

    again = [differences(rng.choice(changes, len(changes))) for _ in range(_BOOTSTRAPS)]
    away = np.abs(differences(changes)) - 2.0 * np.std(again, axis=0)
    return float(np.maximum(away, 0.0).max()) / tolerance


def judged(number: int, draws: int, known: bool, always: bool) -> tuple[str, ...]:
    """Return a row of the table; the referee is asked `always`, or where linear is said."""
    rng = np.random.default_rng(number)
    measurement, nominal, tip_K = lever_of(number, known)
    estimate = solve(Problem.of(measurement, nominal, FitOptions(usual_priors=True)))
    one = Estimate.of(estimate, *verdict_on(estimate))
    calibration = calibrated(estimate, one, measurement, CalibrationOptions())
    gum = calibration.gum
    if gum is None:
        return str(number), "not described", *[""] * 6
    budget = gum.budget
    other = [row.contribution for row in budget.inputs if row.quantity in ("model", "jump")]
    away = float("nan")
    if gum.linear or always:
        changes = re_estimated(estimate, gum.bias_V, draws, rng)
        away = beyond(changes, float(np.linalg.norm(other)), budget.tolerance, rng)
    error = abs(gum.estimate_K - tip_K(np.array([gum.bias_V])).item())
    interval = gum.monte_carlo
    case = "linear" if gum.linear else "not linear"
    return (
        str(number),
        "NEITHER" if gum.linear and away > 1.0 else case,
        f"{gum.estimate_K:.0f}",
        f"{budget.u:.1f}",
        f"{budget.tolerance / budget.expanded():.2f}",
        f"{interval.low - gum.interval_K[0]:+.1f}",
        f"{interval.high - gum.interval_K[1]:+.1f}",
        f"{away:.1f}",
        f"{error / budget.expanded():.2f}",
    )


def main(numbers: range, *how: Any) -> None:
    rows = []
    for number in numbers:
        try:
            rows.append(judged(number, *how))
        except HotleverError as error:
            rows.append((str(number), f"no lever: {str(error)[:40]}", *[""] * 7))
        print(*rows[-1], flush=True)
    head = ("lever", "said", "tip (K)", "u (K)", "tolerance / U", "low off (K)", "high off (K)")
    print()
    table((*head, "referee beyond", "error / U"), rows)
    cases = [row[1] for row in rows]
    for case in ("linear", "not linear", "NEITHER"):
        print(f"{case}: {cases.count(case)} of {len(rows)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("levers", nargs="?", type=int, default=12)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--known", action="store_true")
    parser.add_argument("--all", action="store_true")
    asked = parser.parse_args()
    numbers = range(asked.first, asked.first + asked.levers)
    main(numbers, asked.draws, asked.known, asked.all)
