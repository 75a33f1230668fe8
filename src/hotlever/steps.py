"""Work in steps, told as they are done."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from hotlever.types import Progress, T


def each(items: Collection[T], progress: Progress | None) -> Iterator[T]:
    """Give items one after the other, and tell how many are done."""
    for done, item in enumerate(items, start=1):
        yield item
        if progress is not None:
            progress(done, len(items))
