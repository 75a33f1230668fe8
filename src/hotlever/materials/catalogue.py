"""All kinds of material and all presets, in words and as curves."""

from __future__ import annotations

import numpy as np

from hotlever.materials.kind import Kind
from hotlever.materials.kinds import KINDS
from hotlever.materials.laws import Law
from hotlever.materials.presets import PRESETS
from hotlever.materials.sections import material_of
from hotlever.spieser2017 import DOI
from hotlever.text import aligned
from hotlever.types import Array

#: Temperatures of curves (K), and of a layer whose κ follows from its thickness (µm).
_FROM_K, _TO_K, _STEPS, _LAYER_UM = 250.0, 1300.0, 106, 0.4
#: A preset for the kinds that have no values of their own.
_EXAMPLES = {"metal-film": "Pt", "dielectric": "SiN"}


def _example(kind: str) -> Kind:
    """Return a material of a kind."""
    preset = {"preset": _EXAMPLES[kind]} if kind in _EXAMPLES else {}
    return material_of({"kind": kind, **preset}, kind)


def listing() -> list[str]:
    """Return kinds, parameters, laws and presets, line by line."""
    lines: list[str] = []
    for name, kind in KINDS.items():
        example = _example(name)
        lines.append(f"{name}: {(kind.__doc__ or '').partition('.')[0]}")
        rows = [["  parameter", "unit", "from", "to", "left out", ""]]
        for own, parameter in kind.declared.items():
            value = getattr(example, own)
            given = name not in _EXAMPLES or own not in PRESETS[_EXAMPLES[name]].values
            default = f"{value:.4g}" if given and isinstance(value, float) else "–"
            limits = f"{parameter.lower:.4g}", f"{parameter.upper:.4g}"
            rows.append([f"  {own}", parameter.unit, *limits, default, parameter.meaning])
        lines += aligned(rows)
        for law in _laws(name, example):
            low, high = law.temperature_range
            first = (law.__doc__ or "").partition("\n")[0].partition(",")[0].rstrip(".")
            lines.append(f"  {first}: {law.source}; {low:g} to {high:g} K")
        lines.append("")
    lines.append("presets:")
    rows = []
    for name, preset in PRESETS.items():
        values = ", ".join(f"{key} {value:g}" for key, value in preset.values.items())
        rows.append([f"  {name}", preset.kind, values, preset.source])
    return [*lines, *aligned(rows), "", f"Eq.: of Spieser et al. (2017), doi:{DOI}"]


def _laws(name: str, example: Kind) -> list[Law]:
    """Return the laws of a kind, those of its options among them."""
    options = {"metal-film": {"kappa": 0.5}, "dielectric": {}}.get(name, {"c_kappa": "thickness"})
    other = example.model_copy(update=options)
    return list(dict.fromkeys((*example.laws, *other.laws, *example.effects)))


def curves() -> dict[str, tuple[Array, Array, Array | None]]:
    """Return temperature (K), κ (W m⁻¹ K⁻¹) and ρ (Ω cm, or None) of many materials.

    By name: of each kind of silicon with the values of the reference probe, and of each preset.
    Curves end where the material melts.
    """
    plain = {name: _example(name) for name in KINDS if name not in _EXAMPLES}
    thin = {f"n-silicon, {_LAYER_UM:g} µm by thickness": {"c_kappa": "thickness"}}
    made = plain | {
        name: plain["n-silicon"].model_copy(update=values) for name, values in thin.items()
    }
    for name, preset in PRESETS.items():
        made[name] = material_of({"kind": preset.kind, "preset": name}, name)
    curves_of = {}
    for name, kind in made.items():
        T = np.linspace(_FROM_K, min(_TO_K, kind.highest_K), _STEPS)
        kappa, _ = kind.thermal_conductivity(T, _LAYER_UM)
        rho = None
        if kind.conducts and name not in thin:
            rho = 1.0 / kind.electrical_conductivity(T, getattr(kind, "n_d", 0.0))[0]
        curves_of[name] = T, 100.0 * kappa, rho
    return curves_of
