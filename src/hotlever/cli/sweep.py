"""``hotlever sweep``: a lever over a range of bias."""

from __future__ import annotations

from typing import TYPE_CHECKING

from typer import Option

from hotlever.cli import output as terminal
from hotlever.cli.application import app
from hotlever.cli.options import (
    DataOutput,
    File,
    MediumOption,
    ProbeFile,
    SettingsOption,
    SweepPlot,
    check_medium,
    load_probe,
    make_lever,
    parse_bias,
)
from hotlever.errors import unknown_name
from hotlever.files import Outputs

if TYPE_CHECKING:
    from hotlever.lever import Lever
    from hotlever.probe import Probe

MODELS = ("flat", "full-3d")


@app.command("sweep")
def sweep_command(
    probe_file: ProbeFile = None,
    bias: str = Option("1:11:25", help="START:STOP:COUNT in volts, ends included."),
    medium: MediumOption = None,
    model: str = Option(
        "flat",
        help="flat: the lever in its plane; full-3d: its true thickness and the air around it "
        "(minutes; goes on where it was stopped).",
    ),
    settings: SettingsOption = None,
    output: DataOutput = None,
    plot: SweepPlot = None,
    fields: File = Option(None, help="Write the fields at each bias as VTU to this folder."),
) -> None:
    """Solve a lever over a range of bias."""
    from hotlever.tasks.simulating import Files, sweep

    if model not in MODELS:
        raise unknown_name("value", model, MODELS, "--model")
    check_medium(medium)
    outputs = Outputs(probe_file)
    files = Files(output, plot, fields).checked(outputs)
    probe = load_probe(probe_file, settings, medium)
    values = parse_bias(bias, probe.circuit)
    sweep(terminal, _lever(probe, model), values, outputs, files)


def _lever(probe: Probe, model: str) -> Lever:
    if model == "full-3d":
        from hotlever.lever3d import SolidLever

        with terminal.progress("mesh and air"):
            return SolidLever(probe)

    return make_lever(probe)
