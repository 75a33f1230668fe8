"""A source meter that drives a lever, and a voltmeter at its reader, by SCPI through VISA."""

from __future__ import annotations

import re
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from hotlever.errors import InputError, InstrumentError, excerpt

if TYPE_CHECKING:
    from pyvisa.resources import MessageBasedResource


class MeterReading(NamedTuple):
    """What instruments show at one bias.

    Attributes
    ----------
    bias_V, current_mA : float
    reader_V : float
        NaN without a voltmeter.
    at_compliance : bool
        Whether the source has limited the current, so that the bias is not what was set.
    """

    bias_V: float
    current_mA: float
    reader_V: float
    at_compliance: bool


@dataclass(frozen=True)
class CommandSet:
    """The SCPI commands of some source meters.

    Attributes
    ----------
    model : str
        Pattern of the answer to ``*IDN?``.
    start : tuple of str
        From a reset to a source of voltage whose current is measured; ``{limit}`` is the largest
        current (A).
    read : str
        Answered by bias (V) and current (A).
    tripped : str
        Answered by 1 if the current is limited.
    """

    model: str
    start: tuple[str, ...]
    read: str
    tripped: str


#: Of Keithley's (their reference manuals 2450-901-01 and 2400S-900-01, sections on SCPI).
COMMAND_SETS = {
    "Keithley 2450, 2460, 2461, 2470": CommandSet(
        r"MODEL 24(50|60|61|70)\b",
        (
            "*RST",
            ":SOUR:FUNC VOLT",
            ':SENS:FUNC "CURR"',
            ":SOUR:VOLT:RANG:AUTO ON",
            ":SENS:CURR:RANG:AUTO ON",
            ":SOUR:VOLT:READ:BACK ON",
            ":SOUR:VOLT:ILIM {limit:.6e}",
        ),
        ':READ? "defbuffer1", SOUR, READ',
        ":SOUR:VOLT:ILIM:TRIP?",
    ),
    "Keithley 2400, 2410, 2420, 2425, 2430, 2440": CommandSet(
        r"MODEL 24(00|10|20|25|30|40)\b",
        (
            "*RST",
            ":SOUR:FUNC VOLT",
            ':SENS:FUNC "CURR:DC"',
            ":SOUR:VOLT:RANG:AUTO ON",
            ":SENS:CURR:RANG:AUTO ON",
            ":SENS:CURR:PROT {limit:.6e}",
            ":FORM:ELEM VOLT,CURR",
        ),
        ":READ?",
        ":SENS:CURR:PROT:TRIP?",
    ),
}


def open_line(resource: str, timeout_s: float) -> MessageBasedResource:
    """Open the line to an instrument by its VISA resource name.

    Raises
    ------
    InputError
        If it is no such name, or there is nothing that speaks VISA here.
    InstrumentError
        If nobody answers.
    """
    managers = _managers()
    import pyvisa

    try:
        pyvisa.rname.parse_resource_name(resource)
    except ValueError:
        raise InputError(
            f"{excerpt(resource)}: is no VISA resource name; expected one such as "
            "TCPIP0::192.168.0.5::5025::SOCKET, GPIB0::24::INSTR, USB0::…::INSTR, or twin"
        ) from None
    failure: Exception | None = None
    for manager in managers:
        try:
            line: Any = manager.open_resource(resource, open_timeout=int(1000 * timeout_s))
            line.timeout = int(1000 * timeout_s)
            line.read_termination = line.write_termination = "\n"
            return cast("MessageBasedResource", line)
        except (pyvisa.Error, OSError, ValueError) as error:
            failure = error
    raise InstrumentError(f"{resource}: no instrument answers ({_reason(failure)})")


def load_lines() -> None:
    """Load what opens lines, which takes seconds: for who may have to open one at once."""
    with suppress(InputError, InstrumentError):
        _managers()


@lru_cache
def _managers() -> list[Any]:
    """Return what opens lines: the maker's VISA where there is one, pyvisa-py where not."""
    try:
        import pyvisa
    except ImportError:
        raise InputError(
            "measure: PyVISA is not installed; pip install 'hotlever[instruments]' brings it"
        ) from None
    managers, failure = [], None
    for library in ("", "@py"):
        try:
            managers.append(pyvisa.ResourceManager(library))
        except (pyvisa.Error, OSError, ValueError) as error:
            failure = error
    if not managers:
        raise InstrumentError(f"no instrument answers ({_reason(failure)})")
    return managers


