"""Pages have words, tables and figures."""

from __future__ import annotations

import numpy as np
import pytest

import made_up
from experiments import full_experiment
from hotlever.estimate import Measurement, fit
from hotlever.estimate.uncertainty import examine
from hotlever.report.reproduce import paper_sections as inference
from hotlever.report.reproduce.findings import Findings
from hotlever.report.result_pages import fit_page
from hotlever.studies.simulation_based_calibration import WAYS

# a profile makes its own lever
pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.fixture(scope="module")
def result(coarse):
    data = Measurement.of_sweep(coarse.sweep([2.0, 5.0, 7.0, 8.0, 9.0, 11.0]))
    data.tip_K[:] += np.random.default_rng(0).normal(0.0, 3.0, data.tip_K.size)
    held = dict.fromkeys(("delta", "n_d", "a0", "a1"))
    return fit(data, fixed=held, model=lambda probe, bias: full_experiment(coarse, bias))


def test_a_fit_s_page_tells_what_was_found_and_how_sure_it_is(result):
    found = examine(result, profiles=True, processes=1)
    page = fit_page(result, found)
    kinds = [block["kind"] for block in page.blocks]
    assert kinds.count("figure") == 6
    assert page.blocks[0]["rows"][0][0] == "c_kappa"
    assert "How sure" in [block.get("text") for block in page.blocks]
    assert page.blocks[-1]["name"] == "profiles"


@pytest.fixture
def judged(monkeypatch):
    """Levers that need not be solved: each of the page's is one of those made up."""
    requests = []

    def judge(number, departures):
        other = "mobility" in departures
        requests.append((number, other))
        return made_up.judged_levers(other).isel(lever=number % 3).assign_coords(lever=number)

    monkeypatch.setattr(inference, "judge", judge)
    return requests


@pytest.mark.parametrize(("quick", "count"), [(False, 12), (True, 2)])
def test_levers_never_seen_are_made_with_both_laws_and_counted(coarse, judged, quick, count):
    page = Findings(coarse, quick=quick)
    inference.levers_section(page)
    assert judged == [(n, law) for law in (False, True) for n in range(count)]
    why, same_law, other_law = (one["text"] for one in page.blocks if one["kind"] == "text")
    assert f"{count} levers" in why
    assert "With the mobility of Eq. 8" in same_law
    assert "With the other law" in other_law
    [table] = [one for one in page.blocks if one["kind"] == "table"]
    assert [row[0] for row in table["rows"]] == list(WAYS)
    assert all(len(row) == len(table["columns"]) for row in table["rows"])


def test_the_page_says_when_the_stated_errors_do_not_hold(coarse, judged):
    page = Findings(coarse)
    inference.levers_section(page)
    # a third of the made-up levers is off by three stated errors
    assert "do not cover this departure" in page.blocks[1]["text"]
    assert "67% in its 95 % band" in page.blocks[1]["text"]
