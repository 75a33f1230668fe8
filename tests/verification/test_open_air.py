"""Bodies at one temperature in free space: heat to infinity, exact for sphere and spheroid."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

pytest.importorskip("ngsolve")

from netgen.occ import Axes, Ellipsoid, OCCGeometry, Pnt, Sphere, X, Z

from hotlever.lever3d import OpenAir
from hotlever.probe.mesh import in_a_sphere

CENTRE, RADIUS = (0.0, 0.0, 0.0), 4.0


@cache
def heat(body, order):
    """Total heat for θ = 1 on the body: on its surface, and at infinity."""
    mesh = OCCGeometry(body(0.7)).GenerateMesh(maxh=1.6, grading=0.6)
    air = OpenAir(mesh, CENTRE, RADIUS, order=order)
    coefficients, nodal = air.solve(np.ones(air.vertices.size + len(air.edges)))
    return nodal.sum(), air.at_infinity(coefficients)


def sphere(size):
    body = Sphere(Pnt(*CENTRE), 1.0)
    body.maxh = size
    return in_a_sphere(body, CENTRE, RADIUS)


def spheroid(size):
    body = Ellipsoid(Axes(CENTRE, Z, X), 1.0, 1.0, 0.5)
    body.maxh = size
    return in_a_sphere(body, CENTRE, RADIUS)


EXACT = {
    sphere: 4 * np.pi,
    spheroid: 4 * np.pi * np.sqrt(1 - 0.5**2) / np.arccos(0.5),
}


@pytest.mark.parametrize("body", EXACT)
def test_smooth_bodies_lose_the_exact_heat_and_converge(body):
    errors = [heat(body, order)[0] / EXACT[body] - 1 for order in (2, 3)]
    assert abs(errors[1]) < 1e-3
    assert abs(errors[1]) < 0.4 * abs(errors[0])


def test_the_heat_arrives_at_infinity():
    total, far = heat(sphere, 3)
    assert far == pytest.approx(total, rel=5e-4)
