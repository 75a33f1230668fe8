"""The GUM's own examples, to the digits that it prints, and the Monte Carlo method."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ndtri
from scipy.stats import irwinhall

from hotlever.estimate.uncertainty_budget import Budget, CoverageInterval, InputQuantity, propagate

#: JCGM 100, Table H.2: V (V), I (A) and φ (rad) of five observations.
OBSERVED = np.array(
    [
        [5.007, 4.994, 5.005, 4.990, 4.999],
        [19.663e-3, 19.639e-3, 19.640e-3, 19.685e-3, 19.678e-3],
        [1.0456, 1.0438, 1.0468, 1.0428, 1.0433],
    ]
)
#: JCGM 100, Table H.6: readings and corrections of a thermometer (°C).
READING = [21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511]
CORRECTION = [-0.171, -0.169, -0.166, -0.159, -0.164, -0.165, -0.156, -0.157, -0.159, -0.161, -0.16]


def row(u, sensitivity=1.0, dof=np.inf):
    return InputQuantity("x", 0.0, "1", u, "A" if np.isfinite(dof) else "B", "", sensitivity, dof)


def comparator():
    return Budget((row(5.8, dof=24), row(3.9, dof=5), row(6.7, dof=8)))


def end_gauge():
    """H.1, in nm: of the standard, the comparator, and the differences of expansion and warmth."""
    length, apart = 50_000_623.0, comparator()
    rows = (row(25.0, dof=18), row(apart.u, dof=apart.dof))
    rows += (row(1e-6 / np.sqrt(3), 0.1 * length, 50), row(0.05 / np.sqrt(3), -11.5e-6 * length, 2))
    return Budget(rows)


def impedance():
    """H.2: of R, X and Z by V, I and φ."""
    voltage, current, phase = mean = OBSERVED.mean(axis=1)
    size, cos, sin = voltage / current, np.cos(phase), np.sin(phase)
    relative = np.array([1.0 / voltage, -1.0 / current, 0.0])
    turned = np.array([0.0, 0.0, 1.0])
    slopes = {
        "R": size * (cos * relative - sin * turned),
        "X": size * (sin * relative + cos * turned),
        "Z": size * relative,
    }
    u, correlation = OBSERVED.std(axis=1, ddof=1) / np.sqrt(5), np.corrcoef(OBSERVED)
    return mean, {name: Budget(tuple(map(row, u, by)), correlation) for name, by in slopes.items()}


def thermometer():
    """H.3: the line about 20 °C, its covariance, and the budget of the correction at 30 °C."""
    line, covariance = np.polyfit(np.array(READING) - 20.0, CORRECTION, 1, cov=True)
    u = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(u, u)
    return line, u, correlation, Budget((row(u[0], 10.0), row(u[1])), correlation)


def test_the_end_gauge_of_h_1():
    assert round(comparator().u, 1) == 9.7
    # the GUM goes on with 9.7 for 9.688; of the unrounded number it is 25.4
    assert round(comparator().dof * (9.7 / comparator().u) ** 4, 1) == 25.6
    budget = end_gauge()
    assert [round(each.contribution, 1) for each in budget.inputs] == [25.0, 9.7, 2.9, 16.6]
    assert round(budget.u) == 32
    assert int(budget.dof) == 16
    assert round(budget.coverage_factor(0.99), 2) == 2.92
    # the GUM multiplies what it has rounded; of the unrounded numbers it is 92
    assert round(2.92 * 32) == 93
    assert round(budget.expanded(0.99)) == 92


def test_resistance_and_reactance_of_h_2():
    (voltage, current, phase), of = impedance()
    size = voltage / current
    values = {"R": size * np.cos(phase), "X": size * np.sin(phase), "Z": size}
    # the five observations give 0.2956 for u(X), of which the GUM prints 0.295
    printed = {"R": (127.732, 0.071), "X": (219.847, 0.2956), "Z": (254.260, 0.236)}
    for name, (value, u) in printed.items():
        assert round(float(values[name]), 3) == value
        assert round(of[name].u, 4 if name == "X" else 3) == u

    def correlation(one, other):
        return round(of[one].covariance(of[other]) / (of[one].u * of[other].u), 3)

    assert correlation("R", "X") == -0.588
    assert correlation("R", "Z") == -0.485
    assert correlation("X", "Z") == 0.993
    # Welch and Satterthwaite's equation is that of independent inputs
    assert np.isnan(of["R"].dof)
    assert of["R"].coverage_factor() == pytest.approx(ndtri(0.975))


def test_the_thermometer_of_h_3():
    (slope, cold), (u_slope, u_cold), correlation, budget = thermometer()
    assert (round(cold, 4), round(u_cold, 4)) == (-0.1712, 0.0029)
    assert (round(slope, 5), round(u_slope, 5)) == (0.00218, 0.00067)
    assert round(correlation[0, 1], 3) == -0.930
    assert (round(cold + 10.0 * slope, 4), round(budget.u, 4)) == (-0.1494, 0.0041)


def test_gtc_finds_the_same():
    gtc = pytest.importorskip("GTC", reason="the extra test is not installed as it is locked")
    standard, at = gtc.ureal(50_000_623.0, 25.0, 18), gtc.ureal(-0.1, 0.2)
    apart = sum((gtc.ureal(0.0, *known) for known in ((5.8, 24), (3.9, 5), (6.7, 8))), 215.0)
    expansion = gtc.ureal(0.0, gtc.type_b.uniform(1e-6), 50)
    warmth = gtc.ureal(0.0, gtc.type_b.uniform(0.05), 2)
    length = standard + apart - standard * (expansion * at + 11.5e-6 * warmth)
    assert end_gauge().u == pytest.approx(length.u, rel=1e-6)
    assert end_gauge().dof == pytest.approx(length.df, rel=1e-6)
    assert end_gauge().expanded(0.99) == pytest.approx(
        gtc.reporting.k_factor(np.floor(length.df), 99) * length.u, rel=1e-6
    )
    voltage, current, phase = gtc.type_a.multi_estimate_real(OBSERVED.tolist())
    size = voltage / current
    measurands = {"R": size * gtc.cos(phase), "X": size * gtc.sin(phase), "Z": size}
    _, of = impedance()
    for name, measurand in measurands.items():
        assert of[name].u == pytest.approx(measurand.u, rel=1e-9)
        for other, beside in measurands.items():
            both = gtc.get_covariance(measurand, beside)
            assert of[name].covariance(of[other]) == pytest.approx(both, rel=1e-9)
    line = gtc.type_a.line_fit([reading - 20.0 for reading in READING], CORRECTION)
    assert thermometer()[-1].u == pytest.approx((line.intercept + 10.0 * line.slope).u, rel=1e-9)


def test_trials_are_added_until_both_ends_are_settled():
    """The sum of four rectangular quantities of unit variance, whose quantiles are exact."""
    random, half = np.random.default_rng(0), np.sqrt(3.0)

    def draw(count):
        return random.uniform(-half, half, (count, 4)).sum(axis=1)

    few, many = (propagate(draw, tolerance) for tolerance in (1.0, 0.1))
    share = brentq(lambda at: irwinhall.cdf(at, 4) - 0.975, 2.0, 4.0)
    end = 2.0 * half * (share - 2.0)
    assert (many.low, many.high) == pytest.approx((-end, end), abs=0.02)
    assert 20_000 <= few.trials < many.trials
    # ± 1.96 u is wider than that, by less than half a unit of a digit of u
    budget = Budget((row(1.0),) * 4)
    around = -budget.expanded(), budget.expanded()
    assert many.agrees(around, budget.tolerance)
    assert not many.agrees(around, 0.02)


def test_a_bent_measurand_does_not_agree_and_one_without_uncertainty_tells_nothing():
    assert not CoverageInterval(20_000, -1.2, 2.9).agrees(
        (-1.96, 1.96), Budget((row(1.0),)).tolerance
    )
    assert np.isnan(Budget((row(0.0),)).tolerance)
    assert not CoverageInterval(0, np.nan, np.nan).agrees((-1.96, 1.96), 5.0)


def test_part_of_a_budget_keeps_what_is_correlated():
    _, _, _, budget = thermometer()
    ordered = budget.largest_first()
    assert [row.contribution for row in ordered.inputs] == sorted(
        (row.contribution for row in budget.inputs), reverse=True
    )
    assert ordered.u == pytest.approx(budget.u, rel=1e-12)
    assert budget.part(np.array([1])).u == pytest.approx(budget.inputs[1].u)
