"""Random levers under random wave forms: each is followed to the end, or says when it stopped."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import HistoryEndError, InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import Waveform, pulse, ramp, simulate, sine, step, switched_off
from hotlever.materials import PARAMETERS
from hotlever.materials.silicon import MELTING_POINT
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import dimensions_of

#: Random ones that the usual run has, of all.
_FEW, _ALL = 6, 200


def random_probe(rng: np.random.Generator) -> Probe:
    """A probe whose dimensions, material and circuit are any that there might be."""
    while True:
        probe = Probe.reference() if rng.random() < 0.7 else Probe.u_shape()
        names = [*dimensions_of(probe), *(name for name in PARAMETERS if name != "delta")]
        values = probe.values(names) * np.exp(rng.normal(0.0, 0.15, len(names)))
        circuit = {"series_resistance_ohm": float(rng.choice([0.0, 300.0, 5600.0, 2e4]))}
        try:
            perturbed_probe = probe.replace(dict(zip(names, values.tolist(), strict=True)))
            return perturbed_probe.with_(
                **circuit, base_temperature_K=float(rng.uniform(250.0, 400.0))
            )
        except InputError:
            continue  # its parts would overlap


def random_waveform(rng: np.random.Generator) -> tuple[Waveform, float]:
    """A wave form from nothing to far too much, and how long it is followed (µs)."""
    bias = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, 2.0))
    length = float(10.0 ** rng.uniform(-3.0, 3.0))
    choices = [
        lambda: (step(bias), length),
        lambda: (pulse(bias, length), 10.0 * length),
        lambda: (pulse(bias, length, 3.0 * length, 4), 12.0 * length),
        lambda: (ramp(bias, length), 2.0 * length),
        lambda: (sine(0.0, bias, 1e6 / length), 2.0 * length),
        lambda: (switched_off(min(abs(bias), 1.0)), length),
    ]
    return choices[rng.integers(len(choices))]()


@pytest.mark.parametrize(
    "seed",
    [pytest.param(n, marks=[] if n < _FEW else [pytest.mark.slow]) for n in range(_ALL)],
)
def test_a_history_ends_or_says_when_it_stopped(seed):
    rng = np.random.default_rng(seed)
    probe, (waveform, until) = random_probe(rng), random_waveform(rng)
    message = ""
    try:
        data = simulate(Lever(probe, COARSE), waveform, until)
        reached = until
    except HistoryEndError as error:
        data, reached, message = error.partial, error.time_reached, str(error)
    if message:
        assert 0.0 <= reached < until
        assert f"after {reached:.6g} µs" in message or f"up to {reached:.6g} µs" in message
    for name in ("tip_K", "current_mA", "lever_V", "stored_nJ", "lost_nJ"):
        assert np.isfinite(data[name]).all()
    if data.sizes["time"]:
        assert data.time.values[-1] == pytest.approx(reached, rel=1e-6, abs=1e-9)
        assert data.max_K.max() < MELTING_POINT + 1.0
        stored_and_lost = data.stored_nJ - data.stored_nJ[0] + data.lost_nJ
        largest = float(np.abs(data.supplied_nJ).max() + np.abs(data.stored_nJ).max())
        assert np.abs(data.supplied_nJ - stored_and_lost).max() <= 1e-4 * largest + 1e-12
