"""``hotlever materials``: what levers can be made of."""

from __future__ import annotations

from hotlever.cli.options import command
from hotlever.cli.output import give
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.files import draw
from hotlever.tasks.requests import PlotRequest


@command("materials", PlotRequest)
def materials_command(request: PlotRequest) -> None:
    """List the kinds of material with their parameters, units, bounds, laws and sources."""
    from hotlever.materials.catalogue import curves, listing

    outputs = Outputs()
    outputs.file(request.plot, *FIGURE_TYPES)
    with outputs.together():
        draw(request.plot, lambda figures: figures.material_curves(curves()))
    give("\n".join([*listing(), ""]))
