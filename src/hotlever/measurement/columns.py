"""Which column of a measurement file is which quantity, by its heading or as the user says."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hotlever.errors import InputError, counted, excerpt, quoted, unknown_name
from hotlever.files import read_bytes
from hotlever.measurement.data import MEASURED
from hotlever.quantities import FITTED, MEASURANDS
from hotlever.tables import TextTable, read_table
from hotlever.tables.table import text_lines
from hotlever.types import Array
from hotlever.units import amount, conversion, is_time, name_and_unit, unknown_unit

_SYMBOLS = {
    heading: measurand.symbol
    for measurand in MEASURANDS.values()
    for heading in measurand.headings.split()
}
#: In place of a quantity: a column that is not used.
UNUSED = "unused"
#: In place of a quantity: the group of a binary file that the columns are those of.
GROUP = "group"


@dataclass(frozen=True)
class Column:
    """Index of a quantity in a table, its unit, and factor and offset to the unit inside."""

    symbol: str
    index: int
    heading: str
    unit: str
    scale: tuple[float, float]

    @property
    def origin(self) -> str:
        """Its heading or number, with the unit where that stands elsewhere."""
        heading = f"'{excerpt(self.heading)}'" if self.heading else f"column {self.index + 1}"
        written = name_and_unit(self.heading)[1] == self.unit
        return heading if written else f"{heading} in {self.unit}"

    def values(self, table: TextTable) -> Array:
        """Return the data in the unit used inside; raises InputError (see `TextTable.numbers`)."""
        factor, offset = self.scale
        return factor * table.numbers(self.index, self.symbol) + offset


def symbol_of(name: str) -> str | None:
    """Return the quantity that a column of this name holds, None if that is not known.

    Examples
    --------
    >>> symbol_of("Vb"), symbol_of("I_h"), symbol_of("Voltage")
    ('V_b', 'I_h', None)
    """
    return _SYMBOLS.get(_bare(name))


def _bare(name: str) -> str:
    return re.sub(r"[\W_]+", "", name[:40]).lower()


class Assignment(NamedTuple):
    """What a user says of a column: a quantity, or None if it is not used, and its unit."""

    symbol: str | None  #: or `GROUP`, of which the heading is the name
    unit: str | None
    quantity: str  #: as it was written
    heading: str


def parse_columns(texts: Iterable[str | os.PathLike[str]]) -> dict[str, str]:
    """Parse ``I_h (uA)=Current``: which heading, or number, of a column is which quantity.

    ``unused=Current`` is a column that is not used, whatever its heading says, and ``group=up`` the
    group of a binary file that the columns are of. What has no ``=`` is a file of such lines; those
    that start with ``#`` are comments.

    Raises
    ------
    InputError
        If there is no such quantity, unit or file, or one is given twice.

    Examples
    --------
    >>> parse_columns(["I_h (uA)=Current", "V_b (V)=2"])
    {'I_h (uA)': 'Current', 'V_b (V)': '2'}
    """
    return {each.quantity: each.heading for each in assignments(texts)}


def assignments(
    columns: Iterable[str | os.PathLike[str]] | Mapping[str, str] | None,
) -> list[Assignment]:
    """Return what is said of columns, in texts or parsed; see `parse_columns`."""
    if columns is None or isinstance(columns, Mapping):
        columns = [f"{quantity}={heading}" for quantity, heading in (columns or {}).items()]
    assigned: list[Assignment] = []
    for where, line in (line for text in columns for line in _lines(text)):
        quantity, _, heading = (part.strip(' \t"') for part in line.partition("="))
        if not heading:
            raise InputError(
                f"{where}: found '{excerpt(line)}', expected one like 'I_h (uA)=Current'"
            )
        if quantity.partition(" ")[0] == UNUSED:
            assigned.append(Assignment(None, None, f"{UNUSED} {len(assigned) + 1}", heading))
            continue
        symbol = GROUP if quantity == GROUP else quantity_of(quantity, assigned=True)
        unit = name_and_unit(quantity)[1]
        if symbol is None:
            names = [*MEASURANDS, UNUSED, GROUP]
            raise unknown_name("quantity", name_and_unit(quantity)[0], names, where)
        if unit is not None and conversion(unit, MEASURANDS[symbol].typed_unit) is None:
            raise unknown_unit(unit, MEASURANDS[symbol].typed_unit, f"{where}: {symbol}")
        if any(symbol == each.symbol for each in assigned):
            raise InputError(f"{where}: {symbol} is given twice, expected once")
        assigned.append(Assignment(symbol, unit, quantity, heading))
    return assigned


def _lines(text: str | os.PathLike[str]) -> Iterator[tuple[str, str]]:
    """Give an assignment, or those of a file, and where each stands."""
    if "=" in str(text):
        yield f"--column {text!s}", str(text)
        return
    for row, line in enumerate(text_lines(read_bytes(text, 100_000), str(text)), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield f"{text}: line {row}", line


def quantity_of(heading: str, *, assigned: bool = False) -> str | None:
    """Return the quantity that a heading, or what is assigned to one, names; None if not known.

    The name alone is no time, unless it is assigned: settings of instruments are called so too.
    """
    name, unit = name_and_unit(heading)
    of_time = assigned or conversion(unit or "", MEASURANDS["t"].typed_unit)
    return "t" if is_time(name) and of_time else symbol_of(name)


def measured_table(
    path: str | os.PathLike[str], columns: Mapping[str, str] | None
) -> tuple[TextTable, list[Assignment]]:
    """Read the table of a measurement file, below the row whose headings are known or assigned.

    Returns it, and what is said of its columns (`parse_columns`).

    Raises
    ------
    InputError
        If there is none.
    """
    said = assignments(columns)
    assigned = [each for each in said if each.symbol != GROUP]
    group = next((each.heading for each in said if each.symbol == GROUP), None)

    def is_heading(name: str) -> bool:
        bare = name_and_unit(name)[0]
        named = symbol_of(bare) is not None or any(
            _bare(bare) in measurand.plain.split() for measurand in MEASURANDS.values()
        )
        return named or _is_assigned(name, assigned)

    expected, stated_by = "one like 'V_b (V),I_h (mA),V_r (mV)'", f"--column '{GROUP}={{group}}'"
    return read_table(path, expected, True, is_heading, group, stated_by), assigned


def _is_assigned(name: str, assigned: Sequence[Assignment]) -> bool:
    """Whether a heading is named, with or without its unit, where something is said of columns."""
    names = {name.casefold(), name_and_unit(name)[0].casefold()}
    return any(each.heading.casefold() in names for each in assigned)


def find_columns(
    table: TextTable, assigned: Sequence[Assignment], *, driven: bool = False
) -> dict[str, Column]:
    """Find the column of each quantity, that of the time only in a table of what is in time.

    Parameters
    ----------
    table : TextTable
    assigned : sequence of Assignment
    driven : bool
        Whether a wave form is given, so that the table needs times and no bias.

    Raises
    ------
    InputError
        If a unit is missing or unknown, two columns are the same quantity, or there is no column
        of the bias, or of anything that depends on it.
    """
    where = table.where(-1)
    columns: dict[str, Column] = {}
    unused = {table.index(each.heading) for each in assigned if each.symbol is None}
    for symbol, unit, _, heading in assigned:
        if symbol is None:
            continue
        index = table.index(heading)
        other = next((name for name, column in columns.items() if column.index == index), None)
        if other is not None:
            raise InputError(
                f"{where}: --column says that {excerpt(heading)} is {other} and {symbol}, "
                "expected one of them"
            )
        columns[symbol] = _column(table, symbol, index, unit)
    in_time = driven or "t" in columns
    unavailable = unused | {column.index for column in columns.values()}
    candidates = defaultdict[str, list[int]](list)
    for index, heading in enumerate(table.names):
        named = quantity_of(heading)
        if named is not None and named not in columns and index not in unavailable:
            candidates[named].append(index)
    found: dict[str, int] = {}
    twice: dict[str, str] = {}
    for symbol, indices in candidates.items():
        # its own symbol names a quantity before any other name
        own = [i for i in indices if name_and_unit(table.names[i])[0].lower() == symbol.lower()]
        first, *others = own or indices
        if others and symbol != "t":
            twice[symbol] = str(first + 1)
        found[symbol] = first
    if twice:
        verb = "stands" if len(twice) == 1 else "stand"
        which = " ".join(_assignment(symbol, number) for symbol, number in twice.items())
        raise InputError(
            f"{where}: column{'s' * (len(twice) > 1)} {', '.join(map(quoted, twice))} {verb} "
            f"twice; {which} says which, by number or heading"
        )
    _check_units(table, found)
    columns |= {symbol: _column(table, symbol, index, None) for symbol, index in found.items()}
    if "t" in columns and not (in_time or _are_brief(table, columns["t"])):
        del columns["t"]
    if not driven:
        _take_the_only_ones(table, columns, unused)
    _require(table, columns, driven)
    return columns


def _take_the_only_ones(
    table: TextTable, columns: dict[str, Column], unused: Collection[int]
) -> None:
    """Let a plain heading be the bias, or the current, if nothing else in its unit may be it."""
    for symbol, measurand in MEASURANDS.items():
        used = {*unused, *(column.index for column in columns.values())}
        unit, headings = measurand.typed_unit, measurand.plain.split()
        may_be = [
            index
            for index, heading in enumerate(table.names)
            if index not in used and conversion(name_and_unit(heading)[1] or "", unit)
        ]
        missing = symbol not in columns and not (symbol == "V_b" and "V_l" in columns)
        plain = [i for i in may_be if _bare(name_and_unit(table.names[i])[0]) in headings]
        if missing and plain == may_be and len(plain) == 1:
            columns[symbol] = _column(table, symbol, plain[0], None)


def _check_units(table: TextTable, found: Mapping[str, int]) -> None:
    """Ask for the units of all columns that have none, in one question."""
    bare = {
        symbol: table.names[index]
        for symbol, index in found.items()
        if table.names[:1] != ["DataName"] and name_and_unit(table.names[index])[1] is None
    }
    if len(bare) > 1:
        expected = ", ".join(f"'{MEASURANDS[symbol].heading}'" for symbol in bare)
        raise InputError(
            f"{table.where(-1)}: {counted(len(bare), 'column')} without a unit: "
            f"{', '.join(map(quoted, bare.values()))}; expected {expected} or other units in "
            f"parentheses; {' '.join(_assignment(*each) for each in bare.items())} gives them"
        )


def _column(table: TextTable, symbol: str, index: int, assigned: str | None) -> Column:
    """Return a column with its unit, which the file or the user gives."""
    heading, inside = table.names[index], MEASURANDS[symbol].typed_unit
    where = f"{table.where(-1)}: column '{excerpt(heading or str(index + 1))}'"
    written = name_and_unit(heading)[1]
    # a B1500's table is in the units of SI without a prefix
    if table.names[:1] == ["DataName"]:
        written = written or inside[-1]
    unit = assigned or written
    if unit is None:
        raise InputError(
            f"{where} has no unit, expected '{MEASURANDS[symbol].heading}' or another unit in "
            f"parentheses; {_assignment(symbol, heading or str(index + 1))} gives one"
        )
    difference = symbol.startswith("d")
    scale = conversion(unit, inside, difference)
    if scale is None:
        raise unknown_unit(unit, inside, f"{table.where(-1)}: {excerpt(heading)}")
    if assigned and written:
        own = conversion(written, inside, difference)
        # the unit of the heading may be that of any quantity
        measures = any(
            conversion(written, measurand.typed_unit) for measurand in MEASURANDS.values()
        )
        if own != scale and (own is not None or measures):
            raise InputError(
                f"{where}: its unit is {written}, expected {assigned} as --column says"
            )
    return Column(symbol, index, heading, unit, scale)


def _assignment(symbol: str, heading: str = "HEADING") -> str:
    return f"--column '{MEASURANDS[symbol].heading}={excerpt(heading)}'"


def _are_brief(table: TextTable, column: Column) -> bool:
    """Whether times are numbers, and close enough to each other for what is measured in time.

    Longer ones are slow sweeps with the time of each row.
    """
    if table.dialect.number(table.rows[0][column.index]) is None:
        return False  # clocks show no numbers
    times = column.values(table)
    return bool(0.0 < np.nanmax(times, initial=-np.inf) - np.nanmin(times, initial=np.inf) <= 1e4)


def _require(table: TextTable, columns: Mapping[str, Column], driven: bool) -> None:
    """Refuse a table without bias or times, or without anything that depends on them."""
    if driven and "t" not in columns:
        raise InputError(
            f"{table.where(-1)}: no column of the time, expected one like 'time (us)' beside a "
            f"wave form; another name with --column 't (s)={excerpt(table.names[0]) or 1}'"
        )
    others, rows = len(table.names) - len(columns), len(table.rows)
    if columns and not table.is_named and others > rows:
        raise InputError(
            f"{table.where(-1)}: {counted(rows, 'row')} of {len(table.names)} numbers without a "
            "header row, expected a row for each bias: are rows and columns swapped?"
        )
    observed = {
        *(column.symbol for column in FITTED.values()),
        *(["V_l"] if "t" in columns else []),
    }
    has_bias = driven or "V_b" in columns or {"V_l", "I_h"} <= columns.keys()
    has_bias = has_bias or ("D" in columns and constant_bias(table) is not None)
    if has_bias and observed & columns.keys():
        return
    names = ", ".join(repr(excerpt(name)) for name in table.names[:9])
    header = f"the header names {names}" if table.is_named else "numbers without a header row"
    voltages = (name for name in table.names if conversion(name_and_unit(name)[1] or "", "V"))
    example = next(voltages, "HEADING" if table.is_named else "1")
    raise InputError(
        f"{table.where(-1)}: {header}; expected 'V_b (V)' and at least one of 'I_h (mA)', "
        "'V_r (mV)', 'V_bridge (mV)', 'T_tip (K)', or 'V_l (V)' and 'I_h (mA)'; beside a time V_b, "
        "or a wave form "
        f"such as --pulse 10V,5us, and any of them; other names with {_assignment('V_b', example)}"
        f"{table.without}"
    )


def constant_bias(table: TextTable) -> float | None:
    """Return the one bias (V) of a table that a comment states, such as ``# V_b (V): 8``."""
    for key, value in table.settings.items():
        if quantity_of(key) == "V_b":
            return amount(value, name_and_unit(key)[1], "V", f"{table.path}: {excerpt(key)}")
    return None


