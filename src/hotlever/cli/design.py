"""``hotlever design``: what a change of dimensions, doping or annealing does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.datasets import write_dataset
from hotlever.errors import InputError
from hotlever.files import write_text
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S
from hotlever.tasks.files import draw
from hotlever.tasks.probes import read_probe
from hotlever.tasks.requests import PhysicsRequest, ProbeRequest, TableRequest, option
from hotlever.tasks.texts import check_number, parse_varied

#: Numbers that are varied at once of which there are figures: a curve or a map.
_DRAWN = 2


@dataclass(kw_only=True)
class DesignRequest(TableRequest, PhysicsRequest, ProbeRequest):
    """What a change of a probe's design does."""

    vary: list[str] | None = option(
        None,
        metavar="NAME=START:STOP:COUNT",
        help="Sweep a number of the probe file, annealing_K or annealing_min; repeated: each with "
        "each, as a map. A table of sensitivities if left out.",
    )
    power: float = option(2.0, help="Power (mW) in vacuum at which the tip temperature is given.")
    annealing_K: float = option(
        ANNEALING_K, "--annealing-K", help="Annealing (K) that the probe's delta is of."
    )
    annealing_min: float = option(ANNEALING_S / 60.0, help="Annealing (min) that the delta is of.")
    air: bool = option(True, help="Solve in air too, for k.")


@command("design", DesignRequest)
def design_command(request: DesignRequest) -> None:
    """Show how knee, tip temperature and loss to air depend on a probe's design."""
    from hotlever.probe.shapes import DRAWING
    from hotlever.studies import design as study

    output, plot, outputs = request.output, request.plot, request.outputs(request.probe)
    asked: Any = {"power_mW": request.power, "air": request.air}
    check_number("--power", request.power, 1e-3, 1000)
    check_number("--annealing-K", request.annealing_K, 700, 1700)
    check_number("--annealing-min", request.annealing_min, 1e-3, 1e5)
    varied = parse_varied(request.vary or [])
    if not varied and (plot is not None or output is not None):
        raise InputError("a file or a figure needs a sweep: --vary NAME=START:STOP:COUNT")
    if plot is not None and len(varied) > _DRAWN:
        raise InputError(f"--plot: found {len(varied)} of --vary, expected at most {_DRAWN}")
    start = study.Design(
        request.with_physics(read_probe(terminal, request.probe)),
        request.annealing_K,
        request.annealing_min,
    )
    if not varied:
        with terminal.progress("design") as update:
            sensitivities = study.sensitivities(start, progress=update, **asked)
        terminal.give(study.sensitivity_text(sensitivities) + "\n")
        if start.probe.shape.shape == DRAWING:
            names = ", ".join(start.numbers)
            terminal.note(
                f"a drawing has no dimensions but these; --vary NAME=START:STOP:COUNT of {names}"
            )
        return
    with terminal.progress("design") as update:
        data = study.vary(start, varied, progress=update, **asked)
    terminal.note(*study.design_notes(data))
    with outputs.together():
        if output is not None and output.suffix.lower() == ".nc":
            write_dataset(data, output, ())
        elif output is not None:
            write_text(output, study.design_csv(data))
        draw(plot, lambda figures: figures.design_study(data))
    if output is None:
        terminal.give(study.design_csv(data))
