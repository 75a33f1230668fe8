"""Diffusion of phosphorus while annealing."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.materials import published
from hotlever.materials.silicon import (
    diffusion_length,
    phosphorus_diffusivity,
)
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S


def test_the_slope_of_the_diffusivity_is_exact():
    high, low = (phosphorus_diffusivity(1400.0 + sign * 0.1)[0] for sign in (1, -1))
    slope = phosphorus_diffusivity(1400.0)[1]["T"]
    assert float(slope) == pytest.approx(float(high - low) / 0.2, rel=1e-6)


def test_the_paper_s_annealing_gives_the_paper_s_diffusion_within_the_law_s_error():
    diffusivity, _ = phosphorus_diffusivity(ANNEALING_K)
    assert float(diffusivity) == pytest.approx(1e-12, rel=0.4)
    fitted = (published("option III").material.delta / 2e4) ** 2 / ANNEALING_S
    assert 0.5 < fitted / float(diffusivity) < 1.4


def test_the_length_grows_with_the_root_of_the_time():
    lengths = diffusion_length(ANNEALING_K, np.array([1.0, 4.0]) * ANNEALING_S)
    assert lengths[1] == pytest.approx(2 * lengths[0])
    assert diffusion_length(ANNEALING_K + 10, ANNEALING_S) > lengths[0]


@pytest.mark.parametrize(("temperature", "time"), [(0.0, 1.0), (1400.0, -1.0)])
def test_impossible_annealing_is_refused(temperature, time):
    with pytest.raises(InputError, match="positive temperature"):
        diffusion_length(temperature, time)
