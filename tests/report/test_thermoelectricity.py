"""What the page says of thermoelectricity."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import figures
from hotlever.datasets import labelled
from hotlever.report.reproduce import SECTIONS
from hotlever.report.reproduce import claim_sections as claims
from hotlever.report.reproduce.findings import Findings
from hotlever.studies.thermoelectric_shift import HEATS, POLARITIES, SIDES


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
