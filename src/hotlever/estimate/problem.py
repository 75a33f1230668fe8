"""The inverse problem of an estimate: what is asked, what is known, and what was measured, settled.

Medium, circuit, observables, priors and noise are settled here, once: what comes after takes the
`Problem`, and asks neither files nor probes nor options again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from hotlever.errors import InputError
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.experiment import (
    Experiment,
    ExperimentAtRest,
    Model,
    experiment_of,
    with_distances,
)
from hotlever.estimate.experiment_in_time import ExperimentInTime, known_in_time
from hotlever.estimate.objective import FLAT, PriorDensity
from hotlever.estimate.options import FitOptions
from hotlever.estimate.residuals import Residuals, errors_of_scales
from hotlever.measurement import Measurement, with_measured_circuit
from hotlever.measurement.data import check_sample
from hotlever.measurement.rows import averaged, note_on_averages
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, as_known, default_priors, is_of_laws, priors_of, updated
from hotlever.quantities import FITTED, OF_A_CONTACT


@dataclass(frozen=True)
class Problem:
    """What is to be found of a lever, by which data and beside which priors.

    Attributes
    ----------
    measurement : Measurement
        Its many rows averaged.
    probe : Probe
        As it is stated, in the circuit and medium of the measurement.
    options : FitOptions
        As they hold for this probe and these data: priors as distributions, and what is varied.
    known : dict of str to Prior
        What is known beforehand of each parameter and scale, by name.
    prior : PriorDensity
        The same together; flat if nothing is known.
    residuals : Residuals
        The data, with the errors that they are known to have.
    start : Probe
        Where the search begins: the lever that is likeliest beforehand.
    notes : list of str
        What was decided on the way that a user should know.
    stated : mapping of str to Prior or str
        The priors that a user has stated.
    model : callable, optional
        Makes the experiment, see `hotlever.estimate.fit`.
    """

    measurement: Measurement
    probe: Probe
    options: FitOptions
    known: dict[str, Prior]
    prior: PriorDensity
    residuals: Residuals
    start: Probe
    notes: list[str]
    stated: Mapping[str, Prior | str]
    model: Model | None = None

    @classmethod
    def of(
        cls,
        measurement: Measurement,
        probe: Probe,
        options: FitOptions,
        *,
        before: PriorDensity = FLAT,
        model: Model | None = None,
    ) -> Problem:
        """Settle what is asked of a measurement.

        Parameters
        ----------
        measurement : Measurement
            As it was read.
        probe : Probe
            As it is given, not yet in the circuit and medium of the measurement.
        options : FitOptions
        before : PriorDensity
            What an earlier estimate has left, in place of priors of the same parameters.
        model : callable, optional

        Raises
        ------
        InputError
            If a name does not exist, an observable has no data, a fixed value is impossible, or
            there are fewer data than parameters.
        """
        stated = options.priors
        informed = bool(options.usual_priors or stated or before.names)
        whole, measurement = measurement, averaged(measurement, options.robust or informed)
        in_time = measurement.time_us is not None
        if in_time:
            probe.circuit.need_cold_start("a fit in time")
        of_averages = note_on_averages(whole, measurement)
        probe, notes = with_measured_circuit(probe, measurement, options.medium)
        notes += of_averages + check_sample(measurement, probe)
        if not in_time and (options.usual_priors or "chip_K_per_mW" in options.priors):
            # that none is stated says nothing against the usual ones
            probe = as_known(probe, options.priors or None)
        options = options.of(probe, in_time=in_time)
        priors, more = _priors(options, probe, measurement)
        informed = bool(priors or before.names)
        # data that tell, with priors, which of them are outliers
        enough = int(np.isfinite(measurement.current(probe.circuit)).sum()) >= 15
        options = replace(
            options,
            priors=priors,
            usual_priors=False,
            robust=options.robust or (enough and informed),
        )
        observables = _observables(options, measurement, probe, notes)
        # priors are in standard deviations, so the data must be too
        weights = "errors" if informed else options.weights
        base = probe.circuit.base_temperature_K
        common = errors_of_scales(measurement, observables, priors, base) if informed else []
        numerics = options.numerics
        residuals = Residuals(measurement, observables, weights, common=common, numerics=numerics)
        if not informed and residuals.different < len(options.varied):
            raise InputError(
                f"{measurement.path or 'measurement'}: {residuals.different} different data for "
                f"{len(options.varied)} parameters; fix some or measure at more "
                f"{'times' if in_time else 'biases'}"
            )
        density = PriorDensity.of_priors(priors)
        start = probe.replace(dict(zip(density.names, density.values.tolist(), strict=True)))
        held = {name: value for name, value in options.fixed.items() if value is not None}
        return cls(
            measurement=measurement,
            probe=probe,
            options=options,
            known=priors,
            prior=density.beside(before),
            residuals=residuals,
            start=start.with_(**held) if held else start,
            notes=notes + more,
            stated=stated,
            model=model,
        )

    @property
    def informed(self) -> bool:
        """Whether anything is known beforehand."""
        return bool(self.prior.names)

    @property
    def in_time(self) -> bool:
        """Whether the lever was measured in time."""
        return self.measurement.time_us is not None

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that a search at rest has derivatives by."""
        return tuple(dict.fromkeys([*self.options.usual, *self.options.varied]))

    @cached_property
    def causes(self) -> Diagnosis:
        """What may be behind the data if no such lever shows them."""
        diagnosis = self.options.numerics.diagnosis
        return Diagnosis(self.measurement, self.probe, self.stated, diagnosis, self.names)

    @cached_property
    def experiment(self) -> Experiment:
        """The forward map from the lever's parameters to what was measured."""
        residuals, names = self.residuals, self.names
        if self.measurement.waveform is not None:
            follow = partial(
                ExperimentInTime.of, waveform=self.measurement.waveform, names=self.options.varied
            )
            return (self.model or follow)(self.probe, residuals.along)
        experiment = (self.model or partial(experiment_of, names=names))(self.probe, residuals.bias)
        assert isinstance(experiment, ExperimentAtRest)
        # with priors errors are a matter of standard deviations; the fast lever's slopes do
        experiment = replace(experiment, names=names, first_order=not self.informed)
        experiment = with_distances(experiment, self.probe, residuals.distance_um)
        return experiment.measuring(*residuals.at_rest)


