"""What is known beforehand: how it is written, what the defaults are, what it weighs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.probe import Probe
from hotlever.probe.priors import (
    Prior,
    default_priors,
    known_beforehand,
    priors_of,
)
from hotlever.probe.probe_parameters import nuisances, parameter_of, parameters_of
from of_materials import metal_film_probe

PROBE = Probe.reference()
LOG_3 = math.log(3.0)


@pytest.mark.parametrize(
    ("text", "prior"),
    [
        ("3.3e17 ± 15%", Prior(3.3e17, 0.15)),
        ("3.3e17±15%", Prior(3.3e17, 0.15)),
        ("± 5 %", Prior(5.75e17, 0.05)),
        ("4e17 +- 2e16", Prior(4e17, 2e16, relative=False)),
        ("4e17 +/- 2e16", Prior(4e17, 2e16, relative=False)),
        ("1e17 ×/ 3", Prior(1e17, LOG_3)),
        ("1e17×/3", Prior(1e17, LOG_3)),
        ("1e17 x/ 3", Prior(1e17, LOG_3)),
        ("1e17*/3", Prior(1e17, LOG_3)),
        ("×/ 3", Prior(5.75e17, LOG_3)),
    ],
)
def test_priors_are_read_as_they_are_written(text, prior):
    assert priors_of({"n_d": text}, PROBE, "here") == {"n_d": prior}


def test_dimensions_are_all_that_are_not_named():
    found = priors_of({"dimensions": "± 2%", "gap_um": "3.1 ± 0.1"}, PROBE, "here")
    assert set(found) == set(nuisances(PROBE))
    assert found["gap_um"] == Prior(3.1, 0.1, relative=False)
    assert found["length_um"] == Prior(54.4, 0.02)
    assert "reader_length_um" not in found


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ({"n_d": "3e17"}, r"here: n_d = '3e17', expected a value and its spread"),
        ({"n_d": "± -5%"}, "expected a value and its spread"),
        ({"n_d": "± 0"}, "expected a value and its spread"),
        ({"n_d": "nan ± 5%"}, "expected a value and its spread"),
        ({"n_d": "1 ± 2 ± 3"}, "expected a value and its spread"),
        ({"n_d": "±" * 1000}, "expected a value and its spread"),
        ({"nd": "± 5%"}, "unknown prior 'nd'.*did you mean 'n_d'"),
        ({"dimensions": "3 ± 1%"}, "expected a share such as"),
        ({"raman_scale": "1.02 ± 1%"}, "raman_scale = '1.02 ± 1%', expected a share such as"),
        ({"current_scale": "± 80%"}, "expected a share such as '± 5%', at most 50%"),
        ({"raman_scales": "± 1%"}, "unknown prior 'raman_scales'.*did you mean 'raman_scale'"),
        ({"a1": "0 ± 5%"}, "a relative spread needs a value above 0"),
        ({"a1": "-1e-6 ± 1e-7"}, "expected a value from 0 to 1e-05"),
        ({"thickness_um": "4e19 ± 5%"}, "thickness_um = 4e.19, expected a value from 0.2 to 0.6"),
        ({"thickness_um": "0.4 ± 1e-300"}, "a spread of 2.5e-300 times the value"),
        ({"n_d": "± 1e300%"}, "a spread of inf times the value"),
        ({"n_d": "1e17 ×/ 1"}, r"here: n_d = '1e17 ×/ 1': a factor of 1, expected one above 1"),
        ({"n_d": "×/ 0.3"}, "a factor of 0.3, expected one above 1 and at most 1000"),
        ({"n_d": "×/ -3"}, "a factor of -3, expected one above 1"),
        ({"n_d": "×/ nan"}, "a factor of nan, expected one above 1"),
        ({"n_d": "×/ 1e9"}, r"a factor of 1e\+09, expected one above 1 and at most 1000"),
        ({"n_d": "×/ 3%"}, "or '1e17 ×/ 3'"),
        ({"n_d": "×/"}, "expected a value and its spread"),
        ({"n_d": "1e17 / 3"}, "expected a value and its spread"),
        ({"n_d": "0 ×/ 3"}, "n_d = 0, expected a value from 1e.16"),
        ({"a1": "0 ×/ 3"}, "a relative spread needs a value above 0"),
        ({"impurity_exponent": "1 ×/ 3"}, "may be negative: .* such as '± 0.4', found a factor"),
        ({"edge_bias_um": "0.1 ×/ 2"}, "may be negative: expected a spread in its unit"),
        ({"raman_scale": "×/ 1.1"}, "expected a share such as '± 5%'"),
        ({"dimensions": "×/ 2"}, "expected a share such as '± 5%', at most 50%"),
    ],
)
def test_what_is_no_prior_gets_one_line(texts, message):
    with pytest.raises(InputError, match=message) as no:
        priors_of(texts, PROBE, "here")
    assert "\n" not in str(no.value)


def test_a_probe_file_states_priors_which_win_over_the_usual_ones(tmp_path):
    path = tmp_path / "probe.toml"
    section = '\n[prior]\nn_d = "3.3e17 ± 10%"\ndimensions = "± 2%"\n'
    path.write_text(PROBE.to_toml().split("\n# Without")[0] + section)
    probe = Probe.from_file(path)
    assert Probe.from_sections(probe.sections(), "again") == probe
    assert '"3.3e17 ± 10%"' in probe.to_toml()
    known = default_priors(probe)
    assert known["n_d"] == Prior(3.3e17, 0.10)
    assert known["length_um"].spread == 0.02
    assert known["p"].spread != 0.02
    own_priors = {"n_d": Prior(4e17, 0.01), "gap_um": "± 1%"}
    assert known_beforehand(probe, None) == known
    both = known_beforehand(probe, own_priors)
    assert (both["n_d"], both["gap_um"]) == (own_priors["n_d"], Prior(3.2, 0.01))
    assert both["p"] == known["p"]
    assert known_beforehand(probe, {}) == {}
    path.write_text(path.read_text().replace('n_d = "3', 'n_q = "3'))
    with pytest.raises(InputError, match=r"probe.toml: \[prior\]: unknown prior 'n_q'"):
        Probe.from_file(path)


def test_a_factor_is_one_standard_deviation_of_the_logarithm_either_way():
    prior = priors_of({"n_d": "1e17 ×/ 3"}, PROBE, "here")["n_d"]
    for deviation in (-2.0, -1.0, 0.0, 1.0, 1.5):
        assert prior.at(deviation) == pytest.approx(1e17 * 3.0**deviation, rel=1e-14)
        assert prior.deviation(1e17 * 3.0**deviation) == pytest.approx(deviation, abs=1e-14)
    assert prior.absolute == pytest.approx(1e17 * LOG_3)
    drawn = [prior.at(one) for one in np.random.default_rng(0).standard_normal(20_000)]
    expected = [1e17 / 9.0, 1e17 / 3.0, 1e17, 3e17, 9e17]
    quantiles = np.percentile(drawn, [2.275, 15.866, 50.0, 84.134, 97.725])
    np.testing.assert_allclose(quantiles, expected, rtol=0.1)


def test_all_dimensions_may_be_known_to_a_factor():
    found = priors_of({"dimensions": "×/ 1.2"}, PROBE, "here")
    assert set(found) == set(nuisances(PROBE))
    assert found["length_um"] == Prior(54.4, math.log(1.2))


def test_what_data_made_of_a_factor_is_counted_in_logarithms():
    to_a_factor, in_its_unit = Prior(1e17, LOG_3), Prior(293.0, 1.0, relative=False)
    use = to_a_factor.used(9e17, 9e16)
    assert use.distribution == "log-normal"
    assert use.spread / use.value == pytest.approx(LOG_3)
    assert use.shift == pytest.approx(to_a_factor.deviation(9e17)) == pytest.approx(2.0)
    assert use.spread_ratio == pytest.approx(0.1 / LOG_3)
    assert use.stated == "1e+17 ×/ 3"
    assert Prior(4e17, 0.05).used(4.2e17, 1e16).stated == "4e+17 ± 2e+16"
    base = in_its_unit.used(295.0, 0.5)
    assert (base.distribution, base.shift, base.spread_ratio) == ("normal", 2.0, 0.5)
    assert base.stated == "293 ± 1"
    # of a parameter that ended at zero there is no logarithm
    assert Prior(1e-6, 0.5).used(0.0, 1e-7).shift == pytest.approx(-2.0)


def test_everything_that_a_prior_may_have_is_a_parameter():
    for probe in (PROBE, Probe.u_shape(), PROBE.in_medium("air")):
        known = parameters_of(probe)
        assert set(default_priors(probe)) <= set(known)
        for name, value in zip(known, probe.values(list(known)), strict=True):
            assert known[name].lower <= value <= known[name].upper
            assert known[name].meaning
    with pytest.raises(InputError, match="did you mean 'heater_width_um'"):
        parameter_of(PROBE, "heater_width")


def test_values_are_moved_in_whatever_section_they_are():
    changed_probe = PROBE.replace({"n_d": 4e17, "gap_um": 3.0, "series_resistance_ohm": 5.0})
    assert changed_probe == PROBE.with_(n_d=4e17, gap_um=3.0, series_resistance_ohm=5.0)
    np.testing.assert_array_equal(changed_probe.values(["gap_um", "n_d"]), [3.0, 4e17])


def test_a_prior_of_the_gas_counts_in_air_only():
    texts = {"gas_conductivity": "± 5%"}
    assert priors_of(texts, PROBE, "here") == {}
    assert priors_of(texts, PROBE.in_medium("air"), "here") == {
        "gas_conductivity": Prior(1.0, 0.05)
    }


def test_in_contact_the_gap_is_known_as_the_height_of_the_tip_that_it_is():
    over = Probe.reference().with_(**{"tip.height_um": 0.7}, medium="air", surface_gap_um=0.7)
    table = parameters_of(over.with_(sample="glass"))
    assert table["surface_gap_um"].spread == table["height_um"].spread
    assert parameters_of(over)["surface_gap_um"].spread == 0.1


def test_films_are_known_no_better_than_their_makers_know_them():
    """How much heat they carry was held, so that a calibration of 7 K was off by 26 K."""
    known = default_priors(metal_film_probe())
    shares = {name: prior.spread for name, prior in known.items() if name.startswith("film.")}
    assert shares == dict.fromkeys(("film.resistivity", "film.tcr", "film.lorenz_ratio"), 0.2)
    assert known["nitride.kappa_exponent"] == Prior(0.33, 0.15, relative=False)
    stated = metal_film_probe().with_(**{"film.kappa": 0.5})
    assert default_priors(stated)["film.kappa"] == Prior(0.5, 0.2)


def test_a_share_of_what_is_negative_is_of_its_size():
    """A resistivity that falls with the temperature had no prior, and was held."""
    probe = metal_film_probe().with_(**{"film.tcr": -1e-4})
    assert default_priors(probe)["film.tcr"] == Prior(-1e-4, 2e-5, relative=False)
    found = priors_of({"film.tcr": "-2e-4 ± 10%"}, probe, "here")
    assert found["film.tcr"] == Prior(-2e-4, 2e-5, relative=False)
