"""Where Thomson heat turns its sign in strips of one doping, and which way they are hottest."""

from __future__ import annotations

import numpy as np
import pytest

from beyond_the_paper import largest
from hotlever.lever import Lever
from hotlever.materials import LOW_DOPED, REFERENCE
from hotlever.materials.kinds import LowDopedSilicon, NSilicon, PSilicon
from hotlever.studies.thermoelectric_shift import self_heated, strip_of

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
