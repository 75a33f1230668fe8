"""A lever as far as it is known, linearised about its estimate, up to the bias at which it melts.

It is made again from a calibration, or from priors alone, by one solve on a coarse mesh, whose
derivatives are those that calibrations rest on. The unknowns are the coordinates of the parameters
(`hotlever.estimate.prior_density.Coordinates`) and behind them the scales of meters and
thermometer, in standard deviations of their priors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.experiment import TIP
from hotlever.estimate.optimal_design import Information, NoiseLaw
from hotlever.estimate.optimiser import DISCREPANCY
from hotlever.estimate.options import FitOptions
from hotlever.estimate.posterior import standard_errors
from hotlever.estimate.prior_density import Coordinates, PriorDensity
from hotlever.estimate.surrogate import CurveSurrogate, Rows
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import METERS, SCALES, THERMOMETER, Prior, as_known, known_beforehand
from hotlever.quantities import FITTED
from hotlever.spieser2017 import RAMAN_ERROR_K
from hotlever.text import BAND
from hotlever.types import Array
from hotlever.units import MOST_BIAS

#: Observables whose scale is an unknown, in order.
_SCALED = {observable: scale for scale, observable in SCALES.items()}
#: Noise of a thermometer and of meters that nobody has stated.
_USUAL_NOISE = {"tip": NoiseLaw(RAMAN_ERROR_K, 0.0)}
_USUAL_OF_METERS = NoiseLaw(0.0, 1e-3)


@dataclass(frozen=True)
class LinearisedLever:
    """A lever, and what is known of it.

    Attributes
    ----------
    probe : Probe
        The most likely one.
    names : list of str
        The parameters that are not known exactly, (p,).
    priors : dict of str to Prior
        Of parameters and scales.
    measurement : Measurement or None
    weights : dict of str to ndarray
        See `hotlever.estimate.Estimate`; empty without data.
    stretch : float
        Standard deviations of the tip upwards as a multiple of the linearised ones, 1 or more: as
        far as the calibration has found them to be longer.
    """

    probe: Probe
    names: list[str]
    priors: dict[str, Prior]
    measurement: Measurement | None
    weights: dict[str, Array]
    stretch: float = 1.0

    @classmethod
    def of_calibration(cls, calibration: Estimate) -> LinearisedLever:
        """Return the lever that was calibrated.

        Raises
        ------
        InputError
            If the data are not described, or the calibration rests on other than priors and data.
        """
        calibration.need_described("what to measure next")
        probe, measurement = calibration.probe, calibration.measurement
        if calibration.weights is None or not calibration.priors:
            raise InputError(
                f"what to measure next: found a calibration by route '{calibration.route}' without "
                "priors or the weights of its data, expected one of a probe with priors (hotlever "
                "calibrate DATA.csv --probe PROBE.toml -o CAL.json) by this version"
            )
        if measurement.out_of_contact.any():
            raise InputError(
                "what to measure next: found rows at a distance from the sample, expected a lever "
                "at one place"
            )
        probe.circuit.need_cold_start("what to measure next")
        priors = {
            name: Prior(use.value, use.spread / use.value, True)
            if use.distribution == "log-normal"
            else Prior(use.value, use.spread, False)
            for name, use in calibration.priors.items()
        }
        hottest = calibration.table.isel(bias=int(np.nanargmax(calibration.table.tip_K)))
        above = float(hottest.tip_high_K - hottest.tip_K) / (BAND * float(hottest.tip_stderr_K))
        names = FitOptions(priors=priors).of(probe).varied
        return cls(probe, names, priors, measurement, calibration.weights, max(above, 1.0))

    @classmethod
    def of_priors(
        cls, probe: Probe, stated: Mapping[str, Prior | str] | None = None
    ) -> LinearisedLever:
        """Return a lever that was not measured yet; of priors some may be stated."""
        probe = as_known(probe, stated)
        priors = known_beforehand(probe, stated)
        if not priors:
            raise InputError(
                "what to measure first: expected priors, without which nothing is known"
            )
        probe.circuit.need_cold_start("what to measure next")
        values = {name: prior.value for name, prior in priors.items() if name not in SCALES}
        shares = dict.fromkeys(SCALES, METERS) | {_SCALED["tip"]: THERMOMETER}
        scales = {name: Prior(1.0, share) for name, share in shares.items()}
        names = FitOptions(priors=priors).of(probe).varied
        return cls(probe.replace(values), names, {**scales, **priors}, None, {})

    # --- what it shows ----------------------------------------------------------------------------

    @cached_property
    def surrogate(self) -> CurveSurrogate:
        """Levers like it, until something melts."""
        names, fast = tuple(self.names), SimilarLevers(Lever(self.probe, COARSE))
        reach = Reach(self.probe.circuit, MOST_BIAS)
        solved = fast.linearised(self.probe, reach, names=names)
        return CurveSurrogate(
            self.probe, names, solved.branch, solved.output_slopes, Rows(np.empty(0))
        )

    @cached_property
    def highest_V(self) -> float:
        """The bias (V) up to which it has states."""
        branch = self.surrogate.branch
        return branch.highest_bias(self.probe.circuit, MOST_BIAS)

    @property
    def hottest_K(self) -> float:
        """The tip temperature (K) at which something melts."""
        return self.surrogate.branch.hottest_K

    def bias_for(self, tip_K: float) -> float:
        """Return the bias (V) at which a slow ramp has the tip at a temperature.

        Raises
        ------
        InputError
            If there is none.
        """
        branch, circuit = self.surrogate.branch, self.probe.circuit
        at = branch.bias(np.array([tip_K]), circuit)
        reached = branch.tip_K(branch.read(circuit, at).u) if np.isfinite(at[0]) else at
        if not abs(float(reached[0]) - tip_K) < 1.0:
            raise InputError(
                f"no bias of a slow ramp has the tip of this lever at {tip_K:.0f} K; expected a "
                f"temperature from {self.probe.circuit.base_temperature_K:.0f} to "
                f"{self.hottest_K:.0f} K that it does not jump over"
            )
        return float(at[0])

    def tip(self, bias: Array) -> tuple[Array, Array]:
        """Return the tip temperature (n,) at some biases (V), and its derivatives (n, q).

        The scale of a thermometer moves what it shows, not the tip.
        """
        values, slopes = self.predict(Rows(bias))
        slopes[TIP, :, len(self.names) :] = 0.0
        return values[TIP], slopes[TIP]

    def predict(self, rows: Rows) -> tuple[Array, Array]:
        """Return what rows show (observables, n), and derivatives by the unknowns (…, n, q)."""
        surrogate = self.surrogate.reading(rows)
        values, slopes = surrogate.predict(self.probe.values(self.names))
        of_parameters = slopes * self._coordinates.rates(self._point)
        of_scales = np.zeros((*values.shape, len(_SCALED)))
        for number, (observable, scale) in enumerate(_SCALED.items()):
            row = list(FITTED).index(observable)
            share = self.priors[scale].spread if scale in self.priors else 0.0
            of_scales[row, :, number] = share * self._size(observable, values)
        return values, np.concatenate([of_parameters, of_scales], axis=-1)

    def _size(self, observable: str, values: Array) -> Array:
        """Return what a scale is one of, of values (observables, n): of the tip, its rise."""
        observable_values = values[list(FITTED).index(observable)]
        return observable_values - self.probe.circuit.base_temperature_K * (observable == "tip")

    def highest_tip(self, bias: Array, covariance: Array, deviations: float) -> Array:
        """Return how hot (K) the tip may be at some biases (V); infinite if it may melt.

        That is where it is hottest of all levers that lie so many standard deviations away, by the
        covariance of the unknowns: so far up the gradient that a lever may have a share of
        probability beyond it (the design point of the first-order reliability method; Hasofer and
        Lind, J. Eng. Mech. 100, 111 (1974)). Each such lever is read along its whole branch, so
        that the knee, a fold and the melting of something count. Where parameters make up for each
        other along a bent valley it may lie off the valley and be too cold; so no tip is said to
        stay below what the linearised error says.
        """
        count, length = len(self.names), deviations * self.stretch
        covariance = covariance[:count, :count]
        tip, slopes = self.tip(bias)
        slopes = slopes[:, :count]
        linear = tip + length * standard_errors(slopes, covariance)
        hottest = [
            self._hottest(float(each), slope, covariance, length)
            for each, slope in zip(bias, slopes, strict=True)
        ]
        return np.maximum(linear, hottest)

    def _hottest(self, bias: float, gradient: Array, covariance: Array, length: float) -> float:
        surrogate = self.surrogate.reading(Rows(np.array([bias])))

        def up(gradient: Array) -> Array:
            """Return the parameters that are so far up a gradient."""
            step = covariance @ gradient
            return self.parameters(step * (length / max(float(np.sqrt(gradient @ step)), 1e-300)))

        try:
            first = up(gradient)
            values, slopes = surrogate.predict(first)
            rates = self._coordinates.rates(self._coordinates.point(first))
            refined_values = surrogate.values_at(up(slopes[TIP, 0] * rates))
        except ComputationError:
            return np.inf
        return max(float(values[TIP, 0]), float(refined_values[TIP, 0]))

    def parameters(self, away: Array) -> Array:
        """Return the parameters (p,) of a lever so far away in their coordinates, (p,)."""
        return self._coordinates.values(self._point + away)

    # --- what is known of it ----------------------------------------------------------------------

    @cached_property
    def _coordinates(self) -> Coordinates:
        relative = [name for name, prior in self.priors.items() if prior.relative]
        return Coordinates.of(self.probe, self.names, relative)

    @cached_property
    def _point(self) -> Array:
        return self._coordinates.point(self.probe.values(self.names))

    @cached_property
    def information(self) -> Information:
        """That of priors and data."""
        prior = PriorDensity.of_priors(self.priors)
        numbers, count = [self.names.index(name) for name in prior.names], len(self.names)
        rows = np.zeros((len(numbers), count + len(_SCALED)))
        slopes = prior.slopes(self.probe.values(prior.names))
        rows[:, numbers] = slopes * self._coordinates.rates(self._point)[numbers]
        low, high = self._coordinates.bounds
        # uniform within its bounds where there is no prior
        uniform = np.where(rows[:, :count].any(axis=0), 0.0, 12.0 / (high - low) ** 2)
        information = Information(np.diag(np.append(uniform, np.ones(len(_SCALED))))).with_rows(
            rows
        )
        if self.measurement is None:
            return information
        _, slopes = self.predict(Rows(self.measurement.bias_V, self._measured))
        for name, weights in self.weights.items():
            counts = weights > 0
            of_data = slopes[list(FITTED).index(name), counts]
            information = information.with_rows(weights[counts, None] * of_data)
        return information

    def noise(self, observable: str, values: Array, share: float | None = None) -> Array:
        """Return the standard errors of rows that show values (observables, n) of an observable.

        They are a share that is stated, or follow those of the data at hand, or else what is usual,
        and no smaller than what models are off by.
        """
        law, size = _USUAL_NOISE.get(observable, _USUAL_OF_METERS), self._size(observable, values)
        if share is not None:
            law = NoiseLaw(0.0, share)
        elif (counts := self.weights.get(observable, np.empty(0)) > 0).any():
            errors = 1.0 / self.weights[observable][counts]
            return NoiseLaw.of(errors, self._size(observable, self._measured)[counts]).at(size)
        return np.hypot(law.at(size), DISCREPANCY * size)

    @property
    def _measured(self) -> Array:
        """All that was measured, (observables, n)."""
        assert self.measurement is not None
        return np.stack([self.measurement.observable(name) for name in FITTED])
