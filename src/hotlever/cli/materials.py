"""``hotlever materials``: what levers can be made of."""

from __future__ import annotations

from hotlever.cli.commands import app
from hotlever.cli.options import PlotFile
from hotlever.cli.output import give
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.files import draw


@app.command("materials")
def materials_command(plot: PlotFile = None) -> None:
    """List the kinds of material with their parameters, units, bounds, laws and sources."""
    from hotlever.materials.catalogue import curves, listing

    outputs = Outputs()
    outputs.file(plot, *FIGURE_TYPES)
    with outputs.together():
        draw(plot, lambda figures: figures.material_curves(curves()))
    give("\n".join([*listing(), ""]))
