"""The paper's check: what its linear law does to temperatures above the hot plate's.

Spieser et al. 2017 calibrate a line below 900 K and use it to 1150 K. Silicon's line does not
shift linearly. How far is such a line off, and how much of the 50 K between the measured
(943 K) and the predicted (893 K) knee temperature is that?
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.raman.calibration import Calibration, LinearFit, Point, calibrate, published
from hotlever.raman.lineshape import Array
from hotlever.raman.published import (
    HIGHEST_TIP_TEMPERATURE,
    KNEE_MEASURED,
    KNEE_PREDICTED,
    ROOM_TEMPERATURE,
    SPIESER2017,
)


@dataclass(frozen=True)
class LineCheck:
    """One linear law against the anharmonic law.

    Attributes
    ----------
    name : str
    reads_at_hottest : float
        What the line reads on silicon at the highest temperature, K.
    error_at_hottest : float
        That less the highest temperature, K.
    true_at_knee : float
        Temperature of silicon whose line the linear law reads as the measured knee, K.
    discrepancy : float
        That less the predicted knee temperature, K.
    explained : float
        Part of the published discrepancy that the law's curvature makes up, 0 to 1.
    """

    name: str
    reads_at_hottest: float
    error_at_hottest: float
    true_at_knee: float
    discrepancy: float
    explained: float


@dataclass(frozen=True)
class PaperCheck:
    """Both linear laws against the anharmonic one.

    Attributes
    ----------
    calibration : Calibration
        Its anharmonic law is taken for true.
    laws : list of (str, LinearFit)
        The published line and a line fitted to the anharmonic law below `calibrated_to`.
    results : list of LineCheck
    hottest, knee_measured, knee_predicted, calibrated_to : float
        K.
    """

    calibration: Calibration
    laws: list[tuple[str, LinearFit]]
    results: list[LineCheck]
    hottest: float
    knee_measured: float
    knee_predicted: float
    calibrated_to: float

    def conclusion(self) -> str:
        """The answer in three sentences."""
        errors = sorted(result.error_at_hottest for result in self.results)
        remaining = sorted(result.discrepancy for result in self.results)
        band = float(self.laws[0][1].band(np.array(self.knee_measured - ROOM_TEMPERATURE)))
        published_gap = self.knee_measured - self.knee_predicted
        return (
            f"A line calibrated below {self.calibrated_to:.0f} K reads {errors[0]:.0f} to "
            f"{errors[-1]:.0f} K too hot at {self.hottest:.0f} K. The knee read as "
            f"{self.knee_measured:.0f} K was at {self.knee_predicted + remaining[0]:.0f} to "
            f"{self.knee_predicted + remaining[-1]:.0f} K, so {remaining[0]:.0f} to "
            f"{remaining[-1]:.0f} K of the {published_gap:.0f} K discrepancy remain. The paper's "
            f"own error there is ±{band:.0f} K."
        )

    def errors(self, temperature: Array) -> dict[str, Array]:
        """What each line reads less the true temperature (K), by name."""
        room = self.calibration.room_temperature_K
        shift, _ = self.calibration.anharmonic.shift(temperature, room)
        return {name: law.temperature(shift, room) - temperature for name, law in self.laws}


def paper_check(calibration: Calibration | None = None) -> PaperCheck:
    """Check the linear law of Spieser et al. 2017 against an anharmonic law.

    Parameters
    ----------
    calibration : Calibration, optional
        A hot-plate calibration whose anharmonic law is taken for true; Balkanski's published
        constants unless given.

    Examples
    --------
    >>> check = paper_check()
    >>> [round(result.error_at_hottest) for result in check.results]
    [92, 96]
    """
    truth = calibration or published()
    room = truth.room_temperature_K
    # the paper's series: room temperature to 900 K in steps of about 25 K
    temperatures = np.arange(room, SPIESER2017.calibrated_to + 1.0, 25.0)
    shifts, _ = truth.anharmonic.shift(temperatures, room)
    refitted = calibrate(
        [
            Point(file="", temperature_K=float(t), centre_cm=float(d), centre_stderr_cm=1.0)
            for t, d in zip(temperatures, shifts, strict=True)
        ]
    ).linear
    paper = published().linear
    laws = [
        (_label("published line", paper), paper),
        (_label("line refitted to 900 K", refitted), refitted),
    ]
    gap = KNEE_MEASURED - KNEE_PREDICTED
    results = []
    for name, law in laws:
        hot, _ = truth.anharmonic.shift(np.array([HIGHEST_TIP_TEMPERATURE]), room)
        reads = float(law.temperature(hot, room)[0])
        shift_at_knee = (KNEE_MEASURED - room - law.constant_K) / law.slope_K_cm
        true = float(truth.anharmonic.temperature(np.array([shift_at_knee]), room)[0])
        results.append(
            LineCheck(
                name=name,
                reads_at_hottest=reads,
                error_at_hottest=reads - HIGHEST_TIP_TEMPERATURE,
                true_at_knee=true,
                discrepancy=true - KNEE_PREDICTED,
                explained=(KNEE_MEASURED - true) / gap,
            )
        )
    return PaperCheck(
        calibration=truth,
        laws=laws,
        results=results,
        hottest=HIGHEST_TIP_TEMPERATURE,
        knee_measured=KNEE_MEASURED,
        knee_predicted=KNEE_PREDICTED,
        calibrated_to=SPIESER2017.calibrated_to,
    )


def _label(name: str, law: LinearFit) -> str:
    return f"{name}: {law.constant_K:.1f} K − {-law.slope_K_cm:.1f} K cm · shift"
