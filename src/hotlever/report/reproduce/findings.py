"""What the sections of the page share: the levers, and the list of claims."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from hotlever.lever import Lever
from hotlever.report.page import Linked, Page
from hotlever.spieser2017 import DOI, RAMP
from hotlever.types import Progress

#: Biases (V) of a curve without visible corners.
MANY = np.linspace(0.1, RAMP[-1], 110)


class Findings(Page):
    """The page being filled, with what more than one section looks at.

    Parameters
    ----------
    lever : Lever
        The reference lever in vacuum, with the published option III.
    progress : callable, optional
        For a section that takes long: called with its steps done and their number.

    Attributes
    ----------
    air : Lever
        The same lever in still air, freely suspended.
    claims : list of tuple of str
        Where the paper says what, the verdict, and what was found in this run.
    """

    def __init__(self, lever: Lever, progress: Progress | None = None) -> None:
        super().__init__(
            "Joule-heated cantilever probes: the published results, computed",
            f"Spieser et al., J. Appl. Phys. 121, 174503 (2017), doi:{DOI}, with hotlever's "
            "reference probe, whose dimensions are inferred: no drawing of the published lever "
            "exists.",
        )
        self.lever, self.air, self.progress = lever, lever.in_medium("air"), progress
        self.claims: list[tuple[str, str, str, str]] = []

    def claim(
        self,
        where: str,
        statement: str,
        found: str,
        *,
        holds: bool,
        as_found: str = "",
        because: str = "",
    ) -> None:
        """Add a claim of the paper: how it holds in this run (`as_found`), or why it does not."""
        verdict = f"holds{as_found}"
        if not holds:
            verdict = f"does not hold here, because {because}"
        self.claims.append((Linked(where, self.anchor), statement, verdict, found))

    def columns(self, columns: Mapping[str, tuple[xr.DataArray, str]], caption: str) -> None:
        """Add a table of some values and their format by heading."""
        cells = [[f"{value:{form}}" for value in found.values] for found, form in columns.values()]
        self.table(list(columns), list(zip(*cells, strict=True)), caption)
