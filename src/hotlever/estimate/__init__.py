"""Estimates: what a measurement and what is known beforehand make of a lever.

==============  ====================================================================================
problem         a measurement, priors and options, settled: `problem`, by `options`
forward map     `experiment`: at rest, in time, over a sample; the `surrogate` of a solved lever
residuals       `residuals`: data by their noise and the scales that they have in common
search          `search` for the least of an `objective`, of residuals and priors
posterior       `posterior`: of any quantity, also curved; its samples: `sampling`; of a fit, with
                profiles: `uncertainty`
verdict         `verdict`: whether data are described; why not: `diagnosis`
estimate        `estimate`: all of that, and its `file`; `estimator` makes it, as a fit or as a
                calibration with `tip_temperature`, `uncertainty_budget`, `power_law` and `pulses`;
                by the paper's rule, from a `knee`; `many` of them
next            `next_measurement`: which further rows lessen an error most
==============  ====================================================================================
"""

from hotlever.estimate.estimate import Estimate, read_calibration, read_fit
from hotlever.estimate.estimator import calibrate, fit
from hotlever.estimate.file import FittedParameter
from hotlever.estimate.next_measurement import Plan, plan_next
from hotlever.estimate.options import CalibrationOptions, FitOptions
from hotlever.estimate.power_law import EQ12, PowerLaw, read_power_law
from hotlever.measurement import Measurement, read_measurement

__all__ = [
    "EQ12",
    "CalibrationOptions",
    "Estimate",
    "FitOptions",
    "FittedParameter",
    "Measurement",
    "Plan",
    "PowerLaw",
    "calibrate",
    "fit",
    "plan_next",
    "read_calibration",
    "read_fit",
    "read_measurement",
    "read_power_law",
]
