"""Eq. 12 refitted to the reference probe in vacuum, beside the published coefficients.

Run: python benchmarks/power_law.py
"""

from __future__ import annotations

import numpy as np

from hotlever.calibration.power_law import EQ12, PowerLawFit, fit_power_law
from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.spieser2017 import RAMP
from hotlever.text import value_with_error

SPLIT = 3.3


def main() -> None:
    lever = Lever(Probe.reference())
    model = lever.branch()
    sweep = lever.sweep(RAMP)
    even = np.linspace(0.05, 4.0, 80)
    knee = model.knee.power_mW if model.knee else float("nan")
    ramp = (sweep.power_mW.values, sweep.tip_K.values)
    dense = (even, model.tip_temperature(even))
    fits: dict[str, PowerLawFit] = {
        "the paper's 25 biases": fit_power_law(*ramp),
        "the same, continuous": fit_power_law(*ramp, continuous=True),
        "even powers to 4 mW": fit_power_law(*dense),
        "the same, threshold at the knee": fit_power_law(*dense, threshold_mW=knee),
    }
    names = list(EQ12.values())[:-1]
    heads = ("a K/mW", "b K", "m", "c K/mW", "P_th mW", "jump K", "rms K")
    print(f"{'':<34}" + "".join(f"{head:>11}" for head in heads)
          + f"{f'<= {SPLIT} mW':>11}{f'> {SPLIT} mW':>11}")  # fmt: skip
    published = "".join(f"{getattr(EQ12, name):>11g}" for name in names)
    away = dense[1] - EQ12.tip_temperature(even)
    print(
        f"{'published (residual: our model)':<34}{published}{EQ12.jump_K:>11.1f}"
        f"{np.sqrt(np.mean(away**2)):>11.1f}{np.abs(away[even <= SPLIT]).max():>11.1f}"
        f"{np.abs(away[even > SPLIT]).max():>11.1f}"
    )
    for label, fit in fits.items():
        cells = "".join(
            f"{value_with_error(getattr(fit.law, name), fit.stderr[name]):>11}" for name in names
        )
        print(
            f"{label:<34}{cells}{fit.law.jump_K:>11.1f}{fit.rms_K:>11.1f}"
            f"{fit.largest_residual_K(to_mW=SPLIT):>11.1f}"
            f"{fit.largest_residual_K(from_mW=SPLIT):>11.1f}"
        )
    print(f"power of the knee: {knee:.3f} mW; published law made continuous: threshold at "
          f"{EQ12.meeting().threshold_mW:.3f} mW")  # fmt: skip
    for tip in (500.0, 800.0, 1100.0):
        law = fits["the same, continuous"].law
        power = float(law.power(tip))
        bias = float(model.bias(model.tip_temperature(power), lever.circuit))
        print(f"for {tip:.0f} K: {power:.3f} mW by the continuous law, bias {bias:.3f} V with "
              f"5.6 kOhm; by the model {float(model.bias(tip, lever.circuit)):.3f} V")  # fmt: skip


if __name__ == "__main__":
    main()
