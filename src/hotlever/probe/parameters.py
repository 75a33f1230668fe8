"""What a fit may vary of a probe: its material, its dimensions, circuit and gas."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hotlever.errors import unknown_name
from hotlever.materials import PARAMETERS
from hotlever.materials.parameter import Parameter
from hotlever.text import parameter_named

if TYPE_CHECKING:
    from hotlever.probe.probe import Probe

#: Shares of a dimension or a resistance, of a base temperature, and of what a gas conducts, within
#: which a fit stays.
_OF_THE_VALUE, _OF_THE_BASE, _OF_THE_GAS = (0.5, 1.5), (0.8, 1.2), (0.2, 5.0)
#: What the paper takes as 0: it is varied if it has a prior.
_IMPURITIES = Parameter(
    *("impurity_exponent", "s", "1", 10.0, -2.0, 4.0),
    "power of the temperature in mobility limited by impurities",
)
#: Dimensions of a tip that matter to its lever.
OF_THE_TIP = ("height_um", "half_angle_deg")


def dimensions_of(probe: Probe) -> list[str]:
    """Return the names of all that the drawing says, and the tip if there is one."""
    return [*probe.shape.dimensions(), *(OF_THE_TIP if probe.tip is not None else ())]


def parameters_of(probe: Probe, *, anywhere: bool = False) -> dict[str, Parameter]:
    """Return all that a fit may vary, by name: first the material's parameters.

    With `anywhere`, what counts in other surroundings only as well.

    Examples
    --------
    >>> from hotlever import Probe
    >>> parameters_of(Probe.reference())["heater_width_um"].unit
    'µm'
    """
    shares = dict.fromkeys(dimensions_of(probe), _OF_THE_VALUE)
    shares["base_temperature_K"] = _OF_THE_BASE
    if probe.circuit.series_resistance_ohm > 0:
        shares["series_resistance_ohm"] = _OF_THE_VALUE
    if anywhere or probe.surroundings.medium == "air":
        shares["gas_conductivity"] = _OF_THE_GAS
        if probe.surroundings.surface_gap_um is not None:
            shares["surface_gap_um"] = _OF_THE_VALUE
    parts = (probe.shape, probe.tip, probe.circuit, probe.surroundings)
    meaning = {name: text for part in parts if part for name, text in part.description().items()}
    found = {**PARAMETERS, _IMPURITIES.name: _IMPURITIES}
    for (name, (least, most)), value in zip(shares.items(), probe.at(list(shares)), strict=True):
        found[name] = parameter_named(name)._replace(
            scale=float(value),
            lower=float(least * value),
            upper=float(most * value),
            meaning=meaning[name],
        )
    return found


def parameter_of(probe: Probe, name: str, where: str = "") -> Parameter:
    """Return one of them.

    Raises
    ------
    InputError
        If there is none of this name; the text gives the nearest one.
    """
    known = parameters_of(probe)
    if name not in known:
        raise unknown_name("parameter", name, known, where)
    return known[name]
