"""``hotlever fit`` and ``hotlever calibrate``: what measurements tell of a lever."""

from __future__ import annotations

import typer

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.tasks.measured_requests import CalibrateRequest, FitRequest


@command("fit", FitRequest)
def fit_command(request: FitRequest) -> None:
    """Find the material parameters that make the model match a measurement.

    Of what was measured in time, a file with a column as 'time (us)', the heat capacity, and what
    else is free; the wave form is the column V_b, or what is told.

    With several data files: of each lever, in parallel, and how the levers scatter. The same
    command again goes on where it was stopped.
    """
    from hotlever.tasks.fitting import fit_files

    raise typer.Exit(fit_files(terminal, request))


@command("calibrate", CalibrateRequest)
def calibrate_command(request: CalibrateRequest) -> None:
    """Find the tip temperature of a lever from its I-V curve, with its error.

    With several data files: of each lever, in parallel, and where the levers differ. The same
    command again goes on where it was stopped.
    """
    from hotlever.tasks.calibrating import calibrate_files

    raise typer.Exit(calibrate_files(terminal, request))
