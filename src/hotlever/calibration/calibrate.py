"""Calibrating one lever from its I-V curve, with an error budget."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever.calibration.budget import (
    Tolerances,
    Variation,
    combined,
    fit_variations,
    geometry_variations,
    material_variations,
    refitted,
    spread,
)
from hotlever.calibration.calibration import TABLE_COLUMNS, Calibration
from hotlever.calibration.characteristic import Characteristic, characteristic
from hotlever.calibration.knee import (
    IVCurve,
    Knee,
    KneeOutsideError,
    find_knee,
    scale_to,
    smooth_rows,
)
from hotlever.calibration.power_law import PowerLaw
from hotlever.calibration.power_law_fit import fit_power_law
from hotlever.calibration.transfer import TemperatureCurve, curve_of_law, curve_of_model
from hotlever.errors import ComputationError, InputError
from hotlever.fitting.fit import with_measured_circuit
from hotlever.fitting.fit_file import FitFile
from hotlever.fitting.measurement import Measurement
from hotlever.lever.lever import Lever
from hotlever.probe import MeshOptions, Probe

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

#: Mesh and steps (K) for differences between levers: 0.3 K, see `benchmarks/calibration_routes.py`.
_COARSE_MESH, _COARSE_STEP = MeshOptions(refinement=0.4), 60.0
#: A vacuum model that needs this factor is told that its lever is probably in air.
_LOOKS_LIKE_AIR = 1.08
#: Largest relative error of a knee estimated from the points below it, to go on with.
_WORST_ESTIMATE = 0.3
#: Powers (over the knee's) at which the power law is fitted to a model: even, up to here.
_LAW_TO, _LAW_POINTS = 1.4, 160


def calibrate(
    measurement: Measurement,
    *,
    probe: Probe | None = None,
    fit: FitFile | None = None,
    law: PowerLaw | None = None,
    medium: str | None = None,
    tolerances: Tolerances | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Find the tip temperature of a lever from its I-V curve.

    Parameters
    ----------
    measurement : Measurement
        With bias and current; its own tip temperatures, if it has any, are only compared with.
    probe : Probe, optional
        A probe like the measured one; the reference probe by default.
    fit : FitFile, optional
        A fit of the measured lever itself, in vacuum or in air. Not together with `probe`.
    law : PowerLaw, optional
        A power law in vacuum, in place of a model.
    medium : {"vacuum", "air"}, optional
        Of the model whose temperatures are used; by default what the data file says, or else
        the fit or the probe. With vacuum the paper's rule is used in any medium: the same
        temperatures at k times the power.
    tolerances : Tolerances, optional
    progress : callable, optional
        Called with solved levers and their number.

    Raises
    ------
    InputError
        If the measurement cannot tell: no knee in its range and too cold for an estimate.
    ComputationError
        If a model cannot be solved, or has no knee.
    """
    return _Calibrator(
        measurement, probe, fit, law, medium, tolerances or Tolerances(), progress
    ).run()


