"""``hotlever sweep``: a lever over a range of bias."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hotlever.cli.app import app, note, progress, stdout
from hotlever.cli.options import (
    MediumOption,
    ProbeFile,
    check_medium,
    check_output,
    load_probe,
    parse_bias,
    parse_settings,
)
from hotlever.errors import ComputationError
from hotlever.files import output_folder


@app.command()
def sweep(
    probe_file: ProbeFile = None,
    bias: Annotated[str, typer.Option(help="START:STOP:COUNT in volts, ends included.")] = (
        "1:11:25"
    ),
    medium: MediumOption = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a value of the probe file."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="FILE.csv or FILE.nc; standard output if left out."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the sweep to this file: .png, .svg or .pdf.")
    ] = None,
    fields: Annotated[
        Path | None, typer.Option(help="Write the fields at each bias as VTU to this folder.")
    ] = None,
) -> None:
    """Solve a lever over a range of bias."""
    from hotlever.lever import Lever, sweep_csv, write_sweep
    from hotlever.lever.air_fields import AirFields
    from hotlever.lever.fields import FieldMapper, write_vtu
    from hotlever.report.figures import sweep_overview
    from hotlever.report.style import FIGURE_TYPES, save_figure

    values = parse_bias(bias)
    check_medium(medium)
    check_output(output, ".csv", ".nc")
    check_output(plot, *FIGURE_TYPES)
    probe = load_probe(probe_file).with_values(parse_settings(settings or []))
    if medium is not None:
        probe = probe.in_medium(medium)
    with progress("air") as update:
        lever = Lever(probe, progress=update)

    failure: ComputationError | None = None
    with progress("sweep") as update:
        try:
            ramp = lever.solve(values, update)
        except ComputationError as error:
            ramp, failure = error.partial, error
    data = lever.dataset(ramp)
    for text in filter(None, data.attrs["notes"].split("\n")):
        note(text)
    if output is None:
        stdout.print(sweep_csv(data), end="", markup=False)
    else:
        write_sweep(data, output)
    if plot is not None:
        save_figure(sweep_overview(data), plot)
    if fields is not None:
        mapper = FieldMapper(lever)
        folder = output_folder(fields)
        for state in ramp.states:
            write_vtu(mapper.map(state.x), folder / f"bias_{state.bias:08.4f}V.vtu")
        if lever.medium == "air":
            air = AirFields(lever)
            for state in ramp.states:
                air.write_vtu(state.x, folder / f"bias_{state.bias:08.4f}V_air.vtu")
    if failure is not None:
        raise failure
