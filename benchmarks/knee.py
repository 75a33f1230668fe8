"""Finding the knee of noisy I-V curves: bias, scatter and honesty of five ways.

200 measurements (40 unevenly spaced points from 1 to 11 V, 0.2 % noise) of each of five levers.
Then, for the reference lever, why its knee is not at the inversion temperature.

Run: python benchmarks/knee.py [TRIALS]
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from scipy.interpolate import make_smoothing_spline

from hotlever.calibration.knee import IVCurve, find_knee
from hotlever.lever import Branch, Lever
from hotlever.materials import published
from hotlever.probe import Probe
from hotlever.studies.knee import reasons_of_the_knee, steps_to_the_knee
from problems import processor_time
from synthetic_curves import measured_curve

#: Power of the knee (mW) and its standard error; NaN where a way states none.
Found = tuple[float, float]
NONE = float("nan")


def highest_point(curve: IVCurve) -> Found:
    return float(curve.power_mW[np.argmax(curve.lever_V)]), NONE


def local_polynomial(degree: int, within: float) -> Callable[[IVCurve], Found]:
    """Weighted polynomial of V_l(P_l) over the points within a factor of the highest one."""

    def find(curve: IVCurve) -> Found:
        power, lever = curve.power_mW, curve.lever_V
        centre = float(power[np.argmax(lever)])
        here = np.abs(np.log(power / centre)) < np.log(within)
        x, y = power[here] / centre - 1.0, lever[here]
        if x.size < degree + 2:
            return NONE, NONE
        columns = np.vander(x, degree + 1, increasing=True)
        coefficients = np.linalg.lstsq(columns, y, rcond=None)[0]
        variance = np.sum((y - columns @ coefficients) ** 2) / (x.size - degree - 1)
        covariance = variance * np.linalg.inv(columns.T @ columns)
        curve_fit = np.polynomial.Polynomial(coefficients)
        roots = curve_fit.deriv().roots()
        roots = roots[np.isreal(roots)].real
        roots = roots[curve_fit.deriv(2)(roots) < 0]
        if not roots.size:
            return NONE, NONE
        root = float(roots[np.argmin(np.abs(roots))])
        slopes = np.arange(degree + 1) * root ** np.maximum(np.arange(degree + 1) - 1, 0)
        error = np.sqrt(slopes @ covariance @ slopes) / abs(curve_fit.deriv(2)(root))
        return centre * (1.0 + root), float(centre * error)

    return find


def smoothing_spline(curve: IVCurve) -> Found:
    """Cubic smoothing spline of V_l(P_l), smoothness by generalised cross-validation."""
    spline = make_smoothing_spline(curve.power_mW, curve.lever_V)
    centre = float(curve.power_mW[np.argmax(curve.lever_V)])
    grid = np.linspace(centre / 1.3, min(centre * 1.3, curve.power_mW[-1]), 3001)
    return float(grid[np.argmax(spline(grid))]), NONE


def ours(like: Branch | None) -> Callable[[IVCurve], Found]:
    def find(curve: IVCurve) -> Found:
        knee = find_knee(curve, like)
        return knee.power_mW, knee.power_mW_stderr

    return find


def levers() -> dict[str, Lever]:
    reference = Lever(Probe.reference())
    material = reference.probe.material
    return {
        "reference": reference,
        "lever 3": reference.with_material(published("lever 3").material),
        "lever 4": reference.with_material(published("lever 4").material),
        "lightly doped": reference.with_material(material.with_(n_d=2e17, delta=0.45)),
        "wide and thin": Lever(reference.probe.with_(heater_width_um=1.9, thickness_um=0.35)),
    }


def main(trials: int) -> None:
    branches = {name: lever.branch() for name, lever in levers().items()}
    print(
        f"{'lever':<14}{'way':<28}{'found':>6}{'bias %':>8}{'rms %':>7}{'95 % %':>7}"
        f"{'68 %':>6}{'95 %':>6}{'ms':>6}"
    )
    for name, lever in branches.items():
        other = branches["lever 3" if name == "reference" else "reference"]
        ways = {
            "highest point": highest_point,
            "local cubic": local_polynomial(3, 1.22),
            "local quintic": local_polynomial(5, 1.6),
            "smoothing spline": smoothing_spline,
            "find_knee": ours(None),
            "find_knee, like another lever": ours(other),
        }
        curves = [measured_curve(lever, np.random.default_rng(seed)) for seed in range(trials)]
        true = lever.knee.power_mW if lever.knee else NONE
        for way, find in ways.items():
            began = processor_time()
            knees = np.array([find(curve) for curve in curves])
            milliseconds = (processor_time() - began) / trials * 1000
            error = 100 * (knees[:, 0] / true - 1)
            pull = np.abs(knees[:, 0] - true) / knees[:, 1]
            here = np.isfinite(error)
            honest = [f"{np.mean(pull[here] < width):.0%}" for width in (1.0, 1.96)]
            if np.isnan(knees[:, 1]).all():
                honest = ["", ""]
            print(
                f"{name:<14}{way:<28.28}{here.sum():>6}{error[here].mean():>8.2f}"
                f"{np.sqrt(np.mean(error[here] ** 2)):>7.2f}"
                f"{np.quantile(np.abs(error[here]), 0.95):>7.2f}"
                f"{honest[0]:>6}{honest[1]:>6}{milliseconds:>6.0f}"
            )
    print_reasons()


def print_reasons() -> None:
    reasons = reasons_of_the_knee(Lever(Probe.reference()))
    print("\nreference lever, tip temperature (K) where V_l and R_l are highest")
    for name in reasons.lever.values:
        lever = reasons.sel(lever=name)
        print(f"  {name:<22}{lever.knee_K.item():>8.1f}{lever.resistance_K.item():>8.1f}")
    print(f"from the inversion temperature of {reasons.attrs['inversion_K']:.1f} K to the knee:")
    for reason, kelvins in steps_to_the_knee(reasons):
        print(f"  {kelvins:>+6.1f} K  {reason}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
