"""Probes and materials, written, drawn, described and imported."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hotlever.errors import unknown_name
from hotlever.files import write_text
from hotlever.materials import Kind
from hotlever.materials.catalogue import curves, listing
from hotlever.probe import Probe, ProbeMesh
from hotlever.probe.drawing.outlines import DrawingError
from hotlever.probe.importing import import_drawing
from hotlever.probe.layout import Layout, Taper
from hotlever.probe.shapes import Parametric
from hotlever.tasks.planning_requests import (
    NEW_PROBES,
    ImportRequest,
    MaterialsRequest,
    NewRequest,
    ShowRequest,
)
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.shared import draw, read_probe


def new_probe(reporter: Reporter, request: NewRequest) -> None:
    """Write a parametric probe as a commented file."""
    if request.shape not in NEW_PROBES:
        raise unknown_name("shape", request.shape, NEW_PROBES)
    request.check_outputs()
    probe: Probe = getattr(Probe, NEW_PROBES[request.shape])()
    if request.output is None:
        reporter.give(probe.to_toml())
    else:
        probe.to_file(request.output)


def show_probe(reporter: Reporter, request: ShowRequest) -> None:
    """Draw and describe a probe; outlines that make none are drawn with what is wrong of them."""
    request.check_outputs()
    try:
        probe = read_probe(reporter, request.probe)
    except DrawingError as error:
        fault = error
        draw(
            request.plot,
            lambda figures: figures.outlines_drawing(
                fault.outlines, fault=str(fault), fault_at=fault.place
            ),
        )
        raise
    from hotlever.lever.discretisation import chosen_space  # brings all of the lever along

    name = "reference probe" if request.probe is None else request.probe.name
    layout, triangles = probe.layout(), chosen_space(probe).mesh
    drawn = triangles if request.mesh else None
    draw(request.plot, lambda figures: figures.probe_drawing(layout, name, mesh=drawn))
    reporter.give(_probe_text(probe, triangles, name))


def _probe_text(probe: Probe, mesh: ProbeMesh, name: str) -> str:
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
        fields = part.model_dump(
            exclude={"kind", "preset"}, exclude_none=True, exclude_defaults=usual
        )
        values = [
            f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}"
            for key, value in part
            if key in fields
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


def propose_probe(reporter: Reporter, request: ImportRequest) -> None:
    """Say what a drawing holds, and propose a probe file for it."""
    drawing, output, unit = request.drawing, request.output, request.known_unit
    request.check_outputs()
    folder = Path() if output is None else output.parent
    proposed = import_drawing(drawing, request.cell, folder, unit)
    fault = proposed.fault
    fault_at = fault.place if isinstance(fault, DrawingError) else None
    if output is not None:
        write_text(output, proposed.text)
    draw(
        request.plot,
        lambda figures: figures.outlines_drawing(
            proposed.outlines,
            drawing.name,
            tip=proposed.inference.tip,
            fault="" if fault_at is None else str(fault),
            fault_at=fault_at,
        ),
    )
    reporter.give(proposed.text if output is None else "\n".join([*proposed.listing, ""]))
    reporter.note(*proposed.notes)
    if fault is not None:
        reporter.note(f"the probe file needs an edit before it can be solved: {fault}")


def list_materials(reporter: Reporter, request: MaterialsRequest) -> None:
    """List kinds of material, or those of a probe, and draw their laws."""
    request.check_outputs()
    chosen: tuple[Any, ...] = ()
    if request.probe is not None:
        probe = read_probe(reporter, request.probe)
        chosen = probe.made_of, probe.layout().thickness_um
    draw(request.plot, lambda figures: figures.material_curves(curves(*chosen)))
    reporter.give("\n".join([*listing(*chosen[:1]), ""]))
