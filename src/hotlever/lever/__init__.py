"""The coupled electro-thermal problem of a lever in vacuum or air, and sweeps over the bias."""

from hotlever.lever.branch import Branch, OperatingPoint
from hotlever.lever.dataset import probe_of, read_sweep, write_sweep
from hotlever.lever.lever import Lever, State, sweep

__all__ = [
    "Branch",
    "Lever",
    "OperatingPoint",
    "State",
    "probe_of",
    "read_sweep",
    "sweep",
    "write_sweep",
]
