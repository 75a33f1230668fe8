"""``hotlever design``: what a change of dimensions, doping or annealing does."""

from __future__ import annotations

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.tasks.design_requests import DesignRequest


@command("design", DesignRequest)
def design_command(request: DesignRequest) -> None:
    """Show how knee, tip temperature and loss to air depend on a probe's design."""
    from hotlever.tasks.designing import vary_design

    vary_design(terminal, request)
