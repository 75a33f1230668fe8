"""What is known of a lever before it is measured: a value and a spread for each parameter.

How it is written: `hotlever.probe.prior_texts`. The name ``dimensions`` means all of the drawing
and the thickness. The scales of meters and of the Raman thermometer have priors too, shares such as
``± 2%``: by so much all that they show may be wrong together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from hotlever.errors import InputError, unknown_name
from hotlever.materials.parameters import PUBLISHED_SCATTER, Parameter
from hotlever.probe.parameters import (
    OF_THE_TIP,
    of_materials,
    own_name,
    parameters_of,
    usual_parameters,
)
from hotlever.probe.prior_texts import Written, parsed
from hotlever.probe.shapes import EDGE_BIAS
from hotlever.records import Number

if TYPE_CHECKING:
    from hotlever.probe.probe import Probe

#: Relative spread of what the drawing says, and of a resistor that was measured.
_DIMENSIONS, RESISTANCE = 0.05, 1e-3
#: Of the base temperature (K): a room, or a hot plate and its thermocouple.
_BASE_K = 1.0
#: Of the exponent of the temperature in mobility limited by impurities: half of what it is without
#: screening, 1.5. The paper takes 0.
_IMPURITIES = 0.75
#: Of a tip, as far as it is stated: its height and half-angle, from a micrograph.
_TIP = 0.2
#: Of what air takes up: humidity, what is around, and dimensions as far as they matter to it.
_GAS = 0.1
#: Of the distance to a surface below.
_GAP = 0.1
#: Nominal doping is that good, where the probe file says no better (the makers' own tolerance).
_DOPING = 0.15
#: What is known of films of other materials: they differ from the bulk, and from each other.
_FILM = 0.2
#: Dimensions that do not matter to the tip.
_HARMLESS = ("reader_length_um", "reader_centre_um")
ALL_DIMENSIONS = "dimensions"
#: Scales of what is shown, and the observable that each belongs to.
SCALES = {"current_scale": "current", "reader_scale": "reader", "raman_scale": "tip"}
#: The share of a prior's variance below which nothing is told of it.
_LEAST_TOLD = 1e-3
#: Relative spreads that mean something.
_LEAST, _MOST, _LARGEST_SHARE = 1e-6, 10.0, 0.5
#: The standard deviation of a logarithm from which on it is said as a factor: up and down are as
#: far only by that.
_AS_A_FACTOR = 0.4


@dataclass(frozen=True)
class Prior:
    """A normal distribution of a parameter, or of its logarithm.

    Attributes
    ----------
    value : float
    spread : float
        Standard deviation: relative (of the logarithm), or in the parameter's unit.
    relative : bool
        Whether the logarithm is normal, of what is known to a share or to a factor.

    Examples
    --------
    >>> Prior(400.0, 0.05).deviation(420.0) < 1.0
    True
    >>> to_a_factor = Prior(1e17, math.log(3.0))
    >>> round(to_a_factor.deviation(3e17), 6), round(to_a_factor.deviation(1e17 / 9), 6)
    (1.0, -2.0)
    """

    value: float
    spread: float
    relative: bool = True

    @property
    def absolute(self) -> float:
        """The spread in the parameter's unit, of small changes."""
        return self.spread * (self.value if self.relative else 1.0)

    def at(self, deviation: float) -> float:
        """Return the value so many standard deviations away; the inverse of `deviation`."""
        away = self.spread * deviation
        return float(self.value * np.exp(away)) if self.relative else self.value + away

    def deviation(self, value: float) -> float:
        """Return how far a value is from the prior's, in standard deviations."""
        away = np.log(value / self.value) if self.relative else value - self.value
        return float(away) / self.spread

    def used(self, value: float, spread: float) -> PriorUse:
        """Return what data made of it, a value and a standard deviation in the parameter's unit."""
        distribution: Distribution = "log-normal" if self.relative else "normal"
        return PriorUse(self.value, self.absolute, value, spread, distribution)


#: Of a parameter, or of its logarithm.
Distribution = Literal["normal", "log-normal"]


