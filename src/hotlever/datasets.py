"""What stands in hotlever's datasets: one name, one unit, one meaning for each quantity."""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hotlever import __version__, plotting
from hotlever.errors import InputError
from hotlever.files import whole_file, write_text
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

#: Attribute of a written dataset, see `checksum`.
CHECKSUM = "checksum"
#: Name: unit and meaning.
QUANTITIES: dict[str, tuple[str, str]] = {
    # what an instrument and a thermometer see
    "bias": ("V", "bias"),
    "bias_V": ("V", "bias"),
    "current_mA": ("mA", "heater current"),
    "lever_V": ("V", "lever voltage"),
    "reader_V": ("V", "reader voltage"),
    "bridge_output_V": ("V", "bridge voltage"),
    "tip_K": ("K", "tip temperature"),
    "ramp": ("", "way of the bias"),
    "power_mW": ("mW", "power dissipated in the lever"),
    "total_power_mW": ("mW", "power into the lever by all supplies"),
    "tip_error_K": ("K", "standard error of the measured tip temperature"),
    "current_error_mA": ("mA", "standard error of the measured current"),
    "reader_error_V": ("V", "standard error of the measured reader voltage"),
    "bridge_output_error_V": ("V", "standard error of the measured bridge voltage"),
    # inside a lever
    "heater_ohm": ("ohm", "heater resistance"),
    "legs_ohm": ("ohm", "resistance of both legs"),
    "leg1_ohm": ("ohm", "resistance of the leg at the supply"),
    "leg2_ohm": ("ohm", "resistance of the leg to ground"),
    "lever_ohm": ("ohm", "resistance of the lever"),
    "max_K": ("K", "highest temperature in the lever"),
    "ground_current_mA": ("mA", "current leaving to ground"),
    "end_heat_mW": ("mW", "heat leaving by the leg ends"),
    "air_heat_mW": ("mW", "heat leaving into the air"),
    "radiated_mW": ("mW", "heat leaving by radiation"),
    "into_tip_mW": ("mW", "heat leaving into a tip in contact"),
    "sensitivity": ("of the observable by the parameter", "derivative at fixed bias"),
    # a tip in contact
    "apex_K": ("K", "temperature of the apex"),
    "surface_K": ("K", "sample's surface temperature"),
    "apex_stderr_K": ("K", "standard error of the temperature of the apex"),
    "surface_stderr_K": ("K", "standard error of the sample's surface temperature"),
    "apex_error_K": ("K", "standard error of the measured temperature of the apex"),
    "surface_error_K": ("K", "standard error of the measured surface temperature"),
    "distance_um": ("µm", "distance of the apex to the sample, 0 in contact"),
    "sample_mW": ("mW", "heat into the sample through the contact"),
    "beside_mW": ("mW", "heat from the tip's side into the sample through air"),
    "tip_K_per_mW": ("K/mW", "thermal resistance of the tip"),
    "interface_K_per_mW": ("K/mW", "thermal resistance of the interface"),
    "spreading_K_per_mW": ("K/mW", "thermal resistance of the sample"),
    "current_change_mA": ("mA", "change of the heater current by the contact"),
    "tip_change_K": ("K", "change of the tip temperature by the contact"),
    "current_by_resistance": ("mA mW/K", "change of the heater current by the resistances"),
    # held by a controller
    "set_ohm": ("ohm", "set point of the resistance"),
    "set_mW": ("mW", "set point of the power"),
    "state": ("1", "number of the state at its set point, the coldest first"),
    "slope_ohm_per_K": ("ohm/K", "change of the resistance by that of the tip temperature"),
    "slope_mW_per_K": ("mW/K", "change of the power by that of the tip temperature"),
    "resistance_ohm": ("ohm", "lever voltage over heater current"),
    "proportional": ("V/kohm", "proportional gain P"),
    "integral": ("V/(kohm ms)", "integral gain I"),
    "growth_per_us": ("1/µs", "rate at which the slowest pole grows"),
    "settling_us": ("µs", "time after which a step has settled within 2 %"),
    "overshoot": ("1", "overshoot as a share of a step"),
    # in time
    "time": ("µs", "time"),
    "time_us": ("µs", "time"),
    "supplied_nJ": ("nJ", "electrical energy taken up since the start"),
    "stored_nJ": ("nJ", "heat in the lever above that at the base temperature"),
    "air_stored_nJ": ("nJ", "heat that the air has taken up"),
    "lost_nJ": ("nJ", "heat lost through the leg ends and into the air since the start"),
    "time_constant_us": ("µs", "time constant, negative for what grows"),
    "heating_us": ("µs", "time from 10 to 90 % of the tip's rise"),
    "cooling_us": ("µs", "time from 90 to 10 % of the tip's rise"),
    # small signals
    "frequency": ("Hz", "frequency"),
    "frequency_Hz": ("Hz", "frequency"),
    "impedance_real_ohm": ("ohm", "real part of the impedance"),
    "impedance_imag_ohm": ("ohm", "imaginary part of the impedance"),
    "tip_per_power_K_per_mW": ("K/mW", "change of the tip temperature by that of the power"),
    "tip_per_power_deg": ("deg", "phase of the tip temperature against the power"),
    "tip_per_bias_K_per_V": ("K/V", "change of the tip temperature by that of the bias"),
    "tip_per_bias_deg": ("deg", "phase of the tip temperature against the bias"),
    "bridge_per_bias_V_per_V": ("V/V", "change of the bridge voltage by that of the bias"),
    "bridge_per_bias_deg": ("deg", "phase of the bridge voltage against the bias"),
    **{
        f"{name}_{start}harmonic{kind}": (unit, f"{what} harmonic of the {of} voltage")
        for start, of in (("", "lever"), ("bridge_", "bridge"))
        for name in ("first", "second", "third")
        for kind, unit, what in (("_V", "V", name), ("_deg", "deg", f"phase of the {name}"))
    },
    "mean_tip_K": ("K", "mean tip temperature"),
    # over a surface
    **dict.fromkeys(("distance", "surface_gap_um"), ("µm", "distance to the surface")),
    **dict.fromkeys(("pressure", "pressure_mbar"), ("mbar", "pressure of the air")),
    "reader_ohm": ("ohm", "resistance of the reader"),
    "dV_dz_V_per_um": ("V/µm", "change of the reader voltage with the distance"),
    "dlnR_dz_per_um": ("1/µm", "relative change of the resistance with the distance"),
    "noise_V_per_rtHz": ("V/√Hz", "noise of the reader voltage"),
    "source_V_per_rtHz": ("V/√Hz", "noise by source"),
    "resolution_nm_per_rtHz": ("nm/√Hz", "distance that equals the noise"),
    "delay_us": ("µs", "delay of the reader voltage after the distance"),
    "crosstalk_V_per_V": ("V/V", "change of the reader voltage with the bias of the heater"),
    "crosstalk_V_per_mW": ("V/mW", "change of the reader voltage with the power of the heater"),
    # along the heater
    "position": ("µm", "position along the heater"),
    "temperature": ("K", "temperature"),
    "doping": ("cm⁻³", "doping concentration"),
    "resistivity": ("Ω cm", "resistivity"),
    "resistivity_slope": ("Ω cm/K", "slope of the resistivity"),
    # what is sure
    "tip_stderr_K": ("K", "standard error of the tip temperature"),
    "tip_low_K": ("K", "tip temperature, lower 95 % limit"),
    "tip_high_K": ("K", "tip temperature, upper 95 % limit"),
    "tip_at_power_K": ("K", "tip temperature at a power"),
    "quantile": ("%", "quantile"),
    "inversion_temperature": ("K", "inversion temperature of the heater's doping"),
    "log_probability": ("1", "logarithm of the posterior density, up to a constant"),
    "rhat": ("1", "rank-normalised split R-hat between the ensembles"),
    "effective_sample_size": ("1", "effective sample size"),
    "acceptance_fraction": ("1", "share of accepted proposals"),
    "delta_chi_square": ("1", "rise of chi-square with the other parameters refitted"),
    "parabola": ("1", "rise of chi-square by the standard error"),
    "refitted": ("of the parameter", "optimum of the other parameters"),
    "interval": ("of the parameter", "profile confidence interval"),
    "level": ("1", "confidence level"),
    "value": ("of the quantity", "value"),
    "stderr": ("of the quantity", "standard error"),
    "counts": ("1", "whether the value counts in the mean"),
    "described": ("1", "whether the data of the lever are described"),
    "mean": ("of the quantity", "mean of the levers, weighted by the inverse variance"),
    "scatter": ("of the quantity", "standard deviation between the levers"),
    "mean_stderr": ("of the quantity", "standard error of the mean"),
    "chi_square": ("1", "chi-square of the values about their weighted mean"),
    "birge_ratio": ("1", "root of chi-square over the degrees of freedom"),
    "height": ("V", "height of the pulse"),
    "height_V": ("V", "height of the pulse"),
    "peak_K": ("K", "highest tip temperature of the pulse"),
    "peak_stderr_K": ("K", "standard error of the highest tip temperature"),
    "end_K": ("K", "tip temperature at the end of the pulse"),
    "end_stderr_K": ("K", "standard error of the tip temperature at the end"),
    "mean_K": ("K", "mean tip temperature during the pulse"),
    "mean_stderr_K": ("K", "standard error of the mean tip temperature"),
    "budget_K": ("K", "standard error of the tip temperature by source"),
    "apex_budget_K": ("K", "standard error of the temperature of the apex by source"),
    # what to measure next
    "what": ("", "kind of measurement"),
    "gain": ("K", "how much smaller the standard error gets, per cost"),
    "stderr_now_K": ("K", "standard error of the tip temperature before the measurement"),
    "stderr_then_K": ("K", "standard error of the tip temperature after the measurement"),
    "added": ("1", "measurements made"),
    "tip_limit_K": ("K", "tip temperature, upper 99 % limit"),
    # knee, design and air
    "knee_K": ("K", "tip temperature at the knee"),
    "knee_mW": ("mW", "power at the knee"),
    "knee_V": ("V", "lever voltage at the knee"),
    "knee_mA": ("mA", "heater current at the knee"),
    "knee_bias_V": ("V", "bias at the knee"),
    "resistance_K": ("K", "tip temperature at the highest resistance"),
    "inversion_K": ("K", "inversion temperature of the heater's doping"),
    "cold_ohm": ("ohm", "resistance of the lever when cold"),
    "k": ("1", "power in air over power in vacuum"),
    "best_k": ("1", "the one factor that leaves the smallest error"),
    "best_error_K": ("K", "largest error that the best factor leaves"),
    "unevenness": ("1", "growth of k − 1 from cold to hot"),
    "gap_um": ("µm", "gap between a lever and a surface below it"),
    "loss": ("κ r ΔT", "heat lost by a disc between two planes"),
    "near": ("κ r ΔT", "the same for planes much nearer than the radius"),
    "far": ("κ r ΔT", "the same for planes far away"),
    # tips
    "height_um": ("µm", "height of the tip"),
    "half_angle_deg": ("deg", "half-angle of the tip"),
    "moved_K": ("K", "change of the knee by the tip"),
    "moved_V": ("V", "change of the knee by the tip"),
    "at_power_K": ("K", "largest change of the tip temperature at the same power"),
    "surface_moved_K": ("K", "change of the knee by the tip's surface in air"),
    "surface_moved_V": ("V", "change of the knee by the tip's surface in air"),
    "surface_at_power_K": ("K", "largest change at the same power by the tip's surface in air"),
    "fitted_knee_K": ("K", "knee of a tipless lever fitted to the one with the tip"),
    "missed_K": ("K", "how far the knee lies above that of the fitted tipless lever"),
    # thermoelectricity
    "plain_um": ("µm", "place of the hot spot without thermoelectricity, from the heater's centre"),
    "at_um": ("µm", "place of the hot spot, from the heater's centre"),
    "moved_nm": ("nm", "shift of the hot spot in the direction of the current"),
    "share_nm": ("nm", "share of the shift"),
    "rest_nm": ("nm", "share of the shift by neither Thomson nor Peltier heat"),
    "heat_mW": ("mW", "heat set free"),
    "centre_rise_K": ("K", "rise of the temperature at the heater's centre"),
    "highest_rise_K": ("K", "rise of the temperature at the hot spot"),
    "rms_current_mA": ("mA", "root mean square of the current's residuals"),
    "rms_reader_V": ("V", "root mean square of the reader voltage's residuals"),
    "rms_tip_K": ("K", "root mean square of the tip temperature's residuals"),
    # T(P) above the knee
    "slope_K_per_mW": ("K/mW", "slope of a straight line"),
    "offset_K": ("K", "rise where a straight line has no power"),
    "straight_K": ("K", "how far a straight line is off"),
    "proportional_K": ("K", "how far a line through the base temperature is off"),
    "reach_K": ("K", "how far above the knee a straight line holds"),
    "slope_ratio": ("1", "slope of T(P) at the end over that at the knee"),
    "kappa_ratio": ("1", "κ of silicon at the end over that at the knee"),
    "resistance_K_per_mW": ("K/mW", "thermal resistance of heater and legs, from their squares"),
    "knee_share": ("1", "share of the power in the heater at the knee"),
    "end_share": ("1", "share of the power in the heater at the end"),
    # twins of one material
    "true_value": ("of the parameter", "value of the lever that was measured"),
    # simulation-based calibration
    "off_K": ("K", "tip temperature as calibrated less the true one"),
    "largest_K": ("K", "largest error of the tip temperature"),
    "coverage": ("1", "share of levers whose error is within the band"),
    "seconds": ("s", "processor time of the calibration"),
    # Raman spectra
    "center_per_cm": ("cm-1", "place of the silicon line"),
    "center_stderr_per_cm": ("cm-1", "standard error of the line's place"),
    "fwhm_per_cm": ("cm-1", "full width of the line at half maximum"),
    "shift_per_cm": ("cm-1", "shift of the line against room temperature"),
    "temperature_K": ("K", "tip temperature"),
    "temperature_error_K": ("K", "standard error of the tip temperature"),
    "error": ("K", "line reads less true temperature"),
    "paper_error": ("K", "error stated in the paper"),
}
#: What sweeps and histories of a lever have that a controller holds.
_OF_SET_POINTS = {
    *("set_ohm", "set_mW", "state", "slope_ohm_per_K", "slope_mW_per_K"),
    "resistance_ohm",
}


