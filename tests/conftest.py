"""Fixtures shared by the tests."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from hypothesis import settings

from experiments import on_coarse_meshes
from hotlever.cache import CACHE_VARIABLE
from hotlever.cli import main, output
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import ReducedLever, cached_reduction
from hotlever.materials import published
from hotlever.probe import Probe

ROOT = Path(__file__).parents[1]

# how long an example takes says how busy the machine is
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

# What is loaded to collect the tests stays until the end: looking for garbage in it, again and
# again, takes a twentieth of the processor time.
gc.disable()


def pytest_collection_finish() -> None:
    gc.enable()
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache of reduced levers for the whole run, empty before; the user's own is not touched."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:  # all processes of a run share one
        folder = folder.parent
    folder /= "cache"
    folder.mkdir(exist_ok=True)
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
    return Lever(Probe.reference(), COARSE)


@pytest.fixture(scope="module")
def coarse_meshes(lever: Lever) -> Iterator[None]:
    """For a whole module, see `on_coarse_meshes`; the lever that all share is made before."""
    with on_coarse_meshes():
        yield


@pytest.fixture(scope="session")
def in_air(coarse: Lever) -> Lever:
    """The coarse lever in still air."""
    return coarse.in_medium("air")


@pytest.fixture(scope="session")
def reduced(coarse: Lever) -> ReducedLever:
    """The coarse lever, reduced."""
    return cached_reduction(coarse)


@pytest.fixture(scope="session")
def reduced_in_air(in_air: Lever) -> ReducedLever:
    """The coarse lever in air, reduced."""
    return cached_reduction(in_air)


@pytest.fixture(scope="session")
def reference(lever: Lever) -> Branch:
    """The reference lever as one curve."""
    return lever.branch()


@pytest.fixture(scope="session")
def lever_3(lever: Lever) -> Branch:
    """The same with the paper's material of lever 3."""
    return lever.with_material(published("lever 3").material).branch()


@pytest.fixture(scope="session")
def shared() -> Callable[..., list[Path]]:
    """Give files of the shared data; a test is skipped where one of these very files is missing."""
    top = Path(os.environ.get("HOTLEVER_SHARED", ROOT.parent / "shared"))

    def find(folder: str, *names: str) -> list[Path]:
        paths = [top / folder / name for name in names]
        missing = [path for path in paths if not path.is_file()]
        if missing:
            pytest.skip(f"the shared data are not there ({missing[0]})")
        return paths

    return find


@pytest.fixture
def run(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., tuple[int, str, str]]]:
    """Run the command line in an empty folder; returns exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    # how long something takes depends on the machine
    monkeypatch.setattr(output, "_lines", partial(output._lines, first_s=float("inf")))
    ended_badly = ""

    def call(*arguments: str) -> tuple[int, str, str]:
        nonlocal ended_badly
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        status = int(ended.value.code or 0)
        if status == 1:
            ended_badly = captured.err
        return status, captured.out, captured.err

    yield call
    # a test that did not expect it shows what went wrong
    sys.stderr.write(ended_badly)


@pytest.fixture
def refused(run: Callable[..., tuple[int, str, str]]) -> Callable[..., str]:
    """Run a command line that is at fault: status 2, nothing printed; returns the one line.

    Where it is asked for, what was understood of a file, and notes, may stand above it.
    """

    def call(*arguments: str, below_notes: bool = False) -> str:
        status, out, err = run(*arguments)
        assert (status, out) == (2, ""), err
        *above, line = err.splitlines()
        assert line.startswith("hotlever: ")
        assert below_notes or not above
        assert not any(one.startswith(("hotlever: ", "Traceback")) for one in above)
        return line

    return call
