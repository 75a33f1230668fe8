"""Levers whose laws depart from their formulas: exact derivatives by state and coefficients."""

from __future__ import annotations

import numpy as np
import pytest
from taylor import remainder_orders

from hotlever.lever import Lever
from hotlever.lever.equations import LeverEquations
from hotlever.materials.departures import DEPARTURES, departure_of
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import parameters_of
from of_materials import p_type_probe

STEPS = (0.4, 0.2, 0.1)


def coefficients_of(probe):
    return [name for name in parameters_of(probe) if departure_of(name.rpartition(".")[2])]


def departing(probe):
    rng = np.random.default_rng(0)
    return probe.with_(**{name: rng.normal() for name in coefficients_of(probe)})


PROBES = {
    "paper's": lambda: departing(Probe.reference()),
    "thermoelectric": lambda: departing(Probe.reference()).with_physics(["thermoelectric"]),
    "boron": lambda: departing(p_type_probe()),
}


@pytest.fixture(scope="module", params=PROBES)
def lever(request, coarse_meshes):
    return Lever(PROBES[request.param](), coarse_meshes)


def state_of(lever):
    branch = lever.branch()
    return branch.x[:, [len(branch.u) // 2]]


def test_jacobian_has_taylor_order_two(lever):
    orders = remainder_orders(lever.equations, state_of(lever), 0, (1.0, 0.5, 0.25))
    assert orders[-1] > 1.9


def test_derivatives_by_coefficients_have_taylor_order_two(lever):
    x, names = state_of(lever), coefficients_of(lever.probe)
    assert {departure_of(name.rpartition(".")[2])[0].law for name in names} == set(DEPARTURES)
    start, slopes = lever.equations.balance(x), lever.equations.by_parameter(x, names)
    for number, name in enumerate(names):
        (value,) = lever.probe.values([name])
        rest = []
        for step in STEPS:
            other = lever.probe.replace({name: value + step})
            balance = LeverEquations.of_probe(lever.space, other).balance(x)
            rest.append(np.abs(balance - start - step * slopes[..., number]).max())
        orders = np.log2(np.array(rest[:-1]) / rest[1:])
        assert orders[-1] > 1.9, (name, orders)


def test_without_coefficients_a_lever_is_the_papers():
    material = Probe.reference().material
    assert all(getattr(material, name) == 0.0 for d in DEPARTURES.values() for name in d.names)