def _priors(
    options: FitOptions, probe: Probe, measurement: Measurement
) -> tuple[dict[str, Prior], list[str]]:
    """Return what is known beforehand of a probe, and notes on what of that does not count."""
    in_time = measurement.time_us is not None
    priors = priors_of(options.priors, probe, "priors", in_time=in_time)
    notes = []
    without_effect = [
        name
        for name in options.priors
        if name not in (*priors, "dimensions") and not is_of_laws(name)
    ]
    if without_effect:
        notes.append(
            f"priors that do not count in {probe.surroundings.medium}, and have no effect: "
            f"{', '.join(without_effect)}"
        )
    if options.usual_priors:
        usual = updated(default_priors(probe), options.priors, probe, "priors", in_time=in_time)
        priors = {name: usual[name] for name in usual if name not in options.fixed} | priors
    if in_time:
        varied = replace(options, priors=priors).varied
        priors, more = known_in_time(probe, measurement, priors, varied)
        notes += more
    return priors, notes


def _observables(
    options: FitOptions, measurement: Measurement, probe: Probe, notes: list[str]
) -> tuple[str, ...]:
    """Return what is to be fitted: by default all that has data and that the probe can show."""
    where = measurement.path or "measurement"
    # without a contact there is no such measurement
    can_be = {*probe.observables, *OF_A_CONTACT}
    fittable = tuple(name for name in measurement.observables if name in can_be)
    for name in options.observables or measurement.observables:
        symbol = FITTED[name].symbol
        if name not in measurement.observables:
            raise InputError(
                f"{where}: no values of {name} (column {symbol}); it has "
                f"{', '.join(measurement.observables)}"
            )
        if name in fittable:
            continue
        reason = (
            "the probe has no reader"
            if name == "reader"
            else "the probe has no bridge (bridge_upper_ohm and bridge_lower_ohm in [circuit])"
        )
        if options.observables is None and fittable:
            notes.append(f"{symbol}: {reason}, so that these values are not fitted")
        else:
            expected = f"fit {', '.join(fittable)}" if fittable else "there is nothing else to fit"
            raise InputError(f"{where}: {symbol}: {reason}; {expected}")
    return fittable if options.observables is None else tuple(options.observables)
