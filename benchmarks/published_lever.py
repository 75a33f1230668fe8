"""The lever of the paper from all that is printed of it: data of hotlever.studies.published_lever.

python benchmarks/published_lever.py search     layouts.toml: layouts that suit what is printed
python benchmarks/published_lever.py numbers    numbers.csv: what each of them shows of it
python benchmarks/published_lever.py knee       knee.csv: what carries how much of the 50 K that
                                                the knee is off, in those with a weight
"""

from __future__ import annotations

import csv
import io
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.errors import ComputationError, HotleverError
from hotlever.files import write_text
from hotlever.materials import PARAMETERS
from hotlever.materials.departures import DEPARTURES
from hotlever.studies import published_lever
from hotlever.studies.knee_study import Suspect, carried_by, knee_K
from hotlever.studies.published_lever.ensemble import stored_ensemble
from hotlever.studies.published_lever.layout_numbers import numbers_of
from hotlever.studies.published_lever.layout_search import Found, search
from hotlever.studies.published_lever.layouts import REFERENCE, stored_layouts
from hotlever.studies.published_lever.statements import SEARCHED

FOLDER = Path(published_lever.__file__).parent


@dataclass(frozen=True)
class Drawing:
    """Which layouts are searched for.

    Attributes
    ----------
    shortest_um, longest_um : float
        Lengths between which levers are drawn, their logarithms evenly: with an air of a sphere of
        60 µm around it a lever is shorter than the sphere is wide.
    drawn : int
        Layouts after drawn errors.
    best_um : tuple of float
        Lengths of the layouts that suit best.
    first : str
        What is printed that another layout meets before all else, of `first_um`.
    """

    shortest_um: float = 25.0
    longest_um: float = 110.0
    drawn: int = 16
    best_um: tuple[float, ...] = (25.0, 31.0, 44.0, 54.4, 90.0)
    first: str = "Eq. 12"
    first_um: float = 54.4
    seed: int = field(default=1, repr=False)

    def lengths(self, rng: np.random.Generator) -> list[float]:
        """Return the lengths (µm) that are drawn, one in each of even strata."""
        share = (np.arange(self.drawn) + rng.random(self.drawn)) / self.drawn
        lengths = self.shortest_um * (self.longest_um / self.shortest_um) ** share
        return [round(length, 2) for length in lengths.tolist()]


def write_layouts(drawing: Drawing) -> None:
    """Search for all, and write them."""
    found: list[tuple[str, float, bool, Found]] = []
    for length in drawing.best_um:
        found.append((f"best of {length:.0f} µm", length, False, search(length)))
        said(found)
    first = search(drawing.first_um, first=drawing.first)
    found.append((f"{drawing.first} first", drawing.first_um, False, first))
    said(found)
    departed = search(drawing.first_um, uncertain_laws=True)
    found.append(("uncertain laws", drawing.first_um, False, departed))
    said(found)
    rng = np.random.default_rng(drawing.seed)
    for number, length in enumerate(drawing.lengths(rng)):
        errors = np.random.default_rng([drawing.seed, number])
        try:
            layout = search(length, rng=errors)
        except HotleverError as error:
            print(f"{length} µm: {error}", flush=True)
            continue
        found.append((f"{length:.1f} µm", length, True, layout))
        said(found)
    head = (
        "# Layouts of the lever of Spieser et al. (2017) that suit what is printed of it, written\n"
        "# by benchmarks/published_lever.py search; dimensions in µm, the series resistance in Ω.\n"
    )
    write_text(FOLDER / "layouts.toml", head + "".join(as_toml(*each) for each in found))


def as_toml(name: str, length: float, drawn: bool, found: Found) -> str:
    """Return a layout as its file has it."""
    return (
        f'\n[[layout]]\nname = "{name}"\nlength_um = {length}\ndrawn = {str(drawn).lower()}\n'
        f"square = {found.square:.2f}\n[layout.values]\n"
        + "".join(f"{key} = {value:.6g}\n" for key, value in found.values.items())
    )


def said(found: list[tuple[str, float, bool, Found]]) -> None:
    """Print the latest."""
    name, _, _, one = found[-1]
    values = ", ".join(f"{key} {value:.4g}" for key, value in one.values.items())
    print(
        f"{time.process_time():6.0f} s  {name}: {one.square:.2f} after {one.evaluations}; {values}",
        flush=True,
    )


def write_numbers() -> None:
    """Compute what each layout shows, and write the table."""
    rows: list[dict[str, Any]] = []
    for name, layout in stored_layouts().items():
        rows.append({"layout": name, **numbers_of(layout)})
        print(f"{time.process_time():6.0f} s  {name}", flush=True)
    write_table(FOLDER / "numbers.csv", rows)


def write_knee() -> None:
    """Compute what each suspect carries in the nearest layout, the reference, and all drawn ones.

    Coefficients of laws in the nearest alone.
    """
    found, chosen = stored_layouts(), stored_ensemble()
    drawn = [name for name, layout in found.items() if layout.drawn]
    coefficients = [name for law in DEPARTURES.values() for name in law.names]
    rows: list[dict[str, Any]] = []
    for name in (chosen.nearest, REFERENCE, *drawn):
        probe = found[name].probe()
        own_K = knee_K(probe)
        for suspect in (*Suspect, *(coefficients if name == chosen.nearest else ())):
            if suspect == Suspect.IN_AIR:
                continue
            try:
                carried = carried_by(probe, suspect, own_K)
            except ComputationError as error:
                print(f"{name}, {suspect}: {error}", flush=True)
                continue
            numbers = {
                key: float(getattr(carried, key)) for key in ("moved_K", "shift_K", "ramp_K")
            }
            parameters = {
                key: float(carried.fitted.material.model_dump()[key]) for key in PARAMETERS
            }
            rows.append({"layout": name, "suspect": str(suspect), **numbers, **parameters})
            print(f"{time.process_time():6.0f} s  {name}, {suspect}: {numbers}", flush=True)
        write_table(FOLDER / "knee.csv", rows)


def write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write rows of one table, numbers to five digits."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(
        {key: f"{value:.5g}" if isinstance(value, float) else value for key, value in row.items()}
        for row in rows
    )
    write_text(path, text.getvalue())


def main(words: Iterable[str]) -> None:
    """Write what is asked for."""
    print(f"{len(SEARCHED)} statements have derivatives")
    for word in words:
        {
            "search": lambda: write_layouts(Drawing()),
            "numbers": write_numbers,
            "knee": write_knee,
        }[word]()


if __name__ == "__main__":
    main(sys.argv[1:])
