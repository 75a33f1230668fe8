"""Figures are made of datasets, say what they show, and are written whole."""

from __future__ import annotations

from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import made_up
from hotlever import figures
from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.estimate import Measurement, read_calibration
from hotlever.estimate.many import compare_levers
from hotlever.figures import (
    lever_parameters,
    posterior_corner,
    profile_curves,
    save_figure,
    tip_band,
)
from hotlever.files import FIGURE_TYPES
from hotlever.lever import read_sweep, write_sweep
from hotlever.lever.fields import heater_profile, seen_from_above
from hotlever.lever.transient import pulse, simulate, spectrum, time_constants
from hotlever.probe import Probe
from hotlever.report.report_page import Page
from made_up import levers

pytestmark = pytest.mark.usefixtures("coarse_meshes")

STORED = Path(__file__).parents[1] / "stored" / "1.0.0"


@pytest.fixture(scope="module")
def figure_by_name(coarse):
    sweep = coarse.sweep(np.linspace(1, 11, 9))
    states = coarse.solve([7.2, 8.3])
    profiles = {
        name: heater_profile(state) for name, state in zip(("plateau", "knee"), states, strict=True)
    }
    layout = coarse.space.mesh.layout
    data = Measurement.of_sweep(sweep).dataset(coarse.circuit)
    data = data.assign(current_mA=1.01 * data.current_mA, tip_error_K=5.0 + 0 * data.tip_K)
    return {
        "probe": figures.probe_drawing(layout),
        "u_shape": figures.probe_drawing(Probe.u_shape().layout()),
        "overview": figures.sweep_overview(sweep),
        "iv": figures.iv_curves({"model": sweep}, {"model": coarse.knee()}, data),
        "temperature_power": figures.temperature_power(sweep, measured=data),
        "resistances": figures.resistances(sweep),
        "doping": figures.doping_profile(profiles["knee"]),
        "profiles": figures.heater_profiles(profiles),
        "maps": figures.field_maps(states[1]),
        "map": figures.temperature_map(states[1]),
        "fit": figures.data_and_model(data, sweep, ("current", "tip")),
        "correlation": figures.correlation_matrix(
            ["c_kappa", "p"], np.array([[1, -0.9], [-0.9, 1]])
        ),
        "band": figures.tip_band(sweep.assign(tip_stderr_K=0.01 * sweep.tip_K), data),
        "judged": figures.judged_calibrations(
            xr.concat([made_up.judged_levers(), made_up.judged_levers(True)], "lever")
        ),
    }


NAMES = ["probe", "u_shape", "overview", "iv", "temperature_power", "resistances"]
NAMES += ["doping", "profiles", "maps", "map", "fit", "correlation", "band", "judged"]


def texts(figure):
    return " ".join(text.get_text() for text in figure.findobj(lambda a: hasattr(a, "get_text")))


@pytest.mark.parametrize("name", NAMES)
def test_every_axis_carries_a_unit(figure_by_name, name):
    for axes in figure_by_name[name].axes:
        labels = [axes.get_xlabel(), axes.get_ylabel()]
        # the correlation matrix carries symbols instead
        assert any(labels) or (name == "correlation" and axes.get_xticklabels())
        for label in filter(None, labels):
            assert "(" in label, (name, label)


@pytest.mark.parametrize(("name", "suffix"), list(zip(NAMES, cycle(FIGURE_TYPES), strict=False)))
def test_figures_are_written_in_every_type(figure_by_name, name, suffix, tmp_path):
    path = tmp_path / f"{name}{suffix}"
    save_figure(figure_by_name[name], path)
    assert path.stat().st_size > 5000
    assert list(tmp_path.iterdir()) == [path]


def test_probe_drawing_marks_all_named_parts(figure_by_name):
    text = texts(figure_by_name["probe"])
    for word in ("supply", "ground", "reader", "heater", "tip", "high-doped"):
        assert word in text


def test_maps_name_probe_and_medium_and_mark_the_hottest_place(figure_by_name, coarse):
    for name in ("maps", "map"):
        assert "three-leg lever in vacuum, bias 8.3 V, tip at 899 K" in texts(figure_by_name[name])
    assert "hottest, 899 K" in texts(figure_by_name["map"])


