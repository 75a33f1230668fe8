"""The ensemble: layouts with weights, what each shows, and how the paper's statements fare in it.

What each layout shows is stored, as ``benchmarks/published_lever.py`` writes it. A layout after
drawn errors weighs as much as its length is likely, by either of two priors (`SIZES`), and as those
statements make it which have no derivatives and did not guide the search (`WEIGHED`).
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import Field

from hotlever import spieser2017 as paper
from hotlever.datasets import labelled
from hotlever.materials import PUBLISHED, published
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import Probe
from hotlever.records import Record
from hotlever.studies.published_lever.statements import OPTIONS, SEARCHED
from hotlever.types import Array

#: What the reference probe is called among them.
REFERENCE = "reference"
#: Where the data of this package are.
FOLDER = files("hotlever") / "studies" / "published_lever"


class CandidateLayout(Record):
    """One layout of the paper's lever."""

    name: str = Field(description="by its length, or by what it is")
    length_um: float = Field(gt=0)
    values: dict[str, float] = Field(
        description="other dimensions (µm), the resistor (Ω), and coefficients of laws that depart"
    )
    drawn: bool = Field(description="found after drawn errors: one of those that have a weight")
    square: float = Field(description="sum of squares of its search")

    def probe(self, option: str = next(iter(OPTIONS))) -> Probe:
        """Return the probe of it, with the silicon of a published option; see `OPTIONS`."""
        return probe_of(self.length_um, self.values, option)


def probe_of(length_um: float, values: Mapping[str, float], option: str) -> Probe:
    """Return the probe of a layout, with the silicon of a published option."""
    material = published(OPTIONS[option]).material
    return Probe.reference().with_(length_um=length_um, **values, **material.model_dump())


def reference(names: Iterable[str]) -> CandidateLayout:
    """Return the layout of the reference probe, by the names of its values."""
    probe = Probe.reference()
    values = dict(zip(names, probe.values(list(names)).tolist(), strict=True))
    length = probe.values(["length_um"]).item()
    return CandidateLayout(name=REFERENCE, length_um=length, values=values, drawn=False, square=0.0)


def stored_table(name: str, *keys: str) -> pd.DataFrame:
    """Return a table of numbers as ``benchmarks/published_lever.py`` writes it, by some columns."""
    with (FOLDER / name).open(encoding="utf-8") as file:
        return pd.read_csv(file, index_col=list(keys))


@cache
def stored_layouts() -> dict[str, CandidateLayout]:
    """Return the layouts by name: the reference, those that suit best, those after drawn errors."""
    stored: dict[str, Any] = tomllib.loads((FOLDER / "layouts.toml").read_text(encoding="utf-8"))
    found = [CandidateLayout.from_values(each, "layouts.toml") for each in stored["layout"]]
    return {each.name: each for each in [reference(found[0].values), *found]}


# --- weights -------------------------------------------------------------------------------------

#: How likely a length (µm) is, over how often it was drawn: any that fits into the air of the
#: paper's sphere, and only such that fit if the sphere has the tip in its middle.
SIZES: dict[str, Callable[[Array], Array]] = {
    "any size in the sphere of air": lambda length: np.ones_like(length),
    "sphere about the tip": lambda length: (length <= paper.SPHERE_UM).astype(float),
}
ANY = next(iter(SIZES))


class Weighed(NamedTuple):
    """A statement that did not guide the search: how far a layout is from it.

    Attributes
    ----------
    where, words : str
        As of `hotlever.studies.published_lever.statements.Printed`; ``{may}`` in the words is what
        it may be off by.
    off : callable
        How far a layout is from it, from its numbers.
    may : float
        What the statement may be off by, as it is printed. Of "about" and "approximately" that is
        half a unit of the digit that counts.
    counts : bool
        Whether it counts in the weight; not what is a dimension itself, or follows from the
        parameters alone.
    """

    where: str
    words: str
    off: Callable[[Mapping[str, float]], float]
    may: float
    counts: bool = True

    def deviation(self, found: Mapping[str, float]) -> float:
        """Return how far a layout is from it, in units of what it may be off by."""
        return self.off(found) / self.may


@cache
def _inversion_off_K() -> float:
    """Return the largest difference of a printed inversion temperature from ours (K)."""
    options = paper.INVERSION_TEMPERATURES_K
    ours = {name: PUBLISHED[name].material for name in options}
    return max(
        abs(float(inversion_temperature(material.n_d, material.p)) - options[name])
        for name, material in ours.items()
    )


