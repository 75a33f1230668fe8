"""A source meter and a voltmeter that are none: SCPI behind a socket, with a solved lever.

What they understand is what a Keithley 2450 does of the commands that drive a lever; the 2400's are
understood as well. The lever follows a slow ramp: its hysteresis is not there.
"""

from __future__ import annotations

import re
import socketserver
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from hotlever.lever.lever import Lever
from hotlever.probe import Probe
from hotlever.probe.priors import draw_values, known_beforehand
from hotlever.probe.probe_parameters import parameters_of
from hotlever.types import Array
from hotlever.units import MOST_BIAS


@dataclass(frozen=True)
class RampCurve:
    """What a lever shows on a slow ramp, until something melts.

    Attributes
    ----------
    bias_V, current_mA, reader_V, tip_K : ndarray, shape (n,)
        Rising in bias from 0 V; beyond the last the lever has melted.
    """

    bias_V: Array
    current_mA: Array
    reader_V: Array
    tip_K: Array

    @classmethod
    def of_probe(cls, probe: Probe, points: int = 2001, **lever: Any) -> RampCurve:
        """Solve a lever; `lever` are options of it, as its mesh."""
        circuit = probe.circuit
        branch = Lever(probe, **lever).branch_to(MOST_BIAS)
        bias = np.linspace(0.0, branch.highest_bias(circuit, MOST_BIAS), points)
        u = branch.read(circuit, bias).u
        _, current, reader, _ = branch.curve(u).T
        there = np.isfinite(u)
        return cls(bias[there], current[there], reader[there], branch.tip_K(u[there]))

    def at_each(self, bias_V: Array) -> Array:
        """Return current (mA), reader voltage (V) and tip temperature (K) at biases (V), (3, n)."""
        columns = (self.current_mA, self.reader_V, self.tip_K)
        return np.stack([np.interp(bias_V, self.bias_V, each) for each in columns])

    def at(self, bias_V: float) -> tuple[float, float, float]:
        """Return the same at one bias (V)."""
        current, reader, tip = self.at_each(np.array([bias_V]))[:, 0].tolist()
        return current, reader, tip


def drawn_from_priors(probe: Probe, rng: np.random.Generator) -> Probe:
    """Return a lever like a probe: what is not known exactly of it is drawn from its priors."""
    priors = known_beforehand(probe, {"laws": "paper"})
    of_lever = {name: priors[name] for name in parameters_of(probe) if name in priors}
    return probe.replace(draw_values(of_lever, rng))