def test_each_frame_of_a_film_is_its_state(coarse):
    states = []
    history = simulate(
        coarse, pulse(8.0, 1.0), at=[0.5, 2.0], callback=lambda t, state: states.append((t, state))
    )
    film = figures.pulse_film(history, states)
    surface = seen_from_above(coarse, 1)
    for frame, (t, state) in enumerate(states):
        image, now, at = film._func(frame)
        assert_allclose(image.get_array(), surface.sampling @ state.nodal[0], rtol=1e-6)
        assert_allclose(now.get_xydata(), [[t, history.tip_K.values[frame]]], rtol=1e-5)
        assert at.get_text().startswith(f"{t:g} µs: bias ")
    film._draw_was_started = True  # or matplotlib warns that nobody saw it
    with pytest.raises(InputError, match="no states"):
        figures.pulse_film(history, [])


def test_iv_curve_names_the_knee(figure_by_name):
    assert "knee" in texts(figure_by_name["iv"])


def test_every_dataset_draws_itself(figure_by_name, coarse, tmp_path):
    sweep = coarse.sweep([2.0, 8.0])
    write_sweep(sweep, tmp_path / "a.nc")
    (state,) = coarse.solve([4.0])
    history = simulate(coarse, pulse(8.0, 1.0), at=[0.5, 1.0, 2.0])
    lever = "three-leg lever in vacuum"
    for data, panels, title in (
        (read_sweep(tmp_path / "a.nc"), 4, lever),
        (history, 4, f"{lever}; pulse of 8 V for 1 µs"),
        (spectrum(state, [10.0, 1e5]), 4, f"{lever}; bias 4 V"),
        (heater_profile(state), 2, lever),
        (time_constants(coarse, [4.0, 8.0]), 2, lever),
        (Measurement.of_sweep(sweep).dataset(coarse.circuit), 6, None),
    ):
        figure = data.hotlever.plot()
        assert len(figure.axes) == panels
        assert title in (figure.get_suptitle() or None, None)
        for axes in figure.axes:
            assert all("(" in label for label in filter(None, [axes.get_ylabel()]))
    with pytest.raises(InputError, match="without curves"):
        labelled({"k": ((), 1.0)}).hotlever.plot()


def test_unknown_figure_types_are_refused(figure_by_name, tmp_path):
    with pytest.raises(InputError, match=r"unknown figure type '.bmp'"):
        save_figure(figure_by_name["iv"], tmp_path / "a.bmp")
    with pytest.raises(InputError, match="does not exist"):
        save_figure(figure_by_name["iv"], tmp_path / "no" / "a.png")


def test_page_is_self_contained(figure_by_name, tmp_path):
    page = Page("Title", "Summary & more")
    page.heading("Section")
    page.text("1 < 2")
    page.table(("a", "b"), [("1", "2")], "caption")
    page.figure("iv", figure_by_name["iv"], "what it shows")
    written = page.write(tmp_path / "new" / "folder")
    html = written.read_text(encoding="utf-8")
    assert "1 &lt; 2" in html
    assert "data:image/png;base64," in html
    assert "http" not in html
    assert (written.parent / "iv.pdf").exists()


def test_every_source_of_an_error_is_drawn_however_many_there_are():
    calibration = read_calibration(STORED / "calibration.json")
    table = calibration.tip_table
    own = table.budgets["budget_K"]
    many = {**own, **{f"other {name}": part for name, part in own.items()}}
    more = replace(table, budgets={"budget_K": many})
    figure = figures.calibration_curves(replace(calibration, tabulated=more))
    lines = figure.axes[-1].get_lines()
    assert [line.get_label() for line in lines] == [*many, "together"]
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == len(lines) > 10


def test_a_lever_alone_is_drawn_as_different_from_no_mean():
    """Beyond the range of all others it was said to be as the mean is."""
    whole = read_calibration(STORED / "calibration.json")
    rows = whole.tip_table["bias_V"] < 6.0
    calibrations = {"whole": whole, "part": replace(whole, tabulated=whole.tip_table.rows(rows))}
    figure = figures.calibrated_levers(calibrations, compare_levers(calibrations))
    difference = figure.axes[1].get_lines()[0]
    finite = np.isfinite(difference.get_ydata())
    assert finite.any()
    assert difference.get_xdata()[finite].max() < 6.0 < difference.get_xdata().max()


def test_every_sweep_is_drawn_however_many_there_are(coarse):
    sweep = coarse.sweep([1.0, 2.0])
    (axes,) = figures.iv_curves({f"lever {number}": sweep for number in range(9)}).axes
    assert len(axes.get_lines()) == 9


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


