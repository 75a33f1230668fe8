"""Ten files in each of eight styles in which instruments write, and how they are understood.

The styles are made from what the makers, or programs that read their files, say of them:

- Keithley: columns of a saved buffer in Model 2450 Reference Manual 2450-901-01 Rev. B, page 3-20;
  units as a 2700 writes them in its User's Manual, page 14-3; text of the package keithley2600
  (OE-FET, ``result_table.py``); settings above the table as in KickStart's exports.
- LabVIEW: tables of its express VIs with a German desktop: decimal commas, tabs or semicolons.
- lvm: the headers of LabVIEW measurement files as the packages lvm_read and lvmio describe them.
- B1500: ``TestParameter``, ``DataName`` and ``DataValue`` of EasyEXPERT, and its text with one
  line for each setting, as programs that read them describe both.
- Zurich Instruments: ``chunk;timestamp;value`` and the lines of fields of LabOne's sweeper
  (zhinst-utils, ``load_labone_csv``, and programs that read MFLI files), columns of ziControl.
- oscilloscopes: Tektronix MDO, TBS and TDS, Keysight (``x-axis``, units below), LeCroy 9300C
  Operator's Manual, page E-11.
- Rohde & Schwarz: RTC1000 User Manual 1335.7352.02, page 101; RTM20xx 1317.4726.02, page 228; log
  files of the HMC8012, User Manual, section 6.3.1.
- QCoDeS and Labber: three lines of comment of QCoDeS's ``GNUPlotFormat``; text of pandas.

Run ``python benchmarks/instrument_files.py`` for a table of what is read as it is, what is asked
and what is wrong. A question is one error that names ``--column``; its answer must be enough.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from files_of_laboratories import qcodes, rohde_schwarz, scopes, zurich
from files_of_source_meters import b1500, keithley, labview, lvm
from hotlever import InputError, read_measurement
from hotlever.lever.transient.waveform import step
from hotlever.probe import Circuit
from instruments import AFTER, ANSWER, BIAS, CURRENT, PULSE, READER, TIP, InstrumentFile

STYLES = (keithley, labview, lvm, b1500, zurich, scopes, rohde_schwarz, qcodes)


def _holds(file: InstrumentFile, data) -> bool:
    """Whether what was read is what was written, as far as it was."""
    if file.in_time:
        known = ((PULSE - ANSWER) / 5.6)[AFTER if file.driven else slice(None)]
        return data.time_us is not None and np.allclose(data.current_mA, known, atol=1e-5)
    known = {"bias_V": BIAS, "current_mA": CURRENT, "reader_V": READER, "tip_K": TIP}
    read = {name: getattr(data, name) for name in known}
    there = {name: values for name, values in read.items() if np.isfinite(values).any()}
    return len(there) > 1 and all(np.allclose(v, known[n], rtol=1e-5) for n, v in there.items())


def outcome(file: InstrumentFile, folder: Path) -> tuple[str, str]:
    """Return how a file is understood: 'read', 'asked', 'wrong' or 'refused'; and what is said."""
    path = folder / "data.csv"
    path.write_bytes(file.text.encode(file.encoding))
    circuit = Circuit(series_resistance_ohm=5600.0)
    waveform = step(5.0) if file.driven else None
    try:
        data = read_measurement(path, None, circuit, waveform)
        return ("read" if _holds(file, data) else "wrong"), "; ".join((*data.notes, *data.unused))
    except InputError as error:
        said = str(error)
    if "--column" not in said or not file.columns:
        return "refused", said
    try:
        data = read_measurement(path, file.columns, circuit, waveform)
    except InputError as error:
        return "refused", f"{said} -> {error}"
    return ("asked" if _holds(file, data) else "wrong"), said


def main() -> None:
    """Print the table."""
    total = Counter[str]()
    print(f"{'style':20}{'files':>6}{'read':>6}{'asked':>7}{'wrong':>7}{'refused':>9}")
    problems = []
    with tempfile.TemporaryDirectory() as folder:
        for style in STYLES:
            files = list(style())
            counts = Counter[str]()
            for file in files:
                how, said = outcome(file, Path(folder))
                counts[how] += 1
                if how in ("wrong", "refused"):
                    problems.append(f"{file.style}, {file.name}: {how}: {said}")
            total += counts + Counter(files=len(files))
            print(
                f"{files[0].style:20}{len(files):6}{counts['read']:6}{counts['asked']:7}"
                f"{counts['wrong']:7}{counts['refused']:9}"
            )
    print(
        f"{'together':20}{total['files']:6}{total['read']:6}{total['asked']:7}"
        f"{total['wrong']:7}{total['refused']:9}"
    )
    print(*problems, sep="\n")


if __name__ == "__main__":
    main()
