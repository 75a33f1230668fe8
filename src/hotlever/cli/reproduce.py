"""``hotlever reproduce``: the paper's results as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hotlever.cli.app import app, progress, stdout


@app.command()
def reproduce(
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for the page and its figures.")
    ] = Path("reproduce"),
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Leave out what takes longest: k by geometry, the tip, the mesh."
        ),
    ] = False,
) -> None:
    """Compute the paper's tables and figures and put them on one page."""
    from hotlever.report.reproduce import reproduce_page

    with progress("reproduce") as update:
        page = reproduce_page(quick=quick, progress=update)
    stdout.print(f"{page.write(output)}", markup=False)
