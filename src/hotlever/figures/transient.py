"""Figures of levers in time and frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.colours import BLUE, GREEN, ORANGE, PURPLE, VERMILION
from hotlever.figures.style import (
    axis_label,
    bridge_beside,
    curve,
    entitle,
    figure,
    marker,
    settled,
)

if TYPE_CHECKING:
    import xarray as xr


def history_overview(history: xr.Dataset) -> Figure:
    """Draw what a lever shows in time: voltages, current, tip temperature, heat.

    Where the bias stays what it is, time is logarithmic.
    """
    data = history.isel(time=history.time > 0) if settled(history) else history
    style: Any = {"marker": marker(data, "time"), "ms": 3}
    energies = {"supplied_nJ": ("supplied", PURPLE), "stored_nJ": ("stored", VERMILION)}
    if data.air_stored_nJ.any():
        energies["air_stored_nJ"] = "in the air", BLUE
    energies["lost_nJ"] = "lost", ORANGE
    with figure(7.4, 5.2, 2, 2, letters=True, sharex=True) as (fig, grid):
        voltage, current, tip, heat = grid.ravel()
        for name, label, colour in (
            ("bias_V", "bias V$_b$", PURPLE),
            ("lever_V", "lever V$_l$", BLUE),
            ("reader_V", "reader V$_r$", GREEN),
        ):
            curve(voltage, data, "time", name, color=colour, label=label, **style)
        voltage.set(ylabel="voltage (V)")
        curve(current, data, "time", "current_mA", color=BLUE, **style)
        curve(tip, data, "time", "tip_K", color=VERMILION, **style)
        for name, (label, colour) in energies.items():
            curve(heat, data, "time", name, color=colour, label=label, **style)
        heat.set(ylabel="energy (nJ)")
        for axes in (voltage, heat):
            axes.legend()
        bridge_beside(voltage, data, "time", **style)
        if settled(history):
            tip.set_xscale("log")
        entitle(fig, history, more=history.attrs.get("waveform", ""))
    return fig


def small_signals(spectrum: xr.Dataset) -> Figure:
    """Draw the impedance (Nyquist, Bode) and how the tip follows power and bias."""
    with figure(7.4, 5.4, 2, 2, letters=True) as (fig, grid):
        nyquist, bode, size, phase = grid.ravel()
        real, imaginary = spectrum.impedance_real_ohm / 1000, spectrum.impedance_imag_ohm / 1000
        nyquist.plot(real, -imaginary, "o-", ms=3, color=BLUE)
        nyquist.set(xlabel="Re Z (kΩ)", ylabel="−Im Z (kΩ)")
        nyquist.axhline(0, color="0.4", lw=0.8)
        bode.plot(spectrum.frequency, real, color=BLUE, label="Re Z")
        bode.plot(spectrum.frequency, imaginary, "--", color=BLUE, label="Im Z")
        bode.set(ylabel="impedance (kΩ)")
        for per, unit, colour in (("power", "K/mW", VERMILION), ("bias", "K/V", PURPLE)):
            name, label = f"tip_per_{per}", f"by {per}"
            change = spectrum[f"{name}_{unit.replace('/', '_per_')}"]
            size.plot(spectrum.frequency, change, color=colour, label=f"{label} ({unit})")
            phase.plot(spectrum.frequency, spectrum[f"{name}_deg"], color=colour, label=label)
        changes = "change of T$_{tip}$ (K/mW, K/V)"
        if "bridge_per_bias_deg" in spectrum:
            change, turn = spectrum.bridge_per_bias_V_per_V, spectrum.bridge_per_bias_deg
            label = "V$_{bridge}$ by bias (V/V)"
            size.plot(spectrum.frequency, change, color=ORANGE, label=label)
            phase.plot(spectrum.frequency, turn, color=ORANGE, label="V$_{bridge}$")
            changes = "change of T$_{tip}$, V$_{bridge}$"
        size.set(ylabel=changes, yscale="log")
        phase.set(ylabel="phase (°)")
        _along_frequency(bode, size, phase)
        entitle(fig, spectrum, more=f"bias {spectrum.attrs['bias_V']:.3g} V")
    return fig


def _along_frequency(*panels: Axes) -> None:
    for axes in panels:
        axes.set(xlabel=axis_label("frequency"), xscale="log")
        axes.legend()


def harmonics(data: xr.Dataset) -> Figure:
    """Draw amplitude and phase of the harmonics of the lever voltage, and of a bridge's."""
    voltages = {"": ("-", "V$_l$")}
    if "first_bridge_harmonic_V" in data:
        voltages["bridge_"] = "--", "V$_{bridge}$"
    with figure(7.4, 3.2, 1, 2, letters=True) as (fig, (size, phase)):
        for of, (line, symbol) in voltages.items():
            for name, colour in (("first", BLUE), ("second", GREEN), ("third", VERMILION)):
                volts = data[f"{name}_{of}harmonic_V"]
                # without an offset there is no second harmonic, but for rounding errors
                if float(volts.max()) < 1e-9 * float(data.first_harmonic_V.max()):
                    continue
                label = f"{name} harmonic" + (f", {symbol}" if len(voltages) > 1 else "")
                size.plot(data.frequency, volts, line, color=colour, label=label)
                angle = data[f"{name}_{of}harmonic_deg"]
                phase.plot(data.frequency, angle, line, color=colour, label=label)
        volts_of = ", ".join(symbol for _, symbol in voltages.values())
        size.set(ylabel=f"amplitude of {volts_of} (V)", yscale="log")
        phase.set(ylabel="phase (°)")
        _along_frequency(size, phase)
        driven = f"bias {data.attrs['bias_V']:.3g} V + {data.attrs['amplitude_V']:.3g} V sine"
        entitle(fig, data, more=driven)
    return fig
