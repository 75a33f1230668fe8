"""What the air around a lever does: flux, regions, temperature."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

from documents import EXAMPLES
from hotlever.errors import InputError
from hotlever.figures import air_loss, save_figure
from hotlever.lever import Lever
from hotlever.lever.fields import AirFields
from hotlever.lever.lever import COARSE
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.probe import Probe


@pytest.fixture(scope="module")
def states(in_air):
    return in_air.solve([3.0, 9.0])


@pytest.fixture(scope="module")
def fields(in_air) -> AirFields:
    return AirFields(in_air)


def test_flux_and_regions_add_up_to_the_heat_lost(in_air, states, fields):
    state = states[1]
    expected = in_air.dataset([state]).air_heat_mW.item()
    assert 2 * (fields.flux(state) @ fields.panels.areas) == pytest.approx(expected, rel=1e-9)
    by_region = fields.heat_by_region(state)
    assert sum(by_region.values()) == pytest.approx(expected, rel=1e-9)
    assert list(by_region) == [region.name for region in in_air.space.mesh.layout.regions]
    # the right leg carries no current: air takes heat to it from its hot neighbours
    assert by_region["right leg"] < 0 < by_region["heater"] < by_region["bridge"]


def test_films_on_the_body_are_part_of_the_surface():
    path = EXAMPLES / "palladium-on-nitride.toml"
    lever = Lever(Probe.from_file(path).in_medium("air"), COARSE)
    (state,) = lever.solve([0.3])
    fields = AirFields(lever)
    lost = sum(fields.heat_by_region(state).values())
    assert 2 * (fields.flux(state) @ fields.panels.areas) == pytest.approx(lost, rel=1e-9)


def test_air_at_the_lever_is_as_hot_as_the_lever_and_cold_far_away(in_air, states, fields):
    state = states[1]
    tip_x, tip_y = in_air.space.mesh.layout.tip
    above = np.array([[tip_x, tip_y, 0.2 + height] for height in (0.0, 1.0, 10.0, 100.0, 1e4)])
    found = fields.temperature(state, above)
    assert found[0] == pytest.approx(state.tip_K, rel=5e-3)
    assert (np.diff(found) < 0).all()
    # a point source of the heat lost, seen from far away
    lost = in_air.dataset([state]).air_heat_mW.item()
    kappa = 0.1 * thermal_conductivity_of_air(293.0)[0]
    assert found[-1] - 293.0 == pytest.approx(lost / (4 * np.pi * kappa * 1e4), rel=0.01)
    mirrored = fields.temperature(state, above * [1, 1, -1])
    assert mirrored == pytest.approx(found, rel=1e-9)


def test_air_is_cold_at_a_cold_surface(coarse):
    lever = coarse.with_probe(coarse.probe.with_(surface_gap_um=3.0, medium="air"))
    (state,) = lever.solve([9.0])
    points = np.array([[40.0, 1.0, -3.2], [48.58, 0.0, -3.2], [48.58, 0.0, -1.7]])
    found = AirFields(lever).temperature(state, points)
    assert found[:2] == pytest.approx([293.0, 293.0], abs=1e-6)
    assert 300.0 < found[2] < state.tip_K


def test_vtu_and_figure(states, fields, in_air, tmp_path):
    state = states[1]
    fields.write_vtu(state, tmp_path / "air.vtu")
    read = meshio.read(tmp_path / "air.vtu")
    flux = read.cell_data["heat_flux_into_air_mW_um2"][0]
    assert np.array_equal(flux, fields.flux(state))
    shares = fields.shares(states)
    layout = in_air.space.mesh.layout
    figure = air_loss(layout, fields.panels, fields.flux(state), shares, "9 V")
    (map_axes, share_axes), regions = figure.axes[:2], len(layout.regions)
    assert map_axes.get_xlabel() == "x (µm)"
    drawn = share_axes.get_legend().get_texts()
    assert [text.get_text() for text in drawn] == [*shares.region.values, "whole lever"]
    # a line for each region, their sum, and zero
    assert len(share_axes.lines) == regions + 2
    save_figure(figure, tmp_path / "air.png")
    assert (tmp_path / "air.png").stat().st_size > 10_000


def test_a_lever_in_vacuum_has_no_air(coarse):
    with pytest.raises(InputError, match="in vacuum"):
        AirFields(coarse)