WEIGHED: dict[str, Weighed] = {
    "legs at the knee": Weighed(
        "Section IV",
        f"the resistance of the legs raises the knee by about {paper.KNEE_BY_LEGS_K:.0f} K, "
        "± {may:.0f} K",
        lambda found: found["by_legs_K"] - paper.KNEE_BY_LEGS_K,
        5.0,
    ),
    "legs prevail": Weighed(
        "Section IV, Fig. 5",
        f"only above {paper.LEGS_PREVAIL_K:.0f} K is the resistance of the legs the larger one, "
        "to {may:.0f} K",
        lambda found: max(paper.LEGS_PREVAIL_K - found["legs_prevail_K"], 0.0),
        50.0,
    ),
    "option I mispredicts": Weighed(
        "Section I, Fig. 4c",
        f"above {paper.MISPREDICTED_FROM_K:.0f} K option I is up to {paper.MISPREDICTED_K:.0f} K "
        "off, ± {may:.0f} K",
        lambda found: found["tip_I_K"] - paper.MISPREDICTED_K,
        50.0,
    ),
    "heater halved": Weighed(
        "Fig. 7a",
        "diffusion leaves about half of the heater's length, ± {may:.0%}",
        lambda found: found["heater_left"] - 0.5,
        0.15,
    ),
    "one k": Weighed(
        "Section V, Fig. 10b",
        f"in air T follows Eq. 12 with P/{paper.K_IN_AIR} within {{may:.0f}} K",
        lambda found: found["eq12_air_K"],
        paper.POWER_LAW_SPREAD_K,
    ),
    "knee in air": Weighed(
        "Section V",
        f"the power of the knee in air is {paper.K_IN_AIR} P_th, to that of "
        f"{paper.POWER_LAW_SPREAD_K:.0f} K",
        lambda found: found["knee_air_mW"] / paper.K_IN_AIR - paper.POWER_LAW["threshold_mW"],
        paper.POWER_LAW_SPREAD_K / paper.POWER_LAW["hot_K_per_mW"],
    ),
    "inversion temperatures": Weighed(
        "Table I",
        "T_i follows from n_d and p, to {may} K",
        lambda found: _inversion_off_K(),
        0.5,
        counts=False,
    ),
    "thickness": Weighed(
        "Section II",
        f"the lever is nominally {paper.THICKNESS_UM} µm thick, to {{may}} µm",
        lambda found: found["thickness_um"] - paper.THICKNESS_UM,
        0.02,
        counts=False,
    ),
    "heater": Weighed(
        "Section II",
        f"the heater is {paper.HEATER_LENGTH_UM:.0f} µm long, to {{may}} µm",
        lambda found: found["heater_length_um"] - paper.HEATER_LENGTH_UM,
        0.5,
        counts=False,
    ),
    "sphere of air": Weighed(
        "Section V",
        f"the lever fits into {paper.SPHERE_UM:.0f} µm of radius",
        lambda found: found["length_um"],
        2.0 * paper.SPHERE_UM,
        counts=False,
    ),
    "errors of the parameters": Weighed(
        "Table I",
        "standard errors of each option are in these proportions, within a factor of 1.5",
        lambda found: np.log(max(found[f"errors_{option}"] for option in ("I", "II", "III"))),
        np.log(1.5),
        counts=False,
    ),
}


