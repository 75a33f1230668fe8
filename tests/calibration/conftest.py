"""Characteristics shared by the tests of this folder."""

from __future__ import annotations

import pytest

from hotlever.calibration.characteristic import Characteristic, characteristic
from hotlever.lever import Lever
from hotlever.materials.spieser2017 import published


@pytest.fixture(scope="session")
def reference(lever: Lever) -> Characteristic:
    """Of the reference lever."""
    return characteristic(lever)


@pytest.fixture(scope="session")
def lever_3(lever: Lever) -> Characteristic:
    """Of the reference lever with the paper's material of lever 3."""
    return characteristic(lever.with_material(published("lever 3").material))
