"""Binary files of instruments and programs, as the lines of a text table.

Igor Pro's waves (.ibw) have values along a scale of their own, such as a distance, in one column or
several that may be labelled; its experiments (.pxp) have folders of waves. LabVIEW's TDMS files
have groups of channels, each with properties such as its unit; HDF5 files, QCoDeS's among them,
have groups of datasets with attributes, MATLAB's have variables and structures of them, and
workbooks (.xlsx, .xls) have sheets. Each folder, group, structure and sheet is a table of its own.
The libraries that read them come with extras (``hotlever[igor]``, ``hotlever[tdms]``,
``hotlever[hdf5]``, ``hotlever[excel]``).
"""

from __future__ import annotations

import io
import logging
import re
import struct
import warnings
import zipfile
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import islice, zip_longest
from typing import Any

import numpy as np

from hotlever.errors import InputError, excerpt, quoted, unknown_name
from hotlever.files import LARGEST_TEXT
from hotlever.tables.table import MOST_LINES, Line, decode, with_units
from hotlever.tables.table import number as decimal
from hotlever.types import Array, T
from hotlever.units import conversion, heading_with, is_time, name_and_unit

# The tables of a file by name, whose lines are made when they are asked for.
Groups = dict[str, Callable[[], list[str]]]


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
        Returns the tables of a file's content.
    named : bool
        Whether these have names; else there is one.
    """

    what: str
    extra: str
    package: str
    groups: Callable[[bytes, str], Groups]
    named: bool = True

    def read(self, raw: bytes, where: str, take: Callable[[Groups], T]) -> T:
        """Return what is taken of the tables; errors of the library are those of the input."""
        try:
            # a damaged file has numbers that are none
            with np.errstate(invalid="ignore"):
                return take(self.groups(raw, where))
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
    numbered = enumerate(format_.read(raw, where, take), start=1)
    return [(number, line) for number, line in numbered if line]


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
    # the first record of an experiment may begin as a wave does
    if _experiment_order(raw):
        return _Format("Igor experiment", "igor", "igor2", _experiment_groups)
    if raw.startswith(waves):
        return _Format("Igor wave", "igor", "igor2", _wave_alone, named=False)
    # MATLAB's of version 7.3 have a block of their own in front
    if raw.startswith(hdf5) or raw[512:].startswith(hdf5):
        return _Format("HDF5 file", "hdf5", "h5py", _hdf5_groups)
    if raw.startswith(b"MATLAB 5.0 MAT-file"):
        return _Format("MATLAB file", "hdf5", "scipy", _matlab_groups)
    # an old workbook is one of the files that Windows' compound files may hold
    old = raw.startswith(b"\xd0\xcf\x11\xe0") and (
        "Workbook".encode("utf-16-le") in raw or "Book\0".encode("utf-16-le") in raw
    )
    if old:
        return _Format("workbook", "excel", "xlrd", _old_workbook_groups)
    if raw.startswith(b"PK") and b"xl/workbook.xml" in raw:
        return _Format("workbook", "excel", "openpyxl", _workbook_groups)
    return None


def _lines_of(groups: Groups, where: str, group: str | None, group_stated_by: str) -> list[str]:
    """Return the lines of the only table, or of the one that is named."""
    if not groups:
        raise InputError(f"{where}: holds no table of numbers")
    if group is None and len(groups) > 1:
        most, longest = 6, 120  # that a question names, and characters: of files they are alike
        some = ", ".join(f"'{excerpt(each, longest)}'" for each in islice(groups, most))
        more = f" and {len(groups) - most} more" if len(groups) > most else ""
        how = group_stated_by.format(group=excerpt(next(iter(groups)), longest))
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


def _wave_alone(raw: bytes, where: str) -> Groups:
    """Give the lines of a wave.

    A column with the wave's scale comes first, called ``time`` or ``x``, unless rows are merely
    numbered. Columns are called by their labels; one alone is called like the wave, and has its
    unit. Several columns may have different units, which the wave does not state.
    """
    wave = _wave(raw)
    values = wave["wData"]
    if not values.size:
        raise InputError(f"{where}: a wave without values, expected numbers")
    if not _has_columns(values):
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
    rows = ("\t".join(map(repr, row)) for row in zip(*columns, strict=True))
    return {"": lambda: [*_note(wave, where), "\t".join(names), *rows]}


def _wave(raw: bytes) -> dict[str, Any]:
    from igor2 import binarywave

    # it says what is wrong by an error too
    logging.getLogger("igor2").setLevel(logging.CRITICAL)
    _check_sizes(raw)
    wave: dict[str, Any] = binarywave.load(io.BytesIO(raw))["wave"]
    return wave


def _has_columns(values: Any) -> bool:
    return bool(values.size and values.ndim in (1, 2) and values.dtype.kind in "iuf")


def _note(wave: dict[str, Any], where: str) -> list[str]:
    """Return a wave's note as comments."""
    note = decode(bytes(wave["note"]), f"{where}: its note")
    return [f"# {line}" for line in note.splitlines() if line.strip()]


