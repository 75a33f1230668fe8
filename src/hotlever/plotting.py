"""Who draws what draws itself: figures stand above it, so the package tells which they are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

#: Returns the module of figures, which takes long to load; set by the package itself.
figures: Callable[[], Any]
