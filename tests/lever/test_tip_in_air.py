"""A lever whose tip's surface is in the air: at rest, in time, and only where it is asked for."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.estimate import Measurement, fit
from hotlever.lever import Lever
from hotlever.lever.fields import AirFields
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import simulate, step
from hotlever.lever.transient.frequency_domain import spectrum
from hotlever.probe import Probe, Tip

TIP = Tip(height_um=1.0, half_angle_deg=30.0, in_air=True)
AIR = Probe.reference().model_copy(update={"tip": TIP}).in_medium("air")
BIAS = [4.0, 10.748]


@pytest.fixture(scope="module")
def tipped() -> Lever:
    return Lever(AIR, COARSE)


def hidden(probe):
    """The probe whose tip conducts only."""
    return probe.with_(**{"tip.in_air": False})


def test_its_surface_cools_the_heater_a_little_and_heat_is_conserved(tipped):
    data = tipped.dataset(tipped.solve(BIAS))
    missing = data.power_mW - data.end_heat_mW - data.air_heat_mW
    assert np.abs(missing / data.power_mW).max() < 1e-8
    without = Lever(hidden(AIR), COARSE).sweep(BIAS)
    colder = without.tip_K.values - data.tip_K.values
    # benchmarks/tip.py fitted prints it at the same power
    assert 0.2 < colder[1] < 4.0
    assert np.abs(colder).max() == colder[1]


def test_in_vacuum_a_surface_changes_nothing(tipped):
    vacuum = tipped.in_medium("vacuum")
    alone = Lever(hidden(vacuum.probe), COARSE)
    np.testing.assert_array_equal(vacuum.sweep(BIAS).tip_K, alone.sweep(BIAS).tip_K)


def test_the_heater_gives_more_to_the_air_by_what_the_tip_does(tipped):
    (state,) = tipped.solve([10.748])
    fields = AirFields(tipped)
    flux, panels = fields.flux(state), fields.panels
    of_tip = panels.centres[:, 2] < -0.2 - 1e-6
    lost = fields.heat_by_region(state)
    assert flux @ panels.areas == pytest.approx(sum(lost.values()), rel=1e-9)
    assert 0 < flux[of_tip] @ panels.areas[of_tip] < lost["heater"]


def test_the_apex_of_a_tip_that_conducts_badly_is_cold():
    apex = np.array([[*AIR.layout().tip, -0.2 - TIP.height_um]])
    colder = []
    for kappa in (0.02, 30.0):
        lever = Lever(AIR.with_(**{"tip.kappa": kappa}), COARSE)
        (state,) = lever.solve([10.748])
        colder.append(state.tip_K - AirFields(lever).temperature(state, apex)[0])
    assert colder[0] - colder[1] > 10.0
    # all of the heater's temperature, but for panels as coarse as these
    assert colder[1] == pytest.approx(0.0, abs=4.0)


def test_small_signals_and_history_go_to_the_state_at_rest(tipped):
    low, state, high = tipped.solve([3.99, 4.0, 4.01])
    slow = spectrum(state, [1e-3]).tip_per_bias_K_per_V.item()
    assert slow == pytest.approx((high.tip_K - low.tip_K) / 0.02, rel=1e-3)
    history = simulate(tipped, step(4.0), 0.2e6, tolerance_K=0.5)
    assert history.tip_K[-1].item() == pytest.approx(state.tip_K, abs=0.05)


@pytest.mark.slow
def test_a_fit_knows_of_the_tip_by_the_probe_alone(tipped):
    data = Measurement.of_sweep(Lever(AIR).sweep(np.linspace(1.0, 11.0, 25)))
    start = AIR.with_(n_d=5e17, c_kappa=0.65)
    found = fit(data, start)
    assert found.describes_data
    assert found.parameters["n_d"].value == pytest.approx(AIR.material.n_d, rel=1e-3)
    assert found.parameters["c_kappa"].value == pytest.approx(AIR.material.c_kappa, rel=1e-3)
