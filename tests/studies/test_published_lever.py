"""The paper's lever from all that is printed: readings, stored layouts, weights and verdicts."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from hotlever.datasets import labelled
from hotlever.lever.lever import COARSE
from hotlever.quantities import THERMOMETER
from hotlever.studies.knee_study import Suspect, carried, knee_K, what_to_measure
from hotlever.studies.published_lever.ensemble import (
    ANY,
    CRITERIA,
    REFERENCE,
    SIZES,
    WEIGHED,
    Ensemble,
    stored_ensemble,
    stored_layouts,
    verdict_on,
)
from hotlever.studies.published_lever.statements import MAIN, OPTIONS, SEARCHED
from published_lever import DRAWN, SearchOptions, Solver, numbers_of, search

#: Dimensions of which derivatives are compared with differences, and the resistor.
SOME = ("heater_width_um", "gap_um", "thickness_um", "series_resistance_ohm")


@pytest.fixture(scope="module")
def solver():
    reference = stored_layouts()[REFERENCE]
    return Solver(reference.length_um, COARSE), dict(reference.values)


def test_readings_have_the_derivatives_of_differences(solver, monkeypatch):
    solve, values = solver
    monkeypatch.setattr("published_lever.OPTIONS", {MAIN: OPTIONS[MAIN]})
    here = solve.readings(values)[MAIN]
    reads = {
        "tip": lambda one: one.at_tip([500.0, 893.0, 1100.0]),
        "bias": lambda one: one.at_bias([3.0, 7.0, 10.5]),
        "power": lambda one: one.at_power([1.0, 2.8, 3.9]),
        "knee": lambda one: one.knee_K(),
        "point": lambda one: one.off_point((1.9, 0.95), (0.005, 0.005)),
    }
    for name in SOME:
        step, column = 1e-3 * values[name], list(DRAWN).index(name)
        up, down = (
            solve.readings({**values, name: values[name] + way * step})[MAIN] for way in (1, -1)
        )
        for key, read in reads.items():
            value, slopes = (np.asarray(each) for each in read(here))
            change = (np.asarray(read(up)[0]) - np.asarray(read(down)[0])) / (2.0 * step)
            near = 0.1 if key == "knee" else 0.02
            # voltages, currents and temperatures, each beside its largest
            scale = np.abs(np.atleast_1d(value)).max(axis=-1, keepdims=True) / values[name]
            off = np.abs(slopes[..., column] - change)
            assert (off <= near * np.abs(change) + 1e-3 * scale).all(), (name, key)


def test_a_curve_passes_a_point_of_its_own_and_misses_one_beside_it(solver):
    solve, values = solver
    reading = solve.readings(values)[MAIN]
    (lever_V,), (current,), *_ = reading.at_tip(700.0)[0]
    unit = (0.005, 0.005)
    assert reading.off_point((lever_V, current), unit)[0] == pytest.approx(0.0, abs=1e-6)
    off, _ = reading.off_point((lever_V, current + 0.005), unit)
    assert 0.0 < abs(off) <= 1.0


def test_printed_digits_are_those_of_the_reference_within_some_units(solver):
    solve, values = solver
    readings = solve.readings(values)
    stored = stored_ensemble().deviations.sel(layout=REFERENCE)
    for printed in SEARCHED:
        off, slopes = printed.deviation(readings)
        assert slopes.shape == (off.size, len(DRAWN))
        # a coarse mesh is off by a part of a digit
        assert np.abs(off).max() == pytest.approx(
            stored.sel(statement=printed.name).item(), abs=0.6
        )


@pytest.mark.slow
def test_a_search_from_far_away_finds_what_was_stored():
    best = stored_layouts()["best of 54 µm"]
    found = search(best.length_um, options=SearchOptions(most=(12, 2)))
    assert found.square == pytest.approx(best.square, rel=0.05)
    assert found.values == pytest.approx(best.values, rel=0.03)


@pytest.mark.slow
def test_what_is_stored_of_a_layout_is_what_is_computed():
    name = stored_ensemble().nearest
    found = numbers_of(stored_layouts()[name])
    stored = stored_ensemble().numbers.sel(layout=name)
    for key, value in found.items():
        if key in stored:
            assert value == pytest.approx(stored[key].item(), rel=0.02, abs=0.02), key


def test_layouts_scatter_over_both_priors_of_the_size_and_weigh_one_together():
    found = stored_ensemble()
    assert 12 <= int(found.numbers.drawn.sum()) <= 30
    assert found.weights.sum("layout").values == pytest.approx(np.ones(len(SIZES)))
    assert (found.weights.where(~found.numbers.drawn, 0.0) == 0.0).all()
    large = found.numbers.length_um > 60.0
    assert large.any()
    _, small = SIZES
    assert (found.weights.sel(size=small).where(large, 0.0) == 0.0).all()
    assert found.weights.sel(size=ANY).where(large, 0.0).sum() > 0.0


def test_the_nearest_layout_meets_more_than_the_reference():
    found = stored_ensemble()
    assert found.met(found.nearest) > found.met(REFERENCE)
    assert set(WEIGHED) < set(found.deviations.statement.values)
    assert set(OPTIONS) == {"III", "I", "II", "n_d held"}


def made_up(values: list[float], column: str) -> Ensemble:
    """Return an ensemble of equal weights whose layouts have some values."""
    names = [f"{number} µm" for number in range(len(values))]
    numbers = labelled({column: values, "drawn": [True] * len(values)}, "layout", {"layout": names})
    weights = xr.DataArray(
        np.full((len(SIZES), len(values)), 1.0 / len(values)),
        coords={"size": list(SIZES), "layout": names},
        dims=("size", "layout"),
    )
    return Ensemble(numbers, xr.DataArray(), weights)


@pytest.mark.parametrize(
    ("values", "words", "over"),
    [
        ([10.0, 20.0], "holds", "10 to 20 K"),
        ([10.0, 40.0], "holds for some layouts (50% of the weight)", "10 to 40 K"),
        ([30.0, 40.0], "does not hold", "30 to 40 K"),
    ],
)
def test_verdicts_go_by_the_weight_of_layouts(values, words, over):
    verdict = verdict_on("power_law", made_up(values, CRITERIA["power_law"].column))
    assert verdict == (words, over)


@pytest.mark.parametrize("name", CRITERIA)
def test_every_claim_has_a_number_of_every_layout(name):
    assert np.isfinite(stored_ensemble().numbers[CRITERIA[name].column]).all()
    assert all(verdict_on(name))


def test_suspects_of_the_knee_are_told_of_every_layout_that_has_a_weight():
    found, study = stored_ensemble(), carried()
    drawn = found.numbers.layout[found.numbers.drawn.values]
    assert {*drawn.values, found.nearest, REFERENCE} == {*study.layout.values}
    assert {*study.suspect.values} == {*Suspect} - {Suspect.IN_AIR}
    assert np.isfinite(study[["moved_K", "shift_K", "ramp_K"]].to_dataarray()).all()
    assert (study.stderr_K.sel(layout=found.nearest) > 0.0).all()


@pytest.mark.slow
def test_a_spectrum_tells_more_of_the_knee_than_a_finer_sweep_where_there_is_none():
    study = what_to_measure(stored_layouts()[stored_ensemble().nearest].probe())
    (nothing, _), (spectrum, _), (finer, _), (drawing, _) = study.stderr_K.values
    assert spectrum < 0.6 * nothing
    assert spectrum < 0.7 * finer
    assert finer < nothing
    assert drawing == pytest.approx(nothing, rel=0.05)
    together = study.stderr_K.isel(data=1).values
    # all of the ramp's temperatures have an error in common
    common = THERMOMETER * (knee_K(stored_layouts()[stored_ensemble().nearest].probe()) - 293.0)
    assert (together[:2] > common).all()
    assert (together < 0.6 * nothing).all()
