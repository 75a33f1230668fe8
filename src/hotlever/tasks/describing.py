"""Probes and materials, written, drawn, described and imported; and what is kept on disk."""

from __future__ import annotations

from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from hotlever.errors import unknown_name
from hotlever.files import write_text
from hotlever.tasks.arguments import Plot, ProbeFile, Reporter, Written, draw, read_probe

if TYPE_CHECKING:
    from hotlever.probe import Probe, ProbeMesh
    from hotlever.probe.layout import Layout


def new_probe(
    reporter: Reporter,
    *,
    output: Annotated[Path | None, Written((".toml",))] = None,
    shape: str = "three-leg",
) -> None:
    """Write the reference probe as a commented file.

    Parameters
    ----------
    output
        File; standard output if left out.
    shape
        One of: three-leg, u-shape.
    """
    from hotlever.probe import Probe

    if shape not in (shapes := ("three-leg", "u-shape")):
        raise unknown_name("shape", shape, shapes)
    probe = Probe.u_shape() if shape == "u-shape" else Probe.reference()
    if output is None:
        reporter.give(probe.to_toml())
    else:
        probe.to_file(output)


def show_probe(
    reporter: Reporter, probe: ProbeFile = None, *, plot: Plot = None, mesh: bool = False
) -> None:
    """Draw and describe a probe.

    Parameters
    ----------
    mesh
        Draw the triangles of the mesh too.
    """
    from hotlever.probe.drawing.outlines import DrawingError

    try:
        shown = read_probe(reporter, probe)
    except DrawingError as error:
        # outlines that make no probe are drawn with what is wrong of them
        fault = error
        draw(
            plot,
            lambda figures: figures.outlines_drawing(
                fault.outlines, fault=str(fault), fault_at=fault.place
            ),
        )
        raise
    from hotlever.lever.discretisation import chosen_space  # brings all of the lever along

    name = "reference probe" if probe is None else probe.name
    layout, triangles = shown.layout(), chosen_space(shown).mesh
    drawn = triangles if mesh else None
    draw(plot, lambda figures: figures.probe_drawing(layout, name, mesh=drawn))
    reporter.give(_probe_text(shown, triangles, name))


def _probe_text(probe: Probe, mesh: ProbeMesh, name: str) -> str:
    """Return a probe in words, with the number of triangles of its mesh; `name` heads them."""
    from hotlever.probe.shapes import Parametric

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
    from hotlever.materials import Kind

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
    from hotlever.probe.layout import Taper

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


def propose_probe(
    reporter: Reporter,
    drawing: Path,
    *,
    plot: Plot = None,
    output: Annotated[Path | None, Written((".toml",))] = None,
    cell: str | None = None,
    unit: str | None = None,
) -> None:
    """Say what a drawing holds, and propose a probe file for it.

    Parameters
    ----------
    drawing : DRAWING
        GDSII, OASIS or DXF file.
    output
        Probe file to write; standard output if left out.
    cell
        Of GDSII or OASIS; the top cell if left out.
    unit
        Of the drawing's numbers, as mm; what the file says if left out.
    """
    from hotlever.probe.drawing.outlines import DrawingError
    from hotlever.probe.drawing.sheet import UNITS
    from hotlever.probe.importing import import_drawing

    known_unit = None if unit is None else unit.replace("µ", "u").replace("μ", "u")
    if known_unit is not None and known_unit not in UNITS:
        raise unknown_name("unit", known_unit, UNITS, "--unit")
    folder = Path() if output is None else output.parent
    proposed = import_drawing(drawing, cell, folder, known_unit)
    fault = proposed.fault
    fault_at = fault.place if isinstance(fault, DrawingError) else None
    if output is not None:
        write_text(output, proposed.text)
    draw(
        plot,
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


def list_materials(reporter: Reporter, probe: Path | None = None, *, plot: Plot = None) -> None:
    """List kinds of material, or those of a probe: parameters, units, bounds, laws, sources.

    Parameters
    ----------
    probe : [PROBE.toml]
        Probe file whose materials are listed; all kinds and presets if left out.
    """
    from hotlever.materials.catalogue import curves, listing

    chosen: tuple[Any, ...] = ()
    if probe is not None:
        own = read_probe(reporter, probe)
        chosen = own.made_of, own.layout().thickness_um
    draw(plot, lambda figures: figures.material_curves(curves(*chosen)))
    reporter.give("\n".join([*listing(*chosen[:1]), ""]))


def show_cache(reporter: Reporter, *, clear: bool = False) -> None:
    """Show what is kept on disk to save time: reduced levers, operators of the air, states.

    Parameters
    ----------
    clear
        Remove all that is kept.
    """
    from hotlever.cache import CACHE_VARIABLE, cache_folder, kept_files, largest_size

    folder = cache_folder()
    if folder is None:
        reporter.give(f"the cache is switched off: {CACHE_VARIABLE} is empty\n")
        return
    if clear:
        for _, path in kept_files(folder):
            with suppress(OSError):
                path.unlink()
    files = kept_files(folder)
    sizes: dict[str, list[int]] = defaultdict(list)
    for status, path in files:
        sizes[path.parent.name].append(status.st_size)
    sizes["in all"] = [status.st_size for status, _ in files]
    lines = [f"{folder} (at most {largest_size() / 1e9:g} GB)"]
    for kind, bytes_of in sizes.items():
        lines.append(f"{kind:<10} {len(bytes_of):>6} files {sum(bytes_of) / 1e6:>10.1f} MB")
    reporter.give("\n".join([*lines, ""]))