@dataclass(frozen=True)
class PriorUse:
    """What a prior said and what the data made of it.

    Attributes
    ----------
    value, spread : float
        Before, in the parameter's unit.
    posterior_value, posterior_spread : float
        After.
    distribution : {"normal", "log-normal"}
        If log-normal, spread / value is the standard deviation of the logarithm.

    Examples
    --------
    >>> use = Prior(1e17, math.log(3.0)).used(3e17, 3e16)
    >>> use.stated, round(use.moved, 6), round(use.left, 3)
    ('1e+17 ×/ 3', 1.0, 0.091)
    """

    value: float
    spread: Annotated[float, Field(gt=0)]
    posterior_value: float
    posterior_spread: Number
    distribution: Distribution = "normal"

    @property
    def _by_logarithm(self) -> bool:
        return self.distribution == "log-normal" and self.value > 0 and self.posterior_value > 0

    @property
    def moved(self) -> float:
        """How far the data moved it, in standard deviations of the prior."""
        if self._by_logarithm:
            return math.log(self.posterior_value / self.value) * self.value / self.spread
        return (self.posterior_value - self.value) / self.spread

    @property
    def left(self) -> float:
        """The share of the prior's standard deviation that the data leave."""
        share = self.posterior_spread / self.spread
        return share * self.value / self.posterior_value if self._by_logarithm else share

    @property
    def stated(self) -> str:
        """What was known, in words: ``4e+17 ± 2e+16``, or ``1e+17 ×/ 3``."""
        if self._by_logarithm and self.spread > _AS_A_FACTOR * self.value:
            return f"{self.value:.4g} ×/ {math.exp(self.spread / self.value):.3g}"
        return f"{self.value:.4g} ± {self.spread:.2g}"


class Moved(NamedTuple):
    """How far data moved a parameter from its prior, in standard deviations of the prior.

    Attributes
    ----------
    size : float
    left : float
        Standard deviation that data and priors leave.
    """

    size: float
    left: float

    @property
    def told(self) -> float:
        """Share of the prior's variance that the data take away."""
        return 1.0 - self.left**2

    @property
    def pull(self) -> float:
        """How far the data and all other priors are from the prior, in joint standard deviations.

        Without it the sum of squares would be lower by the square of this.
        """
        return self.size / float(np.sqrt(max(self.told, _LEAST_TOLD)))


def nuisances(probe: Probe) -> list[str]:
    """Return the dimensions of the drawing that matter to the tip, each by itself."""
    held = (*_HARMLESS, EDGE_BIAS, *probe.shape.tied())
    return [name for name in probe.shape.dimensions() if name not in held]


def published_material() -> dict[str, Prior]:
    """Return what is known of the material of any lever: the published ones, and their scatter.

    Half as much again as that of the four levers, which are of one wafer.
    """
    return {name: Prior(*known) for name, known in PUBLISHED_SCATTER.items()}


def default_priors(probe: Probe, material: Mapping[str, Prior] | None = None) -> dict[str, Prior]:
    """Return what is known of a lever of which nothing but the probe file is known.

    Silicon scatters about the probe's as that of the published levers does, half as much again, and
    films of other materials within 20 %; mobility limited by impurities goes with a power of the
    temperature, 0 as in the paper within 0.75; the doping is nominal within 15 %, dimensions are
    within 5 %, those of a tip within 20 %, the series resistance within 0.1 %, the base temperature
    within 1 K; what air takes up and the gap to a surface below are known to 10 %. What is known of
    the material instead may be given; what the probe file states wins.
    """
    known = {name: prior.spread for name, prior in published_material().items()}
    known["n_d"] = _DOPING
    spreads = {name: known.get(own_name(name), _FILM) for name in usual_parameters(probe)}
    if probe.tip is not None:
        spreads |= dict.fromkeys(OF_THE_TIP, _TIP)
    spreads |= dict.fromkeys(nuisances(probe), _DIMENSIONS)
    if probe.circuit.series_resistance_ohm > 0:
        spreads["series_resistance_ohm"] = RESISTANCE
    if probe.surroundings.medium == "air":
        spreads["gas_conductivity"] = _GAS
        if probe.surroundings.surface_gap_um is not None:
            spreads["surface_gap_um"] = _GAP
    values = probe.values(list(spreads)).tolist()
    found = {
        name: Prior(value, float(spread))
        for (name, spread), value in zip(spreads.items(), values, strict=True)
        if value > 0
    }
    absolute = {"base_temperature_K": _BASE_K}
    absolute |= {
        name: _IMPURITIES for name in of_materials(probe) if own_name(name) == "impurity_exponent"
    }
    for name, spread in absolute.items():
        found[name] = Prior(float(probe.values([name])[0]), spread, relative=False)
    own = {name: prior for name, prior in (material or {}).items() if name in found}
    return found | own | priors_of(probe.stated_priors, probe, "[prior]")


