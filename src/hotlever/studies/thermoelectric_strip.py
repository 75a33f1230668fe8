"""Thomson heat in strips of one doping, and where their own current makes them hottest.

There is no Peltier heat in them. S of one carrier grows in size with the temperature, that of two
falls: Thomson heat −T J·(∂S/∂T ∇T) has the other sign above the temperature at which S is largest
in size.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.lever import Lever
from hotlever.materials.kinds import LowDopedSilicon
from hotlever.probe import Probe, Taper
from hotlever.probe.drawing import Drawing, Layer, rectangle
from hotlever.studies.thermoelectric_shift import hot_spot, rises_along
from hotlever.threads import one_blas_thread

#: The strip (µm): long enough that its ends are those of a strip, and as wide as a heater.
_LENGTH, _WIDTH, _THICK = 8.0, 1.0, 0.4
#: Of the self-heated strip (Ω): every temperature has one state.
_R_S = 20_000.0


def strip_of(silicon: LowDopedSilicon, **circuit: object) -> Probe:
    """Return a strip of one kind of silicon along x, from the supply to ground."""
    half = 0.5 * _WIDTH
    ends = {"supply": 0.0, "ground": _LENGTH}
    drawing = Drawing(
        layers={"silicon": Layer(rectangle(0.0, -half, _LENGTH, half), "strip")},
        terminals={name: [(x, -half), (x, half)] for name, x in ends.items()},
        tip_um=(0.5 * _LENGTH, 0.0),
        thickness_um=_THICK,
    )
    return Probe.from_sections(
        {
            **drawing.sections(),
            "materials": {"strip": silicon},
            "circuit": circuit,
            "physics": {"thermoelectric": True},
        },
        "strip",
    )


@one_blas_thread
def self_heated(silicon: LowDopedSilicon, tip: ArrayLike) -> xr.Dataset:
    """Compute where a strip between cold ends is hottest that its own current heats.

    Parameters
    ----------
    silicon : LowDopedSilicon
    tip : array_like, shape (n,)
        Temperatures of its middle (K).

    Returns
    -------
    xarray.Dataset
        ``moved_nm`` on the dimension ``tip_K``: from the middle in the direction of the current.
    """
    lever = Lever(strip_of(silicon, series_resistance_ohm=_R_S))
    temperatures = np.asarray(tip, dtype=float)
    branch = lever.branch(temperatures.max())
    rises = temperatures - lever.circuit.base_temperature_K
    whole = Taper((0.5 * _LENGTH, 0.0), (1.0, 0.0), _LENGTH)
    along = rises_along(lever.space, whole, branch.states(np.sqrt(rises)))
    shift_nm = [1e3 * hot_spot(rise).at_um for rise in along]
    return labelled({"moved_nm": shift_nm}, "tip_K", {"tip_K": temperatures})
