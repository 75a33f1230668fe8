"""Estimation: what a measurement and what is known beforehand make of a lever.

==============  ====================================================================================
forward map     `experiment`: at rest, in time; `load_lines`, and the `surrogate` of a solved lever
noise model     `residuals`: `noise`, `drift`, and the `scales` that data have in common
prior           `hotlever.probe.priors`, together a `prior_density`
optimiser       of an `objective`: `optimiser`, its `subproblem`, `convergence`; where a `search`
                begins; what steers it, `search_options`
posterior       `posterior`: of any `quantity`, linearised; its `profile`; `sampling`
diagnosis       `lack_of_fit`; `diagnosis` by `hypotheses`
answers         `inverse_problem` puts all that together; `estimator` makes a fit of it
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
