"""A drawing's scale, and the shift of its edges by etching."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, union_all

from drawn import box, pointed_lever, reference_points
from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.probe import Probe


def changed(**changes) -> Probe:
    values = reference_points()
    values["probe"] |= changes
    return Probe.from_sections(values, "p")


def outline(probe: Probe) -> Polygon:
    return union_all([Polygon(one.outline, one.holes) for one in probe.layout().regions])


def as_points(scale: float) -> Probe:
    """The reference probe drawn larger."""
    values = reference_points()
    values["probe"]["tip_um"] = (scale * np.array(values["probe"]["tip_um"])).tolist()
    for section in ("layers", "terminals"):
        for name, rings in values[section].items():
            many = isinstance(rings[0][0], list)
            larger = [(scale * np.array(one)).tolist() for one in (rings if many else [rings])]
            values[section][name] = larger
    return Probe.from_sections(values, "larger")


def test_a_scaled_drawing_is_one_that_is_drawn_larger():
    probe, expected = changed(scale=1.25), as_points(1.25)
    assert probe.layout().tip == pytest.approx(expected.layout().tip)
    assert outline(probe).symmetric_difference(outline(expected)).area < 1e-6
    found, other = Lever(probe).sweep([4.0, 7.0]), Lever(expected).sweep([4.0, 7.0])
    np.testing.assert_allclose(found.current_mA, other.current_mA, rtol=2e-5)
    np.testing.assert_allclose(found.tip_K, other.tip_K, atol=0.02)
    assert probe.layout().thickness_um == 0.4


@pytest.mark.parametrize("bias", [0.1, -0.1])
def test_edges_are_where_those_of_the_same_lever_of_dimensions_are(bias):
    """The doped window of the drawing stays, so the lever of dimensions has a shorter heater."""
    values = reference_points()
    values["probe"]["edge_bias_um"] = bias
    values["layers"]["heater"] = box(46.58 + bias, -2, 50.58 - bias, 2)
    found = Probe.from_sections(values, "p")
    expected = Probe.reference().with_(edge_bias_um=bias, heater_length_um=4 - 2 * bias)
    reader = expected.shape.reader_centre_um or 2 / 3 * 54.4
    expected = expected.with_(reader_centre_um=reader)
    assert outline(found).symmetric_difference(outline(expected)).area < 1e-6
    ends = {(one.name, *map(tuple, np.round([one.start, one.end], 6).tolist())) for one in
            expected.layout().terminals}  # fmt: skip
    own = {(one.name, *map(tuple, np.round([one.start, one.end], 6).tolist())) for one in
           found.layout().terminals}  # fmt: skip
    assert {name for name, *_ in own} == {name for name, *_ in ends}
    assert {frozenset(rest) for _, *rest in own} == {frozenset(rest) for _, *rest in ends}
    (one,), (other,) = (Lever(probe).sweep([7.0]).tip_K.values for probe in (found, expected))
    # the reader of the drawing is elsewhere by nanometres
    assert one == pytest.approx(other, abs=0.05)


def test_layers_that_end_at_the_outline_follow_it():
    """Low-doped parts drawn exactly as wide as the silicon, one with slanted borders."""
    values = reference_points()
    values["layers"]["heater"] = box(46.58, -0.8225, 50.58, 0.8225)
    values["layers"]["reader"] = [[34, -9.88], [38, -9.88], [37, -6.42], [33, -6.42]]
    values["probe"]["edge_bias_um"] = 0.1
    layout = Probe.from_sections(values, "p").layout()
    regions = {region.name: region for region in layout.regions}
    assert regions["heater"].area == pytest.approx(4 * 1.845, abs=1e-4)
    assert regions["reader"].area == pytest.approx(4 * 3.66, abs=1e-4)
    # its borders go straight on
    slant = sorted(regions["reader"].outline, key=lambda corner: corner[1])
    assert slant[0][0] - slant[-1][0] == pytest.approx(3.66 / 3.46, abs=1e-4) or (
        slant[0][0] - slant[-2][0]
    ) == pytest.approx(3.66 / 3.46, abs=1e-4)
    assert len(layout.regions) == 5


@pytest.mark.parametrize("bias", [0.1, -0.1])
def test_slanted_legs_arcs_and_holes(tmp_path, bias):
    file = pointed_lever(tmp_path / "lever.dxf")
    values = {
        "probe": {
            "shape": "drawing", "file": str(file), "thickness_um": 0.4, "tip_um": [50.0, 0.0]
        },
        "layers": {"silicon": "SI", "heater": "HEATER"},
        "terminals": {"supply": "V+", "ground": "GND"},
    }  # fmt: skip
    plain = outline(Probe.from_sections(values, "p"))
    values["probe"]["edge_bias_um"] = bias
    probe = Probe.from_sections(values, "p")
    etched = outline(probe)
    # the leg ends, 8 µm wide each, stay on their line
    assert etched.bounds[0] == pytest.approx(0.0, abs=1e-9)
    expected = plain.area + bias * (plain.length - 16.0)
    assert etched.area == pytest.approx(expected, abs=20 * bias**2)
    (hole,) = (one for region in probe.layout().regions for one in region.holes)
    assert np.sqrt(Polygon(hole).area / np.pi) == pytest.approx(1.0 - bias, abs=2e-3)
    assert len({one.name for one in probe.layout().terminals}) == 2


def test_what_etching_leaves_of_no_lever_is_refused():
    with pytest.raises(InputError, match="with edge_bias_um = -1 2 pieces are left, expected one"):
        changed(edge_bias_um=-1.0)
    with pytest.raises(InputError, match="edge_bias_um = 3"):
        changed(edge_bias_um=3.0)
    with pytest.raises(InputError, match="expected 5 to 2000 µm; are unit and scale right"):
        changed(scale=0.05)


def test_places_in_errors_are_those_of_the_drawing():
    values = reference_points()
    values["probe"]["scale"] = 2.0
    values["layers"]["heater"] = [values["layers"]["heater"], box(100, 0, 104, 3)]
    with pytest.raises(InputError, match=r"polygon 2, at \(102.000, 1.500\) µm"):
        Probe.from_sections(values, "p")


def test_a_prior_of_a_drawing_s_edges_is_refused_in_one_line(run, tmp_path):
    changed().to_file(tmp_path / "own.toml")
    data = "V_b (V), I_h (mA)\n" + "".join(f"{v}, {0.1 * v}\n" for v in range(1, 9))
    (tmp_path / "iv.csv").write_text(data, encoding="utf-8")
    status, _, err = run(
        "calibrate", "iv.csv", "--probe", "own.toml", "--prior", "edge_bias_um=0±0.1"
    )
    assert status == 2
    assert "edge_bias_um" in err
    assert err.count("\n") == 1
