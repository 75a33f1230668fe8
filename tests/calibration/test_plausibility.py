"""Data that contradict a probe: refused or doubted, and the likeliest cause is named."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from documents import EXAMPLES
from hotlever.errors import InputError
from hotlever.estimate import Measurement, calibrate, estimator
from hotlever.estimate.diagnosis import Diagnosis, MeasuredRows, hypotheses_of
from hotlever.estimate.knee import IVCurve
from hotlever.estimate.options import FitOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.tip_temperature import what_data_lack
from hotlever.estimate.verdict import check_plausible
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.observables import Linearised
from hotlever.measurement import read_measurement
from hotlever.probe import Probe
from synthetic_curves import measured_curve, measurement_of
from twins import little_known_lever

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.fixture(scope="module")
def curve(reference) -> IVCurve:
    """The reference lever, measured with noise."""
    return measured_curve(reference, np.random.default_rng(4))


@pytest.fixture(scope="module", autouse=True)
def solved_once():
    """Levers as the probe is stated, and as each hypothesis has it, are solved once for all."""
    solved, solve = {}, Diagnosis._linearised

    def once(self: Diagnosis, probe: Probe, names: Sequence[str] = ()) -> Linearised:
        key = probe, tuple(names), repr(self._priors)
        if key not in solved:
            solved[key] = solve(self, probe, names)
        return solved[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Diagnosis, "_linearised", once)
        yield


def altered_measurement(
    curve: IVCurve, rows: slice = slice(None), **changed: np.ndarray
) -> Measurement:
    """Return some rows of a curve as a measurement, with other values in some columns."""
    data = replace(measurement_of(curve), **changed)
    some = {name: values[rows] for name, values in vars(data).items() if np.ndim(values)}
    return replace(data, **some)


def test_equal_rows_are_no_curve(curve):
    equal = {name: np.full(30, getattr(curve, name)[5]) for name in ("bias_V", "current_mA")}
    nothing = dict.fromkeys(("reader_V", "tip_K", "tip_error_K"), np.full(30, np.nan))
    with pytest.raises(InputError, match="at 1 different biases above 0, expected 3 or more"):
        calibrate(Measurement(**equal, **nothing))


@pytest.mark.parametrize(
    ("bias", "current", "probe", "message"),
    [
        pytest.param(
            *(lambda v, i: v, lambda v, i: 1e3 * i),
            *({}, r"kΩ at low bias, expected about 6\.9.*large"),
            marks=pytest.mark.slow,
        ),
        (lambda v, i: v, lambda v, i: 5.0 * i, {}, r"is the current (5|4.99|5.01) times"),
        pytest.param(
            *(lambda v, i: v, lambda v, i: i),
            *({"series_resistance_ohm": 0.0}, r"rather 5\.[56]\d* than"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(lambda v, i: v, lambda v, i: 1e-5 + 0.0 * i, {}, r"hardly any current flows"),
            marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_data_that_cannot_be_this_probe_s_are_refused_with_the_likeliest_cause(
    curve, bias, current, probe, message
):
    volts, mA = curve.bias_V, curve.current_mA
    wrong = altered_measurement(curve, bias_V=bias(volts, mA), current_mA=current(volts, mA))
    with pytest.raises(InputError, match=message):
        calibrate(wrong, probe=Probe.reference().with_(**probe))


@pytest.mark.parametrize(
    ("current", "probe", "question"),
    [
        (lambda i, n: i + 0.04 * i.max() * n, {}, "zero of the current drift"),
        pytest.param(
            *(lambda i, n: i + 0.03 * i.max(), {}, "zero of the current off"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(lambda i, n: i, {"medium": "air"}, "in vacuum, not in air"), marks=pytest.mark.slow
        ),
        pytest.param(
            *(lambda i, n: i, {"thickness_um": 0.8}, "thickness rather 0.[34]"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(lambda i, n: i, {"heater_length_um": 2.6}, "heater length rather"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(lambda i, n: i, {"series_resistance_ohm": 5000.0}, r"resistance, .* rather 5\.[56]"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(lambda i, n: np.minimum(i, 0.8 * i.max()), {}, "is the current clipped"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(lambda i, n: np.where(n < 0.5, i, 0.9 * i), {}, "current jump, .* from row 21"),
            marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_the_likeliest_cause_is_found_by_the_model(curve, current, probe, question):
    wrong = current(curve.current_mA, np.linspace(0.0, 1.0, curve.bias_V.size))
    causes = Diagnosis(
        altered_measurement(curve, current_mA=wrong), Probe.reference().with_(**probe)
    )
    assert re.search(question, causes.likeliest())


def test_currents_of_levers_like_the_stated_one_have_their_derivatives(curve):
    """Of either polarity, and where the branch has ended."""
    lever = Diagnosis(altered_measurement(curve), Probe.reference())._curve
    bias = np.append(np.linspace(-5.0, 13.0, 30), 500.0)
    rows = MeasuredRows(bias, np.zeros_like(bias), 5.6, np.ones(bias.size, dtype=bool))
    away, step = 0.1 * np.random.default_rng(0).normal(size=lever.at.size), 1e-6
    by = lever.current_by_logarithm(away, rows)
    for number, change in enumerate(step * np.eye(away.size)):
        ends = (lever.current(away + way * change, rows) for way in (1.0, -1.0))
        difference = np.subtract(*ends) / (2.0 * step)
        np.testing.assert_allclose(by[:, number], difference, atol=1e-7)


@pytest.mark.slow
def test_one_sweep_of_another_lever_is_no_two_sweeps(long_u_shape):
    """A U-shape of 120 µm, taken for the reference probe."""
    causes = Diagnosis(long_u_shape, Probe.reference()).named()
    assert causes.startswith("is the drawing that of another lever, u-shape?")
    assert "sweeps" not in causes
    assert "jump" not in causes


@pytest.fixture(scope="module")
def long_u_shape() -> Measurement:
    """A U-shape of 120 µm, behind a resistor that the reference probe has too."""
    lever = Lever(Probe.u_shape().with_(length_um=120.0), COARSE).branch()
    return altered_measurement(measured_curve(lever, np.random.default_rng(0)))


def test_another_lever_is_asked_for_before_one_is_searched_for(long_u_shape, monkeypatch):
    """It took a minute, and then named two sweeps."""
    monkeypatch.setattr(estimator, "solve", lambda *_: pytest.fail("a search"))
    asked = "no lever like the probe shows such currents: is the drawing that of another lever, u-"
    with pytest.raises(InputError, match=asked):
        calibrate(long_u_shape, probe=Probe.reference())


def test_a_lever_that_nothing_known_explains_is_no_search_either(monkeypatch):
    """A real curve of 120 µm in air, taken for the reference probe: 40 s, and no cause named."""
    monkeypatch.setattr(estimator, "solve", lambda *_: pytest.fail("a search"))
    data = read_measurement(EXAMPLES / "uiuc-lever.csv")
    with pytest.raises(InputError, match="such currents: is it another lever, or in another med"):
        calibrate(data, probe=Probe.reference())


def test_no_right_lever_is_taken_for_another(curve, long_u_shape):
    """Neither one that is not the usual one of its shape."""
    right = Probe.u_shape().with_(length_um=120.0)
    assert Diagnosis(long_u_shape, right).of_another_lever() == ""
    assert Diagnosis(altered_measurement(curve), Probe.reference()).of_another_lever() == ""


def test_a_lever_of_which_both_polarities_were_measured_is_no_other_one(curve):
    """Half of the rows have negative biases: all of them had counted as without a current."""
    sign = np.where(np.arange(curve.bias_V.size) % 2, 1.0, -1.0)
    both = altered_measurement(
        curve, bias_V=sign * curve.bias_V, current_mA=sign * curve.current_mA
    )
    thermoelectric = Probe.reference().with_physics(("thermoelectric",))
    assert Diagnosis(both, thermoelectric).of_another_lever() == ""
    with pytest.raises(InputError, match="expected 0 or more: a lever shows the same"):
        calibrate(both, probe=Probe.reference())


def test_a_current_in_few_steps_is_of_no_other_lever(curve):
    """Half a step is an error of the meter: a jump was asked about at the third row."""
    step = curve.current_mA.max() / 20.0
    coarse = altered_measurement(curve, current_mA=np.round(curve.current_mA / step) * step)
    assert Diagnosis(coarse, Probe.reference()).of_another_lever() == ""


@pytest.mark.slow
def test_a_lever_of_which_little_is_known_is_looked_for_from_its_cold_rows():
    """Three times less doping than stated: all rows at once led away, and it was refused."""
    unknown = little_known_lever(114, obey=True)
    assert Diagnosis(unknown.measurement, unknown.nominal).of_another_lever() == ""


@pytest.mark.parametrize(
    ("way", "are_two"), [("jittering", False), ("down", False), ("back", True)]
)
def test_one_sweep_is_never_asked_to_be_two(way, are_two):
    bias = np.linspace(0.5, 10.0, 60)
    bias = {
        "jittering": bias + 0.3 * np.sin(2.0 * np.arange(60)),
        "down": bias[::-1],
        "back": np.append(bias, bias),
    }[way]
    rows = MeasuredRows(bias, 0.1 * bias, 5.6, np.ones(bias.size, dtype=bool))
    questions = [each.asks(20.0) for each in hypotheses_of(rows, Probe.reference(), [])]
    assert any("two sweeps" in question for question in questions) == are_two


@pytest.mark.parametrize("kohm", [2.0, 12.0])
def test_a_resistor_that_is_hardly_known_may_be_another(curve, kohm):
    """A cold resistance below the stated resistor alone was refused."""
    probe = Probe.reference().with_(series_resistance_ohm=1e3 * kohm)
    priors = {"series_resistance_ohm": "×/ 3"}
    options = FitOptions(priors=priors, usual_priors=True)
    problem = Problem.of(altered_measurement(curve), probe, options)
    check_plausible(problem)


def test_good_data_have_no_cause(curve):
    assert Diagnosis(altered_measurement(curve), Probe.reference()).likeliest() == ""


def test_a_fit_that_is_another_lever_s_is_said_to_be(curve):
    assert Diagnosis(altered_measurement(curve), Probe.reference()).named(fitted=True) == (
        "is it the fit of another lever?"
    )


@pytest.mark.slow
def test_a_hot_plate_that_was_not_stated_is_noticed():
    """If the laws are exact: departures of them would explain a base 60 K warmer, unnoticed."""
    warm = Lever(Probe.reference().with_(base_temperature_K=353.0)).branch()
    wrong = altered_measurement(measured_curve(warm, np.random.default_rng(0)))
    calibration = calibrate(wrong, probe=Probe.reference(), priors={"laws": "paper"})
    assert "would have to be another" in calibration.reason
    assert "is the base temperature rather about 353 K?" in calibration.reason


def test_temperatures_in_degrees_celsius_are_refused(curve):
    tips = np.full(curve.bias_V.size, np.nan)
    tips[[5, 20]] = 80.0, 400.0
    with pytest.raises(InputError, match=r"T_tip is 80 K at .* is it in °C, or another column"):
        calibrate(altered_measurement(curve, tip_K=tips))


@pytest.mark.parametrize(
    ("rows", "step", "remark"),
    [
        (slice(20, 24), 0.0, "4 rows with a current: few for a lever"),
        (slice(None), 0.05, "a resolution of 0.05 mA only"),
        (slice(None), -0.05, "a resolution of 0.05 mA only, 3."),
        (slice(None, 12), 0.0, "measured only up to a tip of 3"),
    ],
)
def test_what_the_data_lack_is_remarked(curve, reference, rows, step, remark):
    current = np.round(curve.current_mA / abs(step)) * step if step else curve.current_mA
    data = altered_measurement(curve, rows, current_mA=current)
    tips = reference.tip_temperature(curve.power_mW[rows])
    remarks = what_data_lack(data, curve.circuit, tips)
    assert [text for text in remarks if remark in text]


def test_a_calibration_notes_what_its_data_lack(curve):
    notes = calibrate(altered_measurement(curve, slice(20, 24))).notes
    assert [text for text in notes if "4 rows with a current: few" in text]
