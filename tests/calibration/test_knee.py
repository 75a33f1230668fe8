"""The knee of measured I-V curves: no bias, honest errors, a clear word when it is not there."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate.knee import GaussianProcess, IVCurve, KneeOutsideError, find_knee, scale_to
from hotlever.probe import Circuit
from synthetic_curves import current_at, measured_curve

CIRCUIT = Circuit()


def test_without_noise_the_knee_is_found(reference, lever_3):
    bias = np.linspace(1, 11, 400)
    curve = IVCurve.of(bias, current_at(reference, bias, CIRCUIT), CIRCUIT)
    for like in (None, reference, lever_3):
        knee = find_knee(curve, like)
        assert knee.power_mW == pytest.approx(reference.knee.power_mW, rel=1e-3)
        assert knee.lever_V == pytest.approx(reference.knee.lever_V, rel=1e-4)
        assert knee.current_mA == pytest.approx(reference.knee.current_mA, rel=1e-3)
        assert knee.bias_V == pytest.approx(knee.lever_V + 5.6 * knee.current_mA)


def test_noisy_knees_scatter_as_stated(reference, lever_3):
    """40 points with 0.2 % noise; the curve is smoothed with the help of another lever."""
    rng = np.random.default_rng(1)
    true = reference.knee
    knees = [find_knee(measured_curve(reference, rng), lever_3) for _ in range(25)]
    error = np.array([knee.power_mW / true.power_mW - 1 for knee in knees])
    assert np.sqrt(np.mean(error**2)) < 0.008
    assert np.quantile(np.abs(error), 0.95) < 0.015
    assert abs(error.mean()) < 0.004
    for name in ("power_mW", "lever_V", "current_mA"):
        pull = np.array(
            [
                (getattr(knee, name) - getattr(true, name)) / getattr(knee, f"{name}_stderr")
                for knee in knees
            ]
        )
        # 25 trials: two standard deviations of the counts are 19 and 9 %
        assert 0.49 < np.mean(np.abs(pull) < 1.0) < 0.88, name
        assert np.mean(np.abs(pull) < 1.96) > 0.85, name
    assert np.median([knee.current_noise for knee in knees]) == pytest.approx(0.002, rel=0.2)


def test_the_stated_error_follows_the_noise(reference, lever_3):
    def typical(noise: float) -> float:
        rng = np.random.default_rng(2)
        curves = [measured_curve(reference, rng, noise=noise) for _ in range(6)]
        return float(np.median([find_knee(curve, lever_3).power_mW_stderr for curve in curves]))

    assert typical(0.004) > 1.5 * typical(0.001)


@pytest.mark.parametrize(("to_V", "like"), [(7.5, True), (8.0, True), (7.5, False)])
def test_a_knee_above_the_range_is_said_to_be_there(reference, lever_3, to_V, like):
    curve = measured_curve(lever_3, np.random.default_rng(3), to_V=to_V - 0.5)
    with pytest.raises(KneeOutsideError, match="still rises at the end") as no:
        find_knee(curve, reference if like else None)
    assert ("by comparison with the model; measure to" in str(no.value)) == like


def test_a_knee_below_the_range_is_said_to_be_there(reference):
    curve = measured_curve(reference, np.random.default_rng(4), from_V=8.6, points=12)
    with pytest.raises(KneeOutsideError, match="below the measured range"):
        find_knee(curve)
    with pytest.raises(InputError, match=r"highest at point [12]: .* measure from a lower bias"):
        scale_to(curve, reference)


def test_the_advised_bias_reaches_the_knee(reference, lever_3):
    curve = measured_curve(lever_3, np.random.default_rng(5), to_V=7.0)
    with pytest.raises(KneeOutsideError) as no:
        find_knee(curve, reference)
    advised = float(str(no.value).split("measure to ")[1].split(" V")[0])
    knee = lever_3.knee
    assert advised > knee.lever_V + 5.6 * knee.current_mA
    further = measured_curve(lever_3, np.random.default_rng(5), to_V=min(advised, 11.0))
    assert find_knee(further, reference).power_mW == pytest.approx(knee.power_mW, rel=0.015)


def test_the_scale_of_a_cold_curve_of_the_same_lever_is_one(reference):
    curve = measured_curve(reference, np.random.default_rng(6), to_V=7.0, noise=2e-4)
    power, resistance, stderr = scale_to(curve, reference)
    assert power == pytest.approx(1.0, abs=4 * stderr)
    assert stderr < 0.02
    assert resistance == pytest.approx(1.0, abs=0.01)


def test_a_scaled_lever_gives_its_scale(reference):
    """A lever of 1.3 times the heat conductance and 0.9 times the resistance."""
    bias = np.linspace(1, 10, 60)
    current = current_at(reference, bias, CIRCUIT)
    lever = CIRCUIT.lever_voltage(bias, current)
    power, resistance = 1.3 * lever * current, 0.9 * lever / current
    lever, current = np.sqrt(power * resistance), np.sqrt(power / resistance)
    scaled = IVCurve.of(CIRCUIT.bias(lever, current), current, CIRCUIT)
    power, resistance, _ = scale_to(scaled, reference)
    assert (power, resistance) == pytest.approx((1.3, 0.9), rel=6e-3)
    knee_mW = power * reference.knee.power_mW
    assert find_knee(scaled, reference).power_mW == pytest.approx(knee_mW, rel=5e-3)


def test_curves_that_cannot_tell_are_refused(reference):
    bias = np.linspace(1, 11, 40)
    current = current_at(reference, bias, CIRCUIT)
    with pytest.raises(InputError, match="without a series resistance"):
        find_knee(IVCurve.of(bias - 5.6 * current, current, Circuit(series_resistance_ohm=0)))
    with pytest.raises(InputError, match="expected at least 6"):
        IVCurve.of(bias[:5], current[:5], CIRCUIT)
    with pytest.raises(InputError, match="series resistance of 56000 ohm, expected positive"):
        IVCurve.of(bias, current, Circuit(series_resistance_ohm=56000))
    sparse = np.array([1.0, 3.0, 5.0, 7.0, 8.0, 8.5, 9.5, 11.0])
    few = IVCurve.of(sparse, current_at(reference, sparse, CIRCUIT), CIRCUIT)
    with pytest.raises(InputError, match="on either side"):
        find_knee(few)
    cold = np.linspace(0.5, 1.0, 10)
    with pytest.raises(InputError, match="too cold to tell"):
        scale_to(IVCurve.of(cold, current_at(reference, cold, CIRCUIT), CIRCUIT), reference)


def test_a_smooth_curve_covers_the_truth():
    """Its value, and its slope, which decides where the knee is."""
    rng = np.random.default_rng(7)
    x, at, step = np.linspace(0, 2, 50), 1.1, 1e-3
    pulls = []
    for _ in range(25):
        noisy = np.sin(4 * x) + 0.02 * rng.standard_normal(x.size)
        curve = GaussianProcess(x, noisy, np.ones_like(x))
        around = np.array([at - step, at, at + step])
        likeliest, *others = (
            np.array([values[1], (values[2] - values[0]) / (2 * step)])
            for values in (curve.value(around), *curve.samples(around, 1000))
        )
        pulls.append((likeliest - [np.sin(4.4), 4 * np.cos(4.4)]) / np.std(others, axis=0))
        assert curve.noise_factor == pytest.approx(0.02, rel=0.4)
    assert 0.5 < np.sqrt(np.mean(np.square(pulls))) < 1.4
