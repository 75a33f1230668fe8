"""Tables with what instruments, spreadsheets and people put beside plain numbers.

Cells that say "no value" in the words of many makers, in the first, a middle or the last row;
minus signs that are dashes; marks of thousands; rows that are too short or too long, or of numbers
written in another way; lines of totals; encodings; groups of TDMS files. Each is written here from
a curve, so that its rows are known; some can only be refused.

Run ``python benchmarks/odd_tables.py`` for a table of how each is read: its rows are right, it is
refused with one line, or it is wrong without a word.
"""

from __future__ import annotations

import io
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hotlever import InputError, read_measurement
from instruments import BIAS, CURRENT, SECONDS, rows

#: Both polarities, the negative one first: half of the rows begin with a sign.
BOTH = np.concatenate((-BIAS[::-1], BIAS))
BOTH_CURRENT = np.concatenate((-CURRENT[::-1], CURRENT))
#: Columns by their numbers, for tables without headings.
NUMBERED = {"V_b (V)": "1", "I_h (mA)": "2"}
HEADER = "V_b (V),I_h (mA)\n"


class OddTable(NamedTuple):
    """A file, what to tell of its columns, and its rows; None where it can only be refused."""

    name: str
    raw: bytes
    columns: dict[str, str]
    bias: np.ndarray | None
    current: np.ndarray | None


def odd(
    name: str,
    text: str | bytes,
    columns: dict[str, str] | None = None,
    missing: Sequence[int] = (),
    encoding: str = "utf-8",
    *,
    bias: np.ndarray | None = BIAS,
    current: np.ndarray | None = CURRENT,
) -> OddTable:
    """Return a table, whose current is not known in the rows of these numbers."""
    if current is not None:
        current = current.copy()
        current[list(missing)] = np.nan
    raw = text if isinstance(text, bytes) else text.encode(encoding)
    return OddTable(name, raw, columns or {}, bias, current)


def cells(values: np.ndarray, form: str = "{:.7g}") -> list[str]:
    """Return numbers as text."""
    return [form.format(value) for value in values]


def told(values: np.ndarray, words: dict[int, str], form: str = "{:.7g}") -> list[str]:
    """Return numbers as text, with words in place of some."""
    text = cells(values, form)
    for row, word in words.items():
        text[row] = word
    return text


def respelt(values: np.ndarray, spell: Callable[[str], str], form: str = "{:.7g}") -> list[str]:
    """Return numbers as text that is written in another way."""
    return [spell(cell) for cell in cells(values, form)]


