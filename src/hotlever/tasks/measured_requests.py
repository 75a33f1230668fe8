"""What is asked of tasks on measurements and spectra; see `hotlever.tasks.requests`."""

from __future__ import annotations

from dataclasses import MISSING, Field, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.files import FIGURE_TYPES
from hotlever.tasks.requests import (
    FOLDER,
    DriveRequest,
    File,
    PhysicsRequest,
    PlotRequest,
    Request,
    argument,
    check_medium,
    option,
    written,
)
from hotlever.tasks.texts import (
    USUAL,
    check_number,
    parse_number,
    parse_pairs,
    parse_priors,
    parse_setting,
)
from hotlever.units import setting

if TYPE_CHECKING:
    from hotlever.estimate import FitOptions
    from hotlever.probe import Probe


@dataclass(kw_only=True)
class MeasuredRequest(PhysicsRequest):
    """What is done with a measurement: how its file is read, and what is known beforehand."""

    column: list[str] | None = option(
        None,
        "--column",
        metavar="'QUANTITY (UNIT)=NAME'",
        help="Which column of the data is which quantity, as 'I_h (uA)=Current' or by its "
        "number; or a file of such lines; repeated.",
    )
    prior: list[str] | None = option(
        None,
        "--prior",
        metavar="NAME=VALUE±SPREAD",
        help="What is known beforehand, as n_d=3.3e17±15%, n_d=1e17×/3 (to a factor), "
        "dimensions=±2%, usual (what a calibration takes) or none; repeated.",
    )
    laws: str | None = option(
        None,
        metavar="paper|uncertain",
        help="Whether laws of silicon hold to the letter or are as uncertain as published values "
        "differ; left out: uncertain in a calibration, the paper's in a fit.",
    )
    medium: str | None = option(
        None, help="vacuum, air or unknown (both are tried); what the files say if left out."
    )

    @property
    def beforehand(self) -> list[str]:
        """What is known beforehand, as ``--prior`` has it."""
        laws = [] if self.laws is None else [f"laws={self.laws}"]
        return [*(self.prior or []), *laws]

    @property
    def columns(self) -> dict[str, str]:
        """Names of columns by quantity."""
        from hotlever.measurement import parse_columns

        return parse_columns(self.column or [])

    def inputs(self) -> list[Path]:
        """Return the files that are read, those among the values of ``--column`` too."""
        return super().inputs() + [Path(text) for text in self.column or [] if "=" not in text]


@dataclass(kw_only=True)
class LeversRequest(MeasuredRequest):
    """What is made of the measurement of one lever, or of each of several."""

    data: list[Path] = argument(
        MISSING, metavar="DATA.csv...", help="Measurement files, one for each lever."
    )
    probe: File = option(
        None, help="Probe file of levers like these; the reference probe if left out."
    )
    output: File = written(
        (".json",),
        *("-o", "--output"),
        help="Result file (JSON); a folder of them with several data files.",
    )
    report: File = written(FOLDER, help="Write a page with figures to this folder.")
    processes: int | None = option(
        None, metavar="N", help="Local processes; one for each processor if left out."
    )
    scheduler: str | None = option(
        None, metavar="ADDRESS", help="Dask scheduler for several data files, as tls://HOST:8786."
    )

    def check(self) -> None:
        """Refuse what does not go together."""
        check_number("--processes", self.processes, 1, 256)
        self.at_most_one("processes", "scheduler")
        if not self.several:
            self.refuse("scheduler", why="expected several data files")

    @property
    def several(self) -> bool:
        """Whether there are several data files."""
        return len(self.data) > 1

    def types_of(self, own: Field[Any]) -> tuple[str, ...]:
        """Return how the name of a file may end: results of several levers are in a folder."""
        return FOLDER if own.name == "output" and self.several else super().types_of(own)

    def need_single(self, *names: str) -> None:
        """Refuse options that go with one data file where there are several."""
        if self.several:
            self.refuse(*names, why="expected a single data file")


