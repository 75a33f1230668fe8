"""Tables of fits in words, from made-up fits and datasets."""

from __future__ import annotations

import re

import numpy as np
import xarray as xr

from hotlever.estimate.many import lever_rows, levers_text
from hotlever.estimate.uncertainty import Uncertainty
from made_up import levers


def test_table_has_units_and_ends_with_mean_and_scatter():
    columns, *rows = lever_rows(levers(3))
    assert columns == [
        "lever",
        "c_kappa",
        "delta (µm)",
        "n_d (1e17 cm⁻³)",
        "p",
        "a0 (1e-04 Ω cm)",
        "a1 (1e-06 Ω cm K⁻¹)",
        "T_i (K)",
    ]
    assert [row[0] for row in rows] == [
        "lever-0",
        "lever-1",
        "lever-2",
        "weighted mean",
        "scatter between levers",
        "scatter, relative",
        "Birge ratio",
    ]
    # three levers, each with an error of 0.05
    assert re.fullmatch(r"\d\.\d\d\(\d\d?\)", rows[3][3])
    assert float(rows[6][3]) > 0.1
    table = levers(3)
    text = levers_text(table).splitlines()
    assert set(text[4]) == {"-"}


def found() -> Uncertainty:
    profile = xr.Dataset(
        {
            "delta_chi_square": ("point", [4.0, 0.0, 1.0]),
            "parabola": ("point", [4.0, 0.0, 1.0]),
            "interval": (("level", "side"), [[4.0e17, 5.0e17], [3.0e17, np.nan]]),
        },
        coords={"value": ("point", [3e17, 4.5e17, 5e17]), "level": [0.68, 0.95]},
        attrs={"quantity": "n_d", "optimum": 4.5e17, "notes": "n_d: open on the upper side"},
    )
    return Uncertainty(None, None, None, {"n_d": profile})  # type: ignore[arg-type]


def test_intervals_are_in_the_unit_of_the_table_and_open_ones_are_said():
    first, second = found().text().splitlines()
    assert first.split() == [
        "profile",
        "likelihood",
        "68",
        "%",
        "from",
        "to",
        "95",
        "%",
        "from",
        "to",
    ]
    assert second.split() == ["n_d", "(1e17", "cm⁻³)", "4", "5", "3", "open"]
