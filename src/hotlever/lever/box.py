"""Ranges of parameters that a reduced lever is made for."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.parameters import of_materials, usual_parameters
from hotlever.probe.priors import default_priors
from hotlever.types import Array

#: Those of the paper's silicon, which levers of any such probe share.
PAPER: dict[str, tuple[float, float]] = {
    "delta": (0.5, 0.9),
    "n_d": (2.0e17, 9.0e17),
    "p": (2.35, 3.0),
    "a0": (7.5e-4, 1.15e-3),
    "a1": (0.85e-6, 1.5e-6),
}
#: What scales all thermal conductivities of the paper's silicon.
C_KAPPA = "c_kappa"
#: So many standard deviations of what is known beforehand another material's ranges reach.
_SPREADS = 2.5
#: A box serves probes so far from its middle, in its widths.
_SERVES = 0.7
#: Width of a range, as a share of the scale, where nothing is known beforehand.
_UNKNOWN = 0.3


@dataclass(frozen=True)
class Box:
    """Ranges of parameters of a probe's materials.

    Attributes
    ----------
    names : tuple of str
    low, high : ndarray, shape (p,)
    by_logarithm : ndarray of bool, shape (p,)
        Which of them are spread evenly in their logarithm.
    scale : str or None
        A parameter without a range, to which the square of voltages is proportional at the same
        temperatures in vacuum.
    """

    names: tuple[str, ...]
    low: Array
    high: Array
    by_logarithm: NDArray[np.bool_]
    scale: str | None

    @classmethod
    def of(cls, probe: Probe, names: Collection[str] = ()) -> Box:
        """Return the ranges for a probe, of what a fit usually varies and of other parameters.

        The paper's silicon has ranges of its own, whatever its values. Those of other materials
        are where they are likely to be, see `hotlever.probe.priors.default_priors`.
        """
        if is_papers(probe, names):
            low, high = np.array(list(PAPER.values())).T
            even = np.array([name == "n_d" for name in PAPER])
            return cls(tuple(PAPER), low, high, even, C_KAPPA)
        known, priors = of_materials(probe), default_priors(probe)
        # the order must not depend on that of the names
        chosen = [one for one in known if one in {*usual_parameters(probe), *names}]
        ranges: list[tuple[float, float]] = []
        by_logarithm: list[bool] = []
        for name, value in zip(chosen, probe.values(chosen).tolist(), strict=True):
            prior, one = priors.get(name), known[name]
            if prior is None:
                away = _UNKNOWN * (abs(value) or one.scale)
                ends = value - away, value + away
            else:
                ends = prior.at(-_SPREADS), prior.at(_SPREADS)
            ranges.append((max(ends[0], one.lower), min(ends[1], one.upper)))
            by_logarithm.append(prior is not None and prior.relative)
        low, high = np.array(ranges).T
        return cls(tuple(chosen), low, high, np.array(by_logarithm), None)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names, and that of the scale, in the order of a probe."""
        return tuple(PARAMETERS) if self.scale else self.names

    @property
    def widths(self) -> dict[str, float]:
        """How wide the ranges are."""
        return dict(zip(self.names, (self.high - self.low).tolist(), strict=True))

    def values(self, shares: Array) -> dict[str, float]:
        """Return the values at a place given by numbers between 0 and 1, (p,)."""
        straight = self.low + shares * (self.high - self.low)
        even = np.where(self.by_logarithm, self.low * self._ratio**shares, straight)
        return dict(zip(self.names, even.tolist(), strict=True))

    def probe(self, probe: Probe, shares: Array) -> Probe:
        """Return the probe of the materials there."""
        return probe.replace(self.values(shares))

    def covers(self, probe: Probe) -> bool:
        """Whether a reduced lever of this box serves a probe: the paper's serves any."""
        return self.scale is not None or bool((np.abs(self.place(probe) - 0.5) < _SERVES).all())

    def place(self, probe: Probe) -> Array:
        """Invert `probe`, beyond the box too."""
        value, low, high = probe.values(self.names), self.low.copy(), self.high.copy()
        for one in (value, low, high):
            one[self.by_logarithm] = np.log(one[self.by_logarithm])
        return np.asarray((value - low) / (high - low))

    def slopes(self, probe: Probe) -> Array:
        """Return how far each parameter moves per unit of its share of the box, (p,)."""
        by_logarithm = probe.values(self.names) * np.log(self._ratio)
        return np.where(self.by_logarithm, by_logarithm, self.high - self.low)

    @property
    def _ratio(self) -> Array:
        """Of the ends of ranges that are even in their logarithm; 1 for others."""
        low, high = (np.where(self.by_logarithm, one, 1.0) for one in (self.low, self.high))
        return np.asarray(high / low)


def is_papers(probe: Probe, names: Collection[str] = ()) -> bool:
    """Whether a probe is of the paper's silicon, and some names are of its six parameters."""
    return set(names) <= set(PARAMETERS) and not probe.materials and probe.has_plain_silicon
