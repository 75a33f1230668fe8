"""Drawn levers in air: the same as parametric ones, in any place and orientation."""

from __future__ import annotations

import numpy as np
import pytest

from drawn import TIP, drawn, pointed_sections, turned, written
from hotlever.lever import Lever
from hotlever.lever.fields import AirFields
from hotlever.lever.lever import COARSE
from hotlever.lever3d import SolidLever, temperature_slices
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.mesh import SolidMeshOptions

BIAS = np.linspace(1.0, 11.0, 6)
TURNED_TIP = turned(np.array(TIP)[:, None])[:, 0]


@pytest.fixture(scope="module")
def parametric():
    return Lever(Probe.reference().in_medium("air")).sweep(BIAS)


def pointed(folder) -> Probe:
    return Probe.from_sections(pointed_sections(folder / "pointed.dxf"), "test")


@pytest.mark.parametrize("turn", [pytest.param(False, marks=pytest.mark.slow), True])
def test_the_reference_probe_as_a_drawing(tmp_path, parametric, turn):
    """Turned by 30° and shifted too: what is left comes of the mesh of the lever."""
    file = written(tmp_path / "reference.gds", turn=turn)
    sweep = Lever(drawn(file, TURNED_TIP if turn else TIP).in_medium("air")).sweep(BIAS)
    for name in ("current_mA", "lever_V", "reader_V"):
        np.testing.assert_allclose(sweep[name], parametric[name], rtol=2e-5)
    np.testing.assert_allclose(sweep.air_heat_mW, parametric.air_heat_mW, rtol=5e-5)
    np.testing.assert_allclose(sweep.tip_K, parametric.tip_K, atol=0.04)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surroundings", "panels"),
    [
        ({}, (1.0, 1.5)),
        # not symmetric about the mid-plane: twice as many panels
        ({"surface_gap_um": 6.0, "surface_tilt_deg": 3.0, "chip": True}, (0.7, 1.0)),
    ],
)
def test_panels_of_a_slanted_lever_are_fine_enough(tmp_path, surroundings, panels):
    """It has an arc and a hole."""
    probe = pointed(tmp_path).with_(medium="air", **surroundings)
    coarse, fine = (
        Lever(probe, MeshOptions(panels=one, panels_over_surface=one)).sweep([3.0, 9.0])
        for one in panels
    )
    np.testing.assert_allclose(coarse.tip_K - 293.0, fine.tip_K - 293.0, rtol=1e-3)
    np.testing.assert_allclose(coarse.air_heat_mW, fine.air_heat_mW, rtol=2e-3)
    np.testing.assert_allclose(coarse.current_mA, fine.current_mA, rtol=1e-4)
    lost = coarse.end_heat_mW + coarse.air_heat_mW
    np.testing.assert_allclose(lost, coarse.power_mW, rtol=1e-5)


def test_heat_by_region_of_a_slanted_lever(tmp_path):
    lever = Lever(pointed(tmp_path).in_medium("air"), COARSE)
    (state,) = lever.solve([6.0])
    heat = AirFields(lever).heat_by_region(state)
    assert sum(heat.values()) == pytest.approx(lever.dataset([state]).air_heat_mW.item())
    legs = [value for name, value in heat.items() if name != "heater"]
    # but for a hole in one of them the legs are alike
    assert legs[0] == pytest.approx(legs[1], rel=0.06)


@pytest.mark.slow
def test_a_slanted_lever_against_the_full_three_dimensional_simulation(tmp_path):
    pytest.importorskip("ngsolve")
    probe = pointed(tmp_path).in_medium("air")
    solid = SolidLever(probe, SolidMeshOptions(refinement=0.8))
    states = solid.solve([4.0, 10.0])
    full, fast = solid.dataset(states), Lever(probe).sweep([4.0, 10.0])
    np.testing.assert_allclose(fast.tip_K - 293.0, full.tip_K - 293.0, rtol=5e-3)
    np.testing.assert_allclose(fast.current_mA, full.current_mA, rtol=1e-3)
    assert float(temperature_slices(states[1]).temperature.max()) < full.tip_K.max() + 1.0


@pytest.mark.slow
def test_slices_follow_a_lever_that_is_turned(tmp_path):
    pytest.importorskip("ngsolve")
    coarse = SolidMeshOptions(refinement=0.4, grading=0.7)
    slices = []
    for turn in (False, True):
        file = written(tmp_path / f"{turn}.gds", turn=turn)
        probe = drawn(file, TURNED_TIP if turn else TIP).in_medium("air")
        (state,) = SolidLever(probe, coarse, air_order=2).solve([6.0])
        slices.append(temperature_slices(state))
    assert slices[0].axis.values.tolist() == ["x", "y", "x", "y"]
    assert slices[1].axis.values.tolist() == ["along", "across", "along", "across"]
    rise = slices[0].temperature.values - 293.0
    away = np.abs(slices[1].temperature.values - 293.0 - rise)
    assert np.nanquantile(away, 0.95) < 0.03 * np.nanmax(rise)
