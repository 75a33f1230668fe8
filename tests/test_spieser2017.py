"""The published parameter sets."""

from __future__ import annotations

import pytest

from hotlever.errors import InputError
from hotlever.materials import PARAMETERS, PUBLISHED, Material, published
from hotlever.materials.silicon import inversion_temperature
from hotlever.spieser2017 import NOMINAL_DOPING


def test_every_row_of_both_tables_is_there():
    options = [f"option {numeral}" for numeral in ("I", "II", "III")]
    levers = [f"lever {k}{fixed}" for k in range(1, 5) for fixed in ("", ", n_d fixed")]
    assert list(PUBLISHED) == options + levers


def test_options_carry_uncertainties_of_all_six_parameters():
    error = published("option II").standard_error
    assert list(error) == list(PARAMETERS)
    assert error["n_d"] == pytest.approx(1.40e17)
    assert error["a1"] == pytest.approx(0.03e-6)


def test_option_three_is_lever_one():
    assert published("option III").material == published("lever 1").material


@pytest.mark.parametrize("name", PUBLISHED)
def test_fixed_rows_hold_the_nominal_doping(name):
    material = published(name).material
    assert (material.n_d == pytest.approx(NOMINAL_DOPING)) == ("fixed" in name)


@pytest.mark.parametrize("name", ["option I", "option II", "option III"])
def test_printed_inversion_temperatures_follow_from_the_parameters(name):
    entry = published(name)
    ours = inversion_temperature(entry.material.n_d, entry.material.p)
    assert ours == pytest.approx(entry.inversion_temperature_K, abs=0.5)


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_values_lie_within_the_fit_bounds(name):
    material = published(name).material
    for parameter in PARAMETERS.values():
        assert parameter.lower < getattr(material, parameter.name) < parameter.upper


def test_a_wrong_name_is_answered_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'option III'"):
        published("option IIII")


def test_material_refuses_what_cannot_be():
    good = published("option III").material.model_dump()
    with pytest.raises(InputError, match=r"c_kappa = -1: expected at least"):
        Material.from_values({**good, "c_kappa": -1}, "here")
    with pytest.raises(InputError, match=r"n_d = 1.5e\+19 must be below n_hd"):
        Material.from_values({**good, "n_d": 1.5e19, "n_hd": 1e19}, "here")
    with pytest.raises(InputError, match=r"did you mean 'delta'"):
        Material.from_values({**good, "dleta": 1}, "here")
