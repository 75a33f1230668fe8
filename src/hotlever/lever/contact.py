"""A lever whose tip touches a sample: apex, heat into the sample, and what the current tells."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever.contact.law import INTERFACE, ContactLaw
from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.lever.lever import Lever
from hotlever.lever.sensitivities import sensitivities_of
from hotlever.lever.transient import Waveform, simulate
from hotlever.probe.contact import OUT_OF_CONTACT
from hotlever.types import Array, Progress

if TYPE_CHECKING:
    import xarray as xr

_OF_THE_CONTACT = (
    *("tip_K", "apex_K", "sample_mW"),
    *("tip_K_per_mW", "interface_K_per_mW", "spreading_K_per_mW", "current_change_mA"),
)
#: Columns of a file, by bias and in time.
CONTACT_COLUMNS: tuple[str, ...] = ("bias_V", "current_mA", *_OF_THE_CONTACT)
HISTORY_COLUMNS: tuple[str, ...] = ("time_us", *CONTACT_COLUMNS)
#: A heat (mW) that is none but for rounding: nothing is said of resistances without.
_NOTHING_MW = 1e-12


def law_of(lever: Lever) -> ContactLaw:
    """Return the law of a lever's contact.

    Raises
    ------
    InputError
        If its tip touches nothing.
    """
    law = lever.equations.contact
    if law is None:
        raise InputError("the tip touches nothing, expected a probe with a section [contact]")
    return law


def out_of_contact(lever: Lever) -> Lever:
    """Return the lever with its tip just above the sample: what is in the air stays."""
    law_of(lever)
    return lever.with_probe(lever.probe.replace({INTERFACE: OUT_OF_CONTACT}))


def sweep_in_contact(
    lever: Lever, bias: ArrayLike, *, progress: Progress | None = None
) -> xr.Dataset:
    """Read a lever in contact over a range of bias, beside the same out of contact.

    Parameters
    ----------
    lever : Lever
    bias : array_like, shape (n,)
        V.
    progress : callable, optional
        Called with the states done and how many there usually are.

    Returns
    -------
    xarray.Dataset
        One variable for each of `CONTACT_COLUMNS` on the dimension ``bias``; ``beside_mW``, the
        heat through air from the tip's side; ``tip_change_K``, how much the contact cools the
        tip; and ``current_by_resistance``, how the current at this bias changes with the sum of
        the resistances. An error of the current over this is the error of the sum. Resistances are
        those of the heat through the contact; a sweep's other variables beside them.

    Raises
    ------
    InputError
        If the tip touches nothing, or as `Lever.sweep`.
    BranchEndError, ComputationError
        As `Lever.sweep`.
    """
    free = out_of_contact(lever).sweep(bias, progress=progress)
    data = lever.sweep(bias, progress=progress)
    branch, reading, _ = lever._read(data.bias_V.values)
    powered = data.current_mA.values != 0
    slope = np.zeros(powered.size)
    by = sensitivities_of(branch, reading.u[powered], lever.circuit, [INTERFACE])
    slope[powered] = by[0, :, 0] / law_of(lever).sum_by_interface
    columns = _columns(lever, data.tip_K.values) | {
        "current_change_mA": data.current_mA.values - free.current_mA.values,
        "tip_change_K": data.tip_K.values - free.tip_K.values,
        "current_by_resistance": slope,
    }
    return data.assign(labelled(columns).variables)


def history_in_contact(
    lever: Lever,
    waveform: Waveform,
    until_us: float | None = None,
    times_us: ArrayLike | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Follow a lever in contact in time, beside the same out of contact.

    Tip and sample are taken to follow at once, see `hotlever.contact.law`. Parameters and errors
    are those of `hotlever.lever.transient.simulate`.

    Returns
    -------
    xarray.Dataset
        One variable for each of `HISTORY_COLUMNS` on the dimension ``time``, and a history's
        other ones.
    """
    law_of(lever)
    data = simulate(lever, waveform, until_us, times_us, progress=progress)
    free = simulate(out_of_contact(lever), waveform, until_us, data.time.values)
    change = data.current_mA.values - free.current_mA.values
    columns = _columns(lever, data.tip_K.values) | {"current_change_mA": change}
    return data.assign(labelled(columns, "time").variables)


def _columns(lever: Lever, tip_K: Array) -> dict[str, Any]:
    """Return what is between tip and sample, by the tip temperature."""
    law = law_of(lever)
    contact = law.at(tip_K)
    flows = np.where(contact.sample_mW > _NOTHING_MW, contact.sample_mW, np.nan)
    resistance = (tip_K - contact.apex_K) / flows
    return {
        **contact._asdict(),
        "tip_K_per_mW": resistance,
        INTERFACE: np.full_like(tip_K, law.interface_K_per_mW),
        "spreading_K_per_mW": np.full_like(tip_K, law.spreading_K_per_mW),
    }