def in_a_file(data: xr.Dataset, columns: Sequence[str]) -> list[str]:
    """Return the columns of a file: the usual ones, and those that only some levers have.

    These are of a bridge, of set points, and of terminals and monitors, which are named by users.
    """
    own = [str(name) for name in data.data_vars]
    some = {name for name in own if "bridge_" in name or name in _OF_SET_POINTS}
    return [*columns, *(name for name in own if name in some or name not in QUANTITIES)]


def labelled(
    columns: Mapping[str, Any],
    dimensions: str | Sequence[str] = "bias",
    coordinates: Mapping[str, Any] | None = None,
    **attributes: Any,
) -> xr.Dataset:
    """Return columns as a dataset with units and meanings.

    Parameters
    ----------
    columns : mapping of str to array_like
        Of `QUANTITIES`; a tuple gives the dimensions of its own before the values, and unit and
        meaning of any other after them.
    dimensions : str or sequence of str
        Of the other columns.
    coordinates : mapping, optional
        As xarray has them.
    **attributes
        Of the dataset, beside the version of the software.
    """
    import xarray as xr  # takes half a second, which not every command has to wait for

    offer_plots()
    return xr.Dataset(
        {name: quantity(name, dimensions, values) for name, values in columns.items()},
        {name: quantity(name, name, values) for name, values in (coordinates or {}).items()},
        {**attributes, "software": f"hotlever {__version__}"},
    )


