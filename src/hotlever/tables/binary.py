"""Binary files of instruments and programs, as the lines of a text table.

Igor Pro's waves (.ibw) have values along a scale of their own, such as a distance, in one column or
several that may be labelled. LabVIEW's TDMS files have groups of channels, each with properties
such as its unit; HDF5 files, QCoDeS's among them, have groups of datasets with attributes, MATLAB's
have variables and structures of them, and workbooks (.xlsx) have sheets. Each group, structure and
sheet is a table of its own. The libraries that read them come with extras (``hotlever[igor]``,
``hotlever[tdms]``, ``hotlever[hdf5]``, ``hotlever[excel]``).
"""

from __future__ import annotations

import io
import logging
import zipfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice, zip_longest
from typing import Any, TypeVar

import numpy as np

from hotlever.errors import InputError, excerpt, quoted, unknown_name
from hotlever.files import LARGEST_TEXT
from hotlever.tables.headings import with_units
from hotlever.tables.table import MOST_LINES, Line, decode
from hotlever.tables.table import number as decimal
from hotlever.types import Array
from hotlever.units import TIMES, conversion, name_and_unit

T = TypeVar("T")
# The tables of a file by name, whose lines are made when they are asked for.
Groups = Mapping[str, Callable[[], list[str]]]


@dataclass(frozen=True)
class _Format:
    """A format of binary files.

    Attributes
    ----------
    what : str
        A file of it.
    extra, package : str
        What brings its library, and this.
    groups : callable
        Opens a file's content for as long as a context lasts, and gives its tables.
    named : bool
        Whether these have names; else there is one.
    """

    what: str
    extra: str
    package: str
    groups: Callable[[bytes, str], AbstractContextManager[Groups]]
    named: bool = True

    def read(self, raw: bytes, where: str, take: Callable[[Groups], T]) -> T:
        """Return what is taken of the tables; errors of the library are those of the input."""
        try:
            with self.groups(raw, where) as groups:
                return take(groups)
        except ImportError:
            raise InputError(
                f"{where}: reading a {self.what} needs the package {self.package}; install it "
                f"with: pip install 'hotlever[{self.extra}]'"
            ) from None
        except InputError:
            raise
        except Exception as error:  # whatever a damaged file makes the library raise
            reason = excerpt(" ".join(str(error).split()), 160) or type(error).__name__
            raise InputError(f"{where}: not a readable {self.what} ({reason})") from error


def lines_of_binary(
    raw: bytes, where: str, group: str | None = None, group_stated_by: str = ""
) -> list[Line] | None:
    """Return comments, header row and rows of a binary file; None of any other file.

    Cells are separated by tabs. A file of several tables needs one of them named, for which an
    error says how, if there is a way.

    Raises
    ------
    InputError
        If its library is missing, or the file is damaged, too long, no table of numbers, or has
        no such group, or several and none is named.
    """
    format_ = _format_of(raw)
    if format_ is None or not format_.named:
        if group is not None:
            raise InputError(f"{where}: has no groups, and so no group {quoted(group)}")
        if format_ is None:
            return None
    take = partial(_lines_of, where=where, group=group, group_stated_by=group_stated_by)
    return list(enumerate(format_.read(raw, where, take), start=1))


def groups_in(raw: bytes, where: str) -> list[str]:
    """Return the names of the tables of a binary file that has such; of other files, none.

    Raises
    ------
    InputError
        As `lines_of_binary`.
    """
    format_ = _format_of(raw)
    return format_.read(raw, where, list) if format_ is not None and format_.named else []


