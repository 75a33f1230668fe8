"""A probe in the circuit and the surroundings that its measurement was made in."""

from __future__ import annotations

from typing import Any

import numpy as np

from hotlever.errors import InputError
from hotlever.measurement.data import Measurement
from hotlever.probe import Probe

#: mbar; between these the pressure is no matter to a lever without a temperature jump.
_DENSE_MBAR = 700.0, 1200.0


def with_measured_circuit(
    probe: Probe, measurement: Measurement, medium: str | None = None
) -> tuple[Probe, list[str]]:
    """Return the probe in circuit and medium of the measurement, and a note on each difference.

    A `medium` that is asked for wins over both.

    Raises
    ------
    InputError
        If the pressure matters, and the probe does not say how the temperature jumps.
    """
    notes = []
    measured_in, assumed_in = measurement.medium, probe.surroundings.medium
    changes: dict[str, Any] = {"medium": medium or measured_in or assumed_in}
    if measured_in not in (None, changes["medium"]):
        notes.append(f"medium: {medium}, as asked, although the data file says {measured_in}")
    elif medium is None and changes["medium"] != assumed_in:
        notes.append(f"medium: the data file's {measured_in} is used, not the probe's {assumed_in}")
    names = ["series_resistance_ohm", "base_temperature_K"]
    if changes["medium"] == measured_in == "air":
        names.append("gas_conductivity")
        pressure = measurement.pressure_mbar
        if probe.surroundings.accommodation is not None:
            names.append("pressure_mbar")
        elif pressure is not None and not _DENSE_MBAR[0] <= pressure <= _DENSE_MBAR[1]:
            raise InputError(
                f"{measurement.path}: the pressure is {pressure:g} mbar, expected accommodation in "
                "[surroundings] of the probe file, with which it counts, such as "
                "accommodation = 0.9"
            )
    values = {**dict(probe.circuit), **dict(probe.surroundings)}
    for name in names:
        measured, assumed = getattr(measurement, name), values[name]
        if measured is not None and not np.isclose(measured, assumed, rtol=1e-9):
            changes[name] = measured
            notes.append(
                f"{name}: the data file's {measured:g} is used, not the probe's {assumed:g}"
            )
    return probe.with_(**changes), notes
