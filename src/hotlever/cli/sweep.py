"""``hotlever sweep``: a lever over a range of bias."""

from __future__ import annotations

from typer import Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import app
from hotlever.cli.options import (
    File,
    LeverOptions,
    TableOptions,
    parse_bias,
    with_groups,
)
from hotlever.tasks.files import Files
from hotlever.tasks.probes import make_lever


@app.command("sweep")
@with_groups
def sweep_command(
    options: LeverOptions,
    table: TableOptions,
    bias: str = Option("1:11:25", help="START:STOP:COUNT in volts, ends included."),
    model: str = Option(
        "flat",
        help="flat: the lever in its plane; full-3d: its true thickness and the air around it "
        "(minutes; goes on where it was stopped).",
    ),
    fields: File = Option(None, help="Write the fields at each bias as VTU to this folder."),
) -> None:
    """Solve a lever over a range of bias."""
    from hotlever.tasks.sweeping import sweep

    outputs = table.outputs(options.probe_file)
    outputs.folder(fields)
    probe = options.probe()
    biases = parse_bias(bias, probe.circuit)
    lever = make_lever(terminal, probe, model)
    sweep(terminal, lever, biases, outputs, Files(table.output, table.plot, fields))
