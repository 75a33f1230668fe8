"""Figures of levers in time and frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from hotlever.figures.style import BLUE, GREEN, ORANGE, PURPLE, VERMILION, figure

if TYPE_CHECKING:
    import xarray as xr

#: Rows that are marked; more would hide the lines.
_MARKED = 40


def history_overview(history: xr.Dataset) -> Figure:
    """Draw what a lever shows in time: voltages, current, tip temperature, heat.

    Where the bias stays what it is, time is logarithmic.
    """
    settles = float(history.bias_V.max()) == float(history.bias_V.min())
    data = history.isel(time=history.time > 0) if settles else history
    style: Any = {"marker": "o" if data.sizes["time"] <= _MARKED else "", "ms": 3}
    with figure(7.4, 5.2, 2, 2, letters=True, sharex=True) as (made, grid):
        voltage, current, tip, heat = grid.ravel()
        voltage.plot(data.time, data.bias_V, color=PURPLE, label="bias V$_b$", **style)
        voltage.plot(data.time, data.lever_V, color=BLUE, label="lever V$_l$", **style)
        if data.reader_V.notnull().any():
            voltage.plot(data.time, data.reader_V, color=GREEN, label="reader V$_r$", **style)
        voltage.set(ylabel="voltage (V)")
        current.plot(data.time, data.current_mA, color=BLUE, **style)
        current.set(ylabel="heater current I$_h$ (mA)")
        tip.plot(data.time, data.tip_K, color=VERMILION, **style)
        tip.set(ylabel="tip temperature (K)")
        for name, label, colour in (
            ("supplied_nJ", "supplied", PURPLE),
            ("stored_nJ", "stored", VERMILION),
            ("air_stored_nJ", "in the air", BLUE),
            ("lost_nJ", "lost", ORANGE),
        ):
            if name == "air_stored_nJ" and not data[name].any():
                continue  # in vacuum
            heat.plot(data.time, data[name], color=colour, label=label, **style)
        heat.set(ylabel="energy (nJ)")
        for axes in (voltage, heat):
            axes.legend()
        for axes in (tip, heat):
            axes.set(xlabel="time (µs)")
        if settles:
            tip.set_xscale("log")
    return made


def small_signals(spectrum: xr.Dataset) -> Figure:
    """Draw the impedance (Nyquist, Bode) and how the tip follows power and bias."""
    with figure(7.4, 5.4, 2, 2, letters=True) as (made, grid):
        nyquist, bode, size, phase = grid.ravel()
        real, imaginary = spectrum.impedance_real_ohm / 1000, spectrum.impedance_imag_ohm / 1000
        nyquist.plot(real, -imaginary, "o-", ms=3, color=BLUE)
        nyquist.set(xlabel="Re Z (kΩ)", ylabel="−Im Z (kΩ)")
        nyquist.axhline(0, color="0.4", lw=0.8)
        bode.plot(spectrum.frequency, real, color=BLUE, label="Re Z")
        bode.plot(spectrum.frequency, imaginary, "--", color=BLUE, label="Im Z")
        bode.set(xlabel="frequency (Hz)", ylabel="impedance (kΩ)")
        for name, label, colour in (
            ("tip_per_power", "by power (K/mW)", VERMILION),
            ("tip_per_bias", "by bias (K/V)", PURPLE),
        ):
            unit = "K_per_mW" if name == "tip_per_power" else "K_per_V"
            size.plot(spectrum.frequency, spectrum[f"{name}_{unit}"], color=colour, label=label)
            angle = spectrum[f"{name}_deg"]
            phase.plot(spectrum.frequency, angle, color=colour, label=label.partition(" (")[0])
        size.set(xlabel="frequency (Hz)", ylabel="change of T$_{tip}$ (K/mW, K/V)", yscale="log")
        phase.set(xlabel="frequency (Hz)", ylabel="phase (°)")
        for axes in (bode, size, phase):
            axes.set_xscale("log")
            axes.legend()
    return made


def harmonics(data: xr.Dataset) -> Figure:
    """Draw amplitude and phase of the harmonics of the lever voltage."""
    with figure(7.4, 3.2, 1, 2, letters=True) as (made, (size, phase)):
        for name, colour in (("first", BLUE), ("second", GREEN), ("third", VERMILION)):
            volts = data[f"{name}_harmonic_V"]
            # without an offset there is no second harmonic, but for rounding errors
            if float(volts.max()) < 1e-9 * float(data.first_harmonic_V.max()):
                continue
            size.plot(data.frequency, volts, color=colour, label=f"{name} harmonic")
            angle = data[f"{name}_harmonic_deg"]
            phase.plot(data.frequency, angle, color=colour, label=f"{name} harmonic")
        size.set(xlabel="frequency (Hz)", ylabel="amplitude of V$_l$ (V)", yscale="log")
        phase.set(xlabel="frequency (Hz)", ylabel="phase (°)")
        for axes in (size, phase):
            axes.set_xscale("log")
            axes.legend()
    return made
