"""What a tip on the heater changes, and whether leaving it out explains the paper's knee error.

The paper's model has no tip; its knee is 50 K below the measured one. Three questions are told
apart: how the tip moves the knee of the same lever, how it moves the temperature at the same
power, and by how much a tipless model *fitted* to a lever with a tip misses its knee. Only the
last one compares with the paper, whose parameters are fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from hotlever.fitting import fit
from hotlever.fitting.measurement import Measurement
from hotlever.lever import Lever
from hotlever.materials.spieser2017 import RAMP
from hotlever.probe import Probe, Tip

Array = NDArray[np.float64]

#: Plausible tips of lithography probes: height (µm) and half-angle (degrees).
SIZES = ((0.5, 15.0), (0.5, 30.0), (0.7, 20.0), (1.0, 15.0), (1.0, 30.0))


@dataclass(frozen=True)
class TipEffect:
    """What one tip does.

    Attributes
    ----------
    tip : Tip
    knee_K, knee_without_K : float
        T_tip at the knee (dV_l/dI_h = 0), with and without the tip.
    knee_V, knee_without_V : float
        V_l there.
    at_power_K : float
        Largest change of T_tip at the same power, up to the largest common power.
    fitted_knee_K : float
        Knee of a tipless lever fitted to I_h, V_r and T_tip of the lever with the tip.
    """

    tip: Tip
    knee_K: float
    knee_without_K: float
    knee_V: float
    knee_without_V: float
    at_power_K: float
    fitted_knee_K: float

    @property
    def missed_K(self) -> float:
        """How far the true knee lies above that of the fitted tipless model (K)."""
        return self.knee_K - self.fitted_knee_K


def tip_effect(probe: Probe, tip: Tip) -> TipEffect:
    """Compute what a tip changes on a lever, in the flat model and in the probe's medium.

    Parameters
    ----------
    probe : Probe
        Without a tip.
    tip : Tip
    """
    bare, tipped = Lever(probe), Lever(probe.model_copy(update={"tip": tip}))
    without, with_tip = bare.sweep(RAMP), tipped.sweep(RAMP)
    knee, knee_without = tipped.knee(), bare.knee()
    fitted = fit(_as_measured(with_tip), probe)
    return TipEffect(
        tip,
        knee.tip_K.item(),
        knee_without.tip_K.item(),
        knee.lever_V.item(),
        knee_without.lever_V.item(),
        _at_same_power(without, with_tip),
        bare.with_material(fitted.probe.material).knee().tip_K.item(),
    )


def tip_effects(
    probe: Probe,
    sizes: Sequence[tuple[float, float]] = SIZES,
    progress: Callable[[int, int], None] | None = None,
) -> list[TipEffect]:
    """Return `tip_effect` for cones of several heights (µm) and half-angles (degrees)."""
    effects = []
    for height, angle in sizes:
        tip = Tip(height_um=height, half_angle_deg=angle)
        effects.append(tip_effect(probe, tip))
        if progress is not None:
            progress(len(effects), len(sizes))
    return effects


def _as_measured(sweep: xr.Dataset) -> Measurement:
    """A sweep as a measurement without noise."""
    return Measurement(
        bias_V=sweep.bias_V.values,
        current_mA=sweep.current_mA.values,
        reader_V=sweep.reader_V.values,
        tip_K=sweep.tip_K.values,
        tip_error_K=np.full(sweep.tip_K.size, np.nan),
    )


def _at_same_power(without: xr.Dataset, with_tip: xr.Dataset) -> float:
    """Largest change of the tip temperature at the same power (K), with its sign."""
    power = with_tip.power_mW.values
    common = power < without.power_mW.values.max()
    change: Array = (
        with_tip.tip_K.values
        - PchipInterpolator(without.power_mW.values, without.tip_K.values)(power)
    )[common]
    return float(change[np.argmax(np.abs(change))])
