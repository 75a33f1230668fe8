"""Estimation: what a measurement and what is known beforehand make of a lever.

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
                `uncertainty` and `summary`, also of levers compared; a `batch` of fits
==============  ====================================================================================
"""

from hotlever.estimation.estimator import fit
from hotlever.estimation.options import FitOptions
from hotlever.estimation.result import Fit, FittedParameter, read_fit
from hotlever.measurement import Measurement, read_measurement

__all__ = [
    "Fit",
    "FitOptions",
    "FittedParameter",
    "Measurement",
    "fit",
    "read_fit",
    "read_measurement",
]
