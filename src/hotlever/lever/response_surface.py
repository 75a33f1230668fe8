"""Where the parameters of a reduced lever may be, and its branches there to first guess.

A response surface gives the branch of any material in the domain to some ten kelvin: from there
Newton's method finds it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.equations import ELECTRICAL_OUTPUTS
from hotlever.probe import Probe
from hotlever.probe.priors import default_priors
from hotlever.probe.probe_parameters import of_materials, usual_parameters
from hotlever.types import Array

#: Those of the paper's silicon, which levers of any such probe share.
PAPER: dict[str, tuple[float, float]] = {
    "delta": (0.5, 0.9),
    "n_d": (2.0e17, 9.0e17),
    "p": (2.35, 3.0),
    "a0": (7.5e-4, 1.15e-3),
    "a1": (0.85e-6, 1.5e-6),
}


@dataclass(frozen=True)
class ParameterDomain:
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
    def of(cls, probe: Probe, names: Collection[str] = ()) -> ParameterDomain:
        """Return the ranges for a probe, of what a fit usually varies and of other parameters.

        The paper's silicon has ranges of its own, whatever its values. Those of other materials
        are where they are likely to be, see `hotlever.probe.priors.default_priors`.
        """
        if is_papers(probe, names):
            low, high = np.array(list(PAPER.values())).T
            even = np.array([name == "n_d" for name in PAPER])
            return cls(tuple(PAPER), low, high, even, "c_kappa")
        declared, priors = of_materials(probe), default_priors(probe)
        # the order must not depend on that of the names
        chosen = [name for name in declared if name in {*usual_parameters(probe), *names}]
        ranges: list[tuple[float, float]] = []
        by_logarithm: list[bool] = []
        for name, value in zip(chosen, probe.values(chosen).tolist(), strict=True):
            prior, parameter = priors.get(name), declared[name]
            if prior is None:
                # where nothing is known beforehand the range is a share of the scale
                away = 0.3 * (abs(value) or parameter.scale)
                ends = value - away, value + away
            else:
                # in standard deviations of what is known beforehand
                ends = prior.at(-2.5), prior.at(2.5)
            ranges.append((max(ends[0], parameter.lower), min(ends[1], parameter.upper)))
            by_logarithm.append(prior is not None and prior.relative)
        low, high = np.array(ranges).T
        return cls(tuple(chosen), low, high, np.array(by_logarithm), None)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names, and that of the scale, in the order of a probe."""
        return self.names if self.scale is None else (self.scale, *self.names)

    @property
    def widths(self) -> dict[str, float]:
        """How wide the ranges are."""
        return dict(zip(self.names, (self.high - self.low).tolist(), strict=True))

    def values(self, shares: Array) -> dict[str, float]:
        """Return the values at a point given by numbers between 0 and 1, (p,)."""
        straight = self.low + shares * (self.high - self.low)
        even = np.where(self.by_logarithm, self.low * self._ratio**shares, straight)
        return dict(zip(self.names, even.tolist(), strict=True))

    def probe(self, probe: Probe, shares: Array) -> Probe:
        """Return the probe of the materials there."""
        return probe.replace(self.values(shares))

    def covers(self, probe: Probe) -> bool:
        """Whether a reduced lever of this domain serves a probe: the paper's serves any."""
        # so far from its middle, in its widths, a domain serves
        return self.scale is not None or bool((np.abs(self.shares(probe) - 0.5) < 0.7).all())

    def shares(self, probe: Probe) -> Array:
        """Invert `probe`, beyond the domain too."""
        value, low, high = probe.values(self.names), self.low.copy(), self.high.copy()
        for numbers in (value, low, high):
            numbers[self.by_logarithm] = np.log(numbers[self.by_logarithm])
        return np.asarray((value - low) / (high - low))

    def slopes(self, probe: Probe) -> Array:
        """Return how far each parameter moves per unit of its share of the domain, (p,)."""
        by_logarithm = probe.values(self.names) * np.log(self._ratio)
        return np.where(self.by_logarithm, by_logarithm, self.high - self.low)

    @property
    def _ratio(self) -> Array:
        """Of the ends of ranges that are even in their logarithm; 1 for others."""
        low, high = (np.where(self.by_logarithm, end, 1.0) for end in (self.low, self.high))
        return np.asarray(high / low)


