"""Where the heat and the charge of a solved lever go."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hotlever.lever.at_points import Radiated
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.space import Fluxes
from hotlever.probe.circuit import Wiring
from hotlever.types import Array, Index

#: What `balance_columns` returns: heat made in heater and legs (mW; NaN without legs), current to
#: ground (mA), heat through the leg ends, into the air, radiated and into a tip in contact (mW).
BALANCES = (
    "heater_mW",
    "leg1_mW",
    "leg2_mW",
    "ground_current_mA",
    "end_heat_mW",
    "air_heat_mW",
    "radiated_mW",
    "into_tip_mW",
)


def balance_names(wiring: Wiring) -> tuple[str, ...]:
    """Return what `balance_columns` returns: `BALANCES`, and currents into the lever (mA).

    These are at the terminals that the paper's circuit does not have.
    """
    return (*BALANCES, *(f"{name}_mA" for name in _unusual(wiring)))


def _unusual(wiring: Wiring) -> tuple[str, ...]:
    """Return those that a current passes, without the ground of the paper's circuit."""
    usual = "ground" if "ground" in wiring.grounds else None
    return tuple(name for name in wiring.conducting if name != usual)


def balance_columns(equations: LeverEquations, x: Array) -> Array:
    """Return what is at the terminals, and where heat goes, of states (size + 1, n), (n, k).

    Currents and heats at terminals are consistent fluxes: reactions of the weak form at the nodes
    of each. The names are `balance_names`.
    """
    return _balances(equations, equations.fluxes(x), _leaving(equations, x))


def balance_slopes(equations: LeverEquations, x: Array, slopes: Array) -> Array:
    """Return how the `balance_columns` of states change with changes (size + 1, n) of them."""
    theta = equations.kirchhoff(x)[1] * equations.space.air.rise(slopes)
    into_tip = equations.into_tip(x)[1]["T"] * equations.footprint.rise(slopes)
    leaving = _Leaving(theta, equations.radiated_change(x, slopes), into_tip)
    return _balances(equations, equations.flux_changes(x, slopes), leaving)


def heat_left(equations: LeverEquations, x: Array) -> Array:
    """Return all heat that leaves states: by the leg ends and from the surface (mW), (n,)."""
    return np.asarray(sum(_heat_out(equations, equations.fluxes(x), _leaving(equations, x))))


def heat_held(equations: LeverEquations, x: Array) -> tuple[Array, Array]:
    """Return the heat in states (nJ), (n,), and its part that is tested at the leg ends."""
    space = equations.space
    (heat,) = space.weighted(equations.laws.heat_density(equations.at(x)[0].T)[0][None])
    return heat.sum(axis=0), space.end_test[0] @ heat


class _Leaving(NamedTuple):
    """What leaves the surface: θ at the sites of the air, light, and heat into the tip (mW)."""

    theta: Array
    radiated: Radiated
    into_tip: Array


def _leaving(equations: LeverEquations, x: Array) -> _Leaving:
    theta, _ = equations.kirchhoff(x)
    return _Leaving(theta, equations.radiated(x), equations.into_tip(x)[0])


def _heat_out(
    equations: LeverEquations, fluxes: Fluxes, leaving: _Leaving
) -> tuple[Array, Array, Array, Array]:
    """Return the heat through the leg ends, into the air, radiated, and into the tip."""
    theta, radiated, into_tip = leaving
    space, rim = equations.space, equations.rim
    heat = space.weighted(np.concatenate([fluxes.heat_source[None], fluxes.heat]))
    by_ends = -np.einsum("dp,dpn->n", space.end_test, heat)
    into_air, at_ends = space.air.heat(theta)
    at_ends = at_ends + rim.end_test @ radiated.by_rim
    by_faces = (space.weights * radiated.faces).sum(axis=0)
    light = by_faces + radiated.by_rim.sum(axis=0)
    return by_ends - at_ends, into_air, light, into_tip.sum(axis=0)


def _balances(equations: LeverEquations, fluxes: Fluxes, leaving: _Leaving) -> Array:
    """Return the balances of fluxes and what leaves the surface; all linear."""
    space = equations.space
    assert isinstance(space, FullSpace)  # a reduced lever has no ends
    heats = _heat_out(equations, fluxes, leaving)
    made = space.weights * (leaving.radiated.faces - fluxes.heat_source)
    charge = space.weighted(fluxes.charge)
    of_parts = [_made(made, space.parts[part]) for part in ("heater", "leg 1", "leg 2")]
    into = {
        name: np.einsum("dp,dpn->n", space.charge_tests[name], charge)
        for name in space.wiring.conducting
    }
    grounds = [name for name in into if equations.circuit.contact(name).kind == "ground"]
    ground = -sum((into[name] for name in grounds), start=np.zeros_like(heats[0]))
    currents = [into[name] for name in _unusual(space.wiring)]
    return np.stack([*of_parts, ground, *heats, *currents], axis=-1)


def _made(heat: Array, points: Index) -> Array:
    """Return the heat made at some points; NaN if the lever has no such part."""
    made = heat[points].sum(axis=0)
    return np.asarray(made if points.size else np.full_like(made, np.nan))
