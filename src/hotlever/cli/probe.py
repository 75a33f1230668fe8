"""``hotlever probe``: write, describe and draw probes."""

from __future__ import annotations

import typer
from typer import Option

from hotlever.cli.application import Commands, app
from hotlever.cli.options import File, PlotFile, ProbeFile, check_plot, load_probe
from hotlever.cli.output import give
from hotlever.errors import unknown_name
from hotlever.files import Outputs

probe_app = typer.Typer(
    cls=Commands, help="Write, describe and draw probes.", rich_markup_mode=None
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
def show(probe_file: ProbeFile = None, plot: PlotFile = None) -> None:
    """Draw and describe a probe."""
    from hotlever.materials.silicon import inversion_temperature
    from hotlever.probe import mesh_layout

    outputs = Outputs(probe_file)
    check_plot(outputs, plot)
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
        f"mesh: {mesh_layout(layout).elements.nelements} triangles",
    ]
    if plot is not None:
        from hotlever import figures

        with outputs.together():
            figures.save_figure(figures.probe_drawing(layout, name), plot)
    give("\n".join([*lines, ""]))
