"""``hotlever probe``: write, describe and draw probes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hotlever.cli.app import Commands, app, stdout
from hotlever.cli.options import ProbeFile, check_output, load_probe
from hotlever.errors import unknown_name
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import Probe, mesh_layout

probe_app = typer.Typer(
    cls=Commands, help="Write, describe and draw probes.", rich_markup_mode=None
)
app.add_typer(probe_app, name="probe")

_NEW = {"three-leg": Probe.reference, "u-shape": Probe.u_shape}


@probe_app.command()
def new(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="File; standard output if left out.")
    ] = None,
    shape: Annotated[str, typer.Option(help=f"One of: {', '.join(_NEW)}.")] = "three-leg",
) -> None:
    """Write the reference probe as a commented file."""
    if shape not in _NEW:
        raise unknown_name("shape", shape, _NEW)
    probe = _NEW[shape]()
    if output is None:
        stdout.print(probe.to_toml(), end="", markup=False)
    else:
        probe.to_file(output)


@probe_app.command()
def show(
    probe_file: ProbeFile = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw to this file: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Draw and describe a probe."""
    from hotlever.report.figures import probe_drawing
    from hotlever.report.style import FIGURE_TYPES, save_figure

    check_output(plot, *FIGURE_TYPES)
    probe = load_probe(probe_file)
    layout = probe.layout()
    name = "reference probe" if probe_file is None else probe_file.name
    circuit, material = probe.circuit, probe.material
    x, y = layout.tip
    dimensions = [
        f"  {key:<22} {getattr(probe.shape, key):>8g}  {text}"
        for key, text in probe.shape.description().items()
        if getattr(probe.shape, key) is not None
    ]
    lines = [
        f"{name}: {probe.shape.shape}, {layout.thickness_um:g} µm thick",
        *dimensions,
        f"  tip at ({x:g}, {y:g}) µm; terminals {', '.join(t.name for t in layout.terminals)}",
        f"circuit: series resistance {circuit.series_resistance_ohm:g} ohm, "
        f"base temperature {circuit.base_temperature_K:g} K",
        "material: " + ", ".join(f"{key} {value:g}" for key, value in material),
        "inversion temperature of the heater: "
        f"{inversion_temperature(material.n_d, material.p):.1f} K",
        f"mesh: {mesh_layout(layout).triangles.nelements} triangles",
    ]
    stdout.print("\n".join(lines), markup=False)
    if plot is not None:
        save_figure(probe_drawing(layout, name), plot)
