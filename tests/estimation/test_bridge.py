"""A lever in a Wheatstone bridge: what it shows, and what its voltage alone tells of the lever."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from documents import EXAMPLES
from experiments import full_experiment
from hotlever.errors import InputError
from hotlever.estimate import Measurement, calibrate, fit, read_measurement
from hotlever.estimate.experiment import ExperimentAtRest
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.transient import simulate, spectrum, step
from hotlever.probe import Circuit, Probe
from hotlever.quantities import OBSERVABLES

BRIDGE = {"bridge_upper_ohm": 4700.0, "bridge_lower_ohm": 1500.0, "bridge_gain": 20.0}
BRIDGE["bridge_offset_V"] = 1.0
BIAS = np.linspace(0.5, 9.5, 19)
#: Standard error of a current (mA).
NOISE = 1e-3
ROW = list(OBSERVABLES).index("bridge")


@pytest.fixture(scope="module")
def bridged(coarse):
    return coarse.with_probe(coarse.probe.with_(**BRIDGE))


@pytest.fixture(scope="module")
def sweep(bridged):
    return bridged.sweep(BIAS)


@pytest.fixture(scope="module")
def measured(bridged, sweep):
    """A current with noise, and the same by a bridge."""
    circuit, noise = bridged.circuit, np.random.default_rng(3).normal(0.0, NOISE, BIAS.size)
    current, errors = sweep.current_mA.values + noise, np.full(BIAS.size, NOISE)
    nothing = np.full(BIAS.size, np.nan)
    by_current = Measurement(
        BIAS, current, nothing, nothing, nothing, further={"current_error_mA": errors}
    )
    voltage = circuit.bridge_voltage(circuit.lever_voltage(BIAS, current), BIAS)
    gain = abs(circuit.bridge_change(circuit.series_kohm, 0.0))
    by_bridge = replace(
        by_current,
        current_mA=nothing,
        further={"bridge_output_V": voltage, "bridge_output_error_V": gain * errors},
    )
    return by_current, by_bridge


def test_its_voltage_is_that_of_a_network_of_conductances(bridged, sweep):
    """Nodes: supply, between R_s and the lever, between both resistors; all that is left is ground.

    The supply is a current source beside a large conductance.
    """
    source = 1e9
    upper, lower = 1.0 / BRIDGE["bridge_upper_ohm"], 1.0 / BRIDGE["bridge_lower_ohm"]
    series = 1.0 / bridged.circuit.series_resistance_ohm
    for state in sweep.transpose("bias", ...).bias:
        row = sweep.sel(bias=state)
        lever = row.current_mA.item() / 1000.0 / row.lever_V.item()
        conductance = np.array(
            [
                [source + series + upper, -series, -upper],
                [-series, series + lever, 0.0],
                [-upper, 0.0, upper + lower],
            ]
        )
        potential = np.linalg.solve(conductance, [source * state.item(), 0.0, 0.0])
        expected = BRIDGE["bridge_gain"] * (potential[1] - potential[2])
        expected += BRIDGE["bridge_offset_V"]
        assert row.bridge_output_V.item() == pytest.approx(expected, rel=1e-9)


def test_in_time_and_for_small_signals_it_follows_lever_and_bias(bridged, sweep):
    history = simulate(bridged, step(4.0), at=[0.0, 1.0, 3000.0])
    circuit = bridged.circuit
    np.testing.assert_allclose(
        history.bridge_output_V, circuit.bridge_voltage(history.lever_V, history.bias_V), rtol=1e-12
    )
    assert history.bridge_output_V.values[-1] == pytest.approx(
        sweep.bridge_output_V.sel(bias=4.0).item(), rel=1e-3
    )
    below, at, above = bridged.solve([3.999, 4.0, 4.001])
    slow = spectrum(at, [1e-2])
    size = slow.bridge_per_bias_V_per_V.item()
    slope = size * np.cos(np.radians(slow.bridge_per_bias_deg.item()))
    assert slope == pytest.approx((above.bridge_output_V - below.bridge_output_V) / 0.002, rel=1e-4)


def test_values_of_the_circuit_have_their_derivatives(bridged):
    """By central differences; those of the lever are in the test of all sensitivities."""
    names = ("series_resistance_ohm", "bridge_upper_ohm", "bridge_lower_ohm", "bridge_offset_V")
    names = (*names, "base_temperature_K")
    model = ExperimentAtRest(SimilarLevers(bridged), None, BIAS[::4], names)
    at = model.predict(bridged.probe)
    for place, name in enumerate(names[:4]):
        (value,) = bridged.probe.values([name])
        up, down = (
            at.surrogate.values_at(bridged.probe.replace({name: value * (1 + h)}).values(names))
            for h in (1e-4, -1e-4)
        )
        slope = (up - down)[ROW] / (2e-4 * value)
        np.testing.assert_allclose(at.slopes[ROW, :, place], slope, rtol=2e-5)


def test_its_voltage_alone_tells_what_the_current_does(bridged, measured):
    """To a bias the one follows from the other, so do their errors."""
    by_current, by_bridge = (
        fit(
            data,
            bridged.probe,
            fixed={"a1": None, "p": None, "n_d": None},
            weights="errors",
            model=lambda probe, bias: full_experiment(bridged, bias),
        )
        for data in measured
    )
    assert by_bridge.observables == ("bridge",)
    for name in by_current.names:
        expected, found = by_current.parameters[name], by_bridge.parameters[name]
        assert found.value == pytest.approx(expected.value, abs=1e-3 * expected.stderr)
        assert found.stderr == pytest.approx(expected.stderr, rel=1e-3)


def test_an_offset_is_found_with_the_rest(bridged, measured):
    """From the value that it had once."""
    fitted = fit(
        measured[1],
        bridged.probe.with_(bridge_offset_V=0.7),
        fixed=dict.fromkeys(("a0", "a1", "p", "n_d", "delta")),
        free=("bridge_offset_V",),
        weights="errors",
        model=lambda probe, bias: full_experiment(bridged, bias),
    )
    offset = fitted.parameters["bridge_offset_V"]
    assert offset.unit == "V"
    assert 0.0 < offset.stderr < 0.25 * BRIDGE["bridge_offset_V"]
    assert abs(offset.value - BRIDGE["bridge_offset_V"]) < 3.0 * offset.stderr


@pytest.mark.usefixtures("coarse_meshes")
def test_a_lever_is_calibrated_by_its_voltage_alone(bridged, sweep, measured):
    calibration = calibrate(measured[1], probe=bridged.probe, priors={"laws": "paper"})
    assert calibration.describes_data, calibration.reason
    table = calibration.table
    away = np.interp(BIAS, table.bias_V, table.tip_K) - sweep.tip_K
    assert np.abs(away / np.interp(BIAS, table.bias_V, table.tip_stderr_K)).max() < 2.0
    assert table.tip_stderr_K.max() < 15.0
    assert {"bridge_upper_ohm", "bridge_lower_ohm", "bridge_scale"} <= calibration.priors.keys()


@pytest.mark.parametrize("heading", ["V_bridge (mV)", "Bridge voltage [mV]", "Brückenspannung/mV"])
def test_files_head_it_as_laboratories_do_and_it_has_either_sign(tmp_path, heading):
    path = tmp_path / "measured.csv"
    path.write_text(f"V_b (V);{heading}\n1;-250\n2;-400\n-3;-120\n4;90\n", encoding="utf-8")
    data = read_measurement(path)
    assert data.further["bridge_output_V"].tolist() == [-0.25, -0.4, 0.12, 0.09]
    assert data.observables == ("bridge",)
    assert not any("negative" in note and "V_bridge is" in note for note in data.notes)


def test_the_offset_of_the_amplifier_has_no_polarity(bridged, sweep, tmp_path):
    circuit, path = bridged.circuit, tmp_path / "measured.csv"
    turned_V = circuit.bridge_voltage(-sweep.lever_V.values, -BIAS)
    rows = zip(-BIAS, turned_V, strict=True)
    path.write_text("V_b (V),V_bridge (V)\n" + "".join(f"{a},{b}\n" for a, b in rows))
    data = read_measurement(path, circuit=circuit)
    np.testing.assert_allclose(data.bias_V, BIAS)
    np.testing.assert_allclose(data.further["bridge_output_V"], sweep.bridge_output_V, atol=1e-9)


def test_the_example_shows_the_current_of_the_reference_probe_s():
    circuit = Probe.from_file(EXAMPLES / "bridge.toml").circuit
    by_bridge = read_measurement(EXAMPLES / "bridge.csv")
    by_current = read_measurement(EXAMPLES / "reference-probe.csv")
    assert by_bridge.observables == ("bridge",)
    np.testing.assert_array_equal(by_bridge.bias_V, by_current.bias_V)
    np.testing.assert_allclose(by_bridge.current(circuit), by_current.current_mA, atol=1e-7)


def test_a_bridge_is_in_the_probe_or_a_line_says_so(refused, tmp_path):
    (tmp_path / "v.csv").write_text("V_b (V),V_bridge (V)\n1,0.1\n2,0.2\n3,0.3\n")
    for command in ("fit", "calibrate"):
        assert "bridge_upper_ohm and bridge_lower_ohm in [circuit]" in refused(
            command, "v.csv", below_notes=True
        )
    reference = Probe.reference()
    for wrong, line in (
        ({"bridge_upper_ohm": 5600.0}, "a bridge needs bridge_lower_ohm"),
        ({"bridge_gain": 10.0}, "a bridge needs bridge_upper_ohm"),
        ({"bridge_offset_V": 0.1}, "a bridge needs bridge_upper_ohm"),
        ({**BRIDGE, "bridge_gain": 0.0}, "bridge_gain = 0: expected the gain"),
        ({**BRIDGE, "series_resistance_ohm": 0.0}, "a bridge needs a resistor in series"),
        ({**BRIDGE, "bridge_lower_ohm": -1.0}, "bridge_lower_ohm = -1"),
        ({"bridge_uper_ohm": 1.0}, "did you mean 'bridge_upper_ohm'"),
    ):
        with pytest.raises(InputError, match="bridge") as refused:
            reference.with_(**wrong)
        assert line in str(refused.value), str(refused.value)


def test_without_one_no_table_has_a_column_of_it(run):
    assert not Circuit().has_bridge
    _, out, _ = run("sweep", "--bias", "1:2:2")
    assert out.splitlines()[0].split(",")[-1] == "legs_ohm"
    _, out, _ = run("sweep", "--bias", "1:2:2", *[f"--set={k}={v}" for k, v in BRIDGE.items()])
    assert out.splitlines()[0].split(",")[-2:] == ["legs_ohm", "bridge_output_V"]
