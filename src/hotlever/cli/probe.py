"""``hotlever probe``: write, describe and draw probes, and make them of drawings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer
from typer import Argument, Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import Commands, app
from hotlever.cli.options import File, PlotFile, ProbeFile, load_probe
from hotlever.cli.output import give
from hotlever.errors import unknown_name
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.files import draw

if TYPE_CHECKING:
    from hotlever.probe import Layout, Probe, ProbeMesh

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
        give(probe.to_toml())
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

    outputs = Outputs(probe_file)
    outputs.file(plot, *FIGURE_TYPES)
    try:
        probe = load_probe(probe_file)
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
    lines = _described(probe, triangles, name)
    with outputs.together():
        draw(
            plot,
            lambda figures: figures.probe_drawing(layout, name, mesh=triangles if mesh else None),
        )
    give("\n".join([*lines, ""]))


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


def _described(probe: Probe, mesh: ProbeMesh, name: str) -> list[str]:
    circuit, silicon, layout = probe.circuit, probe.heater_silicon, mesh.layout
    x, y = layout.tip
    values = {key: getattr(probe.shape, key) for key in probe.shape.description()}
    dimensions = [
        f"  {key:<22} {values[key]:>8{'g' if isinstance(values[key], float) else ''}}  {text}"
        for key, text in probe.shape.description().items()
        if isinstance(values[key], float | str)
    ]
    if probe.shape.shape == "drawing":
        dimensions += [f"  {text}" for text in _regions(layout)]
    return [
        f"{name}: {probe.shape.shape}, {layout.thickness_um:g} µm thick",
        *dimensions,
        f"  tip at ({x:g}, {y:g}) µm; terminals {', '.join(layout.terminal_names)}",
        f"circuit: series resistance {circuit.series_resistance_ohm:g} ohm, "
        f"base temperature {circuit.base_temperature_K:g} K",
        *(f"  {name}: {contact}" for name, contact in circuit.contacts.items()),
        *_materials(probe),
        *(
            []
            if silicon is None
            else [f"inversion temperature of the heater: {silicon.inversion_temperature():.1f} K"]
        ),
        f"mesh: {mesh.elements.nelements} triangles",
    ]


def _materials(probe: Probe) -> list[str]:
    """Return the values of what a probe is made of, a line for each material."""
    plain = {"material": probe.material} if probe.has_plain_silicon else {}
    lines = []
    for name, material in {**plain, **probe.materials}.items():
        values = [
            f"{key} {value:g}" if isinstance(value, float) else str(value)
            for key, value in material
            if value is not None and key != "preset"
        ]
        lines.append(f"{name}: {', '.join(values)}")
    return lines


def _regions(layout: Layout) -> list[str]:
    """Return what the regions of a drawing are."""
    from hotlever.probe.layout import Taper

    plain = {"high-doped", "low-doped"}
    lines = []
    for region in layout.regions:
        stack = [
            film.material + (f" {film.thickness_um:g} µm" if film.thickness_um else "")
            for film in region.stack
        ]
        kind = "high-doped" if plain.issuperset(stack) else " under ".join(stack)
        own = "low-doped" if plain.issuperset(stack) else f"{kind}, low-doped"
        if isinstance(region.taper, Taper):
            kind = f"{own} strip, {region.taper.length_um:.4g} µm from border to border"
        elif region.taper is not None:
            borders = len(region.taper.borders)
            kind = f"{own}, doping by the distance to {borders} border{'s' * (borders > 1)}"
        part = "insulates" if region.insulates else region.part
        lines.append(f"{region.name}: {part}, {region.area:.4g} µm², {kind}")
    return lines
