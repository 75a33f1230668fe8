"""What is known of a lever before it is measured: a value and a spread for each parameter.

In the section ``[prior]`` of a probe file or on the command line it is a value with a spread in its
unit, ``0.40 ± 0.02``; with a share, ``3.3e17 ± 15%``; or with a factor, ``1e17 ×/ 3``. Without a
value, ``± 5%`` or ``×/ 3``, it is about the probe's own. ``+-`` stands for ``±``, ``x/`` and ``*/``
for ``×/``. A share is a standard deviation of the logarithm, and so is the logarithm of a factor.

The name ``dimensions`` means all of the drawing and the thickness. ``law.kappa`` and the like mean
a law: ``± 10%`` is the standard deviation of its departure at 1000 K
(`hotlever.materials.departures`), and ``exact`` that it holds to the letter; ``laws`` means all of
them, ``uncertain`` as is usual, or the ``paper``'s. The scales of meters and of the
Raman thermometer have priors too, shares such as ``± 2%``: by so much all that they show may be
wrong together.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple, TypeVar

import numpy as np
from pydantic import Field

from hotlever.errors import InputError, unknown_name
from hotlever.materials.departures import DEPARTURES
from hotlever.materials.parameters import Parameter, own_name
from hotlever.probe.parts import ProbeParts
from hotlever.probe.probe_parameters import nuisances, of_materials, parameters_of
from hotlever.probe.shapes import EDGE_BIAS
from hotlever.quantities import METERS, OBSERVABLES, THERMOMETER
from hotlever.records import StandardError
from hotlever.spieser2017 import PUBLISHED_SCATTER
from hotlever.text import with_unit

#: All laws that have a spread, and the parameters by which they depart. The last two have no shape
#: of their own: what is around a lever, and how its heat capacity is measured, move them as a whole
#: by more than published curves differ in shape.
LAWS = {law: tuple(departure.names) for law, departure in DEPARTURES.items()} | {
    "air": ("gas_conductivity",),
    "heat_capacity": ("heat_capacity_scale",),
}
#: Scales of what is shown, and the observable that each belongs to.
SCALES = {row.scale: observable for observable, row in OBSERVABLES.items() if row.scale}
#: Their standard deviations where nothing is said, relative.
USUAL_SCALES = {
    scale: THERMOMETER if OBSERVABLES[observable].is_temperature else METERS
    for scale, observable in SCALES.items()
}
ProbesParts = TypeVar("ProbesParts", bound=ProbeParts)
#: How a spread is written: in the parameter's unit, as a share of its value, or as a factor.
Written = Literal["unit", "share", "factor"]


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
        distribution: Literal["normal", "log-normal"] = "log-normal" if self.relative else "normal"
        return PriorUse(self.value, self.absolute, value, spread, distribution)


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
    >>> use.stated, round(use.shift, 6), round(use.spread_ratio, 3)
    ('1e+17 ×/ 3', 1.0, 0.091)
    """

    value: float
    spread: Annotated[float, Field(gt=0)]
    posterior_value: float
    posterior_spread: StandardError
    distribution: Literal["normal", "log-normal"] = "normal"

    @property
    def _by_logarithm(self) -> bool:
        return self.distribution == "log-normal" and self.value > 0 and self.posterior_value > 0

    @property
    def shift(self) -> float:
        """How far the data moved it, in standard deviations of the prior."""
        if self._by_logarithm:
            return math.log(self.posterior_value / self.value) * self.value / self.spread
        return (self.posterior_value - self.value) / self.spread

    @property
    def spread_ratio(self) -> float:
        """The share of the prior's standard deviation that the data leave."""
        share = self.posterior_spread / self.spread
        return share * self.value / self.posterior_value if self._by_logarithm else share

    @property
    def stated(self) -> str:
        """What was known, in words: ``4e+17 ± 2e+16``, or ``1e+17 ×/ 3``."""
        # up and down are as far only by a factor
        if self._by_logarithm and self.spread > 0.4 * self.value:
            return f"{self.value:.4g} ×/ {math.exp(self.spread / self.value):.3g}"
        return f"{self.value:.4g} ± {self.spread:.2g}"


def of_share(value: float, share: float) -> Prior:
    """Return what is known to a share: of the logarithm, or of the size of a negative value.

    Examples
    --------
    >>> of_share(-1e-4, 0.2)
    Prior(value=-0.0001, spread=2e-05, relative=False)
    """
    return Prior(value, share) if value >= 0 else Prior(value, share * -value, relative=False)


class PriorShift(NamedTuple):
    """How far data moved a parameter from its prior, in standard deviations of the prior.

    Attributes
    ----------
    size : float
    spread_ratio : float
        Standard deviation that data and priors leave, over the prior's.
    """

    size: float
    spread_ratio: float

    @property
    def contraction(self) -> float:
        """Share of the prior's variance that the data take away."""
        return 1.0 - self.spread_ratio**2

    @property
    def pull(self) -> float:
        """How far the data and all other priors are from the prior, in joint standard deviations.

        Without it the sum of squares would be lower by the square of this.
        """
        # below this share of a prior's variance nothing is told of it
        return self.size / float(np.sqrt(max(self.contraction, 1e-3)))


