"""Calibrations of measurement files."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from hotlever.calibration.power_law import read_power_law
from hotlever.calibration.procedure import calibrate
from hotlever.calibration.summary import calibration_text
from hotlever.errors import ComputationError, InputError
from hotlever.estimation import read_fit, read_measurement
from hotlever.files import Outputs, write_text
from hotlever.probe import Probe
from hotlever.tasks.files import draw
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.texts import parse_priors


class Tables(NamedTuple):
    """Files that a calibration is written to."""

    output: Path | None
    table: Path | None
    plot: Path | None = None


def calibrate_file(
    reporter: Reporter,
    data: Path,
    columns: dict[str, str],
    probe: Probe | None,
    fit_file: Path | None,
    power_law: Path | None,
    prior: list[str] | None,
    outputs: Outputs,
    to: Tables,
    **asked: Any,
) -> None:
    """Calibrate a lever; `asked` are options of `hotlever.calibration.procedure.calibrate`.

    Raises
    ------
    ComputationError
        If no lever shows these data; what the search ended at is written.
    """
    fit = None if fit_file is None else read_fit(fit_file)
    like = probe or (Probe.reference() if fit is None else fit.probe)
    priors = parse_priors(prior, like)
    measurement = read_measurement(data, columns, like.circuit)
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes)
    if "current" not in measurement.observables:
        raise InputError(f"{data}: no values of I_h, which a calibration needs beside V_b")
    with reporter.progress("calibrate") as update:
        result = calibrate(
            measurement,
            probe=like if fit is None and power_law is None else None,
            fit=fit,
            law=None if power_law is None else read_power_law(power_law),
            priors=priors,
            progress=update,
            **asked,
        )
    reporter.note(*result.notes)
    with outputs.together():
        if to.output is not None:
            result.write(to.output)
        if to.table is not None:
            write_text(to.table, result.table_csv())
        draw(to.plot, lambda figures: figures.calibration_curves(result))
    reporter.give(calibration_text(result) + "\n")
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")
