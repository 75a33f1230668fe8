"""Fits and calibrations are one estimation: the same data and priors, the same lever."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hotlever
from hotlever.estimate import calibrate, fit

pytestmark = pytest.mark.usefixtures("coarse_meshes")

SLOW = pytest.mark.slow
FOLDER = Path(hotlever.__file__).parent / "examples"
EXAMPLES = [
    ("lever-a.csv", None),
    pytest.param("uiuc-lever.csv", "uiuc-lever.toml", marks=SLOW),
    pytest.param("lever-b.csv", None, marks=SLOW),
    pytest.param("boron-lever.csv", "boron-lever.toml", marks=SLOW),
    pytest.param("palladium-on-nitride.csv", "palladium-on-nitride.toml", marks=SLOW),
    pytest.param("reference-probe.csv", None, marks=SLOW),
]


@pytest.mark.parametrize(("data", "probe"), EXAMPLES)
def test_fit_and_calibrate_give_the_same_parameters(data, probe):
    stated = None if probe is None else FOLDER / probe
    calibration = calibrate(FOLDER / data, probe=stated)
    fitted = fit(FOLDER / data, stated, usual_priors=True)
    assert fitted.describes_data == calibration.describes_data
    names = fitted.names
    assert set(calibration.priors) >= set(names)
    # one posterior, of which both give what they are asked for
    stderr = np.array([fitted.parameters[name].stderr for name in names])
    spread = [calibration.priors[name].posterior_spread for name in names]
    np.testing.assert_allclose(stderr, spread, rtol=1e-6)
    off = fitted.probe.values(names) - calibration.probe.values(names)
    assert np.abs(off / stderr).max() < 1e-6
