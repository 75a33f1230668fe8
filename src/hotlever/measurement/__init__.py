"""Measured data of one lever: the record, and the files that it is read from.

`columns` knows the names and units of the columns, `rows` their order and which of them an
instrument has clipped; `measurement_file` reads the comments that give circuit and surroundings,
refuses what no lever can show, completes the rows and takes these together.
"""
# ruff: noqa: F401 (what is imported here is what the package offers)

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
