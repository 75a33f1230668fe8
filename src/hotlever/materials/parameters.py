"""The table of all parameters of materials: unit, bounds, scale and what is known beforehand.

A new parameter of a material is a row here and a field of its kinds (`hotlever.materials.kinds`),
made of the row by `field_of`; whatever asks for parameters meets it then. Probes add their
dimensions, circuit and gas (`hotlever.probe.probe_parameters`), and texts and axes ask here how a
parameter is named.
"""

from __future__ import annotations

import math
import operator
import re
from typing import Any, NamedTuple

from pydantic import Field

from hotlever.errors import InputError
from hotlever.materials.departures import DEPARTURES, Departure, departure_of
from hotlever.spieser2017 import PUBLISHED_SCATTER

#: What the two kinds of silicon are called that the section ``[material]`` describes.
LOW_DOPED, HIGH_DOPED = "low-doped", "high-doped"


class Parameter(NamedTuple):
    """One quantity that a fit may vary, as users meet it.

    A fit divides by the `scale`, to work with numbers of order one, and stays between `lower` and
    `upper`, within which levers make sense.

    Attributes
    ----------
    name, symbol, unit : str
        In files, in the paper, and of its values.
    scale, lower, upper : float
    meaning : str
    spread : float, optional
        Standard deviation of the prior that it has unless another is stated; none if left out.
    relative : bool
        Whether that is a share of the value: a standard deviation of the logarithm.
    counts : str
        With what it counts alone: ``in time``, or an effect of `hotlever.probe.surroundings`.
    exact : bool
        Whether no value outside the bounds has a meaning.
    usual : bool
        Whether a fit varies it unless it is told otherwise.
    value : float
        What it is in a probe, or where a probe file leaves it out; NaN if that must state it.
    """

    name: str
    symbol: str
    unit: str
    scale: float
    lower: float
    upper: float
    meaning: str
    spread: float | None = None
    relative: bool = True
    counts: str = ""
    exact: bool = False
    usual: bool = False
    value: float = math.nan

    @property
    def bounds(self) -> tuple[float, float]:
        """The lowest and the highest value."""
        return self.lower, self.upper


def _table(*rows: Parameter) -> dict[str, Parameter]:
    return {row.name: row for row in rows}


def _emissivity(value: float) -> Parameter:
    return Parameter(
        *("emissivity", "ε", "1", 1.0, 0.0, 1.0),
        "emissivity of a face, which counts with radiation",
        spread=0.7,
        counts="radiation",
        exact=True,
        value=value,
    )


def _heat_capacity() -> Parameter:
    return Parameter(
        *("heat_capacity", "c", "J cm⁻³ K⁻¹", 1.0, 1.0, 5.0),
        "heat capacity, which counts in time",
        counts="in time",
    )


def _scale(of: str, symbol: str) -> Parameter:
    """Return the row of the scale of a law that a probe file states."""
    meaning = f"scale of {of} where that is a table or a formula"
    # films differ from the bulk, and from each other
    return Parameter(f"{of}_scale", symbol, "1", 1.0, 0.2, 5.0, meaning, spread=0.2, usual=True)


def _coefficients(departure: Departure) -> list[Parameter]:
    """Return the rows of the coefficients of a law's departure.

    By their scale a first step of a search is a standard deviation.
    """
    return [
        Parameter(
            *(name, f"{name.rpartition('_')[0]}{'₁₂₃'[number]}", "1", 10.0, -10.0, 10.0),
            f"departure of the law of the {departure.words}, mode {number + 1}; 0: none",
            spread=1.0,
            relative=False,
            value=0.0,
        )
        for number, name in enumerate(departure.names)
    ]


