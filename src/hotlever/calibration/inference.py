"""A calibration as an estimate: what is known of a lever, brought up to date by its measurement.

Material, dimensions and circuit have priors (`hotlever.probe.priors`); the measurement moves them
to where both are most likely, and the tip temperature with its error follows from there. No knee
is needed: a lever that was measured below it is less certain above, and that is all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hotlever.calibration.jumps import Jump, jumps_of
from hotlever.calibration.knee import Knee
from hotlever.errors import ComputationError, InputError
from hotlever.estimation import Fit, FitOptions, Measurement
from hotlever.estimation.experiment_at_rest import PredictionAtRest
from hotlever.estimation.inverse_problem import Estimate, estimate
from hotlever.estimation.objective import TIP
from hotlever.estimation.posterior import Posterior
from hotlever.estimation.prior_density import PriorDensity
from hotlever.estimation.profile import profile_of_tip
from hotlever.lever import Branch
from hotlever.lever.curve import spline_through
from hotlever.materials import Material
from hotlever.materials.parameters import own_name
from hotlever.probe import Probe
from hotlever.probe.parameters import usual_parameters
from hotlever.probe.priors import (
    SCALES,
    Prior,
    default_priors,
    known_beforehand,
    priors_of,
    published_material,
)
from hotlever.probe.surroundings import Surroundings
from hotlever.text import BAND
from hotlever.types import Array, Progress

#: Rows of the table.
_ROWS = 101
#: By which source of error a parameter counts.
_CIRCUIT = {
    "series_resistance_ohm": "electronics",
    "gas_conductivity": "air",
    "surface_gap_um": "air",
    "base_temperature_K": "base temperature",
}
#: Share of the rise by which the flat lever, or air as panels, differ from full 3-D where the tip
#: is no steeper in bias than that of a lever of constant properties (benchmarks/air_3d.py).
_MODEL = {"vacuum": 3e-4, "air": 7e-4}
#: The same by the jump of the air's temperature at surfaces, where no accommodation is stated: with
#: one of 0.9 air takes up 6 % less, more where the lever is narrow, and an estimate without it is
#: off by so much (rms of six twins from number 1000 on, of both shapes, linearised).
_JUMP = 7e-3
#: The same by the law of the mobility: how far two estimates of a lever are apart, with another law
#: (MINIMOS) in place of Eq. 8 (rms of seven pairs of twins from number 1000 on).
_MOBILITY = 4e-3


def estimate_lever(
    measured: Measurement,
    probe: Probe,
    fit: Fit | None = None,
    priors: Mapping[str, Prior | str] | None = None,
    progress: Progress | None = None,
) -> tuple[Estimate, dict[str, Prior]]:
    """Estimate a lever from its measurement; return with it what was known beforehand.

    Parameters
    ----------
    measured : Measurement
    probe : Probe
        In the circuit and medium of the measurement.
    fit : Fit, optional
        Of this lever to other data, or to the same. Its data count, not what it made of them.
    priors : mapping of str to Prior or str, optional
        In place of some of the usual ones; if empty there are none, and dimensions are held.
    progress : callable, optional

    Raises
    ------
    ComputationError
        If no lever near the probe has states at all measured biases.
    """
    known, medium = known_beforehand(probe, priors), probe.surroundings.medium
    if fit is None:
        options = FitOptions(priors=known, medium=medium)
        return estimate(measured, probe, options, progress=progress), known
    before_fit = _before(fit, priors)
    fixed = dict.fromkeys(fit.options.fixed)
    options = FitOptions(
        observables=fit.observables,
        fixed=fixed,
        priors=before_fit,
        medium=fit.probe.surroundings.medium,
    )
    fitted = estimate(fit.measurement, fit.probe, options, progress=progress)
    if _same_data(fit.measurement, measured):
        return fitted, before_fit
    # what that leaves of the lever itself is known before the other data; circuit and gas are
    # those of each measurement
    own = [name for name in fitted.options.varied if name not in _CIRCUIT]
    numbers = [fitted.options.varied.index(name) for name in own]
    values, covariance = fitted.probe.values(own), fitted.posterior.covariance
    relative = np.array([name not in before_fit or before_fit[name].relative for name in own])
    left = PriorDensity.of_estimate(own, values, covariance[np.ix_(numbers, numbers)], relative)
    probe = probe.replace(dict(zip(own, values.tolist(), strict=True)))
    theirs = {name: prior for name, prior in known.items() if name in {*_CIRCUIT, *SCALES}}
    free = tuple(name for name in own if name not in usual_parameters(probe))
    again = FitOptions(fixed=fixed, priors=theirs, free=free, medium=medium)
    try:
        return (
            estimate(measured, probe, again, before=left, progress=progress),
            {**before_fit, **theirs},
        )
    except ComputationError as error:
        raise ComputationError(
            f"no lever like the fitted one shows these data; is it another lever's fit? ({error})"
        ) from error


def _before(fit: Fit, priors: Mapping[str, Prior | str] | None) -> dict[str, Prior]:
    """Return what was known of a lever before it was fitted.

    The probe of a fit has the material that was found, so that this is no prior of its own.
    """
    if priors is not None and not priors:
        return {}
    asked = priors_of({**fit.options.priors, **(priors or {})}, fit.probe, "priors")
    known = default_priors(fit.probe, published_material()) | asked
    return {name: prior for name, prior in known.items() if name not in fit.options.fixed}


def _same_data(first: Measurement, second: Measurement) -> bool:
    same = np.array_equal(first.bias_V, second.bias_V, equal_nan=True)
    return same and np.array_equal(first.current_mA, second.current_mA, equal_nan=True)


# --- the tip temperature by bias ------------------------------------------------------------------


@dataclass(frozen=True)
class TipByBias:
    """The tip temperature at even rows over the measured range, and how sure it is.

    Attributes
    ----------
    bias_V, current_mA, tip_K : ndarray, shape (n,)
    parts : dict of str to ndarray
        Standard error of the tip temperature (K) at the rows, by source; independent of each other.
    low_K, high_K : ndarray, shape (n,)
        What 95 % lie between; they are as far away as the errors say, unless these do not hold.
    jumps : list of Jump
        Between measured rows.
    asymmetry : str
        Where the interval is from, if not from the errors.
    """

    bias_V: Array
    current_mA: Array
    tip_K: Array
    parts: dict[str, Array]
    low_K: Array
    high_K: Array
    jumps: list[Jump]
    asymmetry: str


def measured_range(estimate: Estimate) -> Array:
    """Return even biases (V) over the measured range, as far as the lever has states."""
    measured, circuit = estimate.measurement, estimate.probe.circuit
    # without a bias nothing is known of a lever that is cold then
    heated = (measured.bias_V > 0) | (not circuit.starts_cold)
    present = measured.bias_V[np.isfinite(measured.current_mA) & heated]
    return np.linspace(present.min(), min(present.max(), highest_bias(estimate)), _ROWS)


def highest_bias(estimate: Estimate) -> float:
    """Return the highest bias (V) up to the highest measured one at which the lever has a state."""
    measured = float(estimate.residuals.bias.max())
    return estimate.branch.highest_bias(estimate.probe.circuit, measured)


def tip_by_bias(
    estimate: Estimate, samples: int = 0, progress: Progress | None = None
) -> TipByBias:
    """Return the tip temperature of an estimated lever with its error, by bias.

    Parameters
    ----------
    estimate : Estimate
    samples : int
        Of the posterior, from which the credible interval is then taken; none by default.
    progress : callable, optional

    Raises
    ------
    InputError
        If samples are asked for of an estimate without priors.
    """
    probe, posterior = estimate.probe, estimate.posterior
    bias = measured_range(estimate)
    predicted = estimate.predicted(bias)
    tip, slopes = predicted.values[TIP], predicted.slopes[TIP][:, estimate.objective.columns]
    variances = {
        source: np.einsum("bi,ij,bj->b", slopes, share, slopes)
        for source, share in shares_by_source(posterior).items()
    }
    stderr = np.sqrt(np.sum(list(variances.values()), axis=0))
    rise = tip - probe.circuit.base_temperature_K
    of_model = error_of_model(probe.surroundings, estimate.options.varied, bias, rise)
    variances["model"] = of_model**2
    (low, high), asymmetry = _credible_interval(estimate, tip, stderr, of_model, samples, progress)
    at_rows = estimate.residuals.bias, estimate.prediction.values[TIP]
    jumps = jumps_of(estimate.branch, probe.circuit, *at_rows)
    for jump in jumps:
        here = jump.unknown(bias)
        low = np.where(here, np.minimum(low, jump.cold_K), low)
        high = np.where(here, np.maximum(high, jump.hot_K), high)
        variances["jump"] = here * ((jump.hot_K - jump.cold_K) / (2.0 * BAND)) ** 2
    parts = {source: np.sqrt(variance) for source, variance in variances.items()}
    return TipByBias(bias, predicted.values[0], tip, parts, low, high, jumps, asymmetry)


def _credible_interval(
    estimate: Estimate,
    tip: Array,
    stderr: Array,
    of_model: Array,
    samples: int,
    progress: Progress | None,
) -> tuple[tuple[Array, Array], str]:
    """Return what 95 % of the tip temperatures lie between (K), and words on where that is from."""
    posterior, away = estimate.posterior, BAND * np.hypot(stderr, of_model)
    too_few = ""
    if not estimate.objective.informed:
        if samples:
            raise InputError("posterior: expected priors, without which it is not that of a fit")
        return (tip - away, tip + away), ""
    if samples:
        # what samples takes a second to load, for which few calibrations have to wait
        from hotlever.estimation.sampling import sample_tip

        sampled = sample_tip(posterior, estimate.optimiser, samples=samples, progress=progress)
        if sampled.enough:
            return sampled.profile.credible_interval(tip, stderr, of_model), sampled.note
        too_few = sampled.note
    profile = profile_of_tip(posterior, estimate.optimiser.model)
    if profile.linear:
        return (tip - away, tip + away), too_few
    low, high = profile.credible_interval(tip, stderr, of_model)
    note = (
        "the tip temperature is not a linear function of what is unknown, so that its limits come "
        f"from estimates of hotter and colder levers: at {tip[-1]:.0f} K 95 % lie from "
        f"{low[-1]:.0f} to {high[-1]:.0f} K"
    )
    return (low, high), "; ".join(filter(None, (too_few, note)))


def shares_by_source(posterior: Posterior) -> dict[str, Array]:
    """Return what adds up to the covariance (p, p), by source of error; independent."""
    shares: dict[str, Array] = {}
    for name, share in posterior.shares.items():
        source = name if name in ("measurement", "fit") else _source(name)
        shares[source] = shares.get(source, 0.0) + share
    return shares


def _source(name: str) -> str:
    of_material = "." in name or name in Material.model_fields
    return _CIRCUIT.get(name, "material" if of_material else "geometry")


def error_of_model(around: Surroundings, varied: Sequence[str], bias: Array, rise: Array) -> Array:
    """Return by how much the tip may be off since the model is (K); most where the tip is steep.

    The law of the mobility counts where its exponents are estimated.
    """
    # a rise that grows as the square of the bias is that of a lever of constant properties
    square, size = np.abs(0.5 * bias * np.gradient(rise, bias)), np.abs(rise)
    error = _MODEL[around.medium] * np.maximum(size, square)
    if around.medium == "air" and around.accommodation is None:
        error = np.hypot(error, _JUMP * size)
    if any(own_name(name) == "impurity_exponent" for name in varied):
        error = np.hypot(error, _MOBILITY * size)
    return np.asarray(error)


# --- knee and power -----------------------------------------------------------------------------


def knee_of(estimate: Estimate, branch: Branch) -> Knee:
    """Return the knee of a branch of the estimated lever, with standard errors; NaN without one.

    There are no errors of a knee that the lever may have beyond the measured range.
    """
    if branch.knee is None:
        return Knee()
    assert isinstance(estimate.prediction, PredictionAtRest)
    surrogate, circuit = estimate.prediction.surrogate, estimate.probe.circuit

    def values(branch: Branch) -> Array:
        """Return V_l, I_h, P_l and V_b of a knee; NaN without one."""
        point = branch.knee
        if point is None:
            return np.full(4, np.nan)
        bias = circuit.bias(point.lever_V, point.current_mA)
        return np.array([point.lever_V, point.current_mA, point.power_mW, bias])

    changes = estimate.posterior.changes(lambda at: values(surrogate.branch_at(at)))
    errors = np.sqrt(np.sum(changes**2, axis=0))
    return Knee(*values(branch).tolist(), *errors.tolist())


def held_power(estimate: Estimate, bias: Array) -> Array:
    """Return the power of the held supplies at some biases (mW), within a coarse mesh's error."""
    branch = estimate.branch
    equations, x = branch.equations, branch.x
    own = x[-1] * equations.observed(x)[1]
    u = branch.read(estimate.probe.circuit, bias).u
    return np.asarray(spline_through(branch.u, equations.power(x) - own)(u))