def published_material() -> dict[str, Prior]:
    """Return what is known of the material of any lever: the published ones, and their scatter."""
    return {name: Prior(*scatter) for name, scatter in PUBLISHED_SCATTER.items()}


def default_priors(
    probe: ProbeParts, material: Mapping[str, Prior] | None = None
) -> dict[str, Prior]:
    """Return what is known of a lever of which nothing but the probe file is known.

    That are the spreads of `hotlever.materials.parameters` and `hotlever.probe.probe_parameters`
    about the probe's values, materials first, and what is known in the parameter's unit last. What
    is known of the material instead may be given; what the probe file states wins.
    """
    materials, table = of_materials(probe), parameters_of(probe)
    priors = {
        name: of_share(parameter.value, parameter.spread)
        if parameter.relative
        else Prior(parameter.value, parameter.spread, relative=False)
        for name, parameter in table.items()
        if parameter.spread is not None and (parameter.value != 0 or not parameter.relative)
    }
    in_units = {name: name in materials for name, prior in priors.items() if not prior.relative}
    order = sorted(priors, key=lambda name: (name in in_units, in_units.get(name, False)))
    usual = {name: priors[name] for name in order}
    own = {name: prior for name, prior in (material or {}).items() if name in usual}
    return updated(usual | own, probe.stated_priors, probe, "[prior]")


def known_beforehand(
    probe: ProbeParts, stated: Mapping[str, Prior | str] | None
) -> dict[str, Prior]:
    """Return the usual priors, with those stated in their place; none at all for an empty mapping.

    Raises
    ------
    InputError
        See `priors_of`.
    """
    if stated is not None and not stated:
        return {}
    return updated(default_priors(probe), stated or {}, probe, "priors")


def updated(
    priors: Mapping[str, Prior],
    stated: Mapping[str, Prior | str],
    probe: ProbeParts,
    where: str,
    *,
    in_time: bool = False,
) -> dict[str, Prior]:
    """Return priors with those stated in their place, and without those of laws that are exact.

    Raises
    ------
    InputError
        See `priors_of`.
    """
    anew = priors_of(stated, probe, where, in_time=in_time)
    exact = {name.removeprefix("law.") for name, text in stated.items() if text == "exact"}
    if "laws" in stated:
        exact |= DEPARTURES.keys()
    names = {name for law in exact for name in _names_of_law(law, probe)}
    return {name: prior for name, prior in priors.items() if name not in names} | anew


def draw_values(priors: Mapping[str, Prior], rng: np.random.Generator) -> dict[str, float]:
    """Return a value from each of some priors, independent of each other, by name."""
    return {name: prior.at(float(rng.standard_normal())) for name, prior in priors.items()}


def as_known(probe: ProbesParts, stated: Mapping[str, Prior | str] | None) -> ProbesParts:
    """Return a probe as far as its priors say more than its file: on a chip as is usual.

    Not where priors are none, or laws the paper's, whose leg ends stay at the base temperature.
    """
    texts = {**probe.stated_priors, **(stated or {})}
    nothing = stated is not None and not stated
    if probe.circuit.chip_K_per_mW or nothing or texts.get("laws") == "paper":
        return probe
    return probe.replace({"chip_K_per_mW": probe.usual_chip_K_per_mW})


def is_of_laws(name: str) -> bool:
    """Return whether a prior is of a law, or of all."""
    return name == "laws" or name.startswith("law.")


