"""How many hostile cases there are: few with all tests, many with ``make test-hostile``."""

from __future__ import annotations

import os

#: Share of the many.
SHARE = float(os.environ.get("HOTLEVER_HOSTILE", "0.03"))


def cases(many: int) -> int:
    """Return how many cases of so many there are now."""
    return max(1, round(SHARE * many))
