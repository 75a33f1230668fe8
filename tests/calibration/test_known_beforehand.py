"""Calibrations of levers of which more is known, or something else, than usual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hotlever.estimate import calibrate, fit, read_calibration
from hotlever.lever import Lever
from hotlever.probe import Circuit, Probe
from synthetic_curves import measured_curve, measurement_of

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.mark.slow
def test_priors_are_about_the_circuit_of_the_measurement(reference):
    """Not about the probe file's, where they differ; also as text."""
    circuit = Circuit(series_resistance_ohm=3000.0)
    curve = measured_curve(reference, np.random.default_rng(7), circuit=circuit, to_V=7.5)
    data = replace(measurement_of(curve), series_resistance_ohm=3000.0)
    calibration = calibrate(data, priors={"dimensions": "± 2%"})
    assert calibration.describes_data
    assert calibration.priors["series_resistance_ohm"].value == 3000.0
    assert calibration.priors["length_um"].spread == pytest.approx(0.02 * 54.4)
    own = fit(data, priors={"series_resistance_ohm": "± 0.1%", "n_d": "± 15%"})
    assert own.parameters["series_resistance_ohm"].value == pytest.approx(3000.0, rel=5e-3)


def test_no_limit_is_below_the_base_of_a_lever_of_which_next_to_nothing_is_known(reference):
    """A heater cools nothing; what is below the stated base is what is not known of that."""
    curve = measured_curve(reference, np.random.default_rng(0), noise=0.01, points=8, to_V=4.0)
    calibration = calibrate(measurement_of(curve), priors={"c_kappa": "×/ 4", "a0": "×/ 2"})
    table = calibration.table
    base_K = calibration.probe.circuit.base_temperature_K
    limit = base_K - 1.96 * table.budget_K.sel(source="base temperature").values
    assert (table.tip_low_K.values >= np.minimum(limit, table.tip_K.values) - 1e-3).all()
    # an error the same either way would reach below it
    assert (table.tip_K.values - 1.96 * table.tip_stderr_K.values < limit).any()


@pytest.mark.slow
def test_edges_that_are_off_together_are_known_by_one_prior():
    """Each dimension by itself would have to be many times its tolerance away.

    The lever obeys the laws of the paper: what others leave open hides edges as well.
    """
    true = Lever(Probe.reference().with_(edge_bias_um=-0.12))
    curve = measured_curve(true.branch(), np.random.default_rng(0))
    priors = {"dimensions": "± 1%", "edge_bias_um": "± 0.1", "laws": "paper"}
    calibration = calibrate(measurement_of(curve), priors=priors)
    use = calibration.priors["edge_bias_um"]
    assert use.posterior_value == pytest.approx(-0.12, abs=2 * use.posterior_spread)
    assert use.posterior_spread < 0.7 * use.spread
    error = np.abs(
        calibration.table.tip_K - true.branch().tip_temperature(calibration.table.power_mW)
    )
    assert float((error / calibration.table.tip_stderr_K).max()) < 2.0


@pytest.mark.slow
def test_doping_known_to_a_factor_is_calibrated_and_written_with_its_distribution(run, tmp_path):
    """The lever that is stated has a third of the doping."""
    true = Lever(Probe.reference()).branch()
    curve = measured_curve(true, np.random.default_rng(4), to_V=9.0)
    rows = zip(curve.bias_V, curve.current_mA, strict=True)
    lines = ["V_b (V),I_h (mA)", *(f"{bias:.6f},{current:.6f}" for bias, current in rows)]
    (tmp_path / "iv.csv").write_text("\n".join(lines))
    status, out, err = run("calibrate", "iv.csv", "--prior", "n_d=1.9e17×/3", "-o", "cal.json")
    assert status == 0, err
    assert "no lever like this one" not in out + err
    use = read_calibration(tmp_path / "cal.json").priors["n_d"]
    assert use.distribution == "log-normal"
    assert (use.value, use.spread / use.value) == pytest.approx((1.9e17, np.log(3.0)))
    off = abs(np.log(use.posterior_value / 5.75e17))
    assert off < 3.0 * use.posterior_spread / use.posterior_value
    assert use.shift == pytest.approx(1.0, abs=0.3)
    if use.shift > 1.0:
        assert f"n_d by {use.shift:+.1f} σ" in out
    table = read_calibration(tmp_path / "cal.json").table
    error = np.abs(table.tip_K - true.tip_temperature(table.power_mW))
    assert float((error / table.tip_stderr_K).max()) < 3.0
