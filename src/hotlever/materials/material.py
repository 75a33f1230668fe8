"""The material parameters of a lever: the six that a fit finds, and n_hd."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from hotlever.errors import unknown_name
from hotlever.records import Record


class Parameter(NamedTuple):
    """One fit parameter as users meet it.

    Attributes
    ----------
    name, symbol, unit : str
        Name in files, symbol in the paper, unit.
    scale : float
        Size of the parameter, by which a fit divides to work with numbers of order one.
    lower, upper : float
        Bounds within which silicon levers make sense; a fit stays inside.
    meaning : str
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


def parameter(name: str, where: str = "") -> Parameter:
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
        raise unknown_name("parameter", name, PARAMETERS, where)
    return PARAMETERS[name]


Positive = Annotated[float, Field(gt=0)]


class Material(Record):
    """Material parameters (section ``[material]`` of a probe file).

    Attributes
    ----------
    c_kappa : float
        Scale c_κ of the thermal conductivity (Eq. 4).
    delta : float
        Diffusion length Δ of the doping profile (µm).
    n_d : float
        Doping concentration of the heater (cm⁻³).
    p : float
        Phonon scattering exponent (Eq. 10).
    a0, a1 : float
        High-doped resistivity at 300 K (Ω cm) and its slope (Ω cm K⁻¹), Eq. 11.
    n_hd : float
        Doping concentration of the high-doped silicon (cm⁻³).
    """

    c_kappa: Positive
    delta: Positive
    n_d: Positive
    p: Positive
    a0: Positive
    a1: Annotated[float, Field(ge=0)]
    n_hd: Positive = 2.2e20

    @model_validator(mode="after")
    def _heater_is_the_low_doped_part(self) -> Material:
        if self.n_d >= self.n_hd:
            raise ValueError(f"n_d = {self.n_d:g} must be below n_hd = {self.n_hd:g}")
        return self
