"""Levers near a surface: in contact with a sample, or reading their distance to it.

Tables and figures, at rest or in time.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from hotlever.errors import ComputationError, InputError, as_far_as_possible, excerpt, quoted
from hotlever.tasks.arguments import (
    HistoryOptions,
    LeverArguments,
    Plot,
    Reporter,
    Table,
    give_table,
    make_lever,
    notes_of,
    read_surrounded_probe,
    refuse,
    refuse_set,
)
from hotlever.tasks.parsing import (
    parse_bias,
    parse_distances,
    parse_pairs,
    parse_pressures,
    parse_settings,
    parse_times,
)
from hotlever.units import setting

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever import Lever
    from hotlever.lever.noise import NoiseOptions
    from hotlever.probe import Probe
    from hotlever.types import Array


def touch(
    reporter: Reporter,
    *,
    sample: str | None = None,
    radius: str | None = None,
    interface: str | None = None,
    bias: str | None = None,
    history: HistoryOptions,
    lever: LeverArguments,
    output: Table = None,
    plot: Plot = None,
) -> None:
    """Touch a sample with the tip: apex, heat into the sample, change of the current.

    Parameters
    ----------
    sample : LAYER,...
        From the top, such as polymer,100nm,silicon: materials or their W/(m K), each but the last
        with its thickness; what the probe file says if left out.
    radius : LENGTH
        Of the contact, the tip's flat end, such as 5nm.
    interface : RESISTANCE
        Such as 1e7K/W, or for an area 1e-8m2K/W; none at first.
    bias : START:STOP:COUNT
        In volts, ends included, or a single one; 1:11:25 if neither this nor a wave form is given.
    """
    from hotlever.lever.contact import CONTACT_COLUMNS, history_in_contact, sweep_in_contact

    drive = history.read()
    if drive is None:
        why = "goes with a wave form, such as --pulse"
        refuse(why, until=history.until, at=history.at)
    else:
        refuse("does not go with a wave form, which has biases of its own", bias=bias)
        reporter.note(*history.notes(drive))
    read = read_surrounded_probe(reporter, lever)
    changes = parse_settings(lever.set, read)
    told = {
        "sample": (sample, "sample"),
        "radius": (radius, "apex_radius_um"),
        "interface": (interface, "interface_K_per_mW"),
    }
    for option, (text, key) in told.items():
        if text is not None:
            refuse_set(changes, option, [key])
    touching = in_contact(reporter, read, sample, radius, interface)
    biases = parse_bias(bias, touching.lowest_bias_V)
    meshed = make_lever(reporter, touching)
    with reporter.progress("contact") as update:
        if drive is None:
            columns, solve = CONTACT_COLUMNS, partial(sweep_in_contact, meshed, biases)
        else:
            times = parse_times(history.until, history.at)
            columns = ("time_us", *CONTACT_COLUMNS)
            solve = partial(history_in_contact, meshed, drive, *times)
        data, failure = as_far_as_possible(lambda: solve(progress=update))
    if failure is not None and not data.tip_K.size:
        raise failure
    reporter.note(*contact_notes(data))
    give_table(
        reporter,
        data,
        columns,
        output,
        plot,
        lambda figures: figures.contact_overview(data, touching),
    )
    if failure is not None:
        raise failure


def in_contact(
    reporter: Reporter, probe: Probe, sample: str | None, radius: str | None, interface: str | None
) -> Probe:
    """Return a probe whose tip touches a sample, where told in other ways than its file says.

    Raises
    ------
    InputError
        If there is no sample, or what is asked for cannot be.
    """
    from hotlever.probe.tip import EXAMPLE, interface_of, parsed_layers

    changes: dict[str, Any] = {}
    tip = probe.tip or EXAMPLE
    radius_um = tip.apex_radius_um
    if probe.tip is None:
        changes["tip.height_um"] = tip.height_um
    if radius is not None:
        radius_um = setting(radius, "um", "--radius")
        if not 1e-4 <= radius_um <= 10.0:
            raise InputError(
                f"--radius: found '{excerpt(radius)}', expected a length from 0.1 nm to 10 µm, "
                "such as 5nm"
            )
        changes["tip.apex_radius_um"] = radius_um
    if sample is not None:
        parsed_layers(sample, "--sample")
        changes["sample"] = sample
    elif probe.contact is None:
        raise InputError(
            "--sample: found none, expected layers such as polymer,100nm,silicon, or a probe file "
            "with a section [contact]"
        )
    if interface is not None:
        resistance = interface_of(interface, radius_um, "--interface")
        changes["interface_K_per_mW"] = resistance
    if probe.surroundings.medium == "air" and probe.surroundings.surface_gap_um is None:
        changes["surface_gap_um"] = tip.height_um
    touching = probe.with_(**changes) if changes else probe
    if probe.tip is None:
        reporter.note(
            f"the probe has no [tip]: a cone {tip.height_um:g} µm high, of half-angle "
            f"{tip.half_angle_deg:g}°"
        )
    return touching


def contact_notes(data: xr.Dataset) -> list[str]:
    """Return what should be known of a lever in contact, by the bias or in time."""
    note = what_the_current_tells(data) if "current_by_resistance" in data else ""
    return [*notes_of(data), *([note] if note else [])]


def what_the_current_tells(data: xr.Dataset, known: float = 1e-4) -> str:
    """Say how well the sum of resistances is known by the current, where it tells most of it.

    A change of the current is `known` to this share of the current.
    """
    import numpy as np

    with np.errstate(divide="ignore", invalid="ignore"):
        error = known * np.abs(data.current_mA.values / data.current_by_resistance.values)
        parts = data.tip_K_per_mW, data.interface_K_per_mW, data.spreading_K_per_mW
        whole = np.sum([part.values for part in parts], axis=0)
        relative = error / whole
    if not np.isfinite(relative).any():
        return ""
    best = int(np.nanargmin(relative))
    share = relative[best]
    accuracy = f"to {share:.2g} of it" if share < 1 else f"no better than {share:.2g} times over"
    return (
        f"a change of I_h known to {known:g} of I_h tells the sum of resistances, "
        f"{1e3 * whole[best]:.3g} K/W, best at {data.bias_V.values[best]:.4g} V: {accuracy}"
    )


def approach(
    reporter: Reporter,
    *,
    distance: str = "0.3um:3um:10",
    bias: str | None = None,
    pressure: str | None = None,
    bandwidth: str = "1Hz:1kHz",
    amplifier: str = "5nV",
    hooge: float = 0.0,
    vibration: str | None = None,
    lever: LeverArguments,
    output: Table = None,
    plot: Plot = None,
) -> None:
    """Read the distance to a surface: signal, noise, resolution.

    Parameters
    ----------
    distance : START:STOP:COUNT
        From the lever's lower face to the surface, ends included, or a single one.
    bias : START:STOP:COUNT
        In volts, ends included, or a single one; the one up to 11 V that resolves the distances
        best if left out.
    pressure : START:STOP:COUNT
        Of the air, in mbar, spaced evenly in the logarithm, or a single one; what the probe file
        says if left out.
    bandwidth : LOW:HIGH
        Of what is read.
    amplifier : V
        Noise at its input, for each √Hz.
    hooge
        Hooge's parameter of the silicon, for 1/f noise.
    vibration : LENGTH
        Of the lever itself, for each √Hz; none if left out.
    """
    import numpy as np

    from hotlever.lever.lever import COARSE, Lever
    from hotlever.lever.reader import Reader, best_bias, over_surface, rows_of

    distances = parse_distances(distance)
    noise = reader_noise(bandwidth, amplifier, hooge, vibration)
    pressures = None if pressure is None else parse_pressures(pressure)
    read = read_over_a_surface(reporter, lever, distances)
    if pressures is not None:
        refuse_set(parse_pairs("--set", lever.set), "pressure", ["pressure_mbar"])
    above = over_a_surface(reporter, read, lever.medium, distances)
    biases = None if bias is None else parse_bias(bias, above.lowest_bias_V)
    reader = Reader(above, noise)
    coarse = Lever(above, COARSE)
    if biases is None:
        highest_V = 11.0
        with reporter.progress("best bias") as update:
            best_V = best_bias(coarse, distances[[0, -1]], highest_V, noise, update)
        biases = np.array([best_V])
        reporter.note(
            f"of all biases up to {highest_V:g} V {biases.item():.4g} V resolves these "
            "distances best (--bias chooses others)"
        )
    above = jumping_at_tip(reporter, coarse, float(biases[biases.size // 2]))
    meshed = make_lever(reporter, above)
    with reporter.progress("distances") as update:
        data = over_surface(meshed, distances, biases, noise, pressures, progress=update)
    if not np.isfinite(data.tip_K.values).any():
        raise ComputationError(notes_of(data)[0])
    if not reader.is_held and above.circuit.swept != "reader":
        reporter.note(
            "no supply heats the terminal reader ([circuit.reader]): the heater itself is read, "
            f"behind {above.circuit.series_resistance_ohm:g} ohm"
        )
    reporter.note(*notes_of(data), "that films bend the lever when it gets warm is left out")
    reporter.tell_table(best_resolved(data, noise))
    rows = rows_of(data)
    columns = [str(name) for name in rows.data_vars]
    whole = output is not None and output.suffix.lower() == ".nc"
    table = data if whole else rows
    give_table(
        reporter, table, columns, output, plot, lambda figures: figures.reader_overview(data)
    )


def read_over_a_surface(reporter: Reporter, lever: LeverArguments, distances: Array) -> Probe:
    """Read a probe at some distances (µm) from a surface, which settings may tilt."""
    refuse_set(parse_pairs("--set", lever.set), "distance", ["surface_gap_um"])
    # a tilt means nothing without a surface, and the farthest one allows most of it
    gap = f"surface_gap_um={distances.max():.12g}"
    settings = [*(lever.set or []), gap]
    return read_surrounded_probe(reporter, replace(lever, set=settings), finds_air=True)


def over_a_surface(reporter: Reporter, probe: Probe, medium: str | None, distances: Array) -> Probe:
    """Return a probe in air over a surface at the nearest of some distances (µm)."""
    from hotlever.lever.reader import check_distances

    check_distances(probe, distances)
    around = probe.surroundings
    changes: dict[str, Any] = {"surface_gap_um": float(distances.min())}
    if medium is None and around.medium == "vacuum":
        reporter.note("in vacuum a reader sees no surface: the lever is taken in air")
        changes["medium"] = "air"
    if around.accommodation is None:
        changes["accommodation"] = around.with_jump.accommodation
        reporter.note(
            "no accommodation is stated: it is taken as 1 (--set accommodation=0.9 states one)"
        )
    return probe.with_(**changes)


def jumping_at_tip(reporter: Reporter, coarse: Lever, bias_V: float) -> Probe:
    """Return the probe of a coarse lever, with the jump of the air as at its tip at a bias.

    A coarse lever's tip does: the jump length of air some kelvin colder or hotter is the same
    within one per cent. The probe stays as it is if it states a temperature for the jump, or if
    there is no state at this bias.
    """
    from hotlever.probe.surroundings import Surroundings

    probe, usual_K = coarse.probe, Surroundings.model_fields["jump_temperature_K"].default
    if probe.surroundings.jump_temperature_K != usual_K:
        return probe
    try:
        (state,) = coarse.solve([bias_V])
    except ComputationError:
        return probe
    T = round(state.tip_K)
    reporter.note(
        f"the air's temperature jumps as at {T} K, the tip's at {bias_V:.4g} V "
        f"(--set jump_temperature_K=... states another one than {usual_K:g})"
    )
    return probe.with_(jump_temperature_K=T)


def reader_noise(
    bandwidth: str, amplifier: str, hooge: float, vibration: str | None
) -> NoiseOptions:
    """Return what is known of noise beside the lever.

    Raises
    ------
    InputError
        If a value makes no sense.
    """
    from hotlever.lever.noise import NoiseOptions

    low, colon, high = bandwidth.partition(":")
    if not colon:
        found = quoted(bandwidth)
        raise InputError(f"--bandwidth: found {found}, expected LOW:HIGH, such as 1Hz:1kHz")
    return NoiseOptions(
        setting(low, "Hz", "--bandwidth"),
        setting(high, "Hz", "--bandwidth"),
        setting(amplifier, "V", "--amplifier"),
        hooge,
        0.0 if vibration is None else setting(vibration, "nm", "--vibration"),
    )


def best_resolved(data: xr.Dataset, noise: NoiseOptions) -> list[list[str]]:
    """Return rows that say how well the best distance and bias are resolved, and by what."""
    import numpy as np

    density = data.resolution_nm_per_rtHz
    if not np.isfinite(density.values).any():
        return []
    # by its values: at one point xarray would import Dask, which takes as long as to solve a lever
    place = np.unravel_index(np.nanargmin(density.values), density.shape)
    number = dict(zip(density.dims, place, strict=True))

    def best(name: str) -> Any:
        column = data[name]
        return column.values[tuple(number[dim] for dim in column.dims if dim in number)]

    resolution = float(best("resolution_nm_per_rtHz"))
    whole = resolution * np.sqrt(noise.high_Hz - noise.low_Hz)
    where = f"{best('surface_gap_um'):.4g} µm, {best('bias_V'):.4g} V"
    rows = [
        ["resolved best", f"{where}, tip at {best('tip_K'):.0f} K"],
        ["resolution", f"{1e3 * resolution:.3g} pm/√Hz, {whole:.3g} nm in the band"],
        ["noise", f"{1e9 * best('noise_V_per_rtHz'):.3g} nV/√Hz, of its square"],
    ]
    shares = (best("source_V_per_rtHz") / best("noise_V_per_rtHz")) ** 2
    for source, share in zip(data.source.values.tolist(), shares.tolist(), strict=True):
        if share:
            rows.append([f"  {source}", f"{100 * share:.3g} %"])
    if not noise.hooge:
        rows.append(["  1/f noise", "not counted (--hooge)"])
    per_V, per_mW = best("crosstalk_V_per_V"), best("crosstalk_V_per_mW")
    if np.isfinite(per_V):
        rows.append(["cross-talk of the heater", f"{per_V:.3g} V/V, {per_mW:.3g} V/mW"])
    return rows
