"""Calibrations of many levers: as fits of many are, see `hotlever.estimation.batch`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from hotlever.calibration.calibration import Calibration, CalibrationFile
from hotlever.calibration.power_law import PowerLaw
from hotlever.calibration.procedure import calibrate
from hotlever.calibration.pulses import PulseTiming
from hotlever.calibration.uncertainty_budget import BudgetOf
from hotlever.estimation import FitOptions
from hotlever.estimation.batch import Batch, Work, estimate_many
from hotlever.files import CALIBRATION
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, known_beforehand


def calibrate_many(
    paths: Sequence[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    probe: Probe | None = None,
    *,
    law: PowerLaw | None = None,
    medium: str | None = None,
    priors: Mapping[str, Prior | str] | None = None,
    pulse: PulseTiming | None = None,
    samples: int = 0,
    budget_of: BudgetOf = "tip",
    **how: Any,
) -> Batch[Calibration]:
    """Calibrate many levers and write a calibration file for each as soon as it is done.

    Parameters
    ----------
    paths : sequence of path
        Measurement files.
    folder : path
        Where the calibration files go, named after the data files.
    probe : Probe, optional
        What the levers are like; the reference probe by default.
    law, medium, priors, pulse, samples, budget_of
        See `hotlever.calibration.procedure.calibrate`.
    **how
        As `hotlever.estimation.batch.estimate_many` has them.

    Raises
    ------
    InputError, ComputationError
        See `hotlever.estimation.batch.estimate_many`.
    """
    like = probe or Probe.reference()
    # what it is for each lever, whatever its file says of circuit and medium
    options = FitOptions(priors=known_beforehand(like, priors), medium=medium)  # type: ignore[arg-type]
    asked = {
        "power_law": None if law is None else law.model_dump(),
        "pulse": None if pulse is None else asdict(pulse),
        "samples": samples,
        "budget_of": budget_of,
    }
    calibration = partial(
        calibrate,
        probe=None if law is not None else like,
        law=law,
        medium=medium,
        priors=priors,
        pulse=pulse,
        samples=samples,
        budget_of=budget_of,
    )
    work = Work("calibration", calibration, CalibrationFile, CALIBRATION, like, options, asked)
    return estimate_many(paths, folder, work, **how)