def priors_of(
    stated: Mapping[str, Prior | str], probe: ProbeParts, where: str, *, in_time: bool = False
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
    table, priors = parameters_of(probe, anywhere=True), dict[str, Prior]()
    if "laws" in stated:
        priors |= _of_all_laws(stated["laws"], probe, f"{where}: laws")
    for name, text in stated.items():
        here = f"{where}: {name}"
        if is_of_laws(name):
            if name != "laws":
                priors |= _of_law(name.removeprefix("law."), text, probe, here)
            continue
        if name not in table and name not in ("dimensions", *SCALES):
            others = [*table, "dimensions", "laws", *(f"law.{law}" for law in LAWS), *SCALES]
            raise unknown_name("prior", name, others, where)
        if isinstance(text, Prior):
            priors[name] = text
        elif name in SCALES:
            priors[name] = Prior(1.0, share_of(text, here))
        elif name == "dimensions":
            spread = share_of(text, here, ("share", "factor"))
            if not probe.shape.outline_moves:
                shifts = [own for own in probe.shape.dimensions() if own_name(own) == EDGE_BIAS]
                raise InputError(
                    f"{here}: edges of a drawing are off by a length, not by a share; expected "
                    f"thickness_um = '{text}', and a spread such as '± 0.1' of {', '.join(shifts)}"
                )
            # those that are named have their own
            unnamed = [dimension for dimension in nuisances(probe) if dimension not in stated]
            priors |= {dimension: Prior(table[dimension].value, spread) for dimension in unnamed}
        else:
            value, spread, written = parsed(text, here)
            own = table[name].value if value is None else value
            is_share = written == "share"
            priors[name] = (
                of_share(own, spread) if is_share else Prior(own, spread, written != "unit")
            )
            _check(priors[name], table[name], here, written)
    counting = parameters_of(probe, in_time=in_time)
    return {name: prior for name, prior in priors.items() if name in counting or name in SCALES}


def _names_of_law(law: str, probe: ProbeParts) -> list[str]:
    """Return the parameters by which a law departs in a probe."""
    return [name for name in parameters_of(probe, anywhere=True) if own_name(name) in LAWS[law]]


def _of_all_laws(text: Prior | str, probe: ProbeParts, where: str) -> dict[str, Prior]:
    """Return the priors of all departures: as is usual, or none."""
    if text not in ("paper", "uncertain"):
        raise unknown_name("choice", str(text), ("paper", "uncertain"), where)
    names = [name for law in DEPARTURES for name in _names_of_law(law, probe)]
    # of the coefficients of a departure, by which its spread is as published
    return dict.fromkeys(names, Prior(0.0, 1.0, relative=False)) if text == "uncertain" else {}


def _of_law(law: str, text: Prior | str, probe: ProbeParts, where: str) -> dict[str, Prior]:
    """Return the priors by which a law is as uncertain as a text says."""
    if law not in LAWS:
        raise unknown_name("law", law, LAWS, where.removesuffix(f": law.{law}"))
    if text == "exact":
        return {}
    share = share_of(str(text), where, ("share", "factor"))
    if law not in DEPARTURES:
        own = _names_of_law(law, probe)
        return {
            name: Prior(value, share)
            for name, value in zip(own, probe.values(own).tolist(), strict=True)
        }
    spread = share / DEPARTURES[law].spread_hot
    prior = Prior(0.0, spread, relative=False)
    return dict.fromkeys(_names_of_law(law, probe), prior)


def share_of(text: str, where: str, allowed: tuple[Written, ...] = ("share",)) -> float:
    """Return the spread of all dimensions, or of what an instrument shows, about what it is.

    Raises
    ------
    InputError
        If it is no such share; `where` names it.

    Examples
    --------
    >>> share_of("± 1.5 %", "here")
    0.015
    """
    value, spread, written = parsed(text, where)
    if not (value is None and written in allowed and 1e-6 <= spread <= 0.5):
        raise InputError(f"{where} = '{text}', expected a share such as '± 5%', at most 50%")
    return spread


def _check(prior: Prior, parameter: Parameter, where: str, written: Written) -> None:
    """Refuse a prior outside what a parameter can be, or with a spread that means nothing."""
    if written == "factor" and parameter.lower < 0:
        raise InputError(
            f"{where} may be negative: expected a spread in its unit such as '± "
            f"{abs(parameter.upper) / 10:g}', found a factor"
        )
    if not parameter.lower <= prior.value <= parameter.upper:
        raise InputError(
            f"{where} = {prior.value:g}, expected a value from {parameter.lower:g} to "
            f"{with_unit(f'{parameter.upper:g}', parameter.unit)}"
        )
    if prior.relative and prior.value == 0:
        raise InputError(f"{where}: a relative spread needs a value above 0")
    share = prior.absolute / abs(prior.value or parameter.scale)
    if not 1e-6 <= share <= 10.0:
        raise InputError(f"{where}: a spread of {share:.2g} times the value, expected 1e-06 to 10")


def parsed(text: str, where: str) -> tuple[float | None, float, Written]:
    """Return value (None for the probe's own), spread, and how that is written.

    The spread of a factor is its logarithm.

    Raises
    ------
    InputError
        If it is no prior; `where` names it.

    Examples
    --------
    >>> parsed("0.40 ± 0.02", "here"), parsed("± 5%", "here")
    ((0.4, 0.02, 'unit'), (None, 0.05, 'share'))
    """
    wrong = InputError(
        f"{where} = '{text[:60]}', expected a value and its spread such as '3.3e17 ± 15%', "
        "'0.40 ± 0.02', '± 5%' or '1e17 ×/ 3'"
    )
    plus_minus = text.replace("+-", "±").replace("+/-", "±")
    match = re.fullmatch(r"([^±/]{0,40}?)(±|[×xX*] ?/)([^±/]{1,40})", plus_minus)
    if match is None:
        raise wrong
    first, sign, second = (part.strip() for part in match.groups())
    written: Written = "factor" if "/" in sign else "share" if second.endswith("%") else "unit"
    try:
        value = float(first) if first else None
        spread = float(second.removesuffix("%") if written == "share" else second)
    except ValueError:
        raise wrong from None
    if value is not None and not math.isfinite(value):
        raise wrong
    if written == "factor":
        if not 1.0 < spread <= 1000.0:
            raise InputError(
                f"{where} = '{text[:60]}': a factor of {spread:g}, expected one above 1 and at "
                "most 1000"
            )
        return value, math.log(spread), written
    if not 0 < spread < math.inf:
        raise wrong
    return value, spread / (100.0 if written == "share" else 1.0), written
