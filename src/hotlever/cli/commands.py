"""The ``hotlever`` command: a command line of the commands that there are.

A command is parsed, done and reported. What it computes with is imported when it is done, so that
the command line answers at once.
"""

from __future__ import annotations

from typing import Any

import typer
import typer.core

from hotlever import __version__
from hotlever.cli.browser import AppRequest
from hotlever.cli.options import add_command
from hotlever.cli.output import give
from hotlever.errors import InputError, unknown_name
from hotlever.tasks.commands import COMMANDS, Command

_EVERY = {**COMMANDS, "app": Command(AppRequest, "hotlever.cli.browser", "open_app")}
#: What the commands are for whose names have a word in common.
_GROUPS = {"probe": "Write, describe, draw and import probes."}


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


def root(
    version: bool = typer.Option(
        False, "--version", help="Print the version and exit.", is_eager=True
    ),
) -> None:
    if version:
        give(f"{__version__}\n")
        raise typer.Exit


def command_line(word: str = "") -> Any:
    """Return the command line with the commands that begin with a word, or all if none does."""
    app = typer.Typer(
        name="hotlever",
        cls=Commands,
        help="How hot is the tip of a Joule-heated silicon cantilever probe, and how sure are we?",
        invoke_without_command=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    app.callback()(root)
    groups = {"": app}
    asked = {name: command for name, command in _EVERY.items() if name.split()[0] == word}
    for name, command in (asked or _EVERY).items():
        group, _, last = name.rpartition(" ")
        if group not in groups:
            groups[group] = typer.Typer(cls=Commands, help=_GROUPS[group], rich_markup_mode=None)
            app.add_typer(groups[group], name=group)
        add_command(groups[group], last, command)
    return typer.main.get_command(app)
