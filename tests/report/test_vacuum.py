"""Sections on the lever in vacuum and on a disc in air: their texts have all that they name."""

from __future__ import annotations

import pytest

from hotlever.report.reproduce import air_sections as air
from hotlever.report.reproduce import layout_sections as layouts
from hotlever.report.reproduce import paper_sections as vacuum
from hotlever.report.reproduce.findings import Findings


@pytest.mark.parametrize(
    ("section", "claims"),
    [
        (vacuum.parameter_section, 1),
        (vacuum.operating_points_section, 2),
        (vacuum.characteristics_section, 3),
        (vacuum.heater_section, 1),
        (vacuum.knee_section, 3),
        (vacuum.balance_section, 0),
        (air.disc_section, 2),
    ],
)
def test_texts_say_what_their_section_found(coarse, section, claims):
    page = Findings(coarse)
    page.heading("Here it is")
    section(page)
    assert len(page.claims) == claims
    captions = [block.get("caption", block.get("text")) for block in page.blocks]
    texts = [*captions, *(text for claim in page.claims for text in claim)]
    assert all(texts)
    assert not any("{" in text for text in texts)
    assert all(where.startswith('<a href="#here-it-is">') for where, *_ in page.claims)


def test_stored_layouts_and_suspects_are_told_without_solving_a_lever(coarse):
    page = Findings(coarse, quick=True)
    page.heading("here")
    layouts.layouts_section(page)
    layouts.discrepancy_section(page)
    [claim] = page.claims
    assert claim[2].startswith("does not hold, because that is less than the 2%")
    captions = [block.get("caption", block.get("text")) for block in page.blocks]
    assert all(captions)
    assert not any("{" in text for text in captions)
    statements = next(block for block in page.blocks if block.get("prose"))
    assert {row[2].partition(",")[0] for row in statements["rows"]} == {"met", "off"}
