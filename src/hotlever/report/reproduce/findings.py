"""What the sections of the page share: the levers, the words, and the list of claims."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import as_file, files
from typing import Any

import numpy as np
import xarray as xr

from hotlever import spieser2017 as paper
from hotlever.estimate import Estimate, Measurement, fit, read_measurement
from hotlever.lever import Lever
from hotlever.report.report_page import Page, filled, texts
from hotlever.studies.published_lever.ensemble import CRITERIA, verdict_on
from hotlever.studies.simulation_based_calibration import ERRORS, GEOMETRIES

# Where the paper says what, the verdict, what was found, and its range over the layouts.
Claim = tuple[str, str, str, str, str]


@dataclass(frozen=True)
class Extent:
    """How many levers a page is of.

    Attributes
    ----------
    every : int
        Of the levers whose T(P) is followed beyond the knee: every so many.
    geometries : int
        Levers of one material, of `GEOMETRIES`, the first.
    errors : tuple of str
        Errors of the model that these have.
    gaps_um : tuple of float
        Distances of a surface (µm), the last of which is none.
    levers : int
        Levers never seen; each is made with either law of the mobility.
    """

    every: int = 1
    geometries: int = len(GEOMETRIES)
    errors: tuple[str, ...] = tuple(ERRORS)
    gaps_um: tuple[float, ...] = (0.5, 1.0, 2.0, 5.0, 10.0, 50.0, np.inf)
    levers: int = 12

    @classmethod
    def quick(cls) -> Extent:
        """Return that of the quick form."""
        return cls(5, 3, ("none", "all"), (1.0, 10.0, np.inf), 2)


class Findings(Page):
    """The page being filled, with what more than one section looks at.

    Parameters
    ----------
    lever : Lever
        The reference lever in vacuum, with the published option III.
    quick : bool
        Whether sections that take long are to be of fewer levers.

    Attributes
    ----------
    claims : list of tuple of str
        Where the paper says what, the verdict, what was found in this run, and the range of that
        over the layouts of the paper's lever, if it depends on the layout.
    """

    def __init__(self, lever: Lever, *, quick: bool = False) -> None:
        super().__init__(
            "Joule-heated cantilever probes: the published results, computed",
            f"Spieser et al., J. Appl. Phys. 121, 174503 (2017), doi:{paper.DOI}, with the paper's "
            "tables and figures by their numbers. No drawing of the published lever exists: what "
            "depends on it is judged on layouts that were estimated from all that is printed, and "
            "drawn for hotlever's reference probe, one more inference.",
        )
        self.lever, self.quick = lever, quick
        self.extent = Extent.quick() if quick else Extent()
        self.claims: list[Claim] = []
        # a curve through so many biases (V) has no visible corners
        self.curve_V = np.linspace(0.1, paper.RAMP[-1], 110)

    @cached_property
    def air(self) -> Lever:
        """The lever in still air, freely suspended."""
        return self.lever.in_medium("air")

    @cached_property
    def fitted_example(self) -> Estimate:
        """Option III on the virtual lab's first lever."""
        return fit(example("lever-a.csv"), self.lever.probe)

    def columns(
        self, name: str, columns: Mapping[str, tuple[xr.DataArray, str]], /, **numbers: Any
    ) -> None:
        """Add a table of some values and their format by heading."""
        cells = [[f"{value:{form}}" for value in data.values] for data, form in columns.values()]
        self.tabulate(name, list(columns), list(zip(*cells, strict=True)), **numbers)

    def claim(self, name: str, /, *, holds: bool, **numbers: Any) -> None:
        """Add the claim of a name that does not go by layouts, and whether it holds in this run.

        Its text may say why in ``layouts``.
        """
        text = self._claim(name, numbers)
        verdict = text["holds"] if holds else f"does not hold, because {text['fails']}"
        row = text["claim"], verdict, text["ours"], text["layouts"]
        self.claims.append((self.linked(text["where"]), *row))

    def judge(self, name: str, value: float, /, **numbers: Any) -> None:
        """Add the claim of a name by the layouts for which it holds.

        The value is what a `hotlever.studies.published_lever.ensemble.Criterion` judges, of the
        reference probe in this run.
        """
        text, (words, over_layouts) = self._claim(name, numbers), verdict_on(name)
        here = bool(CRITERIA[name].holds(value))
        if words == "holds" and here:
            words = text["holds"]
        elif words == "does not hold" and not here:
            words = f"does not hold, because {text['fails']}"
        elif here:
            words = f"{words}; for the reference probe it {text['holds']}"
        else:
            words = f"{words}; not for the reference probe, because {text['fails']}"
        row = text["claim"], words, text["ours"], over_layouts
        self.claims.append((self.linked(text["where"]), *row))

    def _claim(self, name: str, numbers: Mapping[str, Any]) -> dict[str, str]:
        claim = {"holds": "holds", "layouts": "no layout enters", **texts()["claims"][name]}
        return {key: filled(words, **numbers) for key, words in claim.items()}


def example(name: str) -> Measurement:
    """Return a measurement among the package's examples."""
    with as_file(files("hotlever") / "examples" / name) as path:
        return read_measurement(path)
