"""A calibration in words."""

from __future__ import annotations

import numpy as np

from hotlever.calibration.calibration import Calibration
from hotlever.calibration.pulses import PulseCalibration
from hotlever.estimation.words import NEAREST, prior_lines
from hotlever.text import aligned, significant, value_with_error

#: Tip temperatures (K) at which the error budget is printed.
_SHOWN, _FEW = (400.0, 600.0, 800.0, 900.0, 1000.0, 1100.0, 1200.0), 4
#: What each route rests on, in words.
_BASIS = {
    "power law": "a given power law",
    "probe": "a probe like this lever, brought up to date by these data",
    "fit in vacuum": "a fit of this lever in vacuum, and these data",
    "fit in air": "a fit of this lever in air, and these data",
}
#: Errors (K) up to which a calibration is called good, and fair.
_GOOD, _FAIR = 15.0, 40.0


def calibration_text(calibration: Calibration) -> str:
    """Return the result of a calibration as lines of text."""
    basis = f"based on {_BASIS[calibration.route]}, used in {calibration.medium}"
    if calibration.describes_data:
        stated = calibration.tip_temperature_uncertainty_K
        lines = [
            basis,
            *_knee_lines(calibration),
            _law_line(calibration),
            "",
            *_budget_lines(calibration),
            "",
            *([] if calibration.pulse is None else [*_pulse_lines(calibration.pulse), ""]),
            *prior_lines(calibration.priors),
            f"sure to ± {significant(stated)} K (standard error, largest in the table): "
            f"{_verdict(calibration)}",
        ]
    else:
        lines = [
            calibration.doubt,
            f"{NEAREST}; it is {basis}",
            *_nearest_knee(calibration),
            *prior_lines(calibration.priors),
        ]
    if np.isfinite(calibration.measured_rms_K):
        lines.append(
            f"the measured tip temperatures differ by {calibration.measured_rms_K:.1f} K (rms)"
        )
    return "\n".join(lines)


def _law_line(calibration: Calibration) -> str:
    law = calibration.power_law
    if law is None and not calibration.probe.circuit.starts_cold:
        return "no power law: with held supplies the tip does not follow from the power of one"
    if law is None:
        return (
            "no power law: the power falls while the tip gets hotter; the bias tells how hot it is"
        )
    text = (
        f"power law in vacuum: a {law.linear_K_per_mW:.1f} K/mW, b {law.nonlinear_K:.2f} K, "
        f"m {law.exponent:.3f}, c {law.hot_K_per_mW:.1f} K/mW; jump {law.jump_K:+.0f} K"
    )
    if calibration.law_residual_K:
        text += f", within {calibration.law_residual_K:.0f} K of the model"
    return text


def _knee_lines(calibration: Calibration) -> list[str]:
    knee, law = calibration.knee, calibration.power_law
    if np.isnan(knee.power_mW):
        return ["no knee as far as the lever can be heated"]
    factor = []
    if law is not None:
        times = value_with_error(calibration.k, calibration.k_stderr)
        at_knee = f"the power of the knee in vacuum, {law.threshold_mW:.3f} mW"
        factor = [f"k = {times} times {at_knee}"]
    if knee.measured and not calibration.knee_measured:
        return [
            f"knee, beyond the measured range: about {knee.lever_V:.2f} V, {knee.current_mA:.2f} "
            f"mA, {knee.power_mW:.2f} mW at a bias of {knee.bias_V:.1f} V, tip "
            f"{calibration.knee_tip_K:.0f} K",
            *factor,
        ]
    if not knee.measured:
        power = value_with_error(knee.power_mW, knee.power_mW_stderr)
        return [f"knee (estimated): {power} mW, tip {calibration.knee_tip_K:.0f} K", *factor]
    return [
        f"knee: {value_with_error(knee.lever_V, knee.lever_V_stderr)} V, "
        f"{value_with_error(knee.current_mA, knee.current_mA_stderr)} mA, "
        f"{value_with_error(knee.power_mW, knee.power_mW_stderr)} mW at a bias of "
        f"{value_with_error(knee.bias_V, knee.bias_V_stderr)} V, "
        f"tip {calibration.knee_tip_K:.0f} K",
        *factor,
    ]


