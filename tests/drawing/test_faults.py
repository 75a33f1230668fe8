"""Drawings that are wrong: one line that names what, where and what is expected."""

from __future__ import annotations

import ezdxf
import gdstk
import numpy as np
import pytest
from reference_drawing import reference_library

from drawn import box, drawn, library_of, reference_points, written
from hotlever.errors import InputError
from hotlever.probe import Probe
from hotlever.probe.drawing.outlines import DrawingError

BOW = [[50.58, -9.88], [54.4, 9.88], [54.4, -9.88], [50, 9.88]]
BRIDGE = box(50.58, -9.88, 54.4, 9.88)
NEEDLE = [*BRIDGE[:2], [54.4, 0], [90, 0.2], [54.4, 0.4], *BRIDGE[2:]]
HEATER = box(46.58, -2, 50.58, 2)
#: What is wrong: section, name, what is drawn, what the error says.
WRONG = {
    "a gap": (
        "layers",
        "silicon",
        (1, box(46.6, -0.8225, 50.58, 0.8225)),
        r"silicon.* at \(46.580, -0.8.*\) µm: 2 pieces, 0.02 µm apart",
    ),
    "a slit": (
        "layers",
        "silicon",
        (3, box(0, 3.225, 50.58, 9.88)),
        r"silicon.* at .* only 0.005 µm from another edge",
    ),
    "a crossing": (
        "layers",
        "silicon",
        (2, BOW),
        r"silicon, polygon 3, at .* crosses or touches itself",
    ),
    "two points that touch": (
        "layers",
        "silicon",
        (3, [[10, 3.22], [11, 6.42], [9, 6.42]]),
        r"silicon, polygon .*µm: ",
    ),
    "a needle": ("layers", "silicon", (2, NEEDLE), r"silicon, polygon 3, .*: a corner of 0.64°"),
    "a line": ("layers", "silicon", (0, [[0, 0], [10, 0]]), "polygon 1, .* not closed"),
    "no area": ("layers", "heater", (0, [[0, 0], [10, 0], [20, 0]]), "heater, polygon 1"),
    "a heater outside": (
        "layers",
        "heater",
        (1, box(100, 0, 104, 3)),
        r"heater, polygon 2, at \(102.000, 1.500\) µm: .* outside the silicon",
    ),
    "a heater that current passes by": (
        "layers",
        "heater",
        (0, box(46.58, -0.5, 50.58, 0.5)),
        "heater, at .* joined without it",
    ),
    "a heater of many squares": (
        "layers",
        "heater",
        (0, box(50.56, -2, 50.575, 2)),
        "times as long",
    ),
    "low-doped parts that overlap": (
        "layers",
        "reader",
        (0, box(49, -11, 53, 6)),
        "overlaps with 'heater'",
    ),
    "a terminal in the air": (
        "terminals",
        "supply",
        (0, [[-5.0, -3.0], [-5.0, 3.0]]),
        r"'supply', polygon 1, at \(-5.000, .*touches no edge.* 5 µm away",
    ),
    "a terminal beside": ("terminals", "supply", (0, box(-5, -3, -4, 3)), "nearest is 4 µm away"),
    "a terminal on part of an edge": (
        "terminals",
        "supply",
        (0, box(-5, -1, 0, 1)),
        "no edge of the silicon lies inside it",
    ),
    "a terminal on another": (
        "terminals",
        "ground",
        (0, [[0.0, -3.22], [0.0, 3.22]]),
        "touches 'supply'",
    ),
    "a terminal on the heater": (
        "layers",
        "heater",
        (0, box(-1, -4, 50.58, 4)),
        "it lies on the heater",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_drawn_wrongly_is_named_with_its_place(name):
    section, part, (number, outline), message = WRONG[name]
    values = reference_points()
    coordinates = values[section][part]
    group = [coordinates] if isinstance(coordinates[0][0], float | int) else list(coordinates)
    group[number : number + 1] = [outline]
    values[section][part] = group
    with pytest.raises(DrawingError, match=message) as caught:
        Probe.from_sections(values, "probe.toml")
    assert "\n" not in str(caught.value)
    assert caught.value.place is not None
    assert part in "".join(caught.value.outlines)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"layers": {"silicon": box(0, 0, 9, 9)}}, r"\[layers\]: heater is missing"),
        ({"terminals": {"supply": [[0.0, 0.0], [0.0, 1.0]]}}, r"\[terminals\]: ground is missing"),
        ({"layers": {"silicon": "1/0", "heater": "2/0"}}, "file is missing"),
        ({"layers": {"silicon": 5, "heater": "2/0"}, "probe": {"file": "x"}}, "no such file"),
        (
            {"layers": {"silicon": box(0, 0, 9, 9), "heater": [[1]]}},
            'expected a layer such as "1/0"',
        ),
        ({"layers": {"silicon": {"drawn": "5/0"}, "heater": HEATER}}, "material is missing"),
        ({"materials": {"pd": {"kind": "metal-film"}}}, "pd.: resistivity is missing"),
        ({"probe": {"tip_um": "here"}}, r"tip_um = 'here': expected \[x, y\]"),
        ({"probe": {"tip_um": [48.58, 5.0]}}, r"tip_um, at \(48.580, 5.000\) µm: .*outside"),
        ({"probe": {"thickness_um": 100}}, "thickness_um = 100"),
        ({"probe": {"tolerance_um": 5}}, "tolerance_um"),
        ({"probe": {"length_um": 5.0}}, "unknown key 'length_um'"),
        ({"layer": {}}, "unknown section 'layer': did you mean 'layers'"),
    ],
)
def test_a_probe_file_of_a_drawing_that_is_wrong(change, message):
    values = reference_points()
    for section, entries in change.items():
        if section == "probe":
            values["probe"] |= entries
        else:
            values[section] = entries
    with pytest.raises(InputError, match=message) as caught:
        Probe.from_sections(values, "probe.toml")
    assert "\n" not in str(caught.value)


