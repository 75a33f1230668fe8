"""Sections on other levers and surroundings: verdicts follow what was computed."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.datasets import labelled
from hotlever.materials import PARAMETERS
from hotlever.report.reproduce import claims
from hotlever.report.reproduce.findings import Findings
from hotlever.studies.parameter_consistency import FREE, HELD


@pytest.fixture
def page(coarse):
    return Findings(coarse)


def kinds(page):
    return [block["kind"] for block in page.blocks]


def test_lines_above_the_knee_are_judged_by_the_paper_s_spread(page):
    claims.linear_section(page, 10)
    assert kinds(page)[:2] == ["figure", "text"]
    straight, proportional = page.claims
    assert straight[2].startswith("holds within")
    assert proportional[2].startswith("does not hold here")


@pytest.mark.parametrize(("scatter", "verdict"), [(0.02, "holds"), (0.3, "does not hold here")])
def test_parameters_are_judged_apart_from_the_doping(page, monkeypatch, scatter, verdict):
    def made_up(probe, geometries, errors, progress):
        value = np.ones((len(errors), 2, len(geometries), len(PARAMETERS)))
        value[1, :, 0, 1] += scatter
        value[:, :, 0, 2] += 5.0
        return labelled(
            {"value": (("error", "doping", "lever", "parameter"), value)},
            coordinates={
                "error": list(errors),
                "doping": [FREE, HELD],
                "lever": list(geometries),
                "parameter": list(PARAMETERS),
            },
        )

    monkeypatch.setattr(claims, "consistency_study", made_up)
    claims.few_consistency_section(page)
    assert kinds(page) == ["text", "figure", "table"]
    [claim] = page.claims
    assert claim[2].startswith(verdict)
    assert "the paper's own levers 15%, with n_d held 9%" in claim[3]


def test_k_with_a_surface_is_judged_by_what_the_best_one_leaves(page):
    claims.one_sided_section(page, (1.0, np.inf))
    assert set(kinds(page)) == {"figure", "table", "text"}
    [claim] = page.claims
    assert claim[2].startswith("does not hold here")
    assert "most at 1 µm" in claim[3]