def no_values() -> Iterator[OddTable]:
    """Tables with cells that say that there is none."""
    spelt = (
        ("Keithley 2400, not a number", "+9.910000E+37", ","),
        ("Keithley 2400, overflow", "9.9E37", ","),
        ("Keithley 2600", "nan", "\t"),
        ("Keithley 6517", "OVERFLOW", "\t"),
        ("KickStart", "Overflow", ","),
        ("B1500", "199.999E+99", ","),
        ("Fluke", "OL", ";"),
        ("Gossen", "O.L", ";"),
        ("Hioki", "OVER", ";"),
        ("Yokogawa", "-OVER", ","),
        ("Graphtec, above", "+++++++", ","),
        ("Graphtec, below", "-------", ","),
        ("Graphtec, open", "BURNOUT", ","),
        ("LabVIEW", "-Inf", "\t"),
        ("PicoScope", "∞", ","),
        ("Visual C", "-1.#IND", ","),
        ("dashes", "---", " "),
        ("an em dash", "—", ","),
        ("Fortran", "*******", " "),
        ("a database", "NULL", ";"),
        ("R", "NA", ","),
        ("Python", "None", ","),
        ("Excel", "#N/A", ";"),
        ("Excel in Germany", "#ZAHL!", ";"),
    )
    for index, (maker, word, sep) in enumerate(spelt):
        comma = sep == ";"
        where = ((0,), (0, 1, 2), (12,), (24,))[index % 4]
        text = rows(BIAS, told(CURRENT, dict.fromkeys(where, word)), sep=sep)
        if comma:
            text = text.replace(".", ",").replace("O,L", "O.L")
        place = {0: "first", 12: "a middle", 24: "the last"}[where[0]]
        more = " three rows" if len(where) > 1 else " row"
        yield odd(f"{maker}, headerless, {place}{more}", text, NUMBERED, where)
        if index % 2:
            head = HEADER.replace(",", "  " if sep == " " else sep)
            yield odd(f"{maker}, with a header, {place}{more}", head + text, None, where)
    resistance = ["+9.910000E+37"] * 25
    number = {"V_b (V)": "1", "I_h (A)": "2"}
    elements = rows(BIAS, CURRENT / 1e3, resistance, SECONDS, ["+4.921E+04"] * 25, form="{:+.6E}")
    yield odd("Keithley 2400, five elements", elements, number)
    volts = told(BIAS, {0: "#DIV/0!", 5: "#N/A"})
    table = "V_r (V);V_b (V);I_h (mA)\n" + rows(volts, BIAS, CURRENT, sep=";")
    yield odd("Excel, errors in the first cell", table)
    table = rows(volts, BIAS, CURRENT, sep=";")
    yield odd("Excel, errors, headerless", table, {"V_b (V)": "2", "I_h (mA)": "3"})
    yield odd(
        "no bias in the first row",
        HEADER + rows(told(BIAS, {0: "OVERFLOW"}), told(CURRENT, {0: "---"})),
        bias=None,
    )
    first = rows(told(BIAS, {0: "ERR"}), ["F"] * 25, CURRENT)
    third = {"V_b (V)": "1", "I_h (mA)": "3"}
    yield odd("an unknown word first, and a flag", first, third, bias=None)
    blanks = rows(volts, BIAS, CURRENT, sep="  ")
    yield odd("Excel, errors and blanks", "V_r (V)  V_b (V)  I_h (mA)\n" + blanks)
    point = rows(BIAS, told(CURRENT, {24: "9@91E+37"}), sep=";", comma=True).replace("@", ".")
    yield odd("decimal commas, no value with a point", point, NUMBERED, (24,))
    clipped = told(CURRENT, {0: "COMPL"})
    yield odd("a word that nobody knows", rows(BIAS, clipped), NUMBERED, bias=None)
    yield odd(
        "such a word in a sweep", rows(BIAS, told(CURRENT, {9: "COMPL"})), NUMBERED, bias=None
    )


def signs() -> Iterator[OddTable]:
    """Tables with other minus signs, and other ways to write a negative number."""
    both = {"bias": BOTH, "current": BOTH_CURRENT}
    for name, minus in (
        ("U+2212", "−"),
        ("en dash", "–"),
        ("non-breaking hyphen", "\u2011"),
        ("full width", "－"),
    ):
        text = rows(BOTH, BOTH_CURRENT).replace("-", minus)
        yield odd(f"minus as {name}, with a header", HEADER + text, **both)
        yield odd(f"minus as {name}, headerless", text, NUMBERED, **both)
    text = rows(BOTH, BOTH_CURRENT, sep=";", comma=True).replace("-", "–")
    head = HEADER.replace(",", ";")
    yield odd("minus of Windows, German", head + text, encoding="cp1252", **both)
    text = rows(BOTH, BOTH_CURRENT, sep="\t").replace("-", "−")
    yield odd("minus in UTF-16", "V_b (V)\tI_h (mA)\n" + text, encoding="utf-16", **both)
    text = rows(BIAS, CURRENT / 1e3, form="{:.6E}").replace("E-", "E−")
    yield odd("minus in the exponent", "V_b (V),I_h (A)\n" + text)
    text = rows(BIAS, CURRENT / 1e3, form="{:.6E}").replace("E-", "E−")
    yield odd("minus in the exponent, headerless", text, {"V_b (V)": "1", "I_h (A)": "2"})
    twice = "−".encode().decode("cp1252")
    text = rows(BOTH, BOTH_CURRENT).replace("-", twice)
    yield odd("minus, UTF-8 read twice", HEADER + text, **both)

    def accounted(cell: str) -> str:
        return f"({cell[1:]})" if cell.startswith("-") else cell

    def behind(cell: str) -> str:
        return f"{cell[1:]}-" if cell.startswith("-") else cell

    for name, spell in (
        ("in parentheses", accounted),
        ("sign behind", behind),
        ("sign apart", lambda cell: cell.replace("-", "- ")),
        ("an apostrophe before", lambda cell: cell.replace("-", "'-")),
        ("as formulas", lambda cell: cell if cell[0] != "-" else f"={cell}"),
        ("dollars", lambda cell: cell.replace("-", "-$")),
        ("about", lambda cell: cell.replace("-", "~-")),
    ):
        text = rows(respelt(BOTH, spell), respelt(BOTH_CURRENT, spell))
        yield odd(f"negative {name}", HEADER + text, **both)
        yield odd(f"negative {name}, headerless", text, NUMBERED, **both)