def is_taken_as_bias(columns: Mapping[str, Column], assigned: Sequence[Assignment]) -> bool:
    """Whether the bias is a voltage that nobody calls so."""
    is_assigned = any(each.symbol == "V_b" for each in assigned)
    return not is_assigned and "V_b" in columns and quantity_of(columns["V_b"].heading) != "V_b"


def note_on_bias(
    table: TextTable, columns: Mapping[str, Column], assigned: Sequence[Assignment]
) -> list[str]:
    """Say which heading was taken as the bias without naming it."""
    if not is_taken_as_bias(columns, assigned):
        return []
    bias = columns["V_b"]
    return [
        f"{table.path}: {bias.origin} is the only voltage and counts as the bias; if it is "
        f"that over the lever, say {_assignment('V_l', bias.heading)}"
    ]


def note_on_header(table: TextTable, assigned: Sequence[Assignment]) -> list[str]:
    """Say what was taken for the header row where nobody knows a heading in it."""
    names = [name for name in table.names if name.strip()]
    if not names or any(
        _is_assigned(name, assigned)
        or name_and_unit(name)[1] is not None
        or quantity_of(name) is not None
        for name in names
    ):
        return []
    row = ", ".join(f"'{excerpt(name)}'" for name in names[:6])
    return [f"{table.where(-1)}: {row} is taken for the header row"]


