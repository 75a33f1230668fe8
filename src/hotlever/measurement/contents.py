"""A measurement file while it is read: what it may hold, and how it is refused or noted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.measurands import FITTED, MEASURANDS
from hotlever.measurement.columns import Column
from hotlever.measurement.data import DISTANCE, LEVER, MEASURED, TIME
from hotlever.measurement.settings import Settings
from hotlever.probe import Circuit
from hotlever.tables import TextTable
from hotlever.types import Array, Mask
from hotlever.units import plausible


@dataclass
class Contents:
    """Rows and settings of a file, which `bias` and `histories` complete.

    Attributes
    ----------
    table : TextTable
    columns : dict of str to Column
        By symbol: the quantities that the file gives.
    settings : Settings
    notes : list of str
        What of the file was not used or not understood, and what looks wrong in it.
    values : dict of str to ndarray, shape (n,)
        Every quantity by its symbol, in the unit inside; NaN where nothing is known.
    origin : dict of str to str
        The column of a quantity, or what it follows from.

    Raises
    ------
    InputError
        If a cell is no number.
    """

    table: TextTable
    columns: dict[str, Column]
    settings: Settings
    notes: list[str]
    values: dict[str, Array] = field(init=False)
    origin: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        self.origin = {symbol: column.origin for symbol, column in self.columns.items()}
        self.values = dict.fromkeys(MEASURANDS, np.full(len(self.table.rows), np.nan))
        for symbol, column in self.columns.items():
            self.values[symbol] = column.values(self.table)
            if symbol not in ("V_b", LEVER, TIME):
                filled = np.array([bool(row[column.index]) for row in self.table.rows])
                missing = np.isnan(self.values[symbol]) & filled
                self.note_rows(missing, f"{symbol} is written as missing")

    def cell(self, symbol: str, row: int) -> str:
        """Return a cell as it stands in the file, to quote it."""
        return shown(self.table.rows[row][self.columns[symbol].index])

    def refuse(self, rows: Mask, expected: str, *symbols: str) -> None:
        """Refuse the first of some rows, (n,) of bool, for what its cells of `symbols` hold.

        Raises
        ------
        InputError
            If there is one; the text says what was `expected`.
        """
        if rows.any():
            row = int(np.argmax(rows))
            cells = " and ".join(f"{symbol} is '{self.cell(symbol, row)}'" for symbol in symbols)
            raise InputError(f"{self.table.where(row)}: {cells}, expected {expected}")

    def note(self, text: str) -> None:
        """Note what concerns the whole file."""
        self.notes.append(f"{self.table.path}: {text}")

    def note_rows(self, rows: Mask, text: str) -> None:
        """Note what is odd about some rows, (n,) of bool, if there are any."""
        if rows.any():
            others = f", and in {rows.sum() - 1} more rows" if rows.sum() > 1 else ""
            self.notes.append(f"{self.table.where(int(np.argmax(rows)))}: {text}{others}")


#: A standard error this much smaller than the largest value is none.
_LEAST_ERROR = 1e-9
#: Part of the largest value by which noise and drift may push a current or voltage below 0.
NOISE = 0.05
#: K, and standard errors, by which a tip may seem colder than its base.
_COLDER_K, _COLDER_ERRORS = 20.0, 4.0
#: Resistances (kΩ) of levers, cold and hot.
_LEVER_KOHM = (0.1, 60.0)
#: K; probe files take no colder base.
_COLDEST_BASE_K = 250.0


def colder_than_base(tip_K: Array, error_K: Array, base_K: float) -> Mask:
    """Return where a tip seems colder than its base by more than an offset or noise explain."""
    margin = np.maximum(_COLDER_K, _COLDER_ERRORS * np.nan_to_num(error_K))
    return np.asarray(tip_K < base_K - margin)


def check(contents: Contents, *, signed: bool = False, series_ohm: float = 0.0) -> None:
    """Refuse what no lever can show, and note what it hardly can.

    `series_ohm` is in series with the lever if the file does not say what is.

    What may be of either sign is asked less: in time a current goes on or off before the bias is
    known to, and other supplies drive a current of their own.

    Raises
    ------
    InputError
        If a value cannot be, or the largest of a quantity shows that its unit is wrong.
    """
    values, settings = contents.values, contents.settings.values
    for symbol in (each.symbol for each in MEASURED if each.symbol in contents.columns):
        of, data = symbol.removeprefix("d"), values[symbol]
        unit, (low, high) = MEASURANDS[of].unit, MEASURANDS[of].plausible
        size = np.nanmax(np.abs(values[of]), initial=0.0)
        if symbol != of:
            expected = f"a standard error above 0 and up to {high:g} {unit}, or an empty cell"
            contents.refuse((data <= _LEAST_ERROR * size) | (data > high), expected, symbol)
        elif symbol != DISTANCE and not np.isnan(data).all():
            if unit == "K":
                contents.refuse(data <= 0.0, "a temperature above 0 K", symbol)
            where = f"{contents.table.path}: the largest {symbol}"
            either = signed or MEASURANDS[of].signed
            plausible(where, unit, size if either else np.nanmax(data), low, high)
            plausible(where, unit, size, low, high)
            negative = (data < -NOISE * size) & (not either)
            contents.note_rows(negative, f"{symbol} is negative")

    base = settings.get("base_temperature_K", _COLDEST_BASE_K)
    for symbol in (each.symbol for each in FITTED.values() if each.unit == "K"):
        contents.note_rows(
            colder_than_base(values[symbol], values["d" + symbol], base),
            f"{symbol} is below the base temperature ({base:g} K), perhaps in another unit",
        )
    if not signed:
        _check_lever_voltage(contents, series_ohm)


def _check_lever_voltage(contents: Contents, series_ohm: float) -> None:
    """Refuse rows whose series resistor leaves no voltage for the lever."""
    bias, current = contents.values["V_b"], contents.values["I_h"]
    ohm = contents.settings.values.get("series_resistance_ohm", series_ohm)
    lever = Circuit(series_resistance_ohm=ohm).lever_voltage(bias, current)
    below = lever < -NOISE * bias.max()
    if below.any():
        row = int(np.argmax(below))
        raise InputError(
            f"{contents.table.where(row)}: V_b = {bias[row]:g} V and I_h = {current[row]:g} mA "
            f"leave {lever[row]:.3g} V for the lever behind R_s = {ohm:g} ohm, expected a voltage "
            f"above 0{_likely_mistakes(bias, current, ohm / 1000.0)}"
        )


def _likely_mistakes(bias: Array, current: Array, series_kohm: float) -> str:
    """Ask after what would leave a lever of some kilo-ohm behind a series resistance; or nothing.

    Of biases (V) and currents (mA) that leave none.
    """
    heated = (bias > 0) & (current > 0)
    if not heated.any():
        return ""
    kohm = bias[heated] / current[heated]
    lever_kohm = {
        "is V_b the lever's own voltage, not the bias?": kohm,
        "are the columns of V_b and I_h swapped?": 1.0 / kohm - series_kohm,
        "is the unit of I_h wrong (µA labelled mA)?": 1000.0 * kohm - series_kohm,
        "is the unit of V_b wrong (V labelled mV)?": 1000.0 * kohm - series_kohm,
        "is the unit of R_s wrong (ohm labelled kOhm)?": kohm - series_kohm / 1000.0,
    }
    low, high = _LEVER_KOHM
    questions = [ask for ask, of in lever_kohm.items() if low < of.min() and of.max() < high]
    return f": {' or: '.join(questions)}" if questions else ""