def is_papers(probe: Probe, names: Collection[str] = ()) -> bool:
    """Whether a probe is of the paper's silicon, and some names are of its six parameters."""
    plain = probe.has_plain_silicon and not probe.materials
    scaled = isinstance(probe.material.c_kappa, float)
    return set(names) <= {"c_kappa", *PAPER} and plain and scaled


@dataclass(frozen=True)
class ResponseSurface:
    """Quadratic functions of the parameters that give a branch at its nodes.

    At every node, the same for all branches, states and current are fitted to known states and
    their exact derivatives. The conductivity scale c_κ of the paper's silicon needs no fit in
    vacuum: scaling κ scales V² at the same temperatures.

    Attributes
    ----------
    domain : ParameterDomain
    u : ndarray, shape (k,)
        √(T_tip − T_base) (K^½) of the nodes, the first zero.
    coefficients : ndarray, shape (terms, k, size + 4)
        For the terms of ``_terms``, of the states and of V_l (V), I_h (mA), V_r (V).
    grows : ndarray of bool, shape (size + 4,)
        What grows with the root of the domain's scale: all but temperatures.
    scale : float or ndarray, shape ()
        Of all known branches, if the domain has a scale; 1 without.
    """

    domain: ParameterDomain
    u: Array
    coefficients: Array
    grows: NDArray[np.bool_]
    scale: float | Array

    @classmethod
    def fitted(
        cls,
        domain: ParameterDomain,
        u: Array,
        probes: list[Probe],
        values: Array,
        slopes: Array,
        grows: NDArray[np.bool_],
    ) -> ResponseSurface:
        """Fit the coefficients to known branches of m probes with the same scale.

        Of the values, (m, k, size + 4), the slopes are the derivatives by the parameters of the
        domain, (m, k, size + 4, p).
        """
        terms, gradients = zip(*(_terms(domain.shares(probe)) for probe in probes), strict=True)
        matrix = np.concatenate([np.stack(terms), *(gradient.T for gradient in gradients)])
        units = np.stack([domain.slopes(probe) for probe in probes])
        by_share = slopes * units[:, None, None, :]
        rows = np.concatenate([values, *np.moveaxis(by_share, 3, 1)])
        fitted = np.linalg.lstsq(matrix, rows.reshape(len(rows), -1))[0]
        scale = _scale(domain, probes[0])
        return cls(domain, u, fitted.reshape(-1, *values.shape[1:]), grows, scale)

    def states(self, probe: Probe) -> Array:
        """Return the states of a probe at the nodes, (size + 1, k), to some ten kelvin."""
        return self._at(probe)[:, : -len(ELECTRICAL_OUTPUTS)].T

    def electrical_outputs(self, probe: Probe) -> Array:
        """Return V_l (V), I_h (mA) and V_r (V) of a probe at the nodes, shape (k, 3)."""
        return self._at(probe)[:, -len(ELECTRICAL_OUTPUTS) :]

    def _at(self, probe: Probe) -> Array:
        values = np.tensordot(_terms(self.domain.shares(probe))[0], self.coefficients, axes=1)
        values[:, self.grows] *= np.sqrt(_scale(self.domain, probe) / self.scale)
        return np.asarray(values)


def _scale(domain: ParameterDomain, probe: Probe) -> float:
    return float(probe.values([domain.scale])[0]) if domain.scale else 1.0


def _terms(shares: Array) -> tuple[Array, Array]:
    """Return the terms of a quadratic function, (terms,), and their gradients, (terms, p)."""
    count = len(shares)
    first, second = np.triu_indices(count)
    unit = np.eye(count)
    gradient = shares[first, None] * unit[second] + shares[second, None] * unit[first]
    return (
        np.concatenate([[1.0], shares, shares[first] * shares[second]]),
        np.concatenate([np.zeros((1, count)), unit, gradient]),
    )
