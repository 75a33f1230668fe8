"""Probes and materials, written, drawn and described."""

from __future__ import annotations

from typing import Any

from hotlever.errors import unknown_name
from hotlever.lever.discretisation import chosen_space
from hotlever.materials.catalogue import curves, listing
from hotlever.probe import Probe
from hotlever.probe.drawing.outlines import DrawingError
from hotlever.probe.text import probe_text
from hotlever.tasks.design_requests import NEW_PROBES, NewRequest, ShowRequest
from hotlever.tasks.files import draw
from hotlever.tasks.probes import read_probe
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import MaterialsRequest


def new_probe(reporter: Reporter, request: NewRequest) -> None:
    """Write a parametric probe as a commented file."""
    if request.shape not in NEW_PROBES:
        raise unknown_name("shape", request.shape, NEW_PROBES)
    request.outputs()
    probe: Probe = getattr(Probe, NEW_PROBES[request.shape])()
    if request.output is None:
        reporter.give(probe.to_toml())
    else:
        probe.to_file(request.output)


def show_probe(reporter: Reporter, request: ShowRequest) -> None:
    """Draw and describe a probe; outlines that make none are drawn with what is wrong of them."""
    outputs = request.outputs()
    try:
        probe = read_probe(reporter, request.probe)
    except DrawingError as error:
        fault = error
        with outputs.together():
            draw(
                request.plot,
                lambda figures: figures.outlines_drawing(
                    fault.outlines, fault=str(fault), fault_at=fault.place
                ),
            )
        raise
    name = "reference probe" if request.probe is None else request.probe.name
    layout, triangles = probe.layout(), chosen_space(probe).mesh
    drawn = triangles if request.mesh else None
    with outputs.together():
        draw(request.plot, lambda figures: figures.probe_drawing(layout, name, mesh=drawn))
    reporter.give(probe_text(probe, triangles, name))


def list_materials(reporter: Reporter, request: MaterialsRequest) -> None:
    """List kinds of material, or those of a probe, and draw their laws."""
    outputs = request.outputs()
    chosen: tuple[Any, ...] = ()
    if request.probe is not None:
        probe = read_probe(reporter, request.probe)
        chosen = probe.made_of, probe.layout().thickness_um
    with outputs.together():
        draw(request.plot, lambda figures: figures.material_curves(curves(*chosen)))
    reporter.give("\n".join([*listing(*chosen[:1]), ""]))