def _experiment_order(raw: bytes) -> str:
    """Return the order of bytes of an experiment, a file of nothing but records; else ''."""
    for order in "<>":
        at = count = 0
        while at + 8 <= len(raw):
            kind, _, size = struct.unpack_from(f"{order}HHi", raw, at)
            if kind & 0x7FFF > 0xFF or size < 0:
                break
            at, count = at + 8 + size, count + 1
        if at == len(raw) and count > 1:
            return order
    return ""


def _experiment_groups(raw: bytes, where: str) -> Groups:
    """Give the waves of each folder of an experiment, and the scales that they have."""
    order, at, path, known = _experiment_order(raw), 0, ["/"], {"/": _Node()}
    while at < len(raw):
        kind, _, size = struct.unpack_from(f"{order}HHi", raw, at)
        content, at = raw[at + 8 : at + 8 + size], at + 8 + size
        match kind & 0x7FFF:
            case 3:
                _add_wave(known[path[-1]], content, where)
            case 9:
                name = f"{path[-1].rstrip('/')}/{_name(content)}"
                path.append(name)
                known.setdefault(name, _Node())
            case 10 if len(path) > 1:
                path.pop()
    tables: Groups = {}
    for name, node in known.items():
        tables |= node.tables(name, where)
    return tables


def _add_wave(node: _Node, content: bytes, where: str) -> None:
    """Add the columns of a wave, and its scale, to those of its folder."""
    wave = _wave(content)
    values, name = wave["wData"], _name(wave["wave_header"]["bname"])
    if not _has_columns(values):
        node.settings.append(f"# left out, no column of real numbers: {name}")
        return
    columns = node.columns[len(values)]
    scale = _scale(wave, len(values))
    if scale is not None:
        heading, positions = scale
        is_other = heading in columns and not np.array_equal(columns[heading], positions)
        columns[f"{name}: {heading}" if is_other else heading] = positions
    table = values.reshape(len(values), -1).astype(float)
    for label, column in zip(_names(wave, table.shape[1]), table.T, strict=True):
        columns[label if table.shape[1] == 1 else f"{name} {label}"] = column
    node.settings.extend(_note(wave, where))


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
        return [heading_with(_name(header["bname"]), unit)]
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
    return heading_with(name, unit), first + step * np.arange(count)


def _name(name: Any) -> str:
    """Return a name or a unit, which may be an array of characters up to a zero."""
    whole = name if isinstance(name, bytes) else b"".join(np.ravel(name))
    return _cell(whole.split(b"\0")[0].decode("utf-8", errors="replace"))


# --- LabVIEW's TDMS files -----------------------------------------------------------------------


@contextmanager
def _refusing() -> Iterator[None]:
    """Raise what the library would only print: that a file is cut short, and its values a guess."""
    from nptdms.log import log_manager

    def refuse(record: logging.LogRecord) -> bool:
        raise ValueError(record.getMessage())

    console = log_manager.console_handler
    console.addFilter(refuse)
    try:
        yield
    finally:
        console.removeFilter(refuse)


def _tdms_groups(raw: bytes, where: str) -> Groups:
    """Give the groups with values by their names, as these are told.

    Where channels are waveforms, and none has the times, a column of these comes first.
    """
    from nptdms import TdmsFile

    with _refusing():
        # channels are read one by one, as a damaged file may claim any length
        file = TdmsFile.open(io.BytesIO(raw))
        return {
            _cell(group.name): partial(_lines_of_group, file, group, where)
            for group in file.groups()
            if any(map(len, group.channels()))
        }


