"""The page of a lever in time: steps, a train of pulses, time constants, spectra."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import get_args

import numpy as np

from hotlever import figures
from hotlever.lever import Lever
from hotlever.lever.transient import pulse, rise_times, simulate, spectrum, step, time_constants
from hotlever.lever.transient.frequency_domain import harmonics
from hotlever.lever.transient.modes import Source
from hotlever.materials.parameters import sentence
from hotlever.report.report_page import Page
from hotlever.types import Array, Progress
from hotlever.work import each


def transient_page(
    lever: Lever, progress: Progress | None = None, *, pulses: int = 10, frequencies: int = 49
) -> Page:
    """Return the page of a lever in time.

    Parameters
    ----------
    lever : Lever
    progress : callable, optional
        Called with the sections done and their number.
    pulses : int
        Of the train.
    frequencies : int
        Of spectra and harmonics, from 10 Hz to 10 MHz.

    Raises
    ------
    ComputationError
        If the lever cannot be solved or followed.
    """
    branch = lever.branch_past_knee()
    knee = branch.knee
    highest = float(
        branch.bias([branch.hottest_K], lever.circuit)[0]
        if knee is None
        else lever.circuit.bias(knee.lever_V, knee.current_mA)
    )
    # shares of the bias of the knee: beyond it a lever may run away
    biases = [round(share * highest, 2) for share in (0.25, 0.5, 0.75, 0.9)]
    page = Page(
        "A lever in time",
        f"A {lever.probe.shape.shape} lever in {lever.medium}, with "
        f"{lever.circuit.series_resistance_ohm:g} Ω in series. "
        + (
            f"Biases are shares of {highest:.2f} V, where it is hottest."
            if knee is None
            else f"Biases are shares of {highest:.2f} V, that of its knee."
        ),
    )
    swept_Hz = np.geomspace(10.0, 1e7, frequencies)
    sections: dict[str, Callable[[Page, Lever, list[float]], None]] = {
        "A step": _step,
        "A train of pulses": partial(_train, count=pulses),
        "Time constants": _time_constants,
        "Small signals": partial(_small_signals, frequencies_Hz=swept_Hz),
        "Harmonics": partial(_harmonics, frequencies_Hz=swept_Hz),
    }
    for heading, section in each(sections.items(), progress):
        page.heading(heading)
        section(page, lever, biases)
    return page


def _step(page: Page, lever: Lever, biases: list[float]) -> None:
    bias = biases[-1]
    history = simulate(lever, step(bias), per_step=8)
    page.draw("step", figures.history_overview(history), bias=bias)
    times = [1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]
    rows = []
    for bias in biases:
        tip = simulate(lever, step(bias), at=times).tip_K.values
        rows.append([f"{bias:g}", *(f"{value:.0f}" for value in tip)])
    heads = ["bias (V)", *(f"{time:g} µs" for time in times)]
    page.tabulate("step", heads, rows)
    page.sentences(*filter(None, history.attrs["notes"].split("\n")))


def _train(page: Page, lever: Lever, biases: list[float], count: int) -> None:
    wave = pulse(biases[-1], 5.0, 50.0, count)
    history = simulate(lever, wave, per_step=8)
    page.figure("train", figures.history_overview(history), f"{sentence(wave.text)}")
    accounted_nJ = history.stored_nJ + history.air_stored_nJ + history.lost_nJ
    off = float(np.abs(history.supplied_nJ - accounted_nJ).max() / history.supplied_nJ.max())
    page.say("train", off=off)


def _time_constants(page: Page, lever: Lever, biases: list[float]) -> None:
    columns = {
        source: time_constants(lever, biases, source, count=1) for source in get_args(Source)
    }
    times = rise_times(lever, biases)
    rows = []
    for index, bias in enumerate(biases):
        slowest = [constants.time_constant_us.values[index, 0] for constants in columns.values()]
        around = [times.heating_us.values[index], times.cooling_us.values[index]]
        tip = times.tip_K.values[index]
        rows.append([f"{bias:g}", f"{tip:.0f}", *(f"{time:.1f}" for time in (*slowest, *around))])
    held = [f"{source} held" for source in columns]
    heads = ["bias (V)", "tip (K)", *held, "heating", "cooling"]
    page.tabulate("time_constants", heads, rows)


def _small_signals(page: Page, lever: Lever, biases: list[float], frequencies_Hz: Array) -> None:
    for bias in (biases[1], biases[-1]):
        (state,) = lever.solve([bias])
        figure = figures.small_signals(spectrum(state, frequencies_Hz))
        page.draw("spectrum", figure, f"spectrum_{bias:g}V", bias=bias, tip_K=state.tip_K)


def _harmonics(page: Page, lever: Lever, biases: list[float], frequencies_Hz: Array) -> None:
    bias = biases[1]
    drive = 0.05 * bias
    figure = figures.harmonics(harmonics(lever, bias, drive, frequencies_Hz))
    page.draw("harmonics", figure, drive=drive, bias=bias)
