"""Uncertainty budgets of levers never seen: is linear what they call linear?

The levers are those of which the owner knows little (`little_known_levers`), whose estimates bend
most. The referee is what the Monte Carlo method is short for: errors of all data and priors are
drawn, and the lever is estimated anew from each set of them, by the surrogate. The ends of the 95 %
interval are compared with those that a linear estimate has for the same draws, so that few tell.

Three cases: the budget holds by the tolerance of JCGM 101, clause 8, or "not linear" is said, or
neither, which must not be: the referee is off by more than the tolerance and two of its standard
errors, and nothing is said.

Run: python benchmarks/uncertainty_budgets.py [LEVERS] [--first K] [--draws N]
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.random import Generator
from scipy import optimize

from hotlever.calibration.inference import calibrated_by_estimate, estimate_lever
from hotlever.errors import HotleverError
from hotlever.estimation.experiment import TIP
from hotlever.estimation.inverse_problem import Estimate
from hotlever.estimation.load_lines import Rows
from hotlever.estimation.subproblem import Subproblem
from hotlever.types import Array
from little_known_levers import little_known_lever
from problems import table

#: By how much a lever is hotter (K) that is hotter than all that were solved: more than any other.
_HOTTER_K = 1e4
#: Draws of draws, for the standard error of what the referee says.
_BOOTSTRAPS = 200


def re_estimated(estimate: Estimate, bias_V: float, draws: int, rng: Generator) -> Array:
    """Return changes of the tip (K) by drawn errors: linear ones and estimates anew, (draws, 2)."""
    objective = estimate.objective
    near = Subproblem(objective, estimate.prediction)
    predicted = estimate.predicted(np.array([bias_V]))
    # the data tell on which part of the branch the lever is
    surrogate = predicted.surrogate.reading(Rows(np.array([bias_V]), predicted.values))
    origin, bounds = near.origin, objective.bounds
    parameters = estimate.probe.values(objective.names)
    jacobian = near.jacobian(origin)
    slopes = predicted.slopes[TIP, 0, objective.columns] * objective.coordinates.rates(origin)
    by_errors = -slopes @ np.linalg.pinv(jacobian)
    changes = []
    for errors in rng.normal(size=(draws, jacobian.shape[0])):
        anew = optimize.least_squares(
            lambda point, errors=errors: near.residual(point) + errors,
            origin,
            near.jacobian,
            bounds,
            x_scale="jac",
            ftol=1e-6,
            max_nfev=60,
        )
        tip_K = surrogate.shown(objective.among(parameters, anew.x))[TIP, 0]
        ended = tip_K >= surrogate.branch.hottest_K
        hotter = _HOTTER_K if ended else tip_K - predicted.values[TIP, 0]
        changes.append((by_errors @ errors, hotter))
    return np.array(changes)


def beyond(changes: Array, other_K: float, tolerance: float, rng: Generator) -> Array:
    """Return by how much the ends of the interval differ, less two standard errors, in tolerances.

    Errors beside those of the estimate, of which `other_K` is the standard one, are drawn too.
    """

    def differences(rows: Array) -> Array:
        other = other_K * rng.normal(size=(20, len(rows), 1))
        linear, anew = np.percentile((rows + other).reshape(-1, 2), (2.5, 97.5), axis=0).T
        return anew - linear

    again = [differences(rng.choice(changes, len(changes))) for _ in range(_BOOTSTRAPS)]
    away = np.abs(differences(changes)) - 2.0 * np.std(again, axis=0)
    return np.maximum(away, 0.0) / tolerance


def judged(number: int, draws: int) -> tuple[str, ...]:
    """Return a row of the table."""
    rng = np.random.default_rng(number)
    lever = little_known_lever(number)
    estimate, stated = estimate_lever(lever.measurement, lever.nominal)
    calibration = calibrated_by_estimate(lever.measurement, estimate, stated, "probe")
    gum = calibration.gum
    if gum is None:
        return str(number), "not described", *[""] * 6
    budget = gum.budget
    changes = re_estimated(estimate, gum.bias_V, draws, rng)
    other = [row.contribution for row in budget.inputs if row.quantity in ("model", "jump")]
    away = beyond(changes, float(np.linalg.norm(other)), budget.tolerance, rng).max()
    error = abs(gum.estimate_K - lever.tip_K(np.array([gum.bias_V])).item())
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


def main(numbers: range, draws: int) -> None:
    rows = []
    for number in numbers:
        try:
            rows.append(judged(number, draws))
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
    parser.add_argument("--draws", type=int, default=100)
    asked = parser.parse_args()
    main(range(asked.first, asked.first + asked.levers), asked.draws)