@dataclass(frozen=True)
class Ensemble:
    """All layouts with what they show.

    Attributes
    ----------
    numbers : xarray.Dataset
        On ``layout`` the columns of ``numbers.csv``, dimensions, and whether each was ``drawn``
        with errors and so has a weight.
    deviations : xarray.DataArray
        On ``layout`` and ``statement``: how far off, over what the statement may be off by.
    weights : xarray.DataArray
        On ``size``, of `SIZES`, and ``layout``: they add up to one.
    """

    numbers: xr.Dataset
    deviations: xr.DataArray
    weights: xr.DataArray

    @property
    def names(self) -> list[str]:
        """The layouts."""
        return [str(name) for name in self.numbers.layout.values]

    @property
    def nearest(self) -> str:
        """The layout that is nearest to all that was printed, by the sum of squares."""
        return min(self.best, key=lambda name: float(self._square.sel(layout=name)))

    @property
    def best(self) -> list[str]:
        """The layouts that suit best what guided the search, at their length."""
        return [name for name in self.names if name.startswith("best of")]

    @property
    def _square(self) -> xr.DataArray:
        counts = [each for each, statement in WEIGHED.items() if statement.counts]
        weighed = 3.0 * (self.deviations.sel(statement=counts) ** 2).sum("statement")
        return self.numbers.square + weighed

    def met(self, layout: str) -> int:
        """Return how many statements a layout meets."""
        return int((abs(self.deviations.sel(layout=layout)) <= 1.0).sum())

    def share(self, holds: xr.DataArray, size: str = ANY) -> float:
        """Return the weight of the layouts for which something holds, on ``layout``."""
        return float((self.weights.sel(size=size) * holds).sum())

    def range(self, column: str) -> tuple[float, float]:
        """Return the least and largest value among the layouts that have a weight."""
        values = self.numbers[column].where(self.numbers.drawn, drop=True)
        return float(values.min()), float(values.max())

    def mean(self, column: str, size: str = ANY) -> tuple[float, float]:
        """Return weighted mean and standard deviation of a column."""
        weights, values = self.weights.sel(size=size), self.numbers[column]
        mean = (weights * values).sum()
        return float(mean), float(np.sqrt((weights * (values - mean) ** 2).sum()))


@cache
def stored_ensemble() -> Ensemble:
    """Read the stored numbers, and weigh the layouts."""
    rows, found = stored_table("numbers.csv", "layout"), stored_layouts()
    all_numbers = {
        name: {**row, "length_um": found[name].length_um, **found[name].values}
        for name, row in rows.to_dict("index").items()
    }
    statements: dict[str, Callable[[Mapping[str, float]], float]] = {
        each.name: itemgetter(each.name) for each in SEARCHED
    }
    statements |= {name: each.deviation for name, each in WEIGHED.items()}
    deviations = xr.DataArray(
        [[float(of(numbers)) for of in statements.values()] for numbers in all_numbers.values()],
        coords={"layout": list(all_numbers), "statement": list(statements)},
    )
    columns = {
        name: [numbers[name] for numbers in all_numbers.values()]
        for name in next(iter(all_numbers.values()))
        if name not in statements
    }
    steps = {way: np.array(columns[f"by_{way}_K"]) for way in ("ends", "voltage", "doping")}
    columns["doping_share"] = (steps["doping"] / sum(steps.values())).tolist()
    columns["share_growth"] = np.divide(columns["share_hot"], columns["share_cold"]).tolist()
    for name in ("drawn", "square"):
        columns[name] = [getattr(found[layout], name) for layout in all_numbers]
    numbers = labelled(columns, "layout", {"layout": list(all_numbers)})
    return Ensemble(numbers, deviations, _weights(numbers, deviations))


def _weights(numbers: xr.Dataset, deviations: xr.DataArray) -> xr.DataArray:
    counts = [name for name, each in WEIGHED.items() if each.counts]
    square = (deviations.sel(statement=counts) ** 2).sum("statement")
    # half the width of a rectangle is √3 standard deviations
    by_statements = np.exp(-1.5 * (square - square.where(numbers.drawn).min())) * numbers.drawn
    rows = []
    for likely in SIZES.values():
        weight = by_statements * likely(numbers.length_um.values)
        rows.append((weight / weight.sum()).values)
    coordinates = {"size": list(SIZES), "layout": numbers.layout.values}
    return xr.DataArray(rows, coords=coordinates, dims=("size", "layout"))


# --- the paper's claims that depend on the layout -------------------------------------------------


class Criterion(NamedTuple):
    """A claim holds where a number lies between two limits.

    Attributes
    ----------
    column : str
        The number of a layout, in the ensemble.
    form : str
        How the number is written.
    unit : str
    least, most : float
    """

    column: str
    form: str
    unit: str = ""
    least: float = -np.inf
    most: float = np.inf

    def holds(self, value: float | xr.DataArray) -> bool | xr.DataArray:
        """Return whether a claim holds for a number, or where it does."""
        return (value > self.least) & (value < self.most)

    def written(self, value: float) -> str:
        """Return a number with its unit."""
        return f"{value:{self.form}}{self.unit}"


