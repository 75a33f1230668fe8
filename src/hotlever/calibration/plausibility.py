"""Whether data can be those of a lever at all, before it is fitted and after."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtrc

from hotlever.errors import InputError, counted
from hotlever.estimation.diagnosis import Diagnosis
from hotlever.estimation.lack_of_fit import lack_of_fit_text, run_of_outliers
from hotlever.estimation.residuals import Residuals
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.measurement.contents import colder_than_base
from hotlever.probe import Circuit, Probe
from hotlever.probe.parameters import parameters_of
from hotlever.probe.priors import Moved, Prior, PriorUse

#: The resistance of a cold lever is within this factor of its model's.
_WITHIN = 2.5
#: Beyond so many times that of its model hardly any current flows.
_OPEN = 100.0
#: Rows that a calibration needs, and those that are not few.
_FEWEST, _FEW = 3, 6
#: Biases below this share of the largest hardly change what other supplies drive.
_HARDLY = 0.05
#: Currents are coarse in steps of this share of the largest, each a multiple within so much.
_COARSE, _EVEN = 0.01, 0.02
#: A lever is cold that was never hotter (K).
_COLD_K = 400.0
#: Data are not described where parameters are as far from their priors as one lever in 500 is.
_UNLIKELY = 2e-3
#: The same where data and all other priors are so many standard deviations from one prior: of the
#: nearly twenty of a lever one is, by chance, in one lever of 500.
_PULL = 3.85


def check_plausible(
    measured: Measurement, probe: Probe, causes: Diagnosis, priors: Mapping[str, Prior]
) -> None:
    """Refuse data whose resistance at low bias, or whose temperatures, are far from the lever's.

    Raises
    ------
    InputError
        Saying what was compared, and the likeliest cause.
    """
    where = measured.path or "measurement"
    alone, size = probe.circuit.starts_cold, np.abs(measured.bias_V)
    current = measured.current(probe.circuit)
    here = np.isfinite(current) & (measured.bias_V > 0) & (current > 0)
    if not alone:
        # other supplies drive a current as well, which is known less well than what is added
        here = np.isfinite(current) & (size > _HARDLY * size.max())
    different = np.unique(measured.bias_V[here]).size
    if different < _FEWEST:
        above = " above 0" if alone else ""
        raise InputError(
            f"{where}: currents{above} at {different} different biases{above}, expected "
            f"{_FEWEST} or more"
        )
    _check_temperatures(measured, probe, where)
    bias, current = measured.bias_V[here], current[here]
    low = np.argsort(np.abs(bias))[: max(_FEWEST, bias.size // 8)]
    # what a cold lever shows does not depend on what is around it
    cold = probe.in_medium("vacuum") if alone else probe
    rest = Lever(cold, COARSE).branch_to(0.0)
    lever = float(rest.value_slopes[0, 0] / rest.value_slopes[0, 1])
    series = probe.circuit.series_kohm
    added = current[low] - rest.values[0, 1]
    cold_kohm = float(np.median(bias[low] / np.where(added == 0.0, np.nan, added)))
    ratio = cold_kohm / (lever + series)
    if cold_kohm > series and abs(np.log(ratio)) < np.log(_WITHIN):
        return
    # an owner who knows little of a lever expects no less of it
    spread = cold_resistance_spread(cold, priors) if alone else 0.0
    if cold_kohm > series and abs(np.log((cold_kohm - series) / lever)) < _PULL * spread:
        return
    shown = "V_b / I_h" if alone else "the change of V_b over that of I_h"
    cause = causes.likeliest()
    if not cause and cold_kohm > _OPEN * (lever + series):
        cause = "hardly any current flows, as if a terminal was open or the meter at another one"
    cause = cause or "no single cause that is known explains it"
    raise InputError(
        f"{where}: {shown} is {cold_kohm:.4g} kΩ at low bias, expected about "
        f"{lever + series:.4g} kΩ ({series:g} kΩ in series and {lever:.3g} kΩ of the lever): "
        f"{cause}"
    )


def cold_resistance_spread(probe: Probe, priors: Mapping[str, Prior]) -> float:
    """Return the standard deviation of the logarithm of a cold lever's resistance by its priors."""
    lever = SimilarLevers(Lever(probe, COARSE))
    names = tuple(name for name in priors if name in parameters_of(probe))
    branch = lever.linearised(probe, Reach(probe.circuit, 0.0), names=names)
    first = int(branch.branch.solved[0])
    by = branch.shown[first, :2] / branch.branch.values[first, :2, None]
    spreads = np.array([priors[name].absolute for name in names])
    return float(np.linalg.norm((by[0] - by[1]) * spreads))


def _check_temperatures(measured: Measurement, probe: Probe, where: str) -> None:
    """Refuse tips that are colder than the base of the lever."""
    base = probe.circuit.base_temperature_K
    colder = colder_than_base(measured.tip_K, measured.tip_error_K, base)
    if colder.any():
        row = int(np.argmax(colder))
        raise InputError(
            f"{where}: T_tip is {measured.tip_K[row]:.4g} K at {measured.bias_V[row]:.4g} V, "
            f"expected more than the base temperature, {base:g} K: is it in °C, or another column?"
        )


def what_data_lack(measured: Measurement, circuit: Circuit, tip_K: np.ndarray) -> list[str]:
    """Say what the data lack, to tell more of a lever."""
    remarks, count = [], np.isfinite(measured.current(circuit)).sum()
    if count < _FEW:
        remarks.append(
            f"{counted(count, 'row')} with a current: few for a lever, so that the answer leans on "
            f"what was known beforehand; {_FEW} or more would tell"
        )
    levels = np.unique(measured.current_mA[np.isfinite(measured.current_mA)])
    step = float(np.diff(levels).min()) if levels.size > 1 else 0.0
    share = step / float(levels[-1]) if step else 0.0
    if share > _COARSE and np.allclose(levels / step, np.round(levels / step), atol=_EVEN):
        remarks.append(
            f"I_h has a resolution of {step:.2g} mA only, {share:.1%} of its largest value, in "
            f"{counted(levels.size, 'step')}"
        )
    hottest = float(np.nanmax(tip_K))
    if hottest < _COLD_K:
        remarks.append(
            f"the lever was measured only up to a tip of {hottest:.0f} K; what it does beyond is "
            "not known"
        )
    return remarks


def misfit(
    residuals: Residuals,
    values: np.ndarray,
    priors: Mapping[str, PriorUse],
    moved: Mapping[str, Moved],
) -> str:
    """Return why data are not described by what was fitted to them; empty if they are."""
    reason = lack_of_fit_text(residuals, values) or run_of_outliers(residuals, values)
    if reason:
        return reason
    name = max(moved, key=lambda name: abs(moved[name].pull), default="")
    if name and abs(moved[name].pull) > _PULL:
        use = priors[name]
        return (
            f"{name}, known as {use.stated}, would have to be another; the "
            f"data are {abs(moved[name].pull):.1f} σ from it"
        )
    # as many are free to be away as the data tell of
    told = sum(each.told for each in moved.values())
    if told > 0 and chdtrc(told, sum(each.size**2 for each in moved.values())) < _UNLIKELY:
        most = sorted(moved, key=lambda name: -abs(moved[name].size))[:3]
        away = ", ".join(f"{name} by {moved[name].size:+.1f} σ" for name in most)
        return f"what was known beforehand would have to be wrong by too much together, {away}"
    return ""
