"""Measured data of one lever: the record, and the files that it is read from.

`columns` knows the names and units of the columns, `contents` the comments that give circuit and
surroundings and what no lever can show, `rows` the order of the rows, `compliance` what an
instrument has clipped; `measurement_file` completes the rows and takes these together.
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
