"""The commands, and the command line made of them.

A command is a function of who hears it (`hotlever.tasks.arguments.Reporter`), of its arguments,
and of its options, which are told by name. Their types say what the command line takes, and the
docstring is the help: above all of the command, and below of each parameter, with what stands for
its value in place of a type. A parameter that is a dataclass stands for its fields. A command
returns an exit status, or nothing. What it computes with is imported when it is called, so that the
command line answers at once.
"""

from __future__ import annotations

import inspect
import re
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
import typer.core
from typer.models import ParameterInfo

from hotlever import __version__
from hotlever.errors import InputError, unknown_name
from hotlever.files import check_outputs
from hotlever.tasks.arguments import Reporter, Written
from hotlever.tasks.describing import (
    list_materials,
    new_probe,
    propose_probe,
    show_cache,
    show_probe,
)
from hotlever.tasks.estimating import calibrate_files, fit_files, propose
from hotlever.tasks.measuring import measure_lever
from hotlever.tasks.solving import respond, simulate_in_time, sweep
from hotlever.tasks.spectra import join_spectra, measure_spectra
from hotlever.tasks.studying import reproduce, validate, vary_design
from hotlever.tasks.surfaces import approach, touch

Command = Callable[..., int | None]

#: By name, in the order in which the help lists them.
#:
#: :meta hide-value:
COMMANDS: dict[str, Command] = {
    "probe new": new_probe,
    "probe show": show_probe,
    "probe import": propose_probe,
    "materials": list_materials,
    "sweep": sweep,
    "pulse": simulate_in_time,
    "contact": touch,
    "reader": approach,
    "spectrum": respond,
    "design": vary_design,
    "measure": measure_lever,
    "raman": measure_spectra,
    "join": join_spectra,
    "fit": fit_files,
    "calibrate": calibrate_files,
    "next": propose,
    "reproduce": reproduce,
    "validate": validate,
    "cache": show_cache,
}


def run_command(
    words: Sequence[str], reporter: Reporter, commands: Mapping[str, Command] | None = None
) -> int:
    """Do what a command line says, of which the words follow ``hotlever``; return the exit status.

    Raises
    ------
    InputError
        If a word is no command, option or value.
    HotleverError
        As the command does.
    """

    def call(command: Command, values: dict[str, Any]) -> int:
        check_files(command, values)
        return command(reporter, **_grouped(command, values)) or 0

    return _parsed(words, call, reporter, commands or COMMANDS)


def arguments_of(words: Sequence[str]) -> dict[str, Any]:
    """Return what the command of a command line is called with, those left out too, by name.

    Raises
    ------
    InputError
        If a word is no command, option or value.
    """
    arguments = dict[str, Any]()

    def keep(_: Command, values: dict[str, Any]) -> int:
        arguments.update(values)
        return 0

    _parsed(words, keep, None, COMMANDS)
    return arguments


def parameters_of(command: Command) -> dict[str, inspect.Parameter]:
    """Return what a command is told, by name, as typer takes it: of a group each of its options."""
    told = dict[str, inspect.Parameter]()
    _, of_command = _documentation(command)
    _, *parameters = inspect.signature(command, eval_str=True).parameters.values()
    for parameter in parameters:
        group: Any = parameter.annotation
        if is_dataclass(parameter.annotation):
            types = get_type_hints(group, include_extras=True)
            own = [
                each.replace(annotation=types[each.name], kind=inspect.Parameter.KEYWORD_ONLY)
                for each in inspect.signature(group).parameters.values()
            ]
            # options of a group may be those of another one, and some more
            documented = dict[str, tuple[str, str]]()
            for base in reversed(inspect.getmro(group)):
                documented |= _documentation(base)[1]
        else:
            own, documented = [parameter], of_command
        told |= {each.name: _option(each, *documented.get(each.name, ("", ""))) for each in own}
    return told


def _documentation(documented: Any) -> tuple[str, dict[str, tuple[str, str]]]:
    """Return the help in a docstring: of all, and by parameter or attribute its value and help."""
    text = inspect.cleandoc(documented.__doc__ or "")
    help_text, *entries = re.split(r"\n\n(?:Parameters|Attributes)\n-+\n", text)
    entry = re.compile(r"^(\w+)(?: : (.+))?\n((?: {4}.+(?:\n|\Z))+)", re.MULTILINE)
    found = entry.findall("".join(entries))
    return help_text, {name: (value, " ".join(words.split())) for name, value, words in found}


def _option(parameter: inspect.Parameter, value: str, words: str) -> inspect.Parameter:
    """Return a parameter as typer takes it: an option if it is told by its name alone."""
    kind: Any = parameter.annotation
    kind, *marks = get_args(kind) if get_origin(kind) is Annotated else [kind]
    name, by_name = parameter.name, inspect.Parameter.KEYWORD_ONLY
    info: Any = copy(next((mark for mark in marks if isinstance(mark, ParameterInfo)), None))
    if info is None:
        flags = [*["-o"] * (name == "output"), f"--{name.replace('_', '-')}"]
        if parameter.kind is not by_name:
            info = typer.Argument()
        else:
            # what is on unless it is switched off has two names, which typer finds
            info = typer.Option(*flags if parameter.default is not True else ())
    if words:
        info.metavar, info.help = value or None, words
    others = [mark for mark in marks if not isinstance(mark, ParameterInfo)]
    return parameter.replace(kind=by_name, annotation=Annotated[kind, info, *others])