def spellings() -> Iterator[OddTable]:
    """Tables with thousands, units in cells, and text around numbers."""
    nano = CURRENT * 1e6
    in_nano = {"V_b (V)": "1", "I_h (nA)": "2"}

    def grouped(mark: str, comma: bool = False) -> list[str]:
        text = [f"{value:,.1f}" for value in nano]
        if comma:
            return [cell.replace(",", mark).replace(".", ",") for cell in text]
        return [cell.replace(",", mark) for cell in text]

    yield odd("thousands with blanks", rows(BIAS, grouped("\u00a0", True), sep=";"), in_nano)
    yield odd("thousands with apostrophes", rows(BIAS, grouped("'"), sep=";"), in_nano)
    yield odd("thousands with narrow blanks", rows(BIAS, grouped("\u202f"), sep="\t"), in_nano)
    quoted = [f'"{cell}"' for cell in grouped(",")]
    yield odd("thousands in quotes", "V_b (V),I_h (nA)\n" + rows(BIAS, quoted))
    whole = [f"{value:,.0f}" for value in nano]
    volts = [f"{value:.0f}" for value in BIAS * 1e3]
    yield odd(
        "thousands that may be decimals",
        "V_b (mV);I_h (nA)\n" + rows(volts, whole, sep=";"),
        bias=None,
    )
    decimals = rows(BIAS, CURRENT, form="{:.3f}").replace(".", ",")
    yield odd("decimal commas between commas", decimals, NUMBERED, bias=None)
    decimals = rows(BIAS, CURRENT, sep=" ", comma=True, form="{:.6f}")
    yield odd("decimal commas between blanks", decimals, NUMBERED)
    decimals = rows(BIAS, told(CURRENT, {0: "---"}), sep="\t", comma=True)
    yield odd("decimal commas, no first value", decimals, NUMBERED, (0,))
    with_units = rows([f"{v:.2f} V" for v in BIAS], [f"{i:.6f} mA" for i in CURRENT])
    yield odd("units in cells, with a header", HEADER + with_units)
    yield odd("units in cells, headerless", with_units, NUMBERED)
    milli = rows(BIAS, [f"{i:.6f}m" for i in CURRENT])
    yield odd("prefixes in cells", "V_b (V),I_h (A)\n" + milli)
    some = rows(told(BIAS, {0: "~0.4"}), told(CURRENT, {0: "<0.1"}))
    yield odd("limits in the first row", HEADER + some, bias=None)
    yield odd("limits in the first row, headerless", some, NUMBERED, bias=None)
    formulas = rows([f'="{v:.2f}"' for v in BIAS], [f'="{i:.6f}"' for i in CURRENT])
    yield odd("formulas of text", HEADER + formulas)
    status = rows(["CV+4.0E-01", *cells(BIAS[1:])], ["CI+6.9E-02", *cells(CURRENT[1:])])
    yield odd("HP 4145, status before the first row", HEADER + status, bias=None)
    apart = rows(BIAS, [f"{10 * i:.6f} E-01" for i in CURRENT], sep=" ")
    yield odd("exponents apart", apart, NUMBERED)
    fortran = rows(BIAS, CURRENT, sep="  ", form="{:.8E}").replace("E", "D")
    yield odd("Fortran's exponents", fortran, NUMBERED)
    yield odd(
        "units twice, and other ones",
        "V_b (V),I_h (mA)\nV,A\n" + rows(BIAS, CURRENT / 1e3),
        bias=None,
    )


