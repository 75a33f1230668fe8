"""``hotlever materials``: what levers can be made of."""

from __future__ import annotations

from hotlever.cli.application import app
from hotlever.cli.options import PlotFile, check_plot
from hotlever.cli.output import give
from hotlever.files import Outputs


@app.command("materials")
def materials_command(plot: PlotFile = None) -> None:
    """List the kinds of material with their parameters, units, bounds, laws and sources."""
    from hotlever.materials.catalogue import curves, listing

    outputs = Outputs()
    check_plot(outputs, plot)
    if plot is not None:
        from hotlever import figures

        with outputs.together():
            figures.save_figure(figures.material_curves(curves()), plot)
    give("\n".join([*listing(), ""]))
