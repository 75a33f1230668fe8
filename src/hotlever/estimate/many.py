"""Estimates of many levers: in parallel, each written as it comes, resumed where they stopped."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from hotlever import __version__
from hotlever.errors import HotleverError, InputError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.estimator import calibrate, fit
from hotlever.estimate.file import EstimateFile
from hotlever.estimate.options import CalibrationOptions, FitOptions
from hotlever.files import (
    CALIBRATION,
    FOLDER,
    check_outputs,
    output_file,
    output_folder,
    without_nan,
)
from hotlever.lever.lever import Lever
from hotlever.lever.reduced_lever import cached_reduction, can_be_reduced
from hotlever.measurement import Measurement, read_measurement_of, with_measured_circuit
from hotlever.probe import Probe
from hotlever.processes import PROCESSORS, Executor, guarded, local_executor, run_all
from hotlever.types import Progress


@dataclass
class Batch:
    """What became of many data files.

    Attributes
    ----------
    results : dict of str to Estimate
        By the name of the lever, in the order of the data files.
    failures : dict of str to HotleverError
        By data file: why it could not be read, or nothing could be made of it.
    reused : int
        Estimates that had been written before from the same data, probe, options and version.
    """

    results: dict[str, Estimate] = field(default_factory=dict)
    failures: dict[str, HotleverError] = field(default_factory=dict)
    reused: int = 0

    @property
    def exit_status(self) -> int:
        """0 if all is done, 2 if an input was at fault, else 1 if a computation failed.

        Data that no such lever shows are none of which the computation could be finished.
        """
        statuses = [error.exit_status for error in self.failures.values()]
        return max(statuses, default=min(len(self.undescribed), 1))

    @property
    def undescribed(self) -> dict[str, str]:
        """By lever: that its data are not described, and why."""
        results = self.results.items()
        return {name: f"{name}: {result.doubt}" for name, result in results if result.doubt}

    def fail(self, path: str | os.PathLike[str], error: HotleverError) -> None:
        """Note why nothing could be made of a data file."""
        path, text = str(path), str(error)
        self.failures[path] = error if text.startswith(path) else type(error)(f"{path}: {text}")


def fit_many(
    paths: Sequence[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    probe: Probe | None = None,
    options: FitOptions | None = None,
    **how: Any,
) -> Batch:
    """Fit many levers and write a file of each as soon as it is done; see `estimate_many`.

    Parameters
    ----------
    paths : sequence of path
        Measurement files.
    folder : path
        Where the files go, named after the data files.
    probe : Probe, optional
        The reference probe by default.
    options : FitOptions, optional
    **how
        As `estimate_many` has them.
    """
    probe, options = probe or Probe.reference(), options or FitOptions()
    options.of(probe)  # raises for all levers at once
    make = partial(fit, probe=probe, options=options)
    return estimate_many(paths, folder, "fit", make, probe, options, {}, **how)


def calibrate_many(
    paths: Sequence[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    probe: Probe | None = None,
    options: CalibrationOptions | None = None,
    **how: Any,
) -> Batch:
    """Calibrate many levers and write a file of each as soon as it is done; see `estimate_many`.

    Parameters
    ----------
    paths : sequence of path
        Measurement files.
    folder : path
        Where the files go, named after the data files.
    probe : Probe, optional
        What the levers are like; the reference probe by default.
    options : CalibrationOptions, optional
    **how
        As `estimate_many` has them.
    """
    options, like = options or CalibrationOptions(), probe or Probe.reference()
    # what it is for each lever, whatever its file says of circuit and medium
    of_lever = options.of_lever.of(like)
    make = partial(calibrate, probe=None if options.law is not None else like, options=options)
    of_tip = options.values()
    return estimate_many(paths, folder, "calibration", make, like, of_lever, of_tip, **how)


def estimate_many(
    paths: Sequence[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    kind: str,
    make: Callable[[Measurement], Estimate],
    probe: Probe,
    options: FitOptions,
    settings: Mapping[str, Any],
    *,
    processes: int | None = None,
    scheduler: str | None = None,
    columns: Mapping[str, str] | None = None,
    reading: Callable[[Measurement], None] | None = None,
    reducing: Progress | None = None,
    progress: Progress | None = None,
) -> Batch:
    """Estimate many levers and write a file of each as soon as it is done.

    A file that cannot be read, or of which nothing can be made, is reported in the batch; the
    others go on. What is there already, from the same data, probe, options and version, is not
    made again.

    Parameters
    ----------
    paths : sequence of path
        Measurement files.
    folder : path
        Where the files go, named after the data files.
    kind : {"fit", "calibration"}
        What is made of each measurement.
    make : callable
        Makes it, in another process.
    probe : Probe
        What the levers are like.
    options : FitOptions
        What of a lever is varied.
    settings : mapping of str to JSON values
        What else an estimate depends on.
    processes : int, optional
        Local worker processes; by default as many as there are processors. They are started by
        spawn: a script needs ``if __name__ == "__main__"``.
    scheduler : str, optional
        Address of a running Dask scheduler to use instead.
    columns : mapping of str to str, optional
        Names of the columns in all files, see `read_measurement`.
    reading : callable, optional
        Called with each measurement that was read.
    reducing, progress : callable, optional
        Called with the steps done and their number: while a geometry is reduced, and with the
        levers done.

    Raises
    ------
    InputError
        If the folder cannot be made, a name is no parameter's, or no scheduler answers.
    ComputationError
        If the scheduler is lost. What was done by then is written.
    """
    if processes is not None and processes < 1:
        raise InputError(f"found processes = {processes}, expected 1 or more")
    target, data = Path(folder), lever_names(paths)
    check_outputs([(target, FOLDER)])
    ending = CALIBRATION if kind == "calibration" else ".json"
    files = {name: target / f"{name}{ending}" for name in data}
    request = {"probe": probe.sections(), "options": options.values(), **settings}
    request["version"] = __version__
    if columns:
        request["columns"] = dict(columns)
    batch, waiting, requests = Batch(), dict[str, Measurement](), dict[str, Any]()

    def tell() -> None:
        if progress is not None:
            progress(len(batch.results) + len(batch.failures), len(files))

    for name, path in data.items():
        try:
            measurement = read_measurement_of(probe, path, columns)
            measurement.need_rest(f"a {kind} of several levers")
            if reading is not None:
                reading(measurement)
            if target.is_dir():
                output_file(files[name], paths)
        except InputError as error:
            batch.fail(path, error)
            continue
        # all that a result depends on, for its file: the same again need not be made
        requests[name] = dict(without_nan({"sha256": measurement.sha256, **request}))
        # whoever changes the code of a class of materials keeps its name
        again = not probe.classes
        earlier = _written_before(files[name], kind, requests[name]) if again else None
        if earlier is None:
            waiting[name] = measurement
        else:
            batch.results[name] = earlier
            batch.reused += 1
    tell()
    if waiting:
        with _executor(scheduler, min(processes or PROCESSORS, len(waiting))) as executor:
            for name, reason in _not_reduced(probe, options, waiting, reducing).items():
                batch.fail(waiting.pop(name).path, reason)
            names = list(waiting)
            tasks = ((measurement,) for measurement in waiting.values())
            for number, result in run_all(executor, make, tasks):
                name, measurement = names[number], waiting[names[number]]
                try:
                    if isinstance(result, HotleverError):
                        raise result
                    output_folder(target)
                    result.write(files[name], requests[name])
                    batch.results[name] = result
                except HotleverError as error:
                    batch.fail(measurement.path, error)
                tell()
    batch.results = {name: batch.results[name] for name in files if name in batch.results}
    return batch


def _executor(scheduler: str | None, processes: int) -> AbstractContextManager[Executor]:
    if scheduler is None:
        return local_executor(processes)
    try:
        from hotlever.cluster import cluster_executor
    except ImportError:
        raise InputError(
            f"--scheduler {scheduler}: Dask is not installed, expected pip install "
            "'hotlever[cluster]'"
        ) from None
    return cluster_executor(scheduler)


def lever_names(paths: Sequence[str | os.PathLike[str]]) -> dict[str, Path]:
    """Name the different data files: by their own names, with folders where these are the same.

    Examples
    --------
    >>> list(lever_names(["a/lever-1.csv", "a/lever-2.csv", "a/../a/lever-1.csv"]))
    ['lever-1', 'lever-2']
    >>> list(lever_names(["a/lever-1.csv", "b/lever-1.csv"]))
    ['a_lever-1.csv', 'b_lever-1.csv']
    """
    different: dict[object, Path] = {}
    for path in map(Path, paths):
        different.setdefault(_identity(path), path)
    count = Counter(path.stem.casefold() for path in different.values())
    names: dict[str, Path] = {}
    for path in different.values():
        alone = count[path.stem.casefold()] == 1
        name = path.stem if alone else "_".join(path.relative_to(path.anchor).parts)
        # a file name need not be text; and not all disks tell a from A
        name = name.encode(errors="backslashreplace").decode()
        existing, number, plain = {other.casefold() for other in names}, 2, name
        while name.casefold() in existing:
            name, number = f"{plain}-{number}", number + 1
        names[name] = path
    return names


def _identity(path: Path) -> object:
    """Return what two names of one file have in common."""
    try:
        status = path.stat()
    except OSError:
        return os.path.realpath(path)
    return status.st_dev, status.st_ino


def _written_before(file: Path, kind: str, request: dict[str, Any]) -> Estimate | None:
    """Return the estimate of a file that was made from the same; None if there is none."""
    try:
        content = EstimateFile.read(file, kind)
    except InputError:
        return None
    return Estimate.of_file(content) if content.request == request else None


def _not_reduced(
    probe: Probe,
    options: FitOptions,
    waiting: Mapping[str, Measurement],
    progress: Progress | None,
) -> dict[str, HotleverError]:
    """Reduce each geometry once, before the workers need it; return why some levers have none.

    Base temperature and medium are part of a geometry.
    """
    results: dict[object, Any] = {}
    failures: dict[str, HotleverError] = {}
    for name, measurement in waiting.items():
        try:
            probes = [
                with_measured_circuit(probe, measurement, medium)[0] for medium in options.media
            ]
        except InputError as error:
            failures[name] = error
            continue
        errors = []
        for measured in probes:
            geometry = measured.circuit.base_temperature_K, measured.surroundings.medium
            if geometry not in results:
                results[geometry] = guarded(_reduce, measured, options, progress)
            errors.append(results[geometry])
        # of two media one will do
        if None not in errors:
            failures[name] = errors[0]
    return failures


def _reduce(probe: Probe, options: FitOptions, progress: Progress | None) -> None:
    own = options.of(probe)
    names = {*own.usual, *own.varied}
    # with the usual priors more is varied than a reduced lever has
    if not options.usual_priors and can_be_reduced(probe, names):
        cached_reduction(Lever(probe), progress, names)