def shapes() -> Iterator[OddTable]:
    """Tables without a header, with dates and words, short and long rows, and lines below."""
    dates = [f"2023-05-04 16:{minute:02d}:11" for minute in range(25)]
    told_numbers = {"V_b (V)": "2", "I_h (mA)": "3"}
    dated = rows(dates, BIAS, CURRENT)
    yield odd("dates, headerless", dated, told_numbers)
    lines = dated.splitlines(keepends=True)
    lines[9] = lines[9].rpartition(",")[0] + "\n"
    yield odd("dates, headerless, a short row", "".join(lines), told_numbers, (9,))
    own = "when,SMU a,SMU b\n"
    yield odd("dates, own names, a short row", own + "".join(lines), told_numbers, (9,))
    yield odd("dates below a comment", "# when, V_b (V), I_h (mA)\n" + dated)
    yield odd(
        "dates, no first value",
        rows(dates, BIAS, told(CURRENT, {0: "OVERFLOW"})),
        told_numbers,
        (0,),
    )
    words = rows(["SMU1"] * 25, BIAS, CURRENT)
    yield odd("words first, headerless", words, told_numbers)
    count = [str(number) for number in range(1, 26)]
    buffer = rows(count, CURRENT / 1e3, ["A"] * 25, BIAS, ["V"] * 25, ["F"] * 25, ["Front"] * 25)
    yield odd("Keithley's buffer, headerless", buffer, {"V_b (V)": "4", "I_h (A)": "2"})
    points = rows(["DataValue"] * 25, BIAS, told(CURRENT / 1e3, {0: "199.999E+99"}), sep=", ")
    yield odd("B1500, lines of data alone", points, {"V_b (V)": "2", "I_h (A)": "3"}, (0,))
    plain = HEADER + rows(BIAS, CURRENT)
    yield odd("totals below", plain + "Mean,0.61\n")
    yield odd("totals below, after a blank line", plain + "\nMaximum,1.16\nMinimum,0.07\n")
    yield odd("a word below", plain + "END\n")
    yield odd("end of a DOS file", plain + "\x1a")
    lines = plain.splitlines(keepends=True)
    lines[7] = "2.8\n"
    yield odd("a short row", "".join(lines), None, (6,))
    lines[7] = "2.8,0.3,0.4\n"
    yield odd("a long row", "".join(lines), bias=None)
    yield odd(
        "two files joined, with marks",
        ("\ufeff" + plain) * 2,
        bias=np.tile(BIAS, 2),
        current=np.tile(CURRENT, 2),
    )
    yield odd("sep= of Excel", "sep=;\n" + plain.replace(",", ";"))
    yield odd(
        "a repeated header in other units",
        plain + "V_b (V),I_h (A)\n" + rows(BIAS, CURRENT / 1e3),
        bias=None,
    )
    bars = "| V_b (V) | I_h (mA) |\n|---|---|\n" + rows(
        BIAS, CURRENT, sep=" | ", start="| ", last=" |"
    )
    yield odd("Markdown", bars)
    psql = " V_b (V) | I_h (mA) \n---------+----------\n" + rows(BIAS, CURRENT, sep=" | ")
    yield odd("a database's console", psql + "(25 rows)\n")
    underlined = "V_b (V)  I_h (mA)\n-------  --------\n" + rows(BIAS, CURRENT, sep="  ")
    yield odd("underlined headings", underlined)
    page = rows(BIAS, CURRENT, sep="</td><td>", start="<tr><td>", last="</td></tr>")
    yield odd("a page that calls itself .xls", f"<table>\n{page}</table>\n", NUMBERED)
    pairs = ",\n".join(f"[{v:.2f}, {i:.6f}]" for v, i in zip(BIAS, CURRENT, strict=True))
    yield odd("JSON, a row a line", f"[\n{pairs}\n]\n", NUMBERED)
    yield odd(
        "JSON, a column a line",
        f'{{"V_b (V)": {BIAS.tolist()},\n"I_h (mA)": {CURRENT.tolist()}}}\n',
        NUMBERED,
    )
    rigol = "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-3.00e-03,5.0e-07,\n"
    rigol += rows(count, BIAS, CURRENT, last=",,,")
    yield odd("Rigol, times beside the units", rigol, {"V_b (V)": "CH1", "I_h (mA)": "3"})
    yield odd(
        "UTF-16 without a mark",
        rows(BIAS, told(CURRENT, {0: "NaN"}), sep="\t"),
        NUMBERED,
        (0,),
        "utf-16-be",
    )
    yield odd("UTF-32", plain, encoding="utf-32")
    text = rows(BIAS, told(CURRENT, {0: "OVERFLOW"}))
    yield odd("UTF-8 with a mark, headerless", text, NUMBERED, (0,), "utf-8-sig")
    yield odd("numbers above a header", rows(BIAS[:3], CURRENT[:3]) + plain, bias=None)
    yield odd("rows with errors above a header", rows(BIAS[:3], ["ERR"] * 3) + plain, bias=None)


