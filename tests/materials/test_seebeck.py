"""The Seebeck coefficient of silicon, stated without hotlever: limits and published numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from beyond_the_paper import (
    BOLTZMANN_EV,
    bands,
    fermi_integral,
    fermi_level,
    intrinsic_by_hand,
    points,
    read,
    reduced_seebeck,
    seebeck,
)


def ratios(name: str, r: float) -> Iterator[float]:
    """Yield computed over measured, less one, of one of the published samples."""
    for sample, kind, T, n, measured in points():
        if sample == name:
            yield seebeck(T, n, r, kind) / measured - 1.0


@pytest.mark.parametrize("eta", [-8.0, 0.0, 3.0, 40.0])
def test_fermi_integral_of_order_0_is_known_in_full(eta):
    assert fermi_integral(0.0, eta) == pytest.approx(math.log1p(math.exp(eta)), rel=1e-10)


def test_fermi_integral_of_order_half_at_0_is_that_of_the_zeta_function():
    # (1 − 2^(−½)) ζ(3/2)
    by_zeta = (1.0 - 2.0**-0.5) * 2.612375348685488
    assert fermi_integral(0.5, 0.0) == pytest.approx(by_zeta, rel=1e-10)


@pytest.mark.parametrize("ratio", [1e-9, 1e-2, 1.0, 30.0, 1e4])
def test_fermi_level_gives_the_carriers_back(ratio):
    assert fermi_integral(0.5, fermi_level(ratio)) == pytest.approx(ratio, rel=1e-9)


@pytest.mark.parametrize("r", [-0.5, 0.0, 1.5])
def test_limits_of_few_and_of_many_carriers(r):
    few = r + 2.5 + math.log(1e8)
    assert reduced_seebeck(1e-8, r) == pytest.approx(few, abs=1e-6)
    metal = math.pi**2 / 3.0 * (r + 1.5) / fermi_level(1e4)
    assert reduced_seebeck(1e4, r) == pytest.approx(metal, rel=1e-3)


def test_intrinsic_silicon_by_hand():
    # −k_B/e × 0.5637 × (2 + 5.1111), in mV/K
    assert intrinsic_by_hand(1000.0, -0.5) == pytest.approx(-0.3454, abs=1e-4)
    for r in (-0.5, 0.0, 1.5):
        by_hand = intrinsic_by_hand(1000.0, r)
        assert seebeck(1000.0, 1e12, r) == pytest.approx(by_hand, rel=5e-3)


def test_minority_draws_towards_the_other_sign_when_hot():
    assert seebeck(300.0, 1e17, 0.0) < seebeck(1300.0, 1e17, 0.0) < 0.0
    # electrons move faster than holes: of little boron, S turns negative
    assert seebeck(300.0, 1e17, 0.0, "p-silicon") > 0.0 > seebeck(1000.0, 1e17, 0.0, "p-silicon")


def test_carriers_are_neutral_and_one_gap_holds_for_both():
    for kind in ("n-silicon", "p-silicon"):
        more, less = bands(900.0, 5e17, kind)
        assert more.carriers - less.carriers == pytest.approx(5e17, rel=1e-9)
        assert more.sign == -less.sign == (-1 if kind == "n-silicon" else 1)


def test_high_doped_silicon_has_what_was_measured_with_a_mean_free_time():
    name = "sintered from powder, P"
    assert max(abs(x) for x in ratios(name, 0.0)) < 0.13
    # neither acoustic phonons nor ionised impurities do
    assert all(x < -0.12 for x in ratios(name, -0.5))
    assert all(x > 0.5 for x in ratios(name, 1.5))


def test_bulk_p_silicon_at_room_temperature_has_more_than_carriers_alone_give():
    # the rest is the phonons' drag, which is not in the law
    for name in ("single crystal, p", "membrane of 20 to 30 um, p"):
        assert -0.55 < next(ratios(name, 0.0)) < -0.35


def test_every_published_number_has_its_source():
    entries = read()
    ways = {"printed", "authors' file", "digitised"}
    for entry in [*entries["silicon"], *entries["metal"]]:
        assert len(entry["source"]) > 20
        assert entry["as"] in ways
    for entry in entries["silicon"]:
        sign = -1.0 if entry["kind"] == "n-silicon" else 1.0
        assert all(0.01 < sign * S < 2.0 for S in entry["seebeck"])
        # far from what k_B/e alone gives, in mV/K, so nothing is in other units
        assert max(map(abs, entry["seebeck"])) > 1e3 * BOLTZMANN_EV