def _format_of(raw: bytes) -> _Format | None:
    """Return the format of a file by how it begins."""
    hdf5 = b"\x89HDF\r\n\x1a\n"
    # the version of a wave, in either order of bytes
    waves = (b"\0\2", b"\2\0", b"\0\3", b"\3\0", b"\0\5", b"\5\0")
    if raw.startswith(b"TDSm"):
        return _Format("TDMS file", "tdms", "npTDMS", _tdms_groups)
    if raw.startswith(waves):
        return _Format("Igor wave", "igor", "igor2", _igor_groups, named=False)
    # MATLAB's of version 7.3 have a block of their own in front
    if raw.startswith(hdf5) or raw[512:].startswith(hdf5):
        return _Format("HDF5 file", "hdf5", "h5py", _hdf5_groups)
    if raw.startswith(b"MATLAB 5.0 MAT-file"):
        return _Format("MATLAB file", "hdf5", "scipy", _matlab_groups)
    if raw.startswith(b"PK") and b"xl/workbook.xml" in raw:
        return _Format("workbook", "excel", "openpyxl", _excel_groups)
    return None


def _lines_of(groups: Groups, where: str, group: str | None, group_stated_by: str) -> list[str]:
    """Return the lines of the only table, or of the one that is named."""
    if not groups:
        raise InputError(f"{where}: holds no table of numbers")
    if group is None and len(groups) > 1:
        most = 6  # that a question names
        some = ", ".join(map(quoted, islice(groups, most)))
        more = f" and {len(groups) - most} more" if len(groups) > most else ""
        how = group_stated_by.format(group=excerpt(next(iter(groups))))
        raise InputError(
            f"{where}: {len(groups)} groups, each a measurement of its own: {some}{more}; "
            f"expected {f'one, which {how} says' if how else 'a file of one group'}"
        )
    name = next(iter(groups)) if group is None else group
    if name not in groups:
        raise unknown_name("group", name, groups, where)
    return groups[name]()


def _check_length(rows: int, where: str) -> None:
    if rows > MOST_LINES:
        raise InputError(f"{where}: {rows} rows, expected at most {MOST_LINES}")


# --- Igor's waves -------------------------------------------------------------------------------


@contextmanager
def _igor_groups(raw: bytes, where: str) -> Iterator[Groups]:
    yield {"": partial(_igor_lines, raw, where)}


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
        # those that a header states: data, formula, note, units, labels and indices
        sizes = np.frombuffer(raw, "<i4" if raw[0] else ">i4", 13, offset=4)
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


@contextmanager
def _tdms_groups(raw: bytes, where: str) -> Iterator[Groups]:
    """Give the groups with values by their names, as these are told.

    Where channels are waveforms, and none has the times, a column of these comes first.
    """
    with _tdms_file(raw) as file:
        yield {
            _cell(group.name): partial(_lines_of_group, file, group, where)
            for group in file.groups()
            if any(map(len, group.channels()))
        }


def _refuse(record: logging.LogRecord) -> bool:
    """Raise what the library would only print: that a file is cut short, and its values a guess."""
    raise ValueError(record.getMessage())


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
    """Return the heading of a channel, with the unit as LabVIEW's waveforms or DAQmx name it."""
    keys = ("unit_string", "NI_UnitDescription")
    units = (str(channel.properties.get(key, "")) for key in keys)
    return with_units([_cell(channel.name)], [next(filter(None, units), "")])[0]


