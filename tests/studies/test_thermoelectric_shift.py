"""Which heat moves the hot spot of a heater, against the same in one dimension."""

from __future__ import annotations

import numpy as np
import pytest

from beyond_the_paper import Axis, parts, parts_of_lever
from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.studies.thermoelectric_shift import of_p_silicon, shift_by_heat

BIAS = (4.0, 7.22)


@pytest.fixture(scope="module")
def n_type(coarse):
    return shift_by_heat(coarse, [*BIAS, 10.748])


def test_the_shares_are_the_whole(n_type):
    total = n_type.share_nm.sum(["heat", "side"]) + n_type.rest_nm
    np.testing.assert_allclose(total, n_type.moved_nm, rtol=2e-3)
    # against the current, whichever way it flows
    assert (n_type.moved_nm < 0.0).all()
    assert (abs(n_type.rest_nm) < 0.02 * abs(n_type.moved_nm)).all()


def test_peltier_heat_is_set_free_where_the_current_enters_the_heater(n_type):
    peltier = n_type.heat_mW.sel(heat="Peltier")
    for polarity, enters, leaves in ((1, "supply", "ground"), (-1, "ground", "supply")):
        assert (peltier.sel(polarity=polarity, side=enters) > 0.0).all()
        assert (peltier.sel(polarity=polarity, side=leaves) < 0.0).all()
    # as measured in another trial
    assert 0.2 < peltier.sel(bias=7.22, method="nearest").max() < 0.3


@pytest.mark.parametrize(
    ("kind", "along"),
    [("n-silicon", -1), pytest.param("p-silicon", 1, marks=pytest.mark.slow)],
)
def test_parts_are_those_of_one_dimension(kind, along, coarse, n_type):
    axis = Axis(kind, BIAS)
    shift = n_type
    if kind == "p-silicon":
        shift = shift_by_heat(Lever(of_p_silicon(coarse.probe), COARSE, space=coarse.space), BIAS)
    for bias, polarity in zip(BIAS, (1, -1), strict=True):
        plane = parts_of_lever(shift, bias, polarity)
        assert plane == pytest.approx(parts(*axis.shares(bias, polarity)), rel=0.1)
        assert along * plane[-1] > 100.0


def test_a_heater_that_is_no_strip_is_refused():
    from of_materials import metal_film_probe

    with pytest.raises(InputError, match="strip"):
        shift_by_heat(Lever(metal_film_probe(), COARSE), [1.0])


def test_the_study_does_not_depend_on_what_the_probe_asks_for(coarse, n_type):
    thermoelectric_lever = Lever(
        Probe.reference().with_(thermoelectric=True), COARSE, space=coarse.space
    )
    again = shift_by_heat(thermoelectric_lever, BIAS[:1])
    np.testing.assert_allclose(again.moved_nm[:, 0], n_type.moved_nm[:, 0], rtol=1e-6)
    # and the whole is that of the lever solved with it
    (state,) = thermoelectric_lever.solve(BIAS[:1])
    rise = state.tip_K - thermoelectric_lever.circuit.base_temperature_K
    assert again.centre_rise_K.sel(polarity=1).item() == pytest.approx(rise, abs=0.05)
