"""Fits of levers that more than the swept supply heats: a reader held at a voltage, warm ends."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from hotlever import Lever, Probe, fit
from hotlever.errors import InputError
from hotlever.estimate import Measurement, read_fit, read_measurement
from hotlever.estimate.experiment import ExperimentAtRest
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import given_measurement
from hotlever.probe import MeshOptions
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.quantities import observables_of

BIAS = np.array([-7.5, -4.0, 0.0, 1.0, 5.0, 8.0])
#: Relative steps of the Taylor test.
STEPS = (0.004, 0.002)
HELD = {"kind": "supply", "bias_V": 2.0, "series_resistance_ohm": 500.0}
CIRCUITS = {
    "held voltage": {"reader": HELD},
    "warm end": {"ground": {"kind": "ground", "base_temperature_K": 350.0}},
}


def wired(*circuits: str) -> Probe:
    contacts = [contact for circuit in circuits for contact in CIRCUITS[circuit].items()]
    return Probe.reference().with_(
        **{f"circuit.{name}.{key}": one[key] for name, one in contacts for key in one}
    )


def solved_observables(lever: Lever, bias: np.ndarray) -> np.ndarray:
    """What is observed of states that are solved one by one."""
    data = lever.dataset(lever.solve(bias))
    return observables_of(data)


@pytest.fixture(scope="module")
def coarse() -> Lever:
    return Lever(wired("held voltage"), COARSE)


def test_predictions_are_states_and_their_slopes_have_taylor_order_two():
    probe = wired(*CIRCUITS).with_(bridge_upper_ohm=5600.0, bridge_lower_ohm=2000.0)
    names = ("base_temperature_K", "heater_width_um")
    similar = SimilarLevers(Lever(probe, COARSE))
    between = ExperimentAtRest(similar, None, BIAS, names).predict(probe)
    off = np.abs(between.values - solved_observables(similar.lever(probe), BIAS)).max(axis=1)
    assert np.all(off < [2e-5, 2e-5, 0.02, 2e-4])
    # slopes between the states of the branch are those of nearby ones
    branch = between.linearised.branch
    bias = probe.circuit.bias(*branch.values[2:-2:9, :2].T)
    at = ExperimentAtRest(similar, None, bias, names).predict(probe, between)
    start = solved_observables(similar.lever(probe), bias)
    for place, name in enumerate(names):
        (value,) = probe.values([name])
        levers = [similar.lever(probe.replace({name: value * (1 + step)})) for step in STEPS]
        rest = [
            np.abs(
                solved_observables(one, bias) - start - step * value * at.slopes[:, :, place]
            ).max(axis=1)
            for step, one in zip(STEPS, levers, strict=True)
        ]
        assert np.log2(rest[0] / rest[1]).min() > 1.8, name


def test_the_other_polarity_is_that_of_supplies_reversed(coarse):
    other = coarse.with_probe(coarse.probe.with_(**{"circuit.reader.bias_V": -2.0}))
    down, up = coarse.dataset(coarse.solve(-BIAS)), other.dataset(other.solve(BIAS))
    np.testing.assert_allclose(down.tip_K, up.tip_K, rtol=1e-9)
    for column in ("current_mA", "lever_V", "reader_V", "reader_mA"):
        np.testing.assert_allclose(down[column], -up[column], rtol=1e-7, atol=1e-9)
    with pytest.raises(InputError, match="expected finite biases of 0 or more"):
        Lever(Probe.reference(), COARSE).sweep([-1.0])


def corrected(probe: Probe, bias: np.ndarray, full: Lever) -> ExperimentAtRest:
    """The lever on a very coarse mesh, corrected by another one."""
    fast = SimilarLevers(Lever(probe, MeshOptions(heater=0.8, corner=0.4, lever=0.35)))
    return ExperimentAtRest(fast, SimilarLevers(full), bias, usual_parameters(probe))


@pytest.mark.slow
def test_a_fit_finds_what_a_file_of_both_polarities_was_made_with(coarse, tmp_path):
    truth = {"c_kappa": 0.62, "n_d": 5.0e17, "p": 2.5}
    true = coarse.probe.replace(truth)
    data = coarse.with_probe(true).sweep(np.linspace(-8.0, 9.0, 24))
    rows = zip(
        *(data[name].values for name in ("bias_V", "current_mA", "reader_V", "tip_K")), strict=True
    )
    path = tmp_path / "held.csv"
    lines = [",".join(f"{value:.12g}" for value in row) for row in rows]
    path.write_text("\n".join(["V_b (V),I_h (mA),V_r (V),T_tip (K)", *lines]))
    measured = read_measurement(path, circuit=true.circuit)
    assert not [note for note in measured.notes if "differs" in note]

    model = partial(corrected, full=coarse)
    found = fit(measured, coarse.probe, fixed=dict.fromkeys(("delta", "a0", "a1")), model=model)
    for name, value in truth.items():
        assert found.parameters[name].value == pytest.approx(value, rel=2e-5)
    assert found.residual_rms["tip_K"] < 0.02
    assert found.residual_rms["current_mA"] < 1e-5
    found.write(tmp_path / "fit.json")
    again = read_fit(tmp_path / "fit.json")
    assert again.measurement.bias_V.min() == -8.0
    assert again.probe == found.probe


def test_a_file_is_mirrored_only_where_polarities_are_alike(tmp_path):
    path = tmp_path / "both.csv"
    path.write_text("V_b (V),I_h (mA)\n-2,-0.35\n-1,-0.2\n1,0.07\n2,0.21\n")
    held, plain = wired("held voltage"), Probe.reference()
    assert read_measurement(path).bias_V.tolist() == [2.0, 1.0, 1.0, 2.0]
    assert given_measurement(path, held).bias_V.tolist() == [-2.0, -1.0, 1.0, 2.0]
    assert given_measurement(path, plain).bias_V.tolist() == [2.0, 1.0, 1.0, 2.0]
    charged = plain.with_physics(("thermoelectric",))
    assert given_measurement(path, charged).bias_V.tolist() == [-2.0, -1.0, 1.0, 2.0]


def test_a_fit_in_time_is_refused():
    from hotlever.lever.transient import step

    measured = Measurement.in_time([1.0, 2.0], step(4.0), [0.577, 0.576])
    with pytest.raises(InputError, match=r"\[circuit.reader\]: a fit in time takes a lever that"):
        fit(measured, wired("held voltage"))
