"""Igor Pro's binary waves (.ibw), as the lines of a text table.

A file has one wave: values along a scale of its own, such as a distance, in one column or several
that may be labelled. The library that reads it, igor2, comes with the extra ``hotlever[igor]``.
"""

from __future__ import annotations

import io
import logging
from typing import Any

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.tables.cells import MOST_LINES, Line, decode
from hotlever.types import Array
from hotlever.units import conversion, name_and_unit

#: Content begins with one of these: the version of the format, in either order of bytes.
SIGNATURES = tuple(
    version.to_bytes(2, order) for version in (2, 3, 5) for order in ("little", "big")
)

#: Parts of a wave of version 5 whose sizes its header states: data, formula, note, units, labels
#: and indices.
_PARTS = 13


def igor_lines(raw: bytes, where: str) -> list[Line]:
    """Return the note, header row and rows of a binary wave, cells separated by tabs.

    A column with the wave's scale comes first, called ``time`` or ``x``, unless rows are merely
    numbered. Columns are called by their labels; one alone is called like the wave, and has its
    unit. Several columns may have different units, which the wave does not state.

    Raises
    ------
    InputError
        If igor2 is missing, or the file is damaged, too long, or no table of real numbers.
    """
    try:
        from igor2 import binarywave
    except ImportError:
        raise InputError(
            f"{where}: reading .ibw needs the package igor2; install it with: "
            "pip install 'hotlever[igor]'"
        ) from None
    # it says what is wrong by an error too
    logging.getLogger("igor2").setLevel(logging.CRITICAL)
    try:
        _check_sizes(raw)
        wave = binarywave.load(io.BytesIO(raw))["wave"]
        values = wave["wData"]
        if values.ndim not in (1, 2) or values.dtype.kind not in "iuf" or not values.size:
            raise InputError(
                f"{where}: a wave of {values.ndim} dimensions and type {values.dtype}, expected "
                "real numbers in one column or several"
            )
        if len(values) > MOST_LINES:
            raise InputError(f"{where}: {len(values)} rows, expected at most {MOST_LINES}")
        columns = values.reshape(len(values), -1).astype(float).T.tolist()
        names = _names(wave, len(columns))
        scale = _scale(wave, len(values))
        note = decode(bytes(wave["note"]), f"{where}: its note")
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes the library raise
        reason = shown(" ".join(str(error).split()), 160) or type(error).__name__
        raise InputError(f"{where}: not a readable Igor wave ({reason})") from error
    if scale is not None:
        names.insert(0, scale[0])
        columns.insert(0, scale[1].tolist())
    lines = [f"# {line}" for line in note.splitlines() if line.strip()]
    lines.append("\t".join(names))
    lines += ["\t".join(map(repr, row)) for row in zip(*columns, strict=True)]
    return list(enumerate(lines, start=1))


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
        unit = _text(wave.get("data_units", b"")) or _text(header["dataUnits"])
        return [_heading(_text(header["bname"]), unit)]
    # the first label is that of all of them
    labels = list(map(_text, wave["labels"][1][1:]))
    labels += [""] * (count - len(labels))
    return [label or f"column {number}" for number, label in enumerate(labels[:count], start=1)]


def _scale(wave: dict[str, Any], count: int) -> tuple[str, Array] | None:
    """Return heading and values of a wave's scale; None where it merely numbers the rows."""
    header = wave["wave_header"]
    if "hsA" in header:
        step, first, unit = header["hsA"], header["hsB"], _text(header["xUnits"])
    else:
        step, first = header["sfA"][0], header["sfB"][0]
        size = int(wave["bin_header"]["dimEUnitsSize"][0])
        unit = _text(wave["dimension_units"][:size]) or _text(header["dimUnits"][0])
    if not unit and (step, first) == (1.0, 0.0):
        return None
    name = "time" if conversion(unit, "s") else "x"
    return _heading(name, unit), first + step * np.arange(count)


def _heading(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit and name_and_unit(name)[1] is None else name


def _text(name: Any) -> str:
    """Return a name or a unit, which may be an array of characters up to a zero."""
    whole = name if isinstance(name, bytes) else b"".join(np.ravel(name))
    text = whole.split(b"\0")[0].decode("utf-8", errors="replace")
    return " ".join(text.split()).replace('"', "")