@_refusing()
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
    if times and not any(is_time(name_and_unit(name)[0]) for name in names):
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
    if isinstance(value, float):
        return repr(value)
    return " ".join(str(value).split()).replace('"', "")


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
    matrices : list of tuple
        Arrays of two dimensions with their names and units, whose columns are still to be found.
    most : int
        Columns that an array may be; one of more is an image.
    """

    settings: list[str] = field(default_factory=list)
    columns: dict[int, dict[str, Array]] = field(default_factory=lambda: defaultdict(dict))
    matrices: list[tuple[str, str, Array]] = field(default_factory=list)
    most: int = 64

    def add(self, name: str, value: Any, unit: str = "") -> None:
        """Add what has a name: columns, or a setting; what is neither is said to be left out."""
        heading = heading_with(_cell(name), _cell(unit))
        values = np.squeeze(np.asarray(value))
        if values.dtype.kind in "SUO" and values.ndim == 0:
            self.settings.append(f"# {heading}: {_cell(_decoded(values.item()))}")
        elif values.dtype.kind == "c" and not values.imag.any():
            self.add(name, values.real, unit)
        elif values.dtype.kind not in "iufb" or values.ndim > 2:
            self.settings.append(f"# left out, no column of real numbers: {heading}")
        elif values.ndim == 0:
            self.settings.append(f"# {heading}: {_cell(float(values))}")
        elif values.ndim == 1:
            self.columns[values.size][heading] = values.astype(float)
        elif min(values.shape) <= self.most:
            self.matrices.append((_cell(name), _cell(unit), values.astype(float)))
        else:
            self.settings.append(f"# left out, an image: {heading}")

    def tables(self, name: str, where: str) -> Groups:
        """Return its tables by name, one for each number of rows.

        Columns of matrices are as long as a column beside them, else as the longer side.
        """
        lengths = set(self.columns)
        for matrix, unit, values in self.matrices:
            rows, width = values.shape
            beside = (rows in lengths) - (width in lengths)
            lies = beside < 0 or (beside == 0 and rows < width)
            for number, column in enumerate(values if lies else values.T, start=1):
                self.columns[column.size][heading_with(f"{matrix} {number}", unit)] = column
        return {
            name if len(self.columns) == 1 else f"{name} ({rows} rows)": partial(
                self._lines, rows, where
            )
            for rows in self.columns
        }

    def _lines(self, rows: int, where: str) -> list[str]:
        _check_length(rows, where)
        columns = self.columns[rows]
        values = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [*self.settings, "\t".join(columns), *("\t".join(map(repr, row)) for row in values)]


def _decoded(text: Any) -> Any:
    return text.decode("utf-8", errors="replace") if isinstance(text, bytes) else text


def _hdf5_groups(raw: bytes, where: str) -> Groups:
    """Give the groups of an HDF5 file that have datasets, and what attributes say of them."""
    import h5py

    with h5py.File(io.BytesIO(raw), "r") as file:
        return _in_group(file, "/", [], where)


def _in_group(group: Any, name: str, above: Sequence[str], where: str) -> Groups:
    """Return the tables of a group, and of those in it."""
    import h5py

    node = _Node([*above, *_attributes(group)])
    inner = {}
    for key in group:
        # a link may lead nowhere
        part = group.get(key)
        if key == "#refs#" or part is None:
            continue
        if _is_of_references(part):
            # MATLAB's cells: a column each, or a table
            for number, cell in enumerate(_referred(group, part), start=1):
                if _is_column(cell):
                    _check_filters(cell, where)
                    _add_dataset(node, f"{key}({number})", cell)
                else:
                    inner[f"{key}({number})"] = cell
        elif isinstance(part, h5py.Group) or _is_table(part):
            inner[key] = part
        elif isinstance(part, h5py.Dataset):
            _check_filters(part, where)
            _add_dataset(node, key, part)
    tables = node.tables(name, where)
    for key, part in inner.items():
        path = f"{name.rstrip('/')}/{_cell(key)}"
        if isinstance(part, h5py.Group):
            tables |= _in_group(part, path, node.settings, where)
        elif not _is_table(part):
            alone = _Node([*node.settings])
            _check_filters(part, where)
            _add_dataset(alone, key, part)
            tables |= alone.tables(path, where)
        else:
            _check_filters(part, where)
            table = _Node([*node.settings, *_attributes(part)])
            for column in part.dtype.names:
                table.add(column, part[column])
            tables |= table.tables(path, where)
    return tables


def _check_filters(dataset: Any, where: str) -> None:
    """Refuse a dataset that is compressed in a way that the library does not know."""
    import h5py

    properties = dataset.id.get_create_plist()
    for index in range(properties.get_nfilters()):
        code, _, _, name = properties.get_filter(index)
        if not h5py.h5z.filter_avail(code):
            raise InputError(
                f"{where}: '{excerpt(dataset.name)}' is compressed by '{excerpt(_decoded(name))}', "
                "expected gzip or no compression"
            )


def _is_of_references(part: Any) -> bool:
    import h5py

    dtype = getattr(part, "dtype", None)
    return dtype is not None and h5py.check_ref_dtype(dtype) is h5py.Reference


def _referred(group: Any, cells: Any) -> list[Any]:
    """Return what cells refer to, in MATLAB's order."""
    references = islice(np.ravel(cells[()]).tolist(), MOST_LINES)
    return [group.file[reference] for reference in references if reference]


