"""Drawings are read as CAD programs show them, and what does not count is said."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import gdstk
import pytest
from reference_drawing import reference_library

import drawing_files
from drawn import box, drawn, library_of, reference_points, written
from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.probe.drawing.sheet import Sheet, read_sheet

WHOLE_UM2 = drawing_files.LAYOUT_UM2


def right_of(*names: str) -> float:
    """Area of the silicon of drawings, put into one, less that of the reference probe (µm²)."""
    return sum((drawing_files.DXF | drawing_files.GDS)[name][-1].more for name in names)


def lever(folder: Path, *names: str) -> tuple[Probe, str]:
    """The lever of a file with several things in it, and what is said of it."""
    if names[0] in drawing_files.DXF:
        drawing_files.write_dxf(folder / "lever.dxf", *names)
        return drawing_files.read(folder / "lever.dxf")
    drawing_files.write_gds(folder / "lever.gds", *names)
    return drawing_files.read(folder / "lever.gds")


@pytest.mark.slow
@pytest.mark.parametrize("name", [*drawing_files.DXF, *drawing_files.GDS])
def test_no_drawing_is_read_wrongly_without_a_word(name, tmp_path, coarse):
    (*_, right), tip_K = (drawing_files.DXF | drawing_files.GDS)[name], coarse.sweep([8.0]).tip_K[0]
    kind, write = "gds", drawing_files.write_gds
    if name in drawing_files.DXF:
        kind, write = "dxf", drawing_files.write_dxf
    write(tmp_path / f"lever.{kind}", name)
    *_, verdict = drawing_files.judged(tmp_path / f"lever.{kind}", right, float(tip_K))
    assert verdict in ("right", "said", "refused with one line")


def test_what_has_no_extent_is_left_out_and_counted(tmp_path):
    names = (
        "arc of radius 0 on another layer",
        "arc of radius 0 on the silicon",
        "closed polyline of equal points",
        "polyline of one point on the heater",
        "old polyline of no points",
        "empty hatch on the silicon",
        "solid of equal points on the heater",
        "spline of equal points",
        "upright 3DFACE on the silicon",
    )
    probe, told = lever(tmp_path, *names)
    assert drawing_files.areas(probe) == pytest.approx(WHOLE_UM2, abs=1e-6)
    assert "left out: 1 ARC without extent (layer SILICON)" in told
    assert "left out: 1 ARC without extent (layer NOTES)" in told
    assert "left out: 1 SOLID without extent (layer HEATER)" in told
    assert "left out: 1 3DFACE without an area (layer SILICON)" in told
    # a probe file is told of its own layers
    notes = probe.shape.notes()
    assert "left out: 1 HATCH without extent (layer SILICON)" in notes
    assert not any("NOTES" in note for note in notes)
    # and remembers, without the file, what it was told
    (tmp_path / "lever.dxf").unlink()
    probe.to_file(tmp_path / "own.toml")
    assert Probe.from_file(tmp_path / "own.toml").shape.notes() == notes


@pytest.mark.parametrize("kind", ["gds", "oas"])
def test_polygons_without_extent_in_gdsii_and_oasis(tmp_path, kind):
    library = reference_library()
    (cell,) = library.top_level()
    for layer in (1, 77):
        cell.add(gdstk.Polygon([(9, 1)] * 4, layer=layer))
    file = written(tmp_path / f"lever.{kind}", library)
    sheet = read_sheet(file, tolerance_um=0.002)
    assert "77/0" not in sheet.layers
    assert len(sheet.layers["1/0"].rings) == 7
    assert "left out: 1 polygon or path without extent (layer 77/0)" in sheet.notes(["77/0"])
    assert sum(r.area for r in drawn(file).layout().regions) == pytest.approx(732.1, abs=0.1)


def test_fills_are_united_with_what_lies_beside_them(tmp_path, coarse):
    names = (
        "TRACE in the leg",
        "3DFACE in the bridge",
        "MPOLYGON in the leg",
        "hatch 0.5 nm inside the outline",
        "solid beyond the edge",
    )
    probe, told = lever(tmp_path, *names)
    whole = WHOLE_UM2[0] + right_of(*names)
    assert drawing_files.areas(probe)[0] == pytest.approx(whole, abs=1e-3)
    assert "hole" not in told
    probe, _ = lever(tmp_path, *names[:-1])
    tip_K = Lever(probe, COARSE).sweep([8.0]).tip_K
    assert float(tip_K[0]) == pytest.approx(float(coarse.sweep([8.0]).tip_K[0]), abs=0.5)


@pytest.mark.parametrize(
    ("name", "cut"),
    [
        ("hatch between outline and hole", "1 hole, cut by polygon 2"),
        ("solid that fills a hole", ""),
        ("outline twice, once with a corner more", ""),
        ("outline twice, once 0.5 nm inside", ""),
        ("silicon of solids side by side", ""),
        ("hatch of style outer, three paths", "1 hole, cut by polygon 2"),
    ],
)
def test_holes_are_outlines_within_outlines_and_are_said(name, cut, tmp_path):
    probe, told = lever(tmp_path, name)
    whole = WHOLE_UM2[0] + right_of(name)
    assert drawing_files.areas(probe)[0] == pytest.approx(whole, abs=1e-2)
    assert (f"silicon: {cut}" in told) if cut else ("hole" not in told)


def test_a_hole_in_a_list_of_points_is_said():
    values = reference_points()
    values["layers"]["silicon"] += [box(10, -1, 14, 1), box(20, -1, 24, 1)]
    notes = Probe.from_sections(values, "probe").shape.notes()
    assert notes == ["silicon: 2 holes, cut by polygons 6, 7"]


def test_hidden_things_are_left_out_and_noted(tmp_path):
    names = (
        "invisible circle",
        "invisible insert",
        "insert on a layer that is off, content on layer 0",
    )
    probe, told = lever(tmp_path, *names)
    assert drawing_files.areas(probe) == pytest.approx(WHOLE_UM2, abs=1e-6)
    assert "left out: 1 CIRCLE set invisible (layer SILICON)" in told
    assert "left out: 1 LWPOLYLINE in an invisible INSERT (layer SILICON)" in told
    assert "left out: 1 LWPOLYLINE on a layer that is off (layer LATER)" in told
    _, told = lever(tmp_path, "insert in an insert on a frozen layer")
    assert "in an INSERT on the frozen layer LATER (layer SILICON)" in told


@pytest.mark.parametrize("state", ["off", "freeze"])
def test_a_hidden_layer_is_refused_by_name_and_not_proposed(state, run, tmp_path):
    drawing_files.write_dxf(tmp_path / "lever.dxf", "arc of radius 0 on another layer")
    document = ezdxf.readfile(tmp_path / "lever.dxf")
    getattr(document.layers.get("GROUND_PAD"), state)()
    document.saveas(tmp_path / "lever.dxf")
    status, out, _ = run("probe", "import", "lever.dxf")
    assert status == 0
    assert '"GROUND_PAD"' not in out
    with pytest.raises(InputError, match=r"\[terminals\] ground: layer GROUND_PAD is (off|frozen)"):
        drawing_files.read(tmp_path / "lever.dxf")


def test_widths_of_polylines_count_and_are_noted(tmp_path):
    names = ("polyline of constant width", "tapered polyline")
    for name in (*names, "donut around the leg's side"):
        probe, told = lever(tmp_path, name)
        whole = WHOLE_UM2[0] + right_of(name)
        assert drawing_files.areas(probe)[0] == pytest.approx(whole, abs=1e-2)
        assert "1 LWPOLYLINE counts as wide as it is drawn (layer SILICON)" in told


def test_what_draws_no_outline_is_not_one(tmp_path):
    probe, told = lever(tmp_path, "picture below the silicon", "wipeout below a text")
    assert drawing_files.areas(probe) == pytest.approx(WHOLE_UM2, abs=1e-6)
    assert "left out: 1 IMAGE without an outline (layer SILICON)" in told


def test_curves_in_a_unit_that_is_far_too_large_are_doubted(refused, tmp_path):
    drawing_files.write_dxf(tmp_path / "lever.dxf", "kilometres stated, with curves")
    assert "in um it would be 54.4 µm: --unit um" in refused("probe", "import", "lever.dxf")
    with pytest.raises(InputError, match=r"54.4 µm: unit_um = 1 in \[probe\]"):
        read_sheet(tmp_path / "lever.dxf", tolerance_um=0.002)
    document = ezdxf.readfile(tmp_path / "lever.dxf")
    document.units = 4
    document.saveas(tmp_path / "lever.dxf")
    sheet = read_sheet(tmp_path / "lever.dxf", tolerance_um=0.002)
    (note,) = sheet.notes(["SILICON"])
    assert note == "5.44e+04 µm long, so its curves are drawn within 0.054 µm (layer SILICON)"


@pytest.mark.parametrize(
    "name",
    [
        "square path of two equal points",
        "square path of one point",
        "round path of two equal points",
        "path of absolute width, twice as large",
        "boundary inside one that runs around a hole",
    ],
)
def test_paths_and_boundaries_are_drawn_as_a_mask_shop_draws_them(name, tmp_path):
    probe, _ = lever(tmp_path, name)
    whole = WHOLE_UM2[0] + right_of(name)
    assert drawing_files.areas(probe)[0] == pytest.approx(whole, abs=1e-2)


def test_what_a_library_does_not_read_is_said(tmp_path):
    probe, told = lever(
        tmp_path, "flush path of two equal points", "absolute angle within a reference"
    )
    assert "left out: 1 polygon or path without extent (layer 1/0)" in told
    (warning,) = (note for note in probe.shape.notes() if note.startswith("warning"))
    assert "Absolute magnification and rotation of references is not supported" in warning


def test_names_of_layers_do_not_differ_by_case_in_dxf():
    sheet = Sheet("a.dxf", "DXF", {}, [], hidden={"Heater": "off"})
    with pytest.raises(InputError, match="layer Heater is off"):
        sheet.layer("HEATER", "here")


def test_an_empty_cell_says_what_was_left_out(tmp_path):
    cell = gdstk.Cell("LEVER")
    cell.add(gdstk.Polygon([(9, 1)] * 4))
    file = written(tmp_path / "lever.gds", library_of(cell))
    with pytest.raises(InputError, match=r"holds no outline; left out: 1 polygon .*\(layer 0/0\)"):
        read_sheet(file, tolerance_um=0.002)
