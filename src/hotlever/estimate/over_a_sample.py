"""An experiment over a sample, at rest: rows in contact with it, and at distances from it.

One lever is measured in several positions, with all parameters in common: in contact, as the probe
states it; and away from the sample, where no heat passes the interface, and in air the surface is
further away. In vacuum all distances are one position. In air a few are solved, and the rows
between them are interpolated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Self

import numpy as np

from hotlever.contact.law import INTERFACE
from hotlever.estimate.experiment import TIP, ExperimentAtRest, PredictionAtRest, named
from hotlever.estimate.surrogate import CurveSurrogate
from hotlever.probe import Probe
from hotlever.probe.tip import OUT_OF_CONTACT
from hotlever.types import Array


@dataclass(frozen=True)
class Away:
    """Positions away from the sample, (k,).

    Attributes
    ----------
    changes : tuple of mapping of str to float
        What the probe has there in place of its values in contact.
    height_um : float
        Of the tip.
    places : ndarray, shape (k,)
        Logarithms of the distances from sample to lever; empty in vacuum.
    """

    changes: tuple[Mapping[str, float], ...]
    height_um: float
    places: Array

    @classmethod
    def of(cls, probe: Probe, distance_um: Array, most: int = 7) -> Away:
        """Return those that rows at distances of a probe's apex need, (n,), and `most` in air."""
        assert probe.tip is not None
        change, height = {INTERFACE: OUT_OF_CONTACT}, probe.tip.height_um
        out = distance_um[distance_um > 0.0]
        if probe.surroundings.medium == "vacuum" or not out.size:
            return cls((change,), height, np.empty(0))
        places = np.unique(np.log(height + out))
        if places.size > most:
            # Chebyshev's, between which a polynomial follows a smooth function closely
            turns = np.cos(np.linspace(np.pi, 0.0, most))
            places = (places[-1] + places[0] + turns * np.ptp(places)) / 2.0
        gaps = np.exp(places).tolist()
        return cls(tuple({**change, "surface_gap_um": gap} for gap in gaps), height, places)

    def probes(self, probe: Probe) -> list[Probe]:
        """Return a probe in contact as it is there."""
        return [probe.replace(change) for change in self.changes]

    def weights(self, distance_um: Array) -> Array:
        """Return how much rows, (n,), show of the lever in contact and of these, (1 + k, n)."""
        out = distance_um > 0.0
        if not self.places.size:
            return np.stack([~out, out]).astype(float)
        # Lagrange's polynomials
        at, same = np.log(self.height_um + distance_um[out]), np.eye(self.places.size, dtype=bool)
        away = np.where(same, 1.0, self.places[:, None] - self.places)
        factors = np.where(same, 1.0, (at[:, None, None] - self.places) / away)
        weights = np.zeros((1 + self.places.size, out.size))
        weights[0], weights[1:, out] = ~out, factors.prod(axis=-1).T
        return weights


def _mixed(weights: Array, each: Sequence[Array]) -> Array:
    """Return what rows show, (m, n, ...), of what each lever shows at all of them."""
    return np.asarray(np.einsum("kn,kmn...->mn...", weights, np.stack(each)))


class SurrogateOverSample(CurveSurrogate):
    """What is shown over a sample by levers near one; its branch is that in contact.

    Parameters
    ----------
    touching : CurveSurrogate
    away : sequence of CurveSurrogate
        With fewer parameters.
    weights : ndarray, shape (1 + k, n)
        See `Away`.
    """

    def __init__(
        self, touching: CurveSurrogate, away: Sequence[CurveSurrogate], weights: Array
    ) -> None:
        own = touching
        super().__init__(own.probe, own.names, own.branch, own.by_parameter, own.rows)
        self._away, self._weights = away, weights
        self._columns = [[self.names.index(name) for name in each.names] for each in away]

    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """See `hotlever.estimate.surrogate.Surrogate`."""
        pairs = zip(self._away, self._columns, strict=True)
        others = [each.predict(parameters[columns]) for each, columns in pairs]
        return self.mixed(super().predict(parameters), others)

    def mixed(
        self, touching: tuple[Array, Array], away: Sequence[tuple[Array, Array]]
    ) -> tuple[Array, Array]:
        """Return values and slopes at the rows, of those that each lever has at all of them."""
        values, slopes = [touching[0]], [touching[1]]
        for (each, by_own), columns in zip(away, self._columns, strict=True):
            by_all = np.zeros_like(touching[1])
            by_all[..., columns] = by_own
            values.append(each)
            slopes.append(by_all)
        return _mixed(self._weights, values), _mixed(self._weights, slopes)

    def values_at(self, parameters: Array) -> Array:
        """See `hotlever.estimate.surrogate.Surrogate`."""
        pairs = zip(self._away, self._columns, strict=True)
        others = [each.values_at(parameters[columns]) for each, columns in pairs]
        return _mixed(self._weights, [super().values_at(parameters), *others])