def _grouped(command: Command, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of options as a command takes them: those of a group as one."""
    alone, groups = dict(values), dict[str, Any]()
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        group: Any = parameter.annotation
        if is_dataclass(parameter.annotation):
            own = {field.name: alone.pop(field.name) for field in fields(group)}
            groups[parameter.name] = group(**own)
    return alone | groups


def written_by(command: Command) -> dict[str, Written]:
    """Return what a command writes, by the parameters that name it."""
    return {
        name: mark
        for name, parameter in parameters_of(command).items()
        for mark in get_args(parameter.annotation)
        if isinstance(mark, Written)
    }


def defaults_of(command: Command) -> dict[str, str]:
    """Return what options of a command are if left out, where that is a text, by their names."""
    parameters = parameters_of(command).items()
    return {name: own.default for name, own in parameters if isinstance(own.default, str)}


def check_files(command: Command, values: Mapping[str, Any]) -> None:
    """Check the files and folders that a command writes, none of which it reads.

    Raises
    ------
    InputError
        As `hotlever.files.check_outputs`.
    """
    written = written_by(command)
    told = [value for name, value in values.items() if name not in written]
    each = (value if isinstance(value, list) else [value] for value in told)
    # whatever else is the name of a file may be read
    read = [text for texts in each for text in texts if isinstance(text, str | Path)]
    outputs = [
        (values[name], mark.types if mark.types_of is None else mark.types_of(values))
        for name, mark in written.items()
    ]
    check_outputs(outputs, read)


# --- the command line ---------------------------------------------------------------------------

Call = Callable[[Command, dict[str, Any]], int]


def _parsed(
    words: Sequence[str], call: Call, reporter: Reporter | None, commands: Mapping[str, Command]
) -> int:
    """Parse words and call the command that they name; return the exit status."""
    try:
        line = command_line(call, commands, words[0], reporter)
        with line.make_context("hotlever", list(words)) as context:
            line.invoke(context)
    except typer.Exit as ended:
        return ended.exit_code
    except typer.TyperException as error:
        raise InputError(error.format_message()) from None
    return 0


def command_line(
    call: Call,
    commands: Mapping[str, Command] | None = None,
    word: str = "",
    reporter: Reporter | None = None,
) -> Any:
    """Return the command line with the commands that begin with a word, or all if none does.

    Parameters
    ----------
    call : callable
        Takes a command and the values of its parameters by name; returns the exit status.
    commands : mapping of str to callable, optional
        By name; `COMMANDS` if left out.
    word : str
    reporter : Reporter, optional
        Given the version, if that is asked for.
    """

    def root(
        version: Annotated[
            bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)
        ] = False,
    ) -> None:
        if version and reporter is not None:
            reporter.give(f"{__version__}\n")
            raise typer.Exit

    app = typer.Typer(
        name="hotlever",
        cls=_Commands,
        help="How hot is the tip of a Joule-heated silicon cantilever probe, and how sure are we?",
        invoke_without_command=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    app.callback()(root)
    groups = {"": app}
    there = commands or COMMANDS
    chosen = {name: command for name, command in there.items() if name.split()[0] == word}
    for name, command in (chosen or there).items():
        group, _, last = name.rpartition(" ")
        if group not in groups:
            words = {"probe": "Write, describe, draw and import probes."}[group]
            groups[group] = typer.Typer(cls=_Commands, help=words, rich_markup_mode=None)
            app.add_typer(groups[group], name=group)
        groups[group].command(last, cls=_OneCommand)(_called(command, call))
    return typer.main.get_command(app)


def _called(command: Command, call: Call) -> Callable[..., None]:
    """Return what typer calls in place of a command: it is not told of the reporter."""

    @wraps(command)
    def run(**values: Any) -> None:
        raise typer.Exit(call(command, values))

    parameters = list(parameters_of(command).values())
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__doc__ = _documentation(command)[0]
    return run


def _check_gone(words: str) -> None:
    """Refuse a command, or an option after its command, that version 2 had and that is gone."""
    at_rest = "no controller is followed in time; hotlever sweep --hold-resistance finds its states"
    instead = {
        "raman-check": "the check of the paper's linear law is a section of hotlever reproduce",
        "fit --drift": "correct the zeros of the file; a note says where one seems to drift",
        **{
            f"pulse --{name}": at_rest
            for name in ("controller", "hold-resistance", "filter", "limit", "gain-map")
        },
    }
    if words in instead:
        raise InputError(f"{words}: gone since version 3.0; {instead[words]}")


class _Commands(typer.core.TyperGroup):
    """A command group that answers a typo with the nearest command."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command, or raise with the nearest name that exists."""
        _check_gone(cmd_name)
        command = super().get_command(ctx, cmd_name)
        if command is None:
            raise unknown_name("command", cmd_name, self.list_commands(ctx))
        return command


class _OneCommand(typer.core.TyperCommand):
    """A command none of whose options may be given twice, which would lose a value.

    Its ``--calibrate-from``, if it has one, takes all paths up to the next option. Where that would
    leave no spectra to measure, it takes the first path only, so that ``hotlever raman
    --calibrate-from hot-plate/ tip/`` means what it says.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each of its paths, then parse as usual."""
        for word in args:
            _check_gone(f"{self.name} {word.partition('=')[0]}")
        options = [param for param in self.params if param.param_type_name == "option"]
        valued = [option for option in options if not getattr(option, "is_flag", False)]
        names = {name for option in valued for name in option.opts}
        if "--calibrate-from" in names:
            args = spread_option(args, "--calibrate-from", names)
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