def groups() -> Iterator[OddTable]:
    """TDMS files of one group and several."""
    import nptdms

    def tdms(*channels: tuple[str, str, str, np.ndarray, dict[str, object]]) -> bytes:
        file = io.BytesIO()
        with nptdms.TdmsWriter(file) as writer:
            writer.write_segment(
                [
                    nptdms.ChannelObject(group, name, values, {"unit_string": unit, **more})
                    for group, name, unit, values, more in channels
                ]
            )
        return file.getvalue()

    def sweep(group: str, bias: np.ndarray, current: np.ndarray, **more: object) -> list:
        return [(group, "V_b", "V", bias, more), (group, "I_h", "mA", current, more)]

    yield odd("TDMS, one group", tdms(*sweep("up", BIAS, CURRENT)))
    two = sweep("lever 1", BIAS, CURRENT), sweep("lever 2", BIAS, 1.3 * CURRENT)
    yield odd("TDMS, two groups", tdms(*two[0], *two[1]), bias=None)
    yield odd("TDMS, two groups, one told", tdms(*two[0], *two[1]), {"group": "lever 1"})
    other = [("log", "T_stage", "°C", 0.0 * BIAS + 20.0, {})]
    yield odd("TDMS, a group of something else", tdms(*two[0], *other))
    fast = {"wf_increment": 0.5, "wf_start_offset": 0.0}
    slow = {"wf_increment": 1.0, "wf_start_offset": 0.0}
    rates = tdms(("a", "V_b", "V", BIAS, fast), ("a", "I_h", "mA", CURRENT[::2], slow))
    yield odd("TDMS, channels at two rates", rates, bias=None)
    lengths = tdms(("a", "V_b", "V", BIAS, {}), ("a", "I_h", "mA", CURRENT[:20], {}))
    yield odd("TDMS, a channel that ends early", lengths, None, range(20, 25))
    overflow = CURRENT.copy()
    overflow[0] = np.inf
    yield odd("TDMS, an overflow", tdms(*sweep("up", BIAS, overflow)), None, (0,))


KINDS = (no_values, signs, spellings, shapes, groups)

RIGHT, REFUSED, WRONG = "rows right", "refused with one line", "WRONG WITHOUT A WORD"


def outcome(table: OddTable, folder: Path) -> tuple[str, str]:
    """Return how a table is read, and what is said of it."""
    path = folder / ("data.tdms" if table.raw.startswith(b"TDSm") else "data.csv")
    path.write_bytes(table.raw)
    try:
        data = read_measurement(path, table.columns)
    except InputError as error:
        return REFUSED, str(error)
    said = "; ".join((*data.notes, *data.unused))
    if table.bias is None or data.bias_V.shape != table.bias.shape:
        return WRONG, f"{data.bias_V.size} rows; {said}"
    right = np.allclose(data.bias_V, np.abs(table.bias), rtol=1e-5)
    current = np.abs(table.current)
    right = right and np.allclose(data.current_mA, current, rtol=1e-5, equal_nan=True)
    return (RIGHT if right else WRONG), said


def main() -> None:
    """Print the table."""
    total = Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for kind in KINDS:
            for table in kind():
                how, said = outcome(table, Path(folder))
                total[how] += 1
                said = "" if how == RIGHT else said.replace(f"{folder}/", "")[:150]
                print(f"{table.name:50} {how:22} {said}")
    print(
        f"\n{total.total()} tables:", *(f"{total[how]} {how}," for how in (RIGHT, REFUSED, WRONG))
    )


if __name__ == "__main__":
    main()
