"""Figures of Raman thermometry; none needs a display."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.figures.style import BLACK, BLUE, GREEN, VERMILION, figure, panel_letters, some_of
from hotlever.raman.lineshape import WINDOW, Peak, in_window
from hotlever.raman.series import MeasuredLine
from hotlever.raman.thermometer import RamanCalibration
from hotlever.spieser2017 import RAMAN_ERROR_K, RAMAN_ERROR_SHARE
from hotlever.studies.raman_check import conclusion
from hotlever.types import Array


def thermometry(
    lines: Sequence[MeasuredLine],
    table: xr.Dataset,
    calibration: RamanCalibration | None = None,
    series: Sequence[MeasuredLine] = (),
) -> Figure:
    """Spectra stacked by temperature, calibration, residuals: like figure 2 of the paper.

    Parameters
    ----------
    lines : sequence of MeasuredLine
        The measured spectra.
    table : xarray.Dataset
        What was read from them, see `hotlever.raman.series.read_lines`.
    calibration : RamanCalibration, optional
        Without one only the spectra are drawn.
    series : sequence of MeasuredLine
        The hot-plate spectra, to be stacked in place of `lines`.
    """
    used = np.array([line.correction.use for line in lines], dtype=bool)
    lines, table = [line for line in lines if line.correction.use], table.isel(spectrum=used)
    names = list(map(str, table.file.values))
    if calibration is None:
        with figure(4.2, 5.4) as (fig, axes):
            _stack(axes, list(zip(names, lines, strict=True)))
        return fig
    if series:
        stated = {point.file: point.temperature_K for point in calibration.points}
        heated = [line for line in series if line.spectrum.name in stated]
        heated.sort(key=lambda line: stated[line.spectrum.name])
        stacked = [(f"{stated[line.spectrum.name]:.0f} K", line) for line in heated]
    else:
        read = zip(names, table.temperature_K.values, lines, strict=True)
        stacked = [(f"{t:.0f} K" if np.isfinite(t) else name, line) for name, t, line in read]
    with figure(10.0, 5.4) as (fig, alone):
        alone.remove()  # for a column of one panel beside a column of two
        grid = fig.add_gridspec(2, 2, width_ratios=(1.0, 1.35), height_ratios=(1.5, 1.0))
        panels = [fig.add_subplot(cell) for cell in (grid[:, 0], grid[0, 1], grid[1, 1])]
        _stack(panels[0], stacked)
        _calibration(panels[1], calibration, table)
        _residuals(panels[2], calibration)
        panel_letters(panels)
    return fig


def _in_window(line: MeasuredLine) -> tuple[Array, Array]:
    inside = in_window(line.spectrum.x, f"{line.spectrum.name}: ")
    return line.spectrum.x[inside], line.spectrum.y[inside]


def _stack(axes: Axes, stacked: Sequence[tuple[str, MeasuredLine]], most: int = 9) -> None:
    """At most so many spectra above each other, each scaled to its line, with the fit."""
    count = len(stacked)
    if len(stacked) > most:
        chosen = np.unique(np.linspace(0, len(stacked) - 1, most).round().astype(int))
        stacked = [stacked[index] for index in chosen]
    # a cosmic ray would hide the next spectrum
    highest = 1.25
    for level, (label, line) in enumerate(stacked):
        x, y = _in_window(line)
        peak = line.peak
        if peak is None:
            y = y - np.median(y)
            top = float(np.ptp(y)) or 1.0
        else:
            y = y - peak.baseline(x)
            height = y if "saturated" in peak.flags else peak.model(x) - peak.baseline(x)
            top = float(height.max()) or 1.0
        scaled = level + 0.75 * np.clip(y / top, None, highest)
        axes.plot(x, scaled, ".", ms=1.6, color="0.4", rasterized=x.size > 2000)
        if peak is not None:
            fine = np.linspace(x[0], x[-1], 1200)
            curve = np.clip((peak.model(fine) - peak.baseline(fine)) / top, None, highest)
            axes.plot(fine, level + 0.75 * curve, color=BLUE, lw=1.0)
        if len(label) > 22:
            label = f"{label[:10]}…{label[-11:]}"
        axes.text(WINDOW[1] - 1.0, level + 0.12, label, ha="right", va="bottom", fontsize=8)
    axes.set(xlabel="Raman shift (cm⁻¹)", ylabel="intensity less background, scaled", yticks=[])
    axes.set(xlim=WINDOW, ylim=(-0.15, len(stacked) + 0.25))
    axes.plot([], [], ".", color="0.4", label="counts")
    axes.plot([], [], color=BLUE, label="fit")
    axes.legend(loc="upper left", title=some_of(len(stacked), count, "spectra"))


def _calibration(axes: Axes, calibration: RamanCalibration, table: xr.Dataset) -> None:
    residuals, line = calibration.residuals(), calibration.linear
    low, high = calibration.range_K
    room = calibration.room_temperature_K
    measured = table.isel(spectrum=np.isfinite(table.temperature_K.values))
    temperatures = measured.temperature_K.values.tolist()
    top = max([high, *temperatures]) + 40.0
    temperature = np.linspace(min([low, room, *temperatures]), top, 300)
    shift, _ = calibration.anharmonic.shift(temperature, room)
    axes.plot(shift, temperature, color=BLUE, lw=1.6, label="anharmonic law")
    label = f"line: {line.constant_K:.1f} K − {-line.slope_K_cm:.1f} K cm × shift"
    axes.plot(shift, line.temperature(shift, room), "--", color=VERMILION, label=label)
    if residuals["temperature_K"].size:
        style: Any = {"mfc": "none", "color": BLACK, "label": "hot plate"}
        axes.plot(residuals["shift_cm"], residuals["temperature_K"], "o", **style)
    if measured.spectrum.size:
        points = (measured.shift_per_cm, measured.temperature_K, measured.temperature_error_K)
        style = {"fmt": "s", "ms": 4, "color": GREEN, "capsize": 2, "lw": 1.0, "label": "measured"}
        axes.errorbar(*points, **style)
    axes.axhspan(low, high, color="0.4", alpha=0.12, lw=0, label="calibrated range")
    axes.set(xlabel="shift against room temperature (cm⁻¹)", ylabel="temperature (K)")
    # what is colder than the room is shifted the other way
    highest = max([0.5, float(shift.max()), *measured.shift_per_cm.values.tolist()])
    axes.set_xlim(float(shift.min()) - 0.5, highest + 0.5)
    axes.invert_xaxis()
    axes.legend(loc="upper left")


def _residuals(axes: Axes, calibration: RamanCalibration) -> None:
    residuals = calibration.residuals()
    at, linear = residuals["temperature_K"], residuals["linear_K"]
    if not at.size:
        text = "published laws: no hot-plate series"
        axes.text(0.5, 0.5, text, ha="center", transform=axes.transAxes)
        axes.set_axis_off()
        return
    grid = np.linspace(*calibration.range_K, 100)
    band = calibration.linear.band(grid - calibration.room_temperature_K)
    style: Any = {"color": VERMILION, "alpha": 0.18, "lw": 0}
    axes.fill_between(grid, -band, band, label=f"paper: {_paper_error()}", **style)
    out = np.abs(linear) > residuals["band_K"]
    label = f"line (filled: {np.count_nonzero(out)} of {out.size} outside the band)"
    axes.plot(at, linear, "^", mfc="none", color=VERMILION, ms=5, label=label)
    axes.plot(at[out], linear[out], "^", color=VERMILION, ms=5)
    label = f"anharmonic (rms {calibration.anharmonic.residual_rms_K:.1f} K)"
    axes.plot(at, residuals["anharmonic_K"], "o", color=BLUE, ms=3.5, label=label)
    axes.axhline(0.0, color=BLACK, lw=0.8)
    reach = max(float(np.abs(linear).max()), float(band.max()))
    axes.set(xlabel="hot-plate temperature (K)", ylabel="law − hot plate (K)")
    axes.set(ylim=(-1.3 * reach, 2.3 * reach))
    axes.legend(ncol=2, loc="upper left")


def _paper_error() -> str:
    """Return the paper's error of a temperature."""
    return f"±({RAMAN_ERROR_K:g} K + {RAMAN_ERROR_SHARE:g} ΔT)"


