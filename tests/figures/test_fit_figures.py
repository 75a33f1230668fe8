"""The figures of a fit's uncertainty, from made-up datasets."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from hotlever.figures import (
    lever_parameters,
    posterior_corner,
    profile_curves,
    save_figure,
    tip_band,
)
from made_up import levers


def test_corner_has_units_on_its_axes(tmp_path):
    rng = np.random.default_rng(0)
    data = {
        name: ("draw", scale * rng.normal(5, 1, size=800))
        for name, scale in (("c_kappa", 1.0), ("n_d", 1e17), ("inversion_temperature", 100.0))
    }
    figure = posterior_corner(xr.Dataset(data, coords={"quantity": list(data)}))
    labels = {axes.get_xlabel() for axes in figure.axes} - {""}
    assert labels == {"c$_{κ}$", "n$_{d}$ (10$^{17}$ cm⁻³)", "T$_i$ (K)"}
    assert len(figure.axes) == 6
    save_figure(figure, tmp_path / "corner.png")


def test_profile_is_drawn_beside_its_parabola(tmp_path):
    value = np.linspace(0.6, 0.7, 5)
    parabola = ((value - 0.65) / 0.02) ** 2
    profile = xr.Dataset(
        {"delta_chi_square": ("point", parabola), "parabola": ("point", parabola)},
        coords={"value": ("point", value), "level": [0.68, 0.95]},
        attrs={"quantity": "c_kappa", "optimum": 0.65},
    )
    figure = profile_curves([profile])
    dashed, curve = figure.axes[0].lines[:2]
    np.testing.assert_allclose(curve.get_ydata(), dashed.get_ydata(), atol=1e-9)
    save_figure(figure, tmp_path / "profile.png")


def test_band_shows_bias_and_power(tmp_path):
    x = np.linspace(0, 10, 20)
    tip = 300 + 50 * x + np.array([-2, -1, 0, 1, 2])[:, None] * x
    figure = tip_band(
        xr.Dataset(
            {
                "tip_K": (("quantile", "bias"), tip),
                "tip_at_power_K": (("quantile", "power_mW"), tip),
            },
            coords={"quantile": range(5), "bias": x, "power_mW": x},
        )
    )
    assert figure.axes[2].get_xlabel() == "bias V$_b$ (V)"
    assert figure.axes[3].get_xlabel() == "power P$_l$ (mW)"
    widest = max(
        collection.get_datalim(figure.axes[2].transData).y1
        for collection in figure.axes[2].collections
    )
    assert widest == pytest.approx(20.0)
    save_figure(figure, tmp_path / "band.png")


@pytest.mark.parametrize(("count", "held", "panels"), [(4, (), 7), (200, ("n_d", "p"), 5)])
def test_figure_has_a_panel_for_each_free_quantity(tmp_path, count, held, panels):
    figure = lever_parameters(levers(count, held))
    assert len(figure.axes) == panels
    assert all(axes.get_ylabel() for axes in figure.axes)
    last = figure.axes[-1]
    names = [label.get_text() for label in last.get_xticklabels()]
    assert "lever-0" in names if count < 20 else last.get_xlabel() == "lever"
    save_figure(figure, tmp_path / "levers.png")
