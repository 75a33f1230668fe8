"""Fits and calibrations of measurement files, of one lever or many, and what to measure next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from hotlever.errors import ComputationError, HotleverError, InputError, quoted, unknown_name
from hotlever.files import FOLDER, TABLE, check_outputs, write_text
from hotlever.tasks.arguments import (
    DataArguments,
    MeasuredOptions,
    Plot,
    Reporter,
    WaveformOptions,
    Written,
    at_most_one,
    check_medium,
    draw,
    read_probe,
    refuse,
)
from hotlever.tasks.parsing import (
    check_number,
    parse_bias,
    parse_costs,
    parse_kinds,
    parse_noise,
    parse_number,
    parse_pairs,
    parse_setting,
    parse_temperature,
    parse_timing,
)
from hotlever.units import setting

if TYPE_CHECKING:
    from hotlever.estimate import Estimate
    from hotlever.estimate.experiment import Prediction
    from hotlever.estimate.many import Batch, Setting
    from hotlever.estimate.uncertainty import Uncertainty
    from hotlever.measurement import Measurement


def fit_files(
    reporter: Reporter,
    levers: DataArguments,
    *,
    beforehand: MeasuredOptions,
    drive: WaveformOptions,
    observables: str | None = None,
    fix: list[str] | None = None,
    free: str | None = None,
    robust: bool = False,
    weights: str = "maximum",
    posterior: bool = False,
    samples: int | None = None,
    profiles: bool = False,
) -> int:
    """Find the material parameters that make the model match a measurement.

    Of what was measured in time, a file with a column as 'time (us)', the heat capacity, and what
    else is free; the wave form is the column V_b, or what is told.

    With several data files: of each lever, in parallel, and how the levers scatter. The same
    command again goes on where it was stopped.

    Parameters
    ----------
    observables
        Some of current,reader,tip,bridge; all that the file has if left out.
    fix : NAME[=VALUE]
        Hold a parameter.
    free : NAME[,...]
        Vary more than is usual: any parameter of a material, as film.lorenz_ratio, or of the probe.
    robust
        Lessen the weight of points far off the others.
    weights
        maximum: of each observable, as in the paper; or errors, as measured.
    posterior
        Sample the posterior; predict the tip with its band.
    samples : N
        Of the posterior; 2000 if left out.
    profiles
        Profile the likelihood of each parameter.
    """
    from hotlever.estimate import FitOptions, fit
    from hotlever.estimate.many import fit_many
    from hotlever.estimate.summary import fit_text
    from hotlever.measurement import parse_columns, read_measurement_of
    from hotlever.probe.priors import is_of_laws

    several = _check_levers(levers)
    count = _count_samples(posterior, samples)
    if several:
        why = "expected a single data file"
        refuse(why, posterior=posterior, profiles=profiles, **asdict(drive))
    like = read_probe(reporter, beforehand.probe, physics=beforehand.physics)
    priors, stated = beforehand.priors(like), like.stated_priors
    if beforehand.laws is not None:
        stated = {name: text for name, text in stated.items() if not is_of_laws(name)}
    usual = "usual" in (beforehand.prior or [])
    choices: dict[str, Any] = {"robust": robust, "weights": weights, "medium": beforehand.medium}
    options = FitOptions(
        observables=None if observables is None else observables.split(","),
        fixed={
            name: parse_number(text, f"--fix {name}") if text else None
            for name, text in parse_pairs("--fix", fix, bare=True).items()
        },
        priors=stated if priors is None else {**stated, **priors} if priors or usual else {},
        usual_priors=usual,
        free=() if free is None else tuple(map(str.strip, free.split(","))),
        **choices,
    )
    if several:
        make = partial(fit_many, probe=like, options=options)
        return _estimate_several(reporter, levers, beforehand.column, make, "fits")
    (path,) = levers.data
    columns = parse_columns(beforehand.column or [])
    measurement = read_measurement_of(like, path, columns, drive.read())
    options.of(like, in_time=measurement.time_us is not None)  # raises before anything is said
    if posterior or profiles:
        measurement.need_rest("--posterior" if posterior else "--profiles")
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes, *measurement.unused)
    with reporter.progress("fit") as update:
        seen = partial(_show_curve, reporter)
        result = fit(measurement, like, options, progress=update, seen=seen)
    reporter.note(*result.notes)
    texts = [fit_text(result)]
    uncertainty: Uncertainty | None = None
    failure: HotleverError | KeyboardInterrupt | None = None
    if (posterior or profiles) and not result.describes_data:
        reporter.note("no posterior and no profiles of a lever that does not show these data")
    elif posterior or profiles:
        try:
            uncertainty = _examine(reporter, result, count or None, profiles, levers.processes)
            reporter.note(*uncertainty.statements())
            texts.append(uncertainty.text())
        except (HotleverError, KeyboardInterrupt) as error:
            # the fit is there; what ends this is said when it is written
            failure = error
    if levers.output is not None:
        write_text(levers.output, (uncertainty or result).to_json())
    if levers.report is not None:
        from hotlever.report.result_pages import fit_page

        texts.append(f"report: {fit_page(result, uncertainty).write(levers.report)}")
    reporter.give("\n".join([*texts, ""]))
    if failure is not None:
        raise failure
    if not result.describes_data:
        raise ComputationError(f"{path}: {result.doubt}")
    return 0


def _check_levers(levers: DataArguments) -> bool:
    """Refuse ways to work on levers that do not go together; return whether there are several."""
    check_number("--processes", levers.processes, 1, 256)
    at_most_one(processes=levers.processes, scheduler=levers.scheduler)
    if len(levers.data) == 1:
        refuse("expected several data files", scheduler=levers.scheduler)
    return len(levers.data) > 1


def _count_samples(posterior: bool, samples: int | None) -> int:
    """Return how many samples of a posterior are drawn, 0 without."""
    check_number("--samples", samples, 1, 1_000_000)
    if not posterior:
        refuse("goes with --posterior", samples=samples)
        return 0
    return 2_000 if samples is None else samples


def _show_curve(reporter: Reporter, prediction: Prediction) -> None:
    """Show how near to the data the lever is that was found so far."""
    columns = prediction.columns
    along, *_ = columns.values()
    some = along.argsort()[:: max(1, along.size // 200)]
    reporter.show("curve", {name: values[some].tolist() for name, values in columns.items()})


def _examine(
    reporter: Reporter, result: Estimate, samples: int | None, profiles: bool, processes: int | None
) -> Uncertainty:
    """Sample the posterior of a fit, and profile its parameters, as is asked."""
    from hotlever.estimate.uncertainty import examine  # brings scipy's statistics along

    with reporter.progress_bars("profiles", "posterior", "band") as (profiling, sampling, banding):
        return examine(
            result,
            samples=samples,
            profiles=profiles,
            processes=processes,
            profiling=profiling,
            sampling=sampling,
            banding=banding,
        )


def calibrate_files(
    reporter: Reporter,
    levers: DataArguments,
    *,
    fit: Path | None = None,
    power_law: Path | None = None,
    beforehand: MeasuredOptions,
    pulse: str | None = None,
    posterior: bool = False,
    samples: int | None = None,
    at: str | None = None,
    budget_of: str = "tip",
    table: Annotated[Path | None, Written((".csv",))] = None,
    table_by: str | None = None,
    table_step: str | None = None,
    plot: Plot = None,
) -> int:
    """Find the tip temperature of a lever from its I-V curve, with its error.

    With several data files: of each lever, in parallel, and where the levers differ. The same
    command again goes on where it was stopped.

    Parameters
    ----------
    fit
        A fit of this lever (hotlever fit -o).
    power_law
        Power law in vacuum (JSON), or a calibration file.
    pulse : TIME[,PERIOD]
        Calibrate a pulse too, such as 5us or 5us,100us.
    posterior
        Take the limits from samples of the posterior.
    samples : N
        Of the posterior; 2000 if left out.
    at : BIAS|POWER
        Bias of the uncertainty budget, as 8V; the hottest tip if left out. With several levers
        where they are compared, as 8V or 2mW; the highest bias that all of them were measured at if
        left out.
    budget_of
        What the uncertainty budget is of: tip, or apex of a tip in contact.
    table
        Write the table for an instrument, or for its pulses, to this CSV file; with several data
        files each has one beside its calibration.
    table_by
        What the rows are even in: temperature (if left out), power or bias.
    table_step : STEP
        Between the rows, as 10K, 0.05mW or 0.1V; left out: for 50 rows or more.
    """
    from hotlever.estimate import calibrate, read_fit
    from hotlever.estimate.many import Setting, calibrate_many
    from hotlever.estimate.options import CalibrationOptions
    from hotlever.estimate.power_law import read_power_law
    from hotlever.estimate.summary import calibration_text
    from hotlever.measurement import parse_columns, read_measurement_of

    several = _check_levers(levers)
    count = _count_samples(posterior, samples)
    if table is None and not several:
        refuse("goes with --table", table_by=table_by, table_step=table_step)
    at_most_one(fit=fit, probe=beforehand.probe, power_law=power_law)
    if fit or power_law:
        why = "goes with --probe, expected neither --fit nor --power-law"
        refuse(why, physics=beforehand.physics)
    check_medium(beforehand.medium, "unknown")
    if several:
        refuse("expected a single data file", fit=fit, table=table, plot=plot)
    budget_at = None if at is None else Setting(*parse_setting(at))
    if budget_at is not None and not several and budget_at.along != "bias_V":
        raise InputError(
            f"--at: found {quoted(at)}, expected a bias such as 8V of one data file, or several "
            "data files"
        )
    table_options = _table_options("temperature" if table_by is None else table_by, table_step)
    law = None if power_law is None else read_power_law(power_law)
    of_lever = None if fit is None else read_fit(fit)
    stated = beforehand.probe
    like = of_lever.probe if of_lever else read_probe(reporter, stated, physics=beforehand.physics)
    choices: dict[str, Any] = {"medium": beforehand.medium, "budget_of": budget_of}
    options = CalibrationOptions(
        law=law,
        priors=beforehand.priors(like),
        pulse=None if pulse is None else parse_timing(pulse),
        samples=count,
        at_V=None if budget_at is None or several else budget_at.value,
        **choices,
    )
    like_probe = like if of_lever is None and law is None else None
    if several:
        make = partial(calibrate_many, probe=like_probe, options=options)
        more = "calibrations", budget_at, table_options
        return _estimate_several(reporter, levers, beforehand.column, make, *more)
    (path,) = levers.data
    measurement = read_measurement_of(like, path, parse_columns(beforehand.column or []))
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes, *measurement.unused)
    with reporter.progress("calibrate") as update:
        result = calibrate(
            measurement, probe=like_probe, fit=of_lever, options=options, progress=update
        )
    reporter.note(*result.notes)
    texts = [calibration_text(result)]
    if levers.output is not None:
        result.write(levers.output)
    if table is not None:
        write_text(table, result.table_csv(**table_options))
    draw(plot, lambda figures: figures.calibration_curves(result))
    if levers.report is not None:
        texts.append(f"report: {_write_pages(result, levers.report)}")
    reporter.give("\n".join([*texts, ""]))
    if not result.describes_data:
        raise ComputationError(f"{path}: {result.doubt}")
    return 0


def _table_options(by: str, step: str | None) -> dict[str, Any]:
    """Return what the table for an instrument is even in, and its step."""
    from hotlever.estimate.tip_table import TABLES_BY

    if by not in TABLES_BY:
        raise unknown_name("quantity", by, TABLES_BY, "--table-by")
    if step is None:
        return {"by": by}
    unit = TABLES_BY[by][1]
    value = setting(step, unit, "--table-step", bare=True)
    if value <= 0.0:
        raise InputError(f"--table-step {value:g}: expected more than 0 {unit}")
    return {"by": by, "step": value}


def _write_pages(result: Estimate, folder: Path) -> Path:
    """Write the page of a calibration, and that of its uncertainty budget; return the former."""
    from hotlever.report.result_pages import budget_page, calibration_page

    page = calibration_page(result)
    if result.gum is not None:
        budget_page(result).write(folder, "budget")
        page.text("The whole uncertainty budget, as one sheet to print: budget.html.")
    return page.write(folder)


def propose(
    reporter: Reporter,
    data: Path | None = None,
    *,
    beforehand: MeasuredOptions,
    allow: str | None = None,
    count: int | None = None,
    quantity: str = "tip",
    at: str | None = None,
    stay_below: str | None = None,
    bias: str | None = None,
    cost: list[str] | None = None,
    noise: list[str] | None = None,
    output: Annotated[Path | None, Written((".csv",))] = None,
    plot: Plot = None,
) -> None:
    """Say what to measure next, so that a tip temperature or the knee's is known best.

    One row for each proposal, best first: how hot the tip would be there, and how hot at most
    with 99 % certainty, and how sure what counts is known then. Without data: where to begin.

    Parameters
    ----------
    data : [DATA]
        Calibration (hotlever calibrate -o CAL.json), or a measurement file, which is calibrated
        first; left out: a lever that was not measured yet.
    allow : KIND[=COUNT],...
        Some of bias,spectra,reader,dimensions, and at most how many, as bias=15,spectra=3; bias and
        spectra if left out, and reader where it was measured.
    count : N
        Proposals; 5, or as many as are allowed, if left out.
    quantity : tip|knee
        Whose error counts: that of the tip temperature --at, or of that at the knee.
    at : TEMPERATURE
        Tip temperature whose error counts, as 800K; if left out the hottest that was measured, or
        without data the hottest that may be.
    stay_below : TEMPERATURE
        Propose nothing at which the tip could be hotter with more than 1 % probability, as 900K;
        what melts if left out.
    bias : START:STOP:COUNT
        Biases that can be taken (V); even ones to half beyond those measured if left out.
    cost : KIND=TIME
        Of one measurement, as spectra=10min; repeated for each kind. The gain is then that per
        minute.
    noise : NAME=SHARE
        Of a measurement to come, as current=0.2%, tip=1% (of the rise) or dimensions=2%; that of
        the data, or what is usual, if left out; repeated.
    output
        CSV file; a table in words if left out.
    """
    from hotlever.estimate import plan_next, read_calibration
    from hotlever.estimate.next_measurement import check_names

    if quantity == "knee":
        refuse("the knee has a temperature of its own; leave it out", at=at)
    # of a lever that was not measured nothing could tell in which it is
    check_medium(beforehand.medium, *([] if data is None else ["unknown"]))
    most = 100
    check_number("--count", count, 1, most)
    allowed = parse_kinds(allow, most)
    check_names(quantity, allowed or ())  # before a measurement is calibrated
    limits = list((allowed or {"": None}).values())
    usual = sum(number or 0 for number in limits) if all(limits) else 5
    choices: dict[str, Any] = {
        "quantity": quantity,
        "at_K": parse_temperature(at, "--at"),
        "stay_below_K": parse_temperature(stay_below, "--stay-below"),
        "allowed": allowed,
        "count": count or min(usual, most),
        "bias": None if bias is None else parse_bias(bias),
        "costs": parse_costs(cost, list(allowed or ("bias", "spectra"))),
        "noise": parse_noise(noise),
    }
    if data is not None and data.suffix.lower() == ".json":
        why = "the calibration has its own; expected a measurement file"
        refuse(why, **asdict(beforehand))
        choices["calibration"] = read_calibration(data)
    elif data is not None:
        choices["calibration"] = _calibrated_first(reporter, data, beforehand)
    else:
        refuse("expected a measurement file", column=beforehand.column)
        like = read_probe(reporter, beforehand.probe, physics=beforehand.physics)
        like = like if beforehand.medium is None else like.in_medium(beforehand.medium)
        choices |= {"probe": like, "priors": beforehand.priors(like)}
    with reporter.progress("next"):
        plan = plan_next(**choices)
    reporter.note(*plan.notes)
    if output is not None:
        write_text(output, plan.to_csv())
    draw(plot, lambda figures: figures.planned_measurements(plan))
    reporter.give(plan.text() + "\n")


def _calibrated_first(reporter: Reporter, data: Path, beforehand: MeasuredOptions) -> Estimate:
    from hotlever.estimate import calibrate
    from hotlever.measurement import parse_columns, read_measurement_of

    like = read_probe(reporter, beforehand.probe, physics=beforehand.physics)
    measurement = read_measurement_of(like, data, parse_columns(beforehand.column or []))
    reporter.note(*measurement.notes)
    known: Any = {"priors": beforehand.priors(like), "medium": beforehand.medium}
    with reporter.progress("calibrate") as update:
        result = calibrate(measurement, probe=like, **known, progress=update)
    reporter.note(f"{data} was calibrated first, which a file of hotlever calibrate -o saves")
    return result


# --- many levers --------------------------------------------------------------------------------


def _estimate_several(
    reporter: Reporter,
    levers: DataArguments,
    column: list[str] | None,
    make: Callable[..., Batch],
    results: str,
    at: Setting | None = None,
    table_options: dict[str, Any] | None = None,
) -> int:
    """Make a result of each of many measurements and compare them; return the exit status.

    The same again goes on where it was stopped.

    Parameters
    ----------
    reporter : Reporter
    levers : DataArguments
    column : list of str or None
        Which column of the data is which, as the option says it.
    make : callable
        Takes data files, a folder, and how they are worked on: see `estimate_many`.
    results : str
        What the results are called, as their folder beside a page.
    at : Setting, optional
        Where the tips of calibrations are compared.
    table_options : dict, optional
        Of the tables of calibrations for an instrument.

    Raises
    ------
    InputError
        If nothing says where the results go.
    ComputationError
        If it is stopped.
    """
    from hotlever.measurement import parse_columns

    data, output, report, scheduler = levers.data, levers.output, levers.report, levers.scheduler
    table = "levers.csv" if results == "fits" else f"{results}.csv"
    if scheduler is not None and _is_open(scheduler):
        reporter.note(
            f"--scheduler {scheduler}: without TLS whoever reaches this address can have its "
            "workers run any code"
        )
    if output is None and report is None:
        raise InputError(
            f"{len(data)} data files: expected -o FOLDER or --report DIR to write their {results} "
            "to"
        )
    folder = output or Path(str(report), results)
    if output is None:
        check_outputs([(folder, FOLDER)])
    if folder.is_dir():
        check_outputs([(folder / table, (".csv",))], data)
    done = 0
    with reporter.progress_bars("levers", "geometry") as (estimating, reducing):

        def update(count: int, total: int) -> None:
            nonlocal done
            done = count
            estimating(count, total)

        def read(measurement: Measurement) -> None:
            (name, *_, rows), *quantities = measurement.understood
            columns_read = "; ".join(f"{what} {value}" for what, value, _ in quantities)
            reporter.tell(f"{name}: {rows}; {columns_read}")
            reporter.note(*measurement.notes, *measurement.unused)

        where: Any = {"processes": levers.processes, "scheduler": scheduler}
        bars: Any = {"reading": read, "reducing": reducing, "progress": update}
        try:
            batch = make(data, folder, columns=parse_columns(column or []), **where, **bars)
        except KeyboardInterrupt:
            raise ComputationError(
                f"stopped by the user after {done} of {len(data)} files; the same command goes "
                "on from there"
            ) from None
    if batch.reused:
        count = len(batch.results) + len(batch.failures)
        reporter.note(
            f"{batch.reused} of {count} levers have their {results} from before, of the same data"
        )
    if batch.results:
        _tell_together(reporter, batch, folder / table, report, at, table_options)
    for failure in (*map(str, batch.failures.values()), *batch.undescribed.values()):
        reporter.fail(failure)
    return batch.exit_status


def _is_open(address: str) -> bool:
    """Whether anybody on the network who finds a scheduler may use it, and its workers.

    Examples
    --------
    >>> [_is_open(one) for one in ("tcp://node7:8786", "tls://node7:8786", "tcp://127.0.0.1:8786")]
    [True, False, False]
    """
    scheme, _, rest = address.rpartition("://")
    host = rest.rpartition(":")[0].strip("[]")
    return scheme != "tls" and not (host in ("localhost", "::1") or host.startswith("127."))


def _tell_together(
    reporter: Reporter,
    batch: Batch,
    table: Path,
    report: Path | None,
    at: Setting | None,
    table_options: dict[str, Any] | None,
) -> None:
    """Write and say what the estimates of many levers say together.

    Each calibration has its table for an instrument beside it, by these options.
    """
    from hotlever.estimate.many import compare_levers, levers_csv, levers_text

    compared = compare_levers(batch.results, at)
    texts = [levers_text(compared)]
    write_text(table, levers_csv(compared, batch.failures))
    for name, each in batch.results.items() if table_options is not None else ():
        try:
            write_text(table.with_name(f"{name}{TABLE}"), each.table_csv(**table_options or {}))
        except InputError as error:
            texts.append(f"{name}: {error}")
    if report is not None:
        from hotlever.report.result_pages import levers_page

        texts.append(f"report: {levers_page(batch, compared).write(report)}")
    reporter.give("\n".join([*texts, ""]))
