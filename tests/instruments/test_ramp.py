"""A lever is measured bias by bias, and its tip stays below a limit."""

from __future__ import annotations

import errno
from unittest.mock import Mock

import numpy as np
import pytest

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.instruments.ramp import CurveFile, Ramp, RampOptions
from hotlever.instruments.source_meter import MeterReading
from hotlever.instruments.twin import RampCurve, TwinBench, drawn_from_priors
from hotlever.lever.lever import COARSE
from hotlever.measurement import read_measurement
from hotlever.probe import Probe

PAPER = {"laws": "paper"}

pytestmark = pytest.mark.usefixtures("coarse_meshes")


class WithoutLine(TwinBench):
    """Instruments that are called directly."""

    def set_bias(self, bias_V: float) -> None:
        """Set the bias (V)."""
        self.output_on, self.bias_V, self.limit_mA = True, bias_V, 10.0

    def read(self) -> MeterReading:
        """Return what is shown."""
        bias, current, reader = self._shown()
        return MeterReading(bias, self._noisy(current), self._noisy(reader), False)


@pytest.fixture(scope="module")
def curve() -> RampCurve:
    true = drawn_from_priors(Probe.reference(), np.random.default_rng(3))
    return RampCurve.of_probe(true, mesh=COARSE)


def ramp(bias, **options) -> Ramp:
    quick = RampOptions(settle_s=0.0, **options)
    return Ramp(Probe.reference(), np.asarray(bias, dtype=float), quick, PAPER)


def test_the_tip_stays_below_the_limit_and_steps_become_finer_before_it(curve):
    twin, rows = WithoutLine(curve, seed=1), []
    measured = ramp([3.0, 5.0, 9.0, 10.0], stay_below_K=500.0)
    measured.measure(twin, lambda reading, step: rows.append((reading, step)))
    assert measured.complete
    assert "might be above 500 K" in measured.reason or "no more than 4 rows" in measured.reason
    assert 400.0 < twin.hottest_K < 500.0
    assert len(rows) <= 4
    assert rows[-1][0].bias_V not in (9.0, 10.0)
    for reading, step in rows:
        assert curve.at(reading.bias_V)[2] < step.tip_limit_K < 500.0
    last_V = np.array([measured.readings[-1].bias_V])
    low, high = measured.known.likely.band(last_V)[:, 0]
    assert measured.known.tip(last_V)[0] == pytest.approx(twin.hottest_K, abs=20.0)
    assert low < twin.hottest_K < high


def test_the_limit_may_be_the_knee(curve):
    measuring = ramp([1.0], stay_below_K="knee")
    branch = measuring.known.surrogate.branch
    assert measuring.limit_K == pytest.approx(branch.knee.tip_K)


def test_a_fold_is_a_limit_of_its_own():
    """Without a series resistor the lever jumps at its knee."""
    bare = Probe.reference().with_(series_resistance_ohm=0.0)
    measuring = Ramp(bare, np.linspace(1.0, 8.0, 8), RampOptions(stay_below_K=1300.0), PAPER)
    branch = measuring.known.surrogate.branch
    assert measuring.limit_K == pytest.approx(branch.knee.tip_K, abs=1.0)


def test_compliance_ends_it_without_the_row(curve):
    class Limited(WithoutLine):
        def read(self) -> MeterReading:
            return super().read()._replace(at_compliance=self.bias_V > 2.0)

    rows, measured = [], ramp([1.0, 1.5, 2.5])
    measured.measure(Limited(curve), lambda *row: rows.append(row))
    assert measured.complete
    assert "compliance" in measured.reason
    assert [reading.bias_V for reading, _ in rows] == [1.0, 1.5]


def test_rows_of_another_lever_end_it(curve, monkeypatch):
    # what may be behind it is not what is asked here
    monkeypatch.setattr(Diagnosis, "likeliest", lambda _: "is it another lever?")

    class Doubled(WithoutLine):
        def read(self) -> MeterReading:
            reading = super().read()
            return reading._replace(current_mA=5.0 * reading.current_mA)

    measured = ramp([1.0, 2.0, 3.0, 4.0])
    measured.measure(Doubled(curve), lambda *row: None)
    assert not measured.complete
    assert "of no lever like the probe" in measured.reason
    assert measured.reason.endswith("is it another lever?")
    assert len(measured.readings) == 3


def test_biases_that_do_not_rise_are_refused():
    for wrong in ([], [0.0, 1.0], [2.0, 1.0], [-1.0]):
        with pytest.raises(InputError, match="biases that rise"):
            ramp(wrong)


def test_a_limit_that_a_cold_lever_is_above_is_refused():
    with pytest.raises(InputError, match=r"a limit of 250 K, expected one above .*, 293 K"):
        ramp([1.0, 2.0], stay_below_K=250.0)


def test_a_limit_that_no_bias_is_safe_for_leaves_no_row(curve):
    measured = ramp([1.0, 2.0], stay_below_K=293.5)
    measured.measure(WithoutLine(curve), lambda *row: None)
    assert not measured.readings
    assert "beyond 0 V the tip might be above 294 K, with a probability" in measured.reason


def test_rows_are_on_disk_as_they_come_and_can_be_read(tmp_path):
    path = tmp_path / "iv.csv"
    with CurveFile(path, Probe.reference(), with_reader=True) as file:
        for bias in (1.0, 2.0, 3.0):
            file.add(MeterReading(bias, 0.1 * bias, 0.05 * bias, False))
            assert path.read_text().endswith(f"{bias:g},{0.1 * bias:.9g},{0.05 * bias:.9g}\n")
    data = read_measurement(path)
    np.testing.assert_allclose(data.bias_V, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(data.current_mA, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(data.reader_V, [0.05, 0.1, 0.15])
    assert data.series_resistance_ohm == Probe.reference().circuit.series_resistance_ohm
    assert (data.base_temperature_K, data.medium) == (293.0, "vacuum")
    with pytest.raises(InputError, match="exists"), CurveFile(path, Probe.reference(), False):
        pass


def test_a_full_disk_is_one_line(tmp_path, monkeypatch):
    path = tmp_path / "iv.csv"
    with CurveFile(path, Probe.reference(), with_reader=False) as file:
        file.add(MeterReading(1.0, 0.1, float("nan"), False))
        full = OSError(errno.ENOSPC, "No space left on device")
        monkeypatch.setattr("os.fsync", Mock(side_effect=full))
        with pytest.raises(ComputationError, match=r"iv\.csv: cannot be written on \(No space"):
            file.add(MeterReading(2.0, 0.2, float("nan"), False))
    assert "1,0.1\n" in path.read_text()
