"""What a fit may vary of a probe: parameters of the material, dimensions, the series resistance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hotlever.errors import unknown_name
from hotlever.materials import PARAMETERS
from hotlever.materials.material import Parameter
from hotlever.text import parameter_named

if TYPE_CHECKING:
    from hotlever.probe.probe import Probe

#: Shares of a dimension or a resistance, and of what a gas conducts, within which a fit stays.
_OF_THE_VALUE, _OF_THE_GAS = (0.5, 1.5), (0.2, 5.0)


def parameters_of(probe: Probe, *, anywhere: bool = False) -> dict[str, Parameter]:
    """Return all that a fit may vary, by name: first the material's parameters.

    With `anywhere`, what counts in other surroundings only as well.

    Examples
    --------
    >>> from hotlever import Probe
    >>> parameters_of(Probe.reference())["heater_width_um"].unit
    'µm'
    """
    shares = dict.fromkeys(probe.shape.dimensions(), _OF_THE_VALUE)
    if probe.circuit.series_resistance_ohm > 0:
        shares["series_resistance_ohm"] = _OF_THE_VALUE
    if anywhere or probe.surroundings.medium == "air":
        shares["gas_conductivity"] = _OF_THE_GAS
    parts = (probe.shape, probe.circuit, probe.surroundings)
    meaning = {name: text for part in parts for name, text in part.description().items()}
    found = dict(PARAMETERS)
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
