"""What is asked of tasks about probes: what a change of the design does, files, drawings."""

from __future__ import annotations

from dataclasses import MISSING, Field, dataclass
from pathlib import Path
from typing import Any

from hotlever.errors import unknown_name
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S
from hotlever.tasks.requests import (
    File,
    PhysicsRequest,
    PlotRequest,
    ProbeRequest,
    Request,
    TableRequest,
    argument,
    option,
    written,
)

#: Shapes of new probe files, and the methods of `Probe` that make one.
NEW_PROBES = {"three-leg": "reference", "u-shape": "u_shape"}


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
            others = "vary", "power", "annealing_K", "annealing_min", "air"
            self.refuse(others, "does not go with --minimise or --maximise")
        else:
            self.refuse(["within", "at"], "goes with --minimise or --maximise")

    def types_of(self, own: Field[Any]) -> tuple[str, ...]:
        """Return how the name of a file may end: the best design is a probe file."""
        is_probe = own.name == "output" and self.asks_for_best
        return (".toml",) if is_probe else super().types_of(own)


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
