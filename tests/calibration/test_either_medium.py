"""A lever whose medium nobody knows: both are tried, and errors hold both if both describe it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hotlever.errors import ComputationError, InputError
from hotlever.estimate import Measurement, calibrate, estimator, fit, read_calibration
from hotlever.estimate.residuals import Residuals
from hotlever.estimate.tip_table import PulseTiming
from synthetic_curves import measured_curve, measurement_of

pytestmark = pytest.mark.usefixtures("coarse_meshes")

#: Where a lever is so cold that little tells what it is in (K).
COLD_K = 480.0


@pytest.fixture(scope="module")
def cold(lever, reference):
    """The cold part of the reference lever's curve, measured in vacuum."""
    whole = measurement_of(measured_curve(reference, np.random.default_rng(0)))
    tip_K = reference.tip_K(reference.read(lever.circuit, whole.bias_V).u)
    return replace(whole.part(tip_K < COLD_K), medium=None)


@pytest.fixture(scope="module")
def calibrated_in(cold):
    """What is calibrated in a medium, once for all that ask for it."""
    return cache(lambda medium: calibrate(cold, medium=medium))


@pytest.mark.slow
def test_errors_hold_both_media_where_the_data_do_not_tell(
    cold, calibrated_in, reference, monkeypatch
):
    # whose errors do not hold both, as a note says
    monkeypatch.setattr(estimator, "pulse_calibration", lambda *_: None)
    either = calibrate(cold, medium="unknown", pulse=PulseTiming(5.0))
    assert "do not tell which" in either.notes[0]
    assert either.notes[-1].startswith(f"the pulse is that of a lever in {either.medium}")
    table = either.table
    own = calibrated_in(either.medium).table
    other = calibrated_in("air" if either.medium == "vacuum" else "vacuum").table
    # but for rounding: factorisations begin with the pivots of what was solved before
    np.testing.assert_allclose(table.tip_K, own.tip_K, atol=1e-5)
    away = np.abs(other.tip_K - own.tip_K)
    np.testing.assert_allclose(table.budget_K.sel(source="medium"), away / np.sqrt(2.0), atol=0.05)
    np.testing.assert_allclose(table.tip_stderr_K**2, own.tip_stderr_K**2 + away**2 / 2, rtol=0.01)
    for limit, hold in (("tip_low_K", np.minimum), ("tip_high_K", np.maximum)):
        np.testing.assert_allclose(table[limit], hold(own[limit], other[limit]), atol=0.05)
    assert either.gum.budget.inputs[-1].quantity == "medium"
    at_budget = table.sel(bias=either.gum.bias_V)
    assert either.gum.budget.u == pytest.approx(at_budget.tip_stderr_K.item(), rel=1e-6)
    assert either.gum.limits_K == (at_budget.tip_low_K, at_budget.tip_high_K)
    # the Monte Carlo method's interval holds both media, as the limits do
    assert either.gum.monte_carlo.agrees(either.gum.limits_K, either.gum.budget.tolerance)
    true = reference.tip_temperature(table.power_mW)
    assert np.all((table.tip_low_K <= true) & (true <= table.tip_high_K))


def test_the_error_at_the_knee_holds_both_media_too():
    stored = sorted(Path(__file__).parents[1].glob("stored/*/calibration.json"))[-1]
    read = read_calibration(stored)
    band = dict(read.tip_table.columns)
    own = replace(read, band_columns=band, knee=replace(read.knee, tip_K_stderr=10.0))
    other = replace(own, knee=replace(own.knee, tip_K=own.knee.tip_K + 40.0))
    knee = own.in_either(other).knee
    assert knee.tip_K_stderr == pytest.approx(np.hypot(10.0, 40.0 / np.sqrt(2.0)))
    assert knee == replace(own.knee, tip_K_stderr=knee.tip_K_stderr)


def test_a_fit_in_either_medium_is_one_in_the_better(cold):
    priors = {"n_d": "3.3e17 ± 15%"}
    either = fit(cold, medium="unknown", usual_priors=True, priors=priors)
    own = fit(cold, medium=either.medium, usual_priors=True, priors=priors)
    assert either.options.medium == either.medium
    # but for rounding: factorisations begin with the pivots of what was solved before
    away = [
        (parameter.value - own.parameters[name].value) / own.parameters[name].stderr
        for name, parameter in either.parameters.items()
        if parameter.vary
    ]
    np.testing.assert_allclose(away, 0.0, atol=1e-5)
    assert np.all(either.band.tip_stderr_K >= own.band.tip_stderr_K)
    assert either.band.tip_stderr_K[-1] > 1.05 * own.band.tip_stderr_K[-1]


