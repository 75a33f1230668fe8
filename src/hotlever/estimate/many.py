"""Estimates of many levers: made in parallel, each written as it comes, resumed where they stopped.

And what they say together: means, and the scatter between levers.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.special import chdtri

from hotlever import __version__
from hotlever.datasets import frame_text, labelled
from hotlever.errors import HotleverError, InputError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.estimator import calibrate, fit
from hotlever.estimate.file import EstimateFile
from hotlever.estimate.options import CalibrationOptions, FitOptions
from hotlever.estimate.power_law import PowerLaw
from hotlever.estimate.tip_table import STATED, TipTable, interpolated
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
from hotlever.materials.parameters import heading, is_of_material, parameter_named
from hotlever.measurement import Measurement, read_measurement_of, with_measured_circuit
from hotlever.probe import Probe
from hotlever.processes import (
    PROCESSORS,
    Executor,
    cluster_executor,
    guarded,
    local_executor,
    run_all,
)
from hotlever.quantities import QUANTITIES
from hotlever.text import aligned, listed, value_with_error
from hotlever.types import Progress

if TYPE_CHECKING:
    import xarray as xr


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
        here = min(processes or PROCESSORS, len(waiting))
        workers: AbstractContextManager[Executor] = (
            local_executor(here) if scheduler is None else cluster_executor(scheduler)
        )
        with workers as executor:
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


# --- what they say together -----------------------------------------------------------------------


class Compared(NamedTuple):
    """How a quantity is called and written by which levers are compared."""

    heading: str  #: of its column in a table for people
    unit: str
    column: str  #: in a file; ``{}``, if there is a standard error, where its column says so
    words: str
    scale: float = 1.0  #: unit, of its own, that it is printed in
    lower: float = 0.0
    upper: float = np.inf


class Setting(NamedTuple):
    """What levers are compared at: a column of their tables, and its value there."""

    along: str
    value: float

    @property
    def text(self) -> str:
        """The value with its unit."""
        return f"{self.value:.4g} {QUANTITIES[self.along].unit}"


def highest_common_bias(calibrations: Mapping[str, Estimate]) -> Setting:
    """Return the highest bias at which all levers were measured whose data are described."""
    described = [each for each in calibrations.values() if each.describes_data]
    highest = [each.tip_table["bias_V"][-1] for each in described or calibrations.values()]
    return Setting("bias_V", float(min(highest, default=np.nan)))


def compare_levers(estimates: Mapping[str, Estimate], at: Setting | None = None) -> xr.Dataset:
    """Put the estimates of several levers side by side.

    Parameters
    ----------
    estimates : mapping of str to Estimate
        By lever.
    at : Setting, optional
        Where the tip temperatures of calibrations are compared; by default at
        `highest_common_bias`.

    Returns
    -------
    xarray.Dataset
        See `compared`. Fits are compared by the parameters of the materials, and
        ``inversion_temperature`` if there is one; calibrations by ``tip_K``; ``knee_lever_V``,
        ``knee_current_mA``, ``knee_power_mW``, ``knee_tip_K``; ``k``; and those of `PowerLaw`. On
        ``lever`` too: ``file``, ``describes_data``, and ``reason``: why there are no numbers; of
        calibrations ``tip_low_K`` and ``tip_high_K``, between which 95 % lie.

    Raises
    ------
    InputError
        If there is none, or fits are of levers of different materials.
    """
    answers = {True: "true", False: "false", None: "unknown"}
    more = {
        "describes_data": [answers[each.describes_data] for each in estimates.values()],
        "reason": [each.doubt for each in estimates.values()],
        "file": [each.measurement.path for each in estimates.values()],
    }
    if any(each.route for each in estimates.values()):
        return _by_the_tip(estimates, at or highest_common_bias(estimates), more)
    quantities = {lever: _parameters(fit) for lever, fit in estimates.items()}
    names = list(next(iter(quantities.values()), ()))
    for lever, own in quantities.items():
        if missing := [name for name in names if name not in own]:
            words = listed([_compared(name).words for name in missing])
            raise InputError(
                f"{lever}: {words} is missing, expected a lever of the same materials as "
                f"{next(iter(estimates))}"
            )
    return compared(estimates, quantities, {name: _compared(name) for name in names}, more)


def _by_the_tip(
    calibrations: Mapping[str, Estimate], at: Setting, more: dict[str, list[Any]]
) -> xr.Dataset:
    """Compare calibrations at a setting; see `compare_levers`."""
    tip = Compared(f"T_tip at {at.text} (K)", "K", "tip{}_K", f"tip temperature at {at.text}")
    named = {
        "tip_K": tip,
        "knee_lever_V": Compared(
            "knee V_l (V)", "V", "knee_lever_V{}", "lever voltage of the knee"
        ),
        "knee_current_mA": Compared(
            "knee I_h (mA)", "mA", "knee_current_mA{}", "current of the knee"
        ),
        "knee_power_mW": Compared("knee P_l (mW)", "mW", "knee_power_mW{}", "power of the knee"),
        "knee_tip_K": Compared(
            "knee T_tip (K)", "K", "knee_tip_K{}", "tip temperature of the knee"
        ),
        "k": Compared("k", "1", "k{}", "k"),
        "linear_K_per_mW": Compared("a (K/mW)", "K/mW", "linear_K_per_mW", "a"),
        "nonlinear_K": Compared("b (K)", "K", "nonlinear_K", "b"),
        "exponent": Compared("m", "1", "exponent", "m"),
        "hot_K_per_mW": Compared("c (K/mW)", "K/mW", "hot_K_per_mW", "c"),
        "threshold_mW": Compared("threshold (mW)", "mW", "threshold_mW", "threshold"),
    }
    tips = {lever: _tip_at(each, at) for lever, each in calibrations.items()}
    quantities, coefficients = {}, list(PowerLaw.model_fields)
    for lever, each in calibrations.items():
        knee = each.knee
        quantities[lever] = {
            "tip_K": (tips[lever]["tip_K"], tips[lever]["tip_stderr_K"]),
            "knee_lever_V": (knee.lever_V, knee.lever_V_stderr),
            "knee_current_mA": (knee.current_mA, knee.current_mA_stderr),
            "knee_power_mW": (knee.power_mW, knee.power_mW_stderr),
            "knee_tip_K": (knee.tip_K, knee.tip_K_stderr),
            "k": (each.k, each.k_stderr),
            **{name: (getattr(each.power_law, name, np.nan), None) for name in coefficients},
        }
    reasons = [
        each.doubt or _why_none(each, at, tips[lever]) for lever, each in calibrations.items()
    ]
    limits = {
        name: [values[name] for values in tips.values()] for name in ("tip_low_K", "tip_high_K")
    }
    more = {at.along: [at.value] * len(tips), **limits, **more, "reason": reasons}
    # laws, drawing and thermometer are those of all, and known no better by the number of levers
    in_common = ["tip_K", "knee_tip_K", "k"]
    table = compared(calibrations, quantities, named, more, in_common)
    return table.assign_attrs(along=at.along)


def compared(
    results: Mapping[str, Estimate],
    quantities: Mapping[str, Mapping[str, tuple[float, float | None]]],
    written: Mapping[str, Compared],
    more: Mapping[str, Any] | None = None,
    in_common: Sequence[str] = (),
) -> xr.Dataset:
    """Put quantities of several levers side by side.

    Levers whose data are not described have no values. Means are weighted by the inverse variance;
    a lever that does not determine a quantity, or has no error of it beside others that have one,
    is left out of its mean. Where no lever has an error of a quantity, all count the same.

    Parameters
    ----------
    results : mapping of str to Estimate
        By lever.
    quantities : mapping of str to mapping
        By lever, of each quantity its value and standard error.
    written : mapping of str to Compared
        By quantity.
    more : mapping, optional
        Further columns on ``lever``.
    in_common : sequence of str, optional
        Quantities of which the levers may have what is wrong in common.

    Returns
    -------
    xarray.Dataset
        On (``lever``, ``quantity``): ``value`` and ``stderr`` (NaN where there is none), and
        ``counts``, whether the value counts in the mean. On ``lever``: ``described``. On
        ``quantity``: what `Compared` has; ``mean`` (NaN where no value counts); ``scatter``, the
        standard deviation between levers (NaN for one lever); ``chi_square`` of the values about
        their mean, NaN without standard errors; ``birge_ratio``, the root of it over the degrees
        of freedom; and ``mean_stderr``, the standard error of the mean, larger by the Birge ratio
        where that is above 1, and no smaller than the mean of the errors that are in common.

    Raises
    ------
    InputError
        If there is no lever.
    """
    import xarray as xr  # see `hotlever.datasets.labelled`

    if not results:
        raise InputError("no levers to compare, expected one or more")
    names = list(written)
    numbers = [[own[name] for name in names] for own in quantities.values()]
    answers = [result.describes_data is True for result in results.values()]
    described = xr.DataArray(answers, dims="lever")
    value, stderr = (
        xr.DataArray(column, dims=("lever", "quantity")).where(described)
        for column in np.moveaxis(np.array(numbers, dtype=float), -1, 0)
    )
    stated = stderr > 0
    positive = xr.DataArray([each.lower >= 0 for each in written.values()], dims="quantity")
    undetermined = stated & positive & (stderr >= np.abs(value))
    counts = value.notnull() & ~undetermined & (stated | ~stated.any("lever"))
    counting, count = value.where(counts), counts.sum("lever")
    freedom = (count - 1).where(count > 1)
    weight = (1.0 / stderr.where(stated, 1.0) ** 2).where(counts)
    total = weight.sum("lever", min_count=1)
    mean = (weight * counting).sum("lever") / total
    squares = (weight * (counting - mean) ** 2).sum("lever", min_count=1)
    chi_square = squares.where(stated.any("lever"))
    birge_ratio = (chi_square / freedom) ** 0.5
    mean_stderr = (total**-0.5).where(stated.any("lever")) * np.fmax(birge_ratio, 1.0)
    of_all = ((weight * stderr).sum("lever") / total).where(np.isin(names, in_common), 0.0)
    away = counting - counting.mean("lever")
    columns: dict[str, xr.DataArray] = {
        "value": value,
        "stderr": stderr,
        "counts": counts,
        "described": described,
        "mean": mean,
        "mean_stderr": mean_stderr.where(~(mean_stderr < of_all), of_all),
        "scatter": ((away**2).sum("lever") / freedom) ** 0.5,
        "chi_square": chi_square,
        "birge_ratio": birge_ratio,
    }
    how = {
        field: ("quantity", [getattr(each, field) for each in written.values()])
        for field in Compared._fields
    }
    return labelled(
        {name: (column.dims, column.values) for name, column in columns.items()}
        | {name: ("lever", values) for name, values in (more or {}).items()},
        coordinates={"lever": list(results), "quantity": names, **how},
    )


def _compared(name: str) -> Compared:
    """Return how a parameter, or the inversion temperature, is called and written."""
    if name == "inversion_temperature":
        return Compared(heading(name), "K", f"{name}{{}}_K", "inversion temperature")
    parameter = parameter_named(name)
    how = parameter.scale, *parameter.bounds
    return Compared(heading(name), parameter.unit, f"{name}{{}}", name, *how)


def _parameters(fit: Estimate) -> dict[str, tuple[float, float | None]]:
    """Return what a lever is compared by, with errors: its materials, the inversion temperature."""
    # dimensions and the like are varied within priors: their scatter is not the levers'
    quantities = {
        name: (fitted.value, fitted.stderr)
        for name, fitted in fit.parameters.items()
        if is_of_material(name)
    }
    if np.isfinite(fit.inversion_temperature_K):
        quantities["inversion_temperature"] = (
            fit.inversion_temperature_K,
            fit.inversion_temperature_stderr_K,
        )
    return quantities


def statements(levers: xr.Dataset) -> list[str]:
    """Say in words which levers are left out, whether the others differ, and which stand apart.

    And why there is no tip temperature of some whose data are described. Levers differ if equal
    ones would scatter as much less often than once in a hundred times; one stands apart beyond five
    standard deviations (median-based) of the others, which takes six levers to tell.
    """
    count = levers.counts.sum("lever").values
    chi_square = np.where(count > 1, levers.chi_square.values, np.nan)
    limit = chdtri(np.maximum(count - 1, 1), 0.01)
    texts = [
        f"lever {lever} is left out: its data are not described"
        for lever in levers.lever.values[~levers.described.values]
    ]
    texts += [
        f"lever {lever} is left out of the mean of {quantities}, which its data do not determine"
        for lever, quantities in _by_lever(~levers.counts & levers.value.notnull())
    ]
    for index in np.flatnonzero(chi_square > limit):
        quantity = levers.isel(quantity=index)
        texts.append(
            f"the levers differ in {quantity.words.item()}: they scatter by "
            f"{quantity.scatter.item() / abs(quantity['mean'].item()):.1%}, χ² is "
            f"{chi_square[index]:.3g} for {count[index] - 1} degrees of freedom (Birge ratio "
            f"{quantity.birge_ratio.item():.1f})"
        )
    alike = levers.words.values[chi_square <= limit]
    if alike.size:
        texts.append(
            f"the scatter of {listed(alike)} between the levers is no larger than the standard "
            "errors explain"
        )
    many = levers.isel(quantity=np.isfinite(chi_square) & (count >= 6))
    value = many.value.where(many.counts)
    away = np.abs(value - value.median("lever"))
    # the standard deviation of a normal distribution that has this median
    spread = 1.4826 * away.median("lever")
    texts += [
        f"lever {lever} stands apart from the other levers in {quantities}"
        for lever, quantities in _by_lever(away > 5.0 * np.hypot(spread, many.stderr))
    ]
    answers = zip(levers.lever.values, levers.described.values, levers.reason.values, strict=True)
    return texts + [
        f"lever {lever}: {reason}" for lever, described, reason in answers if described and reason
    ]


def _by_lever(chosen: xr.DataArray) -> list[tuple[str, str]]:
    """Return the levers of which some quantities are chosen, with these in words."""
    return [
        (str(row.lever.item()), listed(row.words.values[row.values])) for row in chosen if row.any()
    ]


def lever_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the table of `compare_levers`: columns, levers, then the mean and the scatter.

    Of calibrations without the coefficients of power laws and what no lever has; k stands where one
    is in air.
    """
    if "tip_K" in levers.quantity:
        finite = levers.value.notnull().any("lever")
        in_air = (levers.value.sel(quantity="k") > 1.0).any()
        quantities = [
            name
            for name in levers.quantity.values[finite.values]
            if name not in PowerLaw.model_fields and (name != "k" or in_air)
        ]
        levers = levers.sel(quantity=quantities)
    rows = [["lever", *levers.heading.values]]
    labels = [*levers.lever.values.tolist(), "weighted mean"]
    values = np.vstack([levers.value, levers["mean"]])
    errors = np.vstack([levers.stderr, levers.mean_stderr])
    how = [levers[name].values for name in ("scale", "lower", "upper")]
    for label, *numbers in zip(labels, values, errors, strict=True):
        cells = zip(*numbers, *how, strict=True)
        rows.append([str(label), *(_with_error(*cell) for cell in cells)])
    scatter = levers.scatter.values
    for label, numbers, form in (
        ("scatter between levers", scatter / levers.scale.values, ".3g"),
        ("scatter, relative", scatter / np.abs(levers["mean"].values), ".1%"),
        ("Birge ratio", levers.birge_ratio.values, ".2g"),
    ):
        rows.append(
            [label, *("" if np.isnan(number) else f"{number:{form}}" for number in numbers)]
        )
    return rows


