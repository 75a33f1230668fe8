"""A lever whose tip touches a sample: apex, heat into the sample, and what the current tells."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever.contact.law import INTERFACE, ContactLaw
from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError, as_far_as_possible
from hotlever.lever.lever import Lever, State
from hotlever.lever.observables import sensitivities_of
from hotlever.lever.transient import Waveform, simulate
from hotlever.probe import Probe
from hotlever.probe.tip import OUT_OF_CONTACT
from hotlever.types import Array, Progress
from hotlever.work import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

#: Columns of a file by bias; one in time has those of the time before them.
CONTACT_COLUMNS: tuple[str, ...] = (
    *("bias_V", "current_mA", "tip_K", "apex_K", "sample_mW"),
    *("tip_K_per_mW", "interface_K_per_mW", "spreading_K_per_mW", "current_change_mA"),
)


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


@one_blas_thread
def state_in_contact(
    free: Lever, probe: Probe, bias: float, near: State | None = None
) -> tuple[dict[str, float], State]:
    """Return what a tip in contact shows at a bias (V), and its state, without a branch of its own.

    It is solved from a state in contact that may be near, or else from the one out of contact.

    Parameters
    ----------
    free : Lever
        Out of contact.
    probe : Probe
        In contact, else the same but for the radius of the flat end: the cone is meshed as that of
        `free`.
    bias : float
    near : State, optional

    Returns
    -------
    row : dict of str to float
        What `sweep_in_contact` has of this bias, but for ``current_by_resistance``.
    state : State

    Raises
    ------
    BranchEndError, ComputationError
        As `Lever.solve`.
    """

    def like_free(probe: Probe) -> Lever:
        lever = copy(free)
        lever.probe = probe
        lever._prepare()
        return lever

    (away,) = free.solve([bias])
    # out of contact too, the air beside the cone depends on its radius
    above = free.probe.replace({"apex_radius_um": float(probe.values(["apex_radius_um"])[0])})
    before = like_free(above).polished(away.x, bias)
    touching, after = like_free(probe), None
    for guess in (near, before):
        if guess is not None and after is None:
            with suppress(ComputationError):
                after = touching.polished(guess.x, bias)
    if after is None:
        (after,) = touching.solve([bias])
    columns = _columns(touching, np.array([after.tip_K]))
    row = {name: float(values[0]) for name, values in columns.items()} | {
        "bias_V": bias,
        "tip_K": after.tip_K,
        "current_mA": after.current_mA,
        "current_change_mA": after.current_mA - before.current_mA,
        "tip_change_K": after.tip_K - before.tip_K,
    }
    return row, after


def sweep_in_contact(
    lever: Lever,
    bias: ArrayLike,
    *,
    free: Lever | None = None,
    sensitivities: bool = True,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Read a lever in contact over a range of bias, beside the same out of contact.

    Parameters
    ----------
    lever : Lever
    bias : array_like, shape (n,)
        V.
    free : Lever, optional
        The same out of contact, whose branch is then not solved anew.
    sensitivities : bool
        Add ``current_by_resistance``, of which each state takes as long as a step of the branch.
    progress : callable, optional
        Called with the states done and how many there usually are.

    Returns
    -------
    xarray.Dataset
        One variable for each of `CONTACT_COLUMNS` on the dimension ``bias``; ``beside_mW``, the
        heat through air from the tip's side; ``tip_change_K``, how much the contact cools the
        tip; and ``current_by_resistance``, how the current at this bias changes with the sum of
        the resistances. An error of the current over this is the error of the sum. The resistance
        of the cone is its own, though in air its side gives heat; and a sweep's other variables.

    Raises
    ------
    InputError
        If the tip touches nothing, or as `Lever.sweep`.
    BranchEndError, ComputationError
        As `Lever.sweep`, of either; ``partial`` holds the dataset as far as both were followed.
    """
    above = free or out_of_contact(lever)
    data, before, failure = _side_by_side(
        lambda: lever.sweep(bias, progress=progress),
        lambda data: above.sweep(data.bias_V.values, progress=progress),
    )
    columns = _columns(lever, data.tip_K.values) | {
        "current_change_mA": data.current_mA.values - before.current_mA.values,
        "tip_change_K": data.tip_K.values - before.tip_K.values,
    }
    if sensitivities:
        branch, reading, _ = lever.read(data.bias_V.values)
        powered = data.current_mA.values != 0
        slope = np.zeros(powered.size)
        by = sensitivities_of(branch, reading.u[powered], lever.circuit, [INTERFACE])
        slope[powered] = by[0, :, 0] / law_of(lever).sum_by_interface
        columns["current_by_resistance"] = slope
    return _unless(failure, data.assign(labelled(columns).variables))


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
        One variable for each of `CONTACT_COLUMNS` on the dimension ``time``, and a history's
        other ones.
    """
    law_of(lever)
    above = out_of_contact(lever)
    data, free, failure = _side_by_side(
        lambda: simulate(lever, waveform, until_us, times_us, progress=progress),
        lambda data: simulate(above, waveform, until_us, data.time.values, progress=progress),
    )
    change = data.current_mA.values - free.current_mA.values
    columns = _columns(lever, data.tip_K.values) | {"current_change_mA": change}
    return _unless(failure, data.assign(labelled(columns, "time").variables))


def _side_by_side(
    touching: Callable[[], xr.Dataset], free: Callable[[xr.Dataset], xr.Dataset]
) -> tuple[xr.Dataset, xr.Dataset, ComputationError | None]:
    """Return a lever in contact and out of it where both were followed, and what ended that."""
    data, failure = as_far_as_possible(touching)
    before, ended = as_far_as_possible(lambda: free(data))
    (along,) = before.tip_K.dims
    both = np.isin(data[along].values, before[along].values)
    # mostly all; of an array that chooses xarray asks what `hotlever.datasets.quantity` spares it
    touched = data if both.all() else data.isel({along: both})
    return touched, before, ended or failure


def _unless(failure: ComputationError | None, reached: xr.Dataset) -> xr.Dataset:
    """Return what was reached, or raise the failure with it."""
    if failure is None:
        return reached
    failure.partial = reached
    raise failure


def _columns(lever: Lever, tip_K: Array) -> dict[str, Any]:
    """Return what is between tip and sample, by the tip temperature."""
    law = law_of(lever)
    return {
        **law.at(tip_K)._asdict(),
        INTERFACE: np.full_like(tip_K, law.interface_K_per_mW),
        "spreading_K_per_mW": np.full_like(tip_K, law.spreading_K_per_mW),
    }
