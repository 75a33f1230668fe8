"""The errors hotlever raises, how a typo is answered, and an error that nobody foresaw."""

from __future__ import annotations

import difflib
import os
import platform
import re
import tempfile
import traceback
from collections.abc import Callable, Iterable
from typing import Any

from hotlever import __version__


class HotleverError(Exception):
    """Base of every error raised on purpose; its text is one line for a user."""

    exit_status = 1


class InputError(HotleverError):
    """The input is at fault: the text says where, what was found and what is expected."""

    exit_status = 2


class ComputationError(HotleverError):
    """A computation could not be finished.

    ``partial`` is what was reached before, of the type the call would have returned.
    """

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class InstrumentError(HotleverError):
    """An instrument does not do what it should: the text says which, and what it said."""


class NewtonError(ComputationError):
    """Newton's method did not converge; ``partial`` holds the last finite iterate."""


class BranchEndError(ComputationError):
    """The branch that a slow bias ramp follows ends before the last bias asked for.

    It ends at ``bias_reached`` (V); ``partial`` holds the states up to there.
    """

    def __init__(self, message: str, bias_reached: float, partial: Any = None) -> None:
        super().__init__(message, partial)
        self.bias_reached = bias_reached


class HistoryEndError(ComputationError):
    """A lever could not be followed in time to the end asked for.

    It was followed to ``time_reached`` (µs); ``partial`` holds what was seen up to there.
    """

    def __init__(self, message: str, time_reached: float, partial: Any = None) -> None:
        super().__init__(message, partial)
        self.time_reached = time_reached


def as_far_as_possible(work: Callable[[], Any]) -> tuple[Any, ComputationError | None]:
    """Return what a computation gives; if it fails, what it reached, and the failure.

    Raises
    ------
    ComputationError
        If it reached nothing.
    """
    try:
        return work(), None
    except ComputationError as error:
        if error.partial is None:
            raise
        return error.partial, error


def quoted(value: object) -> str:
    """Return what was found as an error quotes it: the beginning of what is long.

    Examples
    --------
    >>> quoted("a" * 80)
    "'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa…"
    """
    try:
        text = repr(value)
    except (ValueError, RecursionError):
        return f"a very long {type(value).__name__}"
    return text if len(text) <= 40 else f"{text[:38]}…"


def excerpt(text: str, limit: int = 40) -> str:
    """Return the beginning of a text, without what does not print, to quote it in an error."""
    text = "".join(mark if mark.isprintable() else " " for mark in text[: 2 * limit].strip())
    return text if len(text) <= limit else text[: limit - 1] + "…"


def counted(count: int, noun: str) -> str:
    """Return a number of things, whose plural ends in s.

    Examples
    --------
    >>> counted(1, "value"), counted(2, "value")
    ('1 value', '2 values')
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def unknown_name(kind: str, name: str, choices: Iterable[str], where: str = "") -> InputError:
    """Return the error for a name that does not exist, with the nearest one that does.

    Examples
    --------
    >>> str(unknown_name("parameter", "c_kapa", ["c_kappa", "delta"]))
    "unknown parameter 'c_kapa': did you mean 'c_kappa'? (expected one of: c_kappa, delta)"
    """
    names, asked, most = list(choices), name[:40], 5
    # a longer name may be meant that has all its words, though the whole is less alike than others
    whole = [other for other in names if _words(name) <= _words(other)]
    whole = difflib.get_close_matches(asked, whole, n=most, cutoff=0.0)
    # of names that are less alike, one that begins as it does is meant, not any other
    alike = difflib.get_close_matches(asked, names, n=most, cutoff=0.5)
    near = difflib.get_close_matches(asked, names, n=1)
    fewest = min((len(_words(other)) for other in whole), default=0)
    meant = [other for other in whole if len(_words(other)) == fewest]
    near = (meant if len(meant) == 1 else near) or [
        other for other in alike if other[:1].lower() == name[:1].lower()
    ]
    if len(names) > 30:
        nearest = difflib.get_close_matches(asked, names, n=most, cutoff=0.0)
        nearest = list(dict.fromkeys([*whole, *nearest]))[:most]
        names = [*nearest, f"and {len(names) - len(nearest)} more"]
    hint = f": did you mean '{near[0]}'?" if near else ""
    prefix = f"{where}: " if where else ""
    return InputError(
        f"{prefix}unknown {kind} {quoted(name)}{hint} (expected one of: {', '.join(names)})"
    )


def _words(name: str) -> set[str]:
    """Return the words of a name such as ``tip.height_um``."""
    return set(re.split(r"[._ -]", name.lower()))


def unforeseen_error(error: BaseException, arguments: list[str]) -> str:
    """Return the line for an error that nobody foresaw, with where its traceback is kept."""
    what = "out of memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
    return f"internal error: {what} ({_logged(error, arguments)})"


def _logged(error: BaseException, arguments: list[str]) -> str:
    """Keep the traceback in a file, and say where."""
    import platformdirs

    lines = [
        f"hotlever {__version__}, Python {platform.python_version()}, {platform.platform()}\n",
        f"{['hotlever', *arguments]}\n",
        *traceback.format_exception(error),
    ]
    for folder in (platformdirs.user_log_dir("hotlever"), tempfile.gettempdir()):
        try:
            os.makedirs(folder, exist_ok=True)
            handle, path = tempfile.mkstemp(".log", "hotlever-", folder, text=True)
            with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
                file.writelines(lines)
        except OSError:
            continue
        return f"please report it with {path}"
    return "no log could be written"
