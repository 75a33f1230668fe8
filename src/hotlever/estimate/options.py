"""What users ask of a fit, and of a calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, TypeVar, get_args

from hotlever.errors import InputError, unknown_name
from hotlever.estimate.power_law import PowerLaw
from hotlever.estimate.tip_table import PulseTiming
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import SCALES, Prior
from hotlever.probe.probe_parameters import (
    heat_capacities,
    of_materials,
    parameter_of,
    usual_parameters,
)
from hotlever.probe.surroundings import Medium
from hotlever.quantities import FITTED

Weights = Literal["maximum", "errors"]
#: Of what there are uncertainty budgets: a tip, or its apex that touches a sample.
BudgetOf = Literal["tip", "apex"]


@dataclass(frozen=True)
class FitOptions:
    """What a fit is asked.

    Attributes
    ----------
    observables : sequence of {"current", "reader", "tip", "bridge"}, optional
        Option I of the paper is ``["current"]``, option II ``["current", "reader"]``, option
        III adds the tip. All that the measurement has, by default.
    fixed : mapping of str to float or None
        Parameters to hold, at a value or (None) at the probe's.
    robust : bool
        Lessen the weight of points far from the others' fit: from 3.5 standard deviations on, as
        the median absolute residual tells them, down to nothing beyond 6. With priors this is done
        wherever there are enough data to tell.
    weights : {"maximum", "errors"}
        Divide every observable by its largest measured value, as in the paper, or every datum by
        its measurement error; an observable without errors then takes its scatter about the fit.
    medium : {"vacuum", "air", "unknown"}, optional
        What the lever was measured in; wins over measurement and probe. If it is unknown both are
        tried (`hotlever.estimate.estimator`).
    priors : mapping of str to Prior or str
        What is known before, of parameters of the material, dimensions, the circuit or the scales
        of meters, also as text (`hotlever.probe.priors`); all that have a prior are varied.
    usual_priors : bool
        Whether what is usually known beforehand counts where no prior is stated, as it does in a
        calibration (`hotlever.probe.priors.default_priors`).
    free : sequence of str
        What else is varied, beside what usually is.
    usual : sequence of str
        What usually is: by default the six parameters of the paper's lever. A fit takes what its
        probe is made of (`hotlever.probe.probe_parameters.usual_parameters`), and one of what was
        measured in time the scales of the heat capacities.

    Raises
    ------
    InputError
        If a name does not exist, with the nearest that does.
    """

    observables: Sequence[str] | None = None
    fixed: Mapping[str, float | None] = field(default_factory=dict)
    robust: bool = False
    weights: Weights = "maximum"
    medium: Medium | Literal["unknown"] | None = None
    priors: Mapping[str, Prior | str] = field(default_factory=dict)
    usual_priors: bool = False
    free: Sequence[str] = ()
    usual: Sequence[str] = tuple(PARAMETERS)

    def __post_init__(self) -> None:
        for name in self.fixed:
            for others, what in ((self.priors, "has a prior"), (self.free, "is free")):
                if name in others:
                    raise InputError(f"{name} is fixed and {what}, expected one of them")
        for kind, names, existing in (
            ("weights", [self.weights], get_args(Weights)),
            ("observable", self.observables or (), tuple(FITTED)),
            (
                "medium",
                [] if self.medium is None else [self.medium],
                (*get_args(Medium), "unknown"),
            ),
        ):
            for name in names:
                if name not in existing:
                    raise unknown_name(kind, str(name), existing)
        if self.observables is None:
            return
        if not self.observables:
            raise InputError(f"no observables; expected some of {', '.join(FITTED)}")
        chosen = tuple(name for name in FITTED if name in self.observables)
        object.__setattr__(self, "observables", chosen)

    @property
    def varied(self) -> list[str]:
        """All parameters to find."""
        named = dict.fromkeys([*self.usual, *self.priors, *self.free])
        return [name for name in named if name not in {*self.fixed, *SCALES}]

    def of(self, probe: Probe, *, in_time: bool = False) -> FitOptions:
        """Return the options for a probe: what usually varies is what it is made of.

        Raises
        ------
        InputError
            If it has no such parameter as is fixed or free, with the nearest that it has; or if
            all are fixed.
        """
        existing = of_materials(probe, in_time=in_time)
        for name in self.fixed:
            if name not in existing:
                raise unknown_name("parameter", name, existing)
        for name in self.free:
            parameter_of(probe, name, in_time=in_time)
        usual = heat_capacities(probe) if in_time else usual_parameters(probe)
        own = replace(self, usual=usual)
        if not own.varied:
            raise InputError("all parameters are fixed; nothing is left to fit")
        return own

    @property
    def media(self) -> tuple[Medium | None, ...]:
        """What is to be tried: None is what measurement and probe say."""
        return get_args(Medium) if self.medium == "unknown" else (self.medium,)

    def values(self) -> dict[str, Any]:
        """Return the options as plain values."""
        values = asdict(self) | {"fixed": dict(self.fixed), "free": list(self.free)}
        if not values["usual_priors"]:
            del values["usual_priors"]
        if tuple(values.pop("usual")) != tuple(PARAMETERS):
            values["usual"] = list(self.usual)
        return values


@dataclass(frozen=True)
class CalibrationOptions:
    """What a calibration is asked.

    Attributes
    ----------
    law : PowerLaw, optional
        A power law in vacuum, in place of a model. It takes a lever that only the swept supply
        heats.
    medium : {"vacuum", "air", "unknown"}, optional
        What the lever is in; by default what the data file says, or else the fit or the probe. If
        it is unknown both are tried. With vacuum for data from air the paper's rule is used: the
        temperatures that the probe has in vacuum, at k times the power.
    priors : mapping of str to Prior or str, optional
        What is known beforehand, in place of some of the usual priors, such as
        ``{"n_d": "3.3e17 ± 15%"}``; see `hotlever.probe.priors`. If empty there are none, and
        dimensions are held.
    pulse : PulseTiming, optional
        Of pulses whose tip temperature is wanted too (`hotlever.estimate.pulses`).
    samples : int
        Of the posterior, at least, from which the limits of the tip temperature are taken; by
        default they follow from its linearised error, or estimates of hotter and colder levers.
    at_V : float, optional
        Bias of the uncertainty budget; that of the hottest tip by default.
    budget_of : {"tip", "apex"}
        What the uncertainty budget is of: the tip, or its apex that touches a sample.

    Raises
    ------
    InputError
        If a name does not exist, with the nearest that does, or options exclude each other.
    """

    law: PowerLaw | None = None
    medium: Medium | Literal["unknown"] | None = None
    priors: Mapping[str, Prior | str] | None = None
    pulse: PulseTiming | None = None
    samples: int = 0
    at_V: float | None = None
    budget_of: BudgetOf = "tip"

    def __post_init__(self) -> None:
        if self.law is not None and self.medium not in (None, "vacuum"):
            raise InputError("a power law holds in vacuum; with one, leave the medium out")
        if self.law is not None and self.priors is not None:
            raise InputError("a power law takes no priors; a probe or a fit does")
        if self.budget_of not in get_args(BudgetOf):
            raise InputError(
                f"an uncertainty budget of '{self.budget_of}': expected "
                f"{' or '.join(get_args(BudgetOf))}, of which it is at rest (the errors of a pulse "
                "by source are in its table)"
            )

    @property
    def of_lever(self) -> FitOptions:
        """What of the lever is estimated, and beside which priors."""
        usual = self.priors is None or bool(self.priors)
        return FitOptions(priors=self.priors or {}, usual_priors=usual, medium=self.medium)

    def need_none_of_the_rule(self) -> None:
        """Raise an error if something is asked that the paper's rule has not."""
        lacks = {
            "has no posterior": self.samples > 0,
            "has no uncertainty budget": self.at_V is not None or self.budget_of != "tip",
            "says nothing about a pulse": self.pulse is not None,
        }
        for lack, is_requested in lacks.items():
            if is_requested:
                raise InputError(
                    f"the paper's rule {lack}; expected a probe or a fit, in the medium of the data"
                )

    def values(self) -> dict[str, Any]:
        """Return as plain values what does not say of the lever what is estimated."""
        return {
            "power_law": None if self.law is None else self.law.model_dump(),
            "pulse": None if self.pulse is None else asdict(self.pulse),
            "samples": self.samples,
            "budget_of": self.budget_of,
        }


Options = TypeVar("Options", FitOptions, CalibrationOptions)


def chosen(kind: str, options: Options, choices: Mapping[str, Any]) -> Options:
    """Return the options of a fit or a calibration with some of them chosen by name.

    Raises
    ------
    InputError
        If there is no such option; the text gives the nearest one.
    """
    names = list(type(options).__dataclass_fields__)
    for name in choices:
        if name not in names:
            raise unknown_name("option", name, names, kind)
    return replace(options, **choices)