def test_layers_mean_nothing_with_a_parametric_shape():
    values = Probe.reference().sections() | {"layers": {}}
    with pytest.raises(InputError, match=r"section \[layers\] means nothing with shape"):
        Probe.from_sections(values, "probe.toml")


def test_in_a_file_an_error_names_the_layer_and_the_place_is_drawn(run, refused, tmp_path):
    library = reference_library()
    (cell,) = library.top_level()
    cell.add(gdstk.rectangle((100, 0), (104, 3), layer=2))
    written(tmp_path / "lever.gds", library)
    run("probe", "import", "lever.gds", "-o", "probe.toml")
    line = refused("probe", "show", "probe.toml", "--plot", "fault.png")
    where = "lever.gds: heater (layer 2/0), polygon 2, at (102.000, 1.500) µm: it lies outside"
    assert where in line
    assert (tmp_path / "fault.png").stat().st_size > 10_000
    assert run("sweep", "probe.toml")[0] == 2


def test_a_border_tangent_to_an_arc_names_the_layer_that_is_to_be_moved():
    """The silicon's own outline is sound; the heater's border cuts a needle off it."""

    def arc(radius, first, last):
        angles = np.radians(np.linspace(first, last, 60))
        return np.stack([50 + radius * np.cos(angles), radius * np.sin(angles)], axis=1).tolist()

    ring = [[0, -10], *arc(10, -90, 90), [0, 10], [0, 4], *arc(4, 90, -90), [0, -4]]
    values = {
        "probe": {"shape": "drawing", "thickness_um": 0.4, "tip_um": [56.0, 0.0]},
        "layers": {"silicon": ring, "heater": box(54.004, -20, 70, 20)},
        "terminals": {"supply": [[0, -10], [0, -4]], "ground": [[0, 4], [0, 10]]},
    }
    with pytest.raises(DrawingError, match=r"^p: heater, polygon 1, at \(5.*move it$") as caught:
        Probe.from_sections(values, "p")
    assert "its border leaves the silicon with a corner" in str(caught.value)
    values["layers"]["heater"] = box(53.5, -20, 70, 20)
    assert Probe.from_sections(values, "p").layout().regions