def _is_table(part: Any) -> bool:
    """Whether a part of an HDF5 file is a table of fields, but for MATLAB's complex numbers."""
    names = getattr(getattr(part, "dtype", None), "names", None)
    return names is not None and names != ("real", "imag")


def _add_dataset(node: _Node, key: str, dataset: Any) -> None:
    # as conventions and programs name that attribute
    names = ("units", "unit", "Units", "Unit")
    said = {name: np.ravel(value)[:1].tolist() for name, value in dataset.attrs.items()}
    unit = next((_decoded(said[name][0]) for name in names if said.get(name)), "")
    kind = _decoded(*said.get("MATLAB_class", [""]))
    bare_dimension = "This is a netCDF dimension but not a netCDF variable"
    if "MATLAB_empty" in said or str(_decoded(*said.get("NAME", [""]))).startswith(bare_dimension):
        # its values are the lengths of its sides, or none
        return
    if dataset.size is None or dataset.size > MOST_LINES * node.most:
        node.settings.append(f"# left out, too large: {_cell(key)}")
    elif kind == "char":
        node.add(key, "".join(map(chr, np.ravel(dataset[()]).tolist())))
    else:
        values = dataset[()]
        # MATLAB counts along columns first
        node.add(key, _unpacked(values.T if kind else values, said), str(unit))


def _unpacked(values: Any, said: Mapping[str, list[Any]]) -> Any:
    """Return numbers as netCDF's conventions have them packed: scaled, and gaps as one of them."""
    numbers = np.asarray(values)
    packing = {"scale_factor", "add_offset", "_FillValue", "missing_value"} & said.keys()
    if numbers.dtype.kind not in "iuf" or not packing:
        return values
    gaps = [said[name][0] for name in packing & {"_FillValue", "missing_value"} if said[name]]
    scale, offset = (
        said[name][0] if said.get(name) else plain
        for name, plain in (("scale_factor", 1.0), ("add_offset", 0.0))
    )
    return np.where(np.isin(numbers, gaps), np.nan, numbers * scale + offset)


def _attributes(group: Any) -> list[str]:
    """Return what the attributes of a group say, as comments."""
    node = _Node()
    for key, value in group.attrs.items():
        if np.size(value) == 1:
            node.add(key, value)
    return node.settings


def _matlab_groups(raw: bytes, where: str) -> Groups:
    """Give the variables of a MATLAB file, and its structures, each a table of its own."""
    from scipy.io import loadmat

    return _in_structure(loadmat(io.BytesIO(raw), simplify_cells=True), "/", [], where)


