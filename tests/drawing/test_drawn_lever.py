"""Levers of drawings: the same as parametric ones, in any file, place and orientation."""

from __future__ import annotations

from pathlib import Path

import gdstk
import numpy as np
import pytest
from reference_drawing import reference_library
from skfem import MeshTri

from drawn import LAYERS, TERMINALS, TIP, box, drawn, library_of, pointed_sections, turned, written
from drawn import reference_points as points
from hotlever.lever import Lever, read_sweep, write_sweep
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe, ProbeMesh, mesh_layout
from hotlever.probe.drawing.sheet import read_sheet
from hotlever.probe.layout import BorderTaper, Taper
from hotlever.probe.mesh import terminal_facets

TURNED_TIP = turned(np.array(TIP)[:, None])[:, 0]
BIAS = np.linspace(1.0, 11.0, 6)
SHOWN = ("current_mA", "lever_V", "reader_V", "heater_ohm", "tip_K")


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return written(tmp_path_factory.mktemp("drawing") / "reference.gds")


@pytest.fixture(scope="module")
def parametric(lever):
    return lever.sweep(BIAS)


def check_same(sweep, other):
    for name in SHOWN[:-1]:
        np.testing.assert_allclose(sweep[name], other[name], rtol=2e-5)
    np.testing.assert_allclose(sweep.tip_K, other.tip_K, atol=0.02)


def test_the_reference_probe_as_a_drawing(file, parametric):
    probe = drawn(file)
    layout = probe.layout()
    assert layout.heater_taper == Taper(
        pytest.approx(TIP), pytest.approx((1.0, 0.0)), pytest.approx(4)
    )
    assert {region.part for region in layout.regions} == {
        "heater", "leg 1", "leg 2", "reader branch"
    }  # fmt: skip
    check_same(Lever(probe).sweep(BIAS), parametric)


def test_on_the_same_mesh_turned_nothing_changes(file, tmp_path):
    other = written(tmp_path / "turned.gds", turn=True)
    there = drawn(other, TURNED_TIP)
    here = drawn(file)
    mesh = mesh_layout(here.layout())
    turned_mesh = MeshTri(turned(mesh.elements.p), mesh.elements.t)
    layout = there.layout()
    assert [one.name for one in layout.regions] == [one.name for one in here.layout().regions]
    same = ProbeMesh(layout, turned_mesh, mesh.region, terminal_facets(turned_mesh, layout))
    expected = Lever(here, space=FullSpace(mesh)).sweep(BIAS)
    found = Lever(there, space=FullSpace(same)).sweep(BIAS)
    for name in SHOWN:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9)


def test_oasis_says_the_same(file, tmp_path):
    other = drawn(written(tmp_path / "reference.oas")).layout()
    for one, same in zip(other.regions, drawn(file).layout().regions, strict=True):
        assert one.part == same.part
        np.testing.assert_allclose(one.outline, same.outline, atol=1e-9)


def test_a_drawing_on_a_coarser_grid_is_healed(tmp_path):
    """Turned and rounded to whole nanometres, no two edges fit to each other any more."""
    exact = read_sheet(written(tmp_path / "a.gds", turn=True), tolerance_um=0.002)
    cell = gdstk.Cell("ROUNDED")
    for name, layer in exact.layers.items():
        number = int(name.partition("/")[0])
        for ring in layer.rings:
            cell.add(gdstk.Polygon(np.round(ring, 3), layer=number))
    probe = drawn(written(tmp_path / "b.gds", library_of(cell)), TURNED_TIP)
    sweep, expected = Lever(probe).sweep([8.268]), Lever(Probe.reference()).sweep([8.268])
    np.testing.assert_allclose(sweep.current_mA, expected.current_mA, rtol=1e-3)
    np.testing.assert_allclose(sweep.tip_K, expected.tip_K, atol=2.0)


def test_a_drawn_probe_keeps_its_outline_without_the_file(file, tmp_path):
    probe = drawn(file)
    copy = Probe.from_sections(probe.sections(), "copy")
    assert copy == probe
    assert hash(copy.shape) == hash(probe.shape)
    probe.to_file(tmp_path / "copy.toml")
    assert Probe.from_file(tmp_path / "copy.toml") == probe
    changed = probe.with_(thickness_um=0.5, n_d=4e17)
    assert changed.layout().thickness_um == 0.5
    assert changed.layout().regions == probe.layout().regions
    sweep = Lever(probe, COARSE).sweep([2.0])
    write_sweep(sweep, tmp_path / "sweep.nc")
    assert read_sweep(tmp_path / "sweep.nc").tip_K.item() == sweep.tip_K.item()


def test_the_file_is_beside_the_probe_file(file, run, tmp_path):
    (tmp_path / "there").mkdir()
    written(tmp_path / "there" / "lever.gds")
    lines = ['[probe]\nshape = "drawing"\nfile = "lever.gds"\nthickness_um = 0.4']
    lines += [f"tip_um = [{TIP[0]}, {TIP[1]}]"]
    for section, entries in (("layers", LAYERS), ("terminals", TERMINALS)):
        lines += [f"[{section}]", *(f'{name} = "{layer}"' for name, layer in entries.items())]
    (tmp_path / "there" / "probe.toml").write_text("\n".join(lines), encoding="utf-8")
    status, out, _ = run("probe", "show", "there/probe.toml", "--plot", "show.png")
    assert status == 0
    assert "heater: heater, 6.58 µm², low-doped strip, 4 µm from border to border" in out
    assert run("sweep", "there/probe.toml", "--bias", "4:4:1", "--set", "thickness_um=0.5")[0] == 0


