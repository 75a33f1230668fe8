"""A lever that is measured row by row is known as a calibration of all rows knows it."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate import calibrate
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.next_measurement import LinearisedLever
from hotlever.instruments.ramp import RowByRow
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.probe import Probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")


def rows(coarse, count, factor=1.0):
    """Measure the first rows of a sweep."""
    bias = np.linspace(0.6, 6.6, 11)[:count]
    noise = 1.0 + 2e-3 * np.random.default_rng(4).standard_normal(count)
    nothing = np.full(count, np.nan)
    current = factor * coarse.sweep(bias).current_mA.values * noise
    return Measurement(bias, current, nothing, nothing, nothing, medium="vacuum")


def test_what_is_known_after_each_row_is_what_a_calibration_says(coarse, monkeypatch):
    lever = RowByRow(Probe.reference())
    lever.update(rows(coarse, 8))
    solved, linearised = [], SimilarLevers.linearised
    monkeypatch.setattr(
        SimilarLevers,
        "linearised",
        lambda *each, **others: solved.append(each) or linearised(*each, **others),
    )
    for count in (9, 10, 11):
        lever.update(rows(coarse, count))
    # a row asks for a lever or two
    assert len(solved) <= 6
    monkeypatch.undo()
    whole = LinearisedLever.of_calibration(calibrate(rows(coarse, 11)))
    bias = np.array([3.0, 6.6, 7.2])
    (tip, slopes), (of_whole, slopes_of_whole) = lever.known.tip(bias), whole.tip(bias)
    stderr = whole.information.stderr(slopes_of_whole)
    assert lever.known.information.stderr(slopes) == pytest.approx(stderr, rel=0.15)
    assert np.abs(tip - of_whole).max() < 0.3 * stderr.max()
    assert lever.known.likely.band(bias) == pytest.approx(whole.likely.band(bias), rel=0.02)


def test_rows_of_another_lever_are_refused(coarse, monkeypatch):
    # what may be behind it is not what is asked here
    monkeypatch.setattr(Diagnosis, "likeliest", lambda _: "is it another lever?")
    lever = RowByRow(Probe.reference())
    with pytest.raises(InputError, match="is it another lever"):
        lever.update(rows(coarse, 6, factor=4.0))
