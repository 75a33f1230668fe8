"""``hotlever validate``: published numbers of other levers, predicted and compared."""

from __future__ import annotations

from pathlib import Path

from typer import Argument, Option

from hotlever.cli.commands import app
from hotlever.cli.output import give, progress, progress_bars
from hotlever.files import Outputs, write_text


@app.command("validate")
def validate_command(
    case: Path | None = Argument(
        None, metavar="[CASE.toml]", help="A case of your own, whose prediction is printed."
    ),
    output: Path = Option(
        Path("validate"), "-o", "--output", help="Folder for the page and its table."
    ),
) -> None:
    """Predict published numbers of other levers and compare them, on one page and in a table."""
    if case is not None:
        _predict(case)
        return
    from hotlever.datasets import frame_text
    from hotlever.report.validation_pages import validation_page
    from hotlever.studies.validation.prediction import COLUMNS

    outputs = Outputs()
    outputs.folder(output)
    with progress_bars("validate", "draws") as (update, within):
        page, compared = validation_page(update, within)
    with outputs.together():
        written = page.write(output)
        table = compared.to_dataframe()[list(COLUMNS)]
        write_text(output / "validation.csv", frame_text(table, float_format="%.6g"))
    give(f"{written}\n")


def _predict(path: Path) -> None:
    from hotlever.studies.validation.case import Case
    from hotlever.studies.validation.prediction import predict

    case = Case.from_file(path)
    with progress("draws") as update:
        prediction = predict(case, update)
    give(prediction.toml())
    if case.published is not None:
        value, error = case.published.value, case.published.error
        give(f"# published {value:g} ± {error:g}: {prediction.verdict(value, error)}\n")
