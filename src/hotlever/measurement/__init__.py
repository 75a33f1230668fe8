"""Measured data of one lever: the record, and the files that it is read from.

`columns` knows the names and units of the columns, `contents` the comments that give circuit and
surroundings and what no lever can show, `bias` completes the rows, `rows` polarities
and the order of the rows, `compliance` what an instrument has clipped; `reading` takes these
together.
"""

from hotlever.measurement.columns import parse_columns
from hotlever.measurement.data import MEASURED, Measurement, with_measured_circuit
from hotlever.measurement.measurement_file import (
    FileColumn,
    file_columns,
    file_groups,
    given_measurement,
    read_measurement,
    read_measurement_of,
)

__all__ = [
    "MEASURED",
    "FileColumn",
    "Measurement",
    "file_columns",
    "file_groups",
    "given_measurement",
    "parse_columns",
    "read_measurement",
    "read_measurement_of",
    "with_measured_circuit",
]