@dataclass(kw_only=True)
class FitRequest(DriveRequest, LeversRequest):
    """Find the material parameters that make the model match a measurement.

    Of what was measured in time, a file with a column as 'time (us)', the heat capacity, and what
    else is free; the wave form is the column V_b, or what is told.

    With several data files: of each lever, in parallel, and how the levers scatter. The same
    command again goes on where it was stopped.
    """

    observables: str | None = option(
        None, help="Some of current,reader,tip,bridge; all that the file has if left out."
    )
    fix: list[str] | None = option(None, metavar="NAME[=VALUE]", help="Hold a parameter.")
    free: str | None = option(
        None,
        metavar="NAME[,...]",
        help="Vary more than is usual: any parameter of a material, as film.lorenz_ratio, or "
        "of the probe.",
    )
    robust: bool = option(False, "--robust", help="Lessen the weight of points far off the others.")
    weights: str = option(
        "maximum", help="maximum: of each observable, as in the paper; or errors, as measured."
    )
    posterior: bool = option(
        False, "--posterior", help="Sample the posterior; predict the tip with its band."
    )
    samples: int = option(10_000, metavar="N", help="Of the posterior, at least.")
    profiles: bool = option(False, "--profiles", help="Profile the likelihood of each parameter.")

    def check(self) -> None:
        """Refuse what does not go together."""
        super().check()
        check_number("--samples", self.samples, 1, 1_000_000)
        if not self.posterior:
            self.refuse("samples", why="goes with --posterior")
        self.need_single("posterior", "profiles", *(own.name for own in fields(DriveRequest)))

    def options(self, probe: Probe) -> FitOptions:
        """Return what the fit of a probe is asked."""
        from hotlever.estimate import FitOptions
        from hotlever.probe.priors import is_of_laws

        usual = USUAL in (self.prior or [])
        priors, stated = parse_priors(self.beforehand, probe), probe.stated_priors
        if self.laws is not None:
            stated = {name: text for name, text in stated.items() if not is_of_laws(name)}
        choices: dict[str, Any] = {
            name: getattr(self, name) for name in ("robust", "weights", "medium")
        }
        return FitOptions(
            observables=None if self.observables is None else self.observables.split(","),
            fixed={
                name: parse_number(text, f"--fix {name}") if text else None
                for name, text in parse_pairs("--fix", self.fix, bare=True).items()
            },
            priors=stated if priors is None else {**stated, **priors} if priors or usual else {},
            usual_priors=usual,
            free=() if self.free is None else tuple(map(str.strip, self.free.split(","))),
            **choices,
        )


@dataclass(kw_only=True)
class CalibrateRequest(PlotRequest, LeversRequest):
    """Find the tip temperature of a lever from its I-V curve, with its error.

    With several data files: of each lever, in parallel, and where the levers differ. The same
    command again goes on where it was stopped.
    """

    fit: File = option(None, help="A fit of this lever (hotlever fit -o).")
    power_law: File = option(None, help="Power law in vacuum (JSON), or a calibration file.")
    pulse: str | None = option(
        None, metavar="TIME[,PERIOD]", help="Calibrate a pulse too, such as 5us or 5us,100us."
    )
    posterior: bool = option(
        False, "--posterior", help="Take the limits from samples of the posterior."
    )
    samples: int = option(4_000, metavar="N", min=1, help="Of the posterior, at least.")
    at: str | None = option(
        None,
        metavar="BIAS|POWER",
        help="Bias of the uncertainty budget, as 8V; the hottest tip if left out. With several "
        "levers where they are compared, as 8V or 2mW; the highest bias that all of them were "
        "measured at if left out.",
    )
    budget_of: str = option(
        "tip", help="What the uncertainty budget is of: tip, or apex of a tip in contact."
    )
    table: File = written(
        (".csv",),
        help="Write the table for an instrument, or for its pulses, to this CSV file; with several "
        "data files each has one beside its calibration.",
    )
    table_by: str = option(
        "temperature", help="What the rows are even in: temperature, power or bias."
    )
    table_step: str | None = option(
        None,
        metavar="STEP",
        help="Between the rows, as 10K, 0.05mW or 0.1V; left out: for 50 rows or more.",
    )

    def check(self) -> None:
        """Refuse what does not go together, and a medium that does not exist."""
        from hotlever.estimate.options import UNKNOWN_MEDIUM
        from hotlever.estimate.uncertainty_budget import check_budget_of

        super().check()
        if not self.posterior:
            self.refuse("samples", why="goes with --posterior")
        if self.table is None and not self.several:
            self.refuse("table_by", "table_step", why="goes with --table")
        check_budget_of(self.budget_of)
        self.at_most_one("fit", "probe", "power_law")
        if self.fit or self.power_law:
            self.refuse("physics", why="goes with --probe, expected neither --fit nor --power-law")
        check_medium(self.medium, UNKNOWN_MEDIUM)
        self.need_single("fit", "table", "plot")
        if self.at is not None and not self.several and parse_setting(self.at)[0] != "bias_V":
            raise InputError(
                f"--at: found {quoted(self.at)}, expected a bias such as 8V of one data file, or "
                "several data files"
            )
        self.table_options()

    def table_options(self) -> dict[str, Any]:
        """Return what the table for an instrument is even in, and its step."""
        from hotlever.estimate.tip_table import TABLES_BY

        if self.table_by not in TABLES_BY:
            raise unknown_name("quantity", self.table_by, TABLES_BY, "--table-by")
        if self.table_step is None:
            return {"by": self.table_by}
        unit = TABLES_BY[self.table_by][1]
        step = setting(self.table_step, unit, "--table-step", bare=True)
        if step <= 0.0:
            raise InputError(f"--table-step {step:g}: expected more than 0 {unit}")
        return {"by": self.table_by, "step": step}


