"""The ``hotlever`` command: a command line of the commands that there are.

The fields of a request are arguments and options of its command, which is parsed, done and
reported. What it computes with is imported when it is done, so that the command line answers at
once.
"""

from __future__ import annotations

from collections import deque
from dataclasses import MISSING, fields
from inspect import Parameter, Signature
from typing import Annotated, Any, get_type_hints

import typer
import typer.core

from hotlever import __version__
from hotlever.cli import output as terminal
from hotlever.cli.browser import AppRequest
from hotlever.errors import InputError, unknown_name
from hotlever.tasks.commands import COMMANDS, Command

_EVERY = {**COMMANDS, "app": Command(AppRequest, "hotlever.cli.browser", "open_app")}
#: What the commands are for whose names have a word in common.
_GROUPS = {"probe": "Write, describe, draw and import probes."}
#: Commands and options of version 2 that are gone, and what there is in their place.
_AT_REST = "no controller is followed in time; hotlever sweep --hold-resistance finds its states"
_GONE = {
    "raman-check": "the check of the paper's linear law is a section of hotlever reproduce",
    "fit --drift": "correct the zeros of the file; a note says where one seems to drift",
    **{
        f"pulse --{name}": _AT_REST
        for name in ("controller", "hold-resistance", "filter", "limit", "gain-map")
    },
}
#: The option that takes all paths up to the next option.
_SPREAD = "--calibrate-from"


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
    commands = {name: command for name, command in _EVERY.items() if name.split()[0] == word}
    for name, command in (commands or _EVERY).items():
        group, _, last = name.rpartition(" ")
        if group not in groups:
            groups[group] = typer.Typer(cls=Commands, help=_GROUPS[group], rich_markup_mode=None)
            app.add_typer(groups[group], name=group)
        add_command(groups[group], last, command)
    return typer.main.get_command(app)


def check_gone(words: str) -> None:
    """Refuse a command, or an option after its command, that is gone."""
    if words in _GONE:
        raise InputError(f"{words}: gone since version 3.0; {_GONE[words]}")


class Commands(typer.core.TyperGroup):
    """A command group that answers a typo with the nearest command."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command, or raise with the nearest name that exists."""
        check_gone(cmd_name)
        command = super().get_command(ctx, cmd_name)
        if command is None:
            raise unknown_name("command", cmd_name, self.list_commands(ctx))
        return command


def root(
    version: bool = typer.Option(
        False, "--version", help="Print the version and exit.", is_eager=True
    ),
) -> None:
    if version:
        terminal.give(f"{__version__}\n")
        raise typer.Exit


def add_command(commands: typer.Typer, name: str, command: Command) -> None:
    """Add a command of some name to others."""
    types = get_type_hints(command.request)
    parameters = []
    for field in fields(command.request):
        texts, names = field.metadata["texts"], field.metadata.get("names")
        stated = typer.Argument(**texts) if names is None else typer.Option(*names, **texts)
        default = Parameter.empty if field.default is MISSING else field.default
        kind: Any = Annotated[types[field.name], stated]
        parameters.append(
            Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        )

    def run(**values: Any) -> None:
        raise typer.Exit(command.do(terminal, command.request(**values)))

    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__doc__ = command.request.__doc__
    commands.command(name, cls=_Command)(run)


class _Command(typer.core.TyperCommand):
    """A command none of whose options may be given twice, which would lose a value.

    Its ``--calibrate-from``, if it has one, takes all paths up to the next option. Where that would
    leave no spectra to measure, it takes the first path only, so that ``hotlever raman
    --calibrate-from hot-plate/ tip/`` means what it says.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each of its paths, then parse as usual."""
        for word in args:
            check_gone(f"{self.name} {word.partition('=')[0]}")
        options = [param for param in self.params if param.param_type_name == "option"]
        valued = [option for option in options if not getattr(option, "is_flag", False)]
        names = {name for option in valued for name in option.opts}
        if _SPREAD in names:
            args = spread_option(args, _SPREAD, names)
        _, _, param_order = self.make_parser(ctx).parse_args(list(args))
        for option in param_order:
            if param_order.count(option) > 1 and not option.multiple:
                raise InputError(f"{option.opts[-1]}: given twice, expected once")
        return super().parse_args(ctx, args)


def spread_option(args: list[str], option: str, takes_value: set[str]) -> list[str]:
    """Turn ``--option a b`` into ``--option a --option b``.

    Examples
    --------
    >>> spread_option(["x", "--from", "a", "b", "-o", "c"], "--from", {"--from", "-o"})
    ['x', '--from', 'a', '--from', 'b', '-o', 'c']
    >>> spread_option(["--from", "a", "b"], "--from", {"--from"})
    ['--from', 'a', 'b']
    """
    # each option with its values, and each other word by itself
    parts: list[list[str]] = []
    words = deque(args)
    while words:
        word = words.popleft()
        name, equals, value = word.partition("=")
        part = [word]
        if name == option:
            part = [option, value] if equals else [option]
            while words and not words[0].startswith("-"):
                part.append(words.popleft())
        elif word.startswith("-") and word in takes_value and words:
            part.append(words.popleft())
        parts.append(part)
    groups = [part for part in parts if part[0] == option and len(part) > 1]
    if groups and all(part[0].startswith("-") for part in parts):
        # nothing is left to measure: what follows the first path of the last group
        last = groups[-1]
        parts.insert(parts.index(last) + 1, last[2:])
        del last[2:]
    out: list[str] = []
    for part in parts:
        if part in groups:
            out += [word for value in part[1:] for word in (option, value)]
        else:
            out += part
    return out
