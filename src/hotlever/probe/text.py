"""A probe as text: its file, with what each value is, and in words."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Any

from hotlever.materials import Kind
from hotlever.materials.sections import LAWS
from hotlever.probe.layout import Layout, Taper
from hotlever.probe.mesh import ProbeMesh
from hotlever.probe.parts import MATERIALS, ProbeParts
from hotlever.probe.shapes import Parametric, ThreeLeg
from hotlever.probe.surroundings import Physics
from hotlever.probe.tip import EXAMPLE
from hotlever.spieser2017 import DOI
from hotlever.text import as_toml

#: Column in which comments begin.
_COMMENTS = 32


def commented(entry: str, text: str | None) -> str:
    """Return a line of a probe file with a comment, if there is one."""
    return f"{entry:<{_COMMENTS - 2}}  # {text}" if text else entry


def section_lines(
    name: str,
    section: Mapping[str, Any],
    meaning: Mapping[str, str],
    *,
    optional: bool = False,
    start: str = "",
) -> list[str]:
    """Return the lines of a section, after an empty one, each with what its value is.

    Keys that have no value are left out, or with `optional` named in a comment. Sections inside it
    come last. The `start` of each line may make all of it a comment.
    """
    inner = {key: value for key, value in section.items() if isinstance(value, Mapping)}
    lines = [] if inner and len(inner) == len(section) else ["", f"{start}[{name}]"]
    for key, value in section.items():
        if key in inner or (value is None and not optional):
            continue
        written = f"{value:.12g}" if isinstance(value, float) else as_toml(value)
        entry = f"# {key} =" if value is None else f"{start}{key} = {written}"
        lines.append(commented(entry, meaning.get(key)))
    for key, values in inner.items():
        lines += section_lines(f"{name}.{key}", values, {})
    return lines


def file_text(probe: ProbeParts, shape: Mapping[str, Any], meaning: Mapping[str, str]) -> str:
    """Return the probe file of a probe.

    Parameters
    ----------
    probe : ProbeParts
    shape : mapping
        The sections of its shape.
    meaning : mapping of str to str
        What the values of these are, by key.
    """
    lines = ["# A hotlever probe file: lengths in µm, temperatures in K."]
    if shape == ThreeLeg.reference().sections():
        lines += [
            "# The reference probe. No drawing of the published lever exists: these dimensions",
            f"# are inferred from the operating points in doi:{DOI}.",
        ]
    for name, section in shape.items():
        lines += section_lines(name, section, meaning)
    return "\n".join(lines) + "\n" + other_sections(probe)


def other_sections(probe: ProbeParts, without: Container[str] = ()) -> str:
    """Return the sections of a probe's file beside those of its shape, some of them left out."""
    lines = []
    named = {f"{MATERIALS}.{name}": kind for name, kind in probe.materials.items()}
    for name, part in (named | probe.parts).items():
        if name in without:
            continue
        lines += section_lines(name, part.model_dump(), part.description(), optional=True)
    if probe.tip is None:
        lines += ["", "# Without a section [tip] the lever is flat. A cone under the heater:"]
        values, meaning = EXAMPLE.model_dump(), EXAMPLE.description()
        lines += section_lines("tip", values, meaning, start="# ")[1:]
    if not probe.physics:
        lines += ["", "# Without a section [physics] the physics is the paper's. Beyond it:"]
        effects = dict.fromkeys(Physics.model_fields, True)
        lines += section_lines("physics", effects, Physics.description(), start="# ")[1:]
    if probe.laws:
        lines += section_lines(LAWS, probe.laws, {})
    return "\n".join(lines) + "\n"


# --- in words -----------------------------------------------------------------------------------


def probe_text(probe: ProbeParts, mesh: ProbeMesh, name: str) -> str:
    """Return a probe in words, with the number of triangles of its mesh; `name` heads them."""
    circuit, silicon, layout = probe.circuit, probe.heater_silicon, mesh.layout
    x, y = (coordinate + 0.0 for coordinate in layout.tip)  # no -0
    values = {key: getattr(probe.shape, key) for key in probe.shape.description()}
    dimensions = [
        f"  {key:<22} {values[key]:>8{'g' if isinstance(values[key], float) else ''}}  {text}"
        for key, text in probe.shape.description().items()
        if isinstance(values[key], float | str)
    ]
    if not isinstance(probe.shape, Parametric):
        dimensions += [f"  {text}" for text in _regions(layout)]
    lines = [
        f"{name}: {probe.shape.shape}, {layout.thickness_um:g} µm thick",
        *dimensions,
        f"  tip at ({x:g}, {y:g}) µm; terminals {', '.join(layout.terminal_names)}",
        f"circuit: series resistance {circuit.series_resistance_ohm:g} ohm, "
        f"base temperature {circuit.base_temperature_K:g} K",
        *(
            [
                f"  bridge: {circuit.bridge_upper_ohm:g} ohm above "
                f"{circuit.bridge_lower_ohm:g} ohm, gain {circuit.bridge_gain or 1.0:g}, "
                f"offset {circuit.bridge_offset_V:g} V"
            ]
            if circuit.has_bridge
            else []
        ),
        *(f"  {name}: {contact}" for name, contact in circuit.contacts.items()),
        *_sections(probe),
        *(
            []
            if silicon is None
            else [f"inversion temperature of the heater: {silicon.inversion_temperature():.1f} K"]
        ),
        f"mesh: {mesh.elements.nelements} triangles",
    ]
    return "\n".join([*lines, ""])


def _sections(probe: ProbeParts) -> list[str]:
    """Return what else the probe file says, a line for each section; of surroundings their own."""
    parts = {name: part for name, part in probe.parts.items() if name != "circuit"}
    lines = []
    for name, part in {**parts, **probe.materials}.items():
        usual = name == "surroundings"
        kept = part.model_dump(
            exclude={"kind", "preset"}, exclude_none=True, exclude_defaults=usual
        )
        values = [
            f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}"
            for key, value in part
            if key in kept
        ]
        values[:0] = [part.kind] if isinstance(part, Kind) else []
        lines += [f"{name}: {', '.join(values)}"] if values else []
    return lines


def _regions(layout: Layout) -> list[str]:
    """Return what the regions of a drawing are."""
    plain = {"high-doped", "low-doped"}
    lines = []
    for region in layout.regions:
        stack = [
            film.material + (f" {film.thickness_um:g} µm" if film.thickness_um else "")
            for film in region.stack
        ]
        kind = "high-doped" if plain.issuperset(stack) else " under ".join(stack)
        own = "low-doped" if plain.issuperset(stack) else f"{kind}, low-doped"
        if isinstance(region.taper, Taper):
            kind = f"{own} strip, {region.taper.length_um:.4g} µm from border to border"
        elif region.taper is not None:
            borders = len(region.taper.borders)
            kind = f"{own}, doping by the distance to {borders} border{'s' * (borders > 1)}"
        part = "insulates" if region.insulates else region.part
        lines.append(f"{region.name}: {part}, {region.area:.4g} µm², {kind}")
    return lines
