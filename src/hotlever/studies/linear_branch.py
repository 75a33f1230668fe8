"""Is the tip temperature linear in the power above the knee? The paper's Eq. 12, on other levers.

The paper calls the linear relation robust, "observed in other lever structures and doping levels".
Here are levers of other dimensions, of two shapes, of other dopings of either type: each is solved,
and a straight line is fitted from its knee on. Two things bend the curve, and in opposite
directions: silicon conducts heat less the hotter it is, and the heater's share of the power falls
because its resistance does. Where heat arises in the heater alone, the tip rises by its power times

    R = (N_heater/8 + 1/(1/N_1 + 1/N_2)) / (κ t)

in the thickness t, where the squares (length over width) N are those of the heater, of the leg at
the supply, and of those behind the heater. That R, with κ at the temperature of the line's middle,
and the heater's share at the knee are what `slope_regression` explains the slope by.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.lever import Branch, Lever
from hotlever.lever.dataset import dataset_of_branch
from hotlever.lever.lever import COARSE, HOTTEST
from hotlever.materials.heat import thermal_conductivity
from hotlever.probe import Probe
from hotlever.probe.drawing import Drawing, Layer
from hotlever.probe.shapes import Shape, ThreeLeg, UShape
from hotlever.spieser2017 import HOTTEST_TIP_K, KNEE_PREDICTED_K
from hotlever.types import Array, Progress
from hotlever.units import PER_CM_TO_MILLI_PER_UM
from hotlever.work import each

#: How far above its knee (K) each lever is followed: as far as the paper's was.
SPAN_K = HOTTEST_TIP_K - KNEE_PREDICTED_K
#: How far (K) a line may be off where it is asked how far it reaches.
WITHIN_K = 10.0


@dataclass(frozen=True)
class BranchCase:
    """A lever of the study.

    Attributes
    ----------
    probe : Probe
    shape : Shape
        The parametric one that it has, however its probe describes it.
    dopant : str
        Of its heater, n or p.
    changed : str
        What it has not in common with the first lever of its shape and type.
    """

    probe: Probe
    shape: Shape
    dopant: str
    changed: str


def all_cases() -> dict[str, BranchCase]:
    """Return the levers of the study by what is changed."""
    # single dimensions (µm) and parameters in place of the shape's own
    varied = {
        "heater_length_um": (3.0, 3.5, 5.0, 6.0),
        "heater_width_um": (1.0, 2.3, 3.0),
        "length_um": (30.0, 100.0),
        "centre_leg_width_um": (3.0, 12.0),
        "outer_leg_width_um": (2.0, 8.0),
        "leg_width_um": (3.0, 12.0),
        "bridge_width_um": (2.5, 6.0),
        "gap_um": (5.0, 10.0),
        "thickness_um": (0.2,),
        "n_d": (1e17, 2e17, 1e18, 2e18),
        "delta": (0.3, 0.5, 0.75),
    }
    cases = {}
    for start in (Probe.reference(), Probe.u_shape()):
        name = start.shape.shape
        cases[name] = BranchCase(start, start.shape, "n", "")
        fields = {*type(start.shape).model_fields, "n_d", "delta"}
        for key in (key for key in varied if key in fields):
            for value in varied[key]:
                probe = start.with_(**{key: value})
                cases[f"{name}, {key} = {value:g}"] = BranchCase(probe, probe.shape, "n", key)
        for n_a in (1e17, 2e17, 5.75e17, 1e18, 2e18):
            probe = with_heater_of(start, kind="p-silicon", n_d=n_a)
            cases[f"{name}, boron {n_a:g}"] = BranchCase(probe, start.shape, "p", "n_d")
    return cases


def with_heater_of(probe: Probe, **material: Any) -> Probe:
    """Return a lever drawn as some probe is, whose heater is of another material."""
    layout = probe.layout()
    drawing = Drawing.of_layout(layout)
    heater = {"heater": Layer(layout.heater.outline, "other")}
    whole = {"silicon": drawing.layers["silicon"]}
    return Probe.from_drawing(replace(drawing, layers=whole | heater), {"other": material})


def squares(shape: Shape) -> float:
    """Return R κ t of a shape, see the head of this module.

    Examples
    --------
    >>> round(squares(ThreeLeg.reference()), 2), round(squares(UShape.reference()), 2)
    (4.24, 5.64)
    """
    if isinstance(shape, ThreeLeg):
        behind = shape.bridge_width_um + shape.heater_length_um
        first = (shape.length_um - behind) / shape.centre_leg_width_um
        across = (shape.centre_leg_width_um + shape.outer_leg_width_um) / 2 + shape.gap_um
        along = shape.length_um - shape.bridge_width_um / 2
        # both outer legs take up heat, the one without a current too
        second = (along / shape.outer_leg_width_um + across / shape.bridge_width_um) / 2
    elif isinstance(shape, UShape):
        along = shape.length_um - shape.bridge_width_um / 2
        bar = (shape.gap_um - shape.heater_length_um + shape.leg_width_um) / 2
        first = second = along / shape.leg_width_um + bar / shape.bridge_width_um
    else:
        raise TypeError(f"found {type(shape).__name__}, expected ThreeLeg or UShape")
    heater = shape.heater_length_um / shape.heater_width_um
    return float(heater / 8 + first * second / (first + second))


@dataclass(frozen=True)
class BranchLine:
    """A straight line T = T_base + offset + slope P by least squares, over even temperatures.

    Attributes
    ----------
    offset_K, slope_K_per_mW : float
    off_K : float
        Largest distance of the curve from it.
    """

    offset_K: float
    slope_K_per_mW: float
    off_K: float

    @classmethod
    def of(
        cls, branch: Branch, coldest_K: float, hottest_K: float, *, offset: bool = True
    ) -> BranchLine:
        """Fit a line to a branch; without an offset it passes through the base temperature."""
        tip = np.linspace(coldest_K, hottest_K, 60)
        power, rise = branch.power(tip), tip - branch.base_temperature_K
        columns = np.stack([np.full(tip.size, float(offset)), power], axis=1)
        coefficients = np.linalg.lstsq(columns, rise, rcond=None)[0]
        off = np.abs(rise - columns @ coefficients).max()
        return cls(float(coefficients[0]), float(coefficients[1]), float(off))


def reach(branch: Branch, coldest_K: float) -> float:
    """Return how far (K) above a temperature a line stays within `WITHIN_K` of the branch."""
    reached, longest = 0.0, min(branch.hottest_K, HOTTEST) - coldest_K
    for length in [*np.arange(10.0, longest, 10.0).tolist(), longest]:
        if BranchLine.of(branch, coldest_K, coldest_K + length).off_K > WITHIN_K:
            break
        reached = length
    return reached


def linear_branch_study(
    cases: Mapping[str, BranchCase], *, progress: Progress | None = None
) -> xr.Dataset:
    """Fit lines to levers above their knees, and find what their slopes may depend on.

    Parameters
    ----------
    cases : mapping of str to BranchCase
        Of `all_cases`.
    progress : callable, optional
        Called with the levers done and their number.

    Returns
    -------
    xarray.Dataset
        On ``case``: ``knee_K`` (NaN where V_l rises until the end, as is all that follows),
        ``end_K``, to where the line is fitted; its ``slope_K_per_mW``, ``offset_K`` and
        ``straight_K``, how far the branch is from it; ``proportional_K``, how far from the best
        line through the base temperature; ``reach_K``, how far above the knee a line stays within
        `WITHIN_K`; ``slope_ratio``, dT/dP at the end over that
        at the knee, and ``kappa_ratio``, the same of κ_Si; ``resistance_K_per_mW``, R;
        ``knee_share`` and ``end_share``, the heater's of the power. As coordinates ``shape``,
        ``dopant`` and ``changed`` of each `BranchCase`.
    """
    rows = [_row(case) for case in each(cases.values(), progress)]
    names = max(rows, key=len)
    columns = {name: [row.get(name, np.nan) for row in rows] for name in names}
    coordinates = {
        "case": list(cases),
        "shape": ("case", [case.shape.shape for case in cases.values()]),
        "dopant": ("case", [case.dopant for case in cases.values()]),
        "changed": ("case", [case.changed for case in cases.values()]),
    }
    return labelled(columns, "case", coordinates)


def _row(case: BranchCase) -> dict[str, float]:
    branch = Lever(case.probe, COARSE).branch()
    if branch.knee is None:
        return {"knee_K": np.nan}
    knee = branch.knee.tip_K
    end = min(knee + SPAN_K, branch.hottest_K, HOTTEST)
    line, ends = BranchLine.of(branch, knee, end), np.array([knee, end])
    silicon, across = case.probe.heater_silicon, np.array([knee, (knee + end) / 2, end])
    conducted, _ = (
        thermal_conductivity(across)
        if silicon is None
        else silicon.thermal_conductivity(across, case.probe.layout().thickness_um)
    )
    slopes = branch.by_power.slope(branch.power(ends))
    parts = dataset_of_branch(case.probe, branch, branch.u_at(ends))
    shares = (parts.heater_ohm / (parts.heater_ohm + parts.legs_ohm)).values
    thickness = PER_CM_TO_MILLI_PER_UM * conducted[1] * case.probe.layout().thickness_um
    return {
        "knee_K": knee,
        "end_K": end,
        "slope_K_per_mW": line.slope_K_per_mW,
        "offset_K": line.offset_K,
        "straight_K": line.off_K,
        "proportional_K": BranchLine.of(branch, knee, end, offset=False).off_K,
        "reach_K": reach(branch, knee),
        "slope_ratio": float(slopes[1] / slopes[0]),
        "kappa_ratio": float(conducted[2] / conducted[0]),
        "resistance_K_per_mW": squares(case.shape) / float(thickness),
        "knee_share": float(shares[0]),
        "end_share": float(shares[1]),
    }


@dataclass(frozen=True)
class Regression:
    """Least squares of the logarithm of a slope on those of what explains it.

    Attributes
    ----------
    exponents : dict of str to float
        Of the explaining columns.
    factor : float
        What their product is multiplied by.
    determination : float
        R², the share of the variance that is explained.
    scatter : float
        Standard deviation of what is left, relative.
    """

    exponents: dict[str, float]
    factor: float
    determination: float
    scatter: float


def slope_regression(
    study: xr.Dataset, names: tuple[str, ...] = ("resistance_K_per_mW", "knee_share")
) -> Regression:
    """Explain the slopes of a study by some of its columns."""
    solved = study.isel(case=study.slope_K_per_mW.notnull().values)
    logarithms: list[Array] = [np.log(solved[name].values) for name in names]
    slope = np.log(solved.slope_K_per_mW.values)
    columns = np.stack([np.ones(slope.size), *logarithms], axis=1)
    (constant, *exponents), *_ = np.linalg.lstsq(columns, slope, rcond=None)
    left = slope - columns @ np.array([constant, *exponents])
    return Regression(
        dict(zip(names, map(float, exponents), strict=True)),
        float(np.exp(constant)),
        float(1.0 - left.var() / slope.var()),
        float(np.sqrt(left @ left / (slope.size - columns.shape[1]))),
    )
