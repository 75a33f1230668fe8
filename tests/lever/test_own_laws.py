"""Levers of materials with laws of their own: what is written of them, and what reads it."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimation import Measurement, fit, read_fit
from hotlever.lever import Lever, probe_of, read_sweep, sweep_csv, write_sweep
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import pulse, simulate
from hotlever.materials.kinds import HighDopedSilicon
from hotlever.probe import Probe
from hotlever.probe.parameters import usual_parameters
from hotlever.studies.simulation_based_calibration import MinimosLever

REFUSED = "follows laws of its own, those of the Python class .*, which no file holds"


class DoubledSilicon(HighDopedSilicon):
    """High-doped silicon that conducts twice as well."""

    def electrical_conductivity(self, T, n):
        value, by = super().electrical_conductivity(T, n)
        return 2.0 * value, {name: 2.0 * slope for name, slope in by.items()}


@pytest.fixture
def probe():
    """The lever of the example whose legs follow a law of their own."""
    drawn = Probe.from_file("src/hotlever/examples/boron-lever.toml")
    legs = DoubledSilicon(**drawn.materials["legs"].model_dump())
    return drawn.model_copy(update={"materials": {**drawn.materials, "legs": legs}})


@pytest.mark.parametrize("made", ["of the lever", "of the probe"])
def test_a_sweep_says_that_its_laws_are_in_no_file(made, probe, tmp_path):
    lever = MinimosLever(Probe.reference(), COARSE)
    lever = lever if made == "of the lever" else Lever(probe, COARSE)
    sweep = lever.sweep([1.0, 2.0])
    write_sweep(sweep, tmp_path / "sweep.nc")
    again = read_sweep(tmp_path / "sweep.nc")
    assert ("MinimosSilicon" if made == "of the lever" else "DoubledSilicon") in again.attrs["laws"]
    with pytest.raises(InputError, match=REFUSED):
        probe_of(again)
    # what needs no material is as ever
    assert len(sweep_csv(again).splitlines()) == 3
    circuit = lever.probe.circuit
    assert Measurement.of_sweep(again).series_resistance_ohm == circuit.series_resistance_ohm


def test_a_history_says_so_too():
    history = simulate(MinimosLever(Probe.reference(), COARSE), pulse(2.0, 1.0), at=[1.0])
    with pytest.raises(InputError, match=REFUSED):
        probe_of(history)


def test_a_probe_file_is_refused_and_a_changed_probe_keeps_its_laws(probe, tmp_path):
    probe.to_file(tmp_path / "own.toml")
    with pytest.raises(InputError, match=rf"own\.toml: 'legs' {REFUSED}"):
        Probe.from_file(tmp_path / "own.toml")
    changed = probe.in_medium("air").with_(**{"legs.a0": 1.2e-3})
    assert type(changed.materials["legs"]) is DoubledSilicon
    assert changed.materials["legs"].a0 == 1.2e-3
    assert changed.materials["hot"] == probe.materials["hot"]


def test_a_fit_file_does_not_give_another_lever(probe, tmp_path):
    measurement = Measurement.of_sweep(Lever(probe, COARSE).sweep(np.linspace(0.5, 4.5, 9)))
    held = [name for name in usual_parameters(probe) if name != "legs.a0"]
    fit(measurement, probe, fixed=dict.fromkeys(held)).write(tmp_path / "fit.json")
    with pytest.raises(InputError, match=REFUSED):
        read_fit(tmp_path / "fit.json")


def test_what_has_the_usual_laws_is_read_back(tmp_path):
    usual = Probe.from_file("src/hotlever/examples/boron-lever.toml")
    assert "laws" not in usual.sections()
    assert probe_of(Lever(usual, COARSE).sweep([1.0])).materials == usual.materials
