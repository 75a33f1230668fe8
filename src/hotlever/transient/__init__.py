"""Levers in time: wave forms, what a lever shows under them, and its time constants."""

from hotlever.transient.history import history, history_csv, write_history
from hotlever.transient.waveform import Waveform, pulse, ramp, read_waveform, sine, step

__all__ = [
    "Waveform",
    "history",
    "history_csv",
    "pulse",
    "ramp",
    "read_waveform",
    "sine",
    "step",
    "write_history",
]
