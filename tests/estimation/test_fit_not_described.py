"""Fits whose data no such lever shows, or whose search did not converge: no errors are stated."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hotlever import figures
from hotlever.errors import InputError
from hotlever.estimate import Estimate, fit, read_fit
from hotlever.estimate.estimator import undetermined
from hotlever.estimate.sampling import sample_posterior
from hotlever.estimate.summary import NEAREST, fit_text, parameter_rows
from hotlever.estimate.uncertainty import profile_likelihood
from hotlever.report.result_pages import fit_page

EXAMPLE = Path(__file__).parents[2] / "src" / "hotlever" / "examples" / "lever-a.csv"
FIXED = {"a1": None, "p": None, "delta": None, "a0": None}


@pytest.fixture(scope="module")
def good() -> Estimate:
    """A fit that describes its data, with priors."""
    return fit(EXAMPLE, fixed=FIXED, observables=["current"], priors={"n_d": "4.6e17 ± 30%"})


@pytest.fixture(scope="module")
def refused(good: Estimate) -> Estimate:
    return replace(good, reason="current differs by 3%")


def nothing(values: Any) -> bool:
    return bool(np.isnan(np.array(values, dtype=float)).all())


def test_a_fit_that_describes_its_data_has_errors(good):
    assert good.describes_data is True
    assert good.parameters["n_d"].stderr > 0
    assert good.inversion_temperature_stderr_K > 0
    assert good.priors["n_d"].posterior_spread > 0


def test_nothing_has_an_error(refused, good, tmp_path):
    assert refused.parameters["n_d"].value == good.parameters["n_d"].value
    for written in (refused, _again(refused, tmp_path)):
        assert written.describes_data is False
        assert {one.stderr for one in written.parameters.values()} == {None}
        assert nothing(written.inversion_temperature_stderr_K)
        assert nothing(written.band.tip_stderr_K)
        assert np.isfinite(written.band.tip_K).all()
        assert nothing([use.posterior_spread for use in written.priors.values()])
    content = json.loads((tmp_path / "fit.json").read_text())
    assert content["inversion_temperature_stderr_K"] is None
    assert set(content["band"]["tip_stderr_K"]) == {None}
    assert content["describes_data"] is False


def test_words_say_whose_the_numbers_are(refused):
    first, second, *lines = fit_text(refused).splitlines()
    assert first == "no such lever shows these data: current differs by 3%"
    assert second == NEAREST
    assert not any("(" in line.partition("cm⁻³")[0] for line in lines if line.startswith("n_d"))
    rows = {name: (value, remark) for name, value, _, remark in parameter_rows(refused)}
    assert rows["n_d"][1] == "no error"
    assert "(" not in rows["n_d"][0]
    assert rows["p"][1] == "fixed"
    assert not any("error" in text for text in undetermined(refused))


def test_no_band_is_drawn_and_the_figure_says_so(refused, good):
    with_band, without = (figures.tip_band(one.band) for one in (good, refused))
    assert len(with_band.axes) == 2 * len(without.axes)
    assert with_band.axes[0].collections
    assert not any(axes.collections for axes in without.axes)
    lever = "three-leg lever in vacuum"
    assert without.get_suptitle().startswith(f"{lever}; the data are not described")
    assert with_band.get_suptitle() == lever


def test_the_page_has_no_errors(refused):
    page = fit_page(refused)
    texts = [block["text"] for block in page.blocks if block["kind"] == "text"]
    assert texts[0].startswith("No such lever shows these data: current differs by 3%")
    table = next(block for block in page.blocks if block["kind"] == "table")
    assert table["caption"] == "Material parameters of the nearest lever."
    captions = [block["caption"] for block in page.blocks if block["kind"] == "figure"]
    assert not any("band" in caption or "Correlation" in caption for caption in captions)


def test_how_sure_it_is_cannot_be_asked(refused):
    for ask in (sample_posterior, lambda one: profile_likelihood(one, "n_d")):
        with pytest.raises(InputError, match="expected data that a lever describes; no such"):
            ask(refused)


def _again(found: Estimate, folder: Path) -> Estimate:
    found.write(folder / "fit.json")
    return read_fit(folder / "fit.json")
