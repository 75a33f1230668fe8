"""The material parameters of a lever: the six that a fit finds, and two that it is told."""

from __future__ import annotations

from typing import Any, NamedTuple

from pydantic import Field, model_validator

from hotlever.errors import unknown_name
from hotlever.records import Record


class Parameter(NamedTuple):
    """One fit parameter as users meet it: its name in files, its symbol in the paper, its unit.

    A fit divides by the `scale`, to work with numbers of order one, and stays between `lower` and
    `upper`, within which silicon levers make sense.
    """

    name: str
    symbol: str
    unit: str
    scale: float
    lower: float
    upper: float
    meaning: str


#: The six fit parameters in the paper's order.
PARAMETERS: dict[str, Parameter] = {
    parameter.name: parameter
    for parameter in (
        Parameter("c_kappa", "c_κ", "1", 1.0, 0.1, 1.5, "scale of the thermal conductivity"),
        Parameter("delta", "Δ", "µm", 1.0, 0.05, 2.0, "diffusion length of the doping profile"),
        Parameter("n_d", "n_d", "cm⁻³", 1e17, 1e16, 1e19, "doping concentration of the heater"),
        Parameter("p", "p", "1", 1.0, 1.0, 4.0, "phonon scattering exponent"),
        Parameter("a0", "a₀", "Ω cm", 1e-4, 1e-4, 1e-2, "high-doped resistivity at 300 K"),
        Parameter("a1", "a₁", "Ω cm K⁻¹", 1e-6, 0.0, 1e-5, "its temperature coefficient"),
    )
}


def parameter(name: str) -> Parameter:
    """Return the fit parameter of this name.

    Raises
    ------
    InputError
        If there is none; the text gives the nearest one.

    Examples
    --------
    >>> parameter("a0").unit
    'Ω cm'
    """
    if name not in PARAMETERS:
        raise unknown_name("parameter", name, PARAMETERS)
    return PARAMETERS[name]


def _of_silicon(name: str) -> Any:
    """Return the bounds of a parameter, twice as wide as a fit's, and what it is."""
    known = PARAMETERS[name]
    meaning = f"{known.meaning}, {known.symbol} ({known.unit})"
    return Field(ge=known.lower / 2, le=2 * known.upper, description=meaning)


class Material(Record):
    """Parameters of the laws in Eqs. 4 to 11 (section ``[material]`` of a probe file)."""

    c_kappa: float = _of_silicon("c_kappa")
    delta: float = _of_silicon("delta")
    n_d: float = _of_silicon("n_d")
    p: float = _of_silicon("p")
    a0: float = _of_silicon("a0")
    a1: float = _of_silicon("a1")
    n_hd: float = Field(
        default=2.2e20,
        ge=1e18,
        le=1e22,
        description="doping concentration of the high-doped silicon (cm⁻³)",
    )
    impurity_exponent: float = Field(
        default=0.0,
        ge=-2.0,
        le=4.0,
        description="mobility limited by impurities rises as (T / 300 K) to this power; 0: Eq. 9",
    )

    @model_validator(mode="after")
    def _heater_is_the_low_doped_part(self) -> Material:
        if self.n_d >= self.n_hd:
            raise ValueError(f"n_d = {self.n_d:g} must be below n_hd = {self.n_hd:g}")
        return self