def known_beforehand(probe: Probe, stated: Mapping[str, Prior | str] | None) -> dict[str, Prior]:
    """Return the usual priors, with those stated in their place; none at all for an empty mapping.

    Raises
    ------
    InputError
        See `priors_of`.
    """
    if stated is not None and not stated:
        return {}
    return default_priors(probe) | priors_of(stated or {}, probe, "priors")


def priors_of(
    stated: Mapping[str, Prior | str], probe: Probe, where: str, *, in_time: bool = False
) -> dict[str, Prior]:
    """Return priors of which some are written as text.

    What does not count in the probe's surroundings, or in time only, is left out.

    Raises
    ------
    InputError
        If a name does not exist (with the nearest that does) or a text is no prior.

    Examples
    --------
    >>> from hotlever import Probe
    >>> priors_of({"n_d": "3.3e17 ± 15%"}, Probe.reference(), "here")["n_d"]
    Prior(value=3.3e+17, spread=0.15, relative=True)
    """
    known, found = parameters_of(probe, anywhere=True), dict[str, Prior]()
    for name, text in stated.items():
        if name not in known and name not in (ALL_DIMENSIONS, *SCALES):
            raise unknown_name("prior", name, [*known, ALL_DIMENSIONS, *SCALES], where)
        if isinstance(text, Prior):
            found[name] = text
            continue
        value, spread, written = parsed(text, f"{where}: {name}")
        if name in (ALL_DIMENSIONS, *SCALES):
            _check_common(name, text, where, value is None, spread, written)
        if name in SCALES:
            found[name] = Prior(1.0, spread)
            continue
        if name == ALL_DIMENSIONS:
            if not probe.shape.outline_moves:
                raise InputError(
                    f"{where}: {name}: the outline of a drawing is taken as exact so far; expected "
                    "thickness_um alone"
                )
            # those that are named have their own
            some = [one for one in nuisances(probe) if one not in stated]
        else:
            some = [name]
        for one, own in zip(some, probe.values(some).tolist(), strict=True):
            found[one] = Prior(own if value is None else value, spread, written != "unit")
            _check(found[one], known[one], f"{where}: {one}", written)
    counting = parameters_of(probe, in_time=in_time)
    return {name: prior for name, prior in found.items() if name in counting or name in SCALES}


def _check_common(
    name: str, text: str, where: str, own: bool, spread: float, written: Written
) -> None:
    """Refuse what cannot be said of all dimensions, or of what an instrument shows."""
    as_share = written == "share" or (written == "factor" and name not in SCALES)
    if not (own and as_share and _LEAST <= spread <= _LARGEST_SHARE):
        raise InputError(
            f"{where}: {name} = '{text}', expected a share such as '± 5%', at most "
            f"{_LARGEST_SHARE:.0%}"
        )


def _check(prior: Prior, known: Parameter, where: str, written: Written) -> None:
    """Refuse a prior outside what a parameter can be, or with a spread that means nothing."""
    if written == "factor" and known.lower < 0:
        raise InputError(
            f"{where} may be negative: expected a spread in its unit such as '± "
            f"{abs(known.upper) / 10:g}', found a factor"
        )
    if not known.lower <= prior.value <= known.upper:
        raise InputError(
            f"{where} = {prior.value:g}, expected a value from {known.lower:g} to {known.upper:g} "
            f"{known.unit}"
        )
    if prior.relative and prior.value == 0:
        raise InputError(f"{where}: a relative spread needs a value above 0")
    share = prior.absolute / abs(prior.value or known.scale)
    if not _LEAST <= share <= _MOST:
        raise InputError(
            f"{where}: a spread of {share:.2g} times the value, expected {_LEAST:g} to {_MOST:g}"
        )
