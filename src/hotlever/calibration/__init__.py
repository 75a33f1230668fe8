"""From what an instrument shows to a tip temperature: power law, knee, transfer to a medium."""

from hotlever.calibration.calibration import Calibration, read_calibration
from hotlever.calibration.next_measurement import Plan, plan_next
from hotlever.calibration.power_law import EQ12, PowerLaw, read_power_law
from hotlever.calibration.procedure import calibrate

__all__ = [
    "EQ12",
    "Calibration",
    "Plan",
    "PowerLaw",
    "calibrate",
    "plan_next",
    "read_calibration",
    "read_power_law",
]
