"""Levers in time: wave forms, what a lever shows under them, and its time constants."""

from hotlever.lever.transient.frequency_domain import spectrum
from hotlever.lever.transient.history import integrate, write_history
from hotlever.lever.transient.modes import rise_times, time_constants, with_times
from hotlever.lever.transient.trains import simulate
from hotlever.lever.transient.waveform import (
    Waveform,
    pulse,
    ramp,
    read_waveform,
    sine,
    step,
    switched_off,
)

__all__ = [
    "Waveform",
    "integrate",
    "pulse",
    "ramp",
    "read_waveform",
    "rise_times",
    "simulate",
    "sine",
    "spectrum",
    "step",
    "switched_off",
    "time_constants",
    "with_times",
    "write_history",
]
