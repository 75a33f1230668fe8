"""What is proposed for a drawing: which layer is what, and a probe file that can be solved."""

from __future__ import annotations

import re
from pathlib import Path

import ezdxf
import gdstk
import numpy as np
import pytest
from reference_drawing import reference_library

import hotlever
from drawn import TIP, box, library_of, pointed_lever, turned, written
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe

EXAMPLES = Path(hotlever.__file__).parent / "examples"


def imported(run, tmp_path, name, *options):
    """Import a file of the folder; returns the probe, what was printed, and the notes."""
    status, out, err = run("probe", "import", name, "-o", "probe.toml", *options)
    assert status == 0, err
    return Probe.from_file(tmp_path / "probe.toml"), out, err


@pytest.mark.parametrize("turn", [False, True])
@pytest.mark.parametrize("kind", ["gds", "oas"])
def test_the_reference_probe_is_told_from_its_drawing(run, tmp_path, kind, turn):
    written(tmp_path / f"lever.{kind}", turn=turn)
    probe, out, err = imported(run, tmp_path, f"lever.{kind}", "--plot", "lever.png")
    assert err == ""
    tip = turned(np.array(TIP)[:, None])[:, 0] if turn else TIP
    assert probe.shape.tip_um == pytest.approx(tuple(tip), abs=1e-6)
    parts = {region.name: region.part for region in probe.layout().regions}
    assert parts == {
        "heater": "heater",
        "reader": "reader branch",
        "silicon at supply": "leg 1",
        "silicon at ground": "leg 2",
        "silicon at reader": "reader branch",
    }
    assert "cell WAFER; others: LEVER" in out if turn else "cell LEVER" in out
    assert "732.1" in out
    assert "the text 'tip' stands there" in out
    assert (tmp_path / "lever.png").stat().st_size > 10_000


def test_a_cell_of_klayouts_own_is_no_lever(run, tmp_path):
    library = reference_library()
    library.new_cell("$$$CONTEXT_INFO$$$").add(gdstk.Label("PCELL", (0.0, 0.0)))
    written(tmp_path / "lever.gds", library)
    _, out, _ = imported(run, tmp_path, "lever.gds")
    assert "cell LEVER; others: $$$CONTEXT_INFO$$$" in out


def test_without_a_file_name_the_probe_file_is_printed(run, tmp_path):
    written(tmp_path / "lever.gds")
    status, out, _ = run("probe", "import", "lever.gds")
    assert status == 0
    (tmp_path / "probe.toml").write_text(out, encoding="utf-8")
    sweep = Lever(Probe.from_file(tmp_path / "probe.toml"), COARSE).sweep([7.22])
    assert sweep.tip_K.item() == pytest.approx(547, abs=4)


def test_the_file_is_found_from_another_folder(run, tmp_path):
    for folder in ("drawings", "probes"):
        (tmp_path / folder).mkdir()
    written(tmp_path / "drawings" / "lever.gds")
    assert run("probe", "import", "drawings/lever.gds", "-o", "probes/probe.toml")[0] == 0
    text = (tmp_path / "probes" / "probe.toml").read_text(encoding="utf-8")
    assert 'file = "../drawings/lever.gds"' in text
    assert Probe.from_file(tmp_path / "probes" / "probe.toml").layout().regions


def test_a_dxf_with_names_for_layers(run, tmp_path):
    pointed_lever(tmp_path / "lever.dxf")
    probe, out, err = imported(run, tmp_path, "lever.dxf")
    assert err == "note: silicon: 1 hole, cut by polygon 1\n"
    assert "one unit of the file is 1 µm" in out
    names = {terminal.name for terminal in probe.layout().terminals}
    assert names == {"supply", "ground"}
    supply = next(end for end in probe.layout().terminals if end.name == "supply")
    assert supply.start[1] > 0
    assert probe.shape.tip_um[0] == pytest.approx(48.7, abs=0.5)


def without(library: gdstk.Library, *layers: int) -> gdstk.Library:
    """The reference probe's library without some of its layers and without texts."""
    (cell,) = library.top_level()
    other = gdstk.Cell("LEVER")
    other.add(*(one for one in cell.polygons if one.layer not in layers))
    return library_of(other)


def test_contacts_that_share_a_layer_are_told_apart(run, tmp_path):
    library = without(reference_library(), 10, 11, 12)
    (cell,) = library.top_level()
    for low, high in ((-3.22, 3.22), (6.42, 9.88), (-9.88, -6.42)):
        cell.add(gdstk.rectangle((-1, low), (0, high), layer=20))
    written(tmp_path / "lever.gds", library)
    probe, out, _ = imported(run, tmp_path, "lever.gds")
    ends = {one.name: (one.start[1] + one.end[1]) / 2 for one in probe.layout().terminals}
    assert ends == pytest.approx({"supply": 0.0, "ground": 8.15, "reader": -8.15})
    assert "the middle of the heater" in out