def test_what_other_supplies_heat_is_drawn_whole(coarse):
    """Powers below zero were beyond the axis, and legs without a resistance in the legend."""
    sweep = coarse.sweep([1.0, 2.0, 3.0])
    held = sweep.assign(power_mW=sweep.power_mW - 0.1, legs_ohm=np.nan * sweep.legs_ohm)
    assert figures.temperature_power(held).axes[1].get_xlim()[0] < float(held.power_mW.min()) < 0
    assert "legs" not in texts(figures.resistances(held))
    assert "legs" in texts(figures.resistances(sweep))


def test_a_figure_says_of_how_many_curves_it_shows_some():
    x = np.arange(20.0)
    values = np.add.outer(np.arange(9.0), x)
    many = labelled({"tip_K": (("state", "bias"), values)}, coordinates={"bias": x})
    assert "8 of 9 curves" in texts(many.hotlever.plot())
    assert " of 8" not in texts(many.isel(state=slice(8)).hotlever.plot())


def test_a_sensitivity_that_turns_is_not_joined_through_its_zero():
    """On axes by decades it was drawn as finite where the voltage does not tell the distance."""
    slope = np.array([[0.7, -0.09, -0.05]]).T
    one = ("distance", "bias")
    data = xr.Dataset(
        {
            "reader_V": (one, 4.0 + slope),
            "dlnR_dz_per_um": (one, slope),
            "noise_V_per_rtHz": (one, 1e-8 + 0 * slope),
            "resolution_nm_per_rtHz": (one, 1e-5 / np.abs(slope)),
            "source_V_per_rtHz": (("source", *one), 1e-8 + 0 * slope[None]),
            "surface_gap_um": ("distance", [0.3, 1.6, 3.0]),
        },
        coords={"distance": [0.3, 1.6, 3.0], "bias": [12.0], "source": ["amplifier"]},
        attrs={"read_at": "supply"},
    )
    data = data.assign_coords(bias_V=("bias", [12.0]))
    _, sensitivity, _, resolution = figures.reader_overview(data).axes
    for axes in (sensitivity, resolution):
        (drawn,) = axes.get_lines()
        assert_allclose(np.isnan(drawn.get_ydata()), [False, True, False, False])


def test_errors_of_few_temperatures_are_an_area(coarse):
    """Where every other row had one they were lines that nobody saw."""
    sweep = coarse.sweep([2.0, 4.0, 6.0, 8.0])
    tip = sweep.tip_K.where(sweep.bias % 4 == 0)
    data = sweep.assign(tip_K=tip, tip_error_K=5.0 + 0.0 * tip)
    figure = figures.data_and_model(data, sweep, ("tip",))
    lower = next(axes for axes in figure.axes if axes.get_ylabel() == "data − model (K)")
    (path,) = lower.collections[0].get_paths()
    assert path.get_extents().bounds == (4.0, -5.0, 4.0, 10.0)


def test_no_band_is_drawn_where_no_error_is_stated():
    """It had no width there, as of what is known exactly."""
    x = np.linspace(1.0, 6.0, 6)
    stderr = np.array([1.0, 2.0, np.nan, np.nan, 3.0, 4.0])
    band = labelled(
        {"power_mW": x, "tip_K": 300.0 + x, "tip_stderr_K": stderr}, "bias", {"bias": x}
    )
    figure = tip_band(band)
    upper, _, lower, _ = figure.axes
    # at a power errors are others
    assert "95 % at a bias" in texts(figure)
    assert_allclose(upper.get_lines()[0].get_ydata(), 300.0 + x)
    drawn = np.concatenate([path.vertices[:, 0] for path in lower.collections[0].get_paths()])
    assert set(drawn) == {1.0, 2.0, 5.0, 6.0}


@pytest.mark.parametrize(("count", "held", "panels"), [(4, (), 7), (200, ("n_d", "p"), 5)])
def test_figure_has_a_panel_for_each_free_quantity(tmp_path, count, held, panels):
    figure = lever_parameters(levers(count, held))
    assert len(figure.axes) == panels
    assert all(axes.get_ylabel() for axes in figure.axes)
    last = figure.axes[-1]
    names = [label.get_text() for label in last.get_xticklabels()]
    assert "lever-0" in names if count < 20 else last.get_xlabel() == "lever"
    save_figure(figure, tmp_path / "levers.png")
