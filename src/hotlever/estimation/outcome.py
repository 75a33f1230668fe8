"""What fits and calibrations have in common: whether a lever describes what was measured."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from hotlever.errors import InputError
from hotlever.estimation.result_file import ResultFile
from hotlever.files import write_text
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import PriorUse


class Outcome(ABC):
    """What was estimated of a lever; without errors unless the data are described.

    Errors about a lever that does not show the data would not hold.

    Attributes
    ----------
    probe : Probe
    measurement : Measurement
    priors : dict of str to PriorUse
    reason : str
        Why the data are not described by any such lever, or why that is not known; empty if they
        are.
    converged : bool
        Whether the search came to its end.
    notes : list of str
    """

    #: What no lever is like that shows data which are not described.
    lever: ClassVar[str] = "such lever"
    probe: Probe
    measurement: Measurement
    priors: dict[str, PriorUse]
    reason: str
    converged: bool
    notes: list[str]

    def __post_init__(self) -> None:
        if self.describes_data:
            return
        unknown = {name: replace(use, posterior_spread=np.nan) for name, use in self.priors.items()}
        for name, value in {"priors": unknown, **self._without_errors()}.items():
            object.__setattr__(self, name, value)

    @abstractmethod
    def _without_errors(self) -> dict[str, Any]:
        """Return the other attributes that hold errors, without any."""

    @property
    def describes_data(self) -> bool | None:
        """Whether such a lever shows what was measured; None if the search did not converge."""
        return not self.reason if self.converged else None

    @property
    def doubt(self) -> str:
        """That no such lever shows the data, or that the search did not converge; else empty."""
        if self.describes_data:
            return ""
        if self.describes_data is None:
            return f"the search for a lever that shows these data did not converge: {self.reason}"
        return f"no {self.lever} shows these data: {self.reason}"

    def need_described(self, what: str) -> None:
        """Raise an error unless the data are described, for what has no meaning otherwise.

        Raises
        ------
        InputError
            If they are not.
        """
        if not self.describes_data:
            raise InputError(f"{what}: expected data that a lever describes; {self.doubt}")

    @abstractmethod
    def file(self) -> ResultFile:
        """Return what the result file holds."""

    def content(self) -> dict[str, Any]:
        """Return the content of the result file in plain values."""
        return self.file().content()

    def to_json(self) -> str:
        """Return the text of the result file."""
        return self.file().to_json()

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the result file, whole or not at all."""
        write_text(path, self.to_json())