def _nearest_knee(calibration: Calibration) -> list[str]:
    """Return the knee of a lever that does not show the data, without errors."""
    knee = calibration.knee
    if np.isnan(knee.power_mW):
        return []
    return [
        f"its knee: {knee.lever_V:.3g} V, {knee.current_mA:.3g} mA, {knee.power_mW:.3g} mW at a "
        f"bias of {knee.bias_V:.3g} V, tip {calibration.knee_tip_K:.0f} K"
    ]


def _budget_lines(calibration: Calibration) -> list[str]:
    """Return the standard error by source at some temperatures, and the power there.

    Without a power law the bias tells more.
    """
    table, by_power = calibration.heating, calibration.power_law is not None
    sources, tip = table.source.values.tolist(), table.tip_K.values
    along, head = (table.power_mW, "P_l (mW)") if by_power else (table.bias_V, "V_b (V)")
    rows = [[head.rjust(7) for head in ("T_tip (K)", head, "± (K)", *sources)]]
    errors = [table.tip_stderr_K.values, *table.budget_K.values]
    inside = [shown for shown in _SHOWN if tip[0] <= shown <= tip[-1]]
    if len(inside) < _FEW:  # a cold lever, or a short range
        inside = np.linspace(tip[0], tip[-1], _FEW + 1)[1:].round(1).tolist()
    for shown in inside:
        at = np.interp(shown, tip, along.values)
        kelvins = [f"{np.interp(shown, tip, error):.1f}" for error in errors]
        rows.append([f"{shown:.0f}", f"{at:.3f}", *kelvins])
    return aligned(rows, right=True)


def _pulse_lines(pulse: PulseCalibration) -> list[str]:
    """Return heights of the pulse for some peak temperatures, with the error by source."""
    table, sources = pulse.table, pulse.table.source.values.tolist()
    first, last = table.peak_K.values[[0, -1]]
    wanted = np.linspace(first, last, _FEW + 2)[1:].round(0 if last - first > 50 else 1)
    heads = ("peak (K)", "height (V)", "± (K)", "end (K)", "mean (K)", *sources)
    rows = [[head.rjust(7) for head in heads]]
    for peak in np.minimum(wanted, last).tolist():
        height = float(pulse.height_for(peak))
        errors = [table.peak_stderr_K.values, *table.budget_K.values]
        kelvins = [f"{np.interp(height, table.height_V, error):.1f}" for error in errors]
        others = [f"{pulse.tip_temperature(height, one):.0f}" for one in ("end", "mean")]
        rows.append([f"{peak:.0f}", f"{height:.3f}", kelvins[0], *others, *kelvins[1:]])
    return [f"{pulse.timing.text}:", *aligned(rows, right=True)]


def _verdict(calibration: Calibration) -> str:
    stated = calibration.tip_temperature_uncertainty_K
    word = "good" if stated <= _GOOD else "fair" if stated <= _FAIR else "rough"
    largest = calibration.table.budget_K.max("bias").idxmax("source").item()
    advice = {
        "measurement": "less noise, or tip temperatures at some points, would help",
        "geometry": "better known dimensions would help (--prior dimensions=±2%)",
        "material": "a fit of this lever (--fit), or its tip temperatures, would know its material",
        "fit": "more data for the fit would help",
        "air": "a fit in air would measure the loss to air",
        "k": "a finer measurement near the knee would help",
        "constant k": "--medium air would not assume a constant k",
        "electronics": "better known meters would help",
        "base temperature": "a thermometer at the chip would help",
    }
    text = f"{word}; mostly from {largest}"
    if largest in advice:
        return f"{text}: {advice[largest]}"
    if calibration.route == "power law":
        return f"{text}; a probe (--probe) or a fit (--fit) would know more than a power law"
    return text
