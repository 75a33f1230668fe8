"""What to measure next: the error that is foretold is the one that comes, no tip gets too hot."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from documents import EXAMPLES
from hotlever.errors import InputError
from hotlever.estimate import calibrate, plan_next, read_calibration
from hotlever.estimate.experiment import TIP
from hotlever.estimate.next_measurement import LinearisedLever
from hotlever.estimate.surrogate import Rows
from hotlever.lever.lever import COARSE, Lever
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.quantities import THERMOMETER

pytestmark = pytest.mark.usefixtures("coarse_meshes")

#: Noise of currents and, with the same error in common, of Raman temperatures.
CURRENT, RAMAN = 2e-3, 0.01


@pytest.fixture(scope="module")
def measure(coarse):
    """Measure the reference lever at biases (V), at some of them with a spectrum."""
    random = np.random.default_rng(5)

    def measured(bias, spectra):
        sweep = coarse.sweep(np.sort(bias))
        tip, rise = (np.full(bias.size, np.nan) for _ in range(2))
        spectrum = np.isin(np.sort(bias), spectra)
        rise[spectrum] = sweep.tip_K.values[spectrum] - 293.0
        tip[spectrum] = 293.0 + (rise * (1.0 + RAMAN * random.standard_normal(bias.size)))[spectrum]
        noise = 1.0 + CURRENT * random.standard_normal(bias.size)
        nothing = np.full(bias.size, np.nan)
        return Measurement(
            sweep.bias.values, sweep.current_mA.values * noise, nothing, tip, RAMAN * rise
        )

    return measured


@pytest.fixture(scope="module")
def first(measure):
    """A sweep to 7.2 V with one spectrum, and its calibration."""
    bias = np.linspace(0.6, 7.2, 12)
    return bias, calibrate(measure(bias, bias[-1:]))


@pytest.fixture(scope="module")
def known(first):
    """The lever as that calibration leaves it; those that may be drawn of it are drawn once."""
    return LinearisedLever.of_calibration(first[1])


@pytest.fixture(scope="module")
def plan(first):
    return plan_next(first[1], at_K=500.0, stay_below_K=700.0, count=6)


def with_proposed(calibration, plan, measure):
    """Return what was calibrated, and beside it what a plan proposes, measured."""
    before, proposed = calibration.measurement, plan.proposals
    # a spectrum that is taken twice is two rows
    added = proposed.bias_V.values + 1e-4 * np.arange(proposed.sizes["proposal"])
    more = measure(added, added[proposed.what.values == "spectra"])
    columns = {
        name: np.concatenate([getattr(before, name), getattr(more, name)])
        for name in ("bias_V", "current_mA", "reader_V", "tip_K", "tip_error_K")
    }
    return replace(before, **columns)


def scatter_of_the_knee(lever, count=400):
    """Return the standard deviation of the knees (K) of levers drawn as they are known."""
    spread = np.linalg.cholesky(lever.information.covariance)[: len(lever.names)]
    drawn = spread @ np.random.default_rng(1).standard_normal((spread.shape[1], count))
    levers = (lever.surrogate.branch_at(lever.parameters(away)) for away in drawn.T)
    return np.std([branch.knee.tip_K for branch in levers if branch.knee is not None])


def test_the_error_now_is_the_one_that_the_calibration_states(first, tmp_path):
    first[1].write(tmp_path / "cal.json")
    calibration = read_calibration(tmp_path / "cal.json")
    table = calibration.table
    plan = plan_next(calibration, at_K=450.0, count=1)
    stated = np.interp(450.0, table.tip_K, table.tip_stderr_K)
    assert plan.proposals.stderr_now_K.item() == pytest.approx(stated, rel=0.02)
    # and at all others
    now = plan.errors.sel(added=0).isel(bias=plan.errors.bias.values < table.bias_V.values[-1])
    stated = np.interp(now.bias, table.bias_V, table.tip_stderr_K)
    np.testing.assert_allclose(now.tip_stderr_K, stated, rtol=0.05)


def test_the_error_that_is_foretold_is_the_one_that_then_comes(first, plan, measure):
    then = calibrate(with_proposed(first[1], plan, measure)).table
    stated = np.interp(500.0, then.tip_K, then.tip_stderr_K)
    assert plan.proposals.stderr_then_K.values[-1] == pytest.approx(stated, rel=0.25)
    assert stated < 0.9 * plan.proposals.stderr_now_K.values[0]


@pytest.fixture(scope="module")
def unmeasured():
    """The reference lever as its priors tell it."""
    return LinearisedLever.of_priors(Probe.reference(), {"base_temperature_K": "293 ± 2"})


@pytest.mark.parametrize("name", ["c_kappa", "delta", "n_d", "base_temperature_K"])
def test_the_knee_moves_with_parameters_as_those_of_levers_that_have_others(name, unmeasured):
    lever = unmeasured
    number, slopes = lever.names.index(name), lever.knee()[2]
    moved = [
        Lever(lever.probe.replace(dict(zip(lever.names, values, strict=True))), COARSE)
        for way in (-2e-3, 2e-3)
        for values in [lever.parameters(way * np.eye(len(lever.names))[number]).tolist()]
    ]
    differences = np.diff([each.branch().knee.tip_K for each in moved]) / 4e-3
    assert slopes[number] == pytest.approx(differences.item(), rel=2e-2, abs=0.05)


@pytest.mark.slow
def test_the_error_of_the_knee_is_the_scatter_of_the_knees_of_such_levers(measure):
    """Now, and as foretold of the posterior once what is proposed has been measured.

    Nor do the first spectra of a lever beat the scale of their thermometer.
    """
    calibration = calibrate(measure(np.linspace(0.6, 9.6, 16), []))
    plan = plan_next(calibration, quantity="knee", count=4, noise={"tip": RAMAN})
    now = scatter_of_the_knee(LinearisedLever.of_calibration(calibration))
    assert plan.proposals.stderr_now_K.values[0] == pytest.approx(now, rel=0.15)
    then = LinearisedLever.of_calibration(calibrate(with_proposed(calibration, plan, measure)))
    foretold = plan.proposals.stderr_then_K.values[-1]
    assert foretold == pytest.approx(scatter_of_the_knee(then), rel=0.25)
    assert THERMOMETER * (plan.at_K - 293.0) * 0.8 < foretold < 0.8 * now
    assert plan.text().startswith(f"The knee at {plan.at_K:.0f} K is known to ± ")


def test_what_is_proposed_of_the_knee_tells_more_of_it_than_what_is_of_a_cold_tip(known):
    knee, cold = (
        plan_next(known=known, count=3, **aim) for aim in ({"quantity": "knee"}, {"at_K": 400.0})
    )
    assert knee.proposals.tip_K.values.max() > cold.proposals.tip_K.values.max()
    assert knee.at_K == pytest.approx(known.surrogate.branch.knee.tip_K)


def test_nothing_is_proposed_beyond_the_limit(plan):
    proposals, errors = plan.proposals, plan.errors
    assert np.all(proposals.tip_limit_K < 700.0)
    assert np.all(proposals.bias_V <= plan.safe_V)
    assert plan.safe_V <= plan.safe_then_V
    # where the tip is cold it is so many standard errors that 99 % lie below
    cold = errors.isel(bias=errors.tip_K.values < 400.0)
    away = (cold.tip_limit_K - cold.tip_K) / cold.tip_stderr_K.sel(added=0)
    assert away.values == pytest.approx(2.33, rel=0.15)
    assert np.all(np.diff(proposals.stderr_then_K) < 0.0)
    together = proposals.stderr_now_K[0] - proposals.stderr_then_K[-1]
    assert proposals.gain.sum() == pytest.approx(float(together))


@pytest.mark.slow
def test_of_levers_drawn_from_the_priors_one_in_a_hundred_is_hotter_than_said():
    lever = LinearisedLever.of_priors(Probe.reference())
    plan = plan_next(probe=Probe.reference(), stay_below_K=900.0, count=1)
    spread = np.linalg.cholesky(lever.information.covariance)
    random, count = np.random.default_rng(0), len(lever.names)
    surrogate = lever.surrogate.reading(Rows(np.array([plan.safe_V])))
    drawn = (spread @ random.standard_normal((len(spread), 1500)))[:count].T
    tips = [surrogate.values_at(lever.parameters(away))[TIP, 0] for away in drawn]
    assert 0.003 < np.mean(np.array(tips) > 900.0) < 0.03
    assert np.quantile(tips, 0.99) == pytest.approx(900.0, abs=60.0)


def test_spectra_at_one_bias_do_not_beat_the_scale_of_their_thermometer():
    plan = plan_next(bias=np.array([6.4]), allowed={"spectra": None}, count=60)
    common, then = THERMOMETER * (plan.at_K - 293.0), plan.proposals.stderr_then_K.values
    assert then[0] > 1.5 * common
    assert then[-1] == pytest.approx(common, rel=0.1)
    assert "60 spectra at 6.400 V: no other measurement that is allowed tells more" in (
        text := plan.text()
    )
    assert f"the last takes off {then[-2] - then[-1]:.1f} K." in text


def test_no_meter_is_better_than_the_model(known):
    """What a better meter would show is not believed by the calibration that follows either."""
    then = [
        plan_next(
            known=known, at_K=500.0, allowed={"bias": None}, count=1, noise={"current": noise}
        ).proposals.stderr_then_K.item()
        for noise in (2e-3, 1e-5, 1e-6)
    ]
    # what is not known of the laws is most of the error, whatever the meter
    assert then[1] < 0.9999 * then[0]
    assert then[2] == pytest.approx(then[1], rel=1e-3)


def test_costs_decide(known, plan):
    dear = plan_next(known=known, at_K=500.0, count=1, costs={"bias": 1.0, "spectra": 1e4})
    assert plan.proposals.what.values[0] == "spectra"
    assert dear.proposals.what.item() == "bias"


def test_a_dimension_is_proposed_once_and_tells_what_its_prior_would():
    """Of a lever with one dimension known to 1 %, as after it was measured to that."""
    allowed = {"dimensions": None}
    plan = plan_next(allowed=allowed, count=40, at_K=500.0, noise={"dimensions": 0.01})
    names = plan.proposals.what.values.tolist()
    assert len(names) == len({*names}) < 40
    assert np.isnan(plan.proposals.bias_V.values).all()
    assert f"{names[0]}        –" in plan.text()
    # what was known to 3 % and was measured to 1 % is known to that
    together = f"± {100.0 / np.sqrt(1.0 / 0.03**2 + 1.0 / 0.01**2):.4f} %"
    lever = LinearisedLever.of_priors(Probe.reference(), {names[0]: "± 3%"})
    known = LinearisedLever.of_priors(Probe.reference(), {names[0]: together})
    gradient = lever.tip(np.array([lever.bias_for(500.0)]))[1]
    row = lever.dimensions(0.01)[names[0]]
    measured = lever.information.with_rows(row[None]).stderr(gradient)
    assert measured == pytest.approx(known.information.stderr(gradient), rel=1e-3)
    assert measured < 0.99 * lever.information.stderr(gradient)


def test_data_that_are_not_described_get_no_proposals(first):
    doubtful = replace(first[1], reason="the current differs")
    with pytest.raises(InputError, match="no lever like this one shows these data"):
        plan_next(doubtful)
    for missing in ({"weights": None}, {"priors": {}}):
        with pytest.raises(InputError, match="without priors or the weights of its data"):
            plan_next(replace(first[1], **missing))


def test_where_all_rows_were_set_aside_the_next_has_the_usual_noise(first):
    none = {name: 0.0 * weights for name, weights in first[1].weights.items()}
    plan = plan_next(replace(first[1], weights=none), at_K=500.0, count=1)
    assert plan.proposals.stderr_then_K.item() < plan.proposals.stderr_now_K.item()


def test_the_command_writes_a_row_for_each_proposal(run, first):
    first[1].write("cal.json")
    words = ("cal.json", "--at", "500K", "--stay-below", "700K", "--allow", "bias=2,spectra=1")
    status, out, err = run("next", *words, "-o", "next.csv", "--plot", "next.png")
    assert (status, err) == (0, "")
    assert "the tip stays below 700 K, with a certainty of 99%" in out
    rows = list(csv.DictReader(Path("next.csv").read_text(encoding="utf-8").splitlines()))
    names = "what,bias_V,gain,tip_K,tip_high_K,stderr_now_K,stderr_then_K"
    assert list(rows[0]) == names.split(",")
    assert sorted(row["what"] for row in rows) == ["bias", "bias", "spectra"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--allow", "pulse"), "expected some of bias, reader, spectra, dimensions"),
        (("--allow", "spectrum"), "did you mean 'spectra'"),
        (("--quantity", "kne"), "did you mean 'knee'"),
        (("--quantity", "knee", "--at", "800K"), "the knee has a temperature of its own"),
        (("--allow", "bias=0"), "a whole number from 1 to 100"),
        (("--stay-below", "250K"), "no bias is safe"),
        (("--at", "3000K"), "expected a temperature from 293 to"),
        (("--at", "80"), "expected a number with a unit like K"),
        (("--cost", "spectra=10min"), "found none of bias"),
        (("--cost", "spectra=10kg"), "a time such as 30s or 10min"),
        (("--noise", "current=2"), "expected a share"),
        (("--bias", "20:30:5"), "expected some above 0 and up to"),
        (("none.json",), "none.json: no such file"),
        (("c.json", "--prior", "n_d=±5%"), "the calibration has its own"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(refused, words, expected):
    assert expected in refused("next", *words, below_notes=True)


@pytest.mark.parametrize("words", [("--quantity", "kne"), ("--allow", "spectrum")])
def test_a_wrong_name_is_refused_before_data_are_calibrated(run, words):
    status, _, err = run("next", EXAMPLES / "lever-a.csv", *words)
    assert (status, err.count("\n")) == (2, 1)


def test_no_spectra_are_proposed_of_a_heater_without_silicon():
    film = LinearisedLever.of_priors(Probe.from_file(EXAMPLES / "palladium-on-nitride.toml"))
    plan = plan_next(known=film, count=3, at_K=400.0)
    assert set(plan.proposals.what.values.tolist()) == {"bias"}
    spectra_plan = plan_next(known=film, count=3, at_K=400.0, allowed={"spectra": None})
    assert set(spectra_plan.proposals.what.values.tolist()) == {"spectra"}
