"""Binary files of instruments, as the lines of a text table.

Igor Pro's waves (.ibw) have values along a scale of their own, such as a distance, in one column or
several that may be labelled. LabVIEW's TDMS files have groups of channels, each with properties
such as its unit. The libraries that read them come with the extras ``hotlever[igor]`` and
``hotlever[tdms]``.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import islice, zip_longest
from typing import Any

import numpy as np

from hotlever.errors import InputError, excerpt, quoted, unknown_name
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
#: What files are called, the extra that brings their library, and this.
_TDMS, _IGOR = ("TDMS file", "tdms", "npTDMS"), ("Igor wave", "igor", "igor2")
#: Groups that a question names.
_MOST_GROUPS = 6
#: The unit of a channel, as LabVIEW's waveforms and as DAQmx name that property.
_UNITS = ("unit_string", "NI_UnitDescription")
#: Time of the first value (s), and between two.
_OFFSET, _STEP = "wf_start_offset", "wf_increment"


def lines_of_binary(
    raw: bytes, where: str, group: str | None = None, group_stated_by: str = ""
) -> list[Line] | None:
    """Return comments, header row and rows of a wave or a TDMS file; None of any other file.

    Cells are separated by tabs. A TDMS file of several groups needs one of them named, for which
    an error says how, if there is a way.

    Raises
    ------
    InputError
        If its library is missing, or the file is damaged, too long, no table of numbers, or has
        no such group, or several and none is named.
    """
    if raw.startswith(TDMS):
        read = partial(_tdms_lines, group=group, group_stated_by=group_stated_by)
        return list(enumerate(_read(read, raw, where, *_TDMS), start=1))
    if group is not None:
        raise InputError(f"{where}: is no TDMS file, so that it has no group {quoted(group)}")
    if raw.startswith(WAVES):
        return list(enumerate(_read(_igor_lines, raw, where, *_IGOR), start=1))
    return None


def groups_in(raw: bytes, where: str) -> list[str]:
    """Return the names of the groups of a TDMS file that have values; of other files, none.

    Raises
    ------
    InputError
        As `lines_of_binary`.
    """
    return _read(_tdms_groups, raw, where, *_TDMS) if raw.startswith(TDMS) else []


def _read(
    read: Callable[[bytes, str], list[str]],
    raw: bytes,
    where: str,
    what: str,
    extra: str,
    package: str,
) -> list[str]:
    """Return what is read by a library, whose errors become those of the input."""
    try:
        return read(raw, where)
    except ImportError:
        raise InputError(
            f"{where}: reading a {what} needs the package {package}; install it with: "
            f"pip install 'hotlever[{extra}]'"
        ) from None
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


@contextmanager
def _tdms_file(raw: bytes) -> Iterator[Any]:
    """Open a TDMS file; what the library would only print is an error."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    console = log_manager.console_handler
    console.addFilter(_refuse)
    try:
        # channels are read one by one, as a damaged file may claim any length
        with TdmsFile.open(io.BytesIO(raw)) as file:
            yield file
    finally:
        console.removeFilter(_refuse)


def _tdms_groups(raw: bytes, where: str) -> list[str]:
    with _tdms_file(raw) as file:
        return list(_filled_groups(file, where))


def _tdms_lines(raw: bytes, where: str, group: str | None, group_stated_by: str) -> list[str]:
    """Return the lines of a group of a TDMS file, which must be named if there are several.

    Each group is a measurement of its own. Where channels are waveforms, and none has the times,
    a column of these comes first.
    """
    with _tdms_file(raw) as file:
        groups = _filled_groups(file, where)
        if group is None and len(groups) > 1:
            some = ", ".join(map(quoted, islice(groups, _MOST_GROUPS)))
            more = f" and {len(groups) - _MOST_GROUPS} more" if len(groups) > _MOST_GROUPS else ""
            how = group_stated_by.format(group=excerpt(next(iter(groups))))
            raise InputError(
                f"{where}: {len(groups)} groups, each a measurement of its own: {some}{more}; "
                f"expected {f'one, which {how} says' if how else 'a file of one group'}"
            )
        name = next(iter(groups)) if group is None else group
        if name not in groups:
            raise unknown_name("group", name, groups, where)
        return _lines_of_group(file, groups[name], where)


def _refuse(record: logging.LogRecord) -> bool:
    """Raise what the library would only print: that a file is cut short, and its values a guess."""
    raise ValueError(record.getMessage())


def _filled_groups(file: Any, where: str) -> dict[str, Any]:
    """Return the groups with values by their names, as these are told."""
    groups = {
        _cell(group.name): group for group in file.groups() if any(map(len, group.channels()))
    }
    if not groups:
        raise InputError(f"{where}: no channel has values")
    return groups


def _lines_of_group(file: Any, group: Any, where: str) -> list[str]:
    channels = group.channels()
    length = max(map(len, channels))
    _check_length(length, where)
    names = list(map(_channel, channels))
    # what is said of the file counts before what is said of the group
    properties = {**group.properties, **file.properties}
    lines = [f"# {key}: {_cell(value)}" for key, value in properties.items()]
    times = _times(channels, names, where)
    columns = [channel[:].tolist() for channel in channels]
    if times and not any(name_and_unit(name)[0].casefold() in TIMES for name in names):
        names.insert(0, "time (s)")
        columns.insert(0, [times[0] + times[1] * row for row in range(length)])
    lines.append("\t".join(names))
    for row in zip_longest(*columns, fillvalue=""):
        lines.append("\t".join(map(_cell, row)))
    return lines


def _channel(channel: Any) -> str:
    """Return the heading of a channel."""
    units = (str(channel.properties.get(key, "")) for key in _UNITS)
    return with_units([_cell(channel.name)], [next(filter(None, units), "")])[0]


def _times(channels: Sequence[Any], names: Sequence[str], where: str) -> tuple[float, float] | None:
    """Return the first time and the step (s) of the channels; None if not all have them.

    Raises
    ------
    InputError
        If they are not the same, so that rows of values are of different times.
    """
    times = [
        (float(each.properties.get(_OFFSET, 0.0)), float(each.properties.get(_STEP, 0.0)))
        for each in channels
    ]
    timed = {time: name for time, name in zip(times, names, strict=True) if time[1] > 0.0}
    if len(timed) > 1:
        (first, name), (other, other_name) = list(timed.items())[:2]
        raise InputError(
            f"{where}: '{excerpt(name)}' has values every {first[1]:g} s from {first[0]:g} s on, "
            f"'{excerpt(other_name)}' every {other[1]:g} s from {other[0]:g} s on, expected "
            "channels of the same times"
        )
    return times[0] if timed and all(step > 0.0 for _, step in times) else None


def _cell(value: Any) -> str:
    """Return a cell: the shortest text of a number that is read as the same one."""
    return (
        repr(value) if isinstance(value, float) else " ".join(str(value).split()).replace('"', "")
    )