def _reason(error: Exception | None) -> str:
    return excerpt(" ".join(str(error).split()), 100)


@dataclass
class SourceMeter:
    """A source of voltage that shows its current, with a voltmeter at the reader.

    Attributes
    ----------
    resource, identity : str
        Its VISA resource name, and what it says of itself.
    dialect : CommandSet
    source : pyvisa.resources.MessageBasedResource
    reader : pyvisa.resources.MessageBasedResource or None
    """

    resource: str
    identity: str
    dialect: CommandSet
    source: MessageBasedResource
    reader: MessageBasedResource | None = None

    @classmethod
    def open(cls, resource: str, reader: str | None = None, timeout_s: float = 5.0) -> SourceMeter:
        """Open the instruments; nothing is set yet.

        Raises
        ------
        InputError, InstrumentError
            If `open_line` does, or the source is none whose commands are known.
        """
        with ExitStack() as lines:
            source = lines.enter_context(closing(open_line(resource, timeout_s)))
            identity = _asked(source, "*IDN?", resource)
            dialect = next(
                (each for each in COMMAND_SETS.values() if re.search(each.model, identity, re.I)),
                None,
            )
            if dialect is None:
                raise InputError(
                    f"{resource}: found {excerpt(identity, 60)!r}, expected a source meter whose "
                    f"commands are known: {'; '.join(COMMAND_SETS)}"
                )
            voltmeter = None if reader is None else open_line(reader, timeout_s)
            lines.pop_all()
        return cls(resource, identity, dialect, source, voltmeter)

    def start(self, limit_mA: float) -> None:
        """Reset the source, limit its current, and turn its output on at 0 V.

        Raises
        ------
        InstrumentError
            If it refuses something.
        """
        for command in self.dialect.start:
            self._send(command.format(limit=1e-3 * limit_mA))
        self.set_bias(0.0)
        self._send(":OUTP ON")
        self._check()

    def set_bias(self, bias_V: float) -> None:
        """Set the bias (V); it is set when the source has confirmed that it could.

        Raises
        ------
        InstrumentError
            If it could not.
        """
        self._send(f":SOUR:VOLT {bias_V:.7g}")
        self._check()

    def read(self) -> MeterReading:
        """Read bias, current and the voltage of the reader.

        Raises
        ------
        InstrumentError
            If the source reports an error, or an answer is none.
        """
        bias_V, current_A = self._numbers(self.source, self.dialect.read, 2)
        (tripped,) = self._numbers(self.source, self.dialect.tripped, 1)
        self._check()
        reader_V = float("nan")
        if self.reader is not None:
            # of voltmeters of all makers (SCPI-1999, volume 2, MEASure)
            (reader_V,) = self._numbers(self.reader, ":MEAS:VOLT:DC?", 1)
        return MeterReading(bias_V, 1e3 * current_A, reader_V, tripped != 0.0)

    def turn_off(self) -> bool:
        """Turn the output off; return whether the source confirms it."""
        self._send(":OUTP OFF")
        return self._numbers(self.source, ":OUTP?", 1) == [0.0]

    def close(self) -> None:
        """Give the lines back."""
        for line in (self.source, self.reader):
            if line is not None:
                with suppress(Exception):
                    line.close()

    def _send(self, command: str) -> None:
        try:
            self.source.write(command)
        except Exception as error:
            raise InstrumentError(
                f"{self.resource}: lost at {command} ({_reason(error)})"
            ) from error

    def _check(self) -> None:
        """Ask for what the source had to refuse."""
        answer = _asked(self.source, ":SYST:ERR?", self.resource)
        if not re.match(r"[+-]?0\b", answer.strip()):
            raise InstrumentError(f"{self.resource}: reports {excerpt(answer, 80)}")

    def _numbers(self, line: MessageBasedResource, command: str, count: int) -> list[float]:
        answer = _asked(line, command, self.resource)
        try:
            numbers = [float(each) for each in answer.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) != count:
            raise InstrumentError(
                f"{self.resource}: answers {excerpt(answer)!r} to {command}, expected {count} "
                f"number{'s' * (count > 1)}"
            )
        return numbers


def _asked(line: MessageBasedResource, command: str, resource: str) -> str:
    try:
        return str(line.query(command))
    except Exception as error:  # of VISA, its backends and sockets
        raise InstrumentError(f"{resource}: no answer to {command} ({_reason(error)})") from error
