"""Levers drawn in Python, by functions of dimensions too."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from drawn_in_python import GOLD, pointed, three_leg
from experiments import on_coarse_meshes
from hotlever.errors import ComputationError, InputError
from hotlever.estimate import Measurement, fit, read_fit
from hotlever.lever import Lever
from hotlever.lever.branch import Reach
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.probe import Probe, ProbeMesh, drawing
from hotlever.probe.drawing import Drawing, Layer, difference, fillet, rectangle, union
from hotlever.probe.layout import BorderTaper
from hotlever.probe.mesh import terminal_facets
from hotlever.processes import local_processes
from hotlever.studies.design import Design

REFERENCE = Probe.from_drawing(three_leg)
#: A rounded slit, slanted legs, a heater that is no strip, a hole, a film.
POINTED = Probe.from_drawing(pointed, GOLD)
VARIED = ("front_um", "slit_um", "radius_um", "hole_radius_um", "track_um", "edge_bias_um")
REACH = Reach(Probe.reference().circuit, 6.0)


def simple(length_um=34.0, leg_um=4.0, thickness_um=0.4, **changes: Any) -> Drawing:
    leg, bar = rectangle(0, 2, 30, 2 + leg_um), rectangle(30, -2 - leg_um, length_um, 2 + leg_um)
    drawn: dict[str, Any] = {
        "layers": {
            "silicon": union(leg, drawing.mirror(leg), bar),
            "heater": rectangle(29, -2, length_um + 1, 2),
        },
        "terminals": {"supply": [(0, -2 - leg_um), (0, -2)], "ground": [(0, 2), (0, 2 + leg_um)]},
        "tip_um": (32, 0),
        "thickness_um": thickness_um,
    }
    return Drawing(**drawn | changes)


def varied(length_um=34.0, leg_um=4.0) -> Drawing:
    """A lever with another outline if its legs are wide."""
    whole = simple(length_um, leg_um).layers["silicon"]
    if leg_um <= 4.0:
        return simple(length_um, leg_um)
    holed = difference(whole, rectangle(10, 3, 12, 5))
    return simple(length_um, leg_um, layers={**simple(length_um, leg_um).layers, "silicon": holed})


# --- the same lever as one of a built-in shape ------------------------------------------------


def test_the_reference_probe_shows_what_it_does_as_a_built_in_shape(lever):
    """Its derivatives by the logarithms of dimensions, on the same triangles, within 2e-5."""
    drawn, names = Lever(REFERENCE), tuple(REFERENCE.shape.dimensions())[1:]
    assert set(names) <= set(lever.probe.shape.dimensions())
    layout, triangles = lever.space.mesh.layout, drawn.space.mesh.elements
    middle = triangles.p[:, triangles.t].mean(axis=1)
    inside = [np.all((x.box[0] < middle.T) & (x.box[1] > middle.T), 1) for x in layout.regions]
    region, ends = np.argmax(inside, axis=0), terminal_facets(triangles, layout)
    same = Lever(lever.probe, space=FullSpace(ProbeMesh(layout, triangles, region, ends)))
    mine, built_in = (
        SimilarLevers(one).linearised(one.probe, REACH, None, names) for one in (drawn, same)
    )
    expected = built_in.branch.values[1:, :3]
    np.testing.assert_allclose(mine.branch.values[1:, :3], expected, rtol=1e-11)
    apart = (
        (mine.output_slopes - built_in.output_slopes)[1:, :3]
        * REFERENCE.values(names)
        / expected[..., None]
    )
    assert np.abs(apart).max() < 2e-5
    # and on a mesh of its own
    u = np.linspace(2.0, 9.0, 8)
    own = lever.branch_to(6.0).curve(u)[:, :3]
    np.testing.assert_allclose(mine.branch.curve(u)[:, :3], own, rtol=1e-5)


@pytest.fixture(scope="module")
def similar():
    return SimilarLevers(Lever(POINTED, COARSE))


@pytest.fixture(scope="module")
def start(similar):
    """With the derivatives by all that is varied below."""
    return similar.linearised(POINTED, REACH, None, VARIED)


@pytest.mark.parametrize("name", VARIED)
def test_derivatives_have_taylor_order_two(name, similar, start):
    """Of corners that move along curves, borders of any shape, and films that thicken."""
    assert isinstance(POINTED.layout().heater.taper, BorderTaper)
    (value,), rest = POINTED.values((name,)).tolist(), []
    slopes = start.output_slopes[1:, :2, VARIED.index(name)]
    for step in (0.02, 0.01):
        way = step * (value or 1.0)
        perturbed_probe = POINTED.replace({name: value + way})
        branch = similar.linearised(perturbed_probe, REACH, start, (name,)).branch
        change = (branch.values[: start.branch.u.size] - start.branch.values)[1:, :2]
        rest.append(np.abs((change - way * slopes) / start.branch.values[1:, :2]).max())
    assert rest[0] < 1e-3
    assert np.log2(rest[0] / rest[1]) > 1.9


def test_a_moved_mesh_shows_what_a_new_one_does(similar, start):
    """Far away too, where corners on arcs have moved along curves."""
    probe = POINTED.with_(radius_um=1.2, hole_radius_um=1.0, slit_um=3.2, track_um=0.06)
    u = np.linspace(2.0, 9.0, 8)
    predicted = similar.linearised(probe, REACH, start, VARIED[:1]).branch.curve(u)[:, :2]
    new = Lever(probe, COARSE).branch_to(6.0).curve(u)[:, :2]
    np.testing.assert_allclose(predicted, new, rtol=1e-3)


# --- dimensions -------------------------------------------------------------------------------


def test_dimensions_are_those_of_the_function_and_vary_by_name():
    probe = REFERENCE.with_(heater_length_um=5.0, n_d=4e17)
    assert probe.layout().heater_taper.length_um == pytest.approx(5.0)
    assert "length_um = 54.4                # base to front edge" in REFERENCE.to_toml()
    assert list(REFERENCE.shape.dimensions())[1:3] == ["length_um", "centre_leg_width_um"]
    assert Design(REFERENCE).usual[0] == "length_um"
    with pytest.raises(InputError, match="did you mean 'heater_length_um'"):
        REFERENCE.with_(heater_lenght_um=5.0)
    with pytest.raises(InputError, match="gap_um = -1: expected more than 0"):
        REFERENCE.with_(gap_um=-1)


def test_a_function_that_draws_another_outline_for_other_dimensions_is_refused():
    probe = Probe.from_drawing(varied)
    # as a lever of its own it is one
    assert any(region.holes for region in probe.with_(leg_um=4.5).layout().regions)
    similar = SimilarLevers(Lever(probe, COARSE))
    with pytest.raises(InputError, match=r"leg_um cannot change by itself here: .* other corners"):
        similar.equations(probe, ("leg_um",))
    with pytest.raises(ComputationError, match="the lever gets other parts or corners"):
        similar.equations(probe.with_(leg_um=4.5))
    similar.equations(probe, ("length_um",))


def test_a_fit_with_priors_on_its_dimensions_is_read_back(tmp_path):
    true = REFERENCE.with_(heater_width_um=1.7, n_d=5.5e17)
    measured = Measurement.of_sweep(Lever(true, COARSE).sweep(np.linspace(1.0, 9.0, 9)))
    held = dict.fromkeys(("c_kappa", "delta", "p", "a0", "a1"))
    with on_coarse_meshes():
        found = fit(measured, REFERENCE, fixed=held, priors={"heater_width_um": "± 5%"})
    assert found.parameters["heater_width_um"].value == pytest.approx(1.7, rel=5e-3)
    found.write(tmp_path / "fit.json")
    assert read_fit(tmp_path / "fit.json").probe == found.probe


# --- other processes and files ------------------------------------------------------------------


def box_of(probe: Probe) -> list[float]:
    return probe.with_(length_um=60.0).layout().box.ravel().tolist()


def test_a_worker_draws_what_it_can_import():
    assert pickle.loads(pickle.dumps(POINTED)) == POINTED
    with local_processes(2) as run:
        assert run(box_of, [(REFERENCE,)]) == [[0.0, -9.88, 60.0, 9.88]]


def test_a_function_inside_another_cannot_be_sent():
    def inner(length_um=34.0) -> Drawing:
        return simple(length_um)

    with pytest.raises(InputError, match=r"inner cannot be sent to other processes: expected a f"):
        pickle.dumps(Probe.from_drawing(inner))


def test_a_file_names_a_function_and_runs_none(tmp_path, monkeypatch):
    REFERENCE.to_file(tmp_path / "lever.toml")
    assert Probe.from_file(tmp_path / "lever.toml") == REFERENCE
    text = (tmp_path / "lever.toml").read_text().replace("drawn_in_python.three_leg", "os.getcwd")
    (tmp_path / "other.toml").write_text(text)
    with pytest.raises(InputError, match=r"'os.getcwd' is Python, which no file holds: expected"):
        Probe.from_file(tmp_path / "other.toml")


@pytest.mark.parametrize("probe", [POINTED, Probe.u_shape(), REFERENCE.with_(gap_um=3.25)])
def test_gdsii_and_a_probe_file_give_the_same_lever(probe, tmp_path):
    """To the steps of the file's coordinates, 0.1 nm."""
    probe.to_file(tmp_path / "lever.toml", drawing=tmp_path / "lever.gds")
    again = Probe.from_file(tmp_path / "lever.toml")
    before, after = probe.layout(), again.layout()
    assert (again.materials, again.circuit) == (probe.materials, probe.circuit)
    assert after.tip == before.tip
    apart = np.abs(before.corners[:, None] - after.corners).max(axis=2)
    # each has the other's corners; a built-in shape's legs are cut into more regions
    assert apart.min(axis=0).max() < 5.1e-5
    assert sum(one.area for one in after.regions) == pytest.approx(
        sum(one.area for one in before.regions), rel=1e-4
    )
    mine, same = (Lever(one, COARSE).sweep([4.0]).current_mA.item() for one in (probe, again))
    assert same == pytest.approx(mine, rel=2e-4)


