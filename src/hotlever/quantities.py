"""Quantities: one table of what datasets, files and figures call each, and its unit.

An observable of a lever is a row here with a symbol, under which files head its column, and a row
of its standard error; and what a lever does not show by itself has a function in
`hotlever.lever.observables`, by which it follows from what it does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr


class Quantity(NamedTuple):
    """A quantity; with a symbol it is one that instruments measure, or its standard error."""

    name: str  #: in datasets, and of the attribute of a `Measurement`
    unit: str
    meaning: str
    symbol: str = ""  #: heads its column in measurement files
    #: Other headings of its column, in small letters without marks; a blank stands between two.
    headings: str = ""
    #: Where the largest value of a column can lie; else its unit is wrong.
    plausible: tuple[float, float] = (0.0, math.inf)
    #: Whether it may be of either sign at a positive bias.
    signed: bool = False
    #: Unit of differences between data and model, and how many of it make one of its own.
    small: tuple[str, float] = ("", 1.0)
    #: Name of the error that all of its data have in common: the scale of its meter.
    scale: str = ""
    #: What figures call it, if not by its meaning alone.
    label: str = ""
    #: Headings that say no more than the unit does: what a file has of this unit counts as the
    #: quantity where it is the only one.
    plain: str = ""

    @property
    def is_temperature(self) -> bool:
        """Whether a thermometer shows it, whose scale is one of the rise above the base."""
        return self.unit == "K"

    @property
    def typed_unit(self) -> str:
        """The unit as it is typed, with a u for micro."""
        return self.unit.replace("µ", "u")

    @property
    def heading(self) -> str:
        """Symbol and unit, as a header row has them."""
        return f"{self.symbol} ({self.typed_unit})"

    @property
    def axis_label(self) -> str:
        """What it is, and its unit."""
        return f"{self.label or self.meaning} ({self.unit})"


#: All of them, by name.
QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        # what instruments and thermometers measure
        Quantity("time_us", "µs", "time", "t"),
        Quantity(
            "lever_V",
            "V",
            "lever voltage",
            "V_l",
            "vl ul vlever ulever lever levervoltage hebelspannung",
            label="lever voltage V$_l$",
        ),
        Quantity(
            "bias_V",
            "V",
            "bias",
            "V_b",
            "vb ub vbias ubias bias biasvoltage vorspannung versorgungsspannung",
            (1e-3, 1e3),
            label="bias V$_b$",
            plain="voltage spannung u source sourcevalue value reading",
        ),
        Quantity(
            "current_mA",
            "mA",
            "heater current",
            "I_h",
            "ih i current heatercurrent levercurrent strom heizstrom heizerstrom hebelstrom",
            (1e-9, 1e3),
            small=("µA", 1e3),
            scale="current_scale",
            label="heater current I$_h$",
            plain="source sourcevalue value reading",
        ),
        Quantity(
            "reader_V",
            "V",
            "reader voltage",
            "V_r",
            "vr ur vreader ureader reader readervoltage readerspannung",
            (1e-9, 1e3),
            small=("mV", 1e3),
            scale="reader_scale",
            label="reader voltage V$_r$",
        ),
        Quantity(
            "bridge_output_V",
            "V",
            "bridge voltage",
            "V_bridge",
            "vbridge ubridge bridge bridgevoltage bridgeoutput bridgeoutputvoltage bridgesignal "
            "ubrücke brücke brückenspannung diagonalspannung",
            (1e-9, 1e3),
            True,
            ("mV", 1e3),
            "bridge_scale",
            label="bridge voltage V$_{bridge}$",
        ),
        Quantity(
            "tip_K",
            "K",
            "tip temperature",
            "T_tip",
            "ttip tip tiptemperature spitzentemperatur",
            (0.0, 5e3),
            small=("K", 1.0),
            scale="raman_scale",
        ),
        Quantity(
            "tip_error_K",
            "K",
            "standard error of the measured tip temperature",
            "dT_tip",
            "dttip δttip",
        ),
        Quantity(
            "current_error_mA", "mA", "standard error of the measured current", "dI_h", "dih δih"
        ),
        Quantity(
            "reader_error_V",
            "V",
            "standard error of the measured reader voltage",
            "dV_r",
            "dvr δvr",
        ),
        Quantity(
            "bridge_output_error_V",
            "V",
            "standard error of the measured bridge voltage",
            "dV_bridge",
            "dvbridge δvbridge",
        ),
        Quantity(
            "apex_K",
            "K",
            "temperature of the apex",
            "T_apex",
            "tapex apex apextemperature",
            (0.0, 5e3),
            small=("K", 1.0),
        ),
        Quantity(
            "apex_error_K",
            "K",
            "standard error of the measured temperature of the apex",
            "dT_apex",
            "dtapex δtapex",
        ),
        Quantity(
            "surface_K",
            "K",
            "sample's surface temperature",
            "T_melt",
            "tmelt meltingpoint meltingtemperature schmelzpunkt schmelztemperatur",
            (0.0, 5e3),
            small=("K", 1.0),
        ),
        Quantity(
            "surface_error_K",
            "K",
            "standard error of the measured surface temperature",
            "dT_melt",
            "dtmelt δtmelt",
        ),
        Quantity(
            "distance_um",
            "µm",
            "distance of the apex to the sample, 0 in contact",
            "D",
            "d distance separation tipsampledistance tipsampleseparation abstand",
        ),
        # what follows from it
        Quantity("bias", "V", "bias", label="bias V$_b$"),
        Quantity("ramp", "", "way of the bias"),
        Quantity("power_mW", "mW", "power dissipated in the lever", label="power P$_l$"),
        Quantity("total_power_mW", "mW", "power into the lever by all supplies"),
        # inside a lever
        Quantity("heater_ohm", "ohm", "heater resistance"),
        Quantity("legs_ohm", "ohm", "resistance of both legs"),
        Quantity("leg1_ohm", "ohm", "resistance of the leg at the supply"),
        Quantity("leg2_ohm", "ohm", "resistance of the leg to ground"),
        Quantity("lever_ohm", "ohm", "resistance of the lever"),
        Quantity("max_K", "K", "highest temperature in the lever"),
        Quantity("ground_current_mA", "mA", "current leaving to ground"),
        Quantity("end_heat_mW", "mW", "heat leaving by the leg ends"),
        Quantity("air_heat_mW", "mW", "heat leaving into the air"),
        Quantity("radiated_mW", "mW", "heat leaving by radiation"),
        Quantity("into_tip_mW", "mW", "heat leaving into a tip in contact"),
        Quantity("sensitivity", "of the observable by the parameter", "derivative at fixed bias"),
        # a tip in contact
        Quantity("apex_stderr_K", "K", "standard error of the temperature of the apex"),
        Quantity("surface_stderr_K", "K", "standard error of the sample's surface temperature"),
        Quantity("sample_mW", "mW", "heat into the sample through the contact"),
        Quantity("beside_mW", "mW", "heat from the tip's side into the sample through air"),
        Quantity("tip_K_per_mW", "K/mW", "thermal resistance of the tip"),
        Quantity("interface_K_per_mW", "K/mW", "thermal resistance of the interface"),
        Quantity("spreading_K_per_mW", "K/mW", "thermal resistance of the sample"),
        Quantity("current_change_mA", "mA", "change of the heater current by the contact"),
        Quantity("tip_change_K", "K", "change of the tip temperature by the contact"),
        Quantity(
            "current_by_resistance", "mA mW/K", "change of the heater current by the resistances"
        ),
        # held by a controller
        Quantity("set_ohm", "ohm", "set point of the resistance"),
        Quantity("set_mW", "mW", "set point of the power"),
        Quantity("state", "1", "number of the state at its set point, the coldest first"),
        Quantity(
            "slope_ohm_per_K", "ohm/K", "change of the resistance by that of the tip temperature"
        ),
        Quantity("slope_mW_per_K", "mW/K", "change of the power by that of the tip temperature"),
        Quantity("resistance_ohm", "ohm", "lever voltage over heater current"),
        Quantity("proportional", "V/kohm", "proportional gain P"),
        Quantity("integral", "V/(kohm ms)", "integral gain I"),
        Quantity("growth_per_us", "1/µs", "rate at which the slowest pole grows"),
        Quantity("settling_us", "µs", "time after which a step has settled within 2 %"),
        Quantity("overshoot", "1", "overshoot as a share of a step"),
        # in time
        Quantity("time", "µs", "time"),
        Quantity("supplied_nJ", "nJ", "electrical energy taken up since the start"),
        Quantity("stored_nJ", "nJ", "heat in the lever above that at the base temperature"),
        Quantity("air_stored_nJ", "nJ", "heat that the air has taken up"),
        Quantity(
            "lost_nJ", "nJ", "heat lost through the leg ends and into the air since the start"
        ),
        Quantity("time_constant_us", "µs", "time constant, negative for what grows"),
        Quantity("heating_us", "µs", "time from 10 to 90 % of the tip's rise"),
        Quantity("cooling_us", "µs", "time from 90 to 10 % of the tip's rise"),
        # small signals
        Quantity("frequency", "Hz", "frequency"),
        Quantity("frequency_Hz", "Hz", "frequency"),
        Quantity("impedance_real_ohm", "ohm", "real part of the impedance"),
        Quantity("impedance_imag_ohm", "ohm", "imaginary part of the impedance"),
        Quantity(
            "tip_per_power_K_per_mW", "K/mW", "change of the tip temperature by that of the power"
        ),
        Quantity("tip_per_power_deg", "deg", "phase of the tip temperature against the power"),
        Quantity(
            "tip_per_bias_K_per_V", "K/V", "change of the tip temperature by that of the bias"
        ),
        Quantity("tip_per_bias_deg", "deg", "phase of the tip temperature against the bias"),
        Quantity(
            "bridge_per_bias_V_per_V", "V/V", "change of the bridge voltage by that of the bias"
        ),
        Quantity("bridge_per_bias_deg", "deg", "phase of the bridge voltage against the bias"),
        *(
            Quantity(f"{name}_{start}harmonic{kind}", unit, f"{what} harmonic of the {of} voltage")
            for start, of in (("", "lever"), ("bridge_", "bridge"))
            for name in ("first", "second", "third")
            for kind, unit, what in (("_V", "V", name), ("_deg", "deg", f"phase of the {name}"))
        ),
        Quantity("mean_tip_K", "K", "mean tip temperature"),
        # over a surface
        Quantity("distance", "µm", "distance to the surface"),
        Quantity("surface_gap_um", "µm", "distance to the surface"),
        Quantity("pressure", "mbar", "pressure of the air"),
        Quantity("pressure_mbar", "mbar", "pressure of the air"),
        Quantity("reader_ohm", "ohm", "resistance of the reader"),
        Quantity("dV_dz_V_per_um", "V/µm", "change of the reader voltage with the distance"),
        Quantity("dlnR_dz_per_um", "1/µm", "relative change of the resistance with the distance"),
        Quantity("noise_V_per_rtHz", "V/√Hz", "noise of the reader voltage"),
        Quantity("source_V_per_rtHz", "V/√Hz", "noise by source"),
        Quantity("resolution_nm_per_rtHz", "nm/√Hz", "distance that equals the noise"),
        Quantity("delay_us", "µs", "delay of the reader voltage after the distance"),
        Quantity(
            "crosstalk_V_per_V", "V/V", "change of the reader voltage with the bias of the heater"
        ),
        Quantity(
            "crosstalk_V_per_mW",
            "V/mW",
            "change of the reader voltage with the power of the heater",
        ),
        # along the heater
        Quantity("position", "µm", "position along the heater"),
        Quantity("temperature", "K", "temperature"),
        Quantity("doping", "cm⁻³", "doping concentration"),
        Quantity("resistivity", "Ω cm", "resistivity"),
        Quantity("resistivity_slope", "Ω cm/K", "slope of the resistivity"),
        # what is sure
        Quantity("tip_stderr_K", "K", "standard error of the tip temperature"),
        Quantity("tip_low_K", "K", "tip temperature, lower 95 % limit"),
        Quantity("tip_high_K", "K", "tip temperature, upper 95 % limit"),
        Quantity("tip_at_power_K", "K", "tip temperature at a power"),
        Quantity("quantile", "%", "quantile"),
        Quantity("inversion_temperature", "K", "inversion temperature of the heater's doping"),
        Quantity("effective_sample_size", "1", "effective sample size"),
        Quantity("delta_chi_square", "1", "rise of chi-square with the other parameters refitted"),
        Quantity("parabola", "1", "rise of chi-square by the standard error"),
        Quantity("refitted", "of the parameter", "optimum of the other parameters"),
        Quantity("interval", "of the parameter", "profile confidence interval"),
        Quantity("level", "1", "confidence level"),
        Quantity("value", "of the quantity", "value"),
        Quantity("stderr", "of the quantity", "standard error"),
        Quantity("counts", "1", "whether the value counts in the mean"),
        Quantity("described", "1", "whether the data of the lever are described"),
        Quantity("mean", "of the quantity", "mean of the levers, weighted by the inverse variance"),
        Quantity("scatter", "of the quantity", "standard deviation between the levers"),
        Quantity("mean_stderr", "of the quantity", "standard error of the mean"),
        Quantity("chi_square", "1", "chi-square of the values about their weighted mean"),
        Quantity("birge_ratio", "1", "root of chi-square over the degrees of freedom"),
        Quantity("height", "V", "height of the pulse"),
        Quantity("height_V", "V", "height of the pulse"),
        Quantity("peak_K", "K", "highest tip temperature of the pulse"),
        Quantity("peak_stderr_K", "K", "standard error of the highest tip temperature"),
        Quantity("end_K", "K", "tip temperature at the end of the pulse"),
        Quantity("end_stderr_K", "K", "standard error of the tip temperature at the end"),
        Quantity("mean_K", "K", "mean tip temperature during the pulse"),
        Quantity("mean_stderr_K", "K", "standard error of the mean tip temperature"),
        Quantity("budget_K", "K", "standard error of the tip temperature by source"),
        Quantity("apex_budget_K", "K", "standard error of the temperature of the apex by source"),
        # what to measure next
        Quantity("what", "", "kind of measurement"),
        Quantity("gain", "K", "how much smaller the standard error gets, per cost"),
        Quantity(
            "stderr_now_K", "K", "standard error of the tip temperature before the measurement"
        ),
        Quantity(
            "stderr_then_K", "K", "standard error of the tip temperature after the measurement"
        ),
        Quantity("added", "1", "measurements made"),
        Quantity("tip_limit_K", "K", "tip temperature, upper 99 % limit"),
        # knee, design and air
        Quantity("knee_K", "K", "tip temperature at the knee"),
        Quantity("knee_mW", "mW", "power at the knee"),
        Quantity("knee_V", "V", "lever voltage at the knee"),
        Quantity("knee_mA", "mA", "heater current at the knee"),
        Quantity("knee_bias_V", "V", "bias at the knee"),
        Quantity("resistance_K", "K", "tip temperature at the highest resistance"),
        Quantity("inversion_K", "K", "inversion temperature of the heater's doping"),
        Quantity("cold_ohm", "ohm", "resistance of the lever when cold"),
        Quantity("k", "1", "power in air over power in vacuum"),
        Quantity("best_k", "1", "the one factor that leaves the smallest error"),
        Quantity("best_error_K", "K", "largest error that the best factor leaves"),
        Quantity("unevenness", "1", "growth of k − 1 from cold to hot"),
        Quantity("gap_um", "µm", "gap between a lever and a surface below it"),
        Quantity("loss", "κ r ΔT", "heat lost by a disc between two planes"),
        Quantity("near", "κ r ΔT", "the same for planes much nearer than the radius"),
        Quantity("far", "κ r ΔT", "the same for planes far away"),
        # tips
        Quantity("height_um", "µm", "height of the tip"),
        Quantity("half_angle_deg", "deg", "half-angle of the tip"),
        Quantity("moved_K", "K", "change of the knee by the tip"),
        Quantity("moved_V", "V", "change of the knee by the tip"),
        Quantity("at_power_K", "K", "largest change of the tip temperature at the same power"),
        Quantity("surface_moved_K", "K", "change of the knee by the tip's surface in air"),
        Quantity("surface_moved_V", "V", "change of the knee by the tip's surface in air"),
        Quantity(
            "surface_at_power_K",
            "K",
            "largest change at the same power by the tip's surface in air",
        ),
        Quantity("fitted_knee_K", "K", "knee of a tipless lever fitted to the one with the tip"),
        Quantity("missed_K", "K", "how far the knee lies above that of the fitted tipless lever"),
        # thermoelectricity
        Quantity(
            "plain_um",
            "µm",
            "place of the hot spot without thermoelectricity, from the heater's centre",
        ),
        Quantity("at_um", "µm", "place of the hot spot, from the heater's centre"),
        Quantity("moved_nm", "nm", "shift of the hot spot in the direction of the current"),
        Quantity("share_nm", "nm", "share of the shift"),
        Quantity("rest_nm", "nm", "share of the shift by neither Thomson nor Peltier heat"),
        Quantity("heat_mW", "mW", "heat set free"),
        Quantity("centre_rise_K", "K", "rise of the temperature at the heater's centre"),
        Quantity("highest_rise_K", "K", "rise of the temperature at the hot spot"),
        Quantity("rms_current_mA", "mA", "root mean square of the current's residuals"),
        Quantity("rms_reader_V", "V", "root mean square of the reader voltage's residuals"),
        Quantity("rms_tip_K", "K", "root mean square of the tip temperature's residuals"),
        # T(P) above the knee
        Quantity("slope_K_per_mW", "K/mW", "slope of a straight line"),
        Quantity("offset_K", "K", "rise where a straight line has no power"),
        Quantity("straight_K", "K", "how far a straight line is off"),
        Quantity("proportional_K", "K", "how far a line through the base temperature is off"),
        Quantity("reach_K", "K", "how far above the knee a straight line holds"),
        Quantity("slope_ratio", "1", "slope of T(P) at the end over that at the knee"),
        Quantity("kappa_ratio", "1", "κ of silicon at the end over that at the knee"),
        Quantity(
            "resistance_K_per_mW",
            "K/mW",
            "thermal resistance of heater and legs, from their squares",
        ),
        Quantity("knee_share", "1", "share of the power in the heater at the knee"),
        Quantity("end_share", "1", "share of the power in the heater at the end"),
        # twins of one material
        Quantity("true_value", "of the parameter", "value of the lever that was measured"),
        # simulation-based calibration
        Quantity("off_K", "K", "tip temperature as calibrated less the true one"),
        Quantity("largest_K", "K", "largest error of the tip temperature"),
        Quantity("coverage", "1", "share of levers whose error is within the band"),
        Quantity("seconds", "s", "processor time of the calibration"),
        # Raman spectra
        Quantity("center_per_cm", "cm-1", "place of the silicon line"),
        Quantity("center_stderr_per_cm", "cm-1", "standard error of the line's place"),
        Quantity("fwhm_per_cm", "cm-1", "full width of the line at half maximum"),
        Quantity("shift_per_cm", "cm-1", "shift of the line against room temperature"),
        Quantity("temperature_K", "K", "tip temperature"),
        Quantity("temperature_error_K", "K", "standard error of the tip temperature"),
        Quantity("temperature_noise_K", "K", "part of its error independent of the others'"),
        Quantity("error", "K", "line reads less true temperature"),
        Quantity("paper_error", "K", "error stated in the paper"),
    )
}
#: Everything that a measurement may hold, by symbol; ``d`` begins that of a standard error.
MEASURANDS = {quantity.symbol: quantity for quantity in QUANTITIES.values() if quantity.symbol}
#: What a lever shows, by the name that users give it.
OBSERVABLES = {
    "current": MEASURANDS["I_h"],
    "reader": MEASURANDS["V_r"],
    "tip": MEASURANDS["T_tip"],
    "bridge": MEASURANDS["V_bridge"],
}
#: What a tip in contact shows of its sample: its apex, and the surface under it, which melts.
OF_A_CONTACT = {"apex": MEASURANDS["T_apex"], "melting": MEASURANDS["T_melt"]}
#: What a fit compares.
FITTED = OBSERVABLES | OF_A_CONTACT
#: Standard deviations of scales where nothing is said, relative: of a meter, and of a thermometer,
#: by the rise above the base (the hot plate's own accuracy, gradients in the laser's spot).
METERS, THERMOMETER = 1e-3, 0.015
Observable = Literal["current", "reader", "tip", "bridge", "apex", "melting"]


def observables_of(data: xr.Dataset) -> Array:
    """Return `OBSERVABLES` of a dataset, (observables, n); NaN of what it does not have."""
    nothing = np.full(data["tip_K"].shape, np.nan)
    names = [observable.name for observable in OBSERVABLES.values()]
    return np.stack([data[name].values if name in data else nothing for name in names])
