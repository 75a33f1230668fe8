"""What a tip on the heater changes, and whether leaving it out explains the paper's knee error.

The paper's model has no tip; its knee is 50 K below the measured one. Three questions are told
apart: how the tip moves the knee of the same lever, how it moves the temperature at the same
power, and by how much a tipless model *fitted* to a lever with a tip misses its knee. Only the
last one compares with the paper, whose parameters are fitted.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.errors import ComputationError
from hotlever.estimation import Measurement, fit
from hotlever.lever import Branch, Lever, OperatingPoint
from hotlever.probe import Probe, Tip
from hotlever.spieser2017 import RAMP

#: Plausible tips of lithography probes, cones: height (µm) and half-angle (degrees).
SIZES = ((0.5, 15.0), (0.5, 30.0), (0.7, 20.0), (1.0, 15.0), (1.0, 30.0))


def tip_effects(probe: Probe) -> xr.Dataset:
    """Compute what tips of `SIZES` change on a lever, in the flat model and the probe's medium.

    Parameters
    ----------
    probe : Probe
        Without a tip.

    Returns
    -------
    xarray.Dataset
        On the dimension ``tip`` its ``height_um`` and ``half_angle_deg``; ``knee_K`` and
        ``knee_V``; how far the tip has ``moved_K`` the knee; ``at_power_K``, the largest change
        of the tip temperature at the same power; ``fitted_knee_K`` of a tipless lever fitted to
        the one with the tip, and ``missed_K``, how far the knee lies above it. The knee without a
        tip as the attributes ``without_K`` and ``without_V``.

    Raises
    ------
    ComputationError
        If one of the levers has no knee.
    """
    bare = Lever(probe).branch()
    without = _knee(bare)
    rows = []
    for height, angle in SIZES:
        tip = Tip(height_um=height, half_angle_deg=angle)
        lever = Lever(probe.model_copy(update={"tip": tip}))
        data = Measurement.of_sweep(lever.sweep(RAMP))
        fitted = _knee(Lever(fit(data, probe).probe).branch()).tip_K
        knee = _knee(lever.branch())
        rows.append(
            {
                "height_um": height,
                "half_angle_deg": angle,
                "knee_K": knee.tip_K,
                "knee_V": knee.lever_V,
                "moved_K": knee.tip_K - without.tip_K,
                "at_power_K": _at_same_power(bare, lever.branch(), data.tip_K.max()),
                "fitted_knee_K": fitted,
                "missed_K": knee.tip_K - fitted,
            }
        )
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return labelled(columns, "tip", without_K=without.tip_K, without_V=without.lever_V)


def _knee(branch: Branch) -> OperatingPoint:
    if branch.knee is None:
        raise ComputationError(f"the lever has no knee below {branch.hottest_K:.0f} K")
    return branch.knee


def _at_same_power(without: Branch, with_tip: Branch, hottest_K: float) -> float:
    """Largest change of the tip temperature at the same power (K), with its sign."""
    tip = np.linspace(without.base_temperature_K, hottest_K, 200)
    change = tip - without.tip_temperature(with_tip.power(tip))
    return float(change[np.nanargmax(np.abs(change))])
