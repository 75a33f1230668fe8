"""Calibrations of levers of which more is known, or something else, than usual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hotlever.calibration.procedure import calibrate
from hotlever.fitting import fit
from hotlever.lever import Lever
from hotlever.probe import Circuit, Probe
from synthetic_curves import measured_curve, measurement_of


def test_priors_are_about_the_circuit_of_the_measurement(reference):
    """Not about the probe file's, where they differ; also as text."""
    circuit = Circuit(series_resistance_ohm=3000.0)
    curve = measured_curve(reference, np.random.default_rng(7), circuit=circuit, to_V=7.5)
    data = replace(measurement_of(curve), series_resistance_ohm=3000.0)
    found = calibrate(data, priors={"dimensions": "± 2%"})
    assert found.describes_data
    assert found.priors["series_resistance_ohm"].value == 3000.0
    assert found.priors["length_um"].spread == pytest.approx(0.02 * 54.4)
    own = fit(data, priors={"series_resistance_ohm": "± 0.1%", "n_d": "± 15%"})
    assert own.parameters["series_resistance_ohm"].value == pytest.approx(3000.0, rel=5e-3)


def test_edges_that_are_off_together_are_known_by_one_prior():
    """Each dimension by itself would have to be many times its tolerance away."""
    true = Lever(Probe.reference().with_(edge_bias_um=-0.12))
    curve = measured_curve(true.branch(), np.random.default_rng(0))
    found = calibrate(measurement_of(curve), priors={"dimensions": "± 1%", "edge_bias_um": "± 0.1"})
    use = found.priors["edge_bias_um"]
    assert use.posterior_value == pytest.approx(-0.12, abs=2 * use.posterior_spread)
    assert use.posterior_spread < 0.7 * use.spread
    error = np.abs(found.table.tip_K - true.branch().tip_temperature(found.table.power_mW))
    assert float((error / found.table.tip_stderr_K).max()) < 2.0
