"""What is asked of tasks on probes, materials, designs, and what to measure next."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import MISSING, Field, dataclass
from pathlib import Path
from typing import Any

from hotlever.errors import InputError, excerpt, quoted, unknown_name
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S
from hotlever.tasks.measured_requests import MeasuredRequest
from hotlever.tasks.requests import (
    File,
    PhysicsRequest,
    PlotRequest,
    ProbeRequest,
    Request,
    TableRequest,
    argument,
    check_medium,
    option,
    written,
)
from hotlever.tasks.texts import check_number, parse_bias, parse_number, parse_pairs
from hotlever.units import setting

#: Shapes of new probe files, and the methods of `Probe` that make one.
NEW_PROBES = {"three-leg": "reference", "u-shape": "u_shape"}
#: Measurements that are proposed at once; by default, unless kinds are limited.
MOST_PROPOSALS, _USUAL_PROPOSALS = 100, 5
#: Minutes by unit of time.
_MINUTES = {"s": 1.0 / 60.0, "min": 1.0, "h": 60.0}


@dataclass(kw_only=True)
class NewRequest(Request):
    """Write the reference probe as a commented file."""

    output: File = written((".toml",), "-o", "--output", help="File; standard output if left out.")
    shape: str = option("three-leg", help=f"One of: {', '.join(NEW_PROBES)}.")


@dataclass(kw_only=True)
class ShowRequest(PlotRequest, ProbeRequest):
    """Draw and describe a probe."""

    mesh: bool = option(False, "--mesh", help="Draw the triangles of the mesh too.")


@dataclass(kw_only=True)
class ImportRequest(PlotRequest):
    """Say what a drawing holds, and propose a probe file for it."""

    drawing: Path = argument(MISSING, metavar="DRAWING", help="GDSII, OASIS or DXF file.")
    output: File = written(
        (".toml",), "-o", "--output", help="Probe file to write; standard output if left out."
    )
    cell: str | None = option(None, help="Of GDSII or OASIS; the top cell if left out.")
    unit: str | None = option(
        None, help="Of the drawing's numbers, as mm; what the file says if left out."
    )

    @property
    def known_unit(self) -> str | None:
        """The unit, by a name that drawings are read with."""
        from hotlever.probe.drawing.sheet import UNITS

        name = None if self.unit is None else self.unit.replace("µ", "u").replace("μ", "u")
        if name is not None and name not in UNITS:
            raise unknown_name("unit", name, UNITS, "--unit")
        return name


@dataclass(kw_only=True)
class MaterialsRequest(PlotRequest):
    """List kinds of material, or those of a probe: parameters, units, bounds, laws, sources."""

    probe: File = argument(
        None,
        metavar="[PROBE.toml]",
        help="Probe file whose materials are listed; all kinds and presets if left out.",
    )


@dataclass(kw_only=True)
class DesignRequest(TableRequest, PhysicsRequest, ProbeRequest):
    """Show how knee, tip temperature and loss to air depend on a probe's design."""

    vary: list[str] | None = option(
        None,
        metavar="NAME=START:STOP:COUNT",
        help="Sweep a number of the probe file, annealing_K or annealing_min; repeated: each with "
        "each, as a map. A table of sensitivities if left out.",
    )
    power: float = option(2.0, help="Power (mW) in vacuum at which the tip temperature is given.")
    annealing_K: float = option(
        ANNEALING_K, "--annealing-K", help="Annealing (K) that the probe's delta is of."
    )
    annealing_min: float = option(ANNEALING_S / 60.0, help="Annealing (min) that the delta is of.")
    air: bool = option(True, help="Solve in air too, for k.")
    minimise: str | None = option(
        None,
        metavar="QUANTITY",
        help="Find the design whose quantity is least, such as time_constant_us; it writes a probe "
        "file (-o FILE.toml).",
    )
    maximise: str | None = option(None, metavar="QUANTITY", help="Or greatest.")
    within: list[str] | None = option(
        None,
        metavar="NAME=LOW:HIGH",
        help="Bounds of a number that may change, or of a quantity (one may be left out).",
    )
    at: str = option(
        "700K", metavar="POINT", help="Working point: a tip temperature, or as 8V or 2mW."
    )

    @property
    def asks_for_best(self) -> bool:
        """Whether the best design is looked for."""
        return self.minimise is not None or self.maximise is not None

    def need_no_others(self) -> None:
        """Refuse options that do nothing beside what is asked for: the best design, or others."""
        if self.asks_for_best:
            self.at_most_one("minimise", "maximise")
            others = "vary", "power", "annealing_K", "annealing_min", "air"
            self.refuse(*others, why="does not go with --minimise or --maximise")
        else:
            self.refuse("within", "at", why="goes with --minimise or --maximise")

    def types_of(self, own: Field[Any]) -> tuple[str, ...]:
        """Return how the name of a file may end: the best design is a probe file."""
        is_probe = own.name == "output" and self.asks_for_best
        return (".toml",) if is_probe else super().types_of(own)


