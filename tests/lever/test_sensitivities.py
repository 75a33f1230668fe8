"""Forward sensitivities: Taylor order 2 for every parameter and observable."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.lever import Lever
from hotlever.materials import PARAMETERS
from hotlever.probe import MeshOptions, Probe
from hotlever.quantities import OBSERVABLES

#: States of the branch (360, 600 and 1170 K): between them sensitivities are those of nearby ones.
#: None is where many quadrature points pass the step of the thermal conductivity.
NODES = [3, 7, 19]
#: Relative steps: the remainder must be well above rounding errors and quadratic.
STEPS = (0.004, 0.002, 0.001)


@pytest.fixture(scope="module")
def bridged(coarse):
    """The coarse lever in a Wheatstone bridge, so that it shows every observable."""
    bridge = {"bridge_upper_ohm": 5600.0, "bridge_lower_ohm": 2000.0, "bridge_gain": 10.0}
    return coarse.with_probe(coarse.probe.with_(**bridge))


def solved(lever, bias):
    return lever.dataset(lever.solve(bias))


@pytest.mark.parametrize("name", PARAMETERS)
def test_sensitivities_have_taylor_order_two(bridged, name):
    lever_V, current_mA, *_ = bridged.branch().values[NODES].T
    bias = bridged.circuit.bias(lever_V, current_mA)
    start, slopes = solved(bridged, bias), bridged.sweep(bias, sensitivities=True).sensitivity
    value = getattr(bridged.probe.material, name)
    material = bridged.probe.material
    perturbed_datasets = [
        solved(bridged.with_material(material.with_(**{name: value * (1 + step)})), bias)
        for step in STEPS
    ]
    for observable, column in OBSERVABLES.items():
        slope = slopes.sel(observable=observable, parameter=name).values
        rest = np.array(
            [
                np.abs(one[column.name].values - start[column.name].values - step * value * slope)
                for step, one in zip(STEPS, perturbed_datasets, strict=True)
            ]
        )
        orders = np.log2(rest[:-1] / rest[1:])
        # a straight line leaves no remainder to measure an order of; where the curvature happens
        # to vanish the order is higher, and a wrong slope would make it one
        linear = rest[0] < 1e-7 * np.abs(start[column.name].values)
        assert orders[-1][~linear].min(initial=2.0) > 1.75, (observable, orders)


def test_a_lever_without_reader_has_no_reader_sensitivity():
    lever = Lever(Probe.u_shape(), MeshOptions(refinement=0.4))
    sweep = lever.sweep([5.0], sensitivities=True)
    assert np.isnan(sweep.reader_V.item())
    assert np.isnan(sweep.sensitivity.sel(observable="reader")).all()
    assert np.isfinite(sweep.sensitivity.sel(observable="tip")).all()
