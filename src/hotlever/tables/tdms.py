"""LabVIEW's TDMS files, as the lines of a text table.

A file has groups of channels, each with properties such as its unit. The library that reads it,
npTDMS, comes with the extra ``hotlever[tdms]``.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from itertools import zip_longest
from logging import LogRecord
from typing import Any

from hotlever.errors import InputError, quoted, shown
from hotlever.tables.cells import MOST_LINES, Line
from hotlever.tables.headings import with_units
from hotlever.units import TIMES, name_and_unit

#: Content begins so.
SIGNATURE = b"TDSm"
#: The unit of a channel, as LabVIEW's waveforms and as DAQmx name that property.
_UNITS = ("unit_string", "NI_UnitDescription")
#: Time of the first value (s), and between two.
_OFFSET, _STEP = "wf_start_offset", "wf_increment"


def tdms_lines(raw: bytes, where: str) -> list[Line]:
    """Return properties, header row and rows of a TDMS file, cells separated by tabs.

    The rows of groups with the same channels follow each other. Where channels are waveforms, and
    none has the times, a column of these comes first.

    Raises
    ------
    InputError
        If npTDMS is missing, or the file is damaged, too long, or has groups that differ.
    """
    try:
        from nptdms import TdmsFile
        from nptdms.log import log_manager
    except ImportError:
        raise InputError(
            f"{where}: reading .tdms needs the package npTDMS; install it with: "
            "pip install 'hotlever[tdms]'"
        ) from None
    log_manager.console_handler.addFilter(_refuse)
    try:
        # channels are read one by one, as a damaged file may claim any length
        with TdmsFile.open(io.BytesIO(raw)) as file:
            return _lines(file, where)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes the library raise
        reason = shown(" ".join(str(error).split()), 160) or type(error).__name__
        raise InputError(f"{where}: not a readable TDMS file ({reason})") from error
    finally:
        log_manager.console_handler.removeFilter(_refuse)


def _refuse(record: LogRecord) -> bool:
    """Raise what the library would only print: that a file is cut short, and its values a guess."""
    raise ValueError(record.getMessage())


def _lines(file: Any, where: str) -> list[Line]:
    groups = {group.name: group for group in file.groups() if any(map(len, group.channels()))}
    lengths = [max(map(len, group.channels())) for group in groups.values()]
    if not groups or sum(lengths) > MOST_LINES:
        rows = f"{sum(lengths)} rows, expected at most {MOST_LINES}"
        raise InputError(f"{where}: " + (rows if groups else "no channel has values"))
    headings = {name: list(map(_heading, group.channels())) for name, group in groups.items()}
    first, names = next(iter(headings.items()))
    for other in headings:
        if headings[other] != names:
            raise InputError(
                f"{where}: the group {quoted(other)} has other channels than {quoted(first)}, "
                "expected groups with the same channels"
            )
    lines = [f"# {key}: {_text(value)}" for key, value in _properties(file, groups).items()]
    starts = [_times(group.channels()) for group in groups.values()]
    named = any(name_and_unit(name)[0].casefold() in TIMES for name in names)
    timed = not named and None not in starts
    lines.append("\t".join([*(["time (s)"] * timed), *names]))
    for group, length, start in zip(groups.values(), lengths, starts, strict=True):
        columns = [channel[:].tolist() for channel in group.channels()]
        if timed and start is not None:
            columns.insert(0, [start[0] + start[1] * row for row in range(length)])
        for row in zip_longest(*columns, fillvalue=""):
            lines.append("\t".join(map(_text, row)))
    return list(enumerate(lines, start=1))


def _heading(channel: Any) -> str:
    units = (str(channel.properties.get(key, "")) for key in _UNITS)
    return with_units([_text(channel.name)], [next(filter(None, units), "")])[0]


def _properties(file: Any, groups: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is said of the file, and of its groups."""
    said: dict[str, Any] = {}
    for each in (file, *groups.values()):
        said = {**each.properties, **said}
    return said


def _times(channels: list[Any]) -> tuple[float, float] | None:
    """Return the first time and the step (s) that all channels share; None if they have none."""
    times = {
        (float(each.properties.get(_OFFSET, 0.0)), float(each.properties.get(_STEP, 0.0)))
        for each in channels
    }
    return next(iter(times)) if len(times) == 1 and all(step > 0.0 for _, step in times) else None


def _text(value: Any) -> str:
    """Return a cell: the shortest text of a number that is read as the same one."""
    return (
        repr(value) if isinstance(value, float) else " ".join(str(value).split()).replace('"', "")
    )
