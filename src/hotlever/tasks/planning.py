"""What to measure next of a lever, by its calibration, its measurement, or its priors."""

from __future__ import annotations

from hotlever.calibration import Calibration, plan_next, read_calibration
from hotlever.calibration.procedure import calibrate
from hotlever.files import write_text
from hotlever.measurement import read_measurement_of
from hotlever.tasks.files import draw
from hotlever.tasks.next_requests import NextRequest
from hotlever.tasks.probes import read_probe
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.texts import parse_priors


def propose(reporter: Reporter, request: NextRequest) -> None:
    """Say what to measure next, or first.

    Raises
    ------
    InputError
        If the data are not described, so that nothing follows from them.
    """
    request.check()
    choices, outputs = request.choices(), request.outputs()
    if request.data is None:
        probe = request.with_physics(read_probe(reporter, request.probe))
        probe = probe if request.medium is None else probe.in_medium(request.medium)
        priors = parse_priors(request.prior, probe)
        with reporter.progress("next"):
            plan = plan_next(probe=probe, priors=priors, **choices)
    else:
        calibration = _calibration(reporter, request)
        with reporter.progress("next"):
            plan = plan_next(calibration, **choices)
    reporter.note(*plan.notes)
    with outputs.together():
        if request.output is not None:
            write_text(request.output, plan.to_csv())
        draw(request.plot, lambda figures: figures.planned_measurements(plan))
    reporter.give(plan.text() + "\n")


def _calibration(reporter: Reporter, request: NextRequest) -> Calibration:
    """Return the calibration that is asked about, made first of a measurement."""
    assert request.data is not None
    if request.calibrated:
        return read_calibration(request.data)
    like = request.with_physics(read_probe(reporter, request.probe))
    measurement = read_measurement_of(like, request.data, request.columns)
    reporter.note(*measurement.notes)
    priors = parse_priors(request.prior, like)
    with reporter.progress("calibrate") as update:
        result = calibrate(
            measurement, probe=like, priors=priors, medium=request.medium, progress=update
        )
    reporter.note(
        f"{request.data} was calibrated first, which a file of hotlever calibrate -o saves"
    )
    return result
