"""Forward sensitivities: Taylor order 2 for every parameter and observable."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.lever.branch import Branch
from hotlever.lever.equations import steps_of
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.observables import Linearised
from hotlever.lever.solved_states import solve_at
from hotlever.materials import PARAMETERS
from hotlever.quantities import OBSERVABLES

#: States of the branch (360, 600 and 1170 K): between them sensitivities are those of nearby ones.
#: None is where many quadrature points pass the step of the thermal conductivity.
NODES = [3, 7, 19]
#: Relative steps: the remainder must be well above rounding errors and quadratic.
STEPS = (0.002, 0.001)


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


def test_a_state_that_gives_way_to_one_at_a_step_of_a_law_leaves_no_factors(coarse):
    equations, whole = coarse.equations, coarse.branch()
    (at_step,) = (u for u in steps_of(equations) if u > 0)
    u = np.append(whole.u[(whole.u > 0) & (whole.u < at_step)], np.sqrt(at_step**2 - 0.2))
    roots = solve_at(equations, u, whole.states(u), NewtonOptions())
    branch = Branch.whole(equations, u, roots)
    linearised = [
        Linearised.of(
            coarse.probe, ("a0", "n_d"), branch, lambda to: to.u[-1] > at_step + 1, None, factors
        )
        for factors in (None, equations.factorised(roots.x))
    ]
    slopes, again = (each.output_slopes for each in linearised)
    assert again == pytest.approx(slopes, rel=1e-9, nan_ok=True)
