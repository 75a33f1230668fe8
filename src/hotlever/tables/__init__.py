"""Tables in text files, whoever wrote them.

Encoding, separator, decimal sign, header and units are found, not asked for; what the columns and
the lines beside the rows mean is for the caller to know. `read_table` is for files of one table,
where a line that is no row is an error; `find_tables` for files with numbers anywhere.
"""
# ruff: noqa: F401 (what is imported here is what the package offers)

from hotlever.tables.binary import groups_in
from hotlever.tables.table import TextTable
from hotlever.tables.text_tables import find_tables, read_table
