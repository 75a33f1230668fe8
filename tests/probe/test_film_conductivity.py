"""Silicon of another thickness than the paper's conducts heat as its thickness says."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.materials.heat import thermal_conductivity, thermal_conductivity_of_layer
from hotlever.probe import Probe
from hotlever.probe.shapes import ThreeLeg
from of_materials import of_named_silicon

T = np.array([300.0, 600.0, 1000.0])


def sections(thickness_um, **others):
    shape = ThreeLeg.reference().sections()
    shape["probe"]["thickness_um"] = thickness_um
    return shape | others


def read(thickness_um, **others):
    return Probe.from_sections(sections(thickness_um, **others), "lever.toml")


@pytest.mark.parametrize("others", [{}, {"material": {"n_d": 4e17}}])
def test_another_thickness_has_the_law_of_layers(others):
    material = read(1.0, **others).material
    kappa, _ = material.kinds["low-doped"].thermal_conductivity(T, 1.0)
    assert kappa == pytest.approx(thermal_conductivity_of_layer(T, 1.0)[0])


def test_what_is_stated_and_the_papers_thickness_stay():
    assert read(1.0, material={"c_kappa": 0.8}).material.c_kappa == 0.8
    assert read(0.4).material == Probe.reference().material
    assert Probe.reference().with_(thickness_um=1.0).material.c_kappa == 0.686


def test_named_silicon_follows_the_thickness_of_its_layer():
    drawn = of_named_silicon("n-silicon", {}, {})
    assert drawn.materials["hot"].c_kappa == 0.686
    shape = drawn.sections()
    shape["probe"]["thickness_um"] = 1.0
    for name in ("hot", "legs"):
        del shape["materials"][name]["c_kappa"]
    other = Probe.from_sections(shape, "lever.toml")
    assert {kind.c_kappa for kind in other.materials.values()} == {"thickness"}
    shape["materials"]["legs"]["c_kappa"] = 0.9
    stated = Probe.from_sections(shape, "lever.toml")
    assert stated.materials["legs"].c_kappa == 0.9
    assert stated.materials["hot"].c_kappa == "thickness"


def test_surfaces_add_a_resistivity_that_hardly_grows_with_the_temperature():
    added = 1.0 / thermal_conductivity_of_layer(T, 0.4)[0] - 1.0 / thermal_conductivity(T)[0]
    bulk = 1.0 / thermal_conductivity(T)[0]
    assert added == pytest.approx(added[0], rel=0.15)
    assert bulk[-1] > 4.0 * bulk[0]


def test_a_probe_file_says_it_and_is_read_back(tmp_path):
    path = tmp_path / "thick.toml"
    read(1.0).to_file(path)
    assert 'c_kappa = "thickness"' in path.read_text()
    assert Probe.from_file(path) == read(1.0)
