"""``hotlever materials``: what levers can be made of."""

from __future__ import annotations

from typing import Any

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.files import draw
from hotlever.tasks.probes import read_probe
from hotlever.tasks.requests import MaterialsRequest


@command("materials", MaterialsRequest)
def materials_command(request: MaterialsRequest) -> None:
    """List kinds of material, or those of a probe: parameters, units, bounds, laws, sources."""
    from hotlever.materials.catalogue import curves, listing

    outputs = Outputs(request.probe)
    outputs.file(request.plot, *FIGURE_TYPES)
    chosen: tuple[Any, ...] = ()
    if request.probe is not None:
        probe = read_probe(terminal, request.probe)
        chosen = probe.made_of, probe.layout().thickness_um
    with outputs.together():
        draw(request.plot, lambda figures: figures.material_curves(curves(*chosen)))
    terminal.give("\n".join([*listing(*chosen[:1]), ""]))
