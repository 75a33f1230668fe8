"""Calibrations of measurement files."""

from __future__ import annotations

from hotlever.calibration.power_law import read_power_law
from hotlever.calibration.procedure import calibrate
from hotlever.calibration.summary import calibration_text
from hotlever.errors import ComputationError, InputError
from hotlever.estimation import read_fit
from hotlever.files import write_text
from hotlever.measurement import read_measurement_of
from hotlever.tasks.files import draw
from hotlever.tasks.measured_requests import CalibrateRequest
from hotlever.tasks.probes import read_probe
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.texts import parse_priors, parse_timing


def calibrate_file(reporter: Reporter, request: CalibrateRequest) -> None:
    """Calibrate a lever.

    Raises
    ------
    ComputationError
        If no lever shows these data; what the search ended at is written.
    """
    request.check()
    data, law = request.data, request.power_law
    timing = None if request.pulse is None else parse_timing(request.pulse)
    columns, outputs = request.columns, request.outputs()
    fit = None if request.fit is None else read_fit(request.fit)
    like = fit.probe if fit else request.with_physics(read_probe(reporter, request.probe))
    priors = parse_priors(request.prior, like)
    measurement = read_measurement_of(like, data, columns)
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes)
    if "current" not in measurement.observables:
        raise InputError(f"{data}: no values of I_h, which a calibration needs beside V_b")
    with reporter.progress("calibrate") as update:
        result = calibrate(
            measurement,
            probe=like if fit is None and law is None else None,
            fit=fit,
            law=None if law is None else read_power_law(law),
            priors=priors,
            progress=update,
            medium=request.medium,
            pulse=timing,
            samples=request.samples if request.posterior else 0,
        )
    reporter.note(*result.notes)
    with outputs.together():
        if request.output is not None:
            result.write(request.output)
        if request.table is not None:
            write_text(request.table, result.table_csv())
        draw(request.plot, lambda figures: figures.calibration_curves(result))
    reporter.give(calibration_text(result) + "\n")
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")
