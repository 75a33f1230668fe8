"""Thomson heat in strips of one doping: at which temperature it turns, and where they are hottest.

There is no Peltier heat in them. S of one carrier grows in size with the temperature, that of two
falls: Thomson heat −T J·(∂S/∂T ∇T) has the other sign above the temperature at which S is largest
in size.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import ComputationError
from hotlever.lever import Lever
from hotlever.materials.kinds import LowDopedSilicon
from hotlever.probe import Probe, Taper
from hotlever.probe.drawing import Drawing, Layer, rectangle
from hotlever.studies.thermoelectric_shift import Axis, hot_spot
from hotlever.threads import one_blas_thread

#: The strip (µm): long enough that its ends are those of a strip, and as wide as a heater.
_LENGTH, _WIDTH, _THICK = 8.0, 1.0, 0.4
#: Between ends that differ by so much (K), at a current (mA) that hardly heats it, from a supply
#: that is as good as one of a current (Ω).
_DIFFERENCE_K, _CURRENT_MA, _STIFF = 20.0, 0.05, 1e6
#: Where a turn is looked for (K), in these steps: leg ends have limits; and how exactly.
_LOOKED_AT_K, _EXACT_K = np.arange(425.0, 986.0, 80.0).tolist(), 2.0
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


def odd_rise(silicon: LowDopedSilicon, T: float) -> float:
    """Return by how much the current's direction changes the middle of a strip (K), to first order.

    Its ends are a little colder and warmer than T. The current is the same in both directions, and
    with it Joule's heat: only Thomson heat changes its sign. Positive where it is set free by a
    current that flows towards the warm end.
    """
    cold, warm = T - 0.5 * _DIFFERENCE_K, T + 0.5 * _DIFFERENCE_K
    lever = Lever(
        strip_of(
            silicon,
            base_temperature_K=cold,
            series_resistance_ohm=_STIFF,
            ground={"kind": "ground", "base_temperature_K": warm},
        )
    )
    bias = 1e-3 * _STIFF * _CURRENT_MA
    forward, back = lever.solve([bias, -bias])
    return 0.5 * (forward.tip_K - back.tip_K)


@one_blas_thread
def turn_of_thomson_heat(silicon: LowDopedSilicon) -> float:
    """Return the lowest temperature (K) at which Thomson heat turns its sign in a solved strip.

    Raises
    ------
    ComputationError
        If it does not turn.
    """
    from scipy.optimize import brentq

    at, before = _LOOKED_AT_K[0], odd_rise(silicon, _LOOKED_AT_K[0])
    for T in _LOOKED_AT_K[1:]:
        after = odd_rise(silicon, T)
        if before * after < 0.0:
            return float(brentq(lambda T: odd_rise(silicon, T), at, T, xtol=_EXACT_K))
        at, before = T, after
    raise ComputationError(f"Thomson heat does not turn its sign below {at:.0f} K")


@one_blas_thread
def largest_seebeck(silicon: LowDopedSilicon) -> float:
    """Return the temperature (K) at which S of the majority's sign is largest, from the law."""
    T = np.linspace(300.0, 1300.0, 1001)
    sigma, _ = silicon.electrical_conductivity(T, silicon.n_d)
    (beta, _), _ = silicon.thermoelectric(T, silicon.n_d, silicon.carrier)
    S = beta / sigma
    return float(T[(S * np.sign(S[0])).argmax()])


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
    axis = Axis(lever.space, Taper((0.5 * _LENGTH, 0.0), (1.0, 0.0), _LENGTH))
    moved = [
        1e3 * hot_spot(rise).at_um for rise in axis.temperatures(branch.states(np.sqrt(rises)))
    ]
    return labelled({"moved_nm": moved}, "tip_K", {"tip_K": temperatures})
