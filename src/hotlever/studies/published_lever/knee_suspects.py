"""What carries how much of the 50 K that the paper's knee is off, and what would tell.

Stored as ``benchmarks/published_lever.py knee`` writes it: `hotlever.studies.knee_study.carried_by`
of each suspect, and of each coefficient of the departures of laws, which are suspects of the size
of a standard deviation. What a law may carry is a standard error: the root of the sum of the
squares over its coefficients.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from hotlever import spieser2017 as paper
from hotlever.datasets import labelled
from hotlever.estimate import Measurement, calibrate, plan_next
from hotlever.lever import Lever
from hotlever.materials import PARAMETERS
from hotlever.materials.departures import DEPARTURES
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import parameter_named
from hotlever.studies.published_lever.ensemble import stored_table
from hotlever.studies.published_lever.statements import raman_error
from hotlever.types import Array


@cache
def carried() -> xr.Dataset:
    """Return what is stored.

    Returns
    -------
    xarray.Dataset
        On ``layout`` and ``suspect``: ``moved_K``, ``shift_K`` and ``ramp_K``, see
        `hotlever.studies.knee_study.Carried`; and each fitted parameter, by its name. On ``layout``
        and ``law``: ``stderr_K``, what a law may carry where the model is fitted; NaN where that
        was not computed.
    """
    table = stored_table("knee.csv", "layout", "suspect")
    layouts, suspects = (list(table.index.unique(level)) for level in ("layout", "suspect"))
    coefficients = {name for law in DEPARTURES.values() for name in law.names}
    suspects = [name for name in suspects if name not in coefficients]

    def column(key: str, names: list[str]) -> Array:
        values = table[key].unstack("suspect").reindex(index=layouts, columns=names)
        return values.to_numpy(dtype=float)

    by_law = [
        np.linalg.norm(column("shift_K", list(law.names)), axis=1) for law in DEPARTURES.values()
    ]
    both = ("layout", "suspect")
    columns = {
        key: (both, column(key, suspects)) for key in ("moved_K", "shift_K", "ramp_K", *PARAMETERS)
    }
    columns["stderr_K"] = (("layout", "law"), np.transpose(by_law))
    coordinates = {"layout": layouts, "suspect": suspects, "law": list(DEPARTURES)}
    return labelled(columns, both, coordinates)


# --- which measurement would decide ---------------------------------------------------------------


def what_to_measure(probe: Probe, seed: int = 0) -> xr.Dataset:
    """Ask what to measure next for the knee of a lever that was measured as the paper's was.

    The 2 % within which the paper describes currents are taken as two standard deviations of
    currents and reader voltages; temperatures have the error of the paper's thermometer.

    Parameters
    ----------
    probe : Probe
    seed : int
        Of the noise.

    Returns
    -------
    xarray.Dataset
        On ``added``, what is measured next (nothing, a spectrum, a finer sweep, a dimension), and
        ``data``, what is calibrated (the ramp without its temperatures, with them): ``stderr_K``,
        the standard error of the knee then, and ``what`` is proposed, in words.

    Raises
    ------
    InputError
        If a calibration does not describe the ramp.
    ComputationError
        If the lever cannot be solved.
    """
    ramp, rng = Lever(probe).sweep(paper.RAMP), np.random.default_rng(seed)
    error_K = raman_error(ramp.tip_K.values - probe.circuit.base_temperature_K)

    def noisy(values: Array, errors: Array) -> Array:
        return values + errors * rng.standard_normal(values.size)

    current, reader = (
        noisy(ramp[name].values, 0.5 * paper.CURRENT_ERROR * ramp[name].values)
        for name in ("current_mA", "reader_V")
    )
    tip_K = noisy(ramp.tip_K.values, error_K)
    everything = Measurement(ramp.bias_V.values, current, reader, tip_K, error_K)
    nothing = np.full(len(paper.RAMP), np.nan)
    data = {
        "ramp without temperatures": replace(everything, tip_K=nothing, tip_error_K=nothing),
        "ramp with temperatures": everything,
    }
    choices: dict[str, dict[str, Any]] = {
        "a spectrum": {"allowed": {"spectra": 1}, "count": 1},
        "eight more biases, currents to 0.1 %": {
            "allowed": {"bias": 8},
            "count": 8,
            "noise": {"current": 1e-3},
        },
        "a dimension, to 1 %": {"allowed": {"dimensions": 1}, "count": 1},
    }
    stderr_K, what = [], []
    for measurement in data.values():
        estimate = calibrate(measurement, probe=probe)
        plans = [plan_next(estimate, quantity="knee", **choice) for choice in choices.values()]
        spectrum, *_, dimension = (plan.proposals.isel(proposal=0) for plan in plans)
        now = spectrum.stderr_now_K.item()
        stderr_K.append([now, *(plan.proposals.stderr_then_K.values[-1] for plan in plans)])
        name = parameter_named(dimension.what.item()).symbol
        what.append(["", f"at {spectrum.tip_K.item():.0f} K", "", name])
    both = ("added", "data")
    columns = {"stderr_K": (both, np.transpose(stderr_K)), "what": (both, np.transpose(what))}
    return labelled(columns, both, {"added": ["nothing", *choices], "data": list(data)})
