"""A lever in air: balances, derivatives, and independence of the panels."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from hotlever.lever import Lever, probe_of, read_sweep, write_sweep
from hotlever.lever.discretisation import surrounded
from hotlever.lever.lever import COARSE

BIAS = [4.0, 8.268, 10.748]


@pytest.fixture(scope="module")
def fine(lever) -> Lever:
    """The reference lever in air on the default mesh and panels."""
    return lever.in_medium("air")


@pytest.mark.parametrize("medium", ["vacuum", "air"])
def test_a_lever_can_be_sent_to_another_process(coarse, medium):
    lever = coarse.in_medium(medium)
    sent = pickle.loads(pickle.dumps(lever))
    # where matrices are factorised with pivots of earlier ones, these are not sent
    np.testing.assert_allclose(sent.sweep(BIAS).tip_K, lever.sweep(BIAS).tip_K, rtol=1e-12)
    assert sent.space.air.stores.size == lever.space.air.stores.size


@pytest.mark.slow
def test_halved_panels_change_less_than_a_thousandth(lever, fine):
    probe = fine.probe

    def with_panels(refinement: float) -> Lever:
        return Lever(probe, space=surrounded(lever.space, probe, refinement))

    a, b, c = (one.sweep(BIAS) for one in (with_panels(0.7), fine, with_panels(1.4)))
    rise = b.tip_K - 293.0
    assert np.abs((c.tip_K - a.tip_K) / rise).max() < 1e-3
    assert np.abs(c.air_heat_mW / a.air_heat_mW - 1).max() < 1.5e-3
    assert np.abs(c.current_mA / a.current_mA - 1).max() < 2e-4
    # the default lies between them
    assert np.abs((c.tip_K - b.tip_K) / rise).max() < 5e-4


@pytest.mark.slow
def test_vacuum_is_the_limit_of_low_pressure(lever):
    thin = lever.probe.with_(accommodation=0.9, pressure_mbar=1e-4, medium="air")
    rare = lever.with_probe(thin).sweep(BIAS)
    assert np.abs(rare.tip_K - lever.sweep(BIAS).tip_K).max() < 0.01


def test_knee_in_air_is_cooled(in_air):
    knee, vacuum = in_air.knee(), in_air.in_medium("vacuum").knee()
    assert knee.attrs["medium"] == "air"
    assert knee.power_mW.item() > 1.2 * vacuum.power_mW.item()
    assert knee.tip_K.item() == pytest.approx(vacuum.tip_K.item(), abs=60)


def test_a_sweep_says_its_medium_and_surroundings(coarse, tmp_path):
    probe = coarse.probe.with_(surface_gap_um=10.0, medium="air")
    data = coarse.with_probe(probe).sweep([2.0])
    write_sweep(data, tmp_path / "sweep.nc")
    again = read_sweep(tmp_path / "sweep.nc")
    assert again.attrs["medium"] == "air"
    assert probe_of(again) == probe
    assert again.air_heat_mW.attrs["units"] == "mW"


def test_a_space_in_vacuum_is_surrounded_as_the_probe_says(coarse, in_air):
    lever = Lever(in_air.probe, COARSE, space=coarse.space)
    np.testing.assert_array_equal(lever.space.air.operator.matrix, in_air.space.air.operator.matrix)
    assert Lever(coarse.probe, COARSE, space=in_air.space).space.air.medium == "vacuum"
