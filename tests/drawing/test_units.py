"""Units of drawings: a lever that is far too large or too small is doubted, and read in another."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import gdstk
import pytest
from reference_drawing import reference_library

from drawn import pointed_lever, written
from hotlever.errors import InputError
from hotlever.probe import Probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")


def area(probe: Probe) -> float:
    return sum(region.area for region in probe.layout().regions)


def unitless(path: Path, unit_um: float) -> Path:
    """The pointed lever in a DXF file that states no unit."""
    document = ezdxf.readfile(pointed_lever(path, unit_um))
    document.units = 0
    document.saveas(path)
    return path


@pytest.fixture(scope="module")
def lever_um2(tmp_path_factory):
    folder = tmp_path_factory.mktemp("units")
    return area(read(folder, pointed_lever(folder / "lever.dxf")))


def read(folder: Path, drawing: Path, *lines: str) -> Probe:
    text = [
        *("[probe]", 'shape = "drawing"', f'file = "{drawing.name}"', *lines),
        *("thickness_um = 0.4", "tip_um = [50.0, 0.0]"),
        *("[layers]", 'silicon = "SI"', 'heater = "HEATER"'),
        *("[terminals]", 'supply = "V+"', 'ground = "GND"'),
    ]
    (folder / "own.toml").write_text("\n".join(text), encoding="utf-8")
    return Probe.from_file(folder / "own.toml")


def test_a_drawing_in_mm_that_states_no_unit_is_doubted_and_read_in_mm(
    run, refused, tmp_path, lever_um2
):
    unitless(tmp_path / "own.dxf", 1000.0)
    line = refused("probe", "import", "own.dxf", "-o", "own.toml")
    assert line == (
        "hotlever: own.dxf: layer SI: 0.056 µm long with one unit of the file as 1 µm, expected 5 "
        "to 2000 µm; in mm it would be 56 µm: --unit mm"
    )
    assert not (tmp_path / "own.toml").exists()
    status, out, err = run("probe", "import", "own.dxf", "-o", "own.toml", "--unit", "mm")
    assert (status, err) == (0, "note: silicon: 1 hole, cut by polygon 1\n")
    assert "one unit of the file is 1000 µm" in out
    # the unit is in the probe file, so that the drawing is read in it again
    assert "unit_um = 1000 " in (tmp_path / "own.toml").read_text(encoding="utf-8")
    assert area(Probe.from_file(tmp_path / "own.toml")) == pytest.approx(lever_um2, rel=1e-6)
    assert run("sweep", "own.toml", "--bias", "4:4:1")[0] == 0


def test_a_probe_file_says_the_unit_that_would_make_sense(run, tmp_path, lever_um2):
    file = unitless(tmp_path / "own.dxf", 1000.0)
    with pytest.raises(InputError, match=r"silicon \(layer SI\): 0.056 µm long.*unit_um = 1000 in"):
        read(tmp_path, file)
    assert area(read(tmp_path, file, "unit_um = 1000.0")) == pytest.approx(lever_um2, rel=1e-6)
    assert run("sweep", "own.toml", "--set", "unit_um=1")[0] == 2


def test_a_file_that_states_a_wrong_unit(run, refused, tmp_path, lever_um2):
    """Numbers are µm, the template of the drawing program says mm."""
    document = ezdxf.readfile(pointed_lever(tmp_path / "own.dxf"))
    document.units = 4
    document.saveas(tmp_path / "own.dxf")
    line = refused("probe", "import", "own.dxf", "-o", "own.toml")
    assert "5.6e+04 µm long with one unit of the file as 1000 µm" in line
    assert "in um it would be 56 µm: --unit um" in line
    assert run("probe", "import", "own.dxf", "-o", "own.toml", "--unit", "µm")[0] == 0
    assert area(Probe.from_file(tmp_path / "own.toml")) == pytest.approx(lever_um2, rel=1e-6)


@pytest.mark.parametrize("kind", ["gds", "oas"])
def test_gdsii_and_oasis_in_another_unit(run, refused, tmp_path, kind):
    """The numbers of the file are mm; what it says is µm."""
    library = reference_library()
    library.precision *= 1e-3
    (cell,) = library.top_level()
    library.new_cell("SMALL").add(gdstk.Reference(cell, magnification=1e-3))
    written(tmp_path / f"own.{kind}", library)
    assert "--unit mm" in refused("probe", "import", f"own.{kind}", "--cell", "SMALL")
    status, _, err = run(
        "probe", "import", f"own.{kind}", "--cell", "SMALL", "--unit", "mm", "-o", "own.toml"
    )
    assert (status, err) == (0, "")
    assert area(Probe.from_file(tmp_path / "own.toml")) == pytest.approx(732.1, abs=0.1)


def test_a_dxf_in_mils_is_read_and_an_unknown_unit_is_named(refused, tmp_path, lever_um2):
    document = ezdxf.readfile(unitless(tmp_path / "own.dxf", 1.0))
    for entity in document.modelspace():
        entity.scale(1 / 25.4, 1 / 25.4, 1 / 25.4)
    document.units = 9
    document.saveas(tmp_path / "own.dxf")
    assert area(read(tmp_path, tmp_path / "own.dxf")) == pytest.approx(lever_um2, rel=1e-4)
    document.units = 21
    document.saveas(tmp_path / "own.dxf")
    assert "$INSUNITS, 21, is no unit that is understood; say it with --unit" in refused(
        "probe", "import", "own.dxf"
    )


def test_a_unit_that_does_not_exist(refused, tmp_path):
    pointed_lever(tmp_path / "own.dxf")
    assert "did you mean 'inch'" in refused("probe", "import", "own.dxf", "--unit", "inches")


def test_frames_beside_a_lever_of_no_heater_do_not_hide_its_unit(refused, tmp_path):
    file = unitless(tmp_path / "own.dxf", 1000.0)
    document = ezdxf.readfile(file)
    corners = [(-10, -10), (10, -10), (10, 10), (-10, 10)]
    document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": "FRAME"})
    document.saveas(file)
    assert "--unit mm" in refused("probe", "import", "own.dxf")
