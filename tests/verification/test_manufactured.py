"""Manufactured solutions with the real laws: the observed order is the element's plus one."""

from __future__ import annotations

import numpy as np
import pytest
from made_up_fields import BASE, BIAS, Exact, nodal_state, silicon_strip, source
from skfem.element import ElementTriP1, ElementTriP2, ElementTriP3

from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.space import LEVER


class Loaded:
    """The equations at a lever voltage with the manufactured sources; see `newton.Equations`."""

    def __init__(self, equations, exact) -> None:
        self.equations, space = equations, equations.space
        self.scale, self.step_limit = equations.scale, equations.step_limit
        heat, charge = (source(space, load) for load in exact.loads(*space.elements.positions))
        self.loads = space.from_nodal(heat, charge, 0.0)[:, None]

    def residual(self, x, which):
        residual = self.equations.balance(x)
        residual[-1] = x[-1] - BIAS
        return residual - self.loads

    def factorised(self, x, which):
        return self.equations.factorised(x, LEVER)


def errors(element, refinements, amplitude):
    """L2 errors of temperature and potential on a mesh of squares cut in two."""
    equations = silicon_strip(element, 2**refinements)
    exact = Exact(amplitude)
    space = equations.space
    start = nodal_state(space, exact)
    solved = find_roots(Loaded(equations, exact), start, NewtonOptions()).x
    points, weights = space.elements.positions, space.elements.weights
    values = space.elements.sampling[: weights.size]
    return [
        np.sqrt(np.sum(weights * (values @ nodal - field(*points)[0]) ** 2))
        for nodal, field in zip(
            space.nodal(solved[:, 0], BASE), (exact.temperature, exact.potential), strict=True
        )
    ]


@pytest.mark.parametrize(
    ("element", "order", "refinements"),
    [
        (ElementTriP1(), 2, (4, 5, 6)),
        (ElementTriP2(), 3, (3, 4, 5)),
        (ElementTriP3(), 4, (3, 4, 5)),
    ],
    ids=["linear", "quadratic", "cubic"],
)
# below the step of κ at 680 K, so that the laws are smooth over the whole domain
def test_observed_order_is_element_order_plus_one(element, order, refinements):
    table = np.array([errors(element, k, amplitude=250.0) for k in refinements])
    observed = np.log2(table[:-1] / table[1:])
    np.testing.assert_allclose(observed[-1], order, atol=0.15)


def test_the_step_of_the_thermal_conductivity_does_not_stop_convergence():
    """Across 680 K the slope of κ steps within 1 K, which no mesh here resolves."""
    table = np.array([errors(ElementTriP2(), k, amplitude=500.0) for k in (3, 4, 5)])
    observed = np.log2(table[0] / table[-1]) / 2
    # it costs about one order of three
    assert observed.min() > 1.7
