"""Pages that show how far the numbers hold: the paper's results, and other published ones."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from hotlever.files import FOLDER, check_outputs, write_text
from hotlever.tasks.arguments import Reporter, Written, refuse


def reproduce(
    reporter: Reporter,
    *,
    output: Annotated[Path, Written()] = Path("reproduce"),
    quick: bool = False,
) -> None:
    """Compute the paper's tables and figures and put them on one page.

    Parameters
    ----------
    output
        Folder for the page and its figures.
    quick
        Leave out what takes longest: k by geometry, the tip, the mesh; fewer levers.
    """
    from hotlever.report.reproduce import reproduce_page

    with reporter.progress("reproduce") as update:
        page = reproduce_page(quick=quick, progress=update)
    reporter.give(f"{page.write(output)}\n")


def validate(
    reporter: Reporter,
    case: Path | None = None,
    *,
    output: Annotated[Path | None, Written()] = None,
) -> None:
    """Predict published numbers of other levers and compare them, on one page and in a table.

    Parameters
    ----------
    case : [CASE.toml]
        A case of your own, whose prediction is printed.
    output
        Folder for the page and its table; validate if left out.
    """
    if case is not None:
        why = "goes without a case of your own, whose prediction is printed"
        refuse(why, output=output)
        _predict(reporter, case)
        return
    from hotlever.datasets import frame_text
    from hotlever.report.validation_pages import validation_page

    folder = output or Path("validate")
    if output is None:
        check_outputs([(folder, FOLDER)])
    with reporter.progress("validate") as update:
        page, compared = validation_page(update)
    written = page.write(folder)
    table = frame_text(compared.to_dataframe(), float_format="%.6g")
    write_text(folder / "validation.csv", table)
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