def _in_structure(
    content: Mapping[str, Any], name: str, above: Sequence[str], where: str
) -> Groups:
    """Return the tables of a structure, and of those in it."""
    node, inner = _Node([*above]), dict[str, Mapping[str, Any]]()
    for key, value in content.items():
        if key.startswith("__"):
            continue
        parts = value if isinstance(value, list | np.ndarray) else [value]
        if len(parts) and all(isinstance(part, dict) for part in parts):
            many = len(parts) > 1
            inner |= {f"{key}({n})" if many else key: part for n, part in enumerate(parts, start=1)}
        elif _are_cells(value):
            for number, cell in enumerate(value, start=1):
                if _is_column(cell):
                    node.add(f"{key}({number})", cell)
                else:
                    inner[f"{key}({number})"] = {key: cell}
        else:
            node.add(key, value)
    tables = node.tables(name, where)
    for key, part in inner.items():
        tables |= _in_structure(part, f"{name.rstrip('/')}/{key}", node.settings, where)
    return tables


def _is_column(cell: Any) -> bool:
    shape = getattr(cell, "shape", ())
    return bool(shape) and max(shape) == np.prod(shape)


def _are_cells(value: Any) -> bool:
    """Whether a variable of MATLAB is a cell array of arrays of numbers."""
    objects = isinstance(value, np.ndarray) and value.dtype.kind == "O"
    parts = value if objects or isinstance(value, list) else []
    arrays = [part for part in parts if isinstance(part, np.ndarray)]
    return bool(len(parts)) and len(arrays) == len(parts) and all(map(_has_columns, arrays))


# --- workbooks ----------------------------------------------------------------------------------


def _workbook_groups(raw: bytes, where: str) -> Groups:
    """Give the sheets of a packed workbook that hold numbers, hidden ones too."""
    import openpyxl

    _check_sheets(raw, where)
    with warnings.catch_warnings():
        # of styles and charts, which hold no numbers
        warnings.simplefilter("ignore")
        packed = io.BytesIO(_without_fills(raw))
        book = openpyxl.load_workbook(packed, read_only=True, data_only=True)
        with closing(book):
            sheets = {each.title: each.iter_rows(values_only=True) for each in book.worksheets}
            return _sheets(sheets, where)


