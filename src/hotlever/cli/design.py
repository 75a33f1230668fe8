"""``hotlever design``: what a change of dimensions, doping or annealing does."""

from __future__ import annotations

from dataclasses import dataclass

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.errors import InputError
from hotlever.files import FIGURE_TYPES, Outputs, write_text
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S
from hotlever.tasks.files import draw
from hotlever.tasks.probes import read_probe
from hotlever.tasks.requests import (
    File,
    PhysicsRequest,
    PlotRequest,
    ProbeRequest,
    option,
)
from hotlever.tasks.texts import check_number, parse_vary


@dataclass(kw_only=True)
class DesignRequest(PlotRequest, PhysicsRequest, ProbeRequest):
    """What a change of a probe's design does."""

    vary: str | None = option(
        None,
        metavar="NAME=START:STOP:COUNT",
        help="Sweep a number of the probe file, annealing_K or annealing_min; "
        "a table of sensitivities if left out.",
    )
    power: float = option(2.0, help="Power (mW) in vacuum at which the tip temperature is given.")
    annealing_K: float = option(
        ANNEALING_K, "--annealing-K", help="Annealing (K) that the probe's delta is of."
    )
    annealing_min: float = option(ANNEALING_S / 60.0, help="Annealing (min) that the delta is of.")
    air: bool = option(True, help="Solve in air too, for k.")
    output: File = option(None, "-o", "--output", help="FILE.csv; standard output if left out.")


@command("design", DesignRequest)
def design_command(request: DesignRequest) -> None:
    """Show how knee, tip temperature and loss to air depend on a probe's design."""
    from hotlever.probe.shapes import DRAWING
    from hotlever.studies import design as study

    vary, output, plot = request.vary, request.output, request.plot
    power, air = request.power, request.air
    outputs = Outputs(request.probe)
    outputs.file(output, ".csv")
    outputs.file(plot, *FIGURE_TYPES)
    check_number("--power", power, 1e-3, 1000)
    check_number("--annealing-K", request.annealing_K, 700, 1700)
    check_number("--annealing-min", request.annealing_min, 1e-3, 1e5)
    if vary is None and (plot is not None or output is not None):
        raise InputError("a file or a figure needs a sweep: --vary NAME=START:STOP:COUNT")
    start = study.Design(
        request.with_physics(read_probe(terminal, request.probe)),
        request.annealing_K,
        request.annealing_min,
    )
    if vary is None:
        with terminal.progress("design") as update:
            sensitivities = study.sensitivities(start, power_mW=power, air=air, progress=update)
        terminal.give(study.sensitivity_text(sensitivities) + "\n")
        if start.probe.shape.shape == DRAWING:
            names = ", ".join(start.numbers)
            terminal.note(
                f"a drawing has no dimensions but these; --vary NAME=START:STOP:COUNT of {names}"
            )
        return
    name, values = parse_vary(vary)
    start.value(name)
    with terminal.progress("design") as update:
        data = study.vary(start, name, values, power_mW=power, air=air, progress=update)
    terminal.note(*study.knee_notes(data))
    with outputs.together():
        if output is not None:
            write_text(output, study.design_csv(data))
        draw(plot, lambda figures: figures.design_sweep(data))
    if output is None:
        terminal.give(study.design_csv(data))
