"""Figures of Raman thermometry; none needs a display."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.raman.calibration import Calibration
from hotlever.raman.check import PaperCheck
from hotlever.raman.lineshape import Array
from hotlever.raman.peak import WINDOW
from hotlever.raman.series import Line, Row
from hotlever.report.style import BLACK, BLUE, GREEN, VERMILION, figure, panel_letter

GREY = "0.4"
STACKED = 9


def thermometry(
    lines: Sequence[Line],
    rows: Sequence[Row],
    calibration: Calibration | None = None,
    series: Sequence[Line] = (),
) -> Figure:
    """Spectra stacked by temperature, calibration, residuals: like figure 2 of the paper.

    Parameters
    ----------
    lines, rows : sequences
        The measured spectra and their table rows.
    calibration : Calibration, optional
        Without one only the spectra are drawn.
    series : sequence of Line
        The hot-plate spectra, to be stacked in place of `lines`.
    """
    if calibration is None:
        with figure(4.2, 5.4) as made:
            _stack(made.subplots(), lines, [row.file for row in rows])
        return made
    with figure(10.0, 5.4) as made:
        _three_panels(made, lines, rows, calibration, series)
    return made


def _three_panels(
    made: Figure,
    lines: Sequence[Line],
    rows: Sequence[Row],
    calibration: Calibration,
    series: Sequence[Line],
) -> None:
    grid = made.add_gridspec(2, 2, width_ratios=(1.0, 1.35), height_ratios=(1.5, 1.0))
    stack = made.add_subplot(grid[:, 0])
    if series:
        ordered = _by_temperature(series, calibration)
        _stack(stack, [line for _, line in ordered], [f"{t:.0f} K" for t, _ in ordered])
    else:
        labels = [
            f"{row.temperature:.0f} K" if np.isfinite(row.temperature) else row.file for row in rows
        ]
        _stack(stack, lines, labels)
    upper = made.add_subplot(grid[0, 1])
    lower = made.add_subplot(grid[1, 1])
    _calibration(upper, calibration, rows)
    _residuals(lower, calibration)
    for letter, axes in zip("abc", (stack, upper, lower), strict=True):
        panel_letter(axes, letter)


def _by_temperature(series: Sequence[Line], calibration: Calibration) -> list[tuple[float, Line]]:
    stated = {point.file: point.temperature_K for point in calibration.points}
    found = [(stated[line.spectrum.name], line) for line in series if line.spectrum.name in stated]
    return sorted(found, key=lambda pair: pair[0])


def _stack(axes: Axes, lines: Sequence[Line], labels: Sequence[str]) -> None:
    """Spectra above each other, each scaled to its line, with the fit."""
    pairs = [(line, label) for line, label in zip(lines, labels, strict=True)]
    if len(pairs) > STACKED:
        chosen = np.unique(np.linspace(0, len(pairs) - 1, STACKED).round().astype(int))
        pairs = [pairs[i] for i in chosen]
    for level, (line, label) in enumerate(pairs):
        x, y = line.spectrum.x, line.spectrum.y
        inside = (x >= WINDOW[0]) & (x <= WINDOW[1])
        x, y = x[inside], y[inside]
        if not x.size:
            continue
        peak = line.peak
        base = float(np.median(y)) if peak is None else 0.0
        floor = peak.baseline(x) if peak is not None else np.full_like(y, base)
        fitted = None if peak is None else peak.model(x) - floor
        top = float(np.ptp(y) if fitted is None else fitted.max()) or 1.0
        if peak is not None and "saturated" in peak.flags:
            top = float((y - floor).max())
        scaled = np.clip((y - floor) / top, None, 1.25)
        axes.plot(x, level + 0.75 * scaled, ".", ms=1.6, color=GREY, rasterized=x.size > 2000)
        if fitted is not None:
            fine = np.linspace(x[0], x[-1], 1200)
            curve = (peak.model(fine) - peak.baseline(fine)) / top  # type: ignore[union-attr]
            axes.plot(fine, level + 0.75 * np.clip(curve, None, 1.25), color=BLUE, lw=1.0)
        axes.text(WINDOW[1] - 1.0, level + 0.12, _short(label), ha="right", va="bottom", fontsize=8)
    axes.set(
        xlim=WINDOW,
        ylim=(-0.15, len(pairs) + 0.25),
        xlabel="Raman shift (cm⁻¹)",
        ylabel="intensity less background, scaled",
        yticks=[],
    )
    axes.plot([], [], ".", color=GREY, label="counts")
    axes.plot([], [], color=BLUE, label="fit")
    axes.legend(loc="upper left", fontsize=8)


def _short(label: str, limit: int = 22) -> str:
    if len(label) <= limit:
        return label
    return f"{label[: limit // 2 - 1]}…{label[-limit // 2 :]}"


def _calibration(axes: Axes, calibration: Calibration, rows: Sequence[Row]) -> None:
    found = calibration.residuals()
    low, high = calibration.range_K
    measured = np.array([[row.shift, row.temperature, row.error] for row in rows])
    measured = measured[np.all(np.isfinite(measured), axis=1)] if measured.size else measured
    top = max([high, *(measured[:, 1] if measured.size else [])]) + 40.0
    room = calibration.room_temperature_K
    temperature = np.linspace(min(low, room), top, 300)
    shift, _ = calibration.anharmonic.shift(temperature, room)
    line = calibration.linear
    axes.plot(shift, temperature, color=BLUE, lw=1.6, label="anharmonic law")
    axes.plot(
        shift,
        line.temperature(shift, room),
        "--",
        color=VERMILION,
        lw=1.4,
        label=f"line: {line.constant_K:.1f} K − {-line.slope_K_cm:.1f} K cm × shift",
    )
    if found["temperature_K"].size:
        axes.plot(
            found["shift_cm"],
            found["temperature_K"],
            "o",
            mfc="none",
            color=BLACK,
            ms=4.5,
            label="hot plate",
        )
    if measured.size:
        axes.errorbar(
            measured[:, 0],
            measured[:, 1],
            yerr=measured[:, 2],
            fmt="s",
            ms=4,
            color=GREEN,
            capsize=2,
            lw=1.0,
            label="measured",
        )
    axes.axhspan(low, high, color=GREY, alpha=0.12, lw=0, label="calibrated range")
    axes.set(xlabel="shift against room temperature (cm⁻¹)", ylabel="temperature (K)")
    axes.set_xlim(float(shift.min()) - 0.5, 1.0)
    axes.invert_xaxis()
    axes.legend(fontsize=8, loc="upper left")


def _residuals(axes: Axes, calibration: Calibration) -> None:
    found = calibration.residuals()
    room = calibration.room_temperature_K
    if not found["temperature_K"].size:
        axes.text(
            0.5, 0.5, "published laws: no hot-plate series", ha="center", transform=axes.transAxes
        )
        axes.set_axis_off()
        return
    low, high = calibration.range_K
    grid = np.linspace(low, high, 100)
    band = calibration.linear.band(grid - room)
    axes.fill_between(
        grid, -band, band, color=VERMILION, alpha=0.18, lw=0, label="paper: ±(5 K + 0.02 ΔT)"
    )
    out = np.abs(found["linear_K"]) > found["band_K"]
    axes.plot(
        found["temperature_K"],
        found["linear_K"],
        "^",
        mfc="none",
        color=VERMILION,
        ms=5,
        label=f"line (filled: {np.count_nonzero(out)} of {out.size} outside the band)",
    )
    axes.plot(found["temperature_K"][out], found["linear_K"][out], "^", color=VERMILION, ms=5)
    axes.plot(
        found["temperature_K"],
        found["anharmonic_K"],
        "o",
        color=BLUE,
        ms=3.5,
        label=f"anharmonic (rms {calibration.anharmonic.residual_rms_K:.1f} K)",
    )
    axes.axhline(0.0, color=BLACK, lw=0.8)
    reach = max(float(np.abs(found["linear_K"]).max()), float(band.max()))
    axes.set(
        xlabel="hot-plate temperature (K)",
        ylabel="law − hot plate (K)",
        ylim=(-1.3 * reach, 2.3 * reach),
    )
    axes.legend(fontsize=8, ncol=2, loc="upper left")


def paper_check(check: PaperCheck) -> Figure:
    """How far a line calibrated to 900 K is off above, and what that does to the knee."""
    with figure(7.2, 6.4) as made:
        _paper_check(made, check)
    return made


def _paper_check(made: Figure, check: PaperCheck) -> None:
    upper, lower = made.subplots(2, 1, height_ratios=(1.7, 1.0))
    temperature = np.linspace(check.calibration.room_temperature_K, check.hottest + 25.0, 300)
    styles = ((VERMILION, "--"), (BLUE, "-."))
    errors = check.errors(temperature)
    band = check.laws[0][1].band(temperature - check.calibration.room_temperature_K)
    upper.fill_between(
        temperature,
        -band,
        band,
        color=GREY,
        alpha=0.2,
        lw=0,
        label="the paper's error, ±(5 K + 0.02 ΔT)",
    )
    for (color, dash), (name, values), result in zip(
        styles, errors.items(), check.results, strict=True
    ):
        upper.plot(temperature, values, dash, color=color, lw=1.8, label=name)
        upper.plot([check.hottest], [result.error_at_hottest], "o", color=color, ms=5)
    high = max(result.error_at_hottest for result in check.results)
    low = min(result.error_at_hottest for result in check.results)
    upper.text(
        check.hottest - 55.0,
        0.99 * high,
        f"{low:.0f} to {high:.0f} K too hot\nat {check.hottest:.0f} K",
        ha="right",
        va="top",
        fontsize=9,
    )
    upper.axvline(check.calibrated_to, color=BLACK, lw=0.8, ls=":")
    upper.text(check.calibrated_to + 4.0, -0.27 * high, "end of hot plate", fontsize=8)
    upper.axhline(0.0, color=BLACK, lw=0.8)
    upper.set(
        xlabel="true temperature (K), by the anharmonic law",
        ylabel="line reads − true (K)",
        xlim=(temperature[0], temperature[-1]),
        ylim=(-0.33 * high, 1.15 * high),
    )
    upper.legend(fontsize=8, loc="upper left")
    bars: list[tuple[str, float, str]] = [
        ("as published", check.knee_measured - check.knee_predicted, GREY)
    ]
    for (color, _), result in zip(styles, check.results, strict=True):
        bars.append(
            (result.name.split(":")[0] + ",\ncurvature corrected", result.discrepancy, color)
        )
    for level, (_, value, color) in enumerate(reversed(bars)):
        lower.barh(level, value, color=color, height=0.6)
        lower.text(
            value + 0.8,
            level,
            f"{value:.0f} K  ({check.knee_predicted + value:.0f} − {check.knee_predicted:.0f} K)",
            va="center",
            fontsize=9,
        )
    lower.set_yticks(range(len(bars)), [label for label, _, _ in reversed(bars)], fontsize=9)
    lower.set(
        xlabel="knee temperature, measured − predicted (K)",
        xlim=(0.0, 1.45 * (check.knee_measured - check.knee_predicted)),
    )
    made.suptitle("\n".join(textwrap.wrap(check.conclusion(), 92)), fontsize=9.5)


def one_spectrum(line: Line) -> Figure:
    """One spectrum with its fit and what the fit leaves."""
    with figure(6.0, 4.6) as made:
        _one_spectrum(made, line)
    return made


def _one_spectrum(made: Figure, line: Line) -> None:
    x, y = line.spectrum.x, line.spectrum.y
    inside = (x >= WINDOW[0]) & (x <= WINDOW[1])
    x, y = x[inside], y[inside]
    upper, lower = made.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    upper.plot(x, y, ".", ms=3, color=GREY, label="counts")
    residual: Array = y - float(np.median(y))
    if line.peak is not None:
        peak = line.peak
        fine = np.linspace(x[0], x[-1], 1500)
        upper.plot(fine, peak.model(fine), color=BLUE, lw=1.4, label="fit")
        upper.plot(fine, peak.baseline(fine), ":", color=BLACK, lw=1.0, label="background")
        hit = np.isin(x, peak.spikes)
        residual = y - peak.model(x)
        if peak.clipped is not None:
            upper.axvspan(
                *peak.clipped, color=VERMILION, alpha=0.2, lw=0, label="clipped, left out"
            )
            residual = np.where((x >= peak.clipped[0]) & (x <= peak.clipped[1]), np.nan, residual)
        label = f"{peak.centre:.3f} ± {peak.centre_stderr:.3f} cm⁻¹"
        upper.axvline(peak.centre, color=GREEN, lw=0.9, ls="--", label=label)
        reach = float(peak.model(fine).max()) - float(y.min())
        top = float(y.min()) + 1.35 * reach
        upper.set_ylim(float(y.min()) - 0.08 * reach, top)
        if hit.any():
            # a spike above the frame is marked at its edge
            shown = np.minimum(y[hit], top - 0.03 * reach)
            upper.plot(x[hit], shown, "x", color=VERMILION, ms=7, label="cosmic ray, left out")
            residual = np.where(hit, np.nan, residual)
    lower.plot(x, residual, ".", ms=3, color=GREY)
    lower.axhline(0.0, color=BLACK, lw=0.8)
    upper.set(ylabel="counts", title=line.spectrum.name)
    lower.set(xlabel="Raman shift (cm⁻¹)", ylabel="counts − fit", xlim=WINDOW)
    upper.legend(fontsize=8)