#: All parameters of silicon: first the six that the paper fits, in its order.
OF_SILICON = _table(
    *(
        # nominal doping is as good as the makers' own tolerance
        Parameter(
            *row, spread=0.15 if row[0] == "n_d" else PUBLISHED_SCATTER[row[0]][1], usual=True
        )
        for row in (
            ("c_kappa", "c_κ", "1", 1.0, 0.1, 1.5, "scale of the thermal conductivity"),
            ("delta", "Δ", "µm", 1.0, 0.05, 2.0, "diffusion length of the doping profile"),
            ("n_d", "n_d", "cm⁻³", 1e17, 1e16, 1e19, "doping concentration of the heater"),
            ("p", "p", "1", 1.0, 1.0, 4.0, "phonon scattering exponent"),
            ("a0", "a₀", "Ω cm", 1e-4, 1e-4, 1e-2, "high-doped resistivity at 300 K"),
            (
                "a1",
                "a₁",
                "Ω cm K⁻¹",
                1e-6,
                0.0,
                1e-5,
                "temperature coefficient of the high-doped resistivity",
            ),
        )
    ),
    Parameter(
        *("n_hd", "n_hd", "cm⁻³", 1e20, 2e18, 5e21),
        "doping concentration of the high-doped silicon",
        value=2.2e20,
    ),
    Parameter(
        *("impurity_exponent", "s", "1", 10.0, -2.0, 4.0),
        "power of T / 300 K in mobility limited by impurities; 0: Eq. 9",
        relative=False,
        value=0.0,
    ),
    Parameter(
        *("intrinsic_scale", "c_i", "1", 1.0, 0.2, 5.0),
        "scale of the intrinsic carrier density; 1: Eq. 7",
        value=1.0,
    ),
    Parameter(
        *("scattering_exponent", "r", "1", 1.0, -1.0, 2.0),
        "power of the energy in the relaxation time of carriers, which counts with "
        "thermoelectricity",
        spread=0.5,
        relative=False,
        counts="thermoelectric",
        value=0.0,
    ),
    _emissivity(0.2),
    Parameter(
        *("heat_capacity_scale", "c_h", "1", 1.0, 0.5, 1.5),
        "scale of the heat capacity, which counts in time",
        counts="in time",
        value=1.0,
    ),
    *(row for departure in DEPARTURES.values() for row in _coefficients(departure)),
)
#: The six fit parameters of the paper, in its order.
PARAMETERS = {name: parameter for name, parameter in OF_SILICON.items() if parameter.usual}
#: Of metal films. With any of these temperature coefficients the resistivity stays positive.
OF_METAL = _table(
    Parameter(
        *("resistivity", "ρ₂₉₃", "Ω cm", 1e-5, 1e-6, 1e-3, "resistivity at 293 K"),
        spread=0.2,
        usual=True,
    ),
    Parameter(
        *("tcr", "α", "K⁻¹", 1e-3, -5e-4, 5e-3),
        "temperature coefficient of the resistivity",
        spread=0.2,
        usual=True,
    ),
    _scale("resistivity", "c_ρ"),
    Parameter(
        *("lorenz_ratio", "L/L₀", "1", 1.0, 0.2, 5.0),
        "heat carried over what Wiedemann and Franz give",
        spread=0.2,
        value=1.0,
    ),
    Parameter("kappa", "κ", "W cm⁻¹ K⁻¹", 0.01, 0.01, 5.0, "thermal conductivity", spread=0.2),
    _scale("kappa", "c_κ"),
    Parameter(
        *("seebeck", "S", "µV K⁻¹", 1.0, -100.0, 100.0),
        "Seebeck coefficient, which counts with thermoelectricity",
        spread=5.0,
        relative=False,
        counts="thermoelectric",
        value=0.0,
    ),
    _emissivity(0.1),
    _heat_capacity(),
)
OF_DIELECTRIC = _table(
    Parameter(
        *("kappa", "κ₃₀₀", "W cm⁻¹ K⁻¹", 0.01, 1e-3, 1.0),
        "thermal conductivity at 300 K",
        spread=0.2,
        usual=True,
    ),
    Parameter(
        *("kappa_exponent", "m", "1", 1.0, -1.5, 1.5),
        "power of the temperature in the thermal conductivity",
        # of glasses and nitrides 0 to 0.4
        spread=0.15,
        relative=False,
        value=0.0,
    ),
    _scale("kappa", "c_κ"),
    _emissivity(0.15),
    _heat_capacity(),
)

#: Units and bounds of what a table or a formula may state: far wider than those of numbers, since
#: not only metals follow them.
STATED: dict[str, tuple[str, tuple[float, float]]] = {
    "resistivity": ("Ω cm", (1e-7, 1e2)),
    "kappa": ("W cm⁻¹ K⁻¹", (1e-5, 50.0)),
    "heat_capacity": ("J cm⁻³ K⁻¹", (0.01, 20.0)),
    "seebeck": ("µV K⁻¹", (-2000.0, 2000.0)),
    "emissivity": ("1", (0.0, 1.0)),
}
#: Of the kinds above, and of classes of materials made in Python, by name.
_DECLARED = OF_DIELECTRIC | OF_METAL | OF_SILICON
#: The classes that declare some of them.
_OWNERS: dict[str, str] = {}


def declare(parameter: Parameter, owner: str) -> None:
    """Note a parameter of a class of materials, so that it is printed by its name.

    Raises
    ------
    InputError
        If a parameter of this name is in another unit elsewhere.
    """
    name = parameter.name
    other = _DECLARED.get(name, parameter)
    printed = other.unit, other.scale
    if printed != (parameter.unit, parameter.scale) and _OWNERS.get(name) != owner:
        raise InputError(
            f"{owner}: {name} is in {parameter.scale:g} {parameter.unit}, and elsewhere in "
            f"{other.scale:g} {other.unit}: expected the same, or another name"
        )
    if name not in _DECLARED or name in _OWNERS:
        _DECLARED[name], _OWNERS[name] = parameter, owner


def is_declared(name: str) -> bool:
    """Return whether some kind or class of materials has a parameter of this name."""
    return name in _DECLARED


def constant_of(name: str, value: float) -> Parameter:
    """Return the parameter that a number is which a formula names: it stays within a factor of 5.

    Examples
    --------
    >>> constant_of("beta", -2e-7).bounds
    (-1e-06, -4e-08)
    """
    lower, upper = sorted((value / 5.0, value * 5.0)) if value else (-1.0, 1.0)
    scale = abs(value) or 1.0
    return Parameter(name, name, "1", scale, lower, upper, "number in a formula", value=value)


