"""What instruments measure: each quantity with its symbol, unit and headings in files."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from hotlever.datasets import QUANTITIES
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr


class Measurand(NamedTuple):
    """A quantity that instruments measure, or its standard error."""

    symbol: str  #: heads its column in measurement files
    name: str  #: in datasets, and of the attribute of a `Measurement`
    unit: str  #: in datasets
    #: Other headings of its column, in small letters without blanks and marks.
    headings: tuple[str, ...] = ()
    #: Where the largest value of a column can lie; else its unit is wrong.
    plausible: tuple[float, float] = (0.0, math.inf)
    #: Whether it may be of either sign at a positive bias.
    signed: bool = False
    #: Unit of differences between data and model, and how many of it make one of its own.
    small: tuple[str, float] = ("", 1.0)

    @property
    def heading(self) -> str:
        """Symbol and unit, as a header row has them."""
        return f"{self.symbol} ({self.unit})"

    @property
    def meaning(self) -> str:
        """What it is."""
        return QUANTITIES[self.name][1]


_BIAS = ("vb", "ub", "vbias", "ubias", "bias", "biasvoltage", "vorspannung", "versorgungsspannung")
_LEVER = ("vl", "ul", "vlever", "ulever", "lever", "levervoltage", "hebelspannung")
_CURRENT = (
    *("ih", "i", "current", "heatercurrent", "levercurrent"),
    *("strom", "heizstrom", "heizerstrom", "hebelstrom"),
)
_READER = ("vr", "ur", "vreader", "ureader", "reader", "readervoltage", "readerspannung")
_BRIDGE = (
    *("vbridge", "ubridge", "bridge", "bridgevoltage", "bridgeoutput", "bridgeoutputvoltage"),
    *("bridgesignal", "ubrücke", "brücke", "brückenspannung", "diagonalspannung"),
)
_TIP = ("ttip", "tip", "tiptemperature", "spitzentemperatur")
_APEX = ("tapex", "apex", "apextemperature")
_MELTING = ("tmelt", "meltingpoint", "meltingtemperature", "schmelzpunkt", "schmelztemperatur")
_DISTANCE = ("d", "distance", "separation", "tipsampledistance", "tipsampleseparation", "abstand")
#: Everything that a measurement may hold, by symbol; ``d`` begins that of a standard error.
MEASURANDS = {
    measurand.symbol: measurand
    for measurand in (
        Measurand("t", "time_us", "us"),
        Measurand("V_l", "lever_V", "V", _LEVER),
        Measurand("V_b", "bias_V", "V", _BIAS, (1e-3, 1e3)),
        Measurand("I_h", "current_mA", "mA", _CURRENT, (1e-9, 1e3), small=("µA", 1e3)),
        Measurand("V_r", "reader_V", "V", _READER, (1e-9, 1e3), small=("mV", 1e3)),
        Measurand("V_bridge", "bridge_output_V", "V", _BRIDGE, (1e-9, 1e3), True, ("mV", 1e3)),
        Measurand("T_tip", "tip_K", "K", _TIP, (0.0, 5e3), small=("K", 1.0)),
        Measurand("dT_tip", "tip_error_K", "K", ("dttip", "δttip")),
        Measurand("dI_h", "current_error_mA", "mA", ("dih", "δih")),
        Measurand("dV_r", "reader_error_V", "V", ("dvr", "δvr")),
        Measurand("dV_bridge", "bridge_output_error_V", "V", ("dvbridge", "δvbridge")),
        Measurand("T_apex", "apex_K", "K", _APEX, (0.0, 5e3), small=("K", 1.0)),
        Measurand("dT_apex", "apex_error_K", "K", ("dtapex", "δtapex")),
        Measurand("T_melt", "surface_K", "K", _MELTING, (0.0, 5e3), small=("K", 1.0)),
        Measurand("dT_melt", "surface_error_K", "K", ("dtmelt", "δtmelt")),
        Measurand("D", "distance_um", "um", _DISTANCE),
    )
}
_BUFFER = ("source", "sourcevalue", "value", "reading")
#: Headings that say no more than the unit does: what a file has of this unit counts as the
#: quantity where it is the only one.
PLAIN = {"V_b": ("voltage", "spannung", "u", *_BUFFER), "I_h": _BUFFER}
#: What a lever shows, by the name that users give it. How each follows is said in
#: `hotlever.lever.observables`.
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
Observable = Literal["current", "reader", "tip", "bridge", "apex", "melting"]


def observables_of(data: xr.Dataset) -> Array:
    """Return `OBSERVABLES` of a dataset, (observables, n); NaN of what it does not have."""
    nothing = np.full(data["tip_K"].shape, np.nan)
    names = [measurand.name for measurand in OBSERVABLES.values()]
    return np.stack([data[name].values if name in data else nothing for name in names])
