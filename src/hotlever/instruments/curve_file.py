"""The file of a measurement that goes on: each row is on disk as soon as it is read."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import IO

import numpy as np

from hotlever.errors import InputError
from hotlever.instruments.source_meter import Reading
from hotlever.probe import Probe
from hotlever.quantities import QUANTITIES


class CurveFile:
    """A CSV file of rows as they come, with circuit and surroundings in comments above.

    It is a new one: a measurement never takes the place of another. Without a row there is none.

    Parameters
    ----------
    path : path
    probe : Probe
        Whose circuit and medium are said.
    with_reader : bool
        Whether there is a column for the reader.

    Raises
    ------
    InputError
        On entering its context, if the file exists or cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], probe: Probe, with_reader: bool) -> None:
        self._path, self._probe = Path(path), probe
        self._names = ("bias_V", "current_mA", "reader_V")[: 2 + with_reader]
        self._has_heads = False
        self._file: IO[str]

    def __enter__(self) -> CurveFile:
        try:
            self._file = open(self._path, "x", encoding="utf-8", newline="\n")
        except FileExistsError:
            raise InputError(
                f"{self._path}: exists, expected a new name: a measurement overwrites nothing"
            ) from None
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written ({error.strerror})") from None
        circuit, medium = self._probe.circuit, self._probe.surroundings.medium
        self.comment(f"measured by hotlever from {datetime.now().astimezone().isoformat()}")
        self.comment(f"R_s (kOhm): {circuit.series_kohm:.9g}")
        self.comment(f"base temperature (K): {circuit.base_temperature_K:.6g}")
        self.comment(f"medium: {medium}")
        return self

    def comment(self, text: str) -> None:
        """Write a line of words."""
        self._write(f"# {text}")

    def add(self, reading: Reading) -> None:
        """Write a row, the first one behind what heads the columns."""
        if not self._has_heads:
            quantities = [QUANTITIES[name] for name in self._names]
            self._write(",".join(f"{each.symbol} ({each.unit})" for each in quantities))
            self._has_heads = True
        values = (getattr(reading, name) for name in self._names)
        self._write(",".join("" if np.isnan(value) else f"{value:.9g}" for value in values))

    def _write(self, line: str) -> None:
        self._file.write(f"{line}\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()
        if not self._has_heads:
            self._path.unlink(missing_ok=True)