class _Calibrator:
    """One calibration on its way."""

    def __init__(
        self,
        measurement: Measurement,
        probe: Probe | None,
        fit: FitFile | None,
        law: PowerLaw | None,
        medium: str | None,
        tolerances: Tolerances,
        progress: Progress | None,
    ) -> None:
        if (probe is not None) + (fit is not None) + (law is not None) > 1:
            raise InputError("a fit, a probe and a power law exclude each other")
        self._measurement, self._fit, self._law = measurement, fit, law
        self._tolerances, self._progress = tolerances, progress
        origin = fit.probe if fit is not None else probe or Probe.reference()
        if law is not None and medium not in (None, "vacuum"):
            raise InputError("a power law holds in vacuum; with one, leave the medium out")
        if law is not None:  # whatever the lever is in
            measurement = replace(measurement, medium=None)
            medium = "vacuum"
        self._probe, self._notes = with_measured_circuit(origin, measurement, medium)
        self._medium: str = self._probe.surroundings.medium
        self._models: dict[str, Characteristic] = {}
        self._done, self._total = 0, 4

    def run(self) -> Calibration:
        circuit = self._probe.circuit
        curve = IVCurve.of(
            self._measurement.bias_V, self._measurement.current_mA, circuit.series_resistance_ohm
        )
        model = self._model(self._medium)
        measured_knee = self._knee_of_fit()
        reference = self._reference(measured_knee)
        knee, power, error = self._knee(curve, model, reference)
        bias, current = smooth_rows(curve, power, model)
        lever = bias - circuit.series_resistance_ohm / 1000.0 * current
        rows = lever * current
        tip = reference.at(rows, power)
        parts = self._knee_and_meters(curve, model, reference, (power, error), (bias, current))
        parts |= self._levers(rows, power, measured_knee)
        if self._law is not None:
            parts["power law"] = np.abs(
                curve_of_model(self._models, "vacuum").at(rows, power) - tip
            )
        if self._fit is not None and "tip" in self._fit.observables:
            parts["Raman"] = self._thermometer(tip)
        if self._medium == "vacuum" and power > _LOOKS_LIKE_AIR * reference.knee_mW:
            parts["constant k"] = self._constant_k(rows, power, tip)
        total = combined(parts)
        law, residual = self._power_law(measured_knee)
        self._state(tip, power / law.threshold_mW)
        columns = dict(zip(TABLE_COLUMNS, (bias, lever, current, rows, tip, total), strict=True))
        return Calibration(
            route=self._route,
            medium=self._medium,
            power_law=law,
            law_residual_K=residual,
            k=power / law.threshold_mW,
            k_stderr=error / law.threshold_mW,
            knee=knee,
            knee_mW=power,
            knee_stderr_mW=error,
            knee_tip_K=float(reference.at(np.array(power), power)),
            table=xr.Dataset(
                {
                    name: ("bias", columns[name], {"units": unit, "long_name": text})
                    for name, (unit, text) in TABLE_COLUMNS.items()
                }
            ),
            budget=parts,
            measured_rms_K=self._rms(curve, reference, power),
            base_temperature_K=circuit.base_temperature_K,
            probe=self._probe,
            measurement=self._measurement,
            notes=self._notes,
        )

    @property
    def _route(self) -> str:
        if self._law is not None:
            return "power law"
        return "probe" if self._fit is None else f"fit in {self._fit.medium}"

    # --- models -------------------------------------------------------------------------------

    def _model(self, medium: str) -> Characteristic:
        if medium not in self._models:
            self._models[medium] = _with_knee(characteristic(Lever(self._probe.in_medium(medium))))
            self._step()
        return self._models[medium]

    def _coarse_models(self, probe: Probe) -> dict[str, Characteristic]:
        """Solve a probe, in the media that matter, as accurately as differences need."""
        media = {self._medium}
        if self._fit is not None:
            media.add(self._fit.medium)
        return {
            medium: _with_knee(
                characteristic(Lever(probe.in_medium(medium), _COARSE_MESH), step_K=_COARSE_STEP)
            )
            for medium in media
        }

    def _reference(self, measured_knee: tuple[str, float] | None) -> TemperatureCurve:
        if self._law is not None:
            return curve_of_law(self._law, self._probe.circuit.base_temperature_K)
        if measured_knee is not None:
            self._model(measured_knee[0])
        return curve_of_model(self._models, self._medium, measured_knee)

    def _knee_of_fit(self) -> tuple[str, float] | None:
        """Find the knee in the data of the fit, if they are there and reach it."""
        if self._fit is None:
            return None
        data = self._fit.measurement()
        if data is None:
            self._notes.append(
                "the fitted measurement is not at hand, so the model's own knee sets the scale"
            )
            return None
        try:
            curve = IVCurve.of(
                data.bias_V, data.current_mA, self._fit.probe.circuit.series_resistance_ohm
            )
            return self._fit.medium, find_knee(curve, self._model(self._fit.medium)).power_mW
        except InputError:
            self._notes.append(
                "the fitted measurement does not show its knee, so the model's sets the scale"
            )
            return None

    def _power_law(self, measured_knee: tuple[str, float] | None) -> tuple[PowerLaw, float]:
        """Fit Eq. 12 to the model in vacuum, with its threshold at the knee."""
        if self._law is not None:
            return self._law, 0.0
        model = self._model("vacuum")
        threshold = curve_of_model(self._models, "vacuum", measured_knee).knee_mW
        power = np.linspace(0.0, _LAW_TO, _LAW_POINTS + 1)[1:] * threshold
        found = fit_power_law(
            power,
            model.tip_temperature(power),
            base_temperature_K=model.base_temperature_K,
            threshold_mW=threshold,
        )
        return found.law, found.largest_residual_K()

    # --- the knee -----------------------------------------------------------------------------

    def _knee(
        self, curve: IVCurve, model: Characteristic, reference: TemperatureCurve
    ) -> tuple[Knee | None, float, float]:
        try:
            knee = find_knee(curve, model)
        except KneeOutsideError as outside:
            power, error = self._estimated_knee(curve, model, reference, str(outside))
            self._notes.append(
                f"{outside}; until then the power of the knee is estimated from the points below "
                f"it, as {power:.2f} ± {error:.2f} mW"
            )
            return None, power, error
        return knee, knee.power_mW, knee.power_mW_stderr

    def _estimated_knee(
        self, curve: IVCurve, model: Characteristic, reference: TemperatureCurve, text: str
    ) -> tuple[float, float]:
        """Estimate the knee from how the resistance rises below it, with its error."""
        assert model.knee is not None
        scale = scale_to(curve, model)
        squares = scale.power_stderr**2
        nominal = scale.power * model.knee.power_mW
        if self._fit is None:
            # levers of other materials have other knees for the same rise
            for variation in material_variations(self._probe, self._tolerances.material):
                other = self._coarse_models(variation.probe)[self._medium]
                assert other.knee is not None
                estimate = scale_to(curve, other).power * other.knee.power_mW
                squares += variation.share * (estimate / nominal - 1.0) ** 2
        # the knee of a fitted measurement stands above or below the model's
        power = nominal * reference.knee_mW / model.knee.power_mW
        error = power * float(np.sqrt(squares))
        if error > _WORST_ESTIMATE * power:
            raise InputError(
                f"{self._measurement.path or 'measurement'}: {text}. The points below it give its "
                f"power to ± {error / power:.0%} only, which is too little to calibrate with"
            )
        return power, error

    # --- sources of error ---------------------------------------------------------------------

    def _knee_and_meters(
        self,
        curve: IVCurve,
        model: Characteristic,
        reference: TemperatureCurve,
        knee: tuple[float, float],
        rows: tuple[Array, Array],
    ) -> dict[str, Array]:
        """Return the effects of the knee's scatter, of R_s and of the meters."""
        power, error = knee
        bias, current = rows

        def temperature(series: float, voltage: float, amperes: float, knee_mW: float) -> Array:
            lever = voltage * bias - series * amperes * current * curve.series_resistance_ohm / 1e3
            return reference.at(lever * amperes * current, knee_mW)

        nominal = temperature(1.0, 1.0, 1.0, power)
        parts = {"k": temperature(1.0, 1.0, 1.0, power * (1.0 + error / power)) - nominal}
        meters = []
        for place, share in enumerate(
            (self._tolerances.series_resistance, self._tolerances.voltage, self._tolerances.current)
        ):
            factors = [1.0, 1.0, 1.0]
            factors[place] += share
            series, voltage, amperes = factors
            changed = replace(
                curve,
                bias_V=voltage * curve.bias_V,
                current_mA=amperes * curve.current_mA,
                series_resistance_ohm=series * curve.series_resistance_ohm,
            )
            try:
                moved = find_knee(changed, model).power_mW
            except InputError:
                # estimated or hardly determined: the knee moves as the points do
                moved = power * float(np.median(changed.power_mW / curve.power_mW))
            meters.append(temperature(series, voltage, amperes, moved) - nominal)
        parts["electronics"] = np.sqrt(np.sum(np.square(meters), axis=0))
        return {name: np.abs(part) for name, part in parts.items()}

    def _levers(
        self, rows: Array, knee_mW: float, measured_knee: tuple[str, float] | None
    ) -> dict[str, Array]:
        """Return the effects of geometry and of material or fit."""
        data = None if self._fit is None else self._fit.measurement()
        variations: list[Variation] = []
        for variation in geometry_variations(self._probe, self._tolerances.geometry):
            if self._fit is not None and data is not None:
                fit = replace(self._fit, probe=self._probe.in_medium(self._fit.medium))
                probe = refitted(fit, data, variation.probe, _COARSE_MESH)
                variation = replace(variation, probe=probe)
            variations.append(variation)
            self._step()
        variations += (
            fit_variations(replace(self._fit, probe=self._probe))
            if self._fit is not None
            else material_variations(self._probe, self._tolerances.material)
        )
        self._total = self._done + len(variations) + 2

        def temperature(probe: Probe) -> Array:
            curve = curve_of_model(self._coarse_models(probe), self._medium, measured_knee)
            return curve.at(rows, knee_mW)

        return spread(variations, temperature(self._probe), temperature, self._step)

    def _thermometer(self, tip: Array) -> Array:
        """Return the stated error of the temperatures that the fit was made with.

        The whole of it, as if it were common to all points, which a calibration error is.
        """
        data = self._fit.measurement() if self._fit is not None else None
        if data is None:
            self._notes.append("the error of the fitted temperatures is not at hand")
            return np.zeros_like(tip)
        known = np.isfinite(data.tip_K) & np.isfinite(data.tip_error_K)
        if not known.any():
            self._notes.append("the fitted measurement states no errors of its temperatures")
            return np.zeros_like(tip)
        order = np.argsort(data.tip_K[known])
        error: Array = np.interp(tip, data.tip_K[known][order], data.tip_error_K[known][order])
        return error

    def _constant_k(self, rows: Array, knee_mW: float, tip: Array) -> Array:
        """Return how far the rule of a constant k is from the model in air, for this probe."""
        air = curve_of_model({"air": self._model("air")}, "air")
        return np.abs(air.at(rows, knee_mW) - tip)

    # --- words --------------------------------------------------------------------------------

    def _state(self, tip: Array, k: float) -> None:
        """Add what the user should know."""
        if self._medium == "vacuum" and k > _LOOKS_LIKE_AIR:
            self._notes.append(
                f"the lever needs {k:.2f} times the power of the model in vacuum: it seems to be "
                "in air, where --medium air is more accurate"
            )
        if self._medium == "air" and k < _LOOKS_LIKE_AIR:
            self._notes.append(
                f"the lever needs only {k:.2f} times the power of the model in vacuum: it seems to "
                "be in vacuum, not in air"
            )
        beyond = int(np.isnan(tip).sum())
        if beyond:
            self._notes.append(
                f"{beyond} rows of the table are hotter than the models go, and have no temperature"
            )

    def _rms(self, curve: IVCurve, reference: TemperatureCurve, knee_mW: float) -> float:
        """Compare with the measurement's own temperatures."""
        measured = self._measurement
        series = curve.series_resistance_ohm / 1000.0
        power = (measured.bias_V - series * measured.current_mA) * measured.current_mA
        difference = measured.tip_K - reference.at(power, knee_mW)
        here = np.isfinite(difference)
        return float(np.sqrt(np.mean(difference[here] ** 2))) if here.any() else float("nan")

    def _step(self) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, max(self._total, self._done))


def _with_knee(model: Characteristic) -> Characteristic:
    if model.knee is None:
        raise ComputationError(
            f"the model has no knee below {model.hottest_K:.0f} K; calibrate a lever whose model "
            "has one"
        )
    return model
