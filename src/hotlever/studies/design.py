"""What a change of design does: knee, tip temperature and loss to air against any dimension."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from hotlever.datasets import frame_text, labelled
from hotlever.errors import HotleverError, unknown_name
from hotlever.lever import Lever
from hotlever.materials import LOW_DOPED, full_name
from hotlever.materials.parameters import parameter_named
from hotlever.materials.silicon import diffusion_length
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.shapes import EDGE_BIAS
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S
from hotlever.types import Array, Progress
from hotlever.work import each

#: What follows from a design; k is the power of the knee in air over that in vacuum.
QUANTITIES = (
    *("knee_K", "inversion_K", "knee_mW", "knee_V", "knee_mA"),
    *("knee_bias_V", "tip_K", "cold_ohm", "k"),
)
#: Names beside those of a probe file, and what they are.
ANNEALING = {
    "annealing_K": "temperature of the annealing",
    "annealing_min": "time of the annealing",
}
#: Between the coarse and the default mesh, for differences between levers.
DESIGN_MESH = MeshOptions(corner=0.1, heater=0.35, lever=0.15, panels=0.6)
_NO_KNEE = "no knee: the lever voltage rises until something melts"


@dataclass(frozen=True)
class Design:
    """A probe, and how it was annealed.

    Attributes
    ----------
    probe : Probe
    annealing_K, annealing_min : float
        Of the probe's Δ, so that a change of either scales it.
    """

    probe: Probe
    annealing_K: float = ANNEALING_K
    annealing_min: float = ANNEALING_S / 60.0

    def value(self, name: str) -> float:
        """Return a value by its name.

        Raises
        ------
        InputError
            If there is none; the text gives the nearest one.
        """
        numbers, own = self.numbers, self.probe.shape.named(name)
        if own not in numbers:
            raise unknown_name("name", name, numbers)
        return numbers[own]

    @property
    def numbers(self) -> dict[str, float]:
        """All that can be varied, by name: the numbers of the probe file, and the annealing."""
        shape = self.probe.shape
        fixed, numbers = (*shape.read_with, "tolerance_um"), dict(shape.dimensions())
        for section, entries in self.probe.sections().items():
            for key, entry in entries.items():
                if isinstance(entry, Mapping):
                    # a material's name is enough, a layer or a contact has its section before it
                    start = key if section == "materials" else f"{section}.{key}"
                    numbers |= {
                        f"{start}.{name}": value
                        for name, value in entry.items()
                        # edges of a layer are dimensions, with its name alone before them
                        if _number(value) and (section, name) != ("layers", EDGE_BIAS)
                    }
                elif _number(entry) and key not in fixed:
                    numbers[key] = float(entry)
        return numbers | {name: getattr(self, name) for name in ANNEALING if self._is_annealed}

    @property
    def usual(self) -> tuple[str, ...]:
        """What a designer asks for first: of a drawing, its dimensions or what it has for them."""
        names = self.numbers
        heater = self.probe.layout().heater.stack
        of_heater = [
            full_name(film.material, own) for film in heater for own in ("n_d", "resistivity")
        ]
        thickness = [name for name in names if name.startswith("layers.")]
        shape = self.probe.shape
        own = shape.dimensions() if shape.shape == "parametric-drawing" else ()
        of_shape = ("heater_length_um", "heater_width_um", "scale", "thickness_um")
        first = (*own, *of_shape, *thickness, *of_heater, *ANNEALING)
        # a share of what is zero is nothing
        return tuple(name for name in dict.fromkeys(first) if names.get(name))

    @property
    def _is_annealed(self) -> bool:
        """Whether dopant of the silicon of ``[material]`` diffuses anywhere."""
        return any(
            region.taper is not None and region.material == LOW_DOPED
            for region in self.probe.layout().regions
        )

    def changed(self, values: Mapping[str, float]) -> Probe:
        """Return the probe with some values changed.

        The diffusion length follows the annealing as Δ = 2 √(D t_a) does, from the probe's Δ at
        the design's own annealing: the law's ± 40 % in D does not enter.

        Raises
        ------
        InputError
            If a name does not exist, or no such probe can be made.
        """
        for name in values:
            self.value(name)
        annealing: Any = {name: value for name, value in values.items() if name in ANNEALING}
        probe = self.probe.with_(**{name: values[name] for name in values.keys() - annealing})
        if not annealing:
            return probe
        before, after = (
            diffusion_length(design.annealing_K, 60.0 * design.annealing_min)
            for design in (self, replace(self, **annealing))
        )
        return probe.with_(delta=probe.material.delta * float(after / before))


def _number(entry: Any) -> bool:
    return type(entry) in (int, float)


def quantities(
    probe: Probe, power_mW: float, air: bool, mesh: MeshOptions | None = DESIGN_MESH
) -> dict[str, float]:
    """Return the `QUANTITIES` of a probe; k is NaN without air, the knee's where there is none.

    Parameters
    ----------
    probe : Probe
    power_mW : float
        Power (mW) in vacuum at which the tip temperature is given.
    air : bool
        Solve the lever in air too, for k.
    mesh : MeshOptions, optional
        That of designs, which are compared; None is that of a sweep.
    """
    lever = Lever(probe.in_medium("vacuum"), mesh)
    vacuum = lever.branch_past_knee()
    if vacuum.by_power.highest_mW < power_mW:
        vacuum = lever.branch()
    silicon, knee = probe.heater_silicon, vacuum.knee
    # √(T_tip − T_base) (K^½) of a lever that is called cold
    cold = vacuum.point(0.5)
    values = dict.fromkeys(QUANTITIES, float("nan"))
    if silicon is not None:
        values["inversion_K"] = float(silicon.inversion_temperature())
    values["tip_K"] = float(vacuum.tip_temperature(power_mW))
    values["cold_ohm"] = 1000.0 * cold.lever_V / cold.current_mA
    if knee is None:
        return values
    values |= {"knee_K": knee.tip_K, "knee_mW": knee.power_mW}
    values |= {"knee_V": knee.lever_V, "knee_mA": knee.current_mA}
    values["knee_bias_V"] = probe.circuit.bias(knee.lever_V, knee.current_mA)
    in_air = lever.in_medium("air").branch_past_knee().knee if air else None
    if in_air is not None:
        values["k"] = in_air.power_mW / knee.power_mW
    return values


def vary(
    design: Design,
    values: Mapping[str, Sequence[float] | Array],
    *,
    power_mW: float = 2.0,
    air: bool = True,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Solve a design for several values of some of its numbers, each with each.

    Parameters
    ----------
    design : Design
    values : mapping of str to sequence of float
        By name: a key of the probe file, or of `ANNEALING`.
    power_mW, air
        See `quantities`.
    progress : callable, optional

    Returns
    -------
    xarray.Dataset
        `QUANTITIES` on a dimension for each name, and ``reason``: why such a probe cannot be made
        or solved, or has no knee; empty if it can and has.

    Raises
    ------
    InputError
        If a name does not exist.
    HotleverError
        If none of the designs can be made and solved: the error of the first.
    """
    design.probe.circuit.need_cold_start("a study of a design")
    base = {name: design.value(name) for name in values}
    coordinates = {name: np.asarray(each, dtype=float) for name, each in values.items()}
    shape = tuple(each.size for each in coordinates.values())
    rows, reasons, errors = [], [], []
    for combination in each(list(product(*coordinates.values())), progress):
        chosen = dict(zip(coordinates, map(float, combination), strict=True))
        row, reason = dict.fromkeys(QUANTITIES, float("nan")), ""
        try:
            row = quantities(design.changed(chosen), power_mW, air)
            reason = _NO_KNEE if np.isnan(row["knee_K"]) else ""
        except HotleverError as error:
            errors.append(error)
            reason = str(error)
        rows.append(row)
        reasons.append(reason)
    if len(errors) == len(rows):
        raise errors[0]
    columns: dict[str, Array] = {
        key: np.reshape([row[key] for row in rows], shape) for key in QUANTITIES
    }
    return labelled(
        {**columns, "reason": np.reshape(np.array(reasons, dtype=object), shape)},
        tuple(coordinates),
        {name: (name, each, _described(name, base[name])) for name, each in coordinates.items()},
        **{key: json.dumps(section) for key, section in design.probe.sections().items()},
        power_mW=power_mW,
        lever=design.probe.title,
    )


