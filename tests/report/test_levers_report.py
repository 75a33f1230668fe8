"""The table and figure of many levers, from made-up fits."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.fitting.levers import compare_levers
from hotlever.materials import PARAMETERS
from hotlever.report.levers_report import lever_parameters, lever_rows, levers_text
from hotlever.report.style import save_figure


def levers(count: int, held: tuple[str, ...] = ()):
    rng = np.random.default_rng(0)
    return compare_levers(
        {
            f"lever-{number}": {
                "parameters": {
                    name: {
                        "value": known.scale * (2 + 0.1 * rng.normal()),
                        "stderr": None if name in held else 0.05 * known.scale,
                    }
                    for name, known in PARAMETERS.items()
                },
                "inversion_temperature_K": 830.0 + 5 * rng.normal(),
                "inversion_temperature_stderr_K": 3.0,
            }
            for number in range(count)
        }
    )


def test_table_has_units_and_ends_with_mean_and_scatter():
    columns, rows = lever_rows(levers(3))
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
        "mean",
        "scatter between levers",
        "mean standard error",
        "scatter, relative",
    ]
    assert rows[5][1] == "0.05"
    assert rows[5][3] == "0.05"
    text = levers_text(levers(3)).splitlines()
    assert set(text[4]) == {"-"}


@pytest.mark.parametrize(("count", "held", "panels"), [(4, (), 7), (200, ("n_d", "p"), 5)])
def test_figure_has_a_panel_for_each_free_quantity(tmp_path, count, held, panels):
    made = lever_parameters(levers(count, held))
    assert len(made.axes) == panels
    assert all(axes.get_ylabel() for axes in made.axes)
    last = made.axes[-1]
    names = [label.get_text() for label in last.get_xticklabels()]
    assert "lever-0" in names if count < 20 else last.get_xlabel() == "lever"
    save_figure(made, tmp_path / "levers.png")