def raman_check(check: xr.Dataset) -> Figure:
    """How far a line calibrated to 900 K is off above, and what that does to the knee."""
    temperature, band = check.temperature_K.values, check.paper_error.values
    hottest, predicted = check.hottest_K, check.knee_predicted_K
    low, high = check.error_at_hottest.min().item(), check.error_at_hottest.max().item()
    bars = [("as published", check.knee_measured_K - predicted, "0.4")]
    with figure(7.2, 6.4, 2, 1, height_ratios=(1.7, 1.0)) as (fig, (upper, lower)):
        style: Any = {"color": "0.4", "alpha": 0.2, "lw": 0}
        upper.fill_between(
            temperature, -band, band, label=f"the paper's error, {_paper_error()}", **style
        )
        for index, (color, dash) in enumerate(((VERMILION, "--"), (BLUE, "-."))):
            law = check.isel(line=index)
            name = str(law.line.item())
            upper.plot(temperature, law.error, dash, color=color, lw=1.8, label=name)
            upper.plot([hottest], [law.error_at_hottest.item()], "o", color=color, ms=5)
            bar_label = name.split(":")[0] + ",\ncurvature corrected"
            bars.append((bar_label, law.discrepancy.item(), color))
        text = f"{low:.0f} to {high:.0f} K too hot\nat {hottest:.0f} K"
        upper.text(hottest - 55.0, 0.99 * high, text, ha="right", va="top", fontsize=9)
        upper.axvline(check.calibrated_to_K, color=BLACK, lw=0.8, ls=":")
        upper.text(check.calibrated_to_K + 4.0, -0.27 * high, "end of hot plate", fontsize=8)
        upper.axhline(0.0, color=BLACK, lw=0.8)
        upper.set(xlabel="true temperature (K), by the anharmonic law")
        upper.set(ylabel="line reads − true (K)", ylim=(-0.33 * high, 1.15 * high))
        upper.set(xlim=(temperature[0], temperature[-1]))
        upper.legend(loc="upper left")
        for level, (_, value, color) in enumerate(reversed(bars)):
            lower.barh(level, value, color=color, height=0.6)
            text = f"{value:.0f} K  ({predicted + value:.0f} − {predicted:.0f} K)"
            lower.text(value + 0.8, level, text, va="center", fontsize=9)
        lower.set_yticks(range(len(bars)), [label for label, _, _ in reversed(bars)], fontsize=9)
        values = [value for _, value, _ in bars]
        lower.set(xlabel="knee temperature, measured − predicted (K)")
        lower.set(xlim=(min(0.0, *values), 1.45 * max(values)))
        fig.suptitle("\n".join(textwrap.wrap(conclusion(check), 92)), fontsize=9.5)
    return fig