@dataclass(kw_only=True)
class NextRequest(PlotRequest, MeasuredRequest):
    """Say what to measure next, so that the tip temperature is known best.

    One row for each proposal, best first: how hot the tip would be there, and how hot at most
    with 99 % certainty, and how sure its temperature is known then. Without data: where to begin.
    """

    data: File = argument(
        None,
        metavar="[DATA]",
        help="Calibration (hotlever calibrate -o CAL.json), or a measurement file, which is "
        "calibrated first; left out: a lever that was not measured yet.",
    )
    probe: File = option(
        None, help="Probe file of a lever like this one; the reference probe if left out."
    )
    allow: str | None = option(
        None,
        metavar="KIND[=COUNT],...",
        help="Some of bias,spectra,reader, and at most how many, as bias=15,spectra=3; bias and "
        "spectra if left out, and reader where it was measured.",
    )
    count: int | None = option(
        None, metavar="N", help="Proposals; 5, or as many as are allowed, if left out."
    )
    at: str | None = option(
        None,
        metavar="TEMPERATURE",
        help="Tip temperature whose error counts, as 800K; if left out the hottest that was "
        "measured, or without data the hottest that may be.",
    )
    stay_below: str | None = option(
        None,
        metavar="TEMPERATURE",
        help="Propose nothing at which the tip could be hotter with more than 1 % probability, as "
        "900K; what melts if left out.",
    )
    bias: str | None = option(
        None,
        metavar="START:STOP:COUNT",
        help="Biases that can be taken (V); even ones to half beyond those measured if left out.",
    )
    cost: list[str] | None = option(
        None,
        metavar="KIND=TIME",
        help="Of one measurement, as spectra=10min; repeated for each kind. The gain is then that "
        "per minute.",
    )
    noise: list[str] | None = option(
        None,
        metavar="NAME=SHARE",
        help="Of a measurement to come, as current=0.2% or tip=1% (of the rise); that of the data, "
        "or what is usual, if left out; repeated.",
    )
    output: File = written(
        (".csv",), "-o", "--output", help="CSV file; a table in words if left out."
    )

    @property
    def calibrated(self) -> bool:
        """Whether the data are a calibration."""
        return self.data is not None and self.data.suffix.lower() == ".json"

    def check(self) -> None:
        """Refuse what does not go together."""
        from hotlever.estimate.options import UNKNOWN_MEDIUM

        # of a lever that was not measured nothing could tell in which it is
        check_medium(self.medium, *([] if self.data is None else [UNKNOWN_MEDIUM]))
        check_number("--count", self.count, 1, MOST_PROPOSALS)
        if self.calibrated:
            of_levers = "probe", "prior", "laws", "medium", "physics", "column"
            why = "the calibration has its own; expected a measurement file"
            self.refuse(*of_levers, why=why)
        elif self.data is None:
            self.refuse("column", why="expected a measurement file")

    def choices(self) -> dict[str, Any]:
        """Return what is asked of `hotlever.estimate.next_measurement.plan_next`."""
        allowed = parse_kinds(self.allow)
        limits = list((allowed or {"": None}).values())
        usual = sum(number or 0 for number in limits) if all(limits) else _USUAL_PROPOSALS
        return {
            "at_K": _temperature(self.at, "--at"),
            "stay_below_K": _temperature(self.stay_below, "--stay-below"),
            "allowed": allowed,
            "count": self.count or min(usual, MOST_PROPOSALS),
            "bias": None if self.bias is None else parse_bias(self.bias),
            "costs": parse_costs(self.cost, list(allowed or ("bias", "spectra"))),
            "noise": parse_noise(self.noise),
        }


