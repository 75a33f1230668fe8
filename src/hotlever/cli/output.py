"""What a command says: results to standard output, notes and progress to standard error.

Nothing heavy is imported above a bar of progress.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, cast

from hotlever.errors import HotleverError

if TYPE_CHECKING:
    from hotlever.types import Progress


def give(result: str = "") -> None:
    """Print a result, or what was printed before and waits to be written out."""
    try:
        if sys.stdout is not None:
            sys.stdout.write(result)
            sys.stdout.flush()
    except OSError as error:
        # Python would try again at its end
        sys.stdout = None
        if isinstance(error, BrokenPipeError):
            raise
        raise HotleverError(f"standard output: cannot be written ({error.strerror})") from error


class _StandardError:
    """Standard error as it is now; what cannot be told there is no reason to stop."""

    def __getattr__(self, name: str) -> Any:
        return getattr(sys.stderr, name)

    def write(self, text: str) -> int:
        """Write, if somebody reads."""
        try:
            if sys.stderr is not None:
                sys.stderr.write(text)
        except OSError:
            sys.stderr = None
        return len(text)

    def flush(self) -> None:
        """Flush, if somebody reads."""
        with suppress(OSError, AttributeError):
            sys.stderr.flush()


def tell(text: str) -> None:
    """Say something in one line on standard error."""
    _say(" ".join(_printable(text).split()))


def tell_table(rows: Sequence[Sequence[str]]) -> None:
    """Show rows of cells on standard error."""
    from hotlever.text import aligned

    for line in aligned([[_printable(cell) for cell in row] for row in rows]):
        _say(line)


def show(what: str, content: Any) -> None:
    """Leave out what a terminal cannot draw."""


def _say(line: str) -> None:
    print(line, file=cast(Any, _StandardError()), flush=True)


def _printable(text: str) -> str:
    """Leave out what would steer the terminal; files and their names may hold anything."""
    return "".join(char if char.isprintable() else " " for char in text)


def note(*texts: str) -> None:
    """Tell the user something beside the result."""
    for text in texts:
        tell(f"note: {text}")


def fail(message: str) -> None:
    """Say what went wrong, in a line that can be read whatever it quotes."""
    most = 1200
    if message:
        if len(message) > most:
            # what was found stands at the beginning, what is wrong with it at the end
            half = most // 2
            message = f"{message[:half]} … {message[-half:]}"
        tell(f"hotlever: {message}")


def _lines(label: str, first_s: float = 2.0, next_s: float = 10.0) -> Progress:
    """Return what tells progress in lines, seldom, and not at all of what takes little time.

    The first comes after `first_s` seconds, each of the next `next_s` seconds later.
    """
    due = time.monotonic() + first_s

    def update(done: int, total: int) -> None:
        nonlocal due
        if time.monotonic() >= due and done < total:
            tell(f"{label}: {done} of {total}")
            due = time.monotonic() + next_s

    return update


@contextmanager
def progress(label: str) -> Iterator[Progress]:
    """Show a progress bar on standard error while the block runs.

    The block gets a function to call with (steps done, steps in all); library functions
    that can take longer than two seconds accept it as their ``progress`` argument.
    """
    with progress_bars(label) as (update,):
        yield update


@contextmanager
def progress_bars(*labels: str) -> Iterator[tuple[Progress, ...]]:
    """Show several progress bars, each from its first call on; lines where there is no terminal."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield tuple(_lines(label) for label in labels)
        return
    from rich import progress as rich
    from rich.console import Console

    columns = (
        rich.TextColumn("{task.description}"),
        rich.BarColumn(),
        rich.MofNCompleteColumn(),
        rich.TimeElapsedColumn(),
    )
    console = Console(file=cast(Any, _StandardError()))
    with rich.Progress(*columns, console=console, transient=True) as bar:

        def updater(label: str, visible: bool) -> Progress:
            task = bar.add_task(label, total=None, visible=visible)
            return lambda done, total: bar.update(task, completed=done, total=total, visible=True)

        # the first is there at once, to show that work has begun
        yield tuple(updater(label, index == 0) for index, label in enumerate(labels))
