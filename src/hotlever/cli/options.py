"""How a command takes a request: its fields are the options of the command."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, fields
from inspect import Parameter, Signature
from typing import Annotated, Any, TypeVar, get_type_hints

import typer
from typer import Argument, Option

from hotlever.cli.commands import app

Request = TypeVar("Request")


def command(
    name: str, request: type[Request], commands: typer.Typer = app, **settings: Any
) -> Callable[..., Any]:
    """Register a function of a request (`hotlever.tasks.requests`) as a command of some name."""
    types = get_type_hints(request)
    parameters = []
    for field in fields(request):  # type: ignore[arg-type]
        texts, names = field.metadata["texts"], field.metadata.get("names")
        stated = Argument(**texts) if names is None else Option(*names, **texts)
        default = Parameter.empty if field.default is MISSING else field.default
        kind: Any = Annotated[types[field.name], stated]
        parameters.append(
            Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        )

    def register(task: Callable[[Request], None]) -> Callable[[Request], None]:
        def run(**values: Any) -> None:
            task(request(**values))

        run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {each.name: each.annotation for each in parameters}
        run.__doc__ = task.__doc__
        commands.command(name, **settings)(run)
        return task

    return register