@dataclass(kw_only=True)
class ThermometerRequest(Request):
    """How the silicon line is found, and what its shift is read with; see `set_up`."""

    calibration: str | None = option(
        None,
        metavar="CAL.json",
        help="A calibration that --save-calibration wrote, or 'published' for the published "
        "laws (then --reference is needed).",
    )

    calibrate_from: list[Path] | None = option(
        None, metavar="FILE_OR_DIR...", help="Hot-plate spectra to calibrate from; one or more."
    )
    temperatures: File = option(
        None,
        metavar="TABLE.csv",
        help="Hot-plate temperatures: file name, temperature. Left out: header or file name.",
    )
    corrections: File = option(
        None,
        metavar="TABLE.csv",
        help="By hand: file, start_cm-1 of the line, from_cm-1 and to_cm-1 of what is fitted, use.",
    )
    reference: list[Path] | None = option(
        None,
        metavar="FILE_OR_DIR",
        help="Spectrum at room temperature on the instrument as it is now; may be repeated.",
    )
    law: str = option("anharmonic", metavar="linear|anharmonic", help="Calibration law.")
    shape: str | None = option(
        None,
        metavar="lorentzian|voigt|fano",
        help="Line shape; left out: that of the calibration, else lorentzian.",
    )
    resolution: float | None = option(
        None,
        metavar="CM-1",
        help="FWHM of the spectrometer's response, for voigt; left out: fitted.",
    )
    laser_power: float | None = option(
        None, metavar="MW", help="Laser power on the lever, for its heating."
    )
    thermal_resistance: float | None = option(
        None, metavar="K/MW", help="Thermal resistance of the lever, K per mW of heat."
    )
    stress: float = option(
        0.0, metavar="MPA", help="Unknown stress in the silicon; enters the error."
    )

    def inputs(self) -> list[Path]:
        """Return the files that are read, the calibration too."""
        return super().inputs() + ([] if self.calibration is None else [Path(self.calibration)])


def spectra_argument() -> Any:
    """Return the field of the spectra that are measured."""
    return argument(MISSING, metavar="FILE_OR_DIR...", help="Spectra, or folders of spectra.")


@dataclass(kw_only=True)
class RamanRequest(ThermometerRequest):
    """Find the silicon line in Raman spectra and, calibrated, the temperature."""

    spectra: list[Path] = spectra_argument()
    save_calibration: File = written(
        (".json",), metavar="CAL.json", help="Write the calibration to this file."
    )
    output: File = written((".csv",), "--output", "-o", metavar="FILE.csv", help="Left out: print.")
    plot: File = written(
        FIGURE_TYPES, metavar="FILE.png|.svg|.pdf", help="Figure of spectra and calibration."
    )


@dataclass(kw_only=True)
class JoinRequest(ThermometerRequest):
    """Join a bias log with tip spectra into the file that `hotlever fit` takes.

    A spectrum belongs to the row that names it in a 'file' column, or has the bias in its name
    (tip_5.25V.txt); else spectra and rows are paired in order.
    """

    bias_log: Path = argument(MISSING, metavar="BIAS_LOG.csv", help="The bias sweep.")
    spectra: list[Path] = spectra_argument()
    output: File = written((".csv",), "--output", "-o", metavar="DATA.csv", help="Left out: print.")
