"""The figures of a lever, one function each, from datasets; nothing is solved here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.tri import Triangulation

from hotlever.calibration.power_law import EQ12, PowerLaw
from hotlever.fitting.measurement import Measurement
from hotlever.lever.fields import FieldMap
from hotlever.materials import PARAMETERS
from hotlever.probe import Layout
from hotlever.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    ORANGE,
    SKY,
    VERMILION,
    figure,
    panel_letter,
)


def _marker(sweep: xr.Dataset, marker: str = "o") -> str:
    """Mark the points of a sweep, unless they are so many that they hide the line."""
    return marker if sweep.sizes["bias"] <= 40 else ""


def probe_drawing(layout: Layout, title: str = "") -> Figure:
    """Draw a probe from above, with heater, reader, terminals and tip marked."""
    low_doped = {"heater": (VERMILION, "heater (low-doped)"), "reader": (SKY, "reader (low-doped)")}
    with figure(7.0, 3.4) as made:
        axes = made.add_subplot()
        handles: dict[str, Patch | Line2D] = {}
        for region in layout.regions:
            colour, label = "0.82", "high-doped silicon"
            if region.taper is not None:
                colour, label = low_doped["heater" if region.part == "heater" else "reader"]
            axes.add_patch(Polygon(region.outline, facecolor=colour, edgecolor="0.55", lw=0.6))
            handles.setdefault(label, Patch(facecolor=colour, edgecolor="0.55", label=label))
        for terminal in layout.terminals:
            (x0, y0), (x1, y1) = terminal.start, terminal.end
            axes.plot([x0, x1], [y0, y1], color=BLUE, lw=4, solid_capstyle="butt")
            axes.annotate(
                terminal.name,
                ((x0 + x1) / 2, (y0 + y1) / 2),
                xytext=(-8, 0),
                textcoords="offset points",
                ha="right",
                va="center",
                color=BLUE,
            )
        handles["terminal"] = Line2D([], [], color=BLUE, lw=4, label="terminal (base temperature)")
        (tip,) = axes.plot(*layout.tip, marker="^", color=BLACK, ls="none", label="tip")
        handles["tip"] = tip
        corners = np.array([point for region in layout.regions for point in region.outline])
        (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
        margin = 0.04 * (right - left)
        axes.set(
            xlim=(left - 5 * margin, right + margin),
            ylim=(low - margin, high + margin),
            aspect="equal",
            xlabel="x (µm)",
            ylabel="y (µm)",
            title=title,
        )
        made.legend(handles=list(handles.values()), loc="outside lower center", ncols=3)
    return made


def field_maps(fields: FieldMap, layout: Layout, title: str = "") -> Figure:
    """Draw temperature, potential and current density, whole lever and magnified heater."""
    mesh = Triangulation(fields.points[:, 0], fields.points[:, 1], fields.triangles)
    density = np.linalg.norm(fields.current_density, axis=1)
    strong = max(density.max(), 1e-9)
    density = np.maximum(density, strong * 1e-3)
    maps = (
        ("temperature (K)", fields.temperature, "inferno", None),
        ("potential (V)", fields.potential, "viridis", None),
        (
            "current density (mA/µm²)",
            density,
            "cividis",
            LogNorm(strong * 1e-3, strong),
        ),
    )
    heater = np.array(layout.heater.outline)
    size = np.ptp(heater, axis=0).max()
    centre = (heater.min(axis=0) + heater.max(axis=0)) / 2
    with figure(7.0, 6.8) as made:
        grid = made.subplots(3, 2, width_ratios=(1.75, 1.0))
        for row, (label, values, colours, norm) in zip(grid, maps, strict=True):
            for axes in row:
                image = axes.tripcolor(
                    mesh,
                    values,
                    cmap=colours,
                    norm=norm,
                    shading="gouraud" if values.size == len(fields.points) else "flat",
                    rasterized=True,
                )
                for region in layout.regions:
                    axes.add_patch(Polygon(region.outline, fill=False, edgecolor="0.45", lw=0.4))
                axes.plot(*layout.tip, marker="^", mfc="white", mec="black", ms=4)
                axes.set(aspect="equal", ylabel="y (µm)", xlabel="x (µm)")
                axes.grid(False)
            row[1].set(
                xlim=centre[0] + np.array([-0.85, 0.85]) * size,
                ylim=centre[1] + np.array([-0.65, 0.65]) * size,
            )
            made.colorbar(image, ax=row[1], label=label, extend="min" if norm else "neither")
        grid[0, 0].set_title(title)
        grid[0, 1].set_title("heater, magnified")
    return made


def sweep_overview(sweep: xr.Dataset) -> Figure:
    """Draw what a sweep gives against the bias: current, voltages, tip temperature, I-V."""
    with figure(7.4, 5.2) as made:
        grid = made.subplots(2, 2)
        current, voltage, tip, iv = grid.ravel()
        current.plot(sweep.bias_V, sweep.current_mA, "o-", color=BLUE)
        current.set(ylabel="heater current I$_h$ (mA)")
        voltage.plot(sweep.bias_V, sweep.lever_V, "o-", color=BLUE, label="lever V$_l$")
        if sweep.reader_V.notnull().any():
            voltage.plot(sweep.bias_V, sweep.reader_V, "s-", color=GREEN, label="reader V$_r$")
        voltage.set(ylabel="voltage (V)")
        voltage.legend()
        tip.plot(sweep.bias_V, sweep.tip_K, "o-", color=VERMILION)
        tip.set(ylabel="tip temperature (K)")
        iv.plot(sweep.lever_V, sweep.current_mA, "o-", color=BLUE)
        iv.set(xlabel="lever voltage V$_l$ (V)", ylabel="heater current I$_h$ (mA)")
        for axes in (current, voltage, tip):
            axes.set(xlabel="bias V$_b$ (V)")
        for axes, letter in zip(grid.ravel(), "abcd", strict=True):
            panel_letter(axes, letter)
    return made


def iv_curve(
    sweep: xr.Dataset,
    knee: xr.Dataset | None = None,
    measurement: Measurement | None = None,
    curve: xr.Dataset | None = None,
) -> Figure:
    """Draw heater current against lever voltage (paper's Fig. 6a), with the knee.

    Parameters
    ----------
    sweep : xarray.Dataset
        Drawn as points.
    knee : xarray.Dataset, optional
        The one state returned by `Lever.knee`.
    measurement : Measurement, optional
    curve : xarray.Dataset, optional
        A denser sweep, drawn as the line; `sweep` itself by default.
    """
    line = sweep if curve is None else curve
    with figure(4.2, 3.4) as made:
        axes = made.add_subplot()
        axes.plot(line.lever_V, line.current_mA, color=BLUE, lw=1.2)
        axes.plot(sweep.lever_V, sweep.current_mA, "o", color=BLUE, label="model")
        if measurement is not None and measurement.series_resistance_ohm is not None:
            lever = (
                measurement.bias_V
                - measurement.series_resistance_ohm / 1000.0 * measurement.current_mA
            )
            axes.plot(lever, measurement.current_mA, "o", mfc="none", color=BLACK, label="measured")
        if knee is not None:
            at = (knee.lever_V.item(), knee.current_mA.item())
            axes.annotate(
                f"knee: {at[0]:.2f} V, {at[1]:.2f} mA\ntip {knee.tip_K.item():.0f} K",
                at,
                xytext=(-12, -34),
                textcoords="offset points",
                ha="right",
                arrowprops={"arrowstyle": "->", "color": VERMILION},
                color=VERMILION,
            )
        axes.set(
            xlabel="lever voltage V$_l$ (V)",
            ylabel="heater current I$_h$ (mA)",
            xlim=(0, None),
            ylim=(0, None),
        )
        axes.legend(loc="upper left")
    return made


def temperature_power(
    sweep: xr.Dataset,
    law: PowerLaw = EQ12,
    measurement: Measurement | None = None,
    base_temperature_K: float = 293.0,
) -> Figure:
    """Draw tip temperature against power beside the power law (paper's Fig. 6b)."""
    with figure(4.6, 4.6) as made:
        axes, below = made.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        power = np.linspace(0, float(sweep.power_mW.max()) * 1.03, 800)
        expected = law.tip_temperature(power, base_temperature_K)
        jump = np.searchsorted(power, law.threshold_mW)
        for part in (slice(0, jump), slice(jump, None)):
            axes.plot(
                power[part],
                expected[part],
                "--",
                color=ORANGE,
                label="power law, Eq. 12" if part.start == 0 else None,
            )
        style: Any = {"color": BLUE, "marker": _marker(sweep)}
        axes.plot(sweep.power_mW, sweep.tip_K, label="model", **style)
        difference = sweep.tip_K - law.tip_temperature(sweep.power_mW, base_temperature_K)
        below.plot(sweep.power_mW, difference, **style)
        if measurement is not None and measurement.series_resistance_ohm is not None:
            current = measurement.current_mA
            lever = measurement.bias_V - measurement.series_resistance_ohm / 1000.0 * current
            dissipated = lever * current
            axes.plot(dissipated, measurement.tip_K, "o", mfc="none", color=BLACK, label="measured")
            below.plot(
                dissipated,
                measurement.tip_K - law.tip_temperature(dissipated, base_temperature_K),
                "o",
                mfc="none",
                color=BLACK,
            )
        below.axhspan(-25, 25, color="0.92", zorder=0)
        below.axhline(0, color="0.4", lw=0.8)
        below.set(xlabel="power P$_l$ (mW)", ylabel="T$_{tip}$ − law (K)", xlim=(0, None))
        axes.set(ylabel="tip temperature (K)")
        axes.legend(loc="upper left")
        below.annotate("±25 K", (0.02, 0.06), xycoords="axes fraction", color="0.4", fontsize=8)
    return made


def resistances(sweep: xr.Dataset) -> Figure:
    """Draw heater, leg and total resistance against tip temperature (paper's Fig. 5)."""
    with figure(4.2, 3.4) as made:
        axes = made.add_subplot()
        for name, label, colour, marker in (
            ("lever_ohm", "lever, total", BLACK, "s"),
            ("heater_ohm", "heater R$_h$", VERMILION, "o"),
            ("legs_ohm", "legs R$_{l1}$ + R$_{l2}$", BLUE, "^"),
        ):
            style: Any = {"color": colour, "marker": _marker(sweep, marker), "label": label}
            axes.plot(sweep.tip_K, sweep[name] / 1000, **style)
        axes.set(xlabel="tip temperature (K)", ylabel="resistance (kΩ)", ylim=(0, None))
        axes.legend()
    return made


def doping_profile(profile: xr.Dataset) -> Figure:
    """Draw doping and local inversion temperature along the heater (paper's Fig. 7a)."""
    with figure(4.6, 3.4) as made:
        axes = made.add_subplot()
        axes.semilogy(profile.position, profile.doping, color=BLUE)
        axes.set(xlabel="position along the heater (µm)")
        axes.set_ylabel("doping concentration (cm⁻³)", color=BLUE)
        right = axes.twinx()
        right.plot(profile.position, profile.inversion_temperature, "--", color=VERMILION)
        right.set_ylabel("inversion temperature (K)", color=VERMILION)
        right.spines["right"].set_visible(True)
        right.grid(False)
    return made


def heater_profiles(profiles: Mapping[str, xr.Dataset]) -> Figure:
    """Draw local resistivity and temperature along the heater (paper's Fig. 7b).

    Solid where dρ/dT > 0, dashed where it is negative.

    Parameters
    ----------
    profiles : mapping of str to xarray.Dataset
        From `heater_profile`, by the name of the operating point.
    """
    with figure(5.2, 5.2) as made:
        upper, lower = made.subplots(2, 1, sharex=True)
        for (name, profile), colour in zip(profiles.items(), COLOURS, strict=False):
            position, rho = profile.position.values, profile.resistivity.values
            metallic = profile.resistivity_slope.values > 0
            upper.plot(position, np.where(metallic, rho, np.nan), color=colour)
            # let the dashed part reach the solid one
            inverted = ~metallic | ~np.roll(metallic, 1) | ~np.roll(metallic, -1)
            if not metallic.all():
                upper.plot(position, np.where(inverted, rho, np.nan), "--", color=colour)
            label = (
                f"{name}: {profile.attrs['lever_V']:.2f} V, {profile.attrs['current_mA']:.2f} mA"
            )
            lower.plot(position, profile.temperature, color=colour, label=label)
        upper.set(ylabel="resistivity (Ω cm)", ylim=(0, None))
        upper.legend(
            handles=[
                Line2D([], [], color="0.3", label="dρ/dT > 0"),
                Line2D([], [], color="0.3", ls="--", label="dρ/dT < 0"),
            ],
            loc="upper right",
        )
        lower.set(xlabel="position along the heater (µm)", ylabel="temperature (K)")
        low, high = lower.get_ylim()
        lower.set_ylim(low, high + 0.35 * (high - low))
        lower.legend(loc="upper left")
    return made


def data_and_model(measurement: Measurement, model: xr.Dataset, fitted: Sequence[str]) -> Figure:
    """Draw measured and modelled observables, and their difference (paper's Figs. 3 and 4).

    Parameters
    ----------
    measurement : Measurement
    model : xarray.Dataset
        The sweep of the fitted lever at the measured biases, row by row.
    fitted : sequence of str
        The observables that entered the fit.
    """
    panels = [
        ("current", "heater current I$_h$ (mA)", measurement.current_mA, model.current_mA),
        ("reader", "reader voltage V$_r$ (V)", measurement.reader_V, model.reader_V),
        ("tip", "tip temperature (K)", measurement.tip_K, model.tip_K),
    ]
    units = {"current": ("µA", 1000.0), "reader": ("mV", 1000.0), "tip": ("K", 1.0)}
    order = np.argsort(measurement.bias_V)
    bias = measurement.bias_V[order]
    with figure(8.4, 4.6) as made:
        grid = made.subplots(2, 3, sharex=True, height_ratios=(1.8, 1.0))
        for column, (name, label, data, values) in enumerate(panels):
            upper, lower = grid[:, column]
            unit, factor = units[name]
            upper.plot(bias, values.values[order], "-", color=BLUE, label="model")
            upper.plot(bias, data[order], "o", mfc="none", color=BLACK, label="measured")
            lower.axhline(0, color="0.4", lw=0.8)
            if name == "tip":
                error = measurement.tip_error_K[order]
                lower.fill_between(bias, -error, error, color="0.9", label="± dT")
            difference = (data - values.values)[order] * factor
            lower.plot(bias, difference, "o-", color=VERMILION, lw=0.8, ms=3.5)
            upper.set(ylabel=label)
            panel_letter(upper, "abc"[column])
            if name not in fitted:
                upper.annotate(
                    "not fitted", (0.96, 0.05), xycoords="axes fraction", ha="right", color="0.4"
                )
            lower.set(xlabel="bias V$_b$ (V)", ylabel=f"data − model ({unit})")
        grid[0, 0].legend(loc="upper left")
    return made


def correlation_matrix(names: Sequence[str], correlation: np.ndarray) -> Figure:
    """Draw the correlation of fitted parameters (paper's Fig. 4 d-f)."""
    count = len(names)
    with figure(1.2 + 0.52 * count, 0.6 + 0.52 * count) as made:
        axes = made.add_subplot()
        image = axes.imshow(correlation, cmap="PuOr", vmin=-1, vmax=1)
        symbols = [PARAMETERS[name].symbol for name in names]
        axes.set_xticks(range(count), symbols)
        axes.set_yticks(range(count), symbols)
        axes.grid(False)
        for row in range(count):
            for column in range(count):
                value = correlation[row, column]
                axes.text(
                    column,
                    row,
                    f"{value:.2f}",
                    ha="center",
                    va="center",
                    fontsize=7.5,
                    color="white" if abs(value) > 0.7 else "black",
                )
        made.colorbar(image, label="correlation (1)", shrink=0.9)
    return made


def tip_band(band: xr.Dataset, measurement: Measurement | None = None) -> Figure:
    """Draw the predicted tip temperature with its 95 % band against bias and power.

    Parameters
    ----------
    band : xarray.Dataset
        `Fit.band`.
    measurement : Measurement, optional
        Drawn against the bias.
    """
    with figure(7.4, 4.2) as made:
        grid = made.subplots(2, 2, sharex="col", height_ratios=(2.0, 1.0))
        half = 1.96 * band.tip_stderr_K
        for column, (name, label) in enumerate(
            (("bias_V", "bias V$_b$ (V)"), ("power_mW", "power P$_l$ (mW)"))
        ):
            upper, lower = grid[:, column]
            along = band[name]
            upper.fill_between(along, band.tip_K - half, band.tip_K + half, color=SKY, alpha=0.6)
            upper.plot(along, band.tip_K, color=BLUE, label="prediction and 95 % band")
            if measurement is not None and name == "bias_V":
                upper.plot(
                    measurement.bias_V,
                    measurement.tip_K,
                    "o",
                    mfc="none",
                    color=BLACK,
                    label="measured",
                )
            upper.set(ylabel="tip temperature (K)")
            lower.plot(along, half, "o-", color=BLUE, ms=3.5)
            lower.set(xlabel=label, ylabel="half band (K)", ylim=(0, None))
        grid[0, 0].legend(loc="upper left")
    return made


__all__ = [
    "correlation_matrix",
    "data_and_model",
    "doping_profile",
    "field_maps",
    "heater_profiles",
    "iv_curve",
    "probe_drawing",
    "resistances",
    "sweep_overview",
    "temperature_power",
    "tip_band",
]