def _described(name: str, base: float) -> dict[str, object]:
    """Return unit and meaning of a number of a design, and what the design has."""
    varied = parameter_named(name)
    return {"units": varied.unit, "long_name": varied.meaning, "base_value": base}


def sensitivities(
    design: Design,
    names: Sequence[str] | None = None,
    *,
    power_mW: float = 2.0,
    air: bool = True,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return the quantities of a design, and how each changes with some of its numbers.

    These are by default its `Design.usual` ones.

    Returns
    -------
    xarray.Dataset
        `QUANTITIES` of the design; and on ``name`` its ``value`` and, as ``by_`` each quantity,
        the change for one per cent more of it, in K for temperatures and in per cent for
        everything else; central differences.
    """
    design.probe.circuit.need_cold_start("a study of a design")
    names = design.usual if names is None else names
    base = quantities(design.probe, power_mW, air)
    columns: dict[str, list[float]] = {f"by_{key}": [] for key in QUANTITIES}
    value = [design.value(name) for name in names]
    for name, here in each(list(zip(names, value, strict=True)), progress):
        # relative changes
        step = 0.002 if name == "annealing_K" else 0.02
        high, low = (
            quantities(design.changed({name: here * factor}), power_mW, air)
            for factor in (1.0 + step, 1.0 - step)
        )
        for key in QUANTITIES:
            change = (high[key] - low[key]) / (200.0 * step)
            change *= 1.0 if key.endswith("_K") else 100.0 / base[key]
            columns[f"by_{key}"].append(change)
    alone = {key: ((), number) for key, number in base.items()}
    return labelled(
        {**alone, **columns, "value": value}, "name", {"name": list(names)}, power_mW=power_mW
    )


def design_notes(data: xr.Dataset) -> list[str]:
    """Say of which designs of a study something is not known, and why."""
    designs: dict[str, list[str]] = {}
    for numbers in np.argwhere(data.reason.values != ""):
        point = data.reason.isel(dict(zip(data.reason.dims, numbers.tolist(), strict=True)))
        named = " and ".join(f"{name} = {point[name].item():g}" for name in data.reason.dims)
        designs.setdefault(point.item(), []).append(named)
    notes = [f"with {'; '.join(_few(named))}: {reason}" for reason, named in designs.items()]
    return _few(notes)


def mesh_note(probe: Probe, power_mW: float) -> str:
    """Say how far what a study says of a probe is from a sweep, whose mesh is finer."""
    own, finer = (quantities(probe, power_mW, False, mesh) for mesh in (DESIGN_MESH, None))
    texts = [f"{own['tip_K'] - finer['tip_K']:+.2g} K at {power_mW:g} mW"]
    if np.isfinite(own["knee_mW"]) and np.isfinite(finer["knee_mW"]):
        texts = [
            f"{own['knee_K'] - finer['knee_K']:+.2g} K and "
            f"{100 * (own['knee_mW'] / finer['knee_mW'] - 1):+.2g} % of the power at the knee",
            *texts,
        ]
    return f"on a coarser mesh than hotlever sweep, off by {', '.join(texts)} for this probe"


def _few(texts: list[str]) -> list[str]:
    """Return the first of many texts, and how many more there are."""
    more = len(texts) - 3
    return texts if more <= 1 else [*texts[:3], f"and {more} more"]


def sensitivity_text(data: xr.Dataset) -> str:
    """Return the sensitivities of a design, see `sensitivities`, as lines of text."""
    base = {key: data[key].item() for key in QUANTITIES}
    some = ("knee_K", "knee_mW", "knee_V", "knee_bias_V", "tip_K", "cold_ohm", "k")
    quantities = [key for key in some if np.isfinite(base[key])]
    width = max(map(len, data.name.values))
    knee = (
        _NO_KNEE
        if np.isnan(base["knee_K"])
        else f"knee at {base['knee_K']:.0f} K, {base['knee_V']:.3f} V, {base['knee_mA']:.3f} mA, "
        f"{base['knee_mW']:.3f} mW (bias {base['knee_bias_V']:.2f} V)"
    )
    if np.isfinite(base["inversion_K"]):
        knee += f", inversion temperature {base['inversion_K']:.0f} K"
    lines = [
        f"{knee}; tip at {base['tip_K']:.0f} K with "
        f"{data.attrs['power_mW']:g} mW; {base['cold_ohm']:.0f} ohm when cold"
        + ("" if np.isnan(base["k"]) else f"; k = {base['k']:.3f} in air"),
        "change for 1 % more of each (K for temperatures, % for the others):",
        "",
        "  ".join([" " * width, f"{'at':>9}", *(f"{key:>11}" for key in quantities)]),
    ]
    for name in data.name.values:
        row = data.sel(name=name)
        cells = [f"{row[f'by_{key}'].item():+11.3f}" for key in quantities]
        lines.append("  ".join([f"{name:<{width}}", f"{row.value.item():9.4g}", *cells]))
    return "\n".join(lines)


def design_csv(data: xr.Dataset) -> str:
    """Return a study of a design as CSV, one row per design; empty where nothing is known."""
    return frame_text(data[[*QUANTITIES, "reason"]].to_dataframe(), float_format="%.6g")


def label_of(name: str) -> str:
    """Return the label of an axis along which a number of a design runs."""
    if name in ANNEALING:
        return f"{ANNEALING[name]} ({name.rpartition('_')[2]})"
    varied = parameter_named(name)
    return varied.symbol if varied.unit == "1" else f"{varied.symbol} ({varied.unit})"