def damaged() -> dict[str, bytes]:
    whole = b"\x00\x06\x00\x02\x00\x07"
    return {
        "empty": b"",
        "text": b"V_b (V), I_h (mA)\n1, 2\n",
        "the head of a GDSII file": whole,
        "noise behind it": whole + bytes(range(256)) * 20,
        "the head of an OASIS file": b"%SEMI-OASIS\r\n",
        "half a DXF file": b"  0\nSECTION\n  2\nENTITIES\n  0\nLWPOLYLINE\n",
        "a DXF file of nothing": b"  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n  0\nEOF\n",
    }


@pytest.mark.parametrize("name", damaged())
def test_a_damaged_file_is_one_line(name, refused, tmp_path):
    (tmp_path / "lever.gds").write_bytes(damaged()[name])
    line = refused("probe", "import", "lever.gds", "-o", "probe.toml")
    assert line.startswith("hotlever: lever.gds: ")
    assert not (tmp_path / "probe.toml").exists()


def test_cells_that_are_not_there_or_too_many(tmp_path):
    library = reference_library()
    library.new_cell("OTHER").add(gdstk.rectangle((0, 0), (1, 1)))
    file = written(tmp_path / "two.gds", library)
    with pytest.raises(InputError, match=r"2 top cells, .*as `cell` \(LEVER, OTHER\)"):
        drawn(file)
    with pytest.raises(InputError, match="unknown cell 'LEVR': did you mean 'LEVER'"):
        drawn(file, cell="LEVR")
    assert drawn(file, cell="LEVER").shape.cell == "LEVER"
    with pytest.raises(InputError, match=r"unknown layer '1/0'.*expected one of: 0/0"):
        drawn(file, cell="OTHER")


def test_a_cell_in_itself_and_an_array_without_end(tmp_path):
    one, other = gdstk.Cell("ONE"), gdstk.Cell("OTHER")
    one.add(gdstk.Reference(other))
    other.add(gdstk.Reference(one), gdstk.rectangle((0, 0), (1, 1)))
    with pytest.raises(InputError, match="refers to itself"):
        drawn(written(tmp_path / "round.gds", library_of(one, other)))
    wafer = gdstk.Cell("WAFER")
    tile = gdstk.Cell("TILE")
    tile.add(gdstk.rectangle((0, 0), (1, 1), layer=1))
    wafer.add(gdstk.Reference(tile, columns=30000, rows=30000, spacing=(2, 2)))
    with pytest.raises(InputError, match="cell 'WAFER' holds 900000000 polygons, expected"):
        drawn(written(tmp_path / "array.gds", library_of(wafer, tile)))


def test_a_dxf_outline_that_is_open(tmp_path):
    document = ezdxf.new("R2010")
    space = document.modelspace()
    for start, end in (((0, 0), (10, 0)), ((10, 0), (10, 5)), ((10, 5), (0, 5))):
        space.add_line(start, end, dxfattribs={"layer": "SI"})
    document.saveas(tmp_path / "open.dxf")
    values = reference_points()
    values["probe"] |= {"file": str(tmp_path / "open.dxf"), "unit_um": 1.0}
    values["layers"]["silicon"] = "SI"
    with pytest.raises(
        InputError, match=r"silicon \(layer SI\), at \(.*: an outline .* not closed"
    ):
        Probe.from_sections(values, "probe.toml")
    values["probe"]["cell"] = "LEVER"
    with pytest.raises(InputError, match="a DXF file has no cells"):
        Probe.from_sections(values, "probe.toml")


def test_what_a_drawing_cannot_do_yet_is_refused_where_it_is_met(refused, tmp_path):
    probe = Probe.from_sections(reference_points(), "probe.toml")
    probe.to_file(tmp_path / "probe.toml")
    data = "V_b (V), I_h (mA)\n" + "".join(f"{v}, {0.1 * v}\n" for v in range(1, 9))
    (tmp_path / "iv.csv").write_text(data, encoding="utf-8")
    words = ("calibrate", "iv.csv", "--probe", "probe.toml", "--prior", "dimensions=±2%")
    why = "edges of a drawing are off by a length, not by a share; expected thickness_um"
    assert why in refused(*words, below_notes=True)
