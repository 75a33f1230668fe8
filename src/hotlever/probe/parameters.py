"""What a fit may vary of a probe: its materials, its dimensions, circuit and gas."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hotlever.errors import unknown_name
from hotlever.materials import LOW_DOPED, PARAMETERS, Kind, full_name
from hotlever.materials.parameters import Parameter, parameter_named
from hotlever.probe.shapes import EDGE_BIAS, MOST_EDGE_BIAS

if TYPE_CHECKING:
    from hotlever.probe.probe import Probe

#: Shares of a dimension or a resistance, of a base temperature, and of what a gas conducts, within
#: which a fit stays.
_OF_THE_VALUE, _OF_THE_BASE, _OF_THE_GAS = (0.5, 1.5), (0.8, 1.2), (0.2, 5.0)
#: How far off all edges usually are (µm).
_USUAL_BIAS = 0.1
#: Dimensions of a tip that matter to its lever.
OF_THE_TIP = ("height_um", "half_angle_deg")


def dimensions_of(probe: Probe) -> list[str]:
    """Return the names of all that the drawing says, and the tip if there is one."""
    return [*probe.shape.dimensions(), *(OF_THE_TIP if probe.tip is not None else ())]


def of_materials(probe: Probe, *, in_time: bool = False) -> dict[str, Parameter]:
    """Return all parameters of what a probe is made of, by name: first those a fit usually varies.

    With `in_time`, what counts in time only as well. Those of ``[material]`` keep the paper's
    order; two kinds of silicon share c_κ there.

    Examples
    --------
    >>> from hotlever import Probe
    >>> list(of_materials(Probe.reference()))
    ['c_kappa', 'delta', 'n_d', 'p', 'a0', 'a1', 'impurity_exponent', 'n_hd']
    """
    usual = dict.fromkeys(usual_parameters(probe))
    found = {
        full_name(material, own): known._replace(name=full_name(material, own))
        for material, kind in _kinds(probe)
        for own, known in kind.parameters.items()
        if in_time or not known.in_time
    }
    return {name: found[name] for name in [*usual, *(name for name in found if name not in usual)]}


def usual_parameters(probe: Probe) -> tuple[str, ...]:
    """Return what a fit varies of a probe unless it is told otherwise: the paper's six, if it can.

    Of other materials what each kind says, as far as it matters here: without a border with
    high-doped silicon there is no diffusion length.

    Examples
    --------
    >>> from hotlever import Probe
    >>> usual_parameters(Probe.reference())
    ('c_kappa', 'delta', 'n_d', 'p', 'a0', 'a1')
    """
    tapered = {one.stack[0].material for one in probe.layout().regions if one.taper is not None}
    found = [
        full_name(material, own)
        for material, kind in _kinds(probe)
        for own in kind.usual
        if own in kind.parameters and (own != "delta" or material in tapered)
    ]
    plain = [name for name in PARAMETERS if name in found]
    return tuple(dict.fromkeys([*plain, *found]))


def _kinds(probe: Probe) -> list[tuple[str, Kind]]:
    """Return the materials of a probe, low-doped silicon first."""
    return sorted(probe.made_of.items(), key=lambda item: item[0] != LOW_DOPED)


def heat_capacities(probe: Probe) -> tuple[str, ...]:
    """Return what a fit varies of what was measured in time unless it is told otherwise.

    Examples
    --------
    >>> from hotlever import Probe
    >>> heat_capacities(Probe.reference())
    ('heat_capacity_scale',)
    """
    return tuple(name for name, known in of_materials(probe, in_time=True).items() if known.in_time)


def own_name(name: str) -> str:
    """Return the name of a parameter without that of its material.

    Examples
    --------
    >>> own_name("film.tcr"), own_name("n_d")
    ('tcr', 'n_d')
    """
    return name.rpartition(".")[2]


def parameters_of(
    probe: Probe, *, anywhere: bool = False, in_time: bool = False
) -> dict[str, Parameter]:
    """Return all that a fit may vary, by name: first the materials' parameters.

    With `in_time`, what counts in time only as well; with `anywhere`, in other surroundings too.

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
    found = of_materials(probe, in_time=anywhere or in_time)
    for (name, (least, most)), value in zip(
        shares.items(), probe.values(list(shares)), strict=True
    ):
        found[name] = parameter_named(name)._replace(
            scale=float(value),
            lower=float(least * value),
            upper=float(most * value),
            meaning=meaning[name],
        )
    if EDGE_BIAS in found:
        found[EDGE_BIAS] = found[EDGE_BIAS]._replace(
            scale=_USUAL_BIAS, lower=-MOST_EDGE_BIAS, upper=MOST_EDGE_BIAS
        )
    return found


def parameter_of(probe: Probe, name: str, where: str = "", *, in_time: bool = False) -> Parameter:
    """Return one of them.

    Raises
    ------
    InputError
        If there is none of this name; the text gives the nearest one.
    """
    known = parameters_of(probe, in_time=in_time)
    if name not in known:
        raise unknown_name("parameter", name, known, where)
    return known[name]
