"""Pages of fits have words, tables and figures."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.fitting import Measurement, fit
from hotlever.fitting.models import full_model
from hotlever.fitting.uncertainty import examine
from hotlever.report.fit_pages import fit_page


@pytest.fixture(scope="module")
def result(lever):
    data = Measurement.of_sweep(lever.sweep([2.0, 5.0, 7.0, 8.0, 9.0, 11.0]))
    data.tip_K[:] += np.random.default_rng(0).normal(0.0, 3.0, data.tip_K.size)
    held = dict.fromkeys(("delta", "n_d", "a0", "a1"))
    return fit(data, fixed=held, model=lambda probe, bias: full_model(lever, bias))


def test_a_fit_s_page_tells_what_was_found_and_how_sure_it_is(result):
    found = examine(result, profiles=True, processes=1)
    page = fit_page(result, found)
    kinds = [block["kind"] for block in page.blocks]
    assert kinds.count("figure") == 6
    assert page.blocks[0]["rows"][0][0] == "c_kappa"
    assert "How sure" in [block.get("text") for block in page.blocks]
    assert page.blocks[-1]["name"] == "profiles"
