"""Where the heat and the charge of a solved lever go."""

from __future__ import annotations

import numpy as np

from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.space import Fluxes, Space
from hotlever.types import Array, Index

#: What `balance_columns` returns: Joule heat of heater and legs (mW; NaN without legs), current to
#: ground (mA), heat through the leg ends and into the air (mW).
BALANCES = (
    "heater_mW",
    "leg1_mW",
    "leg2_mW",
    "ground_current_mA",
    "end_heat_mW",
    "air_heat_mW",
)


def balance_columns(equations: LeverEquations, x: Array) -> Array:
    """Return the `BALANCES` of states (size + 1, n), shape (n, 6).

    Currents and heats at terminals are consistent fluxes: reactions of the weak form at the nodes
    that are held.
    """
    theta = None if equations.space.air is None else equations.kirchhoff(x)[0]
    return _balances(equations.space, equations.fluxes(x), theta)


def balance_slopes(equations: LeverEquations, x: Array, slopes: Array) -> Array:
    """Return how the `BALANCES` of states change with changes (size + 1, n) of them, (n, 6)."""
    air = equations.space.air
    theta = None if air is None else equations.kirchhoff(x)[1] * air.rise(slopes)
    return _balances(equations.space, equations.flux_changes(x, slopes), theta)


def heat_left(equations: LeverEquations, x: Array) -> Array:
    """Return the heat that leaves states by the leg ends and into the air (mW), (n,)."""
    theta = None if equations.space.air is None else equations.kirchhoff(x)[0]
    by_ends, into_air, _ = _heat_out(equations.space, equations.fluxes(x), theta)
    return by_ends + into_air


def _heat_out(space: Space, fluxes: Fluxes, theta: Array | None) -> tuple[Array, Array, Array]:
    """Return the heat through the leg ends and into the air, and the heat source by point."""
    heat = space.weighted(np.concatenate([fluxes.heat_source[None], fluxes.heat]))
    by_ends = -np.einsum("dp,dpn->n", space.end_test, heat)
    into_air = np.zeros_like(by_ends)
    if theta is not None:
        into_air, at_ends = space.air.heat(theta)
        by_ends = by_ends - at_ends
    return by_ends, into_air, heat[0]


def _balances(space: Space, fluxes: Fluxes, theta: Array | None) -> Array:
    """Return the balances of fluxes and of θ at the sites of the air; all are linear in both."""
    assert isinstance(space, FullSpace)  # a reduced lever has no ends
    end_heat, air_heat, heat_source = _heat_out(space, fluxes, theta)
    charge = space.weighted(fluxes.charge)
    joule = [_joule(heat_source, space.parts[part]) for part in ("heater", "leg 1", "leg 2")]
    ground = -np.einsum("dp,dpn->n", space.ground_test, charge)
    return np.stack([*joule, ground, end_heat, air_heat], axis=-1)


def _joule(heat_source: Array, points: Index) -> Array:
    """Return the heat made at some points; NaN if the lever has no such part."""
    made = -heat_source[points].sum(axis=0)
    return np.asarray(made if points.size else np.full_like(made, np.nan))
