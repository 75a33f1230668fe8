"""A process that owns an instrument, and turns its output off however a measurement ends.

The measurement asks it for what is to be set and read, through a pipe. Where that pipe closes,
because the measurement is done, was interrupted, has failed or was killed, it turns the output off
and asks the instrument whether it is. Where this process dies itself the measurement turns it off,
at once, whatever it is computing. What nobody can turn off, since the line is broken or both were
killed, is said aloud as far as somebody is left to say it: a source meter keeps its output on.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from hotlever.errors import HotleverError, InstrumentError, unforeseen_error
from hotlever.instruments.source_meter import MeterReading, SourceMeter, load_lines


@dataclass(frozen=True)
class Supply:
    """Instruments by name, and how they are used.

    Attributes
    ----------
    source : str
        VISA resource of the source meter.
    reader : str or None
        VISA resource of the voltmeter at the lever's reader.
    limit_mA : float
        The largest current that the source lets through.
    timeout_s : float
        How long an instrument may take to answer.
    answer_s : float
        How long the supervising process may take to set or read all of them.
    start_s : float
        How long the supervising process may take to start, with the instruments.
    turn_off_s : float
        How long it is tried to turn the output off over a line that fails.
    retry_s : float
        How long is waited between two tries.
    """

    source: str
    reader: str | None = None
    limit_mA: float = 10.0
    timeout_s: float = 5.0
    answer_s: float = 30.0
    start_s: float = 30.0
    turn_off_s: float = 2.0
    retry_s: float = 0.2


class Supervisor:
    """An instrument whose output is on while this context lasts, and off behind it.

    Leaving the context raises InstrumentError if nobody confirms that the output is off.
    """

    def __init__(self, supply: Supply) -> None:
        self._supply = supply
        self._is_ending = self._is_off = False
        self.identity = ""

    def __enter__(self) -> Supervisor:
        # before anything is turned on that may have to be turned off from here
        load_lines()
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=supervise, args=(theirs, self._supply), daemon=False)
        self._process.start()
        theirs.close()
        self._watch = threading.Thread(target=self._turn_off_if_it_dies, daemon=True)
        self._watch.start()
        try:
            self.identity = self._answer(self._supply.start_s)
        except BaseException as error:
            self._end(error)
            raise
        return self

    def set_bias(self, bias_V: float) -> None:
        """Set the bias (V)."""
        self._ask(bias_V)

    def read(self) -> MeterReading:
        """Return what the instruments show."""
        reading: MeterReading = self._ask("read")
        return reading

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self._end(error)

    def _turn_off_if_it_dies(self) -> None:
        """Turn the output off where the supervising process ends before it is asked to.

        The measurement may be computing for seconds before it asks it for something again.
        """
        wait([self._process.sentinel])
        if not self._is_ending:
            self._is_off = _turned_off(None, self._supply)

    def _ask(self, request: float | str) -> Any:
        return self._answer(self._supply.answer_s, request)

    def _answer(self, within_s: float, *requests: float | str) -> Any:
        try:
            for request in requests:
                self._pipe.send(request)
            if not self._pipe.poll(within_s):
                raise InstrumentError(f"{self._supply.source}: no answer for {within_s:g} s")
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            raise InstrumentError("the process that supervises the source meter died") from error
        if isinstance(answer, Exception):
            raise answer
        return answer

    def _end(self, error: BaseException | None) -> None:
        """Have the output turned off; raise InstrumentError if nobody confirms that it is."""
        self._is_ending = True
        if self._is_turned_off():
            return
        # whoever owned the instrument may have died
        if not self._process.is_alive():
            self._watch.join()
        if self._is_off or _turned_off(None, self._supply):
            return
        before = f"{error}; " if error is not None and str(error) else ""
        raise InstrumentError(f"{before}{_still_on(self._supply.source)}") from error

    def _is_turned_off(self) -> bool:
        """Have the supervising process turn the output off; return whether it confirms that."""
        supply, confirmed = self._supply, False
        with suppress(OSError):
            self._pipe.send(None)
        deadline = time.monotonic() + supply.turn_off_s + 2.0 * supply.timeout_s
        with suppress(EOFError, OSError):
            while (left := deadline - time.monotonic()) > 0.0 and self._pipe.poll(left):
                answer = self._pipe.recv()
                # answers to what was asked before come first
                if isinstance(answer, bool):
                    confirmed = answer
                    break
        self._pipe.close()
        self._process.join(supply.turn_off_s)
        return confirmed


def _still_on(resource: str) -> str:
    return (
        f"THE OUTPUT OF {resource} MAY STILL BE ON: nobody confirms that it is off; turn it off at "
        "the instrument"
    )


def supervise(pipe: Connection, supply: Supply) -> None:
    """Own the instruments until the other end of a pipe closes, in a process of its own.

    What is sent back are the answers, the errors in their place, and at the end whether the output
    is off.
    """
    for name in ("SIGINT", "SIGHUP", "SIGTERM"):
        # all of them reach the measurement too, which then closes the pipe
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if hasattr(os, "setsid"):
        with suppress(OSError):
            os.setsid()
    meter = None
    try:
        meter = SourceMeter.open(supply.source, supply.reader, supply.timeout_s)
        meter.start(supply.limit_mA)
        pipe.send(meter.identity)
        while (request := pipe.recv()) is not None:
            if request == "read":
                pipe.send(meter.read())
            else:
                meter.set_bias(request)
                pipe.send(None)
    except (EOFError, OSError):
        pass
    except Exception as error:
        if not isinstance(error, HotleverError):
            error = InstrumentError(unforeseen_error(error, ["measure"]))
        with suppress(OSError):
            pipe.send(error)
    finally:
        # what was not opened was not turned on
        confirmed = meter is None or _turned_off(meter, supply)
        try:
            pipe.send(confirmed)
        except OSError:
            # nobody is there any more to say it
            if not confirmed:
                print(f"hotlever: {_still_on(supply.source)}", file=sys.stderr, flush=True)


def _turned_off(meter: SourceMeter | None, supply: Supply) -> bool:
    """Turn the output off, over a new line if need be; return whether that is confirmed."""
    deadline = time.monotonic() + supply.turn_off_s
    while True:
        with suppress(Exception):
            if meter is None:
                meter = SourceMeter.open(supply.source, timeout_s=supply.turn_off_s)
            if meter.turn_off():
                meter.close()
                return True
        if meter is not None:
            meter.close()
        meter = None
        if time.monotonic() > deadline:
            return False
        time.sleep(supply.retry_s)
