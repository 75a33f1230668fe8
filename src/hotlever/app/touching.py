"""A tip in contact that sliders move: what it shows at once. Runs in worker processes.

While sliders move, a coarse lever answers whose branch out of contact is solved once, with the
cone of the probe's file; when they rest, the full lever, whose numbers are those of ``hotlever
contact``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from hotlever.app.live import coloured
from hotlever.app.session import Task, probe_of, surrounded_probe
from hotlever.app.workers import Report
from hotlever.contact.law import INTERFACE
from hotlever.contact.picture import contact_picture
from hotlever.lever import Lever
from hotlever.lever.contact import state_in_contact, sweep_in_contact
from hotlever.lever.lever import COARSE, State
from hotlever.probe import Probe
from hotlever.probe.tip import EXAMPLE, OUT_OF_CONTACT
from hotlever.tasks.arguments import make_lever
from hotlever.tasks.commands import arguments_of
from hotlever.tasks.surfaces import contact_notes, in_contact
from hotlever.work import one_blas_thread

#: By lever out of contact the last state in contact, from which the next one is solved.
_near: WeakKeyDictionary[Lever, State] = WeakKeyDictionary()


def described(report: Report, name: str) -> dict[str, Any]:
    """Return radius (nm), interface (K/W) and sample that a probe file states, or usual ones."""
    probe = probe_of(name)
    contact = probe.contact
    return {
        "radius_nm": 1e3 * (probe.tip or EXAMPLE).apex_radius_um,
        "interface": 0.0 if contact is None else 1e3 * contact.interface_K_per_mW,
        "sample": "polymer, 100nm, silicon" if contact is None else contact.sample,
    }


@one_blas_thread
def answer(report: Report, task: Task, bias: float, most: float, quick: bool) -> dict[str, Any]:
    """Return what a tip in contact shows at a bias (V), and unless `quick` by the bias.

    Parameters
    ----------
    report : Report
    task : Task
        That of ``hotlever contact``.
    bias, most : float
        V; how far the curves go at least, as far as the lever does.
    quick : bool

    Raises
    ------
    HotleverError
        If there is no such contact, or no state at this bias.
    """
    told = arguments_of(task.words)
    probe = surrounded_probe(report, told)
    probe = in_contact(report, probe, told["sample"], told["radius"], told["interface"])
    curves: dict[str, Any] | None = None
    if quick:
        end = 1e-3 * described(report, next(iter(task.files), ""))["radius_nm"]
        free = _out_of_contact(report, probe.with_(**{"tip.apex_radius_um": end}), True, most)
        now, _near[free] = state_in_contact(free, probe, bias, _near.get(free))
    else:
        free, lever = _touching(report, probe, max(most, bias))
        data = sweep_in_contact(lever, [bias], free=free)
        report.note(*contact_notes(data))
        now = {str(name): float(values.item()) for name, values in data.data_vars.items()}
        curves = _curves(report, probe, max(most, bias))
    drawn = contact_picture(probe, now["tip_K"])
    base = probe.circuit.base_temperature_K
    scale = base, max(now["tip_K"], base + 1.0)
    return {
        "now": now,
        "curves": curves,
        "base_K": base,
        "picture": drawn,
        "colours": coloured([T for _, T in drawn.pieces], *scale),
    }


def _out_of_contact(report: Report, probe: Probe, quick: bool, most: float) -> Lever:
    """Return a lever whose tip is just above the sample, solved up to a bias, or to its end."""
    # any sample does for a tip out of contact
    free = probe.with_(**{"sample": "silicon", INTERFACE: OUT_OF_CONTACT})
    return _solved(report, free, quick, most)


@lru_cache(maxsize=3)
def _solved(report: Report, probe: Probe, quick: bool, most: float) -> Lever:
    lever = Lever(probe, COARSE) if quick else make_lever(report, probe)
    lever.read(np.array([most]))
    return lever


@lru_cache(maxsize=3)
def _touching(report: Report, probe: Probe, most: float) -> tuple[Lever, Lever]:
    """Return the full lever out of contact and in contact."""
    free = _out_of_contact(report, probe, False, most)
    return free, free.with_probe(probe)


@lru_cache(maxsize=3)
def _curves(report: Report, probe: Probe, most: float) -> dict[str, Any]:
    """Return the columns of a sweep up to a bias, or as far as both levers go."""
    levers = _touching(report, probe, most)
    for lever in levers:
        branch, *_ = lever.read(np.array([most]))
        most = branch.highest_bias(lever.circuit, most)
    free, lever = levers
    data = sweep_in_contact(lever, np.linspace(0.0, most, 41), free=free, sensitivities=False)
    return {
        name: data[name].values
        for name in ("bias_V", "tip_K", "apex_K", "sample_mW", "beside_mW", "current_change_mA")
    }
