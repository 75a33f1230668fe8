"""The coupled electro-thermal problem of a lever in vacuum or air, and sweeps over the bias."""

from hotlever.lever.lever import (
    Lever,
    LeverState,
    Ramp,
    probe_of,
    read_sweep,
    sweep,
    sweep_csv,
    write_sweep,
)

__all__ = [
    "Lever",
    "LeverState",
    "Ramp",
    "probe_of",
    "read_sweep",
    "sweep",
    "sweep_csv",
    "write_sweep",
]