def _times(channels: Sequence[Any], names: Sequence[str], where: str) -> tuple[float, float] | None:
    """Return the first time and the step (s) of the channels; None if not all have them.

    Raises
    ------
    InputError
        If they are not the same, so that rows of values are of different times.
    """
    times = [
        (float(of.get("wf_start_offset", 0.0)), float(of.get("wf_increment", 0.0)))
        for of in (each.properties for each in channels)
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


# --- HDF5 and MATLAB ----------------------------------------------------------------------------


@dataclass
class _Node:
    """A group of datasets, or a structure of variables.

    Attributes
    ----------
    settings : list of str
        What is said of it, as comments.
    columns : dict of int to dict
        Of so many rows each, by their headings.
    most : int
        Columns that an array may be; one of more is an image.
    """

    settings: list[str]
    columns: dict[int, dict[str, Array]]
    most: int = 64

    @classmethod
    def empty(cls, settings: Sequence[str] = ()) -> _Node:
        """Return one without columns."""
        return cls(list(settings), defaultdict(dict))

    def add(self, name: str, value: Any, unit: str = "") -> None:
        """Add what has a name: columns, or a setting; what is neither is said to be left out."""
        heading = _heading(_cell(name), _cell(unit))
        values = np.squeeze(np.asarray(value))
        if values.dtype.kind in "SUO" and values.ndim == 0:
            self.settings.append(f"# {heading}: {_cell(_decoded(values.item()))}")
        elif values.dtype.kind not in "iufb" or values.ndim > 2:
            self.settings.append(f"# left out, no column of real numbers: {heading}")
        elif values.ndim == 0:
            self.settings.append(f"# {heading}: {_cell(float(values))}")
        elif values.ndim == 1:
            self.columns[values.size][heading] = values.astype(float)
        elif min(values.shape) <= self.most:
            # a row is as many values as there are columns, whichever way the array lies
            columns = values if values.shape[0] <= self.most < values.shape[1] else values.T
            for number, column in enumerate(columns, start=1):
                named = _heading(f"{_cell(name)} {number}", _cell(unit))
                self.columns[column.size][named] = column.astype(float)
        else:
            self.settings.append(f"# left out, an image: {heading}")

    def tables(self, name: str, where: str) -> dict[str, Callable[[], list[str]]]:
        """Return its tables by name, one for each number of rows."""
        names = {
            rows: name if len(self.columns) == 1 else f"{name} ({rows} rows)"
            for rows in self.columns
        }
        return {names[rows]: partial(self._lines, rows, where) for rows in self.columns}

    def _lines(self, rows: int, where: str) -> list[str]:
        _check_length(rows, where)
        columns = self.columns[rows]
        values = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [*self.settings, "\t".join(columns), *("\t".join(map(repr, row)) for row in values)]


def _decoded(text: Any) -> Any:
    return text.decode("utf-8", errors="replace") if isinstance(text, bytes) else text


@contextmanager
def _hdf5_groups(raw: bytes, where: str) -> Iterator[Groups]:
    """Give the groups of an HDF5 file that have datasets, and what attributes say of them."""
    import h5py

    with h5py.File(io.BytesIO(raw), "r") as file:
        tables: dict[str, Callable[[], list[str]]] = {}
        _walk_hdf5(file, "/", [], tables, where)
        yield tables


def _walk_hdf5(
    group: Any,
    name: str,
    above: Sequence[str],
    tables: dict[str, Callable[[], list[str]]],
    where: str,
) -> None:
    """Add the tables of a group, and of those in it."""
    import h5py

    node = _Node.empty([*above, *_attributes(group)])
    inner = {}
    for key in group:
        # a link may lead nowhere
        part = group.get(key)
        if key == "#refs#" or part is None:
            continue
        if isinstance(part, h5py.Group):
            inner[key] = part
        elif isinstance(part, h5py.Dataset):
            _add_dataset(node, key, part)
    tables |= node.tables(name, where)
    for key, part in inner.items():
        _walk_hdf5(part, f"{name.rstrip('/')}/{_cell(key)}", node.settings, tables, where)


def _add_dataset(node: _Node, key: str, dataset: Any) -> None:
    # as conventions and programs name that attribute
    names = ("units", "unit", "Units", "Unit")
    units = (_decoded(dataset.attrs[name]) for name in names if name in dataset.attrs)
    if dataset.dtype.names:
        # a table of HDF5: its fields are columns
        for field in dataset.dtype.names:
            node.add(field, dataset[field])
    elif dataset.size is None or dataset.size > MOST_LINES * node.most:
        node.settings.append(f"# left out, too large: {_cell(key)}")
    elif _decoded(dataset.attrs.get("MATLAB_class", b"")) == "char":
        node.add(key, "".join(map(chr, np.ravel(dataset[()]).tolist())))
    else:
        node.add(key, dataset[()], str(next(units, "")))


def _attributes(group: Any) -> list[str]:
    """Return what the attributes of a group say, as comments."""
    node = _Node.empty()
    for key, value in group.attrs.items():
        if np.size(value) == 1:
            node.add(key, value)
    return node.settings


@contextmanager
def _matlab_groups(raw: bytes, where: str) -> Iterator[Groups]:
    """Give the variables of a MATLAB file, and its structures, each a table of its own."""
    from scipy.io import loadmat

    content = loadmat(io.BytesIO(raw), simplify_cells=True)
    tables: dict[str, Callable[[], list[str]]] = {}
    _walk_matlab(content, "/", [], tables, where)
    yield tables


def _walk_matlab(
    content: Mapping[str, Any],
    name: str,
    above: Sequence[str],
    tables: dict[str, Callable[[], list[str]]],
    where: str,
) -> None:
    """Add the tables of a structure, and of those in it."""
    node, inner = _Node.empty(above), dict[str, Mapping[str, Any]]()
    for key, value in content.items():
        if key.startswith("__"):
            continue
        parts = value if isinstance(value, list | np.ndarray) else [value]
        if len(parts) and all(isinstance(part, dict) for part in parts):
            many = len(parts) > 1
            inner |= {f"{key}({n})" if many else key: part for n, part in enumerate(parts, start=1)}
        else:
            node.add(key, value)
    tables |= node.tables(name, where)
    for key, part in inner.items():
        _walk_matlab(part, f"{name.rstrip('/')}/{key}", node.settings, tables, where)


# --- workbooks ----------------------------------------------------------------------------------


@contextmanager
def _excel_groups(raw: bytes, where: str) -> Iterator[Groups]:
    """Give the sheets of a workbook that hold numbers, hidden ones too."""
    import openpyxl

    with zipfile.ZipFile(io.BytesIO(raw)) as parts:
        size = sum(part.file_size for part in parts.infolist())
    if size > LARGEST_TEXT:
        raise InputError(
            f"{where}: {size / 1e6:.3g} MB unpacked, expected at most {LARGEST_TEXT / 1e6:.3g} MB"
        )
    values = openpyxl.load_workbook(io.BytesIO(raw), read_only=True, data_only=True)
    formulas = openpyxl.load_workbook(io.BytesIO(raw), read_only=True)
    try:
        yield {
            _cell(sheet.title): partial(_sheet_lines, sheet, formulas[sheet.title], where)
            for sheet in values.worksheets
            if any(isinstance(cell, int | float) for row in _cells(sheet) for cell in row)
        }
    finally:
        values.close()
        formulas.close()


def _cells(sheet: Any) -> Iterator[Sequence[Any]]:
    rows: Iterator[Sequence[Any]] = sheet.iter_rows(values_only=True)
    return rows


def _sheet_lines(sheet: Any, formulas: Any, where: str) -> list[str]:
    """Return the rows of a sheet that are not empty.

    Raises
    ------
    InputError
        If a formula has no value, which a program that does not calculate has left out.
    """
    rows: list[list[str]] = []
    pairs = zip_longest(_cells(sheet), _cells(formulas), fillvalue=())
    for number, (row, stated) in enumerate(pairs, start=1):
        for column, (cell, formula) in enumerate(zip_longest(row, stated), start=1):
            if cell is None and str(formula or "").startswith("="):
                raise InputError(
                    f"{where}: sheet {quoted(sheet.title)}, row {number}, column {column}: a "
                    "formula without its value, expected a workbook that was saved by what "
                    "calculates it"
                )
        cells = ["" if cell is None else _cell(cell) for cell in row]
        if any(cells):
            rows.append(cells)
        _check_length(len(rows), where)
    width = max(max(column for column, cell in enumerate(cells, 1) if cell) for cells in rows)
    lines = []
    for cells in rows:
        # words alone in the first cell are what text files have as comments
        alone = cells[0] and not any(cells[1:]) and decimal(cells[0]) is None
        cells += [""] * (width - len(cells))
        lines.append(f"# {cells[0]}" if alone else "\t".join(cells[:width]))
    return lines
