"""What a lever radiates, by parts, and what thin sheets emit."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.materials.heat import (
    FREE_SPACE_OHM,
    STEFAN_BOLTZMANN,
    grey_emission,
    sheet_emissivity,
)
from hotlever.probe import Probe
from hotlever.studies.radiation import radiated_heat, sheet_emissivities

pytestmark = pytest.mark.usefixtures("coarse_meshes")


def test_a_black_lever_radiates_in_proportion_to_its_emissivity():
    black, grey = (radiated_heat(Probe.reference(), [900.0, 1150.0], one) for one in (1.0, 0.2))
    np.testing.assert_allclose(grey.radiated_mW, 0.2 * black.radiated_mW, rtol=0.01)
    np.testing.assert_allclose(grey.cooler_K, 0.2 * black.cooler_K, rtol=0.02)
    default = radiated_heat(Probe.reference(), [900.0, 1150.0])
    np.testing.assert_allclose(default.radiated_mW, grey.radiated_mW, rtol=1e-9)


def test_no_part_radiates_more_than_all_of_it_as_hot_as_the_tip():
    data, probe = radiated_heat(Probe.reference(), [1150.0], 1.0), Probe.reference()
    layout = probe.layout()
    most = 1e-5 * grey_emission(1150.0, 1.0, 293.0)[0]  # mW/µm²
    heater = 2 * layout.heater.area * most
    assert 0.6 * heater < data.heater_mW.item() < heater
    edges = probe.shape.thickness_um * layout_circumference(layout) * most
    assert 0.1 * edges < data.edges_mW.item() < 0.5 * edges
    assert data.edges_mW + data.heater_mW < data.radiated_mW


def layout_circumference(layout) -> float:
    """Of a lever with three legs (µm): edges that no other region has."""
    lengths = {}
    for region in layout.regions:
        for start, end in region.edges:
            key = tuple(sorted((tuple(start.round(6)), tuple(end.round(6)))))
            lengths[key] = None if key in lengths else float(np.linalg.norm(end - start))
    return sum(length for length in lengths.values() if length is not None)


@pytest.mark.parametrize("ohm", [3.0, 188.0, 5e3])
def test_a_sheet_emits_what_it_neither_reflects_nor_passes(ohm):
    """1 + r = t on either side, and the magnetic field steps by the current: 1 − r = t + x t."""
    x = FREE_SPACE_OHM / ohm
    r, t = np.linalg.solve([[1.0, -1.0], [1.0, 1.0 + x]], [-1.0, 1.0])
    assert sheet_emissivity(ohm) == pytest.approx(1.0 - r**2 - t**2, rel=1e-9)
    assert sheet_emissivity(FREE_SPACE_OHM / 2.0) == pytest.approx(0.5)


def test_sheets_of_the_reference_probe_bracket_the_default_emissivity():
    sheets = sheet_emissivities(Probe.reference(), [293.0, 1150.0])
    legs = sheets.sel(material="high-doped")
    assert legs.sheet_ohm.values[0] == pytest.approx(9.34e-4 / 0.4e-4, rel=0.01)
    assert 0.1 < sheets.emissivity.min() < 0.2 < sheets.emissivity.max() < 0.5
    assert pytest.approx(5.67e-12, rel=1e-3) == STEFAN_BOLTZMANN
