"""Drawings that become probe files."""

from __future__ import annotations

from pathlib import Path

from hotlever.files import write_text
from hotlever.probe.drawing.outlines import DrawingError
from hotlever.probe.importing import import_drawing
from hotlever.tasks.design_requests import ImportRequest
from hotlever.tasks.files import draw
from hotlever.tasks.reporter import Reporter


def propose_probe(reporter: Reporter, request: ImportRequest) -> None:
    """Say what a drawing holds, and propose a probe file for it."""
    drawing, output, unit = request.drawing, request.output, request.known_unit
    outputs = request.outputs()
    folder = Path() if output is None else output.parent
    proposed = import_drawing(drawing, request.cell, folder, unit)
    fault = proposed.fault
    fault_at = fault.place if isinstance(fault, DrawingError) else None
    with outputs.together():
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
