"""The chip that holds a lever: how warm the leg ends get by the heat that enters it there.

Heat spreads from the small ends of the legs into the chip, within microseconds, and from there
through its holder, in milliseconds or more. At rest both count, in pulses the spreading alone.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.heat import thermal_conductivity
from hotlever.probe.layout import Layout
from hotlever.probe.parts import ProbeParts, ProbesParts
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM


def mean_inverse_distance(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the mean of 1/r (1/µm) over all pairs of points of a rectangle of sides a, b (µm).

    Examples
    --------
    >>> mean_inverse_distance(1.0, 1.0).round(4).item()
    2.9732
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    diagonal = np.hypot(a, b)
    sides = 2.0 / a * np.arcsinh(a / b) + 2.0 / b * np.arcsinh(b / a)
    return np.asarray(sides + 2.0 / 3.0 * (a**3 + b**3 - diagonal**3) / (a * b) ** 2)


def spreading_K_per_mW(layout: Layout, base_temperature_K: float) -> float:
    """Return by how much leg ends get warmer for the heat that spreads from them into silicon.

    Each end is a rectangle of uniform flux on a half space, and is warmed by the others as by
    points; the heat is shared out so that all ends have one mean temperature.

    Parameters
    ----------
    layout : Layout
    base_temperature_K : float

    Examples
    --------
    >>> from hotlever import Probe
    >>> round(spreading_K_per_mW(Probe.reference().layout(), 293.0), 2)
    0.67
    """
    start, end = np.array([(each.start, each.end) for each in layout.terminals]).swapaxes(0, 1)
    widths = np.linalg.norm(end - start, axis=1)
    apart = np.linalg.norm((start + end)[:, None] - (start + end), axis=2) / 2.0
    np.fill_diagonal(apart, 1.0)
    inverse = 1.0 / apart
    np.fill_diagonal(inverse, mean_inverse_distance(widths, layout.thickness_um))
    kappa = PER_CM_TO_MILLI_PER_UM * float(thermal_conductivity(base_temperature_K)[0])
    return float(1.0 / (2.0 * math.pi * kappa * np.linalg.inv(inverse).sum()))


def usual_chip(probe: ProbeParts) -> float:
    """Return what a chip in its holder usually has (K/mW): spreading, and a holder."""
    # a holder, glue or a clip usually adds as much (K/mW), of which nothing is known but its size
    return spreading_K_per_mW(probe.layout(), probe.circuit.base_temperature_K) + 1.0


def on_usual_chip(probe: ProbesParts, without: bool = False) -> ProbesParts:
    """Return a probe on a chip that gets warm as is usual, if its file says nothing of one."""
    if probe.circuit.chip_K_per_mW or without:
        return probe
    return probe.replace({"chip_K_per_mW": usual_chip(probe)})


def in_pulses(probe: ProbesParts) -> ProbesParts:
    """Return a probe as it is in pulses, while its holder stays cold."""
    at_rest = probe.circuit.chip_K_per_mW
    if not at_rest:
        return probe
    spreading = spreading_K_per_mW(probe.layout(), probe.circuit.base_temperature_K)
    return probe if at_rest <= spreading else probe.replace({"chip_K_per_mW": spreading})
