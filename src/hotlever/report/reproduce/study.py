"""What the sections of the page share: the levers and their solutions, and the list of claims."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import xarray as xr

from hotlever.calibration.characteristic import Characteristic, characteristic
from hotlever.lever import Lever
from hotlever.materials.spieser2017 import RAMP
from hotlever.report.page import Page


@dataclass(frozen=True)
class Claim:
    """What the paper says, and what was found in this run.

    Attributes
    ----------
    where, statement, verdict, found : str
    """

    where: str
    statement: str
    verdict: str
    found: str


@dataclass
class Study:
    """The page being filled, with everything that more than one section looks at.

    Parameters
    ----------
    page : Page
    lever : Lever
        The reference lever in vacuum, with the published option III.
    quick : bool
        Leave out what takes long.
    """

    page: Page
    lever: Lever
    quick: bool
    claims: list[Claim] = field(default_factory=list)

    def claim(
        self,
        where: str,
        statement: str,
        found: str,
        *,
        holds: bool,
        within: str = "",
        because: str = "",
    ) -> None:
        """Add a claim of the paper with its verdict.

        Parameters
        ----------
        where : str
            Section, figure or equation of the paper.
        statement : str
            The claim in our words.
        found : str
            What this run gives.
        holds : bool
        within : str
            How closely it holds.
        because : str
            Why it does not.
        """
        verdict = f"holds within {within}" if within else "holds"
        if not holds:
            verdict = f"does not hold here, because {because}"
        self.claims.append(Claim(where, statement, verdict, found))

    @cached_property
    def ramp(self) -> xr.Dataset:
        """The paper's 25 points in vacuum."""
        return self.lever.sweep(RAMP)

    @cached_property
    def curve(self) -> xr.Dataset:
        """The same with many points."""
        return self.lever.sweep(np.linspace(0.1, RAMP[-1], 110))

    @cached_property
    def knee(self) -> xr.Dataset:
        """The exact knee in vacuum."""
        return self.lever.knee()

    @cached_property
    def air(self) -> Lever:
        """The same lever in still air, freely suspended."""
        return self.lever.in_medium("air")

    @cached_property
    def air_ramp(self) -> xr.Dataset:
        """The paper's 25 points in air."""
        return self.air.sweep(RAMP)

    @cached_property
    def air_curve(self) -> xr.Dataset:
        """The same with many points."""
        return self.air.sweep(np.linspace(0.1, RAMP[-1], 110))

    @cached_property
    def characteristic(self) -> Characteristic:
        """Voltage and power by tip temperature in vacuum."""
        return characteristic(self.lever)

    @cached_property
    def air_characteristic(self) -> Characteristic:
        """Voltage and power by tip temperature in air."""
        return characteristic(self.air)
