"""Many levers in parallel: what fits and calibrations of them have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hotlever.errors import ComputationError, InputError
from hotlever.estimation.batch import Batch
from hotlever.estimation.outcome import Result
from hotlever.files import Outputs, write_text
from hotlever.measurement import Measurement
from hotlever.tasks.measured_requests import LeversRequest
from hotlever.tasks.reporter import Reporter

if TYPE_CHECKING:
    from hotlever.report.page import Page


@dataclass(frozen=True)
class Summary:
    """What is told of the results of a batch together.

    Attributes
    ----------
    text : str
    page : callable
        Makes the report page.
    files : dict of str to str
        Texts by the names of files beside the results.
    """

    text: str
    page: Callable[[], Page]
    files: dict[str, str] = field(default_factory=dict)


def estimate_several(
    reporter: Reporter,
    request: LeversRequest,
    outputs: Outputs,
    results: str,
    table: str,
    make: Callable[..., Batch[Result]],
    summarise: Callable[[Batch[Result]], Summary],
) -> int:
    """Make a result of each of many measurements and compare them; return the exit status.

    The same again goes on where it was stopped.

    Parameters
    ----------
    reporter : Reporter
    request : LeversRequest
    outputs : Outputs
    results, table : str
        What the results are called, as their folder beside a page, and the table of all of them.
    make : callable
        Takes data files, a folder, and how they are worked on: see `estimate_many`.
    summarise : callable

    Raises
    ------
    InputError
        If nothing says where the results go.
    ComputationError
        If it is stopped.
    """
    data, output, report = request.data, request.output, request.report
    scheduler = request.scheduler
    if scheduler is not None and _is_open(scheduler):
        reporter.note(
            f"--scheduler {scheduler}: without TLS whoever reaches this address can have its "
            "workers run any code"
        )
    if output is None and report is None:
        raise InputError(
            f"{len(data)} data files: expected -o FOLDER or --report DIR to write their {results} "
            "to"
        )
    folder = output or Path(str(report), results)
    if output is None:
        outputs.folder(folder)
    if folder.is_dir():
        outputs.file(folder / table)
    done = 0
    with reporter.progress_bars("levers", "geometry") as (estimating, reducing):

        def update(count: int, total: int) -> None:
            nonlocal done
            done = count
            estimating(count, total)

        def read(measurement: Measurement) -> None:
            (name, *_, rows), *quantities = measurement.understood
            columns_read = "; ".join(f"{what} {value}" for what, value, _ in quantities)
            reporter.tell(f"{name}: {rows}; {columns_read}")
            reporter.note(*measurement.notes, *measurement.unused)

        where: Any = {"processes": request.processes, "scheduler": scheduler}
        bars: Any = {"reading": read, "reducing": reducing, "progress": update}
        try:
            batch = make(data, folder, columns=request.columns, **where, **bars)
        except KeyboardInterrupt:
            raise ComputationError(
                f"stopped by the user after {done} of {len(data)} files; the same command goes "
                "on from there"
            ) from None
    if batch.reused:
        count = len(batch.results) + len(batch.failures)
        reporter.note(
            f"{batch.reused} of {count} levers have their {results} from before, of the same data"
        )
    if batch.results:
        summary = summarise(batch)
        texts = [summary.text]
        with outputs.together():
            for name, text in summary.files.items():
                write_text(folder / name, text)
            if report is not None:
                texts.append(f"report: {summary.page().write(report)}")
        reporter.give("\n".join([*texts, ""]))
    for failure in (*map(str, batch.failures.values()), *batch.undescribed.values()):
        reporter.fail(failure)
    return batch.exit_status


def _is_open(address: str) -> bool:
    """Whether anybody on the network who finds a scheduler may use it, and its workers.

    Examples
    --------
    >>> [_is_open(one) for one in ("tcp://node7:8786", "tls://node7:8786", "tcp://127.0.0.1:8786")]
    [True, False, False]
    """
    scheme, _, rest = address.rpartition("://")
    host = rest.rpartition(":")[0].strip("[]")
    return scheme != "tls" and not (host in ("localhost", "::1") or host.startswith("127."))
