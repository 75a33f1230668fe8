"""Fits of measurement files, of one lever or many."""

from __future__ import annotations

from functools import partial
from typing import Any

from hotlever.errors import ComputationError, HotleverError
from hotlever.estimation import Fit, FitOptions, fit
from hotlever.estimation.batch import Batch, fit_many
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.summary import (
    compare_levers,
    fit_text,
    lever_rows,
    levers_csv,
    statements,
    table_text,
)
from hotlever.estimation.uncertainty import Uncertainty, examine
from hotlever.files import Outputs, write_text
from hotlever.measurement import read_measurement_of
from hotlever.probe import Probe
from hotlever.tasks.batches import Summary, estimate_several
from hotlever.tasks.measured_requests import FitRequest
from hotlever.tasks.probes import read_probe
from hotlever.tasks.reporter import Reporter

#: Points of a curve that is shown while the fit goes on.
_DRAWN = 200
#: The table of many levers, in the folder of their fits.
LEVERS_TABLE = "levers.csv"


def fit_files(reporter: Reporter, request: FitRequest) -> int:
    """Fit one lever or many; return the exit status.

    Raises
    ------
    ComputationError
        If no lever shows the data of a single one; what the search ended at is written.
    """
    request.check()
    probe = request.with_physics(read_probe(reporter, request.probe))
    options, outputs = request.options(probe), request.outputs()
    if not request.several:
        _fit_one(reporter, request, outputs, probe, options)
        return 0
    make = partial(fit_many, probe=probe, options=options)
    return estimate_several(reporter, request, outputs, "fits", LEVERS_TABLE, make, _summary)


def _fit_one(
    reporter: Reporter, request: FitRequest, outputs: Outputs, probe: Probe, options: FitOptions
) -> None:
    (data,), waveform = request.data, request.read_waveform()
    samples = request.samples if request.posterior else None
    measurement = read_measurement_of(probe, data, request.columns, waveform)
    if samples or request.profiles:
        measurement.need_rest("--posterior" if samples else "--profiles")
    options.of(probe, in_time=measurement.time_us is not None)  # raises before anything is said
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes, *measurement.unused)
    with reporter.progress("fit") as update:
        seen = partial(_show_curve, reporter)
        result = fit(measurement, probe, options, progress=update, seen=seen)
    reporter.note(*result.notes)
    texts = [fit_text(result)]
    uncertainty: Uncertainty | None = None
    failure: HotleverError | KeyboardInterrupt | None = None
    if not result.describes_data and (samples or request.profiles):
        reporter.note("no posterior and no profiles of a lever that does not show these data")
    elif samples or request.profiles:
        try:
            labels = "profiles", "posterior", "band"
            with reporter.progress_bars(*labels) as (profiling, sampling, banding):
                bars: Any = {"profiling": profiling, "sampling": sampling, "banding": banding}
                asked: Any = {"profiles": request.profiles, "processes": request.processes}
                uncertainty = examine(result, samples=samples, **asked, **bars)
            reporter.note(*uncertainty.statements())
            texts.append(uncertainty.text())
        except (HotleverError, KeyboardInterrupt) as error:
            # the fit is there; what ends this is said when it is written
            failure = error
    with outputs.together():
        if request.output is not None:
            write_text(request.output, (uncertainty or result).to_json())
        if request.report is not None:
            from hotlever.report.fit_pages import fit_page

            texts.append(f"report: {fit_page(result, uncertainty).write(request.report)}")
    reporter.give("\n".join([*texts, ""]))
    if failure is not None:
        raise failure
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")


def _show_curve(reporter: Reporter, prediction: Prediction) -> None:
    """Show how near to the data the lever is that was found so far."""
    columns = prediction.columns
    along, *_ = columns.values()
    some = along.argsort()[:: max(1, along.size // _DRAWN)]
    reporter.show("curve", {name: values[some].tolist() for name, values in columns.items()})


def _summary(batch: Batch[Fit]) -> Summary:
    from hotlever.report.fit_pages import levers_page

    table = compare_levers(batch.results)
    files = {LEVERS_TABLE: levers_csv(table)}
    text = table_text(lever_rows(table), statements(table))
    return Summary(text, lambda: levers_page(batch), files)
