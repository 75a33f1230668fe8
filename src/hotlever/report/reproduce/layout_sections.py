"""The paper's lever from all that is printed of it: layouts, and the 50 K that the knee is off."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.materials import PARAMETERS
from hotlever.materials.departures import DEPARTURES, departure_of
from hotlever.probe.probe_parameters import parameter_named
from hotlever.quantities import THERMOMETER
from hotlever.report.reproduce.findings import Findings
from hotlever.studies.knee_study import Suspect, carried, compare_suspects, what_to_measure
from hotlever.studies.published_lever.ensemble import (
    REFERENCE,
    SIZES,
    WEIGHED,
    Ensemble,
    stored_ensemble,
    stored_layouts,
)
from hotlever.studies.published_lever.statements import SEARCHED
from hotlever.text import listed

#: The layouts that meet Eq. 12 before all else, and whose laws may depart from the printed ones.
_EQ12_FIRST, _UNCERTAIN = "Eq. 12 first", "uncertain laws"


def layouts_section(page: Findings) -> None:
    """The layouts, and how many of the printed statements each meets."""
    found = stored_ensemble()
    drawn = found.numbers.where(found.numbers.drawn, drop=True)
    numbers: Any = {
        "count": drawn.sizes["layout"],
        "statements": found.deviations.sizes["statement"],
        "shortest": drawn.length_um.min(),
        "longest": drawn.length_um.max(),
    }
    page.say("layouts", **numbers)
    _tabulate_dimensions(page, found)
    page.draw("layouts", figures.layouts_by_length(found))
    page.say("size", **_of_size(found))
    page.draw("printed_statements", figures.printed_statements(found))
    _tabulate_statements(page, found)
    _say_tensions(page, found)


def _tabulate_dimensions(page: Findings, found: Ensemble) -> None:
    """Tabulate dimensions of the nearest layout, the reference, and the range of all."""
    some = [found.nearest, REFERENCE, _EQ12_FIRST, _UNCERTAIN]
    names = ["length_um", *next(iter(stored_layouts().values())).values]
    rows = []
    for name in names:
        low, high = found.range(name)
        values = [found.numbers[name].sel(layout=layout).item() for layout in some]
        rows.append(
            (
                f"{parameter_named(name).symbol} ({parameter_named(name).unit})",
                *(f"{value:.4g}" for value in values),
                f"{low:.4g} to {high:.4g}",
            )
        )
    met = [f"{found.met(layout)} of {found.deviations.sizes['statement']}" for layout in some]
    least = min(found.met(str(name)) for name in found.names)
    most = max(found.met(str(name)) for name in found.names)
    rows.append(("statements met", *met, f"{least} to {most}"))
    columns = ("", f"nearest ({some[0]})", *some[1:], "all layouts")
    page.tabulate("layouts", columns, rows)


def _of_size(found: Ensemble) -> dict[str, Any]:
    """Return what the size decides, and which sizes what is said of air makes likely."""
    sizes = [found.mean("length_um", size) for size in SIZES]
    columns = found.numbers[["k_400", "k_893", "k_1150"]].to_dataarray("column")
    growth = columns.sel(column="k_1150") / columns.sel(column="k_400") - 1.0
    drawn = growth.where(found.numbers.drawn)
    best = found.numbers.sel(layout=found.best)
    return {
        "best": (best.length_um.min(), best.length_um.max()),
        "squares": (best.square.min(), best.square.max()),
        "any_size": sizes[0],
        "small": sizes[1],
        "growth_low": drawn.min(),
        "growth_high": drawn.max(),
        "k": found.range("eq12_k"),
        "k_K": found.range("eq12_k_K"),
        "printed_K": found.range("eq12_air_K"),
    }


def _tabulate_statements(page: Findings, found: Ensemble) -> None:
    where = {each.name: (each.where, f"{each.name}: {each.words}") for each in SEARCHED}
    where |= {
        name: (each.where, f"{name}: {each.words.format(may=each.may)}")
        for name, each in WEIGHED.items()
    }
    rows = []
    for name in found.deviations.statement.values:
        deviation = abs(found.deviations.sel(statement=name))
        drawn = deviation.where(found.numbers.drawn, drop=True)
        shares = [found.share(deviation <= 1.0, size) for size in SIZES]
        rows.append(
            (
                *where[str(name)],
                *(
                    _cell(deviation.sel(layout=one).item())
                    for one in (found.nearest, REFERENCE, _UNCERTAIN)
                ),
                f"{drawn.min().item():.2f} to {drawn.max().item():.2f}",
                " / ".join(dict.fromkeys(f"{share:.0%}" for share in shares)),
            )
        )
    columns = ("where", "printed", "nearest", REFERENCE, _UNCERTAIN, "all layouts", "met by")
    page.tabulate("printed_statements", columns, rows, prose=True)


def _best_like(found: Ensemble, layout: xr.Dataset) -> float:
    """Return the sum of squares of the best layout of the same length."""
    best = found.numbers.square.where(found.numbers.length_um == layout.length_um)
    return float(best.sel(layout=found.best).min())


def _cell(deviation: float) -> str:
    return f"{'met' if deviation <= 1.0 else 'off'}, {deviation:.2f}"


def _missed(found: Ensemble, layout: str) -> str:
    """Return the statements that a layout misses, the farthest first, and by how much."""
    deviations = abs(found.deviations.sel(layout=layout)).to_series()
    worst = deviations[deviations > 1.0].sort_values(ascending=False)
    return listed([f"{name} ({value:.2f})" for name, value in worst.items()])


def _say_tensions(page: Findings, found: Ensemble) -> None:
    """Say which statements no layout meets, and what it costs to meet Eq. 12."""
    shares = {
        str(name): found.share(abs(found.deviations.sel(statement=name)) <= 1.0)
        for name in found.deviations.statement.values
    }
    rarely = [f"{name} ({share:.0%})" for name, share in shares.items() if share < 0.5]
    first = found.numbers.sel(layout=_EQ12_FIRST)
    page.say(
        "tensions",
        rarely=listed(rarely),
        last=found.range("eq12_last_K"),
        first=first,
        worst=_missed(found, _EQ12_FIRST),
    )
    departed = found.numbers.sel(layout=_UNCERTAIN)
    coefficients = {
        name: value
        for name, value in stored_layouts()[_UNCERTAIN].values.items()
        if departure_of(name) is not None
    }
    largest = sorted(coefficients, key=lambda name: -abs(coefficients[name]))[:4]
    page.say(
        "uncertain_laws",
        departed=departed,
        largest=listed(
            f"{parameter_named(name).symbol} {coefficients[name]:+.2f}" for name in largest
        ),
        most=max(map(abs, coefficients.values())),
        met=found.met(_UNCERTAIN),
        missed=_missed(found, _UNCERTAIN),
        eq12=abs(found.deviations.sel(layout=found.nearest, statement="Eq. 12")),
        statements=found.deviations.sizes["statement"],
        squares=(_best_like(found, departed), departed.square),
    )
    nearest, reference = (found.numbers.sel(layout=one) for one in (found.nearest, REFERENCE))
    page.say(
        "nearest",
        name=found.nearest,
        nearest=nearest,
        reference=reference,
        met=found.met(found.nearest),
        reference_met=found.met(REFERENCE),
        statements=found.deviations.sizes["statement"],
    )


# --- the 50 K -------------------------------------------------------------------------------------


def discrepancy_section(page: Findings) -> None:
    """What carries how much of the 50 K: each suspect, the laws, and the ramp it is read off."""
    found, study = stored_ensemble(), carried()
    nearest = found.nearest
    page.say("ramp", **_of_the_ramp(found))
    reference = found.numbers.sel(layout=REFERENCE)
    page.judge(
        "knee_misses",
        reference.ramp_up_current.item(),
        reference=reference,
        nearest=found.numbers.sel(layout=nearest),
    )
    page.draw("knee_carried", figures.knee_carried(study, nearest, paper.KNEE_OFF_K))
    rows = [
        (
            str(suspect),
            _of(study.moved_K.sel(suspect=suspect), nearest),
            _of(study.shift_K.sel(suspect=suspect), nearest),
            _of(study.ramp_K.sel(suspect=suspect), nearest),
            _parameters(study.sel(suspect=suspect, layout=nearest)),
        )
        for suspect in study.suspect.values
    ]
    page.tabulate(
        "knee_carried",
        ("suspect", "not fitted (K)", "fitted (K)", "off the ramp (K)", "what the fit takes up"),
        rows,
        nearest=nearest,
        count=found.numbers.drawn.sel(layout=study.layout).sum().item(),
    )
    by_law = [
        (DEPARTURES[str(law)].words, f"± {study.stderr_K.sel(law=law, layout=nearest):.1f}")
        for law in study.law.values
    ]
    total = np.sqrt((study.stderr_K.sel(layout=nearest) ** 2).sum("law"))
    by_law.append(("all laws", f"± {total:.1f}"))
    page.tabulate("knee_laws", ("law", "may carry (K)"), by_law)
    alone = study.shift_K.sel(layout=nearest, suspect=study.suspect != Suspect.TOGETHER)
    few, film = (
        study.sel(suspect=name, layout=nearest) for name in (Suspect.FEW_CARRIERS, Suspect.SURFACES)
    )
    page.say(
        "knee_carried",
        most=alone.max(),
        most_of=alone.idxmax("suspect").item(),
        raman=alone.sel(suspect=Suspect.RAMAN),
        film=film,
        film_ramp=_range(study.ramp_K.sel(suspect=Suspect.SURFACES)),
        few=few,
        few_n_d=paper.PUBLISHED_VALUES["option III"]["n_d"] ** 2 / few.n_d,
        together=study.shift_K.sel(suspect=Suspect.TOGETHER, layout=nearest),
        total=total,
    )
    if not page.quick:
        _in_air(page)


def next_section(page: Findings) -> None:
    """What to measure next of the nearest layout, for its knee."""
    probe = stored_layouts()[stored_ensemble().nearest].probe()
    study = what_to_measure(probe)
    rows = []
    for added in study.added.values:
        cells = []
        for one in (study.sel(added=added, data=data) for data in study.data.values):
            which = f", {one.what.item()}" if one.what else ""
            cells.append(f"± {one.stderr_K:.1f} K{which}")
        rows.append((str(added), *cells))
    page.tabulate("knee_next", ("measured next", *study.data.values), rows)
    (without, together), (spectrum, _), (finer, _), (drawing, _) = study.stderr_K.values
    page.say(
        "knee_next",
        rows=len(paper.RAMP),
        iv=without,
        everything=together,
        scale=THERMOMETER * (paper.KNEE_PREDICTED_K - probe.circuit.base_temperature_K),
        spectrum=spectrum,
        at=study.what.values[1, 0],
        finer=finer,
        drawing=drawing,
        sigmas=paper.KNEE_OFF_K / together,
    )


def _of_the_ramp(found: Ensemble) -> dict[str, Any]:
    """Return what a row of the ramp is worth at the knee."""
    drawn = found.numbers.where(found.numbers.drawn, drop=True)
    # the smaller of the two errors of the current that move the highest V_l to a neighbour
    least = np.minimum(drawn.ramp_up_current, drawn.ramp_down_current)
    step = np.where(
        drawn.ramp_up_current < drawn.ramp_down_current, drawn.ramp_up_K, -drawn.ramp_down_K
    )
    rows = np.concatenate([drawn.ramp_up_K.values, -drawn.ramp_down_K.values])
    return {
        "low": rows.min(),
        "high": rows.max(),
        "least": np.min(least),
        "median": np.median(least),
        "most": np.max(least),
        "step": np.median(step),
        "noise": found.numbers.noise_III.sel(layout=found.nearest),
        "off": (drawn.ramp_row_K - drawn.knee_K).min(),
        "above": (drawn.ramp_row_K - drawn.knee_K).max(),
    }


def _of(values: xr.DataArray, nearest: str) -> str:
    """Return the value of the nearest layout, and the range over those that were computed.

    The range only where its ends differ, to a kelvin.
    """
    ends = dict.fromkeys(f"{end:+z.0f}" for end in _range(values))
    over = f" ({' to '.join(ends)})" if len(ends) > 1 else ""
    return f"{values.sel(layout=nearest).item():+z.1f}{over}"


def _range(values: xr.DataArray) -> tuple[float, float]:
    return values.min().item(), values.max().item()


def _parameters(fitted: xr.Dataset) -> str:
    """Return by how much the fitted parameters differ, in printed standard errors beyond one."""
    own, errors = paper.PUBLISHED_VALUES["option III"], paper.STANDARD_ERRORS["option III"]
    off = {name: (fitted[name].item() - own[name]) / errors[name] for name in PARAMETERS}
    some = [
        f"{PARAMETERS[name].symbol} {value:+.1f}" for name, value in off.items() if abs(value) > 1.0
    ]
    return ", ".join(some) or "–"


def _in_air(page: Findings) -> None:
    """What each suspect carries of the reference probe's knee in air."""
    probe = page.lever.probe.in_medium("air")
    study = compare_suspects(
        probe,
        page.fitted_example,
        (Suspect.RAMAN, Suspect.SURFACES, Suspect.IN_AIR, Suspect.TOGETHER),
    )
    rows = [
        (str(suspect), *(f"{value.item():+z.1f}" for value in both.values()))
        for suspect in study.suspect.values
        for both in [study[["moved_K", "shift_K"]].sel(suspect=suspect)]
    ]
    rows.append(("what remains", "", f"{study.left_K:.0f} ± {study.stderr_K:.0f}"))
    page.tabulate("knee_in_air", ("suspect, in air", "not fitted (K)", "fitted (K)"), rows)
    carried_K = study.shift_K.sel(suspect=Suspect.IN_AIR).item()
    page.judge("tip_in_air", carried_K, carried=carried_K)