def note_on_words(table: TextTable, columns: Mapping[str, Column]) -> list[str]:
    """Say which rows have a word where nearly all others count, such as ``Total``: no datum."""
    used = {column.index for column in columns.values()}
    notes = []
    for index in set(range(len(table.names))) - used:
        cells = [row[index] for row in table.rows]
        words = [row for row, cell in enumerate(cells) if table.dialect.number(cell) is None]
        if 0 < len(words) < np.isfinite(table.array[:, index]).sum():
            notes.append(
                f"{table.where(words[0])}: '{excerpt(cells[words[0]])}' stands where other rows "
                "have a number, and the row counts; to leave it out, begin it with #"
            )
    return notes


def note_on_unused(table: TextTable, columns: Mapping[str, Column]) -> list[str]:
    """Say which columns are not used, and what they may be."""
    used = {column.index for column in columns.values()}
    unused = [
        (heading, name_and_unit(heading)[1] or "")
        for index, heading in enumerate(table.names)
        if index not in used and heading != "DataName" and heading.strip()
    ]
    missing = [measurand for measurand in MEASURED if measurand.symbol not in columns]
    hints = []
    for heading, unit in unused:
        likely = next((column for column in missing if conversion(unit, column.typed_unit)), None)
        if likely is not None:
            hints.append(
                f"if one is {likely.symbol}, say --column '{likely.symbol}={excerpt(heading)}'"
            )
    if not unused:
        return []
    names = [f"'{excerpt(heading)}'" for heading, _ in unused]
    most = 6
    more = f" and {len(names) - most} more" if len(names) > most else ""
    what = f"columns {', '.join(names[:most])}{more} are"
    what = what if len(names) > 1 else f"column {names[0]} is"
    return [f"{table.path}: {'; '.join([f'{what} not used', *hints[:2]])}"]
