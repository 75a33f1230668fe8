"""All kinds of material, all presets and a probe's own materials, in words and as curves.

And what samples are made of, by name: materials of levers by their laws and presets, and others.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hotlever.errors import InputError, excerpt, unknown_name
from hotlever.materials.heat import thermal_conductivity
from hotlever.materials.kinds import KINDS, Kind
from hotlever.materials.laws import Law
from hotlever.materials.parameters import STATED, Parameter
from hotlever.materials.presets import PRESETS, material_of
from hotlever.materials.stated import StatedLaw
from hotlever.spieser2017 import DOI
from hotlever.text import aligned
from hotlever.types import Array
from hotlever.units import product_conversion, quantity

_THIN = "n-silicon, 0.4 µm by thickness"
#: A preset for the kinds that have no values of their own.
_EXAMPLES = {"metal-film": "Pt", "dielectric": "SiN"}

#: Of samples alone: κ (W m⁻¹ K⁻¹), and where it is from.
_OTHERS = {
    "polymer": (
        0.2,
        "amorphous macromolecules have 0.06 to 0.67: X. Xie et al., Phys. Rev. B 95, 035406 (2017)",
    ),
    "glass": (1.14, "borosilicate with 80.6 % SiO₂ at 20 °C: makers' data (0.96 to 1.2)"),
    "quartz": (
        (10.7 * 6.2) ** 0.5,
        "z-cut, as heat spreads: makers' data, 10.7 along the axis and 6.2 across at 25 °C",
    ),
    "sapphire": (
        35.0,
        "300 K: R. L. Aggarwal and A. K. Ramdas, Physical Properties of Diamond and Sapphire "
        "(CRC, 2019), ch. 6, after Cahill et al.",
    ),
}


def _example(kind: str) -> Kind:
    """Return a material of a kind."""
    preset = {"preset": _EXAMPLES[kind]} if kind in _EXAMPLES else {}
    return material_of({"kind": kind, **preset}, kind)


def listing(materials: Mapping[str, Kind] | None = None) -> list[str]:
    """Return kinds, parameters, laws and presets, or the same of some materials, line by line."""
    lines = [line for section in sections(materials).values() for line in (*section, "")]
    return [*lines, f"Eq.: of Spieser et al. (2017), doi:{DOI}"]


def sections(materials: Mapping[str, Kind] | None = None) -> dict[str, list[str]]:
    """Return the lines of each kind and of the presets, or of each of some materials."""
    if materials is not None:
        return {name: _own_lines(name, kind) for name, kind in materials.items()}
    lines = {name: _kind_lines(name) for name in KINDS}
    rows = []
    for name, preset in PRESETS.items():
        values = ", ".join(f"{key} {value:g}" for key, value in preset.values.items())
        rows.append([f"  {name}", preset.kind, values, preset.source])
    return {**lines, "presets": ["presets:", *aligned(rows)]}


def _kind_lines(name: str) -> list[str]:
    kind, example = KINDS[name], _example(name)
    preset = PRESETS[_EXAMPLES[name]].values if name in _EXAMPLES else {}
    values = {own: getattr(example, own) for own in kind.declared if own not in preset}
    head = f"{name}: {(kind.__doc__ or '').partition('.')[0]}"
    # the laws of its options are among its own
    options = {"metal-film": {"kappa": 0.5}, "dielectric": {}}.get(name, {"c_kappa": "thickness"})
    other = example.model_copy(update=options)
    laws = {law: law.source for law in (*example.laws, *other.laws, *example.effects)}
    return _lines(head, kind.declared, "left out", values, laws)


def _own_lines(name: str, kind: Kind) -> list[str]:
    values = {own: getattr(kind, own) for own in kind.parameters}
    laws: dict[Law | StatedLaw, str] = {law: law.source for law in (*kind.laws, *kind.effects)}
    for own, law in kind.stated.items():
        laws[law] = f"{own} ({STATED[own][0]}), {law.source}"
    return _lines(f"{name}: {kind.kind}", kind.parameters, "value", values, laws)


def _lines(
    head: str,
    parameters: Mapping[str, Parameter],
    values_are: str,
    values: Mapping[str, Any],
    laws: Mapping[Law | StatedLaw, str],
) -> list[str]:
    """Return a heading, the parameters with values, and the laws with their sources."""
    rows = [["  parameter", "unit", "from", "to", values_are, ""]]
    for own, parameter in parameters.items():
        value = values.get(own)
        default = f"{value:.4g}" if isinstance(value, float) else "–"
        limits = f"{parameter.lower:.4g}", f"{parameter.upper:.4g}"
        rows.append([f"  {own}", parameter.unit, *limits, default, parameter.meaning])
    lines = [head, *aligned(rows)]
    for law, source in laws.items():
        low, high = law.temperature_range
        title = (law.__doc__ or "").partition("\n")[0].partition(",")[0].rstrip(".")
        first = "" if isinstance(law, StatedLaw) else f"{title}: "
        lines.append(f"  {first}{source}; {low:g} to {high:g} K")
    return lines


def examples() -> dict[str, Kind]:
    """Return each kind of silicon with the values of the reference probe, and each preset."""
    materials = {name: _example(name) for name in KINDS if name not in _EXAMPLES}
    materials[_THIN] = materials["n-silicon"].model_copy(update={"c_kappa": "thickness"})
    for name, preset in PRESETS.items():
        materials[name] = material_of({"kind": preset.kind, "preset": name}, name)
    return materials


def curves(
    kinds: Mapping[str, Kind] | None = None, thickness_um: float = 0.4
) -> dict[str, tuple[Array, Array, Array | None]]:
    """Return temperature (K), κ (W m⁻¹ K⁻¹) and ρ (Ω cm, or None) of materials, by name.

    Curves go as far as the laws do, and end where the material melts.

    Parameters
    ----------
    kinds : mapping of str to Kind, optional
        `examples` if left out.
    thickness_um : float
        Of a layer whose κ follows from it.
    """
    curves_of = {}
    for name, kind in (examples() if kinds is None else kinds).items():
        low = max([250.0, *(law.temperature_range[0] for law in kind.stated.values())])
        T = np.linspace(low, min(1300.0, kind.highest_K), 106)
        kappa, _ = kind.thermal_conductivity(T, thickness_um)
        rho = None
        if kind.conducts and name != _THIN:
            rho = 1.0 / kind.electrical_conductivity(T, getattr(kind, "n_d", 0.0))[0]
        curves_of[name] = T, 100.0 * kappa, rho
    return curves_of


# --- samples ------------------------------------------------------------------------------------


def sample_names() -> tuple[str, ...]:
    """Return the materials that a sample may be made of by name."""
    return (*_OTHERS, "silicon", *PRESETS)


def sample_conductivity(text: str, where: str) -> float:
    """Return κ (W m⁻¹ K⁻¹) of a material by its name, or of a number in this unit.

    Raises
    ------
    InputError
        If it is neither; the nearest name is given.

    Examples
    --------
    >>> [round(sample_conductivity(text, "--sample"), 2) for text in ("silicon", "SiO2", "0.3")]
    [141.44, 1.38, 0.3]
    >>> sample_conductivity("2 mW/(cm K)", "--sample")
    0.2
    """
    if text in _OTHERS:
        return _OTHERS[text][0]
    if text == "silicon":
        return 100.0 * float(thermal_conductivity(300.0)[0])
    if text in PRESETS:
        kind = material_of({"kind": PRESETS[text].kind, "preset": text}, text)
        return 100.0 * kind.thermal_conductivity(np.array(300.0), 1.0)[0].item()
    value, unit = quantity(text)
    if value is None:
        raise unknown_name("material", text, sample_names(), where)
    factor = product_conversion(unit, "W m⁻¹ K⁻¹") if unit else 1.0
    if factor is None or not 1e-3 <= factor * value <= 1e4:
        raise InputError(
            f"{where}: found '{excerpt(text)}', expected a material or its thermal conductivity, "
            "0.001 to 10000 W/(m K)"
        )
    return factor * value
