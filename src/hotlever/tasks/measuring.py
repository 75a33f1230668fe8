"""A lever driven by a source meter, and measured."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from hotlever.errors import ComputationError, InputError, counted, excerpt, quoted
from hotlever.files import write_text
from hotlever.tasks.arguments import PriorOptions, Reporter, Written, check_medium, read_probe
from hotlever.tasks.parsing import check_number, parse_bias, parse_temperature
from hotlever.units import setting

if TYPE_CHECKING:
    from hotlever.instruments.ramp import NextBias, Ramp
    from hotlever.instruments.source_meter import MeterReading
    from hotlever.probe import Probe

#: The source that is no instrument.
TWIN = "twin"


def measure_lever(
    reporter: Reporter,
    *,
    source: str,
    output: Annotated[Path, Written((".csv",))],
    reader: str | None = None,
    bias: str = "1:11:25",
    settle: str = "10s",
    stay_below: str | None = None,
    propose: Annotated[bool, Option("--next")] = False,
    compliance: str = "5mA",
    beforehand: PriorOptions,
    medium: str | None = None,
    calibration: Annotated[Path | None, Written((".json",))] = None,
) -> None:
    """Measure a lever with a source meter, bias by bias, so that its tip stays below a limit.

    Before each bias the rows so far say how hot the tip may get there. The output is turned off at
    the end, whatever ends it; set the instrument's own limits first all the same.

    Parameters
    ----------
    source : RESOURCE
        VISA name of the source meter, as TCPIP0::192.168.0.5::5025::SOCKET; or twin, or twin:NUMBER
        for a certain one: no instrument but a solved lever, to try it.
    output : IV.csv
        Rows, as they come, to this new file.
    reader : RESOURCE
        VISA name of a voltmeter at the reader; or twin.
    bias : START:STOP:COUNT
        Wanted biases (V), and the most rows.
    settle : TIME
        Between setting a bias and the row that counts.
    stay_below : TEMPERATURE
        Take no bias at which the tip could be hotter with more than 1 % probability, as 900K; or
        knee; what melts if left out.
    propose
        Take the biases that hotlever next proposes.
    compliance : CURRENT
        The most that the source lets through.
    medium
        vacuum or air; what the probe file says if left out.
    calibration : CAL.json
        Write the calibration of all rows to this file.
    """
    from hotlever.estimate import calibrate
    from hotlever.estimate.summary import calibration_text
    from hotlever.instruments.ramp import CurveFile, Ramp, RampOptions
    from hotlever.instruments.supervisor import Supervisor, Supply
    from hotlever.measurement import read_measurement_of

    settle_s = 1e-6 * setting(settle, "us", "--settle")
    check_number("--settle", settle_s, 0.0, 3600.0)
    limit_mA = setting(compliance, "mA", "--compliance")
    check_number("--compliance", limit_mA, 1e-3, 100.0)
    limit_K = stay_below if stay_below == "knee" else parse_temperature(stay_below, "--stay-below")
    like = read_probe(reporter, beforehand.probe, physics=beforehand.physics)
    check_medium(medium)
    like = like if medium is None else like.in_medium(medium)
    priors = beforehand.priors(like)
    ramp = Ramp(
        like,
        parse_bias(bias),
        RampOptions(stay_below_K=limit_K, settle_s=settle_s, propose=propose),
        priors,
    )
    with (
        _instruments(reporter, like, source, reader) as (of_source, of_reader),
        CurveFile(output, like, of_reader is not None) as file,
    ):

        def record(reading: MeterReading, step: NextBias) -> None:
            file.add(reading)
            reporter.tell(_row(len(ramp.readings), reading, step))
            reporter.show("rows", _rows(ramp))

        supply = Supply(of_source, of_reader, limit_mA)
        try:
            with Supervisor(supply) as instrument:
                file.comment(f"source: {instrument.identity}")
                ramp.measure(instrument, record)
        except KeyboardInterrupt:
            rows = counted(len(ramp.readings), "row")
            raise ComputationError(
                f"{output}: {rows}; stopped by the user, the output is off"
            ) from None
        file.comment(f"ended: {ramp.reason}")
    if not ramp.readings:
        raise ComputationError(f"{output}: not written, since no row was taken: {ramp.reason}")
    reporter.give(_result(output, ramp))
    if not ramp.complete:
        raise ComputationError(f"{output}: {counted(len(ramp.readings), 'row')}; {ramp.reason}")
    if calibration is not None:
        with reporter.progress("calibrate") as update:
            whole = calibrate(
                read_measurement_of(like, output, {}), probe=like, priors=priors, progress=update
            )
        write_text(calibration, whole.to_json())
        reporter.give(calibration_text(whole) + "\n")


@contextmanager
def _instruments(
    reporter: Reporter, probe: Probe, source: str, reader: str | None
) -> Iterator[tuple[str, str | None]]:
    """Give the VISA names of the instruments; twins last as long as this context."""
    kind, _, number = source.partition(":")
    if kind != TWIN:
        if reader == TWIN:
            raise InputError(f"--reader: found {TWIN} at {excerpt(source)}, expected a voltmeter")
        yield source, reader
        return
    if number and not number.isdigit():
        raise InputError(f"--source: found {quoted(source)}, expected {TWIN} or {TWIN}:NUMBER")
    if reader not in (None, TWIN):
        raise InputError(f"--reader: found {quoted(reader)} at a twin, expected {TWIN}")
    import numpy as np

    from hotlever.instruments.twin import RampCurve, TwinBench, drawn_from_priors

    seed = int(number) if number else secrets.randbelow(10_000)
    lever = drawn_from_priors(probe, np.random.default_rng(seed))
    reporter.note(f"no instrument but a twin: {TWIN}:{seed} is the same one again")
    with TwinBench(RampCurve.of_probe(lever), seed=seed) as twin:
        yield twin.source, None if reader is None else twin.reader
        reporter.note(f"the tip of this twin was {twin.hottest_K:.0f} K at its hottest")


def _row(number: int, reading: MeterReading, step: NextBias) -> str:
    """Return a row in words."""
    how = "to first order" if step.first_order else "with 99 %"
    return (
        f"row {number}: {reading.bias_V:.4g} V, {reading.current_mA:.5g} mA; the tip expected at "
        f"{step.tip_K:.0f} K, below {step.tip_limit_K:.0f} K {how}"
    )


def _rows(ramp: Ramp) -> dict[str, Any]:
    """Return the rows so far, what was foretold of each, and the tip by what is known now."""
    import numpy as np

    shown: dict[str, Any] = {
        "bias_V": [reading.bias_V for reading in ramp.readings],
        "current_mA": [reading.current_mA for reading in ramp.readings],
        "foretold_K": [step.tip_limit_K for step in ramp.steps],
        "limit_K": ramp.limit_K,
    }
    biases = np.linspace(0.0, max(shown["bias_V"]), 101)[1:]
    low, high = ramp.known.likely.band(biases)
    return shown | {
        "band_V": biases.tolist(),
        # that of the most likely lever, as a calibration and what is foretold have it
        "tip_K": ramp.known.tip(biases)[0].tolist(),
        "low_K": low.tolist(),
        "high_K": high.tolist(),
    }


def _result(output: Path, ramp: Ramp) -> str:
    """Return what was measured, in words."""
    import numpy as np

    readings = ramp.readings
    text = f"{counted(len(readings), 'row')} in {output}: {ramp.reason}.\n"
    if ramp.tells:
        at = np.array([max(reading.bias_V for reading in readings)])
        tip_K, (low, high) = ramp.known.tip(at)[0].item(), ramp.known.likely.band(at)[:, 0]
        text += (
            f"At {at.item():.4g} V the tip is at {tip_K:.0f} K, with 95 % between {low:.0f} and "
            f"{high:.0f} K.\n"
        )
    return text
