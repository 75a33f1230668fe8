"""Fits of many levers: in parallel, each written as it comes, resumed where they were stopped."""

from __future__ import annotations

import json
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dask.system import CPU_COUNT

from hotlever import __version__
from hotlever.cache import CACHE_VARIABLE, cache_folder
from hotlever.cluster import local_client, remote_client, run_all
from hotlever.errors import HotleverError, InputError, unknown_name
from hotlever.files import output_folder, write_text
from hotlever.fitting.fit import fit, with_measured_circuit
from hotlever.fitting.least_squares import Weights
from hotlever.fitting.measurement import OBSERVABLE_SYMBOLS, Measurement, read_measurement
from hotlever.lever.lever import Lever
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.materials import parameter
from hotlever.probe import Probe

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class FitRequest:
    """What is asked of every lever; see `hotlever.fitting.fit` for the meaning.

    Attributes
    ----------
    probe : Probe
    observables : tuple of str or None
    fixed : mapping of str to float or None
    robust, drift : bool
    weights : {"maximum", "errors"}
    medium : {"vacuum", "air"} or None

    Raises
    ------
    InputError
        If a name does not exist or a value is impossible.
    """

    probe: Probe = field(default_factory=Probe.reference)
    observables: tuple[str, ...] | None = None
    fixed: Mapping[str, float | None] = field(default_factory=dict)
    robust: bool = False
    drift: bool = False
    weights: Weights = "maximum"
    medium: str | None = None

    def __post_init__(self) -> None:
        for name in self.fixed:
            parameter(name)
        held = {name: value for name, value in self.fixed.items() if value is not None}
        self.probe.material.with_(**held)
        for name in self.observables or ():
            if name not in OBSERVABLE_SYMBOLS:
                raise unknown_name("observable", name, OBSERVABLE_SYMBOLS)

    def record(self, measurement: Measurement) -> dict[str, Any]:
        """Return all that a fit depends on, for its file: the same again need not be fitted."""
        record = {
            "sha256": measurement.sha256,
            "probe": self.probe.values(),
            "observables": self.observables,
            "fixed": self.fixed,
            "robust": self.robust,
            "drift": self.drift,
            "weights": self.weights,
            "medium": self.medium,
            "version": __version__,
        }
        return dict(json.loads(json.dumps(record)))


@dataclass(frozen=True)
class LeverFit:
    """One lever of many, fitted.

    Attributes
    ----------
    name : str
    path : Path
        The fit file.
    content : dict
        What stands in it.
    """

    name: str
    path: Path
    content: dict[str, Any]


@dataclass
class Batch:
    """What became of many data files.

    Attributes
    ----------
    fits : dict of str to LeverFit
        By the name of the lever, in the order of the data files.
    failures : dict of str to HotleverError
        By data file: why it could not be read or fitted.
    reused : int
        Fits that had been written before from the same data, probe, options and version.
    """

    fits: dict[str, LeverFit] = field(default_factory=dict)
    failures: dict[str, HotleverError] = field(default_factory=dict)
    reused: int = 0

    @property
    def exit_status(self) -> int:
        """0 if all is done, 2 if an input was at fault, else 1 if a computation failed."""
        return max((error.exit_status for error in self.failures.values()), default=0)


