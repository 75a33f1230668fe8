"""Which state a row is compared with: the nearest on its load line, whatever a ramp would take."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.estimate.experiment import experiment_of
from hotlever.estimate.objective import Objective, PriorDensity
from hotlever.estimate.posterior import Posterior
from hotlever.estimate.residuals import Residuals
from hotlever.estimate.surrogate import Rows
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.quantities import OBSERVABLES

NAMES = ("n_d", "heater_width_um", "series_resistance_ohm")


@pytest.fixture(scope="module")
def folded():
    """A lever with a small resistor: its bias rises to a fold, falls, and rises again."""
    probe = Probe.reference().with_(series_resistance_ohm=300.0)
    return Lever(probe, COARSE).branch()


def current_alone(current):
    """What was measured, if it was nothing else."""
    nothing = np.full((len(OBSERVABLES) - 1, current.size), np.nan)
    return np.concatenate([current[None], nothing])


def rows_on(branch, tip_K):
    """Rows that lie on a branch, by their tip temperatures."""
    circuit = branch.equations.circuit
    current = branch.current(tip_K)
    bias = circuit.bias(branch.lever_voltage(tip_K), current)
    return Rows(bias, current_alone(current))


def test_rows_stay_on_their_part_of_a_branch_that_folds(folded):
    tips = np.array([400.0, 700.0, 870.0, 960.0, 1100.0, 1250.0])
    rows = rows_on(folded, tips)
    assert rows.bias_V[4] < rows.bias_V[2]  # it folds
    u, short = rows.states(folded, folded.equations.circuit)
    assert np.abs(folded.tip_K(u) - tips).max() < 1e-3
    assert np.all(short == 1.0)
    ramp = folded.read(folded.equations.circuit, rows.bias_V[:3]).u
    assert np.allclose(u[:3], ramp, rtol=0, atol=1e-9)


def test_beyond_its_highest_bias_a_lever_shows_less_than_at_its_end(folded):
    circuit = folded.equations.circuit
    highest = float(circuit.bias(*folded.curve(np.linspace(0, folded.end_u, 4000))[:, :2].T).max())
    rows = Rows(np.array([1.02, 1.1]) * highest, current_alone(np.array([0.9, 1.0])))
    u, short = rows.states(folded, circuit)
    assert np.allclose(short, [1.02, 1.1], rtol=1e-6)
    assert u[0] == u[1]
    end = folded.curve(u[0])[1]
    assert np.allclose(rows.values(folded, circuit)[0], [0.94 * end, 0.7 * end], rtol=1e-6)


@pytest.mark.parametrize("highest", [0.9, 1.25])
def test_derivatives_by_parameters_are_those_of_the_values(highest):
    """Also where rows are beyond the fold of a candidate: order two of a Taylor remainder."""
    probe = Probe.reference().with_(series_resistance_ohm=300.0)
    knee_V = 3.4
    bias = np.linspace(0.4, highest, 5) * knee_V
    current = 0.3 * bias
    model = experiment_of(probe, bias, names=NAMES).measuring(bias, current_alone(current))
    at = model.predict(probe)
    start, step = probe.values(NAMES), np.array([0.02, -0.01, 0.01])
    misses = []
    for share in (1.0, 0.5):
        values = at.surrogate.predict(start * (1.0 + share * step))[0]
        expected = at.values + at.slopes @ (start * share * step)
        misses.append(np.abs(values - expected)[0].max())
    assert misses[0] < 0.02 * at.values[0].max()
    assert misses[1] < 0.35 * misses[0] + 1e-9


def test_a_row_without_a_state_narrows_no_posterior():
    """It ended a lever at a melting tip, which was then stated to 7 K, 110 K off."""
    probe = Probe.reference().with_(series_resistance_ohm=300.0)
    names = NAMES[:2]
    prior = PriorDensity.of_priors(
        {name: Prior(value, 0.2) for name, value in zip(names, probe.values(names), strict=True)}
    )

    def covariance(bias):
        rows = bias, np.minimum(0.3 * bias, 0.9), *np.full((3, bias.size), np.nan)
        residuals = Residuals(Measurement(*rows), ["current"])
        model = experiment_of(probe, bias, names=names).measuring(*residuals.at_rest)
        prediction = model.predict(probe)
        objective = Objective(residuals, probe, names, list(names), prior)
        return prediction.without_state, Posterior(objective, prediction).covariance

    bias = np.array([0.5, 1.5, 2.5, 3.0])
    every, of_states = covariance(bias)
    there, with_end = covariance(np.append(bias, 4.5))
    assert not every.any()
    assert there.tolist() == [False, False, False, False, True]
    assert np.allclose(with_end, of_states, rtol=1e-4)
