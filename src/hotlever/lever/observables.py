"""What instruments and a thermometer show of a lever in its circuit: the observables.

A lever by itself shows V_l, I_h, V_r and the rise of its tip. Each observable follows from these
and from the circuit; all that compares a lever with a measurement has them from here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hotlever.measurands import OBSERVABLES
from hotlever.probe.circuit import Circuit
from hotlever.types import Array

_BRIDGE = OBSERVABLES["bridge"].name


def observed(circuit: Circuit, shown: Array) -> Array:
    """Return `hotlever.measurands.OBSERVABLES` in the order of that table, (observables, n).

    Parameters
    ----------
    circuit : Circuit
    shown : ndarray, shape (4, n)
        V_l (V), I_h (mA), V_r (V) and the rise of the tip (K).

    Returns
    -------
    ndarray
        NaN of what probe or circuit do not have.
    """
    lever_V, current_mA, reader_V, rise_K = shown
    values = {
        "current": current_mA,
        "reader": reader_V,
        "bridge": circuit.bridge_voltage(lever_V, circuit.bias(lever_V, current_mA)),
        "tip": circuit.base_temperature_K + rise_K,
    }
    return np.stack([values[name] for name in OBSERVABLES])


def with_bridge(circuit: Circuit, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return the columns of a sweep or a history with the bridge voltage, if there is a bridge."""
    if not circuit.has_bridge:
        return dict(columns)
    return {**columns, _BRIDGE: circuit.bridge_voltage(columns["lever_V"], columns["bias_V"])}


def observed_by(circuit: Circuit, shown: Array, slopes: Array, names: Sequence[str]) -> Array:
    """Return how observables change with parameters at a fixed bias, (observables, n, p).

    Parameters
    ----------
    circuit : Circuit
    shown : ndarray, shape (4, n)
        See `observed`.
    slopes : ndarray, shape (4, n, p)
        How it changes at this bias, per unit of each parameter; see `at_fixed_bias`.
    names : sequence of str
        The parameters, those of the circuit among them.
    """
    lever_V, current_mA, reader_V, rise_K = slopes
    bias = circuit.bias(shown[0], shown[1])
    of_divider = np.stack([circuit.bridge_by(name, bias) for name in names], axis=-1)
    values = {
        "current": current_mA,
        "reader": reader_V,
        "bridge": circuit.bridge_change(lever_V, 0.0) + of_divider,
        "tip": rise_K + [circuit.base_by(name) for name in names],
    }
    return np.stack([values[name] for name in OBSERVABLES])


def at_fixed_bias(
    along: Array, circuit: Circuit, shown: Array, of_circuit: Array | float = 0.0
) -> Array:
    """Return how what a lever shows changes with parameters at a fixed bias.

    A parameter moves the curves at fixed rises of the tip, or another constraint; the circuit then
    moves the state along its branch until the bias is what it was.

    Parameters
    ----------
    along : ndarray, shape (n, 4)
        Derivatives by u of what `Branch.curve` has.
    circuit : Circuit
    shown : ndarray, shape (n, 4, p)
        Derivatives of V_l, I_h, V_r and the rise of the tip, see
        `hotlever.lever.sensitivities.by_parameter`.
    of_circuit : ndarray, shape (n, p)
        Derivatives of the bias for a given state, see `hotlever.probe.supply.SweptSupply.bias_by`.

    Returns
    -------
    ndarray, shape (4, n, p)
        V, mA, V and K per unit of the parameter.
    """
    missing = circuit.bias(shown[:, 0], shown[:, 1]) + of_circuit
    moved = -missing / circuit.bias(along[:, 0], along[:, 1])[:, None]
    return np.moveaxis(shown + along[:, :, None] * moved[:, None], 1, 0)
