"""Who hears what a task tells beside the files that it writes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol

from hotlever.types import Progress


class Reporter(Protocol):
    """The terminal, or a page of the app."""

    def note(self, *texts: str) -> None:
        """Say what should be known beside the result."""

    def progress(self, label: str) -> AbstractContextManager[Progress]:
        """Show how far the block is, which calls (steps done, steps in all)."""

    def give(self, result: str) -> None:
        """Give the result as text."""

    def tell(self, text: str) -> None:
        """Say something in one line."""

    def fail(self, message: str) -> None:
        """Say what went wrong with a part of the work."""

    def tell_table(self, rows: Sequence[Sequence[str]]) -> None:
        """Show rows of cells."""

    def show(self, what: str, content: Any) -> None:
        """Show what can be drawn on the way to the result, as the ``curve`` of a fit."""

    def progress_bars(self, *labels: str) -> AbstractContextManager[tuple[Progress, ...]]:
        """Show how far several parts of the work are, each from its first call on."""
