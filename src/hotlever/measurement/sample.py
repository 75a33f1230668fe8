"""A measurement over a sample, and whether a probe can have made it."""

from __future__ import annotations

import numpy as np

from hotlever.errors import InputError
from hotlever.measurands import OF_A_CONTACT
from hotlever.measurement.data import DISTANCE, Measurement
from hotlever.probe import Probe


def check_sample(measurement: Measurement, probe: Probe) -> list[str]:
    """Refuse what no such probe shows of a sample; return a note on what does not count.

    Raises
    ------
    InputError
        If the tip touches nothing, or not where a temperature of the contact was measured; or one
        is not above the base temperature.
    """
    where = measurement.path or "measurement"
    base_K = probe.circuit.base_temperature_K
    for name, column in OF_A_CONTACT.items():
        values = measurement.observable(name)
        if np.isnan(values).all():
            continue
        if probe.contact is None:
            raise InputError(
                f"{where}: {column.symbol}: the tip of the probe touches nothing, expected a "
                "section [contact] in the probe file; if it is T_tip, where the tip stands on the "
                "lever, say so with --column"
            )
        for wrong, expected in (
            (values <= base_K, f"more than the base temperature, {base_K:g} K"),
            (np.isfinite(values) & measurement.out_of_contact, f"{DISTANCE} of 0, in contact"),
        ):
            if wrong.any():
                row = int(np.argmax(wrong))
                raise InputError(
                    f"{where}: {column.symbol} is {values[row]:.4g} K at "
                    f"{measurement.bias_V[row]:.4g} V, expected {expected}"
                )
    if measurement.distance_um is None or np.isnan(measurement.distance_um).all():
        return []
    if measurement.time_us is not None:
        raise InputError(f"{where}: {DISTANCE} counts at rest only, expected no column of the time")
    if probe.contact is None:
        return [f"{DISTANCE}: the probe has no [contact], so that distances do not count"]
    return []
