"""Pages that show how far the numbers hold: the paper's results, and other levers' published ones.

What computes is imported when it is needed, since the requests stand here too.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hotlever.files import write_text
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import FOLDER, File, Request, argument, option, written


@dataclass(kw_only=True)
class ReproduceRequest(Request):
    """Compute the paper's tables and figures and put them on one page."""

    output: Path = written(
        FOLDER,
        *("-o", "--output"),
        default=Path("reproduce"),
        help="Folder for the page and its figures.",
    )
    quick: bool = option(
        False,
        "--quick",
        help="Leave out what takes longest: k by geometry, the tip, the mesh; fewer levers.",
    )


@dataclass(kw_only=True)
class ValidateRequest(Request):
    """Predict published numbers of other levers and compare them, on one page and in a table."""

    case: File = argument(
        None, metavar="[CASE.toml]", help="A case of your own, whose prediction is printed."
    )
    output: Path = written(
        FOLDER,
        *("-o", "--output"),
        default=Path("validate"),
        help="Folder for the page and its table.",
    )


def reproduce(reporter: Reporter, request: ReproduceRequest) -> None:
    """Write the page of the paper's results."""
    from hotlever.report.reproduce import reproduce_page

    request.check_outputs()
    with reporter.progress_bars("reproduce", "levers") as (update, within):
        page = reproduce_page(quick=request.quick, progress=update, within=within)
    written = page.write(request.output)
    reporter.give(f"{written}\n")


def validate(reporter: Reporter, request: ValidateRequest) -> None:
    """Write the page and the table of published numbers, or predict those of one case."""
    if request.case is not None:
        request.refuse("output", why="goes without a case of your own, whose prediction is printed")
        _predict(reporter, request.case)
        return
    from hotlever.datasets import frame_text
    from hotlever.report.validation_pages import validation_page

    request.check_outputs()
    with reporter.progress("validate") as update:
        page, compared = validation_page(update)
    written = page.write(request.output)
    table = frame_text(compared.to_dataframe(), float_format="%.6g")
    write_text(request.output / "validation.csv", table)
    reporter.give(f"{written}\n")


def _predict(reporter: Reporter, path: Path) -> None:
    from hotlever.studies.validation.case import Case
    from hotlever.studies.validation.prediction import predict

    case = Case.from_file(path)
    with reporter.progress("draws") as update:
        prediction = predict(case, update)
    text = prediction.toml()
    if case.published is not None:
        value, error = case.published.value, case.published.error
        text += f"# published {value:g} ± {error:g}: {prediction.verdict(value, error)}\n"
    reporter.give(text)
