"""Runge and Kutta's methods as tables of coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hotlever.types import Array

#: Modes are looked at that decay so often within a step, and how much more the steady ones count.
_FASTEST, _EXACTLY = 12.0, 1e4


@dataclass(frozen=True)
class Tableau:
    """Coefficients of an implicit method whose first stage is explicit, and the others alike.

    Attributes
    ----------
    times : ndarray, shape (stages,)
        Of the stages, as shares of a step.
    stages : ndarray, shape (stages, stages)
        Weights of the slopes in each stage, lower triangular; the last are those of the step too.
    embedded : ndarray, shape (stages,)
        Weights of the method of lower order that tells the error.
    """

    times: Array
    stages: Array
    embedded: Array

    @property
    def diagonal(self) -> float:
        """The weight that all implicit stages have of their own slope."""
        return float(self.stages[-1, -1])

    @property
    def weights(self) -> Array:
        """Weights of the slopes in a step."""
        return self.stages[-1]

    @cached_property
    def predictors(self) -> tuple[Array, Array]:
        """Weights that extrapolate to each stage.

        Of the stages before it, (stages, stages), and of the slope at the start times the step,
        (stages,). They are those by which a stage follows from the others best if what decays does
        so at any rate; what changes steadily is met exactly. Stages are of order two, and a
        polynomial through them would be a hundred times as far off.
        """
        count, ones = len(self.times), np.ones((len(self.times), 1))
        z = -np.linspace(0.0, _FASTEST, 200)
        values = np.linalg.solve(np.eye(count) - z[:, None, None] * self.stages, ones)[..., 0]
        # what decays fast has mostly done so when steps become long
        counted = np.exp(z) / (0.1 - z)
        constant, straight = np.append(np.ones(count), 0.0), np.append(self.times, 1.0)
        modes = np.column_stack([values, z]) * counted[:, None]
        rows = np.vstack([modes, _EXACTLY * constant, _EXACTLY * straight])
        weights = np.zeros((count, count + 1))
        for stage in range(1, count):
            earlier = [*range(stage), count]
            weights[stage, earlier] = np.linalg.lstsq(rows[:, earlier], rows[:, stage])[0]
        return weights[:, :-1], weights[:, -1]

    @cached_property
    def _to_end(self) -> Array:
        """By how much the slope at the end rises with each stage, times the step."""
        return np.linalg.inv(self.stages[1:, 1:])[-1]

    def end_slope(self, stages: Array, first: Array, length: float) -> Array:
        """Return the slopes (k,) at the end of a step of what is in its stages, (k, stages).

        They are those of the same method, read as one that steps these, with the slopes at the
        start.
        """
        rise = (stages[:, 1:] - stages[:, :1]) @ self._to_end
        return np.asarray(rise / length - (self._to_end @ self.stages[1:, 0]) * first)


#: The ESDIRK part of ARK4(3)6L[2]SA (Kennedy and Carpenter, Appl. Numer. Math. 44, 139 (2003)):
#: order four with an error estimate of order three, L-stable and stiffly accurate.
ARK436L2SA = Tableau(
    times=np.array([0.0, 1 / 2, 83 / 250, 31 / 50, 17 / 20, 1.0]),
    stages=np.array(
        [
            [0.0] * 6,
            [1 / 4, 1 / 4, 0.0, 0.0, 0.0, 0.0],
            [8611 / 62500, -1743 / 31250, 1 / 4, 0.0, 0.0, 0.0],
            [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4, 0.0, 0.0],
            [
                15267082809 / 155376265600,
                -71443401 / 120774400,
                730878875 / 902184768,
                2285395 / 8070912,
                1 / 4,
                0.0,
            ],
            [82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4],
        ]
    ),
    embedded=np.array(
        [
            4586570599 / 29645900160,
            0.0,
            178811875 / 945068544,
            814220225 / 1159782912,
            -3700637 / 11593932,
            61727 / 225920,
        ]
    ),
)
