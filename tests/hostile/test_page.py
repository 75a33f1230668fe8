"""The page of promises states the numbers of hostile cases that there are."""

from __future__ import annotations

from pathlib import Path

from promises import hostile_counts, rows

PAGE = Path(__file__).parents[2] / "docs" / "promises.md"


def test_the_page_has_the_counts():
    text = PAGE.read_text(encoding="utf-8")
    for row in rows(hostile_counts()):
        assert row in text
