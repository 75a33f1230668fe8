"""What a fit may vary of a probe: parameters of the material, dimensions, the series resistance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hotlever.errors import unknown_name
from hotlever.materials import PARAMETERS
from hotlever.materials.material import Parameter

if TYPE_CHECKING:
    from hotlever.probe.probe import Probe

#: Shares of a dimension, or of a resistance, within which a fit stays.
_LEAST, _MOST = 0.5, 1.5


def parameters_of(probe: Probe, *, anywhere: bool = False) -> dict[str, Parameter]:
    """Return all that a fit may vary, by name: first the material's parameters.

    With `anywhere`, what counts in other surroundings only as well.

    Examples
    --------
    >>> from hotlever import Probe
    >>> parameters_of(Probe.reference())["heater_width_um"].unit
    'µm'
    """
    meaning = probe.shape.description()
    found = dict(PARAMETERS)
    for name, value in probe.shape.dimensions().items():
        symbol = name.removesuffix("_um").replace("_", " ")
        found[name] = Parameter(
            name, symbol, "µm", value, _LEAST * value, _MOST * value, meaning[name]
        )
    name = "series_resistance_ohm"
    if (value := probe.circuit.series_resistance_ohm) > 0:
        meaning = probe.circuit.description()
        found[name] = Parameter(
            name, "R_s", "Ω", value, _LEAST * value, _MOST * value, meaning[name]
        )
    if anywhere or probe.surroundings.medium == "air":
        name, value = "gas_conductivity", probe.surroundings.gas_conductivity
        meaning = probe.surroundings.description()
        found[name] = Parameter(
            name, "κ_gas/κ_air", "1", 1.0, 0.2 * value, 5 * value, meaning[name]
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