@dataclass(frozen=True)
class ExperimentOverSample(ExperimentAtRest):
    """Predicts a measurement over a sample; see `hotlever.estimate.experiment`.

    Attributes
    ----------
    positions : Away
    away : tuple of ExperimentAtRest
        One for each position, without the parameters that do not matter there.
    weights : ndarray, shape (1 + k, n)
        See `Away`.
    """

    positions: Away = field(kw_only=True)
    away: tuple[ExperimentAtRest, ...] = field(kw_only=True)
    weights: Array = field(kw_only=True)

    @classmethod
    def of(cls, touching: ExperimentAtRest, probe: Probe, distance_um: Array) -> Self:
        """Return that of a lever in contact, at rows with distances of its apex (µm)."""
        positions = Away.of(probe, distance_um)
        own = {field.name: getattr(touching, field.name) for field in fields(touching)}
        names = tuple(name for name in touching.names if name not in positions.changes[0])
        away = tuple(
            replace(touching.drawn_anew(each), names=names) for each in positions.probes(probe)
        )
        weights = positions.weights(distance_um)
        return cls(**own, positions=positions, away=away, weights=weights)

    def measuring(
        self, bias: Array, measured: Array | None, distance_um: Array | None = None
    ) -> ExperimentAtRest:
        """Return the model at other rows; of the lever in contact where no distance is said."""
        if distance_um is None:
            names = [field.name for field in fields(ExperimentAtRest)]
            own = ExperimentAtRest(**{name: getattr(self, name) for name in names})
            return own.measuring(bias, measured)
        away = tuple(each.measuring(bias, measured) for each in self.away)
        weights = self.positions.weights(distance_um)
        return replace(self, bias=bias, measured=measured, away=away, weights=weights)

    def coarse(self) -> Self:
        """See `ExperimentAtRest.coarse`."""
        return replace(super().coarse(), away=tuple(each.coarse() for each in self.away))

    def until_melting(self) -> Self:
        """See `ExperimentAtRest.until_melting`."""
        away = tuple(each.until_melting() for each in self.away)
        return replace(super().until_melting(), away=away)

    def drawn_anew(self, probe: Probe) -> Self:
        """See `ExperimentAtRest.drawn_anew`."""
        pairs = zip(self.away, self.positions.probes(probe), strict=True)
        away = tuple(each.drawn_anew(there) for each, there in pairs)
        return replace(super().drawn_anew(probe), away=away)

    def predict(self, probe: Probe, near: PredictionAtRest | None = None) -> PredictionAtRest:
        """See `ExperimentAtRest.predict`."""
        own = super().predict(probe, near)
        nearby = (None,) * len(self.away) if near is None else near.away
        trios = zip(self.away, self.positions.probes(probe), nearby, strict=True)
        away = tuple(each.predict(there, other) for each, there, other in trios)
        surrogate = SurrogateOverSample(
            own.surrogate, [each.surrogate for each in away], self.weights
        )
        every = [(each.values, each.slopes) for each in (own, *away)]
        values, slopes = surrogate.mixed(every[0], every[1:])
        lever = probe.circuit.lever_voltage(self.bias, values[0])
        columns = {**own.columns, "lever_V": lever, **named(values)}
        return PredictionAtRest(
            probe, values, slopes, surrogate, columns, slopes[TIP], own.linearised, away
        )

    def confirmed(self, at: PredictionAtRest) -> Self:
        """See `ExperimentAtRest.confirmed`."""
        if self.full is None:
            return self
        pairs = zip(self.away, at.away, strict=True)
        away = tuple(each.confirmed(there) for each, there in pairs)
        return replace(super().confirmed(at), away=away)


def with_distances(
    experiment: ExperimentAtRest, probe: Probe, distance_um: Array | None
) -> ExperimentAtRest:
    """Return an experiment with its rows at distances from a sample (µm), if they have some."""
    if probe.contact is None or distance_um is None or not (distance_um > 0.0).any():
        return experiment
    return ExperimentOverSample.of(experiment, probe, distance_um)
