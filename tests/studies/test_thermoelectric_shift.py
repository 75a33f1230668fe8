"""Which heat moves the hot spot of a heater, and where Thomson heat turns in strips."""

from __future__ import annotations

import numpy as np
import pytest

from beyond_the_paper import Axis, largest, parts, parts_of_lever
from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.materials import LOW_DOPED, REFERENCE
from hotlever.materials.kinds import LowDopedSilicon, NSilicon, PSilicon
from hotlever.probe import Probe
from hotlever.studies.thermoelectric_shift import of_p_silicon, self_heated, shift_by_heat, strip_of
from of_materials import metal_film_probe

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


#: Ends of a strip that differ by so much (K), at a current (mA) that hardly heats it, from a supply
#: that is as good as one of a current (Ω).
DIFFERENCE_K, CURRENT_MA, STIFF = 20.0, 0.05, 1e6


def silicon(kind, n_d):
    values = REFERENCE.kinds[LOW_DOPED].model_dump() | {"n_d": n_d}
    values.pop("kind")
    return kind(**values)


def odd_rise(silicon: LowDopedSilicon, T: float) -> float:
    """Return by how much the current's direction changes the middle of a strip (K), to first order.

    Its ends are a little colder and warmer than T. The current is the same in both directions, and
    with it Joule's heat: only Thomson heat changes its sign. Positive where it is set free by a
    current that flows towards the warm end.
    """
    cold, warm = T - 0.5 * DIFFERENCE_K, T + 0.5 * DIFFERENCE_K
    lever = Lever(
        strip_of(
            silicon,
            base_temperature_K=cold,
            series_resistance_ohm=STIFF,
            ground={"kind": "ground", "base_temperature_K": warm},
        )
    )
    bias = 1e-3 * STIFF * CURRENT_MA
    forward, back = lever.solve([bias, -bias])
    return 0.5 * (forward.tip_K - back.tip_K)


def largest_seebeck(silicon: LowDopedSilicon) -> float:
    """Return the temperature (K) at which S of the majority's sign is largest, from the law."""
    T = np.linspace(300.0, 1300.0, 1001)
    sigma, _ = silicon.electrical_conductivity(T, silicon.n_d)
    (beta, _), _ = silicon.thermoelectric(T, silicon.n_d, silicon.carrier)
    S = beta / sigma
    return float(T[(S * np.sign(S[0])).argmax()])


@pytest.mark.parametrize("kind", [NSilicon, PSilicon])
@pytest.mark.parametrize("n_d", [1e17, 5.75e17, 2e18])
def test_thomson_heat_turns_where_the_seebeck_coefficient_is_largest(kind, n_d):
    own = silicon(kind, n_d)
    at = largest_seebeck(own)
    before, after = odd_rise(own, at - 20.0), odd_rise(own, at + 20.0)
    assert before * after < 0.0
    # one carrier takes its heat from the warm end to the cold one or against its own way
    assert (before > 0.0) == (own.carrier == "electron")


def test_the_largest_coefficient_is_that_of_its_second_statement():
    own = silicon(NSilicon, 5.75e17)
    assert largest_seebeck(own) == pytest.approx(largest(5.75e17, 0.0, p=own.p)[0], abs=2.0)


@pytest.mark.parametrize("n_d", [5.75e17, 1e19])
@pytest.mark.parametrize("kind", [NSilicon, PSilicon])
def test_hot_strips_are_hottest_where_the_minority_carriers_go(kind, n_d):
    """As the microwires of J. Mater. Res. 26, 1061 (2011) and Sci. Rep. 3, 2724 (2013) were."""
    own = silicon(kind, n_d)
    cold, hot = self_heated(own, [500.0, 1250.0]).moved_nm.values
    # n-type, hot: along the current, to the lower potential
    along = 1.0 if kind is NSilicon else -1.0
    assert along * cold < -5.0
    assert along * hot > 50.0
