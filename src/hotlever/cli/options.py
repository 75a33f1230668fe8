"""How the command line takes a request: its fields are arguments and options of a command."""

from __future__ import annotations

from collections import deque
from dataclasses import MISSING, fields
from inspect import Parameter, Signature
from typing import Annotated, Any, get_type_hints

import typer
import typer.core
from typer import Argument, Option

from hotlever.cli import output as terminal
from hotlever.tasks.commands import Command

#: The option that takes all paths up to the next option.
_SPREAD = "--calibrate-from"


def add_command(commands: typer.Typer, name: str, command: Command) -> None:
    """Add a command of some name to others."""
    types = get_type_hints(command.request)
    parameters = []
    for field in fields(command.request):
        texts, names = field.metadata["texts"], field.metadata.get("names")
        stated = Argument(**texts) if names is None else Option(*names, **texts)
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
    commands.command(name, cls=_SpreadingCommand)(run)


class _SpreadingCommand(typer.core.TyperCommand):
    """A command whose ``--calibrate-from``, if it has one, takes all paths up to the next option.

    Where that would leave no spectra to measure, it takes the first path only, so that
    ``hotlever raman --calibrate-from hot-plate/ tip/`` means what it says.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each of its paths, then parse as usual."""
        options = [param for param in self.params if param.param_type_name == "option"]
        valued = [option for option in options if not getattr(option, "is_flag", False)]
        names = {name for option in valued for name in option.opts}
        if _SPREAD in names:
            args = spread_option(args, _SPREAD, names)
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
