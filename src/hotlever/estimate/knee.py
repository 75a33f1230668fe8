"""The knee of a measured I-V curve, where dV_l/dI_h = 0, and a lever that is scaled to it.

The lever voltage V_l = V_b - R_s I_h has its highest value at the knee. V_l(I_h) turns back
there, but the curve is a single-valued function of the power P_l = V_l I_h, so the resistance is
smoothed against the power, and the knee is where the smooth V_l(P_l) is highest.

The paper's rule (Section V) has one factor k from it. In another medium, or on another lever of the
same kind, the tip temperature is the same function of the power but for one factor,
T(P) = T_ref(P / k), and the knee tells the factor. What T_ref is decides how good that is: a power
law, the model of a probe, or a model fitted to the lever itself. The error comes from the knee,
from the meters, and from how much levers of other dimensions and materials differ from the one
whose temperatures are taken over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import curve_fit, minimize

from hotlever.errors import InputError, counted
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.power_law import PowerLaw, law_of_model, power_turns
from hotlever.estimate.tip_table import Knee, rms, table_by_bias
from hotlever.lever import Branch
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement, with_measured_circuit
from hotlever.measurement.rows import averaged, note_on_averages
from hotlever.piecewise import spline_through
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import default_priors
from hotlever.probe.probe_parameters import RESISTANCE
from hotlever.quantities import METERS
from hotlever.text import value_with_error
from hotlever.types import Array
from hotlever.work import one_blas_thread


@dataclass(frozen=True)
class IVCurve:
    """Measured points of a lever, rising in power."""

    bias_V: Array
    current_mA: Array
    circuit: Circuit

    @classmethod
    def of(cls, bias_V: ArrayLike, current_mA: ArrayLike, circuit: Circuit) -> IVCurve:
        """Sort the points by power, and leave out those without bias or lost in noise near zero.

        Raises
        ------
        InputError
            If a lever voltage is not positive, or fewer than six points are left.
        """
        bias, current = np.asarray(bias_V, dtype=float), np.asarray(current_mA, dtype=float)
        present = np.isfinite(bias) & np.isfinite(current) & (bias > 0)
        curve = cls(bias[present], current[present], circuit)
        wrong = (curve.current_mA <= 0) | (curve.lever_V <= 0)
        lost = wrong & (curve.bias_V < 0.01 * curve.bias_V.max(initial=0.0))
        for row in np.flatnonzero(wrong & ~lost):
            raise InputError(
                f"at a bias of {curve.bias_V[row]:g} V the current is {curve.current_mA[row]:g} mA "
                f"and the lever voltage {curve.lever_V[row]:.4g} V with a series resistance of "
                f"{circuit.series_resistance_ohm:g} ohm, expected positive ones"
            )
        curve = curve.rows(~lost)
        fewest = 6
        if curve.bias_V.size < fewest:
            raise InputError(
                f"{counted(curve.bias_V.size, 'point')} with bias and current, expected at least "
                f"{fewest}"
            )
        return curve.rows(np.argsort(curve.power_mW, kind="stable"))

    @property
    def lever_V(self) -> Array:
        """V_l = V_b - R_s I_h."""
        return np.asarray(self.circuit.lever_voltage(self.bias_V, self.current_mA))

    @property
    def power_mW(self) -> Array:
        """P_l = V_l I_h."""
        return self.lever_V * self.current_mA

    def rows(self, chosen: NDArray[Any]) -> IVCurve:
        """Return some of the points, by a mask or their numbers."""
        return IVCurve(self.bias_V[chosen], self.current_mA[chosen], self.circuit)

    @property
    def peak(self) -> int:
        """Row of the first maximum of V_l: hot legs can make it rise again."""
        lever_V = self.lever_V
        # the knee has been passed once V_l has fallen by a twentieth
        fallen = np.flatnonzero(lever_V < 0.95 * np.maximum.accumulate(lever_V))
        return int(np.argmax(lever_V[: fallen[0]] if fallen.size else lever_V))

    @property
    def vertex(self) -> Knee:
        """Where V_l is highest, on the parabola through the three highest points."""
        middle = int(np.clip(self.peak, 1, self.bias_V.size - 2))
        three = self.rows(np.arange(middle - 1, middle + 2))
        parabola = np.polynomial.Polynomial.fit(three.power_mW, three.lever_V, 2)
        power = float(np.clip(parabola.deriv().roots()[0], *three.power_mW[[0, -1]]))
        lever_V = float(parabola(power))
        current = power / lever_V
        return Knee(lever_V, current, power, self.circuit.bias(lever_V, current))


class KneeOutsideError(InputError):
    """The measured range does not include the knee; the text says which way to go."""


def find_knee(
    curve: IVCurve,
    like: Branch | None = None,
    *,
    neighbourhood: float = 1.8,
    fewest: int = 6,
    fewest_beside: int = 2,
    search: float = 1.35,
    powers: int = 151,
    samples: int = 300,
) -> Knee:
    """Find the knee in a measured I-V curve.

    Parameters
    ----------
    curve : IVCurve
        Noisy, unevenly spaced.
    like : Branch, optional
        Of a lever that resembles the measured one. Only its relation of temperature to power,
        scaled to the measured knee, is used: the resistance is a smoother function of the
        temperature than of the power. Halves the bias; also says where the knee is to be
        expected when it is outside the range.
    neighbourhood : float
        Points whose power is within this factor of the highest lever voltage's are used.
    fewest, fewest_beside : int
        Points near the knee, and on either side of it.
    search : float
        The knee is sought within this factor of the highest measured lever voltage's power.
    powers, samples : int
        At how many powers it is sought, and how many smooth curves tell its error.

    Raises
    ------
    KneeOutsideError
        If the points end before the knee, or begin after it.
    InputError
        If there are too few points near it.
    """
    if curve.circuit.series_resistance_ohm == 0.0:
        raise InputError(
            "without a series resistance the lever jumps at its knee, so a measured curve ends "
            "there and does not show it; measure with one of some kΩ"
        )
    _check_sides(curve, like, fewest_beside)
    peak_mW = float(curve.power_mW[curve.peak])
    near = curve.rows(np.abs(np.log(curve.power_mW / peak_mW)) < np.log(neighbourhood))
    smooth = SmoothCurves(near, peak_mW, like)
    measured = smooth.points.power_mW
    beside = min((measured < peak_mW).sum(), (measured > peak_mW).sum())
    if measured.size < fewest or beside < fewest_beside:
        raise InputError(
            f"{counted(measured.size, 'point')} with {peak_mW / neighbourhood:.2f} to "
            f"{peak_mW * neighbourhood:.2f} mW, near the knee, expected at least {fewest} with "
            f"{fewest_beside} on either side; measure more finely there"
        )
    low = max(peak_mW / search, measured[0])
    high = min(peak_mW * search, measured[-1])
    power = np.linspace(low, high, powers)
    likeliest = smooth.likeliest(power)
    if likeliest.peak in (0, powers - 1):
        raise KneeOutsideError(
            "the lever voltage is highest at the end of the points near the knee "
            f"({power[likeliest.peak]:.3f} mW): measure beyond it, and more finely"
        )
    knees = [sample.vertex for sample in smooth.samples(power, samples)]
    spread = {
        f"{name}_stderr": float(np.std([getattr(knee, name) for knee in knees]))
        for name in ("lever_V", "current_mA", "power_mW", "bias_V")
    }
    noise = smooth.current_noise
    return replace(likeliest.vertex, **spread, current_noise=noise, points=measured.size)


def _check_sides(curve: IVCurve, like: Branch | None, fewest: int) -> None:
    """Refuse a curve whose highest lever voltage is at one of its ends."""
    lever_V, bias_V = curve.lever_V, curve.bias_V
    if curve.peak < fewest:
        raise KneeOutsideError(
            f"the lever voltage falls from the first points on ({lever_V[0]:.3f} V at a bias of "
            f"{bias_V[0]:.3f} V): the knee is below the measured range; measure from a lower bias"
        )
    if curve.peak < bias_V.size - fewest:
        return
    advice = "; measure to a higher bias"
    if like is not None and like.knee is not None:
        power, resistance, _ = scale_to(curve, like)
        lever = like.knee.lever_V * float(np.sqrt(power * resistance))
        bias = curve.circuit.bias(lever, power * like.knee.power_mW / lever)
        beyond = max(bias, float(bias_V[-1])) * 1.1
        advice = (
            f", at about {bias:.1f} V by comparison with the model; measure to {beyond:.1f} V or "
            "more"
        )
    raise KneeOutsideError(
        f"the lever voltage still rises at the end of the measured range ({lever_V[-1]:.3f} V at "
        f"a bias of {bias_V[-1]:.3f} V): the knee is beyond it{advice}"
    )


class SmoothCurves:
    """Smooth I-V curves through measured points.

    The logarithm of the root of the resistance, V_l = sqrt(P_l R_l), is smoothed along the
    temperature rise of a lever that resembles the measured one, scaled to a knee; without it, along
    the power.
    """

    def __init__(self, curve: IVCurve, knee_mW: float, like: Branch | None) -> None:
        self._knee_mW, self._like = knee_mW, like
        self.points = curve.rows(np.isfinite(self._along(curve.power_mW)))
        power, lever_V = self.points.power_mW, self.points.lever_V
        # at the knee an error of the current changes the lever voltage, at a power, by R_s times it
        noise = curve.circuit.series_kohm * self.points.current_mA / lever_V
        self._smooth = GaussianProcess(self._along(power), np.log(lever_V / np.sqrt(power)), noise)
        self.current_noise = self._smooth.noise_factor

    def _along(self, power: Array) -> Array:
        """Return the coordinate of some powers: zero without power, and one at the knee."""
        if self._like is None or self._like.knee is None:
            return power / self._knee_mW
        base, knee = self._like.base_temperature_K, self._like.knee
        tip = self._like.tip_temperature(power / self._knee_mW * knee.power_mW)
        return (tip - base) / (knee.tip_K - base)

    def likeliest(self, power: Array) -> IVCurve:
        """Return the likeliest curve at some powers (mW), (n,)."""
        return self._curve(power, self._smooth.value(self._along(power)))

    def samples(self, power: Array, count: int) -> list[IVCurve]:
        """Return so many curves that are as likely by the points, at some powers (mW), (n,)."""
        ln_root_R = self._smooth.samples(self._along(power), count)
        return [self._curve(power, sample) for sample in ln_root_R]

    def _curve(self, power: Array, ln_root_R: Array) -> IVCurve:
        circuit, current = self.points.circuit, np.sqrt(power) * np.exp(-ln_root_R)
        return IVCurve(np.asarray(circuit.bias(power / current, current)), current, circuit)


class GaussianProcess:
    """A smooth curve with its uncertainty, found from noisy values by largest likelihood.

    Rasmussen and Williams, "Gaussian Processes for Machine Learning", MIT Press (2006), chapters 2,
    4 and 5, with the Matérn 5/2 covariance: functions with two derivatives, no more, which does not
    round off a sharp bend as smoother covariances do.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Points and values, both of the order of one.
    noise : ndarray, shape (n,)
        Standard errors of the values up to a common factor, `noise_factor`, which is found.
    """

    @one_blas_thread
    def __init__(self, x: Array, y: Array, noise: Array) -> None:
        self._x, self._mean, self._noise = x, float(np.mean(y)), noise
        values = y - self._mean

        def cost(logarithms: Array) -> float:
            """Minus the logarithm of the marginal likelihood, less a constant."""
            factor = self._factorised(*np.exp(logarithms))
            return float(
                0.5 * values @ cho_solve(factor, values) + np.log(np.diag(factor[0])).sum()
            )

        # of length, amplitude and noise, where coordinates and values are of the order of one
        bounds = np.log([(0.03, 5.0), (1e-3, 20.0), (1e-6, 0.3)])
        # there may be two optima: a bent curve with little noise, a smooth one with more
        starts = np.log([(0.25, 0.5, 2e-3), (0.5, 0.5, 2e-2)])
        optima = [minimize(cost, start, method="L-BFGS-B", bounds=bounds) for start in starts]
        best = min(optima, key=lambda optimum: optimum.fun)
        self._length, self._amplitude, self.noise_factor = np.exp(best.x).tolist()
        self._factor = self._factorised(*np.exp(best.x))
        self._weights = cho_solve(self._factor, values)

    def _factorised(self, length: float, amplitude: float, noise_factor: float) -> tuple:
        covariance = _covariance(self._x, self._x, length, amplitude)
        # so that rounding leaves the covariance of the points positive
        variance = (noise_factor * self._noise) ** 2 + 1e-11
        return cho_factor(covariance + np.diag(variance), lower=True)

    def value(self, x: Array) -> Array:
        """Return the curve at some places, (m,)."""
        cross = _covariance(x, self._x, self._length, self._amplitude)
        return np.asarray(self._mean + cross @ self._weights)

    @one_blas_thread
    def samples(self, x: Array, count: int) -> Array:
        """Return curves that are as likely as this one by the points, (count, m); always the same.

        They scatter about it by its standard error.
        """
        cross = _covariance(x, self._x, self._length, self._amplitude)
        prior = _covariance(x, x, self._length, self._amplitude)
        covariance = prior - cross @ cho_solve(self._factor, cross.T)
        rng = np.random.default_rng(0)
        return rng.multivariate_normal(self.value(x), covariance, count, method="eigh")


def _covariance(x: Array, y: Array, length: float, amplitude: float) -> Array:
    """Return the covariance of the curve at some places, (n,), with that at others, (m,)."""
    distance = np.abs(x[:, None] - y) * np.sqrt(5.0) / length
    matern = (1.0 + distance + distance**2 / 3.0) * np.exp(-distance)
    # with a mean of unit variance
    return np.asarray(amplitude**2 * matern + 1.0)


# --- the scale between a measured curve and a lever that resembles it -----------------------------


def scale_to(curve: IVCurve, like: Branch, fewest: int = 2) -> tuple[float, float, float]:
    """Stretch the resistance against power of one lever to the points of another.

    Uses every point up to the knee, and needs no knee: the resistance rises with the temperature,
    so the power at which it has risen by as much tells the scale. There are so many points below
    the highest lever voltage at least.

    Returns
    -------
    power, resistance : float
        The measured lever needs so many times the power for the same temperature, and then has so
        many times the resistance.
    power_stderr : float
        Of the former, as the scatter of the points says.

    Raises
    ------
    InputError
        If the points are so few, or so cold, that the resistance does not tell.
    """
    below = curve.rows(np.arange(curve.peak + 1))
    if curve.peak < fewest:
        raise InputError(
            f"the lever voltage is highest at point {curve.peak + 1}: too few are below "
            "the knee to tell how much power the lever needs; measure from a lower bias"
        )
    top = like.knee.power_mW if like.knee is not None else like.by_power.highest_mW

    def ln_resistance(power: Array, ln_power_scale: float, ln_resistance_scale: float) -> Array:
        own = power * np.exp(-ln_power_scale)
        lever_V = like.lever_voltage(like.tip_temperature(np.minimum(own, top)))
        return np.log(lever_V**2 / own) + ln_resistance_scale

    # from where the last point is at the other lever's knee, up to twenty times as far
    lowest = float(np.log(below.power_mW[-1] / top))
    highest = lowest + np.log(20.0)
    start, bounds = (lowest + 0.1, 0.0), ((lowest, -np.inf), (highest, np.inf))
    measured = np.log(below.lever_V / below.current_mA)
    values, covariance = curve_fit(ln_resistance, below.power_mW, measured, start, bounds=bounds)
    if values[0] > highest - 0.01:
        raise InputError(
            "the resistance hardly changes over the measured points: they are too cold to tell "
            "how much power the lever needs"
        )
    power, resistance = np.exp(values).tolist()
    return power, resistance, power * float(np.sqrt(covariance[0, 0]))


# --- the paper's rule -----------------------------------------------------------------------------

#: How far a parameter is moved for a derivative, in standard deviations of its prior.
_STEP = 0.1


@dataclass(frozen=True)
class TemperatureCurve:
    """Tip temperature against power of a reference, and the power of its knee.

    Attributes
    ----------
    tip : callable
        Temperature (K) of powers (mW); NaN where nothing is known.
    knee_mW : float
    """

    tip: Callable[[Array], Array]
    knee_mW: float

    def at(self, power_mW: Array, knee_mW: float) -> Array:
        """Return the temperature (K) of a lever whose knee is at `knee_mW`."""
        return self.tip(np.asarray(power_mW, dtype=float) * (self.knee_mW / knee_mW))


def curve_of_law(law: PowerLaw, base_temperature_K: float) -> TemperatureCurve:
    """Return a power law as a reference; its threshold stands for the knee, as in the paper."""
    return TemperatureCurve(
        lambda power: law.tip_temperature(power, base_temperature_K), law.threshold_mW
    )


def curve_of_model(model: Branch) -> TemperatureCurve:
    """Return the model of a lever, in the medium it is to be calibrated in, as reference.

    Raises
    ------
    ComputationError
        If it has no knee.
    """
    return TemperatureCurve(model.tip_temperature, model.need_knee("the model").power_mW)


def calibrated_by_rule(
    whole: Measurement, origin: Probe, law: PowerLaw | None, route: str
) -> Estimate:
    """Calibrate a lever by the paper's rule: the temperatures of a reference at k times the power.

    Parameters
    ----------
    whole : Measurement
        As it was read.
    origin : Probe
        As it is given: resembles the lever.
    law : PowerLaw, optional
        The reference; the probe's model in vacuum by default.
    route : str
        See `hotlever.estimate.Estimate`.

    Raises
    ------
    InputError
        If the points neither show the knee nor tell its power to 30 %, it is far from that of the
        reference, or the power of the probe turns.
    ComputationError
        If the probe has no knee.
    """
    measured = averaged(whole, robust=True)
    # a power law holds for vacuum, whatever the lever is in
    anywhere = measured if law is None else replace(measured, medium=None)
    probe, notes = with_measured_circuit(origin, anywhere, "vacuum")
    probe.circuit.need_cold_start("a power law")
    try:
        result = _calibrated_by_knee(measured, probe, law, route)
    except InputError as error:
        raise InputError(f"{measured.path or 'measurement'}: {error}") from error
    return replace(result, notes=[*notes, *note_on_averages(whole, measured), *result.notes])


def _calibrated_by_knee(
    measured: Measurement, probe: Probe, law: PowerLaw | None, route: str
) -> Estimate:
    """Return the calibration of a lever like a probe in vacuum, in the circuit of its data."""
    lever = Lever(probe)
    vacuum, circuit = lever.branch(), probe.circuit
    if turns := power_turns(vacuum, "vacuum"):
        raise InputError(f"the paper's rule: {turns}; expected a lever of which it is")
    model, similar = curve_of_model(vacuum), _similar_branches(probe, vacuum)
    reference = model if law is None else curve_of_law(law, circuit.base_temperature_K)
    current = measured.current(circuit)
    curve = IVCurve.of(measured.bias_V, current, circuit)
    notes = []
    try:
        knee = find_knee(curve, vacuum)
    except KneeOutsideError as outside:
        knee = _estimated_knee(curve, vacuum, reference, similar, str(outside))
        notes.append(
            f"{outside}; until then the power of the knee is estimated from the points below it, "
            f"as {value_with_error(knee.power_mW, knee.power_mW_stderr)} mW"
        )
    knee_mW, like_mW = knee.power_mW, reference.knee_mW
    # large levers have 20 mW where small ones have 2, and a wrong unit is a thousand
    if not 1.0 / 100.0 < knee_mW / like_mW < 100.0:
        raise InputError(
            f"the knee is at {knee_mW:.3g} mW, that of the lever it is compared with at "
            f"{like_mW:.3g} mW, expected within a factor of 100; are bias and current in "
            "their units?"
        )
    rows = smooth_rows(curve, knee_mW, vacuum)
    power = rows.power_mW
    tip, of_model = reference.at(power, knee_mW), model.at(power, knee_mW)
    parts = {
        "k": np.abs(reference.at(power, knee_mW + knee.power_mW_stderr) - tip),
        "electronics": _error_of_meters(reference, knee_mW, rows),
        "other levers": _error_of_other_levers(similar, power / knee_mW),
    }
    if law is not None:
        parts["power law"] = np.abs(of_model - tip)
    like_air = 1.08  # a lever that needs so many times the power is probably in air
    if law is None or knee_mW > like_air * like_mW:
        in_air = curve_of_model(lever.in_medium("air").branch())
        parts["constant k"] = np.abs(in_air.at(power, knee_mW) - of_model)
    used, residual = (law, 0.0) if law is not None else law_of_model(vacuum, model.knee_mW)
    k = knee_mW / used.threshold_mW
    if k > like_air and measured.medium != "vacuum":
        better = "--medium air is" if law is None else "a probe with --medium air would be"
        notes.append(
            f"the lever needs {k:.2f} times the power of the model in vacuum: it seems to be "
            f"in air, where {better} more accurate"
        )
    if beyond := int(np.isnan(tip).sum()):
        notes.append(
            f"{beyond} rows of the table are hotter than the models go, and have no temperature"
        )
    own = reference.at(circuit.power(measured.bias_V, current), knee_mW)
    return Estimate(
        tabulated=table_by_bias(circuit, rows.bias_V, rows.current_mA, tip, {"budget_K": parts}),
        route=route,
        power_law=used,
        law_residual_K=residual,
        k=k,
        k_stderr=knee.power_mW_stderr / used.threshold_mW,
        knee=replace(knee, tip_K=float(reference.at(np.array(knee_mW), knee_mW))),
        measured_rms_K=rms(measured.tip_K - own),
        probe=probe,
        measurement=measured,
        notes=notes,
    )


def smooth_rows(
    curve: IVCurve, knee_mW: float, like: Branch | None = None, count: int = 101
) -> IVCurve:
    """Return points over the measured range, `count` even ones in bias and in power, smoothed.

    At the knee, where the bias hardly tells temperatures apart, the power does.

    The power of the knee may be measured or estimated; for `like` see `find_knee`.
    """
    smooth = SmoothCurves(curve, knee_mW, like)
    measured = smooth.points
    power = np.linspace(measured.power_mW[0], measured.power_mW[-1], 2000)
    fine = smooth.likeliest(power)
    bias = np.maximum.accumulate(fine.bias_V)
    low, high = max(measured.bias_V[0], bias[0]), min(measured.bias_V.max(), bias[-1])
    by_power = np.interp(np.linspace(power[0], power[-1], count), power, bias)
    rows = np.unique(np.concatenate([np.linspace(low, high, count), np.clip(by_power, low, high)]))
    return IVCurve(rows, np.interp(rows, bias, fine.current_mA), curve.circuit)


def _estimated_knee(
    curve: IVCurve, like: Branch, reference: TemperatureCurve, similar: list[Branch], text: str
) -> Knee:
    """Estimate the knee from how the resistance rises below it, with its error.

    Levers of other materials have other knees for the same rise.
    """
    power, _, stderr = scale_to(curve, like)
    model, *others = (branch.need_knee("the model").power_mW for branch in similar)
    spread = np.linalg.norm(np.array(others) / model - 1.0) / _STEP
    error = float(np.hypot(stderr, spread))
    if error > 0.3:
        raise InputError(
            f"{text}. The points below it give its power to ± {error:.0%} only, which is too "
            "little to calibrate with"
        )
    # the knee of a fitted measurement stands above or below the model's
    knee_mW = power * reference.knee_mW
    return Knee(power_mW=knee_mW, power_mW_stderr=error * knee_mW)


def _error_of_meters(reference: TemperatureCurve, knee_mW: float, rows: IVCurve) -> Array:
    """Return the standard error (K) at smooth rows by R_s and the scales of both meters.

    The knee moves as the highest lever voltage of the rows does.
    """
    changes = []
    for series, voltage, current in 1.0 + np.diag([RESISTANCE, METERS, METERS]):
        ohm = float(series * rows.circuit.series_resistance_ohm)
        misread = IVCurve(
            voltage * rows.bias_V,
            current * rows.current_mA,
            rows.circuit.with_(series_resistance_ohm=ohm),
        )
        moved_mW = knee_mW * misread.vertex.power_mW / rows.vertex.power_mW
        changes.append(reference.at(misread.power_mW, moved_mW))
    return np.linalg.norm(np.array(changes) - reference.at(rows.power_mW, knee_mW), axis=0)


# --- levers of other dimensions and materials ---------------------------------------------------


def _similar_branches(probe: Probe, like: Branch) -> list[Branch]:
    """Return a coarse model of a probe, and the same with each parameter moved within its prior."""
    priors = default_priors(probe)
    # the circuit is the measured one, whatever the lever
    names = tuple(name for name in priors if name != "series_resistance_ohm")
    past = float(like.bias(like.hottest_K, probe.circuit))
    reach = Reach(probe.circuit, min(past, 1e3))
    solved = SimilarLevers(Lever(probe, COARSE)).linearised(probe, reach, None, names)
    model = solved.branch
    changes = solved.output_slopes * np.array([_STEP * priors[name].absolute for name in names])
    slopes = spline_through(model.u, changes)(model.u, 1)
    perturbations = zip(np.moveaxis(changes, 2, 0), np.moveaxis(slopes, 2, 0), strict=True)
    return [model, *(model.shifted(*change) for change in perturbations)]


def _error_of_other_levers(similar: list[Branch], ratio: Array) -> Array:
    """Return the standard deviation (K) of the tip at powers over that of the knee, (n,)."""
    knees = [branch.need_knee("the model").power_mW for branch in similar]
    ends = [branch.by_power.highest_mW for branch in similar]
    # where one of them has melted they differ as they do before
    power = np.outer(knees, np.minimum(ratio, np.min(np.divide(ends, knees))))
    tip, *perturbed_tips = (
        branch.tip_temperature(row) for branch, row in zip(similar, power, strict=True)
    )
    return np.linalg.norm(np.array(perturbed_tips) - tip, axis=0) / _STEP
