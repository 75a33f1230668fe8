"""``hotlever sweep``, ``contact``, ``pulse`` and ``spectrum``: a lever at rest or not."""

from __future__ import annotations

from dataclasses import MISSING, dataclass

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.tasks.files import draw
from hotlever.tasks.probes import make_lever
from hotlever.tasks.requests import (
    ContactRequest,
    LeverRequest,
    PulseRequest,
    SweepRequest,
    TableRequest,
    option,
)
from hotlever.tasks.texts import parse_frequencies
from hotlever.units import bias_setting


@command("sweep", SweepRequest)
def sweep_command(request: SweepRequest) -> None:
    """Solve a lever over a range of bias."""
    from hotlever.tasks.sweeping import sweep

    sweep(terminal, request)


@command("pulse", PulseRequest)
def pulse_command(request: PulseRequest) -> None:
    """Follow a lever in time: steps, pulses, ramps, sines, or what a file says."""
    from hotlever.tasks.simulating import simulate_in_time

    simulate_in_time(terminal, request)


@command("contact", ContactRequest)
def contact_command(request: ContactRequest) -> None:
    """Touch a sample with the tip: apex, heat into the sample, change of the current."""
    from hotlever.tasks.contacting import touch

    touch(terminal, request)


@dataclass(kw_only=True)
class SpectrumRequest(TableRequest, LeverRequest):
    """A lever under small signals."""

    bias: str = option(MISSING, metavar="V", help="Of the operating point.")
    frequency: str = option(
        "1Hz:10MHz:71", metavar="START:STOP:COUNT", help="Spaced evenly in the logarithm."
    )
    amplitude: str | None = option(
        None, metavar="V", help="Of a sine about the bias: harmonics of V_l instead (3ω method)."
    )


@command("spectrum", SpectrumRequest)
def spectrum_command(request: SpectrumRequest) -> None:
    """Show impedance and thermal response to small signals at a bias, or harmonics."""
    from hotlever.datasets import csv_text, write_dataset
    from hotlever.lever.transient.frequency_domain import (
        HARMONIC_COLUMNS,
        SPECTRUM_COLUMNS,
        harmonics,
        spectrum,
    )

    swing = None if request.amplitude is None else bias_setting(request.amplitude, "--amplitude")
    volts, frequencies = bias_setting(request.bias, "--bias"), parse_frequencies(request.frequency)
    outputs = request.outputs(request.probe)
    lever = make_lever(terminal, request.read_probe(terminal))
    with terminal.progress("spectrum") as update:
        if swing is None:
            (state,) = lever.solve([volts], update)
            data = spectrum(state, frequencies)
        else:
            data = harmonics(lever, volts, swing, frequencies, update)
    columns = SPECTRUM_COLUMNS if swing is None else HARMONIC_COLUMNS
    with outputs.together():
        if request.output is not None:
            write_dataset(data, request.output, columns)
        draw(
            request.plot,
            lambda figures: (figures.small_signals if swing is None else figures.harmonics)(data),
        )
    if request.output is None:
        terminal.give(csv_text(data, columns))