def fit_many(
    paths: Sequence[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    request: FitRequest | None = None,
    *,
    processes: int | None = None,
    scheduler: str | None = None,
    reducing: Progress | None = None,
    progress: Progress | None = None,
) -> Batch:
    """Fit many levers and write a fit file for each as soon as it is done.

    A file that cannot be read or fitted is reported in the result; the others go on. A lever
    whose fit file is there already, from the same data, request and version, is not fitted again.

    Parameters
    ----------
    paths : sequence of path
        Measurement files.
    folder : path
        Where the fit files go, named after the data files.
    request : FitRequest, optional
        The reference probe and all observables by default.
    processes : int, optional
        Local worker processes; by default as many as there are processors. They are started by
        spawn: a script needs ``if __name__ == "__main__"``.
    scheduler : str, optional
        Address of a running Dask scheduler to use instead.
    reducing, progress : callable, optional
        Called with the steps done and their number: while a geometry is reduced, and with the
        levers done.

    Raises
    ------
    InputError
        If the folder cannot be made, or no scheduler answers.
    ComputationError
        If the scheduler is lost. What was done by then is written.
    """
    request = request or FitRequest()
    if processes is not None and processes < 1:
        raise InputError(f"found processes = {processes}, expected 1 or more")
    target, data = output_folder(folder), lever_names(paths)
    files = {name: target / f"{name}.json" for name in data}
    batch, waiting = Batch(), {}
    for name, path in data.items():
        try:
            measurement = read_measurement(path)
        except InputError as error:
            batch.failures[str(path)] = error
            continue
        content = _written_before(files[name], request.record(measurement))
        if content is None:
            waiting[name] = measurement
        else:
            batch.fits[name] = LeverFit(name, files[name], content)
            batch.reused += 1

    def tell() -> None:
        if progress is not None:
            progress(len(batch.fits) + len(batch.failures), len(files))

    tell()
    with _shared_cache(), _client(min(processes or CPU_COUNT, len(waiting)), scheduler) as client:
        if client is not None:
            _reduce(request, waiting, reducing)
            names = list(waiting)
            tasks = ((measurement, request) for measurement in waiting.values())
            for number, result in run_all(client, _fitted, tasks):
                name, measurement = names[number], waiting[names[number]]
                if isinstance(result, HotleverError):
                    batch.failures[measurement.path] = _failure(measurement.path, result)
                else:
                    content = {**result, "request": request.record(measurement)}
                    _write(content, files[name])
                    batch.fits[name] = LeverFit(name, files[name], content)
                tell()
    batch.fits = {name: batch.fits[name] for name in files if name in batch.fits}
    return batch


def lever_names(paths: Sequence[str | os.PathLike[str]]) -> dict[str, Path]:
    """Name the different data files: by their own names, with folders where these are the same.

    Examples
    --------
    >>> list(lever_names(["a/lever-1.csv", "a/lever-2.csv", "a/lever-1.csv"]))
    ['lever-1', 'lever-2']
    >>> list(lever_names(["a/lever-1.csv", "b/lever-1.csv"]))
    ['a_lever-1.csv', 'b_lever-1.csv']
    """
    different = list(dict.fromkeys(map(Path, paths)))
    count = Counter(path.stem for path in different)
    return {
        path.stem if count[path.stem] == 1 else "_".join(path.relative_to(path.anchor).parts): path
        for path in different
    }


def _write(content: dict[str, Any], file: Path) -> None:
    write_text(file, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def _written_before(file: Path, record: dict[str, Any]) -> dict[str, Any] | None:
    """Return a fit file that was made from the same; None if there is none."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    same = isinstance(content, dict) and content.get("request") == record
    return content if same else None


@contextmanager
def _client(processes: int, scheduler: str | None) -> Iterator[Any]:
    """Give a Dask client; None where there is nothing to do."""
    if not processes:
        yield None
        return
    with local_client(processes) if scheduler is None else remote_client(scheduler) as client:
        yield client


@contextmanager
def _shared_cache() -> Iterator[None]:
    """Let local workers find reduced levers on disk, even if the user's cache is switched off."""
    if cache_folder() is not None:
        yield
        return
    with tempfile.TemporaryDirectory(prefix="hotlever-") as folder:
        os.environ[CACHE_VARIABLE] = folder
        try:
            yield
        finally:
            os.environ[CACHE_VARIABLE] = ""


def _reduce(
    request: FitRequest, waiting: Mapping[str, Measurement], progress: Progress | None
) -> None:
    """Reduce each geometry once, before the workers need it.

    Base temperature and medium are part of it.
    """
    probes = (
        with_measured_circuit(request.probe, measurement, request.medium)[0]
        for measurement in waiting.values()
    )
    different = {(one.circuit.base_temperature_K, one.surroundings.medium): one for one in probes}
    for one in different.values():
        cached_reduction(Lever(one), progress=progress)


def _fitted(measurement: Measurement, request: FitRequest) -> dict[str, Any]:
    """Fit one lever, in a worker; return the content of its fit file."""
    result = fit(
        measurement,
        request.probe,
        observables=request.observables,
        fixed=request.fixed,
        robust=request.robust,
        drift=request.drift,
        weights=request.weights,
        medium=request.medium,
    )
    return dict(json.loads(result.to_json()))


def _failure(path: str, found: HotleverError) -> HotleverError:
    """Return an error that names the data file."""
    text = str(found)
    return type(found)(text if text.startswith(path) else f"{path}: {text}")
