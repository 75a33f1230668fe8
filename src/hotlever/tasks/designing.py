"""What a change of a probe's design does: sensitivities, variations, or the best within bounds."""

from __future__ import annotations

from typing import Any

from hotlever.datasets import write_dataset
from hotlever.errors import InputError
from hotlever.files import write_text
from hotlever.probe.shapes import DRAWING
from hotlever.studies import design as study
from hotlever.tasks.planning_requests import DesignRequest
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.shared import draw, read_probe
from hotlever.tasks.texts import check_number, parse_bounds, parse_setting, parse_varied

#: Numbers that are varied at once of which there are figures: a curve or a map.
_DRAWN = 2


def vary_design(reporter: Reporter, request: DesignRequest) -> None:
    """Find how knee, tip temperature and loss to air depend on a probe's design."""
    request.need_no_others()
    if request.asks_for_best:
        optimise_design(reporter, request)
        return
    output = request.output
    request.check_outputs()
    options: Any = {"power_mW": request.power, "air": request.air}
    check_number("--power", request.power, 1e-3, 1000)
    check_number("--annealing-K", request.annealing_K, 700, 1700)
    check_number("--annealing-min", request.annealing_min, 1e-3, 1e5)
    varied = parse_varied(request.vary or [])
    if not varied:
        request.refuse("plot", "output", why="needs a sweep, --vary NAME=START:STOP:COUNT")
    elif len(varied) > _DRAWN:
        why = f"found {len(varied)} of --vary, expected at most {_DRAWN}"
        request.refuse("plot", why=why)
    start = study.Design(
        request.with_physics(read_probe(reporter, request.probe)),
        request.annealing_K,
        request.annealing_min,
    )
    if not varied:
        with reporter.progress("design") as update:
            sensitivities = study.sensitivities(start, progress=update, **options)
        reporter.note(study.mesh_note(start.probe, request.power))
        reporter.give(study.sensitivity_text(sensitivities) + "\n")
        if start.probe.shape.shape == DRAWING:
            names = ", ".join(start.numbers)
            reporter.note(
                f"a drawing has no dimensions but these; --vary NAME=START:STOP:COUNT of {names}"
            )
        return
    with reporter.progress("design") as update:
        data = study.vary(start, varied, progress=update, **options)
    reporter.note(study.mesh_note(start.probe, request.power), *study.design_notes(data))
    if output is not None and output.suffix.lower() == ".nc":
        write_dataset(data, output, ())
    elif output is not None:
        write_text(output, study.design_csv(data))
    draw(request.plot, lambda figures: figures.design_study(data))
    if output is None:
        reporter.give(study.design_csv(data))


def optimise_design(reporter: Reporter, request: DesignRequest) -> None:
    """Find the design within bounds whose quantity is least or greatest."""
    from hotlever.studies.optimisation import optimise, optimum_text
    from hotlever.studies.working_point import WorkingPoint

    request.check_outputs()
    probe = request.with_physics(read_probe(reporter, request.probe))
    point = WorkingPoint(*parse_setting(request.at, tip=True))
    quantity, bounds = request.minimise or request.maximise or "", parse_bounds(request.within)
    for option, name in (
        ("--minimise" if request.minimise else "--maximise", quantity),
        *(("--within", name) for name in bounds),
    ):
        if name == point.column:
            raise InputError(
                f"{option} {name}: it is what --at {request.at} holds, expected another quantity, "
                "or another --at"
            )
    with reporter.progress("design") as update:
        greatest = request.maximise is not None
        optimum = optimise(probe, quantity, point, bounds, greatest=greatest, progress=update)
    if optimum.reason:
        reporter.note(f"this may not be the optimum: {optimum.reason}")
    if request.output is not None:
        optimum.best.probe.to_file(request.output)
    draw(request.plot, lambda figures: figures.design_optimum(optimum))
    reporter.give(optimum_text(optimum) + "\n")
