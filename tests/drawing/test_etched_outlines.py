"""A drawing's scale, and the shift of its edges by etching."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, union_all

from drawn import box, pointed_sections, reference_points
from hotlever.errors import InputError
from hotlever.estimate import Measurement, fit
from hotlever.lever import Lever
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.probe import Probe
from hotlever.probe.drawing.kit import drawn_shape


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
@pytest.mark.parametrize("shape", ["three-leg", "u-shape", "u-shape, filled", "u-shape, a bar"])
def test_a_lever_of_dimensions_is_etched_as_the_same_one_drawn_is(shape, bias):
    """The shoulders of its heater stayed: the reference probe was off by 7 K at 0.1 µm."""
    plain = {
        "three-leg": Probe.reference(),
        "u-shape": Probe.u_shape(),
        "u-shape, filled": Probe.u_shape().with_(heater_length_um=6.0),
        "u-shape, a bar": Probe.u_shape().with_(heater_width_um=4.0),
    }[shape]
    sections = plain.sections() | drawn_shape(plain.shape).sections()
    drawn = Probe.from_sections(sections, "p").with_(edge_bias_um=bias)
    built_in = plain.with_(edge_bias_um=bias)
    assert outline(drawn).symmetric_difference(outline(built_in)).area < 1e-6
    (one,), (other,) = (Lever(probe).sweep([7.0]).tip_K.values for probe in (drawn, built_in))
    # where a border goes on straight, parts of the same silicon end elsewhere
    assert one == pytest.approx(other, abs=0.05)


@pytest.mark.parametrize("shift", [0.1, -0.1])
@pytest.mark.parametrize("layer", ["silicon", "heater"])
def test_a_shifted_layer_shows_what_one_drawn_so_does(layer, shift):
    """A window that is drawn wider has other parts: within 0.3 K of the 26 K that it does."""
    values = reference_points()
    probe = Probe.from_sections(values, "p").with_(**{f"{layer}.edge_bias_um": shift})
    if layer == "heater":
        values["layers"]["heater"] = box(46.58 - shift, -2 - shift, 50.58 + shift, 2 + shift)
    else:
        silicon = union_all([Polygon(ring) for ring in values["layers"]["silicon"]])
        wider = silicon.buffer(shift, join_style="mitre").intersection(Polygon(box(0, -20, 60, 20)))
        if shift < 0:  # legs end where they end
            ends = [box(0, low - shift, 1, high + shift) for low, high in
                    ((-3.22, 3.22), (6.42, 9.88), (-9.88, -6.42))]  # fmt: skip
            wider = union_all([wider, *map(Polygon, ends)])
        values["layers"]["silicon"] = [list(wider.exterior.coords)[:-1]]
        for line in values["terminals"].values():
            low, high = line[0][1], line[1][1]
            line[0][1], line[1][1] = low - shift, high + shift
    found, expected = Lever(probe), Lever(Probe.from_sections(values, "drawn so"))
    (tip,), (other) = (lever.sweep([7.0]).tip_K.values for lever in (found, expected))
    assert tip == pytest.approx(*other, abs=0.35)
    plain = Lever(Probe.from_sections(reference_points(), "p")).sweep([7.0]).tip_K.values
    assert abs(tip - plain[0]) > 20


def test_layers_that_end_at_the_outline_follow_it():
    """Low-doped parts drawn exactly as wide as the silicon, one with slanted borders."""
    values = reference_points()
    values["layers"]["heater"] = box(46.58, -0.8225, 50.58, 0.8225)
    values["layers"]["reader"] = [[34, -9.88], [38, -9.88], [37, -6.42], [33, -6.42]]
    values["probe"]["edge_bias_um"] = 0.1
    layout = Probe.from_sections(values, "p").layout()
    regions = {region.name: region for region in layout.regions}
    # it ends where the neck does
    assert regions["heater"].area == pytest.approx(3.8 * 1.845, abs=1e-4)
    assert regions["heater"].taper.length_um == pytest.approx(4.0, abs=1e-6)
    assert regions["reader"].area == pytest.approx(4 * 3.66, abs=1e-4)
    # its borders go straight on
    slant = sorted(regions["reader"].outline, key=lambda corner: corner[1])
    assert slant[0][0] - slant[-1][0] == pytest.approx(3.66 / 3.46, abs=1e-4) or (
        slant[0][0] - slant[-2][0]
    ) == pytest.approx(3.66 / 3.46, abs=1e-4)
    assert len(layout.regions) == 5


@pytest.mark.parametrize("bias", [0.1, -0.1])
def test_slanted_legs_arcs_and_holes(tmp_path, bias):
    values = pointed_sections(tmp_path / "lever.dxf")
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
    why = "with silicon.edge_bias_um = -1 a part of the lever turns over"
    with pytest.raises(InputError, match=why):
        changed(edge_bias_um=-1.0)
    # the gap between the legs is closed
    with pytest.raises(InputError, match=r"silicon.edge_bias_um = 1.7 a part of the lever"):
        changed(edge_bias_um=1.7)
    with pytest.raises(InputError, match="edge_bias_um = 3"):
        changed(edge_bias_um=3.0)
    with pytest.raises(InputError, match=r"heater.* edge_bias_um = -2 nothing of it is left"):
        changed().with_(**{"heater.edge_bias_um": -2.0})
    with pytest.raises(InputError, match="expected 5 to 2000 µm; are unit and scale right"):
        changed(scale=0.05)


def test_a_shift_of_all_edges_is_that_of_the_outline(tmp_path):
    probe = changed(edge_bias_um=0.05)
    assert probe.sections()["layers"]["silicon"]["edge_bias_um"] == 0.05
    assert probe.values(["silicon.edge_bias_um"]).tolist() == [0.05]
    assert changed().with_(edge_bias_um=0.05) == probe
    probe = probe.with_(**{"heater.edge_bias_um": -0.1, "prior.edge_bias_um": "± 0.1"})
    assert probe.stated_priors == {"silicon.edge_bias_um": "± 0.1"}
    for drawing in (None, tmp_path / "own.gds"):
        probe.to_file(tmp_path / "own.toml", drawing)
        read = Probe.from_file(tmp_path / "own.toml")
        assert read.shape.dimensions() == probe.shape.dimensions()
    values = reference_points()
    values["prior"] = dict.fromkeys(("edge_bias_um", "silicon.edge_bias_um"), "± 0.1")
    with pytest.raises(InputError, match=r"\[prior\]: edge_bias_um: expected silicon.edge_bias_um"):
        Probe.from_sections(values, "p")
    values = reference_points()
    values["probe"]["edge_bias_um"] = 0.1
    values["layers"]["silicon"] = {"drawn": values["layers"]["silicon"], "edge_bias_um": 0.1}
    with pytest.raises(InputError, match=r"expected it in \[layers.silicon\] only"):
        Probe.from_sections(values, "p")


def test_edges_that_no_dopant_comes_from_are_not_shifted():
    values = reference_points()
    values["materials"] = {"gold": {"kind": "metal-film", "preset": "Au"}}
    metal = {"drawn": box(0, -3.22, 20, 3.22), "material": "gold", "thickness_um": 0.05}
    values["layers"]["metal"] = metal
    assert "metal.edge_bias_um" not in Probe.from_sections(values, "p").shape.dimensions()
    values["layers"]["metal"] = {**metal, "edge_bias_um": 0.1}
    expected = r"layers.metal.*: no dopant .*expected it of silicon, heater, reader"
    with pytest.raises(InputError, match=expected):
        Probe.from_sections(values, "p")


def test_places_in_errors_are_those_of_the_drawing():
    values = reference_points()
    values["probe"]["scale"] = 2.0
    values["layers"]["heater"] = [values["layers"]["heater"], box(100, 0, 104, 3)]
    with pytest.raises(InputError, match=r"polygon 2, at \(102.000, 1.500\) µm"):
        Probe.from_sections(values, "p")


# --- edges that are uncertain ---------------------------------------------------------------------

EDGES = ("silicon.edge_bias_um", "heater.edge_bias_um")
REACH = Reach(Probe.reference().circuit, 6.0)


@pytest.fixture(scope="module", params=["reference", "pointed", "slanted"])
def similar(request, tmp_path_factory):
    values = reference_points()
    if request.param == "slanted":
        # borders that end on long edges, and the heater is no strip
        values["layers"]["heater"] = [[46.9, -2], [50.2, -2], [50.0, 2], [47.2, 2]]
    if request.param == "pointed":
        values = pointed_sections(tmp_path_factory.mktemp("drawn") / "lever.dxf")
    return SimilarLevers(Lever(Probe.from_sections(values, "p"), COARSE))


@pytest.fixture(scope="module")
def start(similar):
    return similar.linearised(similar.drawn, REACH, None, EDGES)


@pytest.mark.parametrize("name", EDGES)
def test_derivatives_by_edges_have_taylor_order_two(name, similar, start):
    rest = []
    slopes = start.output_slopes[1:, :2, EDGES.index(name)]
    for step in (0.02, 0.01):
        branch = similar.linearised(
            similar.drawn.replace({name: step}), REACH, start, (name,)
        ).branch
        change = (branch.values[: start.branch.u.size] - start.branch.values)[1:, :2]
        rest.append(np.abs((change - step * slopes) / start.branch.values[1:, :2]).max())
    assert rest[0] < 1e-3
    assert np.log2(rest[0] / rest[1]) > 1.9


def test_a_moved_mesh_shows_what_a_new_one_of_shifted_edges_does(similar, start):
    probe = similar.drawn.replace({EDGES[0]: -0.1, EDGES[1]: 0.1})
    u = np.linspace(2.0, 9.0, 8)
    moved = similar.linearised(probe, REACH, start, EDGES[1:]).branch.curve(u)[:, :2]
    new = Lever(probe, COARSE).branch_to(6.0).curve(u)[:, :2]
    np.testing.assert_allclose(moved, new, rtol=1e-3)


def test_a_window_of_another_width_is_found(coarse_meshes):
    """Bias and current of a lever whose heater is 0.15 µm wider on each side than it is drawn."""
    drawn = Probe.from_sections(reference_points(), "p")
    true = Lever(drawn.with_(**{"heater.edge_bias_um": 0.15}))
    curve = true.sweep(np.linspace(0.5, 9.0, 20))
    nothing = np.full(20, np.nan)
    shown = (curve.bias_V.values, curve.current_mA.values, nothing, curve.tip_K.values, nothing)
    measured = Measurement(*shown)
    found = fit(measured, probe=drawn, priors={"heater.edge_bias_um": "± 0.2", "delta": "± 1%"})
    assert found.parameters["heater.edge_bias_um"].value == pytest.approx(0.15, abs=0.02)


def test_a_prior_of_edges_is_stated_by_layer(run, refused, tmp_path):
    changed().to_file(tmp_path / "own.toml")
    data = "V_b (V), I_h (mA)\n" + "".join(f"{v}, {0.1 * v}\n" for v in range(1, 9))
    (tmp_path / "iv.csv").write_text(data, encoding="utf-8")

    def of_prior(prior: str) -> str:
        return refused("calibrate", "iv.csv", "--probe", "own.toml", "--prior", prior)

    assert "in its unit such as '± 0.2'" in of_prior("heater.edge_bias_um=0.1x/2")
    assert "did you mean 'heater.edge_bias_um'" in of_prior("heatre.edge_bias_um=±0.1")
    status, _, err = run(
        *("calibrate", "iv.csv", "--probe", "own.toml", "--prior", "edge_bias_um=±0.1"),
        *("--prior", "silicon.edge_bias_um=±0.1"),
    )
    assert (status, "silicon.edge_bias_um alone" in err) == (2, True)
    err = of_prior("dimensions=±2%")
    assert "a spread such as '± 0.1' of silicon.edge_bias_um, heater.edge_bias_um" in err
