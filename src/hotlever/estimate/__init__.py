"""Estimates: what a measurement and what is known beforehand make of a lever.

==============  ====================================================================================
forward map     `experiment`: at rest, in time, over a sample; the `surrogate` of a solved lever
noise model     `residuals`: `noise`, drift, and the scales that data have in common
prior           `hotlever.probe.priors`, together a `prior_density`
optimiser       of an `objective`: `optimiser`
posterior       `posterior`: of any quantity, also curved; its `profile`; `sampling` by `chains`
design          `optimal_design`: which further rows lessen an error most
diagnosis       `diagnosis`: whether data are described; why not, by `hypotheses`
problem         `inverse_problem` puts all that together, as `options` ask, and searches
answers         `estimator` makes a fit of it: a `result`, an `outcome` as calibrations are, with
                `uncertainty` and `fit_summary`, also of levers compared; a `batch` of fits
the tip         a `calibration`, by a `procedure`: `tip_temperature` by bias and power in a
                `tip_table`, its `uncertainty_budget` by `gum`, its `knee` and `power_law`,
                `pulses`; the `next_measurement`; many `levers`
==============  ====================================================================================
"""

from hotlever.estimate.calibration import Calibration, read_calibration
from hotlever.estimate.estimator import fit
from hotlever.estimate.next_measurement import Plan, plan_next
from hotlever.estimate.options import FitOptions
from hotlever.estimate.power_law import EQ12, PowerLaw, read_power_law
from hotlever.estimate.procedure import calibrate
from hotlever.estimate.result import Fit, FittedParameter, read_fit
from hotlever.measurement import Measurement, read_measurement

__all__ = [
    "EQ12",
    "Calibration",
    "Fit",
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
