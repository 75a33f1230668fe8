"""What a fit is asked: the one set of options of `fit`, of batches and of the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

from hotlever.errors import InputError, unknown_name
from hotlever.lever.dataset import OBSERVABLES
from hotlever.materials import PARAMETERS, parameter
from hotlever.probe import Probe
from hotlever.probe.priors import SCALES, Prior
from hotlever.probe.surroundings import Medium

Weights = Literal["maximum", "errors"]


@dataclass(frozen=True)
class FitOptions:
    """What a fit is asked.

    Attributes
    ----------
    observables : sequence of {"current", "reader", "tip"}, optional
        Option I of the paper is ``["current"]``, option II ``["current", "reader"]``, option
        III all three. All that the measurement has, by default.
    fixed : mapping of str to float or None
        Parameters to hold, at a value or (None) at the probe's.
    robust : bool
        Lessen the weight of points far from the others' fit: from 3.5 standard deviations on, as
        the median absolute residual tells them, down to nothing beyond 6.
    weights : {"maximum", "errors"}
        Divide every observable by its largest measured value, as in the paper, or every datum by
        its measurement error; an observable without errors then takes its scatter about the fit.
    drift : bool
        Let the zeros of I_h and V_r lie on straight lines over the order of the rows.
    medium : {"vacuum", "air"}, optional
        What the lever was measured in; wins over measurement and probe.
    priors : mapping of str to Prior or str
        What is known before, of parameters of the material, dimensions, the circuit or the scales
        of meters, also as text (`hotlever.probe.priors`); all that have a prior are varied.
    free : sequence of str
        What else is varied beside the material.

    Raises
    ------
    InputError
        If a name does not exist, with the nearest that does.
    """

    observables: Sequence[str] | None = None
    fixed: Mapping[str, float | None] = field(default_factory=dict)
    robust: bool = False
    weights: Weights = "maximum"
    drift: bool = False
    medium: Medium | None = None
    priors: Mapping[str, Prior | str] = field(default_factory=dict)
    free: Sequence[str] = ()

    def __post_init__(self) -> None:
        for name in self.fixed:
            parameter(name)
            if name in self.priors:
                raise InputError(f"{name} is fixed and has a prior, expected one of them")
        if len(self.fixed) >= len(PARAMETERS):
            raise InputError("all parameters are fixed; nothing is left to fit")
        asked: list[tuple[str, Any, tuple[str, ...]]] = [
            ("weights", self.weights, get_args(Weights))
        ]
        asked += [("observable", name, tuple(OBSERVABLES)) for name in self.observables or ()]
        if self.medium is not None:
            asked.append(("medium", self.medium, get_args(Medium)))
        for kind, name, known in asked:
            if name not in known:
                raise unknown_name(kind, str(name), known)
        if self.observables is None:
            return
        if not self.observables:
            raise InputError(f"no observables; expected some of {', '.join(OBSERVABLES)}")
        chosen = tuple(name for name in OBSERVABLES if name in self.observables)
        object.__setattr__(self, "observables", chosen)

    @property
    def material(self) -> list[str]:
        """The parameters of the material to find."""
        return [name for name in PARAMETERS if name not in self.fixed]

    @property
    def varied(self) -> list[str]:
        """All parameters to find."""
        more = dict.fromkeys([*self.priors, *self.free])
        return [*self.material, *(name for name in more if name not in {*PARAMETERS, *SCALES})]

    def held(self, probe: Probe) -> Probe:
        """Return a probe with the fixed values in place.

        Raises
        ------
        InputError
            If a value is impossible.
        """
        values = {name: value for name, value in self.fixed.items() if value is not None}
        return probe.with_(**values) if values else probe

    def values(self) -> dict[str, Any]:
        """Return the options as plain values."""
        return asdict(self) | {"fixed": dict(self.fixed), "free": list(self.free)}
