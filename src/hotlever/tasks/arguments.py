"""Arguments and options that several commands share, each declared once as the type of a parameter.

Beside what the command line says of it stands, with one that names what is written, what that is
(`Written`). What several options tell together is settled here too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

from typer import Argument, Option

from hotlever.errors import InputError, excerpt
from hotlever.files import FIGURE_TYPES, FOLDER

if TYPE_CHECKING:
    from hotlever.lever.transient import Waveform


@dataclass(frozen=True)
class Written:
    """Marks a parameter that names a file which is written, or a folder.

    Attributes
    ----------
    types : tuple of str
        How the name of the file may end; `FOLDER` for a folder.
    types_of : callable, optional
        Tells this where it depends on other parameters, of whose values by name it is given all.
    """

    types: tuple[str, ...] = FOLDER
    types_of: Callable[[Mapping[str, Any]], tuple[str, ...]] | None = None


# --- levers -------------------------------------------------------------------------------------

ProbeFile = Annotated[
    Path | None,
    Argument(metavar="[PROBE.toml]", help="Probe file; the reference probe if left out."),
]
Medium = Annotated[str | None, Option(help="vacuum or air; what the files say if left out.")]
Settings = Annotated[
    list[str] | None,
    Option("--set", metavar="NAME=VALUE", help="Change a value of the probe file."),
]
Physics = Annotated[
    str | None,
    Option(
        metavar="EFFECT,...",
        help="thermoelectric, radiation or both: effects that count beyond the paper's, or none; "
        "what the probe file says if left out.",
    ),
]
Bias = Annotated[
    str | None,
    Option(
        metavar="START:STOP:COUNT",
        help="In volts, ends included, or a single one; 1:11:25 if left out.",
    ),
]

# --- what is written ----------------------------------------------------------------------------

Plot = Annotated[
    Path | None, Option(help="Draw to this file: .png, .svg or .pdf."), Written(FIGURE_TYPES)
]
Table = Annotated[
    Path | None,
    Option("-o", "--output", help="FILE.csv or FILE.nc; standard output if left out."),
    Written((".csv", ".nc")),
]

# --- in time ------------------------------------------------------------------------------------

Step = Annotated[str | None, Option(metavar="V", help="Switch the bias on, and leave it.")]
Pulse = Annotated[str | None, Option(metavar="V,TIME", help="A pulse, such as 10V,5us.")]
Period = Annotated[str | None, Option(metavar="TIME", help="Of pulses that are repeated.")]
Count = Annotated[int | None, Option(metavar="N", help="Number of pulses.")]
Ramp = Annotated[str | None, Option(metavar="V,TIME", help="Raise the bias, such as 8V,50us.")]
Sine = Annotated[str | None, Option(metavar="V+V@FREQ", help="Such as 3V+0.5V@20kHz.")]
WaveformFile = Annotated[
    Path | None, Option(help="A table of times and biases, such as a supply takes.")
]
Until = Annotated[str | None, Option(metavar="TIME", help="When to stop.")]
Times = Annotated[
    str | None,
    Option(metavar="TIME,...", help="Times to report; where the solver stepped if left out."),
]

# --- measurements of levers ---------------------------------------------------------------------

MeasuredProbe = Annotated[
    Path | None,
    Option(help="Probe file of levers like these; the reference probe if left out."),
]
MeasuredMedium = Annotated[
    str | None,
    Option(help="vacuum, air or unknown (both are tried); what the files say if left out."),
]
Column = Annotated[
    list[str] | None,
    Option(
        metavar="'QUANTITY (UNIT)=NAME'",
        help="Which column of the data is which quantity, as 'I_h (uA)=Current' or by its "
        "number; or a file of such lines; repeated.",
    ),
]
Priors = Annotated[
    list[str] | None,
    Option(
        metavar="NAME=VALUE±SPREAD",
        help="What is known beforehand, as n_d=3.3e17±15%, n_d=1e17×/3 (to a factor), "
        "dimensions=±2%, usual (what a calibration takes) or none; repeated.",
    ),
]
Laws = Annotated[
    str | None,
    Option(
        metavar="paper|uncertain",
        help="Whether laws of silicon hold to the letter or are as uncertain as published values "
        "differ; left out: uncertain in a calibration, the paper's in a fit.",
    ),
]
Data = Annotated[
    list[Path], Argument(metavar="DATA.csv...", help="Measurement files, one for each lever.")
]
Results = Annotated[
    Path | None,
    Option("-o", "--output", help="Result file (JSON); a folder of them with several data files."),
    Written(types_of=lambda values: FOLDER if len(values["data"]) > 1 else (".json",)),
]
Report = Annotated[Path | None, Option(help="Write a page with figures to this folder."), Written()]
Processes = Annotated[
    int | None,
    Option(metavar="N", help="Local processes; one for each processor if left out."),
]
Scheduler = Annotated[
    str | None,
    Option(metavar="ADDRESS", help="Dask scheduler for several data files, as tls://HOST:8786."),
]

# --- spectra ------------------------------------------------------------------------------------

Spectra = Annotated[
    list[Path], Argument(metavar="FILE_OR_DIR...", help="Spectra, or folders of spectra.")
]
CalibrationName = Annotated[
    str | None,
    Option(
        metavar="CAL.json",
        help="A calibration that --save-calibration wrote, or 'published' for the published laws "
        "(then --reference is needed).",
    ),
]
CalibrateFrom = Annotated[
    list[Path] | None,
    Option(metavar="FILE_OR_DIR...", help="Hot-plate spectra to calibrate from; one or more."),
]
Temperatures = Annotated[
    Path | None,
    Option(
        metavar="TABLE.csv",
        help="Hot-plate temperatures: file name, temperature. Left out: header or file name.",
    ),
]
Corrections = Annotated[
    Path | None,
    Option(
        metavar="TABLE.csv",
        help="By hand: file, start_cm-1 of the line, from_cm-1 and to_cm-1 of what is fitted, use.",
    ),
]
Reference = Annotated[
    list[Path] | None,
    Option(
        metavar="FILE_OR_DIR",
        help="Spectrum at room temperature on the instrument as it is now; may be repeated.",
    ),
]
CalibrationLaw = Annotated[str, Option(metavar="linear|anharmonic", help="Calibration law.")]
LineShape = Annotated[
    str | None,
    Option(
        metavar="lorentzian|voigt|fano",
        help="Line shape; left out: that of the calibration, else lorentzian.",
    ),
]
Resolution = Annotated[
    float | None,
    Option(
        metavar="CM-1", help="FWHM of the spectrometer's response, for voigt; left out: fitted."
    ),
]
LaserPower = Annotated[
    float | None, Option(metavar="MW", help="Laser power on the lever, for its heating.")
]
ThermalResistance = Annotated[
    float | None,
    Option(metavar="K/MW", help="Thermal resistance of the lever, K per mW of heat."),
]
Stress = Annotated[
    float, Option(metavar="MPA", help="Unknown stress in the silicon; enters the error.")
]

# --- what options tell together -----------------------------------------------------------------


def _stated(options: Mapping[str, Any]) -> list[str]:
    """Return the options, by the names of their parameters, that are stated."""
    return [
        f"--{name.replace('_', '-')}"
        for name, value in options.items()
        if value is not None and value is not False
    ]


def refuse(why: str, **options: Any) -> None:
    """Refuse options of which any would do nothing, or contradict.

    Examples
    --------
    >>> refuse("goes with --pulse", period=None, count=None)
    >>> refuse("goes with --pulse", period="5us", count=None)
    Traceback (most recent call last):
    ...
    hotlever.errors.InputError: --period: goes with --pulse
    """
    for option in _stated(options):
        raise InputError(f"{option}: {why}")


def at_most_one(**options: Any) -> None:
    """Refuse several of some options."""
    if len(stated := _stated(options)) > 1:
        raise InputError(f"{' and '.join(stated)}: expected only one of them")


def check_medium(medium: str | None, *more: str) -> None:
    """Refuse a medium that does not exist."""
    from hotlever.probe.surroundings import Medium

    media = *get_args(Medium), *more
    if medium is not None and medium not in media:
        raise InputError(f"--medium {excerpt(medium)}: expected {' or '.join(media)}")


def read_drive(
    step: str | None,
    pulse: str | None,
    period: str | None,
    count: int | None,
    ramp: str | None,
    sine: str | None,
    waveform: Path | None,
) -> Waveform | None:
    """Return the one wave form that is told by a text or in a file; None if none is.

    Raises
    ------
    InputError
        If several are told, or one cannot be understood.
    """
    from hotlever.lever.transient import read_waveform
    from hotlever.lever.transient.waveform import waveform_from_text

    told = {"step": step, "pulse": pulse, "ramp": ramp, "sine": sine}
    at_most_one(**told, waveform=waveform)
    if pulse is None:
        refuse("goes with --pulse", period=period, count=count)
    if waveform is not None:
        return read_waveform(waveform)
    for kind, text in told.items():
        if text is not None:
            return waveform_from_text(kind, text, period, count, mark="--")
    return None
