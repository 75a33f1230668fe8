"""The ``hotlever`` command: the application, and where each command is.

Commands are thin: parse, call the library, write, print. A command's module is imported when it is
called, and imports what it computes with when it computes, so that the command line answers at
once.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer
import typer.core

from hotlever import __version__
from hotlever.cli.output import give
from hotlever.errors import InputError, unknown_name

#: The module of each command, which registers itself on `app` when it is imported.
_MODULES = {
    "app": "browser",
    "cache": "cache",
    "calibrate": "estimate",
    "contact": "levers",
    "design": "design",
    "fit": "estimate",
    "join": "raman",
    "materials": "materials",
    "probe": "probe",
    "pulse": "levers",
    "raman": "raman",
    "raman-check": "raman",
    "reader": "levers",
    "reproduce": "reproduce",
    "spectrum": "levers",
    "sweep": "levers",
    "validate": "validate",
}


class Commands(typer.core.TyperGroup):
    """A command group that answers a typo with the nearest command, and reads options once."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command, or raise with the nearest name that exists."""
        command = super().get_command(ctx, cmd_name)
        if command is None:
            raise unknown_name("command", cmd_name, self.list_commands(ctx))
        return command

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command and its arguments; an option given twice would lose a value."""
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None and not isinstance(command, Commands):
            inner = command.context_class(command, info_name=name, parent=ctx)
            _, _, options = command.make_parser(inner).parse_args(list(rest))
            for option in options:
                if options.count(option) > 1 and not option.multiple:
                    raise InputError(f"{option.opts[-1]}: given twice, expected once")
        return name, command, rest


app = typer.Typer(
    name="hotlever",
    cls=Commands,
    help="How hot is the tip of a Joule-heated silicon cantilever probe, and how sure are we?",
    invoke_without_command=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback()
def root(
    version: bool = typer.Option(
        False, "--version", help="Print the version and exit.", is_eager=True
    ),
) -> None:
    if version:
        give(f"{__version__}\n")
        raise typer.Exit


def command_line(command: str = "") -> Any:
    """Return the command line with the command of some name, or with all where there is none."""
    for name in [command] if command in _MODULES else _MODULES:
        import_module(f"hotlever.cli.{_MODULES[name]}")
    return typer.main.get_command(app)
