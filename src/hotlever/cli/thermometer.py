"""The options of a Raman thermometer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from hotlever.cli.options import File
from hotlever.cli.output import note, progress

if TYPE_CHECKING:
    from hotlever.raman.thermometry import Thermometry

CalibrationOption = Annotated[
    str | None,
    Option(
        metavar="CAL.json",
        help="A calibration that --save-calibration wrote, or 'published' for the published "
        "laws (then --reference is needed).",
    ),
]


@dataclass
class ThermometerOptions:
    """What `set_up` of `hotlever.raman.thermometry` takes."""

    calibration: CalibrationOption = None
    calibrate_from: Annotated[
        list[Path] | None,
        Option(metavar="FILE_OR_DIR...", help="Hot-plate spectra to calibrate from; one or more."),
    ] = None
    temperatures: Annotated[
        File,
        Option(
            metavar="TABLE.csv",
            help="Hot-plate temperatures: file name, temperature. Left out: header or file name.",
        ),
    ] = None
    corrections: Annotated[
        File,
        Option(
            metavar="TABLE.csv",
            help="By hand: file, start_cm-1 of the line, from_cm-1 and to_cm-1 of what is fitted, "
            "use.",
        ),
    ] = None
    reference: Annotated[
        list[Path] | None,
        Option(
            metavar="FILE_OR_DIR",
            help="Spectrum at room temperature on the instrument as it is now; may be repeated.",
        ),
    ] = None
    law: Annotated[str, Option(metavar="linear|anharmonic", help="Calibration law.")] = "anharmonic"
    shape: Annotated[
        str | None,
        Option(
            metavar="lorentzian|voigt|fano",
            help="Line shape; left out: that of the calibration, else lorentzian.",
        ),
    ] = None
    resolution: Annotated[
        float | None,
        Option(
            metavar="CM-1",
            help="FWHM of the spectrometer's response, for voigt; left out: fitted.",
        ),
    ] = None
    laser_power: Annotated[
        float | None, Option(metavar="MW", help="Laser power on the lever, for its heating.")
    ] = None
    thermal_resistance: Annotated[
        float | None,
        Option(metavar="K/MW", help="Thermal resistance of the lever, K per mW of heat."),
    ] = None
    stress: Annotated[
        float, Option(metavar="MPA", help="Unknown stress in the silicon; enters the error.")
    ] = 0.0

    @property
    def files(self) -> list[Path | str | None]:
        """The files that it reads."""
        several = [*(self.calibrate_from or []), *(self.reference or [])]
        return [*several, self.temperatures, self.calibration, self.corrections]

    def set_up(self) -> Thermometry:
        """Set the thermometer up; what is noticed goes to standard error."""
        from hotlever.raman import thermometry

        return thermometry.set_up(**vars(self), listener=thermometry.Listener(note, progress))