def test_a_probe_draws_itself():
    (axes,) = REFERENCE.draw("mine").axes
    assert {text.get_text() for text in axes.texts} == {"supply", "ground", "reader"}


# --- areas, and what is wrong ---------------------------------------------------------------------


def test_arcs_are_on_their_circle_whatever_the_angle():
    triangle = [(0, 0), (10, 0), (3, 6)]
    rounded = np.array(fillet(triangle, 0.8, [(3, 6)]).exterior.coords)
    inner = np.array(fillet(triangle, 0.8, [(3, 6)], quarter=64).exterior.coords)
    arc = inner[~np.isclose(inner[:, 1], 0.0)]
    radii = np.linalg.norm(arc - arc.mean(axis=0), axis=1)
    centre, *_ = np.linalg.lstsq(2 * np.c_[arc, np.ones(len(arc))], (arc**2).sum(1), rcond=None)
    np.testing.assert_allclose(np.linalg.norm(arc - centre[:2], axis=1), 0.8, rtol=1e-9)
    assert radii.size > rounded.shape[0]


AT = [(0.0, 2.0), (0.0, 6.0)]
CROSSED = [(0, 0), (4, 4), (4, 0), (0, 4)]
FAULTS = {
    "crossed": (lambda: union(CROSSED), r"union, polygon 1, at \(2\.000, 2\.000\) µm: an outline"),
    "no area": (lambda: fillet("2/0", 1.0), "fillet: found '2/0', expected a polygon or points"),
    "nothing": (lambda: difference(rectangle(0, 0, 1, 1), rectangle(0, 0, 2, 2)), "nothing is lef"),
    "radius": (
        lambda: fillet(rectangle(0, 0, 10, 2), 1.5),
        r"fillet, at .*: with a radius of 1\.5 µm its arcs need 3 µm of an edge of 2 µm, "
        "expected a radius of at most 1 µm",
    ),
    "negative radius": (lambda: fillet(rectangle(0, 0, 1, 1), -1.0), "found a radius of -1 µm"),
    "terminal": (
        lambda: Probe.from_drawing(simple(terminals={"supply": [(-9, 0), (-9, 2)], "ground": AT})),
        "drawing: terminal 'supply'.*: it touches no edge of the silicon; the nearest is 9 µm",
    ),
    "no terminal": (
        lambda: Probe.from_drawing(simple(terminals={"suply": [(0, -6), (0, -2)]})),
        "supply is missing; is it meant by 'suply'",
    ),
    "layer": (
        lambda: Probe.from_drawing(simple(layers={"silicn": rectangle(0, 0, 9, 9)})),
        r"drawing: \[layers\]: silicon is missing; is it meant by 'silicn'\?",
    ),
    "material": (
        lambda: Probe.from_drawing(
            simple(layers={"body": Layer(rectangle(0, 0, 9, 9), "glod")}), GOLD
        ),
        "did you mean 'gold'",
    ),
    "tip": (lambda: Probe.from_drawing(simple(tip_um=(90, 0))), "tip_um, at .* outside the silic"),
    "function": (lambda: Probe.from_drawing(lambda: 3), "returned 3, expected a Drawing"),
    "argument": (
        lambda: Probe.from_drawing(lambda width: simple()),
        "argument width: expected a dimension in µm with its default, such as leg_width_um=6.0",
    ),
    "name": (
        lambda: Probe.from_drawing(lambda height_um=3.0: simple()),
        r"argument height_um is a name of \[tip\], expected another",
    ),
    "neither": (lambda: Probe.from_drawing("lever.gds"), "expected a Drawing or a function"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_is_wrong_is_one_clear_line(name):
    make, line = FAULTS[name]
    with pytest.raises(InputError, match=line) as error:
        make()
    assert "\n" not in str(error.value)
