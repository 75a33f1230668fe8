"""``hotlever reproduce``: the paper's results as one page."""

from __future__ import annotations

from pathlib import Path

from typer import Option

from hotlever.cli.commands import app
from hotlever.cli.output import give, progress_bars
from hotlever.files import Outputs


@app.command("reproduce")
def reproduce_command(
    output: Path = Option(
        Path("reproduce"), "-o", "--output", help="Folder for the page and its figures."
    ),
    quick: bool = Option(
        False,
        "--quick",
        help="Leave out what takes longest: k by geometry, the tip, the mesh; fewer levers.",
    ),
) -> None:
    """Compute the paper's tables and figures and put them on one page."""
    from hotlever.report.reproduce import reproduce_page

    outputs = Outputs()
    outputs.folder(output)
    with progress_bars("reproduce", "levers") as (update, within):
        page = reproduce_page(quick=quick, progress=update, within=within)
    with outputs.together():
        written = page.write(output)
    give(f"{written}\n")
