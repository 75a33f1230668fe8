"""A calibration as an estimate: what is known of a lever, brought up to date by its measurement.

Material, dimensions and circuit have priors (`hotlever.probe.priors`); the measurement moves them
to where both are most likely, and the tip temperature with its error follows from there. No knee
is needed: a lever that was measured below it is less certain above, and that is all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hotlever.calibration.jumps import jumps_of, not_of_a_ramp
from hotlever.calibration.knee import Knee
from hotlever.calibration.plausibility import misfit
from hotlever.errors import ComputationError, InputError
from hotlever.estimation import Fit, FitOptions, Measurement
from hotlever.estimation.either_medium import error_of_choice
from hotlever.estimation.inverse_problem import Estimate, estimate
from hotlever.estimation.limits import profile_of_tip
from hotlever.lever import Branch
from hotlever.lever.curve import spline_through
from hotlever.lever.dataset import OBSERVABLES
from hotlever.materials import Material
from hotlever.probe import Probe
from hotlever.probe.parameters import own_name, usual_parameters
from hotlever.probe.priors import (
    SCALES,
    JointPrior,
    Prior,
    PriorUse,
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
#: Share of the measured biases that a lever must reach to show the data.
_REACHED = 0.98
#: How far (standard errors) along each axis of the estimate the knee is looked at.
_ASIDE = 0.5


@dataclass(frozen=True)
class Estimated:
    """A lever as estimated, and what that says of its tip temperature.

    Attributes
    ----------
    probe : Probe
    bias_V, current_mA, tip_K : ndarray, shape (n,)
        Even rows over the measured range.
    parts : dict of str to ndarray
        Standard error of the tip temperature (K) at the rows, by source; independent of each other.
    tip_low_K, tip_high_K : ndarray, shape (n,)
        What 95 % lie between; they are as far away as the errors say, unless these do not hold.
    priors : dict of str to PriorUse
    reason : str
        Why the data are not described, or why that is not known; empty if they are.
    converged : bool
        Whether the search came to its end.
    notes : list of str
    estimate : Estimate
        That all this is read from.
    """

    probe: Probe
    bias_V: Array
    current_mA: Array
    tip_K: Array
    parts: dict[str, Array]
    tip_low_K: Array
    tip_high_K: Array
    priors: dict[str, PriorUse]
    reason: str
    notes: list[str]
    estimate: Estimate
    converged: bool = True

    @property
    def held_mW(self) -> Array:
        """Power of the held supplies at the rows (mW), within the error of a coarse mesh."""
        branch = self.branch
        equations, x = branch.equations, branch.x
        own = x[-1] * equations.observed(x)[1]
        u = branch.read(self.probe.circuit, self.bias_V).u
        return np.asarray(spline_through(branch.u, equations.power(x) - own)(u))

    @property
    def branch(self) -> Branch:
        """The lever as far as it was measured, corrected by the full model."""
        return self.estimate.branch

    def knee_of(self, branch: Branch) -> Knee:
        """Return the knee of a branch of this lever, with standard errors; NaN without one."""
        if branch.knee is None:
            return Knee()
        point, circuit = branch.knee, self.probe.circuit
        values = [point.lever_V, point.current_mA, point.power_mW]
        values.append(float(circuit.bias(point.lever_V, point.current_mA)))
        return Knee(*values, *np.sqrt(np.sum(self._knee_changes() ** 2, axis=0)).tolist())

    @property
    def varied(self) -> list[str]:
        """The parameters that were estimated."""
        return self.estimate.options.varied

    @property
    def shares(self) -> dict[str, Array]:
        """What adds up to their covariance (p, p), by source; independent of each other."""
        return _shares(self.estimate)

    def directions(self, least: float = 0.0) -> list[dict[str, float]]:
        """Return changes of the parameters by one standard error, independent of each other.

        They are along the axes of the correlation, those left out whose variance is less than
        some share of a parameter's.
        """
        covariance = self.estimate.covariance
        scale = np.sqrt(np.diag(covariance))
        variances, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
        steps = (axes * np.sqrt(np.maximum(variances, 0.0)) * scale[:, None]).T
        kept = variances >= least
        return [dict(zip(self.varied, step.tolist(), strict=True)) for step in steps[kept]]

    def or_else(self, other: Estimated) -> Estimated:
        """Return what is known of the tip temperature if the lever may as well be another one."""
        tip, low, high = (
            np.interp(self.bias_V, other.bias_V, known)
            for known in (other.tip_K, other.tip_low_K, other.tip_high_K)
        )
        return replace(
            self,
            parts=self.parts | {"medium": error_of_choice(self.tip_K, tip)},
            tip_low_K=np.minimum(self.tip_low_K, low),
            tip_high_K=np.maximum(self.tip_high_K, high),
        )

    def _knee_changes(self) -> Array:
        """Return V_l, I_h, P_l and V_b of the knee one standard error away on each axis."""
        known = self.estimate.problem.model.names
        at = self.estimate.optimum.prediction
        origin, circuit = at.probe.at(known), self.probe.circuit
        changes = []
        for direction in self.directions():
            axis = np.array([direction.get(name, 0.0) for name in known])
            ends = []
            for way in (_ASIDE, -_ASIDE):
                knee = at.nearby.branch_at(origin + way * axis).knee
                if knee is None:  # beyond the measured range
                    return np.full((1, 4), np.nan)
                shown = [knee.lever_V, knee.current_mA, knee.power_mW]
                ends.append([*shown, circuit.bias(knee.lever_V, knee.current_mA)])
            changes.append((np.array(ends[0]) - np.array(ends[1])) / (2.0 * _ASIDE))
        return np.array(changes)


def estimated(
    measured: Measurement,
    probe: Probe,
    fit: Fit | None = None,
    priors: Mapping[str, Prior | str] | None = None,
    samples: int = 0,
    progress: Progress | None = None,
) -> Estimated:
    """Estimate a lever from its measurement.

    Parameters
    ----------
    measured : Measurement
    probe : Probe
        In the circuit and medium of the measurement.
    fit : Fit, optional
        Of this lever to other data, or to the same. Its data count, not what it made of them.
    priors : mapping of str to Prior or str, optional
        In place of some of the usual ones; if empty there are none, and dimensions are held.
    samples : int
        Of the posterior, from which the limits are then taken; none by default.
    progress : callable, optional

    Raises
    ------
    ComputationError
        If no lever near the probe has states at all measured biases.
    """
    known = known_beforehand(probe, priors)
    if fit is None:
        options = FitOptions(priors=known)
        found = estimate(measured, probe, options, progress=progress)
        return _put_together(found, measured, known, samples, progress)
    held = _before(fit, priors)
    options = FitOptions(
        observables=fit.observables,
        fixed=dict.fromkeys(fit.options.fixed),
        priors=held,
    )
    found = estimate(fit.measurement, fit.probe, options, progress=progress)
    if _same_data(fit.measurement, measured):
        return _put_together(found, measured, held, samples, progress)
    # what that leaves of the lever itself is known before the other data; circuit and gas are
    # those of each measurement
    own = [name for name in found.options.varied if name not in _CIRCUIT]
    places = [found.options.varied.index(name) for name in own]
    values = found.optimum.probe.at(own)
    relative = np.array([name not in held or held[name].relative for name in own])
    joint = JointPrior(own, values, found.covariance[np.ix_(places, places)], relative)
    probe = probe.moved(dict(zip(own, values.tolist(), strict=True)))
    theirs = {name: prior for name, prior in known.items() if name in {*_CIRCUIT, *SCALES}}
    again = FitOptions(
        fixed=options.fixed,
        priors=theirs,
        free=tuple(name for name in own if name not in usual_parameters(probe)),
    )
    try:
        found = estimate(measured, probe, again, joint=joint, progress=progress)
    except ComputationError as error:
        raise ComputationError(
            f"no lever like the fitted one shows these data; is it another lever's fit? ({error})"
        ) from error
    return _put_together(found, measured, {**held, **theirs}, samples, progress)


def _before(fit: Fit, priors: Mapping[str, Prior | str] | None) -> dict[str, Prior]:
    """Return what was known of a lever before it was fitted.

    The probe of a fit has the material that was found, so that this is no prior of its own.
    """
    if priors is not None and not priors:
        return {}
    asked = priors_of({**fit.options.priors, **(priors or {})}, fit.probe, "priors")
    known = default_priors(fit.probe, published_material()) | asked
    return {name: prior for name, prior in known.items() if name not in fit.options.fixed}


def _same_data(one: Measurement, other: Measurement) -> bool:
    same = np.array_equal(one.bias_V, other.bias_V, equal_nan=True)
    return same and np.array_equal(one.current_mA, other.current_mA, equal_nan=True)


def _put_together(
    found: Estimate,
    measured: Measurement,
    known: Mapping[str, Prior],
    samples: int,
    progress: Progress | None,
) -> Estimated:
    best, residuals = found.optimum.probe, found.problem.residuals
    # without a bias nothing is known of a lever that is cold then
    heated = (measured.bias_V > 0) | (not best.circuit.starts_cold)
    present = measured.bias_V[np.isfinite(measured.current_mA) & heated]
    at, branch = found.optimum.prediction, found.branch
    highest = branch.highest_bias(best.circuit, float(residuals.bias.max()))
    bias = np.linspace(present.min(), min(present.max(), highest), _ROWS)
    predicted = found.predicted(bias)
    slopes = found.slopes(predicted)[list(OBSERVABLES).index("tip")]
    parts: dict[str, Array] = {
        source: np.einsum("bi,ij,bj->b", slopes, share, slopes)
        for source, share in _shares(found).items()
    }
    tip = predicted.values[2]
    rise = tip - best.circuit.base_temperature_K
    of_model = error_of_model(best.surroundings, found.options.varied, bias, rise)
    stderr = np.sqrt(np.sum(list(parts.values()), axis=0))
    (low, high), lopsided = _limits(found, tip, stderr, of_model, samples, progress)
    parts["model"] = of_model**2
    jumps = jumps_of(branch, best.circuit, residuals.bias, at.values[2])
    for jump in jumps:
        here = jump.unknown(bias)
        low, high = (
            np.where(here, np.minimum(low, jump.cold_K), low),
            np.where(here, np.maximum(high, jump.hot_K), high),
        )
        parts["jump"] = here * ((jump.hot_K - jump.cold_K) / (2.0 * BAND)) ** 2
    use = found.priors(known)
    converged, reason = found.verdict(misfit(residuals, at.values, use, found.moved))
    reason = reason or not_of_a_ramp(branch, best.circuit, residuals.bias, at.values[2])
    if not reason and highest < _REACHED * float(residuals.bias.max()):
        reason = f"the lever that comes nearest has no steady state above {highest:.4g} V"
    return Estimated(
        probe=best,
        bias_V=bias,
        current_mA=predicted.values[0],
        tip_K=tip,
        parts={source: np.sqrt(variance) for source, variance in parts.items()},
        tip_low_K=low,
        tip_high_K=high,
        priors=use,
        reason=reason,
        notes=[
            *found.notes,
            *([] if reason else lopsided),
            *(jump.note for jump in jumps),
            *residuals.suspicious(at.values, robust=True),
        ],
        estimate=found,
        converged=converged,
    )


def _shares(found: Estimate) -> dict[str, Array]:
    """Return what adds up to the covariance of the varied parameters, by source."""
    shares: dict[str, Array] = {}
    for name, share in found.problem.objective.shares(found.optimum.prediction).items():
        source = name if name in ("measurement", "fit") else _source(name)
        shares[source] = shares.get(source, 0.0) + share
    return shares


def _limits(
    found: Estimate,
    tip: Array,
    stderr: Array,
    of_model: Array,
    samples: int,
    progress: Progress | None,
) -> tuple[tuple[Array, Array], list[str]]:
    """Return what 95 % of the tip temperatures lie between (K), and words on where that is from."""
    objective, at = found.problem.objective, found.optimum.prediction
    away = BAND * np.hypot(stderr, of_model)
    if samples and not objective.informed:
        raise InputError("posterior: expected priors, without which it is not that of a fit")
    if not objective.informed:
        return (tip - away, tip + away), []
    if samples:
        # what samples takes a second to load, for which few calibrations have to wait
        from hotlever.estimation.sampled_limits import posterior_of_tip

        posterior = posterior_of_tip(
            objective,
            at,
            found.problem.others(at),
            found.covariance,
            samples=samples,
            progress=progress,
        )
        return posterior.profile.limits(tip, stderr, of_model), [posterior.note]
    profile = profile_of_tip(objective, at, found.solved, found.covariance)
    if profile.linear:
        return (tip - away, tip + away), []
    low, high = profile.limits(tip, stderr, of_model)
    return (low, high), [
        "the tip temperature is not a linear function of what is unknown, so that its limits come "
        f"from estimates of hotter and colder levers: at {tip[-1]:.0f} K 95 % lie from "
        f"{low[-1]:.0f} to {high[-1]:.0f} K"
    ]


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


def _source(name: str) -> str:
    of_material = "." in name or name in Material.model_fields
    return _CIRCUIT.get(name, "material" if of_material else "geometry")