def _with_error(value: float, stderr: float, scale: float, lower: float, upper: float) -> str:
    if np.isnan(value):
        return ""
    return value_with_error(float(value), float(stderr), float(scale), (lower, upper))


def _rows_along(calibration: Estimate, along: str) -> TipTable | None:
    """Return the rows that tell a tip temperature by bias or power; None if there are none."""
    by_bias = along == "bias_V"
    if not calibration.describes_data or not (by_bias or calibration.power_law is not None):
        return None
    return calibration.tip_table if by_bias else calibration.heating


def _tip_at(calibration: Estimate, at: Setting) -> dict[str, float]:
    """Return the tip temperature with its errors (K); NaN where there is none."""
    rows, names = _rows_along(calibration, at.along), ("tip_K", *STATED)
    if rows is None:
        return dict.fromkeys(names, np.nan)
    return {name: float(interpolated(rows, at.value, at.along, name)) for name in names}


def _why_none(calibration: Estimate, at: Setting, tip: Mapping[str, float]) -> str:
    """Return why a lever whose data are described has no tip temperature there, if so."""
    if np.isfinite(tip["tip_K"]):
        return ""
    if at.along == "power_mW" and calibration.power_law is None:
        return "its tip temperature does not follow from a power; expected a bias"
    low, high = calibration.heating[at.along][[0, -1]]
    unit = QUANTITIES[at.along].unit
    return f"{at.text} is out of its range, {low:.4g} to {high:.4g} {unit}, or where it jumps"