#: By the name of the claim.
CRITERIA: dict[str, Criterion] = {
    "operating_points": Criterion("points_off", ".2%", most=0.01),
    # the paper reads it off 25 points
    "simulated_knee": Criterion(
        "knee_K",
        ".0f",
        " K",
        least=paper.KNEE_PREDICTED_K - 10.0,
        most=paper.KNEE_PREDICTED_K + 10.0,
    ),
    "power_law": Criterion("eq12_K", ".0f", " K", most=paper.POWER_LAW_SPREAD_K),
    "legs_prevail": Criterion("legs_prevail_K", ".0f", " K", least=paper.LEGS_PREVAIL_K - 50.0),
    "heater_length": Criterion("heater_left", ".0%", least=0.35, most=0.65),
    # a part of the 25 K within which temperatures are described
    "knee_condition": Criterion("by_voltage_K", ".0f", " K", most=5.0),
    "knee_by_legs": Criterion(
        "by_legs_K", ".0f", " K", least=0.5 * paper.KNEE_BY_LEGS_K, most=1.5 * paper.KNEE_BY_LEGS_K
    ),
    "knee_by_doping": Criterion("doping_share", ".0%", least=0.75, most=1.25),
    # as large as it must be for the highest V_l to be that of another row
    "knee_misses": Criterion("ramp_up_current", ".2%", least=paper.CURRENT_ERROR),
    "dependent_parameters": Criterion("coupling_I", ".2f", least=0.8),
    "decoupled_groups": Criterion("coupling_III", ".2f", most=0.6),
    "current_alone": Criterion("tip_I_K", ".0f", " K", least=paper.POWER_LAW_SPREAD_K),
    "doping_held": Criterion("tip_n_d_held_K", ".0f", " K", most=paper.POWER_LAW_SPREAD_K),
    "one_factor": Criterion("eq12_air_K", ".0f", " K", most=paper.POWER_LAW_SPREAD_K),
    "constant_share": Criterion("share_growth", ".2f", "-fold", least=0.9, most=1.1),
    "factor_of_the_knee": Criterion("k_by_knee_K", ".0f", " K", most=paper.POWER_LAW_SPREAD_K),
    "one_sided": Criterion("one_sided_K", ".0f", " K", most=paper.POWER_LAW_SPREAD_K),
    "linear_branch": Criterion("straight_K", ".0f", " K", most=paper.POWER_LAW_SPREAD_K),
    "proportional_branch": Criterion("proportional_K", ".0f", " K", most=paper.POWER_LAW_SPREAD_K),
    "missing_tip": Criterion("tip_carries_K", "+.2f", " K", least=0.75 * paper.KNEE_OFF_K),
    "tip_in_air": Criterion("tip_in_air_K", "+.2f", " K", least=0.75 * paper.KNEE_OFF_K),
    "thermoelectric_size": Criterion("shift_nm", ".0f", " nm", most=paper.SHIFT_NM),
    "thermoelectric_direction": Criterion("shift_along_nm", "+.0f", " nm", least=0.0),
    "thermoelectric_prediction": Criterion(
        "without_heat_carried_K", ".1f", " K", most=paper.POWER_LAW_SPREAD_K
    ),
    "radiation": Criterion("radiated_share", ".2%", most=1e-3),
}


def verdict_on(name: str, found: Ensemble | None = None) -> tuple[str, str]:
    """Return the verdict on a claim, by the weight of the layouts for which it holds.

    Returns
    -------
    words : str
    range : str
        Of its number over the layouts.
    """
    found = found or stored_ensemble()
    criterion = CRITERIA[name]
    holds = criterion.holds(found.numbers[criterion.column])
    assert isinstance(holds, xr.DataArray)
    least, *_, most = sorted(found.share(holds, size) for size in SIZES)
    # so much of the weight is as good as all of it, or none
    if least >= 0.95:
        words = "holds"
    elif most <= 0.05:
        words = "does not hold"
    elif f"{least:.0%}" == f"{most:.0%}":
        words = f"holds for some layouts ({most:.0%} of the weight)"
    else:
        words = f"holds for some layouts ({least:.0%} to {most:.0%} of the weight)"
    low, high = map(criterion.written, found.range(criterion.column))
    return (words, low if low == high else f"{low.removesuffix(criterion.unit)} to {high}")
