"""Which way the hot spot of a heater moves with thermoelectricity, and which heat moves it.

A current sets free the heat −T J·∇S, where the Seebeck coefficient S depends on the temperature
and on the doping n::

    −T J·(∂S/∂T ∇T)    Thomson heat, within the silicon,
    −T J·(∂S/∂n ∇n)    Peltier heat, at the tapers of the doping and, as a step of S, at the
                       heater's borders with high-doped silicon.

How much of the hot spot's shift each of them carries is found along the way from a lever without
thermoelectricity to the one with it. There S is a share λ of its own, from 0 to 1, or to −1 for
the other polarity, and the bias stays. At each λ the linearised equations say how each heat by
itself moves the hot spot. The shares add up to the whole shift, whatever its size. What is neither
Thomson nor Peltier heat is the voltage by the Seebeck effect, which changes Joule's heat, and the
heat that electrons and holes carry together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import ComputationError
from hotlever.lever import Lever, State
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.laws_at_points import LawsAtPoints
from hotlever.lever.solved_states import state_at_bias
from hotlever.lever.space import TIP
from hotlever.lever.transport import Fluxes, Properties, dot
from hotlever.materials import HIGH_DOPED, LOW_DOPED
from hotlever.materials.kinds import Kind, LowDopedSilicon, PSilicon
from hotlever.probe import Probe, Taper
from hotlever.probe.drawing import Drawing, Layer, rectangle
from hotlever.types import Array
from hotlever.work import one_blas_thread

#: The heats, and the halves of the heater in which they are set free, by the terminal beyond.
HEATS, SIDES = ("Thomson", "Peltier"), ("supply", "ground")
#: Whether the current flows from the supply through the heater to ground, or back.
POLARITIES = (1, -1)


# --- where it is hottest --------------------------------------------------------------------------


class HotSpot(NamedTuple):
    """Where the axis of a heater is hottest.

    Attributes
    ----------
    at_um : float
        From the heater's centre, towards ground.
    centre_rise, rise : float
        Of the temperature above that of the base (K), at the centre and at the hot spot.
    """

    at_um: float
    centre_rise: float
    rise: float


def rises_along(space: FullSpace, taper: Taper, x: Array) -> list[Chebyshev]:
    """Return temperatures by the position (µm) on the inner part of a heater's axis.

    Parameters
    ----------
    space : FullSpace
    taper : Taper
        Centre, direction, from the supply to ground, and length of the heater.
    x : ndarray, shape (size + 1, k)
        States, or changes of them; temperatures count from that of the base.
    """
    # in the inner 80 % of the heater
    half = 0.5 * 0.8 * taper.length_um
    position = np.linspace(-half, half, 81)
    values = space.rise_at(np.array(taper.centre) + np.outer(position, taper.axis), x)
    # a polynomial has no steps from element to element
    return [Chebyshev.fit(position, T, 14, domain=(-half, half)) for T in values.T]


def hot_spot(rise: Chebyshev) -> HotSpot:
    """Return where a temperature by position is highest.

    Raises
    ------
    ComputationError
        If that is at an end.
    """
    roots = rise.deriv().roots()
    level = roots[np.isreal(roots)].real
    level = level[(np.abs(level) < rise.domain[1]) & (rise.deriv(2)(level) < 0.0)]
    if not level.size:
        raise ComputationError("the heater is hottest near one of its ends")
    at = float(level[rise(level).argmax()])
    return HotSpot(at, float(rise(0.0)), float(rise(at)))


# --- the heats ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Heats:
    """Thomson and Peltier heat of a lever, on either side of its heater's centre.

    S is split into that of the heater's own doping n_d and what more doping adds,
    S(T, n) = S(T, n_d) + D(T, n). As no charge piles up, ∇·J = 0, the Peltier heat
    −T J·(∂S/∂n ∇n) = −T J·(∇D − ∂D/∂T ∇T) tested with φ is

        ∫ D T J·∇φ + φ (D + T ∂D/∂T) J·∇T,

    in which a step of S needs no care. D is nothing at the centre, where the sides meet.

    Parameters
    ----------
    equations : LeverEquations
        With thermoelectricity.
    own : Kind
        What the middle of the heater is made of.
    sides : dict of str to ndarray, shape (points, 1)
        1 on a side of the heater's centre, 0 on the other.
    """

    equations: LeverEquations
    own: Kind
    sides: Mapping[str, Array]

    def tested(self, x: Array, current: Array) -> dict[tuple[str, str], Array]:
        """Return the heats of a state as they enter its equations, (size + 1, 1).

        Parameters
        ----------
        x : ndarray, shape (size + 1, 1)
        current : ndarray, shape (2, points, 1)
            Current density times thickness (mA/µm).

        Returns
        -------
        dict
            By heat and side.
        """
        fields, properties, by_T = self.equations.at(x)
        assert properties.beta is not None
        assert by_T.beta is not None
        S = properties.beta / properties.sigma
        S_T = (by_T.beta - S * by_T.sigma) / properties.sigma
        own, own_T = self._own(fields.T)
        D, D_T = S - own, S_T - own_T
        along = dot(current, fields.grad_T)
        nothing = np.zeros_like(current)
        tested = {}
        sources = fields.T * S_T * along, -(D + fields.T * D_T) * along
        carried = nothing, -D * fields.T * current
        for heat, source, flux in zip(HEATS, sources, carried, strict=True):
            for side, there in self.sides.items():
                fluxes = Fluxes(there * source, there * flux, nothing)
                tested[heat, side] = self.equations.space.weak_form(fluxes)
        return tested

    def power(self, tested: Array) -> float:
        """Return how much heat (mW) one of them is."""
        return -float(tested[self.equations.space.is_temperature].sum())

    def _own(self, T: Array) -> tuple[Array, Array]:
        """Return S (V/K) of the middle of the heater, and its slope by T."""
        doping = self.own.n_d if isinstance(self.own, LowDopedSilicon) else 0.0
        sigma, sigma_by = self.own.electrical_conductivity(T, doping)
        (beta, _), beta_by = self.own.thermoelectric(T, doping, "electron")
        S = beta / sigma
        return S, (beta_by["T"][0] - S * sigma_by["T"]) / sigma


# --- from no thermoelectricity to all of it -------------------------------------------------------


def _weakened(share: float) -> type[LawsAtPoints]:
    """Return laws with a share of the Seebeck coefficients; negative for the other polarity."""

    class Weakened(LawsAtPoints):
        def properties(
            self, T: Array, names: Sequence[str] = ("T",)
        ) -> tuple[Properties, dict[str, Properties]]:
            total, by = super().properties(T, names)
            return weaker(total), {name: weaker(each) for name, each in by.items()}

    def weaker(properties: Properties) -> Properties:
        assert properties.beta is not None
        assert properties.gamma is not None
        return replace(properties, beta=share * properties.beta, gamma=share**2 * properties.gamma)

    return Weakened


class _Way:
    """The way of one lever at one bias from no thermoelectricity to all of it."""

    def __init__(self, lever: Lever) -> None:
        self.lever = lever
        self.whole = self._at_share(1.0)
        self._taper, sides = _from_supply(lever)
        own = lever.probe.kinds[lever.probe.layout().heater.material]
        self.heats = Heats(self.whole, own, sides)

    def rises(self, x: Array) -> list[Chebyshev]:
        """Return the temperature along the heater, see `rises_along`."""
        return rises_along(self.lever.space, self._taper, x)

    def _at_share(self, share: float) -> LeverEquations:
        probe = self.lever.probe.with_physics(("thermoelectric",))
        return LeverEquations.of_probe(self.lever.space, probe, laws=_weakened(share))

    def state(self, share: float, bias: float, guess: Array) -> tuple[LeverEquations, Array]:
        """Return the equations with a share of S, and their state at a bias (V)."""
        equations = self._at_share(share)
        return equations, state_at_bias(equations, self.lever.circuit, bias, guess)

    def rates(self, equations: LeverEquations, x: Array, share: float) -> Array:
        """Return how fast each heat, and last all there is, moves the hot spot (µm)."""
        current = -equations.fluxes(x).charge
        each = list(self.heats.tested(x, current).values())
        causes = np.stack([*each, self._all(x, share)], axis=-1)
        changes = self._at_bias(equations, x, causes)[:, 0]
        rise, *risen = self.rises(np.hstack([x, changes]))
        at = hot_spot(rise).at_um
        return np.array([-change.deriv()(at) / rise.deriv(2)(at) for change in risen])

    def _all(self, x: Array, share: float) -> Array:
        """Return how the equations of a state change with the share, (size + 1, 1)."""
        fields, properties, _ = self.whole.at(x)
        assert properties.beta is not None
        assert properties.gamma is not None
        beta, gamma = properties.beta, properties.gamma
        charge = beta * fields.grad_T
        heat = fields.T * (beta * fields.grad_V + 2.0 * share * gamma * fields.grad_T)
        return self.whole.space.weak_form(Fluxes(-dot(charge, fields.grad_V), heat, charge))

    def _at_bias(self, equations: LeverEquations, x: Array, causes: Array) -> Array:
        """Return the changes (size + 1, 1, k) of a state by what is added to its equations."""
        factors, circuit = equations.factorised(x, TIP), self.lever.circuit
        right = -causes
        right[-1] = 0.0
        changes = equations.solve_linear(x, factors, right)
        along = equations.along(x, factors)
        current = equations.balance_change(x, changes)[-1] + causes[-1]
        off = circuit.bias(changes[-1], current)
        by = circuit.bias(along[-1], equations.balance_change(x, along)[-1])
        return np.asarray(changes - along[..., None] * (off / by[:, None]))


def _from_supply(plain: Lever) -> tuple[Taper, dict[str, Array]]:
    """Return a heater's axis from the supply to ground, and which points are on which side.

    By the potential in the cold lever, which falls along the current.

    Raises
    ------
    InputError
        If the heater is no strip.
    """
    space, taper = plain.space, plain.space.mesh.layout.heater_taper
    _, potential = space.nodal(plain.equations.cold()[0][:, 0], 0.0)
    elements = space.elements
    end = 0.25 * taper.length_um * np.array(taper.axis)
    positions = np.array(taper.centre) + np.outer([-1.0, 0.0, 1.0], end)
    before, centre, after = elements.interpolation(positions)[0] @ potential
    if before < after:
        taper = replace(taper, axis=(-taper.axis[0], -taper.axis[1]))
    at_points = (elements.sampling[: elements.weights.size] @ potential)[:, None]
    sides = at_points > centre, at_points <= centre
    return taper, {side: there.astype(float) for side, there in zip(SIDES, sides, strict=True)}


# --- what is asked --------------------------------------------------------------------------------


@one_blas_thread
def shift_by_heat(lever: Lever, bias: ArrayLike) -> xr.Dataset:
    """Compute by which heat thermoelectricity moves the hot spot of a heater.

    Parameters
    ----------
    lever : Lever
        Its heater is a strip. Whether its probe has thermoelectricity does not matter.
    bias : array_like, shape (n,)
        Biases (V), positive.

    Returns
    -------
    xarray.Dataset
        On the dimension ``bias`` where the hot spot is without thermoelectricity, ``plain_um`` from
        the heater's centre towards ground. For either ``polarity``, 1 or −1: how far it has moved
        in the direction of the current, ``moved_nm``; how much of that is due to neither Thomson
        nor Peltier heat, ``rest_nm``; where it is now, ``at_um``; and the rises of the temperature
        at the heater's centre and at the hot spot, ``centre_rise_K`` and ``highest_rise_K``. By
        ``heat`` and by ``side`` of the heater's centre, that of the supply or of ground:
        ``share_nm`` of the shift, and ``heat_mW`` that is set free, negative where it is taken up.

    Raises
    ------
    InputError
        If the heater is no strip.
    ComputationError
        If a bias is not reached, or the heater is hottest near one of its ends.
    """
    plain = lever.with_probe(lever.probe.with_physics(()))
    states = plain.solve(bias)
    way = _Way(plain)
    rows = [[_shift(way, state, polarity) for state in states] for polarity in POLARITIES]
    columns: dict[str, Any] = {"plain_um": ("bias", [row["plain_um"] for row in rows[0]])}
    for name in ("moved_nm", "rest_nm", "at_um", "centre_rise_K", "highest_rise_K"):
        columns[name] = (("polarity", "bias"), [[row[name] for row in line] for line in rows])
    for name in ("share_nm", "heat_mW"):
        values = np.array([[row[name] for row in line] for line in rows])
        values = values.reshape(*values.shape[:2], len(HEATS), len(SIDES))
        columns[name] = (("polarity", "bias", "heat", "side"), values)
    coordinates = {
        "bias": [state.bias_V for state in states],
        "polarity": list(POLARITIES),
        "heat": list(HEATS),
        "side": list(SIDES),
    }
    return labelled(columns, (), coordinates)


def _shift(way: _Way, plain: State, polarity: int) -> dict[str, Any]:
    """Return a row of `shift_by_heat`."""
    before = hot_spot(way.rises(plain.x)[0])
    x, shift_um = plain.x, np.zeros(len(HEATS) * len(SIDES) + 1)
    # shares of S at which the linearised equations are looked at: Gauss's rule from 0 to 1
    for node, weight in zip(*np.polynomial.legendre.leggauss(3), strict=True):
        share = 0.5 + 0.5 * node
        equations, x = way.state(polarity * share, plain.bias_V, x)
        shift_um += 0.5 * weight * way.rates(equations, x, polarity * share)
    equations, x = way.state(polarity, plain.bias_V, x)
    after = hot_spot(way.rises(x)[0])
    heats = way.heats.tested(x, -equations.fluxes(x).charge).values()
    return {
        "plain_um": before.at_um,
        # S is reversed in place of the current, which is the mirror image in charge
        "moved_nm": 1e3 * polarity * (after.at_um - before.at_um),
        "share_nm": 1e3 * shift_um[:-1],
        "rest_nm": 1e3 * (shift_um[-1] - shift_um[:-1].sum()),
        "at_um": after.at_um,
        "centre_rise_K": after.centre_rise,
        "highest_rise_K": after.rise,
        "heat_mW": [polarity * way.heats.power(heat) for heat in heats],
    }


def of_p_silicon(probe: Probe) -> Probe:
    """Return a probe doped with boron as it is with phosphorus: the same numbers, other carriers.

    It is no possible probe of a file, so that it is not checked.
    """
    kinds = probe.kinds
    own = kinds[LOW_DOPED].model_dump() | {"kind": "p-silicon"}
    materials = {LOW_DOPED: PSilicon(**own), HIGH_DOPED: kinds[HIGH_DOPED]}
    return probe.model_copy(update={"materials": materials})


def strip_of(silicon: LowDopedSilicon, length_um: float = 8.0, **circuit: object) -> Probe:
    """Return a strip of one kind of silicon along x, from the supply to ground.

    It is so long that its ends are those of a strip, and as wide as a heater.
    """
    half = 0.5
    ends = {"supply": 0.0, "ground": length_um}
    drawing = Drawing(
        layers={"silicon": Layer(rectangle(0.0, -half, length_um, half), "strip")},
        terminals={name: [(x, -half), (x, half)] for name, x in ends.items()},
        tip_um=(0.5 * length_um, 0.0),
        thickness_um=0.4,
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
    # with such a resistor every temperature has one state
    length_um = 8.0
    lever = Lever(strip_of(silicon, length_um, series_resistance_ohm=20_000.0))
    temperatures = np.asarray(tip, dtype=float)
    branch = lever.branch(temperatures.max())
    rises = temperatures - lever.circuit.base_temperature_K
    whole = Taper((0.5 * length_um, 0.0), (1.0, 0.0), length_um)
    along = rises_along(lever.space, whole, branch.states(np.sqrt(rises)))
    shift_nm = [1e3 * hot_spot(rise).at_um for rise in along]
    return labelled({"moved_nm": shift_nm}, "tip_K", {"tip_K": temperatures})
