"""Sections of the page of the paper: texts say what was found, and verdicts follow from it."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import figures
from hotlever.datasets import labelled
from hotlever.materials import PARAMETERS
from hotlever.report.reproduce import SECTIONS
from hotlever.report.reproduce import claim_sections as claims
from hotlever.report.reproduce import layout_sections as layouts
from hotlever.report.reproduce import paper_sections as vacuum
from hotlever.report.reproduce.findings import Extent, Findings
from hotlever.studies.simulation_based_calibration import FREE, HELD
from hotlever.studies.thermoelectric_shift import HEATS, POLARITIES, SIDES


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
    claims.one_sided_section(quick_page)
    assert set(kinds(quick_page)) == {"figure", "table", "text"}
    [claim] = quick_page.claims
    assert claim[2].startswith("does not hold, because")
    assert "most at 1 µm" in claim[3]


def test_radiation_is_judged_by_all_of_the_lever(page):
    claims.radiation_section(page)
    [claim] = page.claims
    assert claim[2].startswith("does not hold, because 1.1 µW is what the heater's faces")


@pytest.mark.parametrize(
    ("section", "claims"),
    [
        (vacuum.parameter_section, 1),
        (vacuum.operating_points_section, 2),
        (vacuum.characteristics_section, 3),
        (vacuum.heater_section, 1),
        (vacuum.knee_section, 3),
        (vacuum.balance_section, 0),
        (claims.disc_section, 2),
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


def made_up_shift(bias, moved_nm=-100.0):
    """A shift that is the same at all biases, a tenth of it by Thomson heat."""
    size = len(bias)
    shares = moved_nm * np.array([[0.05, 0.05], [0.45, 0.45]])
    along = np.full((2, size), moved_nm)
    parts = ("polarity", "bias", "heat", "side")
    return labelled(
        {
            "plain_um": ("bias", np.full(size, 0.1)),
            "moved_nm": (parts[:2], along),
            "at_um": (parts[:2], 0.1 + 1e-3 * along * np.array([[1.0], [-1.0]])),
            "centre_rise_K": (parts[:2], np.full((2, size), 300.0)),
            "share_nm": (parts, np.broadcast_to(shares, (2, size, 2, 2))),
            "heat_mW": (parts, np.broadcast_to(0.01 * shares, (2, size, 2, 2))),
        },
        (),
        {"bias": bias, "polarity": list(POLARITIES), "heat": list(HEATS), "side": list(SIDES)},
    )


@pytest.fixture
def verdicts(coarse, monkeypatch):
    """Give the verdicts on a lever whose hot spot moves so far."""

    def judge(moved_nm):
        monkeypatch.setattr(
            *(claims, "shift_by_heat"),
            lambda lever, bias: made_up_shift(bias, moved_nm),
        )
        strip = labelled({"moved_nm": [-10.0, -5.0, 15.0]}, "tip_K", {"tip_K": [500.0, 800, 900]})
        monkeypatch.setattr(claims, "self_heated", lambda silicon, tip: strip)
        page = Findings(coarse)
        page.heading("here")
        claims.shift_section(page)
        return page.claims

    return judge


def test_shift_and_direction_are_judged_apart(verdicts):
    (_, _, size, found, layouts), (_, _, direction, *_) = verdicts(-100.0)
    assert size == "holds"
    assert found.startswith("by up to 100 nm")
    assert layouts.endswith(" nm")
    assert "along the electrons" in direction
    # where the strip turns
    assert "hotter than 825 K" in direction
    (_, _, size, *_), (_, _, direction, found, _) = verdicts(600.0)
    assert size.startswith("holds; not for the reference probe, because")
    assert direction == "does not hold; for the reference probe it holds"
    assert found == "+600 to +600 nm, of which Thomson heat is +60 nm at most"


def test_the_figure_has_both_polarities_and_both_heats():
    figure = figures.thermoelectric_shift(made_up_shift([4.0, 8.0]), made_up_shift([4.0], 50.0))
    place, displacement = figure.axes
    assert len(place.lines) == 4
    assert [line.get_ydata()[0] for line in displacement.lines][:4] == [-100.0, -90.0, -10.0, 50.0]


@pytest.mark.slow
def test_of_the_reference_probe(coarse):
    page = Findings(coarse)
    for heading, section in SECTIONS.items():
        if heading.startswith("Thermoelectricity"):
            page.heading(heading)
            section(page)
    size, direction, prediction = (verdict for _, _, verdict, *_ in page.claims)
    assert size == prediction == "holds"
    assert "along the electrons" in direction
