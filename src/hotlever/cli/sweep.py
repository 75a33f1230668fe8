"""``hotlever sweep``: a lever over a range of bias."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from typer import Option

from hotlever.cli.application import app
from hotlever.cli.options import (
    DataOutput,
    File,
    MediumOption,
    ProbeFile,
    SettingsOption,
    SweepPlot,
    check_medium,
    check_plot,
    load_probe,
    make_lever,
    parse_bias,
)
from hotlever.cli.output import give, note, progress
from hotlever.errors import ComputationError, unknown_name
from hotlever.files import Outputs, output_folder

if TYPE_CHECKING:
    from hotlever.lever import Lever, State
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
    from hotlever.lever import sweep_csv, write_sweep

    if model not in MODELS:
        raise unknown_name("value", model, MODELS, "--model")
    check_medium(medium)
    outputs = Outputs(probe_file)
    outputs.file(output, ".csv", ".nc")
    check_plot(outputs, plot)
    outputs.folder(fields)
    probe = load_probe(probe_file, settings, medium)
    values = parse_bias(bias, probe.circuit)
    lever = _lever(probe, model)
    states: list[State] = []
    with progress("sweep") as update:
        data, failure = _reached(lambda: lever.sweep(values, progress=update))
        if failure is not None and not data.bias.size:
            raise failure
        if fields is not None:
            states, ended = _reached(lambda: lever.solve(data.bias_V.values, update))
            failure = failure or ended
    note(*filter(None, data.attrs["notes"].split("\n")))
    with outputs.together():
        if output is not None:
            write_sweep(data, output)
        if plot is not None:
            from hotlever import figures

            figures.save_figure(figures.sweep_overview(data), plot)
        if fields is not None:
            _write_fields(lever, states, output_folder(fields))
    if output is None:
        give(sweep_csv(data))
    if failure is not None:
        raise failure


def _reached(work: Callable[[], Any]) -> tuple[Any, ComputationError | None]:
    """Return what a computation gives; if it fails, what it reached, and the failure."""
    try:
        return work(), None
    except ComputationError as error:
        if error.partial is None:
            raise
        return error.partial, error


def _lever(probe: Probe, model: str) -> Lever:
    if model == "full-3d":
        from hotlever.lever3d import SolidLever

        with progress("mesh and air"):
            return SolidLever(probe)

    return make_lever(probe)


def _write_fields(lever: Lever, states: list[State], folder: Path) -> None:
    """Write the fields of states to a folder, those of the air too where there is some."""
    from hotlever.lever3d import SolidLever

    def name(state: State, suffix: str) -> Path:
        return folder / f"bias_{state.bias_V:08.4f}V{suffix}"

    if isinstance(lever, SolidLever):
        from hotlever import figures
        from hotlever.lever3d.fields import temperature_slices, write_solid_vtu

        for state in states:
            write_solid_vtu(state, name(state, ".vtu"))
            if lever.medium == "air":
                slices = figures.temperature_slices(temperature_slices(state))
                figures.save_figure(slices, name(state, ".png"))
        return

    from hotlever.lever.air_fields import AirFields
    from hotlever.lever.fields import FieldMapper, write_vtu

    mapper, air = FieldMapper(lever), AirFields(lever) if lever.medium == "air" else None
    for state in states:
        write_vtu(mapper.map(state), name(state, ".vtu"))
        if air is not None:
            air.write_vtu(state, name(state, "_air.vtu"))