def field_of(parameter: Parameter, **others: Any) -> Any:
    """Return the field of a record for a parameter: what it is, its bounds, and its value if any.

    The bounds are twice as wide as a fit's; those of what may be negative, or are exact, are the
    fit's own.
    """
    least, most = field_bounds(parameter)
    words = f"{parameter.meaning}, {parameter.symbol} ({parameter.unit})"
    stated = {"description": words, "ge": least, "le": most}
    if not math.isnan(parameter.value):
        stated["default"] = parameter.value
    if departure_of(parameter.name):
        # files name the coefficients that are not zero
        stated["exclude_if"] = operator.not_
    field = Field(**{**stated, **others})
    field.metadata.append(parameter)
    return field


def field_bounds(parameter: Parameter) -> tuple[float, float]:
    """Return the bounds of a parameter's field, see `field_of`."""
    widened = 1.0 if parameter.lower < 0 or parameter.exact else 2.0
    return parameter.lower / widened, widened * parameter.upper


# --- names --------------------------------------------------------------------------------------


def full_name(material: str, own: str) -> str:
    """Return the name of a material's parameter in probe files, fits and on the command line.

    Examples
    --------
    >>> full_name("film", "tcr"), full_name("low-doped", "n_d")
    ('film.tcr', 'n_d')
    """
    return own if material in (LOW_DOPED, HIGH_DOPED) else f"{material}.{own}"


def own_name(name: str) -> str:
    """Return the name of a parameter without that of its material.

    Examples
    --------
    >>> own_name("film.tcr"), own_name("n_d")
    ('tcr', 'n_d')
    """
    return name.rpartition(".")[2]


def is_of_material(name: str) -> bool:
    """Return whether a parameter is one of a material, named or that of ``[material]``.

    Examples
    --------
    >>> is_of_material("film.tcr"), is_of_material("n_d"), is_of_material("thickness_um")
    (True, True, False)
    """
    return "." in name or name in OF_SILICON or name in _OWNERS


def parameter_named(name: str) -> Parameter:
    """Return how a parameter of a material, or any other value of a probe file, is printed.

    Examples
    --------
    >>> parameter_named("heater_width_um").symbol, parameter_named("heater_width_um").unit
    ('heater width', 'µm')
    >>> parameter_named("film.tcr").symbol, parameter_named("film.tcr").unit
    ('α (film)', 'K⁻¹')
    """
    material, _, own = name.rpartition(".")
    if not material and is_of_material(name):
        return _DECLARED[name]
    if material and (declared := _DECLARED.get(own)):
        return declared._replace(
            name=name,
            symbol=f"{declared.symbol} ({material})",
            meaning=f"{declared.meaning}, {material}",
        )
    # by the endings of names in probe files
    units = {"um": "µm", "ohm": "Ω", "V": "V", "K": "K", "deg": "°", "K_per_mW": "K/mW"}
    ending = max((unit for unit in units if name.endswith(f"_{unit}")), key=len, default="")
    stem = name.removesuffix(f"_{ending}")
    words = stem.replace(".", " ").replace("_", " ")
    return Parameter(name, words, units.get(ending, "1"), 1.0, -math.inf, math.inf, words)


def label(name: str) -> str:
    """Return what a parameter, or any other value of a probe file, is called in words.

    Examples
    --------
    >>> label("n_d"), label("heater_width_um")
    ('doping concentration of the heater, n_d', 'heater width')
    """
    named = parameter_named(name)
    meaning = named.meaning.removesuffix(f", {name.rpartition('.')[0]}")
    return named.symbol if meaning == named.symbol else f"{meaning}, {named.symbol}"


def scaled_unit(name: str) -> str:
    """Return the unit a parameter is printed in.

    Examples
    --------
    >>> scaled_unit("n_d"), scaled_unit("impurity_exponent")
    ('1e17 cm⁻³', '')
    """
    unit, scale = parameter_named(name).unit, scale_of(name)
    power = "" if scale == 1 else f"{scale:.0e} ".replace("e+", "e")
    return "" if unit == "1" else f"{power}{unit}"


def heading(name: str) -> str:
    """Return the heading of a column with a parameter or the inversion temperature.

    Examples
    --------
    >>> heading("n_d"), heading("p"), heading("inversion_temperature")
    ('n_d (1e17 cm⁻³)', 'p', 'T_i (K)')
    """
    if name == "inversion_temperature":
        return "T_i (K)"
    unit = scaled_unit(name)
    return f"{name} ({unit})" if unit else name


def scale_of(name: str) -> float:
    """Return the unit, of its own, that a parameter is printed in; one of pure numbers."""
    named = parameter_named(name)
    return 1.0 if named.unit == "1" else named.scale


def sentence(text: str) -> str:
    """Make a note a sentence; names of parameters, and k, keep their small letters.

    Examples
    --------
    >>> sentence("the levers differ"), sentence("n_d is not determined")
    ('The levers differ.', 'n_d is not determined.')
    """
    first = re.split(r"[^\w.]", text, maxsplit=1)[0]
    named = first == "k" or is_of_material(first)
    return f"{text if named else text[0].upper() + text[1:]}."
