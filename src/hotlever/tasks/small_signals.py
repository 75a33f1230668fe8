"""Levers under small signals: a table and a figure of their response, or of harmonics."""

from __future__ import annotations

from hotlever.datasets import csv_text, in_a_file, write_dataset
from hotlever.lever.transient.frequency_domain import (
    HARMONIC_COLUMNS,
    SPECTRUM_COLUMNS,
    harmonics,
    spectrum,
)
from hotlever.tasks.files import draw
from hotlever.tasks.probes import make_lever
from hotlever.tasks.ranges import parse_frequencies
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import SpectrumRequest
from hotlever.units import bias_setting


def respond(reporter: Reporter, request: SpectrumRequest) -> None:
    """Find impedance and thermal response to small signals at a bias, or harmonics."""
    swing = None if request.amplitude is None else bias_setting(request.amplitude, "--amplitude")
    volts, frequencies = bias_setting(request.bias, "--bias"), parse_frequencies(request.frequency)
    outputs = request.outputs()
    lever = make_lever(reporter, request.read_probe(reporter))
    with reporter.progress("spectrum") as update:
        if swing is None:
            (state,) = lever.solve([volts], update)
            data = spectrum(state, frequencies)
        else:
            data = harmonics(lever, volts, swing, frequencies, update)
    columns = in_a_file(data, SPECTRUM_COLUMNS if swing is None else HARMONIC_COLUMNS)
    with outputs.together():
        if request.output is not None:
            write_dataset(data, request.output, columns)
        draw(
            request.plot,
            lambda figures: (figures.small_signals if swing is None else figures.harmonics)(data),
        )
    if request.output is None:
        reporter.give(csv_text(data, columns))
