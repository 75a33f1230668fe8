"""Which medium a fit assumes: what is asked, else what the data file says, else the probe file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import hotlever
from hotlever.estimate import read_measurement
from hotlever.measurement import with_measured_circuit
from hotlever.probe import Probe

EXAMPLE = Path(hotlever.__file__).parent / "examples" / "lever-a.csv"


@pytest.mark.parametrize(
    ("option", "in_file", "in_probe", "expected", "noted"),
    [
        (None, None, "vacuum", "vacuum", False),
        (None, None, "air", "air", False),
        (None, "air", "vacuum", "air", True),
        (None, "vacuum", "air", "vacuum", True),
        (None, "air", "air", "air", False),
        ("air", "vacuum", "vacuum", "air", True),
        ("vacuum", "air", "vacuum", "vacuum", True),
        ("air", None, "vacuum", "air", False),
    ],
)
def test_medium_of_a_fit(option, in_file, in_probe, expected, noted):
    measurement = replace(read_measurement(EXAMPLE), medium=in_file)
    probe, notes = with_measured_circuit(Probe.reference().in_medium(in_probe), measurement, option)
    assert probe.surroundings.medium == expected
    assert any("medium" in note for note in notes) == noted