@dataclass
class TwinBench:
    """The instruments at one lever, while this context lasts.

    Attributes
    ----------
    curve : RampCurve
    noise : float
        Standard error of each reading of a current or voltage, as a share.
    seed : int
        Of the noise.
    model : str
        Which source meter it says to be.
    output_on, is_melted : bool
    bias_V : float
        What is set.
    limit_mA : float
    hottest_K : float
        The hottest that the tip has been.
    """

    curve: RampCurve
    noise: float = 1e-3
    seed: int = 0
    model: str = "2450"
    output_on: bool = False
    is_melted: bool = False
    bias_V: float = 0.0
    limit_mA: float = 0.1
    hottest_K: float = 0.0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self._errors: list[str] = []
        self._servers: list[_Server] = []

    def __enter__(self) -> TwinBench:
        lock = threading.Lock()
        for answer in (self.source_answer, self.voltmeter_answer):
            server = _Server(answer, lock)
            threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
            self._servers.append(server)
        return self

    def __exit__(self, *_: object) -> None:
        self.break_lines()

    @property
    def source(self) -> str:
        """The VISA resource of the source meter."""
        return self._servers[0].resource

    @property
    def reader(self) -> str:
        """The VISA resource of the voltmeter."""
        return self._servers[1].resource

    def break_lines(self) -> None:
        """Break the lines to the instruments, which stay as they are."""
        for server in self._servers:
            server.stop()

    # --- the lever --------------------------------------------------------------------------------

    def _shown(self) -> tuple[float, float, float]:
        """Return bias (V), current (mA) and reader voltage (V) without noise."""
        if not self.output_on or self.is_melted:
            return self.bias_V * self.output_on, 0.0, 0.0
        bias = self.bias_V
        current, reader, tip = self.curve.at(bias)
        if current > self.limit_mA:
            within = self.curve.current_mA <= self.limit_mA
            first = int(np.argmin(within)) - 1
            bias = float(self.curve.bias_V[max(first, 0)])
            _, reader, tip = self.curve.at(bias)
            current = self.limit_mA
        self.hottest_K = max(self.hottest_K, tip)
        self.is_melted = bias >= self.curve.bias_V[-1]
        return bias, current, reader

    def _noisy(self, value: float) -> float:
        return value * (1.0 + self.noise * float(self._rng.standard_normal()))

    # --- the instruments --------------------------------------------------------------------------

    def voltmeter_answer(self, message: str) -> str | None:
        """Do what the voltmeter is told; return its answer to a question."""
        header, _ = _parsed(message)
        if header == "*IDN?":
            return "KEITHLEY INSTRUMENTS,MODEL DMM6500,0,twin"
        return f"{self._noisy(self._shown()[2]):.8E}" if header == "MEAS:VOLT?" else None

    def source_answer(self, message: str) -> str | None:
        """Do what the source meter is told; return its answer to a question."""
        header, argument = _parsed(message)
        bias, current, _ = self._shown()
        waits = header == "SYST:ERR?" and self._errors
        answers = {
            "*IDN?": f"KEITHLEY INSTRUMENTS,MODEL {self.model},0,twin",
            "OUTP?": f"{self.output_on:d}",
            "READ?": f"{bias:.8E},{1e-3 * self._noisy(current):.8E}",
            "SOUR:VOLT:ILIM:TRIP?": f"{current >= self.limit_mA:d}",
            "SENS:CURR:PROT:TRIP?": f"{current >= self.limit_mA:d}",
            "SYST:ERR?": self._errors.pop(0) if waits else '0,"No error"',
        }
        if header == "*RST":
            self.output_on, self.bias_V, self.limit_mA = False, 0.0, 0.105
        elif header in ("SOUR:VOLT:ILIM", "SENS:CURR:PROT"):
            self.limit_mA = 1e3 * float(argument)
        elif header == "SOUR:VOLT":
            self.bias_V = float(argument)
            self._shown()  # the lever follows at once
        elif header == "OUTP":
            self.output_on = argument in ("1", "ON")
        elif header not in answers and header not in (
            # these change nothing here
            *("*CLS", "SOUR:FUNC", "SENS:FUNC", "SOUR:VOLT:RANG:AUTO", "SENS:CURR:RANG:AUTO"),
            *("SOUR:VOLT:READ:BACK", "FORM:ELEM"),
        ):
            self._errors.append('-113,"Undefined header"')
        return answers.get(header)


def _parsed(message: str) -> tuple[str, str]:
    """Return the header of a SCPI message in its short form, and the argument.

    The short form of a word are its first four letters, or three if the fourth is a vowel; what is
    optional is left out (SCPI-1999, volume 1, section 6.2.1).
    """
    header, _, argument = message.strip().partition(" ")
    question = header.endswith("?")
    words = [re.sub(r"\d+$", "", word) for word in header.rstrip("?").upper().split(":") if word]
    short = [word if len(word) <= 4 else word[: 3 if word[3] in "AEIOU" else 4] for word in words]
    kept = [word for word in short if word not in ("LEV", "IMM", "AMPL", "DC", "MODE", "STAT")]
    return ":".join(kept) + "?" * question, argument.strip().upper()


class _Server(socketserver.ThreadingTCPServer):
    """An instrument at a port of this machine."""

    allow_reuse_address, daemon_threads = True, True

    def __init__(self, answer: Callable[[str], str | None], lock: threading.Lock) -> None:
        self.answer, self.lock = answer, lock
        self._connections: list[Any] = []
        super().__init__(("127.0.0.1", 0), _Connection)

    @property
    def resource(self) -> str:
        """The VISA resource name."""
        return f"TCPIP0::127.0.0.1::{self.server_address[1]}::SOCKET"

    def get_request(self) -> Any:
        """Accept a connection."""
        connection = super().get_request()
        self._connections.append(connection[0])
        return connection

    def stop(self) -> None:
        """Answer nobody any more."""
        self.shutdown()
        self.server_close()
        for connection in self._connections:
            with suppress(OSError):
                connection.shutdown(2)


class _Connection(socketserver.StreamRequestHandler):
    server: _Server

    def handle(self) -> None:
        """Answer until the other end is closed."""
        with suppress(OSError):
            for line in self.rfile:
                with self.server.lock:
                    answer = self.server.answer(line.decode("ascii", "replace"))
                if answer is not None:
                    self.wfile.write(f"{answer}\n".encode("ascii"))
