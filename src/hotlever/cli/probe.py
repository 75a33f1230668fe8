"""``hotlever probe``: write, describe and draw probes, and make them of drawings."""

from __future__ import annotations

from dataclasses import dataclass

import typer
from typer import Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import Commands, app
from hotlever.cli.options import command
from hotlever.errors import unknown_name
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.design_requests import ImportRequest
from hotlever.tasks.files import draw
from hotlever.tasks.probes import read_probe
from hotlever.tasks.requests import File, PlotRequest, ProbeRequest, option

probe_app = typer.Typer(
    cls=Commands, help="Write, describe, draw and import probes.", rich_markup_mode=None
)
app.add_typer(probe_app, name="probe")

#: Shapes, and the methods of `Probe` that make one.
_NEW = {"three-leg": "reference", "u-shape": "u_shape"}


@probe_app.command()
def new(
    output: File = Option(None, "-o", "--output", help="File; standard output if left out."),
    shape: str = Option("three-leg", help=f"One of: {', '.join(_NEW)}."),
) -> None:
    """Write the reference probe as a commented file."""
    from hotlever.probe import Probe

    if shape not in _NEW:
        raise unknown_name("shape", shape, _NEW)
    Outputs().file(output, ".toml")
    probe = getattr(Probe, _NEW[shape])()
    if output is None:
        terminal.give(probe.to_toml())
    else:
        probe.to_file(output)


@dataclass(kw_only=True)
class ShowRequest(PlotRequest, ProbeRequest):
    """A probe to draw and describe."""

    mesh: bool = option(False, "--mesh", help="Draw the triangles of the mesh too.")


@command("show", ShowRequest, probe_app)
def show(request: ShowRequest) -> None:
    """Draw and describe a probe."""
    from hotlever.lever.meshing import chosen_space
    from hotlever.probe.drawing.outlines import DrawingError
    from hotlever.probe.summary import probe_text

    probe_file, plot = request.probe, request.plot
    outputs = Outputs(probe_file)
    outputs.file(plot, *FIGURE_TYPES)
    try:
        probe = read_probe(terminal, probe_file)
    except DrawingError as error:
        fault = error
        with outputs.together():
            draw(
                plot,
                lambda figures: figures.outlines_drawing(
                    fault.outlines, fault=str(fault), place=fault.place
                ),
            )
        raise
    name = "reference probe" if probe_file is None else probe_file.name
    layout, triangles = probe.layout(), chosen_space(probe).mesh
    drawn = triangles if request.mesh else None
    with outputs.together():
        draw(plot, lambda figures: figures.probe_drawing(layout, name, mesh=drawn))
    terminal.give(probe_text(probe, triangles, name))


@command("import", ImportRequest, probe_app)
def import_command(request: ImportRequest) -> None:
    """Say what a drawing holds, and propose a probe file for it."""
    from hotlever.tasks.importing import propose_probe

    propose_probe(terminal, request)
