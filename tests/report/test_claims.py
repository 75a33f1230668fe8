"""Sections on other levers and surroundings: verdicts follow what was computed."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.datasets import labelled
from hotlever.materials import PARAMETERS
from hotlever.report.reproduce import air_sections as air
from hotlever.report.reproduce import claim_sections as claims
from hotlever.report.reproduce.findings import Extent, Findings
from hotlever.studies.parameter_consistency import FREE, HELD


@pytest.fixture
def page(coarse):
    return Findings(coarse)


@pytest.fixture
def quick_page(coarse):
    return Findings(coarse, quick=True)


def kinds(page):
    return [block["kind"] for block in page.blocks]


def test_lines_above_the_knee_are_judged_by_the_paper_s_spread(quick_page):
    quick_page.extent = Extent(every=10)
    claims.linear_section(quick_page)
    assert kinds(quick_page)[:2] == ["figure", "text"]
    straight, proportional = quick_page.claims
    assert straight[2].startswith("holds within")
    assert proportional[2].startswith("does not hold, because")


@pytest.mark.parametrize(("scatter", "verdict"), [(0.02, "holds"), (0.3, "does not hold, because")])
def test_parameters_are_judged_apart_from_the_doping(page, monkeypatch, scatter, verdict):
    def made_up(probe, geometries, errors):
        value = np.ones((len(errors), 2, len(geometries), len(PARAMETERS)))
        value[errors.index("all"), :, 0, 1] += scatter
        value[errors.index("mobility"), :, :, 3] += 0.04
        value[:, :, 0, 2] += 5.0
        return labelled(
            {
                "value": (("error", "doping", "lever", "parameter"), value),
                "true_value": ("parameter", np.ones(len(PARAMETERS))),
            },
            coordinates={
                "error": list(errors),
                "doping": [FREE, HELD],
                "lever": list(geometries),
                "parameter": list(PARAMETERS),
            },
        )

    monkeypatch.setattr(claims, "consistency_study", made_up)
    claims.consistency_section(page)
    assert kinds(page) == ["text", "figure", "table", "text"]
    assert (
        "agree within 0.0%, n_d apart, while their mean is up to 4.0% (p)"
        in (page.blocks[-1]["text"])
    )
    [claim] = page.claims
    assert claim[2].startswith(verdict)
    assert "the paper's own levers 15%, with n_d held 9%" in claim[3]


def test_k_with_a_surface_is_judged_by_what_the_best_one_leaves(quick_page):
    quick_page.extent = Extent(gaps_um=(1.0, np.inf))
    air.one_sided_section(quick_page)
    assert set(kinds(quick_page)) == {"figure", "table", "text"}
    [claim] = quick_page.claims
    assert claim[2].startswith("does not hold, because")
    assert "most at 1 µm" in claim[3]


def test_radiation_is_judged_by_all_of_the_lever(page):
    claims.radiation_section(page)
    [claim] = page.claims
    assert claim[2].startswith("does not hold, because 1.1 µW is what the heater's faces")
