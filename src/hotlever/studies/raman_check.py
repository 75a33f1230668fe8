"""The paper's Raman thermometer: what its linear law does above the hot plate's temperatures.

Spieser et al. 2017 calibrate a line below 900 K and use it to 1150 K. Silicon's line does not
shift linearly. How far is such a line off, and how much of the 50 K between the measured
(943 K) and the predicted (893 K) knee temperature is that?
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from hotlever import spieser2017 as paper
from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.raman.thermometer import (
    Point,
    RamanCalibration,
    calibrate_raman,
    published_raman_calibration,
)


def paper_check(calibration: RamanCalibration | None = None) -> xr.Dataset:
    """Check the linear law of Spieser et al. 2017 against an anharmonic law.

    Parameters
    ----------
    calibration : RamanCalibration, optional
        A hot-plate calibration whose anharmonic law is taken for true; Balkanski's published
        constants unless given.

    Raises
    ------
    InputError
        If no temperature belongs to the line at the measured knee by that law.

    Returns
    -------
    xarray.Dataset
        For each ``line`` (the published one, and one refitted to the anharmonic law up to
        900 K): what it reads at the hottest tip's temperature and how far that is off; the
        true temperature at the measured knee, how far that is above the predicted knee, and
        the part of the published discrepancy that is thereby explained, 0 to 1. On
        ``temperature_K`` what each line reads less the truth, and the paper's error.

    Examples
    --------
    >>> check = paper_check()
    >>> check.error_at_hottest.values.round().tolist()
    [92.0, 96.0]
    """
    truth = calibration or published_raman_calibration()
    room = truth.room_temperature_K
    # the paper's series: room temperature to 900 K in steps of about 25 K
    series = np.arange(room, paper.RAMAN_CALIBRATED_TO_K + 1.0, 25.0)
    shifts, _ = truth.anharmonic.shift(series, room)
    points = [
        Point(file="", temperature_K=float(t), centre_cm=float(d), centre_stderr_cm=1.0)
        for t, d in zip(series, shifts, strict=True)
    ]
    printed = published_raman_calibration().linear
    laws = {"published line": printed}
    laws[f"line refitted to {paper.RAMAN_CALIBRATED_TO_K:.0f} K"] = calibrate_raman(points).linear
    grid = np.linspace(room, paper.HOTTEST_TIP_K + 25.0, 300)
    shift, _ = truth.anharmonic.shift(grid, room)
    hot, _ = truth.anharmonic.shift(np.array([paper.HOTTEST_TIP_K]), room)
    reads = np.array([law.temperature(hot, room)[0] for law in laws.values()])
    at_knee = [
        (paper.KNEE_MEASURED_K - room - law.constant_K) / law.slope_K_cm for law in laws.values()
    ]
    true = truth.anharmonic.temperature(np.array(at_knee), room)
    if np.isnan(true).any():
        raise InputError(
            f"the calibration's anharmonic law has no temperature at a shift of {min(at_knee):.1f} "
            "cm⁻¹, where the knee was read; expected one for silicon"
        )
    error = np.array([law.temperature(shift, room) - grid for law in laws.values()])
    names = [
        f"{name}: {law.constant_K:.1f} K − {-law.slope_K_cm:.1f} K cm · shift"
        for name, law in laws.items()
    ]
    return labelled(
        {
            "reads_at_hottest": reads,
            "error_at_hottest": reads - paper.HOTTEST_TIP_K,
            "true_at_knee": true,
            "discrepancy": true - paper.KNEE_PREDICTED_K,
            "explained": (paper.KNEE_MEASURED_K - true) / paper.KNEE_OFF_K,
            "error": (("line", "temperature_K"), error),
            "paper_error": ("temperature_K", printed.band(grid - room)),
        },
        "line",
        {"line": names, "temperature_K": grid},
        truth=truth.source,
        hottest_K=paper.HOTTEST_TIP_K,
        knee_measured_K=paper.KNEE_MEASURED_K,
        knee_predicted_K=paper.KNEE_PREDICTED_K,
        calibrated_to_K=paper.RAMAN_CALIBRATED_TO_K,
    )


def conclusion(check: xr.Dataset) -> str:
    """The answer in three sentences."""
    errors, remaining = np.sort(check.error_at_hottest), np.sort(check.discrepancy)
    measured, predicted = check.knee_measured_K, check.knee_predicted_K
    band = check.paper_error.interp(temperature_K=measured).item()
    return (
        f"A line calibrated below {check.calibrated_to_K:.0f} K reads {errors[0]:.0f} to "
        f"{errors[-1]:.0f} K too hot at {check.hottest_K:.0f} K. The knee read as "
        f"{measured:.0f} K was at {predicted + remaining[0]:.0f} to "
        f"{predicted + remaining[-1]:.0f} K, so {remaining[0]:.0f} to {remaining[-1]:.0f} K of "
        f"the {measured - predicted:.0f} K discrepancy remain. The paper's own error there is "
        f"±{band:.0f} K."
    )