class Plots:
    """What hotlever does with its datasets: ``data.hotlever.plot()`` draws one."""

    def __init__(self, data: xr.Dataset) -> None:
        self._data = data

    def plot(self) -> Figure:
        """Return the figure that belongs to the dataset; see `hotlever.figures.figure_of`.

        `hotlever.save_figure` writes it to a file.

        Examples
        --------
        >>> import hotlever
        >>> sweep = hotlever.sweep(hotlever.Probe.reference(), [1.0, 2.0])
        >>> len(sweep.hotlever.plot().axes)
        4
        """
        figure: Figure = plotting.figures().figure_of(self._data)
        return figure


@cache
def offer_plots() -> None:
    """Let all datasets of xarray have `Plots`."""
    import xarray as xr

    xr.register_dataset_accessor("hotlever")(Plots)


def quantity(name: str, dimensions: str | Sequence[str], values: Any) -> xr.Variable:
    """Return a variable with its unit and meaning; for tuples see `labelled`.

    Of other arrays xarray would ask whether they are Dask's, and import Dask for that where it is
    installed: a third of a second.
    """
    import pandas as pd
    import xarray as xr

    own, array, *stated = values if isinstance(values, tuple) else (dimensions, values)
    unit_and_meaning = zip(("units", "long_name"), QUANTITIES.get(name, ()), strict=False)
    array, attributes = np.asarray(array), stated[0] if stated else dict(unit_and_meaning)
    if array.ndim == 0:
        own = ()
    elif own == name and array.dtype.kind in "if":
        return xr.Variable(own, pd.Index(array), attributes)
    try:
        return xr.Variable(own, array, attributes, fastpath=True)
    except TypeError:  # a version of xarray that does not know it
        return xr.Variable(own, array, attributes)


