"""What is said of single spectra by hand: where the line is, which part is fitted, or neither."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np

from hotlever.errors import InputError, shown, unknown_name
from hotlever.raman.peak import PeakOptions
from hotlever.raman.spectrum import Spectrum
from hotlever.tables import read_table

#: Header of a table of corrections.
COLUMNS = ("file", "start_cm-1", "from_cm-1", "to_cm-1", "use")
_USE = {"": True, "yes": True, "no": False}


@dataclass(frozen=True)
class Correction:
    """Of one spectrum; what is left out is as for all."""

    start: float | None = None  #: the line's place, cm⁻¹, near enough for the fit to begin there
    low: float | None = None  #: the part that is fitted begins here, cm⁻¹
    high: float | None = None  #: and ends here, cm⁻¹
    use: bool = True  #: whether the spectrum is measured at all

    def of(self, options: PeakOptions) -> PeakOptions:
        """Return how the line of this spectrum is fitted, where those of all are as in `options`.

        Examples
        --------
        >>> Correction(start=516.0, high=540.0).of(PeakOptions()).window
        (440.0, 540.0)
        """
        low, high = options.window
        window = (low if self.low is None else self.low, high if self.high is None else self.high)
        start = options.start if self.start is None else self.start
        return replace(options, start=start, window=window).validate()


#: What is said of most spectra.
NOTHING = Correction()


def corrections_text(corrections: Mapping[str, Correction]) -> str:
    """Return the table that `read_corrections` reads.

    Examples
    --------
    >>> print(corrections_text({"tip_04.txt": Correction(start=516.5)}), end="")
    file,start_cm-1,from_cm-1,to_cm-1,use
    tip_04.txt,516.5,,,yes
    """
    written = io.StringIO()
    table = csv.writer(written, lineterminator="\n")
    table.writerow(COLUMNS)
    for name, correction in corrections.items():
        *numbers, use = astuple(correction)
        cells = ("" if number is None else f"{number:.10g}" for number in numbers)
        table.writerow((name, *cells, "yes" if use else "no"))
    return written.getvalue()


def read_corrections(path: str | os.PathLike[str]) -> dict[str, Correction]:
    """Read a table of corrections: one row for each spectrum that needs one.

    Parameters
    ----------
    path : path
        A table with the columns ``file``, ``start_cm-1``, ``from_cm-1``, ``to_cm-1`` and ``use``
        (yes or no), in any order and all but the first as far as they are needed; a cell is empty
        where nothing is said. A file may be named with some of its folders before it.

    Raises
    ------
    InputError
        If it is no such table, names a file twice, or says what no spectrum can be fitted with.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = Path(folder) / "by-hand.csv"
    ...     _ = table.write_text("file,start_cm-1,use\\ntip_04.txt,516.5,\\ntip_07.txt,,no\\n")
    ...     read_corrections(table)["tip_07.txt"].use
    False
    """
    table = read_table(path, "rows of file name and what is corrected")
    heads = [name.strip().lower().replace(" (", "_").rstrip(")") for name in table.names]
    for name, head in zip(table.names, heads, strict=True):
        if head not in COLUMNS:
            raise unknown_name("column", name, COLUMNS, table.where(-1))
    if "file" not in heads or len(set(heads)) < len(heads):
        raise InputError(
            f"{table.where(-1)}: found {shown(', '.join(table.names))}, expected the column file "
            f"and any of {', '.join(COLUMNS[1:])}, each once"
        )
    corrections: dict[str, Correction] = {}
    nothing = np.full(len(table.rows), np.nan)
    numbers = [
        table.numbers(heads.index(name), name) if name in heads else nothing
        for name in COLUMNS[1:4]
    ]
    for row, cells in enumerate(table.rows):
        name = Path(cells[heads.index("file")]).as_posix()
        if name in corrections:
            raise InputError(f"{table.where(row)}: '{shown(name)}' has a row above")
        at_row = (float(column[row]) for column in numbers)
        start, low, high = (None if np.isnan(value) else value for value in at_row)
        use = cells[heads.index("use")].strip().lower() if "use" in heads else ""
        if use not in _USE:
            raise InputError(f"{table.where(row)}: use: found '{shown(use)}', expected yes or no")
        corrections[name] = Correction(start, low, high, _USE[use])
        try:
            corrections[name].of(PeakOptions())
        except InputError as error:
            raise InputError(f"{table.where(row)}: {error}") from None
    return corrections


def of_spectrum(spectrum: Spectrum, corrections: Mapping[str, Correction]) -> Correction:
    """Return what is said of a spectrum, the row with the most folders before its name first."""
    names = _names(spectrum) if corrections else []
    return next((corrections[name] for name in names if name in corrections), NOTHING)


def check_corrections(
    corrections: Mapping[str, Correction], spectra: Iterable[Spectrum], where: str
) -> list[str]:
    """Check that there is a spectrum for each correction.

    Parameters
    ----------
    corrections : mapping
    spectra : iterable of Spectrum
        All that there are.
    where : str
        The table's name, for the error.

    Returns
    -------
    list of str
        Corrections for folders that none of the spectra is from.

    Raises
    ------
    InputError
        If there is none; the text names the nearest one.
    """
    if not corrections:
        return []
    spectra_named = dict.fromkeys(name for spectrum in spectra for name in _names(spectrum))
    folders = {Path(name).parent for name in spectra_named}
    elsewhere = [name for name in corrections if Path(name).parent not in folders]
    for name in corrections:
        if name not in spectra_named and name not in elsewhere:
            beside = [other for other in spectra_named if Path(other).parent == Path(name).parent]
            raise unknown_name("spectrum", name, beside, where)
    return elsewhere


def _names(spectrum: Spectrum) -> list[str]:
    """By what a spectrum may be called: its name, with more or fewer folders before it."""
    folders = Path(spectrum.folder).parts
    return [Path(*folders[depth:], spectrum.name).as_posix() for depth in range(len(folders) + 1)]
