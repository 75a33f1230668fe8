"""Forward sensitivities: Taylor order 2 for every parameter and observable."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.lever import Lever
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.lever import OBSERVABLE_COLUMNS
from hotlever.materials import PARAMETERS
from hotlever.probe import MeshOptions, Probe

BIAS = np.array([4.0, 7.5, 10.5])
#: Relative steps: the remainder must be well above Newton's tolerance and still quadratic.
STEPS = (0.04, 0.02, 0.01)


@pytest.mark.parametrize("name", PARAMETERS)
def test_sensitivities_have_taylor_order_two(coarse, name):
    start = coarse.sweep(BIAS, sensitivities=True)
    value = getattr(coarse.probe.material, name)
    material = coarse.probe.material
    moved = [
        coarse.with_material(material.with_(**{name: value * (1 + step)})).sweep(BIAS)
        for step in STEPS
    ]
    for observable in OBSERVABLES:
        column = OBSERVABLE_COLUMNS[observable]
        slope = start.sensitivity.sel(observable=observable, parameter=name)
        rest = np.array(
            [
                np.abs(one[column] - start[column] - step * value * slope)
                for step, one in zip(STEPS, moved, strict=True)
            ]
        )
        orders = np.log2(rest[:-1] / rest[1:])
        # a straight line leaves no remainder to measure an order of; where the curvature happens
        # to vanish the order is higher, and a wrong slope would make it one
        linear = rest[0] < 1e-7 * np.abs(start[column].values)
        assert orders[-1][~linear].min(initial=2.0) > 1.75, (observable, orders)


def test_a_lever_without_reader_has_no_reader_sensitivity():
    lever = Lever(Probe.u_shape(), MeshOptions(refinement=0.4))
    sweep = lever.sweep([5.0], sensitivities=True)
    assert np.isnan(sweep.reader_V.item())
    assert np.isnan(sweep.sensitivity.sel(observable="reader")).all()
    assert np.isfinite(sweep.sensitivity.sel(observable="tip")).all()
