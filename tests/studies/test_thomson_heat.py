"""Where Thomson heat turns its sign in strips of one doping, and which way they are hottest."""

from __future__ import annotations

import pytest

from hotlever.errors import ComputationError
from hotlever.materials import LOW_DOPED, REFERENCE
from hotlever.materials.kinds import NSilicon, PSilicon
from hotlever.studies.thermoelectric_strip import (
    largest_seebeck,
    odd_rise,
    self_heated,
    turn_of_thomson_heat,
)
from seebeck import largest


def silicon(kind, n_d):
    values = REFERENCE.kinds[LOW_DOPED].model_dump() | {"n_d": n_d}
    values.pop("kind")
    return kind(**values)


@pytest.mark.parametrize("kind", [NSilicon, PSilicon])
@pytest.mark.parametrize("n_d", [1e17, 5.75e17, 2e18])
def test_thomson_heat_turns_where_the_seebeck_coefficient_is_largest(kind, n_d):
    own = silicon(kind, n_d)
    at = largest_seebeck(own)
    before, after = odd_rise(own, at - 20.0), odd_rise(own, at + 20.0)
    assert before * after < 0.0
    # one carrier takes its heat from the warm end to the cold one or against its own way
    assert (before > 0.0) == (own.carrier == "electron")


def test_the_turn_is_found_and_the_largest_coefficient_is_that_of_its_second_statement():
    own = silicon(NSilicon, 5.75e17)
    assert turn_of_thomson_heat(own) == pytest.approx(largest_seebeck(own), abs=20.0)
    with pytest.raises(ComputationError, match="does not turn"):
        turn_of_thomson_heat(silicon(NSilicon, 1e19))
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
