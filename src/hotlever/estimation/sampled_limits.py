"""How far the tip temperature may be off either way, by samples of the posterior.

All parameters are sampled, and the limits are quantiles of their tip temperatures. Levers near the
optimum are taken from those that were solved in the search.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.estimation.ensembles import independent_samples, rhat_of_ensembles
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.limits import Profile, looked_at
from hotlever.estimation.objective import Objective
from hotlever.estimation.posterior import Posterior
from hotlever.estimation.surrogate import Surrogate
from hotlever.text import BAND
from hotlever.types import Array, Progress

#: Standard deviations from which on a solved lever tells of those that samples reach.
_TELLING = 1.0
#: R̂ from which on samples are too few.
_SETTLED = 1.05


@dataclass(frozen=True)
class TipPosterior:
    """What posterior samples say of the tip temperature.

    Attributes
    ----------
    profile : Profile
        From the quantiles of 2.5 and 97.5 %.
    effective_samples, rhat : float
        Of the tip temperature where it is hottest.
    """

    profile: Profile
    effective_samples: float
    rhat: float

    @property
    def note(self) -> str:
        """What the limits are from, and whether there are enough samples."""
        text = (
            "95 % of the tip temperatures lie between quantiles of posterior samples "
            f"({self.effective_samples:.0f} effective ones, R̂ {self.rhat:.3f})"
        )
        return text + ("" if self.rhat < _SETTLED else "; these are too few, take more samples")


def posterior_of_tip(
    objective: Objective,
    at: Prediction,
    others: list[Prediction],
    covariance: Array,
    *,
    samples: int,
    progress: Progress | None = None,
) -> TipPosterior:
    """Sample the parameters of an estimate, and their tip temperatures.

    Parameters are those of `hotlever.estimation.limits.profile_of_tip`, with `others` than the
    optimum that have been solved, and those of `hotlever.estimation.ensembles.sample`. What is
    sampled costs too little for processes of its own.
    """
    surrogate = Surrogate(objective, at, others, least=_TELLING)
    posterior = Posterior(objective, surrogate.values, surrogate.origin, at.slopes)
    chains = posterior.sample(samples=samples, progress=progress)
    some, every = looked_at(at), chains.points.reshape(-1, surrogate.origin.size)
    tips = np.array([surrogate.values(point)[2] for point in every])
    slopes = at.slopes[2][some][:, objective.columns]
    stderr = np.sqrt(np.einsum("bi,ij,bj->b", slopes, covariance, slopes))
    low, high = np.percentile(tips[:, some], (2.5, 97.5), axis=0)
    middle = at.values[2, some]
    hottest = tips[:, some[-1]].reshape(chains.points.shape[:3])
    return TipPosterior(
        Profile(middle, (middle - low) / (BAND * stderr), (high - middle) / (BAND * stderr)),
        independent_samples(hottest),
        rhat_of_ensembles(hottest),
    )
