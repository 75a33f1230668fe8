"""Figures of levers: sweeps, profiles, held states, histories, small signals; and at a sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter

from hotlever.contact.picture import contact_picture
from hotlever.estimate.power_law import EQ12, PowerLaw
from hotlever.figures.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    HEAT,
    LINES,
    MEASURED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    apart_at_turns,
    axis_label,
    bridge_beside,
    curve,
    entitle,
    figure,
    from_zero,
    marker,
    settled,
    some_of,
)
from hotlever.probe import Probe
from hotlever.spieser2017 import BASE_TEMPERATURE_K, POWER_LAW_SPREAD_K, PublishedPoint
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr


def material_curves(curves: Mapping[str, tuple[Array, Array, Array | None]]) -> Figure:
    """Draw thermal conductivity and resistivity of materials against the temperature.

    Parameters
    ----------
    curves : mapping of str to tuple
        From `hotlever.materials.catalogue.curves`.
    """
    with figure(7.4, 4.6, 1, 2) as (fig, (left, right)):
        materials = zip(curves.items(), cycle(LINES), strict=False)
        for (name, (T, kappa, rho)), (line, colour) in materials:
            left.semilogy(T, kappa, line, color=colour, label=name)
            if rho is not None:
                right.semilogy(T, rho, line, color=colour)
        left.set(xlabel="temperature (K)", ylabel="thermal conductivity (W m⁻¹ K⁻¹)")
        right.set(xlabel="temperature (K)", ylabel="resistivity (Ω cm)")
        fig.legend(loc="outside lower center", ncols=4)
    return fig


def sweep_overview(sweep: xr.Dataset) -> Figure:
    """Draw what a sweep gives against the bias: current, voltages, tip temperature, I-V.

    The way back, if it goes back too, is dashed.
    """
    if "ramp" in sweep.coords:
        # the last row of the way up is the first of that down
        top = int((sweep.ramp == "up").sum())
        sweep, back = sweep.isel(bias=slice(top)), sweep.isel(bias=slice(max(top - 1, 0), None))
    else:
        back = None
    with figure(7.4, 5.2, 2, 2, letters=True) as (fig, grid):
        current, voltage, tip, iv = grid.ravel()
        if back is not None:
            style: Any = {"mfc": "none", "label": "way back"}
            curve(current, back, "bias_V", "current_mA", "o--", color=SKY, **style)
            curve(voltage, back, "bias_V", "lever_V", "o--", color=SKY, **style)
            curve(voltage, back, "bias_V", "reader_V", "s--", color=GREEN, mfc="none")
            curve(tip, back, "bias_V", "tip_K", "o--", color=ORANGE, **style)
            curve(iv, back, "lever_V", "current_mA", "o--", color=SKY, **style)
        curve(current, sweep, "bias_V", "current_mA", "o-", color=BLUE, label="I$_h$, swept supply")
        held = [name for name in map(str, sweep.data_vars) if name.endswith("_mA")]
        held = [name for name in held if name not in ("current_mA", "ground_current_mA")]
        for name, colour in zip(held, cycle(COLOURS[1:]), strict=False):
            label = f"at {name.removesuffix('_mA')}"
            current.plot(sweep.bias_V, sweep[name], "s-", color=colour, label=label)
        if held:
            current.set(ylabel="current into the lever (mA)")
        if held or back is not None:
            current.legend()
        curve(voltage, sweep, "bias_V", "lever_V", "o-", color=BLUE, label="lever V$_l$")
        curve(voltage, sweep, "bias_V", "reader_V", "s-", color=GREEN, label="reader V$_r$")
        voltage.set(ylabel="voltage (V)")
        voltage.legend()
        bridge_beside(voltage, sweep, "bias_V", marker="^")
        curve(tip, sweep, "bias_V", "tip_K", "o-", color=VERMILION)
        curve(iv, sweep, "lever_V", "current_mA", "o-", color=BLUE)
        entitle(fig, sweep)
    return fig


def iv_curves(
    sweeps: Mapping[str, xr.Dataset],
    knees: Mapping[str, xr.Dataset] | None = None,
    measured: xr.Dataset | None = None,
    published: Sequence[PublishedPoint] = (),
) -> Figure:
    """Draw heater current against lever voltage (paper's Figs. 6a and 10a), with the knees.

    Parameters
    ----------
    sweeps : mapping of str to xarray.Dataset
        By label; those of more than 40 biases as lines alone.
    knees : mapping of str to xarray.Dataset, optional
        By label of a sweep and in their order, the one state returned by `Lever.knee`.
    measured : xarray.Dataset, optional
        From `Measurement.dataset`.
    published : sequence of `hotlever.spieser2017` operating points, optional
    """
    with figure(4.8, 3.6) as (fig, axes):
        for (name, sweep), colour in zip(sweeps.items(), cycle(COLOURS), strict=False):
            line = marker(sweep, "bias") or "-"
            curve(axes, sweep, "lever_V", "current_mA", line, color=colour, label=name)
        if measured is not None:
            curve(axes, measured, "lever_V", "current_mA", **MEASURED)
        for (name, knee), colour in zip((knees or {}).items(), cycle(COLOURS), strict=False):
            seen = f"knee{'' if len(sweeps) < 2 else f' in {name}'}: {knee.tip_K.item():.0f} K"
            seen += f", {knee.lever_V.item():.2f} V, {knee.current_mA.item():.2f} mA"
            axes.plot(knee.lever_V, knee.current_mA, "D", ms=6, color=colour, label=seen)
        for index, point in enumerate(published):
            label = None if index else "published operating points"
            ring: Any = {"mfc": "none", "mec": VERMILION, "ms": 9, "ls": "none", "label": label}
            axes.plot(point.lever_V, point.current_mA, "o", **ring)
            at: Any = {"xytext": (-4, -13), "textcoords": "offset points", "ha": "right"}
            axes.annotate(point.name, (point.lever_V, point.current_mA), fontsize=8, **at)
        datasets = [*sweeps.values(), *([] if measured is None else [measured])]
        volts, currents = (
            np.concatenate([data[name].values for data in datasets])
            for name in ("lever_V", "current_mA")
        )
        axes.set(xlim=from_zero(volts), ylim=from_zero(currents))
        entitle(fig, *sweeps.values())
        axes.legend(loc="upper left")
    return fig


def temperature_power(
    sweep: xr.Dataset,
    law: PowerLaw = EQ12,
    measured: xr.Dataset | None = None,
    base_temperature_K: float = BASE_TEMPERATURE_K,
) -> Figure:
    """Draw tip temperature against power beside the power law (paper's Fig. 6b)."""

    def expected(power: Any) -> Array:
        return law.tip_temperature(power, base_temperature_K)

    with figure(4.6, 4.6, 2, 1, sharex=True, height_ratios=(2.2, 1.0)) as (fig, (axes, below)):
        power = np.linspace(0, float(sweep.power_mW.max()) * 1.03, 800)
        jump = np.searchsorted(power, law.threshold_mW)
        for part, label in ((slice(0, jump), "power law, Eq. 12"), (slice(jump, None), None)):
            axes.plot(power[part], expected(power[part]), "--", color=ORANGE, label=label)
        model: Any = {"color": BLUE, "marker": marker(sweep, "bias"), "label": "model"}
        for data, style in ((sweep, model), (measured, MEASURED)):
            if data is not None:
                curve(axes, data, "power_mW", "tip_K", **style)
                below.plot(data.power_mW, data.tip_K - expected(data.power_mW), **style)
        below.axhspan(-POWER_LAW_SPREAD_K, POWER_LAW_SPREAD_K, color="0.92", zorder=0)
        below.axhline(0, color="0.4", lw=0.8)
        below.set(xlabel=axis_label("power_mW"), ylabel="T$_{tip}$ − law (K)")
        below.set(xlim=from_zero(sweep.power_mW))
        axes.legend(loc="upper left")
        where: Any = {"xycoords": "axes fraction", "color": "0.4", "fontsize": 8}
        below.annotate(f"±{POWER_LAW_SPREAD_K:.0f} K", (0.02, 0.06), **where)
        entitle(fig, sweep)
    return fig


def resistances(sweep: xr.Dataset) -> Figure:
    """Draw heater, leg and total resistance against tip temperature (paper's Fig. 5)."""
    with figure(4.2, 3.4) as (fig, axes):
        for name, label, colour, mark in (
            ("lever_ohm", "lever, total", BLACK, "s"),
            ("heater_ohm", "heater R$_h$", VERMILION, "o"),
            ("legs_ohm", "legs R$_{l1}$ + R$_{l2}$", BLUE, "^"),
        ):
            if not np.isnan(sweep[name].values).all():  # legs with different currents have none
                style: Any = {"color": colour, "marker": marker(sweep, "bias", mark)}
                axes.plot(sweep.tip_K, sweep[name] / 1000, **style, label=label)
        axes.set(
            xlabel=axis_label("tip_K"), ylabel="resistance (kΩ)", ylim=from_zero(sweep.lever_ohm)
        )
        entitle(fig, sweep)
        axes.legend()
    return fig


def doping_profile(profile: xr.Dataset) -> Figure:
    """Draw doping and local inversion temperature along the heater (paper's Fig. 7a)."""
    with figure(4.6, 3.4) as (fig, axes):
        curve(axes, profile, "position", "doping", color=BLUE)
        axes.set(yscale="log")
        axes.yaxis.label.set_color(BLUE)
        right = axes.twinx()
        right.plot(profile.position, profile.inversion_temperature, "--", color=VERMILION)
        right.set_ylabel("inversion temperature (K)", color=VERMILION)
        entitle(fig, profile)
        right.spines["right"].set_visible(True)
        right.grid(False)
    return fig


def heater_profiles(profiles: Mapping[str, xr.Dataset]) -> Figure:
    """Draw local resistivity and temperature along the heater (paper's Fig. 7b).

    Solid where dρ/dT > 0, dashed where it is negative.

    Parameters
    ----------
    profiles : mapping of str to xarray.Dataset
        From `heater_profile`, by the name of the operating point.
    """
    with figure(5.2, 5.2, 2, 1, sharex=True) as (fig, (upper, lower)):
        for (name, profile), colour in zip(profiles.items(), cycle(COLOURS), strict=False):
            rho, metallic = profile.resistivity, profile.resistivity_slope.values > 0
            # let the dashed part reach the solid one
            inverted = ~metallic | ~np.roll(metallic, 1) | ~np.roll(metallic, -1)
            for part, line in ((metallic, "-"), (inverted & ~metallic.all(), "--")):
                masked_profile = profile.assign(resistivity=rho.where(part))
                curve(upper, masked_profile, "position", "resistivity", line, color=colour)
            seen = f"{profile.attrs['lever_V']:.2f} V, {profile.attrs['current_mA']:.2f} mA"
            label = f"{name}: {seen}"
            curve(lower, profile, "position", "temperature", color=colour, label=label)
        upper.set(ylim=(0, None))
        solid = Line2D([], [], color="0.3", label="dρ/dT > 0")
        dashed = Line2D([], [], color="0.3", ls="--", label="dρ/dT < 0")
        upper.legend(handles=[solid, dashed], loc="upper right")
        low, high = lower.get_ylim()
        lower.set_ylim(low, high + 0.35 * (high - low))
        entitle(fig, *profiles.values())
        lower.legend(loc="upper left")
    return fig


def held_states(data: xr.Dataset, curve: xr.Dataset | None = None) -> Figure:
    """Draw the states at set points: the held quantity and the bias against the tip temperature.

    Parameters
    ----------
    data, curve : xarray.Dataset
        Of `hotlever.lever.set_points.hold`.
    """
    of_power = "set_mW" in data
    column, scale = ("set_mW", 1.0) if of_power else ("set_ohm", 1000.0)
    with figure(7.4, 3.4, 1, 2, letters=True) as (fig, (quantity, bias)):
        if curve is not None:
            whole = curve.power_mW if of_power else curve.lever_V / curve.current_mA
            style: Any = {"color": "0.6", "lw": 1.0, "label": "all states"}
            quantity.plot(curve.tip_K, whole, **style)
            bias.plot(curve.tip_K, curve.bias_V, **style)
        for number, colour in zip(np.unique(data.state).tolist(), cycle(COLOURS), strict=False):
            some = data.isel(bias=data.state.values == number)
            label = f"state {number:g} of a set point"
            for axes, values in ((quantity, some[column] / scale), (bias, some.bias_V)):
                axes.plot(some.tip_K, values, "o", color=colour, label=label)
        highest = 1.25 * float(data[column].max()) / scale
        if curve is not None:
            # a resistance has poles where other supplies turn the current: no room for these
            highest = max(highest, min(whole.max().item(), 1.5 * whole.quantile(0.9).item()))
        quantity.set(
            xlabel=axis_label("tip_K"),
            ylabel="power P$_l$ (mW)" if of_power else "resistance V$_l$/I$_h$ (kΩ)",
            ylim=(0.0, 1.05 * highest),
        )
        bias.set(xlabel=axis_label("tip_K"), ylabel=axis_label("bias_V"))
        quantity.legend()
        entitle(fig, data)
    return fig


def history_overview(history: xr.Dataset) -> Figure:
    """Draw what a lever shows in time: voltages, current, tip temperature, heat.

    Where the bias stays what it is, time is logarithmic.
    """
    data = history.isel(time=history.time > 0) if settled(history) else history
    style: Any = {"marker": marker(data, "time"), "ms": 3}
    energies = {"supplied_nJ": ("supplied", PURPLE), "stored_nJ": ("stored", VERMILION)}
    if data.air_stored_nJ.values.any():
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


# --- at a sample ----------------------------------------------------------------------------------


def contact_overview(data: xr.Dataset, probe: Probe) -> Figure:
    """Draw tip, contact and sample with their resistances, and temperatures, heat and current.

    Parameters
    ----------
    data : xarray.Dataset
        Of `hotlever.lever.contact`, by bias or in time.
    probe : Probe
        In contact.
    """
    along = "time_us" if "time" in data.sizes else "bias_V"
    (dimension,) = data.apex_K.dims
    mark = f"{marker(data, str(dimension))}-"
    with figure(9.6, 5.2) as (fig, axes):
        axes.remove()
        grid = fig.add_gridspec(3, 2, width_ratios=(1.15, 1.0))
        hottest = data.isel({dimension: int(np.argmax(data.tip_K.values))})
        _draw(fig.add_subplot(grid[:, 0]), hottest, probe)
        temperature, heat, current = (fig.add_subplot(grid[row, 1]) for row in range(3))
        curve(temperature, data, along, "tip_K", mark, color=VERMILION, label="tip at the lever")
        curve(temperature, data, along, "apex_K", mark, color=PURPLE, label="apex")
        temperature.set(ylabel="temperature (K)")
        temperature.legend()
        through = ("sample_mW", ORANGE, "through the contact"), ("beside_mW", BLUE, "through air")
        for name, colour, label in through[: 1 + bool((data.beside_mW > 1e-9).any())]:
            heat.plot(data[along], 1e3 * data[name], mark, color=colour, label=label)
        heat.set(ylabel="heat into the\nsample (µW)")
        heat.legend()
        current.plot(data[along], 1e3 * data.current_change_mA, mark, color=BLUE)
        current.set(ylabel="change of I$_h$\nat contact (µA)", xlabel=axis_label(along))
        for above in (temperature, heat):
            above.set(xlabel="")
            above.tick_params(labelbottom=False)
        entitle(fig, data)
    return fig


def _draw(axes: Axes, state: xr.Dataset, probe: Probe) -> None:
    """Draw lever, tip and sample of one state, coloured by temperature."""
    tip = probe.tip
    assert tip is not None
    base, hot, apex = probe.circuit.base_temperature_K, float(state.tip_K), float(state.apex_K)
    drawn = contact_picture(probe, hot)
    heat, scale = mpl.colormaps[HEAT], Normalize(base, max(hot, base + 1.0))
    width = drawn.half_width
    for number, (name, top, bottom) in enumerate(drawn.layers):
        grey = str(0.78 + 0.16 * (number % 2))
        axes.fill_between([-width, width], bottom, top, facecolor=grey)
        axes.text(-0.97 * width, (top + bottom) / 2.0, name, va="center", fontsize=8)
    for corners, T in drawn.pieces:
        axes.fill(*zip(*corners, strict=True), facecolor=heat(scale(T)), lw=0.0)
    for line in drawn.outlines:
        axes.plot(*zip(*line, strict=True), color="0.3", lw=0.8)

    def word(height: float, text: str) -> None:
        axes.text(1.06 * width, height, text, va="center", fontsize=8)

    high, low = drawn.height[0], drawn.bottom
    end = f"r = {1e3 * tip.apex_radius_um:.4g} nm"
    word(high + 0.35, f"heater: {hot:.0f} K")
    word(0.6 * high, f"cone, {tip.height_um:g} µm: {_per_watt(state.tip_K_per_mW)}")
    word(0.12 * high, f"apex: {apex:.0f} K")
    word(0.0, f"interface, {end}: {_per_watt(state.interface_K_per_mW)}")
    word(0.3 * low, f"spreading: {_per_watt(state.spreading_K_per_mW)}")
    word(0.5 * low, f"heat: {1e3 * float(state.sample_mW):.3g} µW")
    word(low, f"far away: {base:.0f} K")
    # less heat (mW) is none but for rounding
    if float(state.beside_mW) > 1e-9:
        air = f"air: {1e3 * float(state.beside_mW):.3g} µW"
        axes.text(-0.97 * width, 0.08 * high, air, fontsize=8)
    axes.set(xlim=(-1.05 * width, 2.45 * width), ylim=(low - 0.2, drawn.top + 0.2), xticks=[])
    axes.set_yticks(*zip(*drawn.ticks, strict=True))
    axes.tick_params(labelsize=8)
    axes.grid(visible=False)
    axes.spines[["bottom", "right", "top"]].set_visible(False)
    axes.set_title(f"where it is hottest, at {float(state.bias_V):.4g} V")


def _per_watt(resistance: Any) -> str:
    """Return a thermal resistance (K/mW) as text."""
    value = 1e3 * float(resistance)
    return f"{value:.3g} K/W" if value > 0 else "none"


class _Plain(LogFormatter):
    """Numbers of a logarithmic axis as they are."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a number; empty where it has none."""
        return f"{x:g}" if super().__call__(x, pos) else ""


def reader_overview(data: xr.Dataset) -> Figure:
    """Draw what a reader shows, by distance to the surface or else by bias.

    Parameters
    ----------
    data : xarray.Dataset
        Of `hotlever.lever.reader.over_surface`.
    """
    along = "distance" if data.sizes["distance"] > 1 or data.sizes["bias"] == 1 else "bias"
    x_name = {"distance": "surface_gap_um", "bias": "bias_V"}[along]
    labels = {"distance": "{:.3g} µm", "bias": "{:.4g} V", "pressure": "{:.3g} mbar"}
    others = [name for name in labels if name in data.sizes and name != along]
    points = [
        dict(zip(others, indices, strict=True))
        for indices in np.ndindex(*(data.sizes[name] for name in others))
    ]
    chosen = np.unique(np.linspace(0, len(points) - 1, min(6, len(points))).round())
    curves = [data.isel(points[int(number)]) for number in chosen]
    best = data.isel(data.resolution_nm_per_rtHz.argmin(...))
    of_best = data.sel({name: best[name].item() for name in others})
    mark = f"{marker(data, along)}-"
    with figure(8.2, 5.6, 2, 2, letters=True) as (fig, ((voltage, slope), (noise, resolution))):
        for curve, colour in zip(curves, COLOURS, strict=False):
            label = ", ".join(labels[name].format(curve[name].item()) for name in others)
            style = {"color": colour, "label": label}
            x = curve[x_name]
            voltage.plot(x, curve.reader_V, mark, **style)
            for axes, values in (
                (slope, 10.0 * np.abs(curve.dlnR_dz_per_um)),
                (resolution, 1e3 * curve.resolution_nm_per_rtHz),
            ):
                axes.plot(*apart_at_turns(curve.dlnR_dz_per_um, x, values), mark, **style)
        voltage.set(ylabel="reader voltage (V)")
        slope.set(ylabel="|d ln R/dz| (10$^{-4}$/nm)", yscale="log")
        resolution.set(ylabel="resolution (pm/√Hz)", yscale="log")
        noise.plot(of_best[x_name], 1e9 * of_best.noise_V_per_rtHz, "k" + mark, label="all")
        for source in data.source.values.tolist():
            part = of_best.source_V_per_rtHz.sel(source=source)
            if (part**2 > 1e-3 * of_best.noise_V_per_rtHz**2).any():
                noise.plot(of_best[x_name], 1e9 * part, mark, label=source)
        at = ", ".join(labels[name].format(best[name].item()) for name in others)
        noise.set(ylabel=f"noise at {at} (nV/√Hz)", yscale="log")
        noise.legend(fontsize=7)
        if len(curves) > 1:
            slope.legend(fontsize=7, title=some_of(len(curves), len(points), "curves"))
        for axes in (voltage, slope, noise, resolution):
            axes.set(xlabel=axis_label(x_name))
        for axes in (slope, noise, resolution):
            for which in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
                which(_Plain(minor_thresholds=(2, 0.5)))
        entitle(fig, data, more=f"read at the terminal {data.attrs['read_at']}")
    return fig