def tips_along(calibrations: Mapping[str, Estimate], along: str) -> xr.Dataset:
    """Return the tip temperatures of those levers whose data are described, at the same settings.

    Parameters
    ----------
    calibrations : mapping of str to Estimate
        By lever.
    along : {"bias_V", "power_mW"}

    Returns
    -------
    xarray.Dataset
        ``tip_K`` and ``tip_stderr_K`` on (``lever``, ``along``); NaN out of a lever's range,
        and where it jumps.
    """
    tables = {
        lever: rows
        for lever, each in calibrations.items()
        if (rows := _rows_along(each, along)) is not None
    }
    edges = [float(table[along][end]) for table in tables.values() for end in (0, -1)]
    at = np.linspace(min(edges, default=0.0), max(edges, default=1.0), 200)
    columns = {
        name: np.array([interpolated(table, at, along, name) for table in tables.values()])
        for name in ("tip_K", "tip_stderr_K")
    }
    shape = len(tables), at.size
    return labelled(
        {name: values.reshape(shape) for name, values in columns.items()},
        ("lever", along),
        {"lever": list(tables), along: at},
    )


def law_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the coefficients of the power laws in vacuum, a column each, below a head."""
    laws = levers.sel(quantity=list(PowerLaw.model_fields))
    rows = [["lever", *laws.heading.values.tolist()]]
    for lever in laws.lever:
        values = laws.value.sel(lever=lever).values.tolist()
        cells = ("" if np.isnan(value) else value_with_error(value, np.nan) for value in values)
        rows.append([str(lever.item()), *cells])
    return rows


def levers_text(levers: xr.Dataset) -> str:
    """Return `lever_rows` as text, mean and scatter below a line; then `statements`."""
    lines = aligned(lever_rows(levers))
    # above the rows that are of all levers: mean, scatter twice, Birge ratio
    lines.insert(-4, "-" * max(map(len, lines)))
    return "\n".join(lines + statements(levers))


def levers_csv(levers: xr.Dataset, failures: Mapping[str, HotleverError] | None = None) -> str:
    """Return a table with one row for each lever: value and standard error of each quantity.

    Behind them what else `compare_levers` has on ``lever``; below them the data files of which
    nothing could be made, and why.
    """
    import xarray as xr  # see `hotlever.datasets.labelled`

    columns = {
        quantity.column.item().format(kind): column.sel(quantity=quantity).reset_coords(drop=True)
        for quantity in levers.quantity
        for kind, column in (("", levers.value), ("_stderr", levers.stderr))
        if not kind or "{}" in quantity.column.item()
    }
    own = (levers.attrs.get("along"), "tip_low_K", "tip_high_K", "describes_data", "reason", "file")
    table = xr.Dataset({**columns, **{name: levers[name] for name in own if name in levers}})
    frame = table.to_dataframe()
    for path, error in (failures or {}).items():
        frame.loc[path, ["reason", "file"]] = str(error), path
    return frame_text(frame, float_format="%.8g")
