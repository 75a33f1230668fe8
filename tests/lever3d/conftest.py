"""A coarse lever in air, shared by the tests."""

from __future__ import annotations

import pytest
import xarray as xr

from hotlever.lever import State
from hotlever.lever3d import SolidLever
from hotlever.probe import Probe
from hotlever.probe.mesh import SolidMeshOptions

COARSE = SolidMeshOptions(refinement=0.4, grading=0.7)


@pytest.fixture(scope="session", params=[pytest.param("air", marks=pytest.mark.slow)])
def in_air() -> SolidLever:
    """The reference lever in air on a coarse mesh, which takes ten seconds: all that ask are slow.

    `tests/verification/test_open_air.py` compares the air of solids with exact solutions.
    """
    pytest.importorskip("ngsolve")
    return SolidLever(Probe.reference().in_medium("air"), COARSE, air_order=2)


@pytest.fixture(scope="session")
def state(in_air: SolidLever) -> State:
    """Its state at 5 V."""
    (state,) = in_air.solve([5.0])
    return state


@pytest.fixture(scope="session")
def sweep(in_air: SolidLever, state: State) -> xr.Dataset:
    """What is measured in that state."""
    return in_air.dataset([state])
