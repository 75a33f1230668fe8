"""Whether a lever describes what was measured: said the same way by fits and calibrations."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from typing import Any, ClassVar

from hotlever.errors import InputError
from hotlever.estimation.embedded import Section
from hotlever.files import json_text, write_text
from hotlever.measurement import Measurement


def doubt(describes_data: bool | None, reason: str, lever: str = "such lever") -> str:
    """Say that data are not described, or that the search did not converge; empty if they are."""
    if describes_data:
        return ""
    if describes_data is None:
        return f"the search for a lever that shows these data did not converge: {reason}"
    return f"no {lever} shows these data: {reason}"


class Outcome(ABC):
    """What was estimated of a lever; without errors unless the data are described.

    Errors about a lever that does not show the data would not hold.

    Attributes
    ----------
    measurement : Measurement
    reason : str
        Why the data are not described by any such lever, or why that is not known; empty if they
        are.
    converged : bool
        Whether the search came to its end.
    """

    #: What no lever is like that shows data which are not described.
    lever: ClassVar[str] = "such lever"
    measurement: Measurement
    reason: str
    converged: bool

    def __post_init__(self) -> None:
        for name, value in ({} if self.describes_data else self._without_errors()).items():
            object.__setattr__(self, name, value)

    @abstractmethod
    def _without_errors(self) -> dict[str, Any]:
        """Return the attributes that hold errors, without any."""

    @property
    def describes_data(self) -> bool | None:
        """Whether such a lever shows what was measured; None if the search did not converge."""
        return not self.reason if self.converged else None

    @property
    def doubt(self) -> str:
        """That no such lever shows the data, or that the search did not converge; else empty."""
        return doubt(self.describes_data, self.reason, self.lever)

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
    def content(self) -> dict[str, Any]:
        """Return the content of the result file."""

    def to_json(self) -> str:
        """Return the result file."""
        return json_text(self.content())

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the result file, whole or not at all."""
        write_text(path, self.to_json())


class Verdict(Section):
    """Whether data are described, as a result file says it; one that does not say so has a reason.

    Attributes
    ----------
    describes_data : bool or None
        None where the search did not converge.
    reason : str
        Why they are not; empty if they are.
    """

    describes_data: bool | None = True
    reason: str = ""

    @property
    def verdict(self) -> dict[str, Any]:
        """The same as an `Outcome` has it: `converged` and `reason`."""
        reason = self.reason or ("" if self.describes_data else "the file does not say why")
        return {"converged": self.describes_data is not None, "reason": reason}
