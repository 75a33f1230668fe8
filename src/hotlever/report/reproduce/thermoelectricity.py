"""Thermoelectricity: how far, and which way, it moves the hot spot; and what a fit gains by it."""

from __future__ import annotations

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.estimation import Fit
from hotlever.lever import Lever
from hotlever.materials import PARAMETERS
from hotlever.report.reproduce.findings import Findings, example
from hotlever.report.reproduce.vacuum import published_biases
from hotlever.studies.thermoelectric_fit import described_without, fits_with_and_without
from hotlever.studies.thermoelectric_shift import of_p_silicon, shift_by_heat
from hotlever.studies.thermoelectric_strip import self_heated

#: Biases (V) beside those of the published points, the lowest first.
_BIAS = (4.0, 5.0, 6.0, 9.0, 10.0)
#: Temperatures (K) of a strip of one doping.
_STRIP_K = np.arange(500.0, 1301.0, 25.0)
#: A change of a mean residual by less, relative to it, is none.
_MATTERS = 0.1


def shift_section(page: Findings) -> None:
    """The shift of the hot spot, heat by heat, for either kind of silicon."""
    points = published_biases(page.lever)
    biases = sorted([*_BIAS, *points])
    n_type = shift_by_heat(page.lever, biases)
    p_type = shift_by_heat(Lever(of_p_silicon(page.lever.probe)), biases)
    page.draw("thermoelectric_shift", figures.thermoelectric_shift(n_type, p_type))
    base = page.lever.circuit.base_temperature_K
    rows = [
        row
        for name, shift in (("phosphorus", n_type), ("boron", p_type))
        for polarity in (1, -1)
        for bias in points
        for row in [_row(name, shift.sel(polarity=polarity), bias, base)]
    ]
    page.tabulate("thermoelectric_shift", _COLUMNS, rows)
    at_points = n_type.sel(bias=points, method="nearest")
    largest, cold = float(abs(at_points.moved_nm).max()), n_type.isel(bias=0)
    page.claim(
        "thermoelectric_size",
        holds=largest < paper.SHIFT_NM,
        most=paper.SHIFT_NM,
        largest=largest,
        cold=float(abs(cold.moved_nm).max()),
        bias=cold.bias.item(),
    )
    thomson = at_points.share_nm.sel(heat="Thomson").sum("side")
    silicon = page.lever.probe.heater_silicon
    assert silicon is not None
    strip = self_heated(silicon, _STRIP_K)
    first, last = (p_type.sel(polarity=1).sel(bias=bias, method="nearest") for bias in points[:2])
    page.claim(
        "thermoelectric_direction",
        holds=bool((at_points.moved_nm > 0.0).all()),
        least=float(at_points.moved_nm.max()),
        most=float(at_points.moved_nm.min()),
        thomson=float(thomson.min()),
        strip=_turn(strip),
        p_cold=first.moved_nm.item(),
        p_cold_K=base + first.centre_rise_K.item(),
        p_hot=last.moved_nm.item(),
        p_hot_K=base + last.centre_rise_K.item(),
    )


_COLUMNS = (
    *("doped with", "bias (V)", "T_tip (K)", "moved along the current (nm)"),
    *("by Peltier heat, supply", "ground", "by Thomson heat"),
    *("Peltier heat, supply (mW)", "ground (mW)"),
)


def _row(name: str, shift: xr.Dataset, bias: float, base: float) -> tuple[str, ...]:
    at = shift.sel(bias=bias, method="nearest")
    moved = [f"{value:+.0f}" for value in at.share_nm.sel(heat="Peltier").values]
    heats = [f"{value:+.3f}" for value in at.heat_mW.sel(heat="Peltier").values]
    thomson = at.share_nm.sel(heat="Thomson").sum().item()
    tip = base + at.centre_rise_K.item()
    signed = f"{at.polarity.item() * at.bias.item():+.2f}"
    all_of_it = f"{at.moved_nm.item():+.0f}"
    return (name, signed, f"{tip:.0f}", all_of_it, *moved, f"{thomson:+.0f}", *heats)


def _turn(strip: xr.Dataset) -> float:
    """Return the temperature (K) at which the shift of a strip turns for the last time."""
    moved, tip = strip.moved_nm.values, strip.tip_K.values
    before = int(np.flatnonzero(np.diff(np.sign(moved)))[-1])
    near = slice(before, before + 2)
    order = np.argsort(moved[near])
    return float(np.interp(0.0, moved[near][order], tip[near][order]))


def prediction_section(page: Findings) -> None:
    """What a fit gains by thermoelectricity."""
    fits = fits_with_and_without(example("lever-a.csv"), page.lever.probe)
    plain, with_it = fits[False], fits[True]
    rows = [
        ("without" if result is plain else "with thermoelectricity", *_fitted(result))
        for result in (plain, with_it)
    ]
    columns = ["model", *(f"rms {name}" for name in plain.residual_rms), *PARAMETERS]
    page.tabulate("thermoelectric_fit", columns, rows)
    gain = 1.0 - with_it.residual_rms["tip_K"] / plain.residual_rms["tip_K"]
    moved = {
        name: abs(with_it.parameters[name].value / plain.parameters[name].value - 1.0)
        for name in PARAMETERS
    }
    name = max(moved, key=moved.__getitem__)
    there = described_without(page.lever.probe)
    page.claim(
        "thermoelectric_prediction",
        holds=gain < _MATTERS,
        before=plain.residual_rms["tip_K"],
        after=with_it.residual_rms["tip_K"],
        symbol=PARAMETERS[name].symbol,
        moved=moved[name],
        off=there.off_K.max().item(),
    )


def _fitted(result: Fit) -> list[str]:
    cells = [f"{value:.3g}" for value in result.residual_rms.values()]
    return cells + [f"{result.parameters[name].value:.4g}" for name in PARAMETERS]
