"""Hostile files: good ones of every kind that is read, and what is done to them.

A case is a family and a number; the same number makes the same bytes.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments import full_experiment
from hotlever.estimate import calibrate, fit, read_calibration, read_fit, read_measurement
from hotlever.estimate.power_law import EQ12, read_power_law
from hotlever.lever import Lever, read_sweep, write_sweep
from hotlever.lever.lever import COARSE
from hotlever.lever.transient.waveform import read_waveform
from hotlever.materials import published
from hotlever.measurement import Measurement, parse_columns
from hotlever.probe import Probe
from hotlever.raman.spectrum_reading import read_file
from hotlever.raman.spectrum_tables import read_bias_log, read_corrections, read_temperatures
from hotlever.raman.thermometer import published_raman_calibration, read_raman_calibration
from spectrometer_files import jcamp_bytes, spc_bytes, wdf_bytes

EXAMPLES = Path(__file__).parents[2] / "src" / "hotlever" / "examples"

#: What stands in for a number, a word, or anything else.
NUMBERS = [
    *("nan", "-nan", "inf", "-Infinity", "1e999", "-1e999", "1e-999", "9" * 400, "0x10", "1_000"),
    *(
        "-0",
        "0",
        "-1",
        "1e300",
        "-1e300",
        "1e-300",
        "1,5",
        "1.5.5",
        "١٢",
        "½",
        "--5",
        "+",
        ".",
        "e",
    ),
    *("true", "null", "1e", "9**9**9**9", "__import__('os')", "1/0", "3 V", "5 kOhm", "''", "[1]"),
]
WORDS = [
    *("", " ", "\0", "\x1b[2J", "\r", "\u202e", "\ufeff", "é", "µ", "😀", "$x^{$", "%s%n", "{0}"),
    *("<script>alert(1)</script>", "../../x", "/dev/zero", "~", "|ls", "$(ls)", "`ls`", "CON"),
    *("#", '"', "'", ";", ",", "\t", "=", "(", "[", "]]", "}", "\\", "a" * 5000, "[" * 3000),
    *("R_s (kOhm): -5", "# base temperature: 77 K", "# medium: lava", "V_b (V)", "T_tip (°C)"),
    *("!!python/object:os.system", "&a [*a]", "<!DOCTYPE x [<!ENTITY a 'a'>]>"),
]
VALUES: list[Any] = [
    *(None, True, False, "", "x", "1", "nan", -1, 0, 1e300, -1e300, 1e-300, 10**30, 0.5, -0.0),
    *([], {}, [[]], [None], {"a": {}}, "a" * 5000, [1.0] * 5, "../../x", "\x1b[2J", "$x^{$"),
]


@dataclass(frozen=True)
class Family:
    """A kind of file: good ones, and what reads them."""

    suffix: str
    good: list[bytes]
    read: Callable[[Path], Any]
    form: str = "text"  #: or "json", or "bytes"


def families(folder: Path) -> dict[str, Family]:
    """Make good files of every kind, in a folder."""
    rng = np.random.default_rng(1)
    x = np.linspace(440.0, 600.0, 161)
    y = 1e3 + 1e4 / (1 + ((x - 520.4) / 2.0) ** 2) + rng.normal(0, 20, x.size)
    text = "".join(f"{a:.3f}\t{b:.1f}\n" for a, b in zip(x, y, strict=True))
    lever = Lever(Probe.reference(), COARSE)
    data = Measurement.of_sweep(lever.sweep(np.linspace(2.0, 10.0, 9)))
    fitted = fit(data, model=lambda probe, at: full_experiment(lever.with_probe(probe), at))
    fitted.write(folder / "fit.json")
    write_sweep(lever.sweep([1.0, 2.0]), folder / "sweep.nc")
    law = {"linear_K_per_mW": 110, "nonlinear_K": 4, "exponent": 3, "hot_K_per_mW": 200}
    law |= {"threshold_mW": 2.8}
    published_raman_calibration().save(folder / "raman.json")
    at = np.linspace(2.0, 11.0, 19)
    curve = Measurement.of_sweep(lever.with_material(published("lever 3").material).sweep(at))
    calibrate(curve, law=EQ12).write(folder / "calibration.json")
    rows = (data.bias_V, data.current_mA, data.tip_K)
    table = "\n".join(f"{v:g},{i:.6g},{t:.1f}" for v, i, t in zip(*rows, strict=True))
    head = "# R_s (kOhm): 5.6\n# base temperature (K): 293\n# medium: vacuum\n"
    measured = [
        (EXAMPLES / "lever-a.csv").read_bytes()[:1500],
        f"{head}V_b (V),I_h (mA),T_tip (K)\n{table}\n".encode(),
        f"{head}V_b (V),I_h (mA),T_tip (K)\n{table}\n".replace(",", ";").encode("utf-16"),
        f"V_b (V),I_h (mA),T_tip (K)\n{table}\n".replace(",", "\t").encode("cp1252"),
    ]
    drawn = b'[probe]\nshape = "drawing"\nfile = "x.gds"\nthickness_um = 0.4\ntip_um = [1.0, 2.0]\n'
    probes = [Probe.reference().to_toml().encode(), Probe.u_shape().to_toml().encode(), drawn]
    log = "time (s),V_b (V),I_h (mA)\n0,1,0.14\n10,2,0.28\n20,3,0.42\n"
    wave = "time (us),V_b (V)\n0,0\n5,1\n10,8\n20,0\n"
    timed = [
        b"# R_s (kOhm): 5.6\nt (us),V_b (V),I_h (mA)\n0,0,0\n1,4,0.571\n2,4,0.57\n5,4,0.568\n",
        b"# R_s (ohm): 5600\nTime/ms;V_b (V);V_l (V)\n0,001;9;1,9\n0,002;9;1,95\n0,004;9;2,01\n",
    ]
    by_hand = "file,start_cm-1,from_cm-1,to_cm-1,use\na.txt,516.5,480,540,yes\nb.txt,,,,no\n"
    hot = "file,temperature (C)\na.txt,25\nb.txt,100\nc.txt,200\n"
    return {
        "measurement": Family(".csv", measured, read_measurement),
        "in time": Family(".csv", timed, read_measurement),
        "columns": Family(".txt", [b"I_h (uA)=Current\nV_b (V)=1\n"], _columns),
        "probe": Family(".toml", probes, Probe.from_file),
        "fit": Family(".json", [(folder / "fit.json").read_bytes()], read_fit, "json"),
        "calibration": Family(
            ".json", [(folder / "calibration.json").read_bytes()], read_calibration, "json"
        ),
        "power law": Family(".json", [json.dumps(law).encode()], read_power_law, "json"),
        "raman calibration": Family(
            ".json", [(folder / "raman.json").read_bytes()], read_raman_calibration, "json"
        ),
        "spectrum": Family(".txt", [text.encode(), text.replace("\t", ";").encode()], read_file),
        "wdf": Family(".wdf", [wdf_bytes(x, [y])], read_file, "bytes"),
        "spc": Family(".spc", [spc_bytes(x, y)], read_file, "bytes"),
        "jcamp": Family(".jdx", [jcamp_bytes(x, y)], read_file),
        "sweep": Family(".nc", [(folder / "sweep.nc").read_bytes()], read_sweep, "bytes"),
        "bias log": Family(".csv", [log.encode()], read_bias_log),
        "waveform": Family(".csv", [wave.encode()], read_waveform),
        "temperatures": Family(".csv", [hot.encode()], read_temperatures),
        "corrections": Family(".csv", [by_hand.encode()], read_corrections),
    }


def _columns(path: Path) -> Any:
    return parse_columns([str(path)])


def spoilt(family: Family, number: int) -> bytes:
    """Return a good file of a family after one to three things were done to it."""
    rng = np.random.default_rng(number)
    raw = family.good[rng.integers(len(family.good))]
    for _ in range(_any([1, 1, 1, 2, 3], rng)):
        ways = {"text": _TEXT * 2 + _BYTES, "json": _JSON * 3 + _TEXT, "bytes": _BYTES}[family.form]
        raw = ways[rng.integers(len(ways))](raw, rng)[: 2 * 10**6]
    return raw


# --- on bytes -------------------------------------------------------------------------------------


def _flipped(raw: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(raw)
    for place in rng.integers(max(len(raw), 1), size=rng.integers(1, 9)):
        if changed:
            changed[place % len(changed)] ^= 1 << rng.integers(8)
    return bytes(changed)


def _cut(raw: bytes, rng: np.random.Generator) -> bytes:
    return raw[: rng.integers(len(raw) + 1)]


def _without_some(raw: bytes, rng: np.random.Generator) -> bytes:
    place = rng.integers(len(raw) + 1)
    return raw[:place] + raw[place + rng.integers(1, 200) :]


def _overwritten(raw: bytes, rng: np.random.Generator) -> bytes:
    place, some = rng.integers(len(raw) + 1), rng.bytes(int(rng.integers(1, 9)))
    fill = [some, bytes(len(some)), b"\xff" * len(some)][rng.integers(3)]
    return raw[:place] + fill + raw[place + len(fill) :]


def _twice(raw: bytes, rng: np.random.Generator) -> bytes:
    return raw + raw[rng.integers(len(raw) + 1) :]


_BYTES = [_flipped, _cut, _without_some, _overwritten, _twice]


# --- on text --------------------------------------------------------------------------------------


def _lines(raw: bytes) -> list[str]:
    return raw.decode("utf-8", "surrogateescape").split("\n")


def _joined(lines: list[str]) -> bytes:
    return "\n".join(lines).encode("utf-8", "surrogateescape")


def _any(choices: list[Any], rng: np.random.Generator) -> Any:
    return choices[rng.integers(len(choices))]


def _another_line(raw: bytes, rng: np.random.Generator) -> bytes:
    lines = _lines(raw)
    at, to = rng.integers(len(lines), size=2)
    way = rng.integers(4)
    if way == 0:
        lines.insert(to, lines[at])
    elif way == 1:
        del lines[at]
    elif way == 2:
        lines[at], lines[to] = lines[to], lines[at]
    else:
        lines[at:at] = [lines[at]] * int(_any([2, 50, 2000], rng))
    return _joined(lines)


def _another_cell(raw: bytes, rng: np.random.Generator) -> bytes:
    lines = _lines(raw)
    at = rng.integers(len(lines))
    mark = _any([",", ";", "\t", " ", "=", ":"], rng)
    cells = lines[at].split(mark)
    cells[rng.integers(len(cells))] = _any(NUMBERS + WORDS, rng)
    lines[at] = mark.join(cells)
    return _joined(lines)


def _a_word_more(raw: bytes, rng: np.random.Generator) -> bytes:
    lines = _lines(raw)
    at = rng.integers(len(lines))
    place = rng.integers(len(lines[at]) + 1)
    lines[at] = lines[at][:place] + _any(WORDS, rng) + lines[at][place:]
    return _joined(lines)


def _another_encoding(raw: bytes, rng: np.random.Generator) -> bytes:
    text = raw.decode("utf-8", "replace")
    return text.encode(_any(["utf-16", "utf-16-le", "utf-32", "cp1252", "utf-7"], rng), "replace")


_TEXT = [
    _another_line,
    _another_line,
    _another_cell,
    _another_cell,
    _a_word_more,
    _another_encoding,
]


# --- on JSON --------------------------------------------------------------------------------------


def _another_value(raw: bytes, rng: np.random.Generator) -> bytes:
    try:
        content = json.loads(raw)
    except (ValueError, RecursionError):
        return _flipped(raw, rng)
    inside = content
    for _ in range(rng.integers(6)):
        deeper = [one for one in _entries(inside) if isinstance(inside[one], dict | list)]
        if not deeper:
            break
        inside = inside[_any(deeper, rng)]
    keys = _entries(inside)
    if not keys:
        return raw
    key = _any(keys, rng)
    if rng.random() < 0.3:
        del inside[key]
    else:
        inside[key] = _any(VALUES, rng)
    return json.dumps(content).encode()


def _entries(inside: Any) -> list[Any]:
    if isinstance(inside, dict):
        return list(inside)
    return list(range(len(inside))) if isinstance(inside, list) else []


_JSON = [_another_value]
