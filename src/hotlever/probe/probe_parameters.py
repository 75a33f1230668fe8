"""The table of what a fit may vary of a probe: its materials, its dimensions, circuit and gas.

What materials have stands in `hotlever.materials.parameters`; here dimensions and circuit are
added, and what the probe's values say of bounds and scales.
"""

from __future__ import annotations

import math
from typing import Any

from hotlever.errors import InputError, unknown_name
from hotlever.materials import LOW_DOPED, PARAMETERS, Kind, Parameter, full_name
from hotlever.materials.parameters import own_name, parameter_named
from hotlever.probe.circuit import MOST_OFFSET_V
from hotlever.probe.parts import ProbeParts
from hotlever.probe.shapes import EDGE_BIAS, MOST_EDGE_BIAS
from hotlever.probe.tip import MOST_HALF_ANGLE_DEG, OUT_OF_CONTACT

#: Relative spread of a resistor that was measured.
RESISTANCE = 1e-3
#: Dimensions of a tip that matter to its lever, the last in contact only.
OF_THE_TIP = ("height_um", "half_angle_deg", "apex_radius_um")


def dimensions_of(probe: ProbeParts) -> list[str]:
    """Return the names of all that the drawing says, and the tip if there is one."""
    return [*probe.shape.dimensions(), *_of_the_tip(probe)]


def _of_the_tip(probe: ProbeParts) -> tuple[str, ...]:
    if probe.tip is None:
        return ()
    return OF_THE_TIP if probe.contact is not None else OF_THE_TIP[:-1]


def nuisances(probe: ProbeParts) -> list[str]:
    """Return the dimensions of the drawing that matter to the tip, each by itself."""
    # the reader does not matter to the tip
    held = ("reader_length_um", "reader_centre_um", *probe.shape.tied())
    return [
        name
        for name in probe.shape.dimensions()
        if name not in held and own_name(name) != EDGE_BIAS
    ]


def of_materials(
    probe: ProbeParts, *, anywhere: bool = False, in_time: bool = False
) -> dict[str, Parameter]:
    """Return all parameters of what a probe is made of, by name: first those a fit usually varies.

    With `in_time`, what counts in time only as well; with `anywhere`, what counts with effects that
    are off too. Those of ``[material]`` keep the paper's order; two kinds of silicon share c_κ
    there. What nothing tells of has no prior.

    Examples
    --------
    >>> from hotlever import Probe
    >>> list(of_materials(Probe.reference()))[:9]
    ['c_kappa', 'delta', 'n_d', 'p', 'a0', 'a1', 'impurity_exponent', 'intrinsic_scale', 'kappa_1']
    """
    usual, effects = usual_parameters(probe), probe.physics.effects
    counting = {"", *effects, *(["in time"] if in_time else [])}
    table = {
        name: parameter._replace(
            name=name,
            spread=parameter.spread if name in usual or not parameter.usual else None,
            value=float(getattr(kind, own)),
        )
        for material, kind in _kinds(probe)
        for own, parameter in kind.parameters.items()
        for name in [full_name(material, own)]
        if anywhere or parameter.counts in counting
    }
    return {name: table[name] for name in dict.fromkeys([*usual, *table])}


def usual_parameters(probe: ProbeParts) -> tuple[str, ...]:
    """Return what a fit varies of a probe unless it is told otherwise: the paper's six, if it can.

    Of other materials what each kind says, as far as it matters here: without a border with
    high-doped silicon there is no diffusion length.

    Examples
    --------
    >>> from hotlever import Probe
    >>> usual_parameters(Probe.reference())
    ('c_kappa', 'delta', 'n_d', 'p', 'a0', 'a1')
    """
    tapered = {region.material for region in probe.layout().regions if region.taper is not None}
    usual = [
        full_name(material, own)
        for material, kind in _kinds(probe)
        for own in kind.usual
        if own in kind.parameters and (own != "delta" or material in tapered)
    ]
    plain = [name for name in PARAMETERS if name in usual]
    return tuple(dict.fromkeys([*plain, *usual]))


def _kinds(probe: ProbeParts) -> list[tuple[str, Kind]]:
    """Return the materials of a probe, low-doped silicon first."""
    return sorted(probe.made_of.items(), key=lambda item: item[0] != LOW_DOPED)