def _without_fills(raw: bytes) -> bytes:
    """Return a workbook whose cells are of no colour: the library refuses an empty ``<fill/>``.

    Instruments write such. The formats of numbers, which tell dates, stay.
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(raw)) as parts, zipfile.ZipFile(packed, "w") as others:
        for name in parts.namelist():
            content = parts.read(name)
            if name == "xl/styles.xml":
                fill = rb"(?s)<fill\b[^>]*/>|<fill\b[^>]*>.*?</fill>"
                content = re.sub(fill, b"<fill><patternFill/></fill>", content)
            others.writestr(name, content)
    return packed.getvalue()


def _old_workbook_groups(raw: bytes, where: str) -> Groups:
    """Give the sheets of an .xls file that hold numbers, hidden ones too."""
    import xlrd

    # it prints what it finds odd
    with xlrd.open_workbook(file_contents=raw, logfile=io.StringIO()) as book:

        def value(cell: Any) -> Any:
            if cell.ctype == xlrd.XL_CELL_DATE:
                # what only looks like a date in its format may be none; Excel shows such as ####
                with suppress(OverflowError):
                    return xlrd.xldate_as_datetime(cell.value, book.datemode)
                return "#VALUE!"
            is_error = cell.ctype == xlrd.XL_CELL_ERROR
            return xlrd.error_text_from_code[cell.value] if is_error else cell.value

        sheets = {sheet.name: [list(map(value, row)) for row in sheet.get_rows()] for sheet in book}
        return _sheets(sheets, where)


def _sheets(sheets: Mapping[str, Iterable[Sequence[Any]]], where: str) -> Groups:
    """Return the tables of sheets that hold numbers."""
    groups: Groups = {}
    for name, cells in sheets.items():
        rows = list(islice(cells, MOST_LINES + 1))
        if any(isinstance(cell, int | float) for row in rows for cell in row):
            groups[_cell(name)] = partial(_sheet_lines, rows, where)
    return groups


def _check_sheets(raw: bytes, where: str) -> None:
    """Refuse a packed workbook that is too large, or that nobody has calculated.

    Raises
    ------
    InputError
        If so. A formula may lack its value where a program that does not calculate wrote it, and
        the library would take it for an empty cell.
    """
    with zipfile.ZipFile(io.BytesIO(raw)) as parts:
        size = sum(part.file_size for part in parts.infolist())
        if size > LARGEST_TEXT:
            raise InputError(
                f"{where}: {size / 1e6:.3g} MB unpacked, expected at most "
                f"{LARGEST_TEXT / 1e6:.3g} MB"
            )
        names = [name for name in parts.namelist() if name.startswith("xl/worksheets/sheet")]
        for sheet in map(parts.read, names):
            _check_extent(sheet, where)
            formula = rb"<(?:\w+:)?c\b([^>]*)>\s*<(?:\w+:)?f\b(?:[^>]*/>|[^<]*</[\w:]+>)\s*"
            for cell, value in re.findall(formula + rb"(<(?:\w+:)?v\b[^>]*>[^<])?", sheet):
                if not value and b't="str"' not in cell:
                    name = re.search(rb'\br="(\w+)"', cell)
                    raise InputError(
                        f"{where}: cell {name[1].decode() if name else '?'}: a formula without its "
                        "value, expected a workbook that was saved by what calculates it"
                    )


def _check_extent(sheet: bytes, where: str) -> None:
    """Refuse a sheet whose cells are few and far apart: rows are filled up to the last one."""
    cells = re.findall(rb'<(?:\w+:)?c\b[^>]*\br="([A-Z]{1,3})(\d{1,7})"', sheet)
    rows = max((int(row) for _, row in cells), default=0)
    _check_length(rows, where)
    letters = max((column.rjust(3, b"@") for column, _ in cells), default=b"@@@")
    width = sum((letter - 64) * 26**power for power, letter in enumerate(reversed(letters)))
    if rows * width > 64 * MOST_LINES:
        raise InputError(
            f"{where}: a sheet of {rows} rows and {width} columns, expected at most "
            f"{64 * MOST_LINES} cells"
        )


def _sheet_lines(rows: Sequence[Sequence[Any]], where: str) -> list[str]:
    """Return the rows of a sheet as lines, empty ones too, so that they keep their numbers."""
    _check_length(len(rows), where)
    table = [["" if cell is None else _cell(cell) for cell in row] for row in rows]
    table = _upright(table)
    width = max(number for cells in table for number, cell in enumerate(cells, start=1) if cell)
    lines = []
    for cells in table:
        # words alone in the first cell are what text files have as comments
        alone = any(cells) and cells[0] and not any(cells[1:]) and decimal(cells[0]) is None
        if not alone and cells and cells[0].startswith("#") and not _holds_numbers(cells):
            # a heading such as that of a count, and no comment
            cells[0] = f"No{cells[0][1:]}" if len(cells[0]) == 1 else cells[0][1:].strip()
        cells += [""] * (width - len(cells))
        filled = "\t".join(cells[:width]) if any(cells) else ""
        lines.append(f"# {cells[0]}" if alone else filled)
    return lines


def _holds_numbers(cells: Sequence[str]) -> bool:
    return any(decimal(cell) is not None for cell in cells)


def _upright(table: list[list[str]]) -> list[list[str]]:
    """Return the cells of a sheet with a column for each quantity, which may have a row for each.

    Such rows begin with one or two words, a name and maybe its unit, before all their numbers, and
    no row of words alone heads the columns.
    """
    words = [
        next((n for n, cell in enumerate(row) if decimal(cell) is not None), 0) for row in table
    ]
    lying = [
        number
        for number, (row, before) in enumerate(zip(table, words, strict=True))
        if before in (1, 2) and all(row[:before]) and len([*filter(None, row)]) - before > 1
    ]
    others = [row for number, row in enumerate(table) if number not in lying]
    longest = max((len(table[number]) for number in lying), default=0)
    numbers = (cell for number in lying for cell in table[number][words[number] :])
    is_table = (
        len(lying) > 1
        and longest > 2 * len(lying)
        and len({words[number] for number in lying}) == 1
        and not any(sum(map(bool, row)) > 2 for row in others)
        and all(not cell or decimal(cell) is not None for cell in numbers)
    )
    if not is_table:
        return table
    columns = zip_longest(*(table[number] for number in lying), fillvalue="")
    return [*others, *map(list, columns)]
