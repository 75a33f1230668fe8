"""Fifty files that somebody may drop by mistake or mischief, the same at every run."""

from __future__ import annotations

import random
from collections.abc import Iterator

_GOOD = "V_b (V),I_h (mA)\n" + "".join(f"{i},{0.1 * i:.2f}\n" for i in range(1, 12))
_PROBE = '[probe]\nshape = "three-leg"\nlength_um = {}\n'


def bad_files() -> Iterator[tuple[str, bytes]]:
    """Give names and contents."""
    noise = random.Random(1)
    yield "empty.csv", b""
    yield "spaces.csv", b"   \n\n  \t \n"
    yield "bom.csv", "\ufeff".encode()
    yield "nul.csv", bytes(1000)
    yield "binary.csv", noise.randbytes(5000)
    yield "binary.txt", noise.randbytes(5000)
    yield "page.csv", b"<!doctype html><script>alert(1)</script>"
    yield "words.txt", b"to whom it may concern\n" * 20
    yield "header.csv", b"V_b (V),I_h (mA)\n"
    yield "one-row.csv", b"V_b (V),I_h (mA)\n1,0.1\n"
    yield "no-bias.csv", _GOOD.replace("V_b (V)", "time (s)").encode()
    yield "no-unit.csv", _GOOD.replace("(V)", "").replace("(mA)", "").encode()
    yield "furlongs.csv", _GOOD.replace("(mA)", "(furlongs)").encode()
    yield "power.csv", _GOOD.replace("(mA)", "(9**9**9**9)").encode()
    yield "twice.csv", b"V_b (V),V_b (V)\n1,2\n2,3\n3,4\n"
    yield "letters.csv", _GOOD.replace("0.", "a.").encode()
    yield "infinite.csv", _GOOD.replace("0.1", "inf").replace("0.2", "-1e999").encode()
    yield "huge.csv", _GOOD.replace("0.", "1e300").encode()
    yield "negative.csv", _GOOD.replace("0.", "-0.").encode()
    yield "ragged.csv", b"V_b (V),I_h (mA)\n1\n2,3,4\n,,,,,\n5\n"
    yield "long-line.csv", b"V_b (V),I_h (mA)\n" + b"1," * 100_000
    yield "quotes.csv", b'V_b (V),I_h (mA)\n"1,"2\n"3""",4\n"'
    yield "formula.csv", b"V_b (V),I_h (mA)\n=cmd|' /C calc'!A0,1\n2,3\n"
    yield "utf16.csv", "caf\u00e9 \u03ba\n".encode("utf-16")
    yield "latin.csv", b"\xe9\xff\xfe,\xb5\n1,2\n"
    yield "<img src=x onerror=alert(1)>.csv", b"x"
    yield "$\\frac{1}{$.csv", b"x"
    yield "../../../etc/cron.d/evil.csv", b"x"
    yield "-o.csv", b"--report\n"
    yield ".hidden.csv", b"x"
    yield "a" * 300 + ".csv", b"x"
    yield "right\u202ecsv.exe", b"MZ"
    yield "con.csv", b"\x1b[2J\x1b[31m\n"
    yield "deep.json", b"[" * 100_000
    yield "number.json", b'{"parameters": 1e999}'
    yield "fit.json", b'{"correlation": {"names": 3}, "parameters": {}}'
    yield "cal.json", b'{"route": "probe", "table": []}'
    yield "broken.toml", b"[probe\nshape="
    yield "other.toml", b"[tool]\nname = 'x'\n"
    yield "nan.toml", _PROBE.format("nan").encode()
    yield "tiny.toml", _PROBE.format("1e-9").encode()
    yield "text.toml", _PROBE.format('"<b>long</b>"').encode()
    yield "keys.toml", b"a" + b".a" * 100_000 + b" = 1\n"
    yield "link.toml", b'[probe]\nshape = "drawing"\nfile = "/etc/passwd"\nthickness_um = 0.4\n'
    yield "noise.gds", noise.randbytes(2000)
    yield "short.gds", b"\x00\x06\x00\x02\x02\x58"
    yield "noise.oas", b"%SEMI-OASIS\r\n" + noise.randbytes(500)
    yield "words.dxf", b"0\nSECTION\n2\nENTITIES\n0\nLINE\n"
    yield "zip.dxf", b"PK\x03\x04" + noise.randbytes(500)
    yield "picture.png", b"\x89PNG\r\n\x1a\n" + noise.randbytes(500)
