"""Binary files of instruments, as the lines of a text table.

Igor Pro's waves (.ibw) have values along a scale of their own, such as a distance, in one column or
several that may be labelled. LabVIEW's TDMS files have groups of channels, each with properties
such as its unit. The libraries that read them come with the extras ``hotlever[igor]`` and
``hotlever[tdms]``.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Mapping
from importlib import import_module
from itertools import zip_longest
from typing import Any

import numpy as np

from hotlever.errors import InputError, excerpt, quoted
from hotlever.tables.headings import with_units
from hotlever.tables.table import MOST_LINES, Line, decode
from hotlever.types import Array
from hotlever.units import TIMES, conversion, name_and_unit

#: Content of a TDMS file begins so, that of a wave with the version of the format, in either order
#: of bytes.
TDMS = b"TDSm"
WAVES = tuple(version.to_bytes(2, order) for version in (2, 3, 5) for order in ("little", "big"))

#: Parts of a wave of version 5 whose sizes its header states: data, formula, note, units, labels
#: and indices.
_PARTS = 13
#: The unit of a channel, as LabVIEW's waveforms and as DAQmx name that property.
_UNITS = ("unit_string", "NI_UnitDescription")
#: Time of the first value (s), and between two.
_OFFSET, _STEP = "wf_start_offset", "wf_increment"


def lines_of_binary(raw: bytes, where: str) -> list[Line] | None:
    """Return comments, header row and rows of a wave or a TDMS file; None of any other file.

    Cells are separated by tabs.

    Raises
    ------
    InputError
        If its library is missing, or the file is damaged, too long, or no table of numbers.
    """
    if raw.startswith(TDMS):
        read, what, suffix, extra, package = _tdms_lines, "TDMS file", "tdms", "tdms", "npTDMS"
    elif raw.startswith(WAVES):
        read, what, suffix, extra, package = _igor_lines, "Igor wave", "ibw", "igor", "igor2"
    else:
        return None
    try:
        import_module(package.lower())
    except ImportError:
        raise InputError(
            f"{where}: reading .{suffix} needs the package {package}; install it with: "
            f"pip install 'hotlever[{extra}]'"
        ) from None
    try:
        return list(enumerate(read(raw, where), start=1))
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes the library raise
        reason = excerpt(" ".join(str(error).split()), 160) or type(error).__name__
        raise InputError(f"{where}: not a readable {what} ({reason})") from error


def _check_length(rows: int, where: str) -> None:
    if rows > MOST_LINES:
        raise InputError(f"{where}: {rows} rows, expected at most {MOST_LINES}")


# --- Igor's waves -------------------------------------------------------------------------------


def _igor_lines(raw: bytes, where: str) -> list[str]:
    """Return the lines of a wave.

    A column with the wave's scale comes first, called ``time`` or ``x``, unless rows are merely
    numbered. Columns are called by their labels; one alone is called like the wave, and has its
    unit. Several columns may have different units, which the wave does not state.
    """
    from igor2 import binarywave

    # it says what is wrong by an error too
    logging.getLogger("igor2").setLevel(logging.CRITICAL)
    _check_sizes(raw)
    wave = binarywave.load(io.BytesIO(raw))["wave"]
    values = wave["wData"]
    if values.ndim not in (1, 2) or values.dtype.kind not in "iuf" or not values.size:
        raise InputError(
            f"{where}: a wave of {values.ndim} dimensions and type {values.dtype}, expected "
            "real numbers in one column or several"
        )
    _check_length(len(values), where)
    columns = values.reshape(len(values), -1).astype(float).T.tolist()
    names = _names(wave, len(columns))
    scale = _scale(wave, len(values))
    if scale is not None:
        names.insert(0, scale[0])
        columns.insert(0, scale[1].tolist())
    note = decode(bytes(wave["note"]), f"{where}: its note")
    lines = [f"# {line}" for line in note.splitlines() if line.strip()]
    lines.append("\t".join(names))
    return lines + ["\t".join(map(repr, row)) for row in zip(*columns, strict=True)]


def _check_sizes(raw: bytes) -> None:
    """Raise ValueError if parts of a wave do not fit into its file: the library would go on."""
    if 5 in raw[:2]:
        sizes = np.frombuffer(raw, "<i4" if raw[0] else ">i4", _PARTS, offset=4)
        if sizes.min() < 0 or sizes.sum(dtype=np.int64) > len(raw):
            raise ValueError(f"its parts are larger than its {len(raw)} bytes")


def _names(wave: dict[str, Any], count: int) -> list[str]:
    """Return the headings of so many columns."""
    header = wave["wave_header"]
    if count == 1:
        unit = _name(wave.get("data_units", b"")) or _name(header["dataUnits"])
        return [_heading(_name(header["bname"]), unit)]
    # the first label is that of all of them
    labels = list(map(_name, wave["labels"][1][1:]))
    labels += [""] * (count - len(labels))
    return [label or f"column {number}" for number, label in enumerate(labels[:count], start=1)]


def _scale(wave: dict[str, Any], count: int) -> tuple[str, Array] | None:
    """Return heading and values of a wave's scale; None where it merely numbers the rows."""
    header = wave["wave_header"]
    if "hsA" in header:
        step, first, unit = header["hsA"], header["hsB"], _name(header["xUnits"])
    else:
        step, first = header["sfA"][0], header["sfB"][0]
        size = int(wave["bin_header"]["dimEUnitsSize"][0])
        unit = _name(wave["dimension_units"][:size]) or _name(header["dimUnits"][0])
    if not unit and (step, first) == (1.0, 0.0):
        return None
    name = "time" if conversion(unit, "s") else "x"
    return _heading(name, unit), first + step * np.arange(count)


