"""A probe in words: its shape, circuit and materials."""

from __future__ import annotations

from hotlever.materials import Kind
from hotlever.probe.layout import Layout, Taper
from hotlever.probe.mesh import ProbeMesh
from hotlever.probe.probe import Probe
from hotlever.probe.shapes import Parametric


def probe_text(probe: Probe, mesh: ProbeMesh, name: str) -> str:
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


def _sections(probe: Probe) -> list[str]:
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