def csv_text(data: xr.Dataset, columns: Sequence[str]) -> str:
    """Return columns of a dataset as CSV text; empty where a value does not exist.

    What lies along a line has a column for each point, counted from 0 behind the name.
    """
    flat: dict[str, Array] = {}
    for name in columns:
        values, (stem, _, unit) = data[name].values, name.rpartition("_")
        lines = {f"{stem}.{point}_{unit}": column for point, column in enumerate(values.T)}
        flat |= {name: values} if values.ndim == 1 else lines
    rows = (
        ",".join(f"{value:.10g}" if math.isfinite(value) else "" for value in row)
        for row in zip(*flat.values(), strict=True)
    )
    return "\n".join([",".join(flat), *rows]) + "\n"


def frame_text(frame: Any, **options: Any) -> str:
    """Return a pandas DataFrame as CSV text; empty where there is no finite number.

    The options are those of its ``to_csv``.
    """
    finite = frame.replace([math.inf, -math.inf], math.nan)
    return str(finite.to_csv(lineterminator="\n", **options))


def write_dataset(data: xr.Dataset, path: str | os.PathLike[str], columns: Sequence[str]) -> None:
    """Write a dataset as ``.csv`` (some columns) or ``.nc`` (everything).

    Raises
    ------
    InputError
        If the suffix is neither, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".csv":
        write_text(path, csv_text(data, columns))
    elif suffix == ".nc":
        with whole_file(path) as temporary:
            # any reader knows damaged numbers by sums of their own; only the sum over all knows
            # those whose address in the file is damaged
            numbers = [name for name in data.variables if data[name].dtype.kind in "if"]
            sums = {name: {"fletcher32": True} for name in numbers if data[name].ndim}
            summed = data.assign_attrs({CHECKSUM: checksum(data)})
            summed.to_netcdf(temporary, engine="netcdf4", encoding=sums)
    else:
        raise InputError(f"{path}: unknown file type '{suffix}', expected .csv or .nc")


def checksum(data: xr.Dataset) -> int:
    """Return a sum over all numbers of a dataset, by which a damaged file is known."""
    total = 0
    for name in sorted(map(str, data.variables)):
        values = data[name].values
        if values.dtype.kind == "f":
            # files do not keep what kind of NaN it was
            total = zlib.crc32(np.where(np.isnan(values), np.nan, values).tobytes(), total)
    return total