def _temperature(text: str | None, option: str) -> float | None:
    if text is None:
        return None
    kelvins = setting(text, "K", option)
    check_number(option, kelvins, 1.0, 5000.0)
    return kelvins


def parse_kinds(text: str | None) -> dict[str, int | None] | None:
    """Parse ``bias,spectra`` or ``bias=15,spectra=3``: kinds of measurement, at most so many.

    Examples
    --------
    >>> parse_kinds("bias,spectra=3")
    {'bias': None, 'spectra': 3}
    """
    if text is None:
        return None
    kinds = dict[str, int | None]()
    expected = "KIND,... or KIND=COUNT,..., such as bias,spectra=3"
    for name, number in parse_pairs("--allow", text.split(","), expected, bare=True).items():
        if number and not (number.isdecimal() and 1 <= int(number[:9]) <= MOST_PROPOSALS):
            raise InputError(
                f"--allow {excerpt(name)}: found {quoted(number)}, expected a whole number from 1 "
                f"to {MOST_PROPOSALS}"
            )
        kinds[name] = int(number) if number else None
    return kinds


def parse_costs(texts: Iterable[str] | None, kinds: Sequence[str]) -> dict[str, float]:
    """Parse several ``KIND=TIME``, such as ``spectra=10min``, in minutes.

    Examples
    --------
    >>> parse_costs(["spectra=10min", "bias=30s"], ["bias", "spectra"])
    {'spectra': 10.0, 'bias': 0.5}
    """
    costs, expected = dict[str, float](), "KIND=TIME, such as spectra=10min"
    for name, text in parse_pairs("--cost", texts, expected).items():
        where = f"--cost {excerpt(name)}"
        if name not in kinds:
            raise unknown_name("kind of measurement", name, kinds, "--cost")
        number, minutes = text.rstrip("hminsec "), 0.0
        with suppress(InputError):
            minutes = _MINUTES.get(text[len(number) :].strip(), 0.0) * parse_number(number, where)
        if not 0.0 < minutes < math.inf:
            raise InputError(f"{where}: found {quoted(text)}, expected a time such as 30s or 10min")
        costs[name] = minutes
    missing = [kind for kind in kinds if kind not in costs]
    if costs and missing:
        raise InputError(f"--cost: found none of {', '.join(missing)}, expected one of each kind")
    return costs


def parse_noise(texts: Iterable[str] | None) -> dict[str, float]:
    """Parse several ``NAME=SHARE``, such as ``current=0.2%``, of observables.

    Examples
    --------
    >>> parse_noise(["current=0.2%", "tip=1%"])
    {'current': 0.002, 'tip': 0.01}
    """
    from hotlever.quantities import OBSERVABLES

    noise, expected = dict[str, float](), "NAME=SHARE, such as current=0.2%"
    for name, text in parse_pairs("--noise", texts, expected).items():
        if name not in OBSERVABLES:
            raise unknown_name("observable", name, OBSERVABLES, "--noise")
        where = f"--noise {name}"
        share = parse_number(text.removesuffix("%"), where) / 100.0 if text.endswith("%") else 0.0
        if not 1e-6 <= share <= 0.5:
            raise InputError(f"{where}: found {quoted(text)}, expected a share from 1e-4% to 50%")
        noise[name] = share
    return noise