def heat_capacities(probe: ProbeParts) -> tuple[str, ...]:
    """Return what a fit varies of what was measured in time unless it is told otherwise.

    Examples
    --------
    >>> from hotlever import Probe
    >>> heat_capacities(Probe.reference())
    ('heat_capacity_scale',)
    """
    return tuple(
        name
        for name, parameter in of_materials(probe, in_time=True).items()
        if parameter.counts == "in time"
    )


def parameters_of(
    probe: ProbeParts, *, anywhere: bool = False, in_time: bool = False
) -> dict[str, Parameter]:
    """Return all that a fit may vary, by name: first the materials' parameters.

    With `in_time`, what counts in time only as well; with `anywhere`, in other surroundings and
    with effects that are off too.

    Examples
    --------
    >>> from hotlever import Probe
    >>> parameters_of(Probe.reference())["heater_width_um"].unit
    'µm'
    """
    table = of_materials(probe, anywhere=anywhere, in_time=in_time)
    parts = (probe.shape, probe.tip, probe.contact, probe.circuit, probe.surroundings)
    meaning = {name: text for part in parts if part for name, text in part.description().items()}

    def add(name: str, spread: float | None, within: Any = (0.5, 1.5), **own: Any) -> None:
        """Add a parameter that stays within multiples of its value, unless its own limits are."""
        (value,) = probe.values([name]).tolist()
        lower, upper = (share * value for share in within)
        usual = {"scale": value, "lower": lower, "upper": upper, "spread": spread, "value": value}
        named = parameter_named(name)
        words = meaning.get(name, named.meaning)
        table[name] = named._replace(**{**usual, "meaning": words, **own})

    matter = nuisances(probe)
    shifts: dict[str, Any] = {"scale": 0.1, "lower": -MOST_EDGE_BIAS, "upper": MOST_EDGE_BIAS}
    for name in probe.shape.dimensions():
        own = shifts if own_name(name) == EDGE_BIAS else {}
        add(name, 0.05 if name in matter else None, **own)
    of_micrograph = 0.2
    for name in _of_the_tip(probe):
        # half again of a blunt cone's angle would be no cone, see `Tip`
        blunt = name == "half_angle_deg" and 1.5 * probe.values([name])[0] > MOST_HALF_ANGLE_DEG
        add(name, of_micrograph, **({"upper": MOST_HALF_ANGLE_DEG} if blunt else {}))
    if probe.contact is not None and 0 < probe.contact.interface_K_per_mW < OUT_OF_CONTACT:
        # nothing is known of it but its power of ten
        add("interface_K_per_mW", math.log(10.0), (1e-3, 1e3))
    # of a room, or a hot plate and its thermocouple
    add("base_temperature_K", 1.0, (0.8, 1.2), relative=False)
    if anywhere or probe.circuit.chip_K_per_mW:
        usual = probe.usual_chip_K_per_mW
        # in pulses the spreading counts alone, which is known; the holder is not
        limits = {"scale": usual, "lower": 0.01, "upper": 100.0, "relative": False}
        add("chip_K_per_mW", None if in_time else 0.6 * usual, **limits)
    if probe.circuit.series_resistance_ohm > 0:
        add("series_resistance_ohm", RESISTANCE)
    if probe.circuit.has_bridge:
        add("bridge_upper_ohm", RESISTANCE)
        add("bridge_lower_ohm", RESISTANCE)
        limits = {"scale": 0.01, "lower": -MOST_OFFSET_V, "upper": MOST_OFFSET_V, "relative": False}
        add("bridge_offset_V", None, **limits)
    if anywhere or probe.surroundings.medium == "air":
        # humidity, what is around, and dimensions as far as they matter to what air takes up
        add("gas_conductivity", 0.1, (0.2, 5.0))
        if probe.surroundings.surface_gap_um is not None:
            # that of a tip in contact is its height
            add("surface_gap_um", 0.1 if probe.contact is None else of_micrograph)
    return table


def parameter_of(
    probe: ProbeParts, name: str, where: str = "", *, in_time: bool = False
) -> Parameter:
    """Return one of them.

    Raises
    ------
    InputError
        If there is none of this name; the text gives the nearest one.
    """
    table = parameters_of(probe, in_time=in_time)
    if name == "interface_K_per_mW" and name not in table and probe.contact is not None:
        raise InputError(
            f"{where}{': ' * bool(where)}{name} = {probe.contact.interface_K_per_mW:g}: expected a "
            "value above 0 to start from, in [contact] of the probe file"
        )
    if name not in table:
        raise unknown_name("parameter", name, table, where)
    return table[name]
