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
    space, fluxes = equations.space, equations.fluxes(x)
    heat = space.weighted(np.concatenate([fluxes.heat_source[None], fluxes.heat]))
    left = -np.einsum("dp,dpn->n", space.end_test, heat)
    if space.air is not None:
        into_air, at_ends = space.air.heat(equations.kirchhoff(x)[0])
        left += into_air - at_ends
    return np.asarray(left)


def _balances(space: Space, fluxes: Fluxes, theta: Array | None) -> Array:
    """Return the balances of fluxes and of θ at the sites of the air; all are linear in both."""
    assert isinstance(space, FullSpace)  # a reduced lever has no ends
    heat = space.weighted(np.concatenate([fluxes.heat_source[None], fluxes.heat]))
    heat_source, charge = heat[0], space.weighted(fluxes.charge)
    end_heat = -np.einsum("dp,dpn->n", space.end_test, heat)
    air_heat = np.zeros_like(end_heat)
    if theta is not None:
        air_heat, at_ends = space.air.heat(theta)
        end_heat = end_heat - at_ends
    joule = [_joule(heat_source, space.parts[part]) for part in ("heater", "leg 1", "leg 2")]
    ground = -np.einsum("dp,dpn->n", space.ground_test, charge)
    return np.stack([*joule, ground, end_heat, air_heat], axis=-1)


def _joule(heat_source: Array, points: Index) -> Array:
    """Return the heat made at some points; NaN if the lever has no such part."""
    made = -heat_source[points].sum(axis=0)
    return np.asarray(made if points.size else np.full_like(made, np.nan))
