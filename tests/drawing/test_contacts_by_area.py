"""Contacts over the legs: noted where they count as an end only, and terminals by area."""

from __future__ import annotations

import numpy as np
import pytest

from drawn import box, reference_points
from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.probe.drawing.outlines import DrawingError

ENDS = {"supply": (-3.22, 3.22), "ground": (6.42, 9.88), "reader": (-9.88, -6.42)}
BIAS = [4.0, 7.0]


def lever(reach: float, start: float = -1.0, by_area: bool = True) -> dict:
    """The reference probe with contacts from `start` to `reach` on its legs."""
    values = reference_points()
    for name, (low, high) in ENDS.items():
        contact = box(start, low, reach, high)
        values["terminals"][name] = {"area": contact} if by_area else contact
    return values


def shorter(reach: float) -> Probe:
    """The reference probe drawn with legs that begin where the contacts end."""
    values = reference_points()
    silicon = values["layers"]["silicon"]
    for leg in (0, 3, 4):
        silicon[leg] = [[max(x, reach), y] for x, y in silicon[leg]]
    for name, (low, high) in ENDS.items():
        values["terminals"][name] = [[reach, low], [reach, high]]
    return Probe.from_sections(values, "shorter")


@pytest.mark.parametrize("start", [-1.0, 2.0])
def test_a_terminal_by_area_is_a_lever_with_shorter_legs(start):
    """Also where a stub of the leg is left behind the contact."""
    probe, expected = Probe.from_sections(lever(12.0, start), "by area"), shorter(12.0)
    own, other = probe.layout().terminals, expected.layout().terminals
    assert [one.name for one in own] == [one.name for one in other]
    corners = [[(one.start, one.end) for one in ends] for ends in (own, other)]
    np.testing.assert_allclose(*corners, atol=1e-9)
    found, other = Lever(probe).sweep(BIAS), Lever(expected).sweep(BIAS)
    for name in ("current_mA", "reader_V", "lever_V"):
        np.testing.assert_allclose(found[name], other[name], rtol=2e-5)
    np.testing.assert_allclose(found.tip_K, other.tip_K, atol=0.02)
    edge = Lever(Probe.from_sections(lever(12.0, by_area=False), "edge")).sweep(BIAS)
    assert abs(edge.tip_K - found.tip_K).max() > 10


def test_a_contact_in_a_leg_is_a_hole_with_the_terminal_round_it():
    values = reference_points()
    values["terminals"]["reader"] = {"area": box(1, -9, 3, -7)}
    layout = Probe.from_sections(values, "p").layout()
    assert sum(one.name == "reader" for one in layout.terminals) == 4
    assert sum(len(region.holes) for region in layout.regions) == 1


def test_a_probe_with_a_terminal_by_area_is_written_and_read(tmp_path):
    probe = Probe.from_sections(lever(12.0), "by area")
    probe.to_file(tmp_path / "copy.toml")
    assert Probe.from_file(tmp_path / "copy.toml") == probe
    assert Probe.from_sections(probe.sections(), "copy") == probe
    assert hash(Probe.from_sections(lever(12.0, by_area=False), "edge")) != hash(probe)


def test_a_contact_over_more_than_a_tenth_of_a_leg_is_noted(run, tmp_path):
    Probe.from_sections(lever(6.0, by_area=False), "p").to_file(tmp_path / "own.toml")
    for command in (["sweep", "own.toml", "--bias", "4:4:1"], ["probe", "show", "own.toml"]):
        status, _, err = run(*command)
        assert status == 0
        (line,) = [line for line in err.splitlines() if "'supply'" in line]
        assert "covers 6 µm of a leg of 46.6 µm but counts as its end only" in line
        assert "rest as bare silicon" in line
        assert 'supply = { area = "LAYER" } in [terminals]' in line
        assert "a film: [layers.NAME]" in line


@pytest.mark.parametrize(
    "values", [lever(4.0, by_area=False), lever(30.0), reference_points()], ids=str
)
def test_a_contact_that_just_overlaps_is_not_noted(values):
    assert Probe.from_sections(values, "p").shape.notes() == []


def test_a_contact_that_is_a_film_too_is_not_noted():
    values = lever(30.0, by_area=False)
    metal = [values["terminals"][name] for name in ENDS]
    values["layers"]["metal"] = {"drawn": metal, "material": "film", "thickness_um": 0.1}
    values["materials"] = {"film": {"kind": "metal-film", "preset": "Pd"}}
    assert Probe.from_sections(values, "p").shape.notes() == []
    del values["layers"]["metal"], values["materials"]
    assert len(Probe.from_sections(values, "p").shape.notes()) == 3


@pytest.mark.parametrize(
    ("terminal", "section", "message"),
    [
        ("supply", {"area": box(-1, -12, 60, 12)}, "'supply', at .*: it covers the tip"),
        ("supply", {"area": box(-9, -3, -2, 3)}, "'supply', polygon 1, .* lies outside the sil"),
        ("ground", {"area": box(1, -4, 3, 10)}, "'supply', at .*another terminal, stated by area"),
        ("supply", {"area": box(-1, -3.215, 9, 3.22)}, "'supply', polygon 1, .*its border leaves"),
        ("supply", {"aera": box(0, 0, 1, 1)}, r"\[terminals.supply\]: unknown key 'aera'.*'area'"),
        ("supply", {}, r"\[terminals.supply\]: area is missing"),
    ],
)
def test_terminals_by_area_that_are_wrong(terminal, section, message):
    values = reference_points()
    values["terminals"][terminal] = section
    with pytest.raises((InputError, DrawingError), match=message) as caught:
        Probe.from_sections(values, "probe.toml")
    assert "\n" not in str(caught.value)