def _heading(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit and name_and_unit(name)[1] is None else name


def _name(name: Any) -> str:
    """Return a name or a unit, which may be an array of characters up to a zero."""
    whole = name if isinstance(name, bytes) else b"".join(np.ravel(name))
    return _cell(whole.split(b"\0")[0].decode("utf-8", errors="replace"))


# --- LabVIEW's TDMS files -----------------------------------------------------------------------


def _tdms_lines(raw: bytes, where: str) -> list[str]:
    """Return the lines of a TDMS file.

    The rows of groups with the same channels follow each other. Where channels are waveforms, and
    none has the times, a column of these comes first.
    """
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    console = log_manager.console_handler
    console.addFilter(_refuse)
    try:
        # channels are read one by one, as a damaged file may claim any length
        with TdmsFile.open(io.BytesIO(raw)) as file:
            return _lines_of_groups(file, where)
    finally:
        console.removeFilter(_refuse)


def _refuse(record: logging.LogRecord) -> bool:
    """Raise what the library would only print: that a file is cut short, and its values a guess."""
    raise ValueError(record.getMessage())


def _lines_of_groups(file: Any, where: str) -> list[str]:
    groups = {group.name: group for group in file.groups() if any(map(len, group.channels()))}
    lengths = [max(map(len, group.channels())) for group in groups.values()]
    if not groups:
        raise InputError(f"{where}: no channel has values")
    _check_length(sum(lengths), where)
    headings = {name: list(map(_channel, group.channels())) for name, group in groups.items()}
    first, names = next(iter(headings.items()))
    for other in headings:
        if headings[other] != names:
            raise InputError(
                f"{where}: the group {quoted(other)} has other channels than {quoted(first)}, "
                "expected groups with the same channels"
            )
    lines = [f"# {key}: {_cell(value)}" for key, value in _properties(file, groups).items()]
    starts = [_times(group.channels()) for group in groups.values()]
    named = any(name_and_unit(name)[0].casefold() in TIMES for name in names)
    timed = not named and None not in starts
    lines.append("\t".join([*(["time (s)"] * timed), *names]))
    for group, length, start in zip(groups.values(), lengths, starts, strict=True):
        columns = [channel[:].tolist() for channel in group.channels()]
        if timed and start is not None:
            columns.insert(0, [start[0] + start[1] * row for row in range(length)])
        for row in zip_longest(*columns, fillvalue=""):
            lines.append("\t".join(map(_cell, row)))
    return lines


def _channel(channel: Any) -> str:
    """Return the heading of a channel."""
    units = (str(channel.properties.get(key, "")) for key in _UNITS)
    return with_units([_cell(channel.name)], [next(filter(None, units), "")])[0]


def _properties(file: Any, groups: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is said of the file, and of its groups."""
    properties: dict[str, Any] = {}
    for each in (file, *groups.values()):
        properties = {**each.properties, **properties}
    return properties


def _times(channels: list[Any]) -> tuple[float, float] | None:
    """Return the first time and the step (s) that all channels share; None if they have none."""
    times = {
        (float(each.properties.get(_OFFSET, 0.0)), float(each.properties.get(_STEP, 0.0)))
        for each in channels
    }
    return next(iter(times)) if len(times) == 1 and all(step > 0.0 for _, step in times) else None


def _cell(value: Any) -> str:
    """Return a cell: the shortest text of a number that is read as the same one."""
    return (
        repr(value) if isinstance(value, float) else " ".join(str(value).split()).replace('"', "")
    )