def test_without_contacts_edges_in_line_far_from_the_heater_are_taken(run, tmp_path):
    written(tmp_path / "lever.gds", without(reference_library(), 10, 11, 12))
    probe, out, _ = imported(run, tmp_path, "lever.gds")
    ends = {one.name: (one.start[1] + one.end[1]) / 2 for one in probe.layout().terminals}
    assert ends == pytest.approx({"supply": 0.0, "ground": 8.15, "reader": -8.15})
    assert "no layer marks a terminal" in out


def test_layers_that_are_nothing_of_the_lever_do_not_disturb(run, tmp_path):
    library = reference_library()
    (cell,) = library.top_level()
    cell.add(gdstk.rectangle((-200, -200), (200, 200), layer=99))
    cell.add(gdstk.rectangle((70, 20), (80, 30), layer=50))
    written(tmp_path / "lever.gds", library)
    probe, out, err = imported(run, tmp_path, "lever.gds")
    assert err == ""
    assert probe.layout().heater.area == pytest.approx(6.58)
    assert [line.split()[-1] for line in out.splitlines() if line.startswith(("50/", "99/"))] == [
        "–",
        "–",
    ]


def test_a_frame_around_a_lever_is_no_terminal(run, tmp_path):
    document = ezdxf.readfile(pointed_lever(tmp_path / "lever.dxf"))
    document.modelspace().add_lwpolyline(box(-10, -30, 70, 30), close=True)
    document.saveas(tmp_path / "lever.dxf")
    probe, out, _ = imported(run, tmp_path, "lever.dxf")
    assert re.search(r"^0 +1 +4800 .* –$", out, re.M)
    assert {terminal.name for terminal in probe.layout().terminals} == {"supply", "ground"}


def test_lines_that_are_drawn_twice_are_one_outline(run, tmp_path):
    document = ezdxf.readfile(pointed_lever(tmp_path / "lever.dxf"))
    space = document.modelspace()
    once, *_ = imported(run, tmp_path, "lever.dxf")
    for number, line in enumerate(space.query('LINE[layer=="SI"]')):
        start, end = line.dxf.start, line.dxf.end
        # all of it, or a part
        space.add_line(end, start if number else start.lerp(end), dxfattribs={"layer": "SI"})
    document.saveas(tmp_path / "lever.dxf")
    probe, out, _ = imported(run, tmp_path, "lever.dxf")
    assert re.search("^SI .* silicon$", out, re.M)
    areas = [sum(region.area for region in each.layout().regions) for each in (once, probe)]
    assert areas[1] == pytest.approx(areas[0], rel=1e-6)


def test_what_cannot_be_told_is_left_to_the_user(run, tmp_path):
    cell = gdstk.Cell("LEVER")
    cell.add(gdstk.Polygon(box(0, 0, 50, 10), layer=1))
    written(tmp_path / "lever.gds", library_of(cell))
    status, out, err = run("probe", "import", "lever.gds", "-o", "probe.toml")
    assert status == 0
    assert "to be checked: no layer lies across the silicon" in out
    assert err.startswith("note: the probe file needs an edit before it can be solved")
    text = (tmp_path / "probe.toml").read_text(encoding="utf-8")
    assert re.search('# heater = +# not found in the drawing, such as "1/0"', text)
    assert run("sweep", "probe.toml")[0] == 2


@pytest.mark.parametrize("contacts", [True, False])
def test_a_film_that_is_heater_and_legs_in_one(run, tmp_path, contacts):
    """As on an example, of whose materials a drawing says nothing."""
    lever = Probe.from_file(EXAMPLES / "palladium-on-nitride.toml")
    lever.to_file(tmp_path / "pd.toml", drawing=tmp_path / "pd.gds")
    if contacts:
        library = gdstk.read_gds(tmp_path / "pd.gds")
        (cell,) = library.top_level()
        cell.add(gdstk.rectangle((-2, -25), (0.5, -15), layer=10))
        cell.add(gdstk.rectangle((-2, 15), (0.5, 25), layer=11))
        library.write_gds(tmp_path / "pd.gds")
    probe, out, _ = imported(run, tmp_path, "pd.gds")
    assert "what it and the body are made of, the drawing does not say" in out
    assert [layer.thickness_um for layer in probe.shape.layers] == [None, 0.05]
    assert sorted(probe.materials) == ["Pd", "SiN"]
    assert probe.shape.tip_um == pytest.approx((56.0, 0.0), abs=0.5)
    assert probe.layout().heater.area == pytest.approx(lever.layout().heater.area, rel=1e-6)


def test_a_proposal_that_is_at_fault_is_drawn_with_its_place(run, tmp_path):
    library = reference_library()
    (cell,) = library.top_level()
    cell.add(gdstk.rectangle((100, 0), (104, 3), layer=2))
    written(tmp_path / "lever.gds", library)
    status, _, err = run("probe", "import", "lever.gds", "-o", "p.toml", "--plot", "lever.png")
    assert status == 0
    assert "heater (layer 2/0), polygon 2, at (102.000, 1.500) µm" in err
    assert (tmp_path / "lever.png").stat().st_size > 10_000
