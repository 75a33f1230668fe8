"""Levers: ``hotlever sweep``, ``contact``, ``reader``, ``pulse`` and ``spectrum``."""

from __future__ import annotations

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.tasks.requests import (
    ContactRequest,
    PulseRequest,
    ReaderRequest,
    SpectrumRequest,
    SweepRequest,
)


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


@command("reader", ReaderRequest)
def reader_command(request: ReaderRequest) -> None:
    """Read the distance to a surface: signal, noise, resolution."""
    from hotlever.tasks.approaching import approach

    approach(terminal, request)


@command("spectrum", SpectrumRequest)
def spectrum_command(request: SpectrumRequest) -> None:
    """Show impedance and thermal response to small signals at a bias, or harmonics."""
    from hotlever.tasks.small_signals import respond

    respond(terminal, request)
