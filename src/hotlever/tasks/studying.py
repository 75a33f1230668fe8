"""Studies: what a change of a design does, and how far numbers hold, the paper's and others'.

A design is told by its sensitivities, by variations, or by the best within bounds; the paper's
results and other published ones are pages.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from hotlever.errors import InputError
from hotlever.files import FOLDER, check_outputs, write_text
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S
from hotlever.tasks.arguments import (
    Physics,
    Plot,
    ProbeFile,
    Reporter,
    Written,
    at_most_one,
    draw,
    read_probe,
    refuse,
)
from hotlever.tasks.parsing import check_number, parse_bounds, parse_setting, parse_varied

if TYPE_CHECKING:
    from hotlever.probe import Probe


def vary_design(
    reporter: Reporter,
    probe: ProbeFile = None,
    *,
    physics: Physics = None,
    vary: list[str] | None = None,
    power: float | None = None,
    annealing_K: Annotated[
        float | None,
        Option(
            "--annealing-K",
            help=f"Annealing (K) that the probe's delta is of; {ANNEALING_K:g} if left out.",
        ),
    ] = None,
    annealing_min: Annotated[
        float | None,
        Option(help=f"Annealing (min) that the delta is of; {ANNEALING_S / 60.0:g} if left out."),
    ] = None,
    air: bool = True,
    minimise: str | None = None,
    maximise: str | None = None,
    within: list[str] | None = None,
    at: str | None = None,
    output: Annotated[
        Path | None,
        Written(
            types_of=lambda values: (
                (".toml",) if values["minimise"] or values["maximise"] else (".csv", ".nc")
            )
        ),
    ] = None,
    plot: Plot = None,
) -> None:
    """Show how knee, tip temperature and loss to air depend on a probe's design.

    Parameters
    ----------
    vary : NAME=START:STOP:COUNT
        Sweep a number of the probe file, annealing_K or annealing_min; repeated: each with each, as
        a map. A table of sensitivities if left out.
    power
        Power (mW) in vacuum at which the tip temperature is given; 2 if left out.
    air
        Solve in air too, for k.
    minimise : QUANTITY
        Find the design whose quantity is least, such as time_constant_us; it writes a probe file
        (-o FILE.toml).
    maximise : QUANTITY
        Or greatest.
    within : NAME=LOW:HIGH
        Bounds of a number that may change, or of a quantity (one may be left out).
    at : POINT
        Working point: a tip temperature, or as 8V or 2mW; 700K if left out.
    output
        FILE.csv or FILE.nc; standard output if left out.
    """
    from hotlever.datasets import write_dataset
    from hotlever.studies import design as study

    beside: dict[str, Any] = {
        "vary": vary,
        "power": power,
        "annealing_K": annealing_K,
        "annealing_min": annealing_min,
        "no_air": not air,
    }
    if minimise is not None or maximise is not None:
        at_most_one(minimise=minimise, maximise=maximise)
        refuse("does not go with --minimise or --maximise", **beside)
        changed = read_probe(reporter, probe, physics=physics)
        point = "700K" if at is None else at
        _optimise(reporter, changed, minimise, maximise, within, point, output, plot)
        return
    refuse("goes with --minimise or --maximise", within=within, at=at)
    power_mW = 2.0 if power is None else power
    annealed_K = ANNEALING_K if annealing_K is None else annealing_K
    annealed_min = ANNEALING_S / 60.0 if annealing_min is None else annealing_min
    check_number("--power", power, 1e-3, 1000)
    check_number("--annealing-K", annealing_K, 700, 1700)
    check_number("--annealing-min", annealing_min, 1e-3, 1e5)
    varied = parse_varied(vary or [])
    if not varied:
        refuse("needs a sweep, --vary NAME=START:STOP:COUNT", plot=plot, output=output)
    elif len(varied) > 2:
        # a figure is a curve or a map
        refuse(f"found {len(varied)} of --vary, expected at most 2", plot=plot)
    start = study.Design(read_probe(reporter, probe, physics=physics), annealed_K, annealed_min)
    if not varied:
        with reporter.progress("design") as update:
            sensitivities = study.sensitivities(start, power_mW=power_mW, air=air, progress=update)
        reporter.note(study.mesh_note(start.probe, power_mW))
        reporter.give(study.sensitivity_text(sensitivities) + "\n")
        if start.probe.shape.shape == "drawing":
            names = ", ".join(start.numbers)
            reporter.note(
                f"a drawing has no dimensions but these; --vary NAME=START:STOP:COUNT of {names}"
            )
        return
    with reporter.progress("design") as update:
        data = study.vary(start, varied, power_mW=power_mW, air=air, progress=update)
    reporter.note(study.mesh_note(start.probe, power_mW), *study.design_notes(data))
    if output is not None and output.suffix.lower() == ".nc":
        write_dataset(data, output, ())
    elif output is not None:
        write_text(output, study.design_csv(data))
    draw(plot, lambda figures: figures.design_study(data))
    if output is None:
        reporter.give(study.design_csv(data))


def _optimise(
    reporter: Reporter,
    probe: Probe,
    minimise: str | None,
    maximise: str | None,
    within: list[str] | None,
    at: str,
    output: Path | None,
    plot: Path | None,
) -> None:
    """Find the design within bounds whose quantity is least or greatest."""
    from hotlever.studies.optimisation import WorkingPoint, optimise, optimum_text

    point = WorkingPoint(*parse_setting(at, tip=True))
    quantity, bounds = minimise or maximise or "", parse_bounds(within)
    for option, name in (
        ("--minimise" if minimise else "--maximise", quantity),
        *(("--within", name) for name in bounds),
    ):
        if name == point.column:
            raise InputError(
                f"{option} {name}: it is what --at {at} holds, expected another quantity, or "
                "another --at"
            )
    with reporter.progress("design") as update:
        greatest = maximise is not None
        optimum = optimise(probe, quantity, point, bounds, greatest=greatest, progress=update)
    if optimum.reason:
        reporter.note(f"this may not be the optimum: {optimum.reason}")
    if output is not None:
        optimum.best.probe.to_file(output)
    draw(plot, lambda figures: figures.design_optimum(optimum))
    reporter.give(optimum_text(optimum) + "\n")


# --- pages of published numbers -------------------------------------------------------------------


def reproduce(
    reporter: Reporter,
    *,
    output: Annotated[Path, Written()] = Path("reproduce"),
    quick: bool = False,
) -> None:
    """Compute the paper's tables and figures and put them on one page.

    Parameters
    ----------
    output
        Folder for the page and its figures.
    quick
        Leave out what takes longest: k by geometry, the tip, the mesh; fewer levers.
    """
    from hotlever.report.reproduce import reproduce_page

    with reporter.progress("reproduce") as update:
        page = reproduce_page(quick=quick, progress=update)
    reporter.give(f"{page.write(output)}\n")


def validate(
    reporter: Reporter,
    case: Path | None = None,
    *,
    output: Annotated[Path | None, Written()] = None,
) -> None:
    """Predict published numbers of other levers and compare them, on one page and in a table.

    Parameters
    ----------
    case : [CASE.toml]
        A case of your own, whose prediction is printed.
    output
        Folder for the page and its table; validate if left out.
    """
    if case is not None:
        why = "goes without a case of your own, whose prediction is printed"
        refuse(why, output=output)
        _predict(reporter, case)
        return
    from hotlever.datasets import frame_text
    from hotlever.report.validation_pages import validation_page

    folder = output or Path("validate")
    if output is None:
        check_outputs([(folder, FOLDER)])
    with reporter.progress("validate") as update:
        page, compared = validation_page(update)
    written = page.write(folder)
    table = frame_text(compared.to_dataframe(), float_format="%.6g")
    write_text(folder / "validation.csv", table)
    reporter.give(f"{written}\n")


def _predict(reporter: Reporter, path: Path) -> None:
    from hotlever.studies.validation.case import Case
    from hotlever.studies.validation.prediction import predict

    case = Case.from_file(path)
    with reporter.progress("draws") as update:
        prediction = predict(case, update)
    text = prediction.toml()
    if case.published is not None:
        value, error = case.published.value, case.published.error
        text += f"# published {value:g} ± {error:g}: {prediction.verdict(value, error)}\n"
    reporter.give(text)
