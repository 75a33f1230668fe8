"""Bayesian optimal design: what a measurement will take off an error, known before it is made."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
import pytest

from hotlever.estimate.next_measurement import Candidate, Information, NoiseLaw, best_first


def line(x, noise=0.1):
    """A reading of a straight line, by its offset and slope."""
    return np.array([[1.0, x]]) / noise


KNOWN = Information(np.eye(2))


def test_a_datum_lessens_the_variance_as_the_normal_equations_say():
    candidate, gradient = (
        Candidate("reading", np.vstack([line(0.3), line(0.9)])),
        np.array([1.0, 2]),
    )
    then = KNOWN.with_rows(candidate.rows).stderr(gradient) ** 2
    assert candidate.variance_after(KNOWN.covariance, gradient) == pytest.approx(then, rel=1e-12)
    # an offset of N(0, 1), read once with the error s, is known to 1 / (1 + 1/s²)
    offset = KNOWN.with_rows(line(0.0)).stderr(np.array([1.0, 0.0]))
    assert offset**2 == pytest.approx(1.0 / (1.0 + 100.0), rel=1e-12)


def test_a_line_is_read_where_it_is_asked_for():
    at = np.linspace(0.0, 1.0, 11)
    candidates = [Candidate("reading", line(x)) for x in at]
    # far out the slope tells most, and of the value there nothing tells more than a reading there
    assert at[best_first(KNOWN, candidates, np.array([0.0, 1.0]), 1)[0]] == 1.0
    assert at[best_first(KNOWN, candidates, np.array([1.0, 0.8]), 1)[0]] == pytest.approx(0.8)


def test_greedy_proposals_come_near_the_best_of_all_designs():
    random = np.random.default_rng(3)
    candidates = [Candidate("reading", random.normal(size=(1, 4))) for _ in range(8)]
    gradient, known = random.normal(size=4), Information(np.eye(4))

    def stderr(chosen):
        return known.with_rows(np.vstack([candidates[n].rows for n in chosen])).stderr(gradient)

    best = min(stderr(chosen) for chosen in combinations_with_replacement(range(8), 3))
    greedy = stderr(best_first(known, candidates, gradient, 3))
    assert best <= greedy < 1.1 * best < 0.9 * known.stderr(gradient)


def test_what_costs_less_or_may_not_be_made_again_counts():
    gradient = np.array([1.0, 0.0])
    dear = Candidate("spectra", line(0.0), cost=10.0)
    cheap = Candidate("bias", line(0.0, noise=0.5), again=False)
    assert best_first(KNOWN, [dear, cheap], gradient, 3) == [1, 0, 0]
    assert best_first(KNOWN, [dear, cheap], gradient, 3, {"spectra": 1}) == [1, 0]


def test_the_law_of_a_noise_is_found_again_and_outliers_hardly_move_it():
    values = np.linspace(0.1, 2.0, 40)
    errors = NoiseLaw(1e-3, 2e-3).at(values)
    errors[7] *= 50.0
    law = NoiseLaw.of(errors, values)
    np.testing.assert_allclose(law.at(values[8:]), errors[8:], rtol=0.05)
