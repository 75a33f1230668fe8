"""What a tip on the heater changes, and whether leaving it out explains the paper's knee error.

The paper's model has no tip; its knee is 50 K below the measured one. Three questions are told
apart: how the tip moves the knee of the same lever, how it moves the temperature at the same
power, and by how much a tipless model *fitted* to a lever with a tip misses its knee. Only the
last one compares with the paper, whose parameters are fitted. A tip does two things: it conducts
heat away from the middle of the heater, and in air its surface gives heat to the air. What the
second does by itself is told apart, since the paper suspects it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.estimation import Measurement, fit
from hotlever.lever import Branch, Lever
from hotlever.probe import Probe, Tip
from hotlever.spieser2017 import RAMP
from hotlever.studies.knee_reasons import knee_of

#: Plausible tips of lithography probes, cones: height (µm) and half-angle (degrees).
SIZES = ((0.5, 15.0), (0.5, 30.0), (0.7, 20.0), (1.0, 15.0), (1.0, 30.0))
#: Tips of other scanning probes, as slender as they must be to stand on the reference heater.
TALL = ((2.0, 15.0), (3.0, 10.0), (5.0, 8.0))


def tip_effects(probe: Probe, sizes: Sequence[tuple[float, float]] = SIZES) -> xr.Dataset:
    """Compute what tips change on a lever, in the flat model and the probe's medium.

    Parameters
    ----------
    probe : Probe
        Without a tip.
    sizes : sequence of (float, float)
        Height (µm) and half-angle (degrees) of each tip.

    Returns
    -------
    xarray.Dataset
        On the dimension ``tip`` its ``height_um`` and ``half_angle_deg``; ``knee_K`` and
        ``knee_V``; how far the tip has ``moved_K`` and ``moved_V`` the knee; ``at_power_K``, the
        largest change of the tip temperature at the same power. Of these three the parts
        ``surface_moved_K``, ``surface_moved_V`` and ``surface_at_power_K`` that the tip's surface
        has in air: against a tip that conducts only, zero in vacuum. ``fitted_knee_K`` of a tipless
        lever fitted to the one with the tip, and ``missed_K``, how far the knee lies above it. The
        knee without a tip as the attributes ``without_K`` and ``without_V``.

    Raises
    ------
    ComputationError
        If one of the levers has no knee.
    """
    bare = Lever(probe).branch()
    without = knee_of(bare)
    rows = []
    for height, angle in sizes:
        tip = Tip(height_um=height, half_angle_deg=angle, in_air=True)
        lever = Lever(probe.model_copy(update={"tip": tip}))
        data = Measurement.of_sweep(lever.sweep(RAMP))
        hottest, branch = float(data.tip_K.max()), lever.branch()
        conducting = branch
        if lever.medium == "air":
            conducts = tip.model_copy(update={"in_air": False})
            conducting = Lever(probe.model_copy(update={"tip": conducts})).branch()
        fitted = knee_of(Lever(fit(data, probe).probe).branch()).tip_K
        knee, by_conduction = knee_of(branch), knee_of(conducting)
        rows.append(
            {
                "height_um": height,
                "half_angle_deg": angle,
                "knee_K": knee.tip_K,
                "knee_V": knee.lever_V,
                "moved_K": knee.tip_K - without.tip_K,
                "moved_V": knee.lever_V - without.lever_V,
                "at_power_K": _at_same_power(bare, branch, hottest),
                "surface_moved_K": knee.tip_K - by_conduction.tip_K,
                "surface_moved_V": knee.lever_V - by_conduction.lever_V,
                "surface_at_power_K": _at_same_power(conducting, branch, hottest),
                "fitted_knee_K": fitted,
                "missed_K": knee.tip_K - fitted,
            }
        )
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return labelled(columns, "tip", without_K=without.tip_K, without_V=without.lever_V)


def _at_same_power(without: Branch, with_tip: Branch, hottest_K: float) -> float:
    """Largest change of the tip temperature at the same power (K), with its sign."""
    if with_tip is without:
        return 0.0  # not what curves are off by
    tip = np.linspace(without.base_temperature_K, hottest_K, 200)
    change = tip - without.tip_temperature(with_tip.power(tip))
    return float(change[np.nanargmax(np.abs(change))])
