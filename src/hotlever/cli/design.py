"""``hotlever design``: what a change of dimensions, doping or annealing does."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hotlever.cli.app import app, progress, stdout
from hotlever.cli.options import ProbeFile, check_output, load_probe
from hotlever.errors import InputError
from hotlever.files import write_text
from hotlever.materials.diffusion import ANNEALING_K, ANNEALING_S


@app.command()
def design(
    probe_file: ProbeFile = None,
    vary: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=START:STOP:COUNT",
            help="Sweep a key of the probe file, annealing_K or annealing_min; "
            "a table of sensitivities if left out.",
        ),
    ] = None,
    power: Annotated[
        float, typer.Option(help="Power (mW) in vacuum at which the tip temperature is given.")
    ] = 2.0,
    annealing_K: Annotated[
        float, typer.Option("--annealing-K", help="Annealing (K) that the probe's delta is of.")
    ] = ANNEALING_K,
    annealing_min: Annotated[
        float, typer.Option("--annealing-min", help="Annealing (min) that the delta is of.")
    ] = ANNEALING_S / 60.0,
    air: Annotated[bool, typer.Option(help="Solve in air too, for k.")] = True,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="FILE.csv; standard output if left out.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the sweep to this file: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Show how knee, tip temperature and loss to air depend on a probe's design."""
    from hotlever.calibration.design import Design, parse_range, sensitivities
    from hotlever.calibration.design import vary as sweep_design
    from hotlever.report.design_report import design_csv, design_figure, sensitivity_text
    from hotlever.report.style import FIGURE_TYPES, save_figure

    check_output(output, ".csv")
    check_output(plot, *FIGURE_TYPES)
    if not power > 0:
        raise InputError(f"--power {power:g}: expected a positive power (mW)")
    if vary is None and (plot is not None or output is not None):
        raise InputError("a file or a figure needs a sweep: --vary NAME=START:STOP:COUNT")
    start = Design(load_probe(probe_file), annealing_K, annealing_min)
    if vary is None:
        with progress("design") as update:
            base, slopes = sensitivities(start, power_mW=power, air=air, progress=update)
        stdout.print(sensitivity_text(start, base, slopes, power), markup=False)
        return
    name, values = parse_range(vary)
    start.value(name)
    with progress("design") as update:
        data = sweep_design(start, name, values, power_mW=power, air=air, progress=update)
    if output is None:
        stdout.print(design_csv(data), end="", markup=False)
    else:
        write_text(output, design_csv(data))
    if plot is not None:
        save_figure(design_figure(data), plot)