def one_spectrum(line: MeasuredLine) -> Figure:
    """One spectrum with its fit and what the fit leaves."""
    x, y = _in_window(line)
    residual: Array = y - float(np.median(y))
    with figure(6.0, 4.6, 2, 1, sharex=True, height_ratios=(3.0, 1.0)) as (fig, (upper, lower)):
        upper.plot(x, y, ".", ms=3, color="0.4", label="counts")
        if line.peak is not None:
            residual = _fitted(upper, line.peak, x, y)
        low, high = line.window
        if line.window != WINDOW:
            upper.axvspan(low, high, color=GREEN, alpha=0.12, lw=0, label="fitted part")
            residual = np.where((x >= low) & (x <= high), residual, np.nan)
        lower.plot(x, residual, ".", ms=3, color="0.4")
        lower.axhline(0.0, color=BLACK, lw=0.8)
        upper.set(ylabel="counts", title=line.spectrum.name)
        lower.set(xlabel="Raman shift (cm⁻¹)", ylabel="counts − fit", xlim=WINDOW)
        upper.legend()
    return fig


def _fitted(axes: Axes, peak: Peak, x: Array, y: Array) -> Array:
    """Draw the fit of a spectrum and what it left out; return what it leaves of the rest."""
    fine = np.linspace(x[0], x[-1], 1500)
    axes.plot(fine, peak.model(fine), color=BLUE, label="fit")
    axes.plot(fine, peak.baseline(fine), ":", color=BLACK, lw=1.0, label="background")
    hit = np.isin(x, peak.spikes)
    residual = np.where(hit, np.nan, y - peak.model(x))
    if peak.clipped is not None:
        low, high = peak.clipped
        style: Any = {"color": VERMILION, "alpha": 0.2, "lw": 0, "label": "clipped, left out"}
        axes.axvspan(low, high, **style)
        residual = np.where((x >= low) & (x <= high), np.nan, residual)
    label = f"{peak.centre:.3f} ± {peak.centre_stderr:.3f} cm⁻¹"
    axes.axvline(peak.centre, color=GREEN, lw=0.9, ls="--", label=label)
    least = float(y.min())
    reach = float(peak.model(fine).max()) - least
    top = least + 1.35 * reach
    axes.set_ylim(least - 0.08 * reach, top)
    if hit.any():
        # a spike above the frame is marked at its edge
        clipped = np.minimum(y[hit], top - 0.03 * reach)
        axes.plot(x[hit], clipped, "x", color=VERMILION, ms=7, label="cosmic ray, left out")
    return residual