@pytest.mark.slow
def test_what_describes_the_data_is_the_answer(reference):
    """By the laws of the paper, which its lever obeys: with others it may be one in air."""
    measured = measurement_of(measured_curve(reference, np.random.default_rng(0)))
    unknown = replace(measured, medium=None)
    calibration = calibrate(unknown, medium="unknown", priors={"laws": "paper"})
    assert calibration.describes_data
    assert calibration.medium == "vacuum"
    assert "in air a lever does not describe the data" in calibration.notes[0]
    assert "medium" not in calibration.table.source.values


def answers(of: dict[str, tuple[str, float] | Exception]) -> Any:
    """Answer as told: a reason against it, and how unlikely it is."""

    def answered(medium: str) -> tuple[Any, Any]:
        answer = of[medium]
        if isinstance(answer, Exception):
            raise answer
        reason, deviance = answer
        return SimpleNamespace(posterior=SimpleNamespace(deviance=deviance)), Answer(medium, reason)

    return answered


@dataclass
class Answer:
    """An outcome of which only this much counts."""

    medium: str
    reason: str
    notes: tuple[str, ...] = ()
    residual_rms: Mapping[str, float] = field(default_factory=lambda: {"current_mA": 0.00123})

    def in_either(self, other: Answer) -> Answer:
        return replace(self, medium=f"{self.medium} or {other.medium}")


def likelier(of: dict[str, tuple[str, float] | Exception]) -> Any:
    """The answer in an unknown medium, with both media in its name if it is of either."""

    return estimator.in_medium("unknown", answers(of))[1]


def test_a_described_answer_comes_before_a_likelier_one():
    answer = likelier({"vacuum": ("", 9.0), "air": ("no such lever", 1.0)})
    assert answer.medium == "vacuum"
    assert answer.notes == [
        "the medium is not known: in vacuum a lever describes the data (rms 0.0012 mA); "
        "in air a lever does not describe the data (rms 0.0012 mA)"
    ]


def test_of_two_described_the_likelier_is_the_answer():
    assert likelier({"vacuum": ("", 9.0), "air": ("", 1.0)}).medium == "air or vacuum"


def test_of_two_that_are_not_described_the_nearer_is_shown():
    assert likelier({"vacuum": ("no", 9.0), "air": ("no", 1.0)}).medium == "air"


def test_what_cannot_be_solved_is_said():
    failure = ComputationError("it melts")
    answer = likelier({"vacuum": failure, "air": ("", 1.0)})
    assert answer.medium == "air"
    assert answer.notes[0].endswith("in vacuum there is none: it melts")
    with pytest.raises(ComputationError, match="it melts"):
        likelier({"vacuum": failure, "air": failure})


def test_the_medium_that_is_asked_for_wins_over_what_the_file_says(cold, calibrated_in):
    """Once a calibration in air of what a file calls vacuum was one in vacuum, without a word."""
    assert cold.medium is None
    in_air = calibrate(replace(cold, medium="vacuum"), medium="air")
    assert in_air.medium == "air"
    # factors begin with the pivots of earlier matrices, and rounding decides how many steps a state
    # of a coarse lever takes; vacuum would be tens of kelvins away
    np.testing.assert_allclose(in_air.table.tip_K, calibrated_in("air").table.tip_K, rtol=1e-6)
    expected_note = "medium: air, as asked, although the data file says vacuum"
    assert [note for note in in_air.notes if "medium" in note] == [expected_note]


def test_only_data_may_be_of_an_unknown_medium(refused, cold):
    assert "--medium unknown: expected vacuum or air" in refused("sweep", "--medium", "unknown")
    with pytest.raises(InputError, match="unknown medium 'unknow'"):
        fit(cold, medium="unknow")


def test_a_left_out_datum_is_no_gain():
    """Of two levers, one that leaves a datum out is no likelier than one just so far from it."""
    bias = np.linspace(1.0, 10.0, 20)
    current, nothing = 0.1 * bias, np.full(20, np.nan)
    outlying_current = current.copy()
    outlying_current[7] += 0.1
    errors = np.full(20, 0.01)
    measured = Measurement(
        bias, outlying_current, nothing, nothing, nothing, further={"current_error_mA": errors}
    )
    residuals = Residuals(measured, ["current"], "errors")
    values = np.stack([current, nothing, nothing])
    plain = residuals.errors.normalisation
    assert plain == pytest.approx(2.0 * 20 * np.log(0.01))
    residuals.errors.lessen(residuals.difference(values), gently=False)
    assert np.sum(residuals.weighted(values) ** 2) == pytest.approx(0.0, abs=1e-9)
    assert residuals.errors.normalisation == pytest.approx(plain + 36.0)
