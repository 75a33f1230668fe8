"""The ``hotlever`` command: the application object and what every command shares.

Each command lives in a module of its own beside this one and registers itself on `app`.
Commands are thin: parse, call the library, print. Progress goes to standard error, results
to standard output or the named file.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer
import typer.core
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hotlever import __version__
from hotlever.errors import HotleverError, unknown_name


class Commands(typer.core.TyperGroup):
    """A command group that answers a typo with the nearest command."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command, or raise with the nearest name that exists."""
        command = super().get_command(ctx, cmd_name)
        if command is None:
            raise unknown_name("command", cmd_name, self.list_commands(ctx))
        return command


app = typer.Typer(
    name="hotlever",
    cls=Commands,
    help="How hot is the tip of a Joule-heated silicon cantilever probe, and how sure are we?",
    invoke_without_command=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

stderr = Console(stderr=True, highlight=False, soft_wrap=True)
stdout = Console(highlight=False, soft_wrap=True)


def note(text: str) -> None:
    """Tell the user something beside the result, on standard error."""
    stderr.print(f"note: {text}", markup=False)


Update = Callable[[int, int], None]


@contextmanager
def progress(label: str) -> Iterator[Update]:
    """Show a progress bar on standard error while the block runs.

    The block gets a function to call with (steps done, steps in all); library functions
    that can take longer than two seconds accept it as their ``progress`` argument.
    """
    with progress_bars(label) as (update,):
        yield update


@contextmanager
def progress_bars(*labels: str) -> Iterator[tuple[Update, ...]]:
    """Show several progress bars, each from its first call on."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=stderr, transient=True) as bar:

        def updater(label: str, visible: bool) -> Update:
            task = bar.add_task(label, total=None, visible=visible)
            return lambda done, total: bar.update(task, completed=done, total=total, visible=True)

        # the first is there at once, to show that work has begun
        yield tuple(updater(label, place == 0) for place, label in enumerate(labels))


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)
    ] = False,
) -> None:
    if version:
        stdout.print(__version__)
        raise typer.Exit


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exit status 0 done, 1 not finished, 2 the input is at fault."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        status = app(arguments or ["--help"], standalone_mode=False)
    except typer.TyperException as error:
        _exit(error.format_message(), error.exit_code)
    except typer.Abort:
        _exit("stopped by the user", 1)
    except HotleverError as error:
        _exit(str(error), error.exit_status)
    except KeyboardInterrupt:
        _exit("stopped by the user", 1)
    except BrokenPipeError:
        # the reader of our standard output has gone (`| head`): nothing left to say to it
        sys.stderr.close()
        sys.exit(1)
    sys.exit(status if isinstance(status, int) else 0)


def fail(message: str) -> None:
    """Say in one line on standard error what went wrong."""
    one_line = " ".join(message.split())
    if one_line:
        stderr.print(f"hotlever: {one_line}", markup=False)


def _exit(message: str, status: int) -> None:
    fail(message)
    sys.exit(status)
