"""``hotlever sweep``: a lever over a range of bias."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hotlever.cli.app import app, note, progress, stdout
from hotlever.cli.options import (
    MediumOption,
    ProbeFile,
    check_choice,
    check_medium,
    check_output,
    load_probe,
    parse_bias,
    parse_settings,
)
from hotlever.errors import ComputationError
from hotlever.files import output_folder
from hotlever.probe import Probe

if TYPE_CHECKING:
    from hotlever.lever import Lever
    from hotlever.lever.lever import LeverState
    from hotlever.lever.state_store import StateStore
    from hotlever.lever3d import SolidLever

MODELS = ("flat", "full-3d")


@app.command()
def sweep(
    probe_file: ProbeFile = None,
    bias: Annotated[str, typer.Option(help="START:STOP:COUNT in volts, ends included.")] = (
        "1:11:25"
    ),
    medium: MediumOption = None,
    model: Annotated[
        str,
        typer.Option(
            help="flat: the lever in its plane; full-3d: its true thickness and the air around it "
            "(minutes; goes on where it was stopped)."
        ),
    ] = "flat",
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
    from hotlever.lever import sweep_csv, write_sweep
    from hotlever.report.figures import sweep_overview
    from hotlever.report.style import FIGURE_TYPES, save_figure

    values = parse_bias(bias)
    check_choice("--model", model, MODELS)
    check_medium(medium)
    check_output(output, ".csv", ".nc")
    check_output(plot, *FIGURE_TYPES)
    probe = load_probe(probe_file).with_values(parse_settings(settings or []))
    if medium is not None:
        probe = probe.in_medium(medium)
    lever, store, fields_writer = _made(probe, model)

    failure: ComputationError | None = None
    with progress("sweep") as update:
        try:
            ramp = lever.solve(values, update, store)
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
        write = fields_writer(output_folder(fields))
        for state in ramp.states:
            write(state)
    if failure is not None:
        raise failure


def _made(
    probe: Probe, model: str
) -> tuple[Lever, StateStore | None, Callable[[Path], Callable[[LeverState], None]]]:
    """Make the lever, the place to keep its states, and what writes fields to a folder."""
    if model == "full-3d":
        from hotlever.lever3d import SolidLever

        with progress("mesh and air"):
            solid = SolidLever(probe)
        return solid, solid.store(), lambda folder: _solid_writer(solid, folder)

    from hotlever.lever import Lever

    with progress("air") as update:
        flat = Lever(probe, progress=update)
    return flat, None, lambda folder: _flat_writer(flat, folder)


def _flat_writer(lever: Lever, folder: Path) -> Callable[[LeverState], None]:
    from hotlever.lever.air_fields import AirFields
    from hotlever.lever.fields import FieldMapper, write_vtu

    mapper = FieldMapper(lever)
    air = AirFields(lever) if lever.medium == "air" else None

    def write(state: LeverState) -> None:
        write_vtu(mapper.map(state.x), folder / f"{_name(state)}.vtu")
        if air is not None:
            air.write_vtu(state.x, folder / f"{_name(state)}_air.vtu")

    return write


def _solid_writer(lever: SolidLever, folder: Path) -> Callable[[LeverState], None]:
    from hotlever.lever3d.fields import write_solid_vtu
    from hotlever.report.air_figures import temperature_slices
    from hotlever.report.style import save_figure

    def write(state: LeverState) -> None:
        write_solid_vtu(lever, state.x, folder / f"{_name(state)}.vtu")
        if lever.medium == "air":
            save_figure(temperature_slices(lever, state.x), folder / f"{_name(state)}.png")

    return write


def _name(state: LeverState) -> str:
    return f"bias_{state.bias:08.4f}V"
