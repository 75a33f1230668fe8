"""Ways to the tip temperature of a lever from its I-V curve, compared on twin levers.

Each twin has the reference shape with every dimension off by 3 % (standard deviation) and a
material that scatters as the four published levers do. It is measured in vacuum and in air: 40
points with 0.2 % noise of the current; the fits also have V_r (0.2 %) and T_tip with the paper's
Raman error. Errors are differences from the twin's true tip temperature at the same power, from
320 K to 1200 K, the knee being found in the noisy curve.

Run: python benchmarks/calibration_routes.py [LEVERS] [OF THEM FITTED IN AIR]
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hotlever.calibration.knee import IVCurve, find_knee
from hotlever.calibration.knee_scaling import (
    TemperatureCurve,
    curve_of_law,
    curve_of_model,
    knee_of,
)
from hotlever.calibration.power_law import EQ12
from hotlever.errors import HotleverError
from hotlever.estimation import Measurement, fit
from hotlever.lever import Branch, Lever
from hotlever.materials import Material, published
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import Circuit, MeshOptions, Probe
from hotlever.spieser2017 import BASE_TEMPERATURE_K as BASE
from hotlever.spieser2017 import SCATTER_OF
from synthetic_curves import current_at, measured_curve

Array = NDArray[np.float64]
Temperatures = Callable[[Array], Array]

MEDIA = ("vacuum", "air")
DIMENSIONS = 0.03
HIGHEST_BIAS = {"vacuum": 11.0, "air": 13.0}
MESH = MeshOptions(refinement=0.7)
CIRCUIT = Circuit()


def twin(rng: np.random.Generator) -> Probe:
    """Return a probe like the reference, with scatter in dimensions and material."""
    reference = Probe.reference()
    shape = {
        name: getattr(reference.shape, name) * float(np.exp(DIMENSIONS * rng.standard_normal()))
        for name in reference.shape.description()
        if getattr(reference.shape, name) is not None
    }
    names = [name for name in Material.model_fields if name != "n_hd"]
    logarithms = np.log(
        [[getattr(published(lever).material, name) for name in names] for lever in SCATTER_OF]
    )
    # normal deviates with the covariance of the four levers
    deviations = (logarithms - logarithms.mean(axis=0)).T @ rng.standard_normal(len(logarithms))
    deviations /= np.sqrt(len(logarithms) - 1)
    material = {
        name: getattr(reference.material, name) * float(np.exp(change))
        for name, change in zip(names, deviations, strict=True)
    }
    return reference.with_(**shape | material)


def models_of(probe: Probe) -> dict[str, Branch]:
    lever = Lever(probe.in_medium("vacuum"), MESH)
    return {medium: lever.in_medium(medium).branch() for medium in MEDIA}


def full_measurement(
    probe: Probe, branch: Branch, medium: str, rng: np.random.Generator
) -> Measurement:
    """Measure current, reader voltage and tip temperature at 25 biases."""
    bias = np.linspace(1.0, HIGHEST_BIAS[medium], 25)
    bias = bias[np.isfinite(current_at(branch, bias, CIRCUIT))]
    sweep = Lever(probe.in_medium(medium), MESH).sweep(bias)
    error = 5.0 + 0.02 * (sweep.tip_K.values - BASE)  # the paper's calibration error
    tip = sweep.tip_K.values + 0.5 * error * rng.standard_normal(bias.size)
    return Measurement(
        bias,
        sweep.current_mA.values * (1 + 0.002 * rng.standard_normal(bias.size)),
        sweep.reader_V.values * (1 + 0.002 * rng.standard_normal(bias.size)),
        np.where(tip > 300.0, tip, np.nan),
        error,
    )


def fitted(measurement: Measurement, medium: str) -> tuple[dict[str, Branch], float]:
    """Fit the reference shape; return the fitted models and the power of the measured knee."""
    models = models_of(fit(measurement, Probe.reference(), medium=medium).probe)
    curve = IVCurve.of(measurement.bias_V, measurement.current_mA, CIRCUIT)
    return models, find_knee(curve, models[medium]).power_mW


def bare_rule(knee_mW: float, material: Material) -> Temperatures:
    """The knee is at the inversion temperature, and the rise is proportional to the power."""
    rise = float(inversion_temperature(material.n_d, material.p)) - BASE
    return lambda power: BASE + rise * power / knee_mW


def routes(
    curve: IVCurve,
    medium: str,
    own: dict[str, Branch],
    reference: dict[str, Branch],
    probe: Probe,
    fits: dict[str, tuple[dict[str, Branch], float]],
) -> dict[str, Temperatures]:
    knee = find_knee(curve, reference[medium]).power_mW
    nominal = Probe.reference().material
    temperatures: dict[str, Temperatures] = {
        "bare rule, nominal doping": bare_rule(knee, nominal),
        "bare rule, doping known": bare_rule(knee, probe.material),
        "Eq. 12 times k": lambda power: curve_of_law(EQ12, BASE).at(power, knee),
        "reference probe, vacuum times k": lambda power: curve_of_model(reference["vacuum"]).at(
            power, knee
        ),
        "probe known, vacuum times k": lambda power: curve_of_model(own["vacuum"]).at(power, knee),
    }
    if medium == "air":
        temperatures["reference probe, air model"] = lambda power: curve_of_model(
            reference["air"]
        ).at(power, knee)
        temperatures["probe known, air model"] = lambda power: curve_of_model(own["air"]).at(
            power, knee
        )
    for fit_medium, (models, fit_knee) in fits.items():
        if fit_medium == "air" and medium == "vacuum":
            continue
        # the fitted lever's knee is above or below its model's by as much in either medium
        # the knee that was measured takes the place of the model's, which is less sure of it
        above = fit_knee / knee_of(models[fit_medium]).power_mW
        fitted = models[medium]
        fitted_curve = TemperatureCurve(fitted.tip_temperature, above * knee_of(fitted).power_mW)
        temperatures[f"fit in {fit_medium}"] = lambda power, of=fitted_curve: of.at(power, knee)
    return temperatures


def main(count: int, fitted_in_air: int) -> None:
    reference = models_of(Probe.reference())
    errors: dict[tuple[str, str], list[Array]] = {}
    scales = []
    for number in range(count):
        rng = np.random.default_rng(number)
        probe = twin(rng)
        try:
            own = models_of(probe)
            fits = {
                medium: fitted(full_measurement(probe, own[medium], medium, rng), medium)
                for medium in (MEDIA if number < fitted_in_air else MEDIA[:1])
            }
            for medium in MEDIA:
                curve = measured_curve(own[medium], rng, to_V=HIGHEST_BIAS[medium])
                tip = np.linspace(320.0, min(1200.0, own[medium].hottest_K), 300)
                power = own[medium].power(tip)
                for name, route in routes(curve, medium, own, reference, probe, fits).items():
                    errors.setdefault((medium, name), []).append(route(power) - tip)
            scales.append(
                own["air"].power(np.array([400.0, 600.0, 800.0, 1000.0, 1200.0]))
                / own["vacuum"].power(np.array([400.0, 600.0, 800.0, 1000.0, 1200.0]))
            )
        except HotleverError as error:
            print(f"lever {number} left out: {error}", file=sys.stderr)
        print(f"lever {number + 1} of {count}", file=sys.stderr)
    print(
        f"{'in':<8}{'route':<34}{'levers':>7}{'rms K':>7}"
        f"{'median of largest K':>21}{'largest K':>11}"
    )
    for (medium, name), of_levers in sorted(
        errors.items(), key=lambda entry: -MEDIA.index(entry[0][0])
    ):
        largest = [float(np.nanmax(np.abs(error))) for error in of_levers]
        rms = np.sqrt(np.nanmean(np.concatenate(of_levers) ** 2))
        print(
            f"{medium:<8}{name:<34}{len(of_levers):>7}{rms:>7.1f}{np.median(largest):>21.1f}"
            f"{max(largest):>11.1f}"
        )
    ratio = np.mean(scales, axis=0)
    print(
        "power in air over that in vacuum at 400, 600, 800, 1000, 1200 K: "
        + ", ".join(f"{value:.3f}" for value in ratio)
    )


if __name__ == "__main__":
    arguments = [int(argument) for argument in sys.argv[1:3]]
    main(*(arguments + [6, 2][len(arguments) :]))
