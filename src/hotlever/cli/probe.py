"""``hotlever probe``: write, describe and draw probes, and make them of drawings."""

from __future__ import annotations

from pathlib import Path

import typer
from typer import Argument, Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import Commands, app
from hotlever.cli.options import File, PlotFile, ProbeFile
from hotlever.errors import unknown_name
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.files import draw
from hotlever.tasks.probes import read_probe

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
    probe = getattr(Probe, _NEW[shape])()
    if output is None:
        terminal.give(probe.to_toml())
    else:
        probe.to_file(output)


@probe_app.command()
def show(
    probe_file: ProbeFile = None,
    plot: PlotFile = None,
    mesh: bool = Option(False, "--mesh", help="Draw the triangles of the mesh too."),
) -> None:
    """Draw and describe a probe."""
    from hotlever.lever.meshing import chosen_space
    from hotlever.probe.drawing.outlines import DrawingError
    from hotlever.probe.summary import probe_text

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
    with outputs.together():
        draw(
            plot,
            lambda figures: figures.probe_drawing(layout, name, mesh=triangles if mesh else None),
        )
    terminal.give(probe_text(probe, triangles, name))


@probe_app.command("import")
def import_command(
    drawing: Path = Argument(metavar="DRAWING", help="GDSII, OASIS or DXF file."),
    output: File = Option(
        None, "-o", "--output", help="Probe file to write; standard output if left out."
    ),
    cell: str | None = Option(None, help="Of GDSII or OASIS; the top cell if left out."),
    unit: str | None = Option(
        None, help="Of the drawing's numbers, as mm; what the file says if left out."
    ),
    plot: PlotFile = None,
) -> None:
    """Say what a drawing holds, and propose a probe file for it."""
    from hotlever.probe.drawing.sheet import UNITS
    from hotlever.tasks.importing import propose_probe

    name = None if unit is None else unit.replace("µ", "u").replace("μ", "u")
    if name is not None and name not in UNITS:
        raise unknown_name("unit", name, UNITS, "--unit")

    outputs = Outputs(drawing)
    outputs.file(output, ".toml")
    outputs.file(plot, *FIGURE_TYPES)
    propose_probe(terminal, drawing, cell, name, outputs, output, plot)
