"""``hotlever fit``: material parameters from measurements."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer
from typer import Argument, Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import app
from hotlever.cli.options import (
    ColumnOption,
    Drive,
    File,
    MeasuredMediumOption,
    PriorOption,
    check_number,
    column_files,
    with_groups,
)
from hotlever.errors import InputError
from hotlever.files import Outputs
from hotlever.tasks.probes import read_probe


@dataclass
class FitFiles:
    """What a fit reads and writes."""

    data: list[Path] = Argument(
        metavar="DATA.csv...", help="Measurement files, one for each lever."
    )
    probe_file: File = Option(None, "--probe", help="Probe file; the reference probe if left out.")
    column: ColumnOption = None
    output: File = Option(
        None, "-o", "--output", help="Fit file (JSON); a folder of them with several data files."
    )
    report: File = Option(None, help="Write a page with figures to this folder.")

    def outputs(self, *inputs: Path | None) -> Outputs:
        """Return where files are written to, none of which is read."""
        return Outputs(*self.data, self.probe_file, *column_files(self.column), *inputs)


@dataclass
class ModelOptions:
    """What is fitted, what is varied, and what is known of it."""

    observables: str | None = Option(
        None, help="Some of current,reader,tip; all that the file has if left out."
    )
    fix: list[str] | None = Option(None, metavar="NAME[=VALUE]", help="Hold a parameter.")
    free: str | None = Option(
        None,
        metavar="NAME[,...]",
        help="Vary more than is usual: any parameter of a material, as film.lorenz_ratio, or "
        "of the probe.",
    )
    robust: bool = Option(False, "--robust", help="Lessen the weight of points far off the others.")
    drift: bool = Option(
        False, "--drift", help="Let the zeros of I_h and V_r drift along the file."
    )
    weights: str = Option(
        "maximum", help="maximum: of each observable, as in the paper; or errors, as measured."
    )
    prior: PriorOption = None
    medium: MeasuredMediumOption = None


@dataclass
class UncertaintyOptions:
    """How sure a single fit is, beyond its standard errors."""

    posterior: bool = Option(
        False, "--posterior", help="Sample the posterior; predict the tip with its band."
    )
    samples: int = Option(10_000, metavar="N", help="Of the posterior, at least.")
    profiles: bool = Option(False, "--profiles", help="Profile the likelihood of each parameter.")
    processes: int | None = Option(
        None, metavar="N", help="Local processes; one for each processor if left out."
    )

    def examined(self) -> dict[str, Any]:
        """Return what `hotlever.estimation.uncertainty.examine` is asked."""
        samples = self.samples if self.posterior else None
        return {"samples": samples, "profiles": self.profiles, "processes": self.processes}


@app.command("fit")
@with_groups
def fit_command(
    files: FitFiles,
    drive: Drive,
    model: ModelOptions,
    uncertainty: UncertaintyOptions,
    scheduler: str | None = Option(
        None, metavar="ADDRESS", help="Dask scheduler for several data files, as tls://HOST:8786."
    ),
) -> None:
    """Find the material parameters that make the model match a measurement.

    Of what was measured in time, a file with a column as 'time (us)', the heat capacity, and what
    else is free; the wave form is the column V_b, or what is told.

    With several data files: of each lever, in parallel, and how the levers scatter. The same
    command again goes on where it was stopped.
    """
    from hotlever.measurement import parse_columns
    from hotlever.tasks.fitting import Destination, fit_one, fit_options, fit_several

    processes, several = uncertainty.processes, len(files.data) > 1
    check_number("--samples", uncertainty.samples, 1, 1_000_000)
    check_number("--processes", processes, 1, 256)
    if processes is not None and scheduler is not None:
        raise InputError("--processes and --scheduler: expected one of them, not both")
    if several and (uncertainty.posterior or uncertainty.profiles):
        raise InputError("--posterior and --profiles: expected a single data file")
    if several and drive.options:
        raise InputError(f"{next(iter(drive.options))}: expected a single data file")
    if not several and scheduler is not None:
        raise InputError("--scheduler: expected several data files")
    probe = read_probe(terminal, files.probe_file)
    options = fit_options(probe, **vars(model))
    columns = parse_columns(files.column or [])
    to = Destination(files.outputs(drive.waveform), files.output, files.report)
    if several:
        batch = fit_several(
            terminal,
            files.data,
            columns,
            probe,
            options,
            to,
            processes=processes,
            scheduler=scheduler,
        )
        raise typer.Exit(batch.exit_status)
    examined = uncertainty.examined()
    fit_one(terminal, files.data[0], columns, drive.read(), probe, options, examined, to)