def test_cells_in_cells_arrays_and_holes(tmp_path):
    """A bridge with a row of holes, each as GDSII writes it, in an array of a cell in a cell."""
    library = reference_library()
    (lever,) = library.top_level()
    hole = gdstk.Cell("HOLE")
    hole.add(
        *gdstk.boolean(
            gdstk.rectangle((0, 0), (2, 2)), gdstk.rectangle((0.5, 0.5), (1.5, 1.5)), "not", layer=1
        )
    )
    row = gdstk.Cell("ROW")
    row.add(gdstk.Reference(hole, columns=1, rows=3, spacing=(2, 2)))
    library.add(hole, row)
    # the outer edges of the row lie on the front edge of the bridge
    lever.add(gdstk.Reference(row, (54.4, -3.0)))
    layout = drawn(written(tmp_path / "holes.gds", library)).layout()
    bridge = next(region for region in layout.regions if len(region.holes))
    assert len(bridge.holes) == 3
    solid = drawn(written(tmp_path / "solid.gds")).layout()
    area = sum(region.area for region in solid.regions)
    assert sum(region.area for region in layout.regions) == pytest.approx(area + 3 * 3.0)
    mesh = mesh_layout(layout)
    assert mesh.elements.nelements > 400


def test_dxf_with_arcs_blocks_and_outlines_of_lines(tmp_path):
    found = {}
    for unit in (1.0, 1000.0):
        sections = pointed_sections(tmp_path / f"lever{unit:g}.dxf", unit)
        probe = Probe.from_sections(sections, "test")
        found[unit] = probe.layout()
    layout = found[1.0]
    assert [len(region.holes) for region in layout.regions] == [0, 0, 1]
    half = [(0, 20), (44, 7), (54, 2), (54, 0), (42, 0), (42, 2), (0, 12)]
    exact = 2 * polygon_area(half) + np.pi * 2**2 / 2 - np.pi * 1**2
    area = sum(region.area for region in layout.regions)
    # chords within 2 nm of arcs 2 µm and 1 µm in radius
    assert area == pytest.approx(exact, abs=0.002 * 4 * np.pi)
    assert area != pytest.approx(exact, abs=1e-6)
    in_mm = sum(region.area for region in found[1000.0].regions)
    assert in_mm == pytest.approx(area, rel=1e-9)
    sweep = Lever(probe).sweep([3.0, 9.0])
    np.testing.assert_allclose(sweep.ground_current_mA, sweep.current_mA, rtol=1e-9)
    np.testing.assert_allclose(sweep.end_heat_mW, sweep.power_mW, rtol=1e-6)


def polygon_area(outline):
    x, y = np.array(outline, dtype=float).T
    return abs(0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def test_a_heater_round_a_corner_takes_the_distance_to_its_borders():
    values = points()
    values["layers"]["heater"] = [box(40, -4, 50.58, 4)]
    layout = Probe.from_sections(values, "test").layout()
    taper = layout.heater.taper
    assert isinstance(taper, BorderTaper)
    back, front = sorted(taper.borders, key=lambda border: border[0][0])
    assert {x for x, _ in back} == {40.0}
    assert {x for x, _ in front} == {50.58}
    away = taper.distances(np.array([[41.0, 46.0], [3.0, 3.0]]))
    np.testing.assert_allclose(away[0], [1.0, 6.0])
    # the front border ends at y = 0.8225
    np.testing.assert_allclose(away[1, 1], np.hypot(4.58, 3.0 - 0.8225))


def test_distances_to_borders_make_the_papers_profile_of_a_strip(coarse):
    layout = coarse.probe.layout()
    taper = layout.heater_taper
    x0, x1 = taper.centre[0] - 2.0, taper.centre[0] + 2.0
    borders = BorderTaper((((x0, -1.0), (x0, 1.0)), ((x1, -1.0), (x1, 0.0), (x1, 1.0))))
    here = np.stack([np.linspace(x0, x1, 9), np.linspace(-0.8, 0.8, 9)])
    np.testing.assert_allclose(
        np.sort(borders.distances(here), axis=0), np.sort(taper.distances(here), axis=0), atol=1e-12
    )


def test_several_heaters_and_further_terminals():
    values = points()
    heaters = [box(46.58, -2, 50.58, 2), box(10, 6, 14, 11)]
    values["layers"]["heater"] = heaters
    values["terminals"]["cold end"] = values["terminals"].pop("reader")
    probe = Probe.from_sections(values, "test")
    layout = probe.layout()
    assert [region.name for region in layout.regions if region.part == "heater"] == [
        "heater",
        "heater 2",
    ]
    sweep = Lever(probe, COARSE).sweep([4.0])
    assert np.isnan(sweep.reader_V).all()
    one = Lever(Probe.from_sections(points(), "test"), COARSE).sweep([4.0])
    assert sweep.heater_ohm.item() > 1.3 * one.heater_ohm.item()


@pytest.mark.slow
def test_a_fit_of_a_drawn_lever_finds_what_that_of_the_parametric_one_does(file):
    from hotlever.estimate import fit, read_measurement

    data = read_measurement(Path(__file__).parents[2] / "src/hotlever/examples/lever-a.csv")
    found, expected = fit(data, drawn(file)), fit(data, Probe.reference())
    for name, parameter in expected.parameters.items():
        assert found.parameters[name].value == pytest.approx(parameter.value, rel=2e-3)
