"""The Kohlrausch relation in three dimensions: the L-shape of `test_kohlrausch`, as a solid."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from bare import state_at
from skfem.element import ElementTetP2
from test_kohlrausch import GROUND, HIGH_DOPED, SUPPLY

from hotlever.lever.elements import FiniteElements
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.materials import published
from hotlever.probe import Circuit, Layout, Region
from hotlever.probe.mesh import SolidMeshOptions, mesh_solid

OUTLINE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))


@cache
def space(refinement):
    """Elements whose sizes are divided by `refinement`."""
    layout = Layout((Region("all", "heater", OUTLINE),), (SUPPLY, GROUND), (0.5, 0.5), 0.3)
    # there is no air, so nothing asks for small edges along the rim
    sizes = SolidMeshOptions(
        heater=0.4, lever=0.2, corner=0.1, rim=100.0, grading=0.4, refinement=refinement
    )
    mesh = mesh_solid(layout, sizes)
    return FullSpace(mesh, FiniteElements(mesh.elements, ElementTetP2(), 4))


def highest(voltage, refinement):
    """Highest temperature at the nodes of a mesh."""
    solid = space(refinement)
    equations = LeverEquations(solid, published("option III").material.kinds, Circuit())
    return 293.0 + solid.rises(state_at(equations, voltage)).max()


@pytest.mark.parametrize("voltage", [0.5, 1.0])
def test_highest_temperature_of_a_solid_l_shape(voltage):
    exact = HIGH_DOPED[voltage]
    errors = np.abs([highest(voltage, refinement) - exact for refinement in (0.6, 2.0)])
    # the exact value is given to 0.005 K
    assert errors[1] < 2e-4 * (exact - 293) + 0.005
    assert errors[1] < errors[0] / 4
