"""Fixtures shared by the tests."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hotlever.cache import CACHE_VARIABLE
from hotlever.calibration.characteristic import Characteristic, characteristic
from hotlever.cli import main
from hotlever.lever import Lever
from hotlever.materials.spieser2017 import published
from hotlever.probe import MeshOptions, Probe

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """An empty cache of reduced levers for the whole run; the user's own is not touched."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CACHE_VARIABLE, str(folder))
        yield folder


@pytest.fixture(scope="session")
def lever() -> Lever:
    """The reference lever on the default mesh."""
    return Lever(Probe.reference())


@pytest.fixture(scope="session")
def coarse() -> Lever:
    """The reference lever on a coarse mesh: for what does not depend on accuracy."""
    return Lever(Probe.reference(), MeshOptions(refinement=0.4))


@pytest.fixture(scope="session")
def reference(lever: Lever) -> Characteristic:
    """The characteristic of the reference lever."""
    return characteristic(lever)


@pytest.fixture(scope="session")
def lever_3(lever: Lever) -> Characteristic:
    """That of the reference lever with the paper's material of lever 3."""
    return characteristic(lever.with_material(published("lever 3").material))


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of shared data; tests that need it are skipped where it is not there."""
    folder = Path(os.environ.get("HOTLEVER_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"the shared data are not there ({folder})")
    return folder


@pytest.fixture
def run(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[int, str, str]]:
    """Run the command line in an empty folder; returns exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return call
