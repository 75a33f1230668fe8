"""Probes and levers, read and made with what should be known of them told."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hotlever.probe import Probe
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.texts import parse_settings

if TYPE_CHECKING:
    from hotlever.lever import Lever


def read_probe(
    reporter: Reporter, path: Path | None = None, settings: Sequence[str] | None = None
) -> Probe:
    """Read a probe file, or take the reference probe, and change some of its values.

    What should be known of its shape is told.
    """
    probe = Probe.reference() if path is None else Probe.from_file(path)
    probe = probe.with_(**parse_settings(settings, probe)) if settings else probe
    reporter.note(*probe.shape.notes())
    return probe


def make_lever(reporter: Reporter, probe: Probe) -> Lever:
    """Mesh a probe, and make the air around it."""
    from hotlever.lever import Lever

    with reporter.progress("air") as update:
        return Lever(probe, progress=update)
