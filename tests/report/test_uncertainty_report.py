"""The tables of posterior and profiles, from made-up datasets."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from hotlever.fitting.uncertainty import Uncertainty
from hotlever.report.page import Page
from hotlever.report.uncertainty_report import add_uncertainty, uncertainty_text


@pytest.fixture
def found() -> Uncertainty:
    profile = xr.Dataset(
        {
            "delta_chi_square": ("point", [4.0, 0.0, 1.0]),
            "parabola": ("point", [4.0, 0.0, 1.0]),
            "interval": (("level", "side"), [[4.0e17, 5.0e17], [3.0e17, np.nan]]),
        },
        coords={"value": ("point", [3e17, 4.5e17, 5e17]), "level": [0.68, 0.95]},
        attrs={"parameter": "n_d", "optimum": 4.5e17, "notes": "n_d: open on the upper side"},
    )
    return Uncertainty(None, None, None, {"n_d": profile})  # type: ignore[arg-type]


def test_intervals_are_in_the_unit_of_the_table_and_open_ones_are_said(found):
    first, second = uncertainty_text(found).splitlines()
    assert first.split() == [
        "profile",
        "likelihood",
        "68",
        "%",
        "from",
        "to",
        "95",
        "%",
        "from",
        "to",
    ]
    assert second.split() == ["n_d", "(1e17", "cm⁻³)", "4", "5", "3", "open"]


def test_page_has_words_table_and_figure(found):
    page = Page("a fit")
    add_uncertainty(page, found)
    kinds = [block["kind"] for block in page.blocks]
    assert kinds == ["heading", "text", "table", "figure"]
    assert page.blocks[1]["text"] == "n_d: open on the upper side."
