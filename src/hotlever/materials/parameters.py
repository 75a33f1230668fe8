"""Parameters of materials as users meet them."""

from __future__ import annotations

from typing import Any, NamedTuple

from pydantic import Field


class Parameter(NamedTuple):
    """One fit parameter as users meet it: its name in files, its symbol in the paper, its unit.

    A fit divides by the `scale`, to work with numbers of order one, and stays between `lower` and
    `upper`, within which levers make sense.
    """

    name: str
    symbol: str
    unit: str
    scale: float
    lower: float
    upper: float
    meaning: str

    @property
    def bounds(self) -> tuple[float, float]:
        """The lowest and the highest value."""
        return self.lower, self.upper


#: All parameters of silicon: first the six that the paper fits, in its order.
OF_SILICON: dict[str, Parameter] = {
    parameter.name: parameter
    for parameter in (
        Parameter("c_kappa", "c_κ", "1", 1.0, 0.1, 1.5, "scale of the thermal conductivity"),
        Parameter("delta", "Δ", "µm", 1.0, 0.05, 2.0, "diffusion length of the doping profile"),
        Parameter("n_d", "n_d", "cm⁻³", 1e17, 1e16, 1e19, "doping concentration of the heater"),
        Parameter("p", "p", "1", 1.0, 1.0, 4.0, "phonon scattering exponent"),
        Parameter("a0", "a₀", "Ω cm", 1e-4, 1e-4, 1e-2, "high-doped resistivity at 300 K"),
        Parameter("a1", "a₁", "Ω cm K⁻¹", 1e-6, 0.0, 1e-5, "its temperature coefficient"),
        Parameter(
            *("n_hd", "n_hd", "cm⁻³", 1e20, 2e18, 5e21),
            "doping concentration of the high-doped silicon",
        ),
        Parameter(
            *("impurity_exponent", "s", "1", 10.0, -2.0, 4.0),
            "power of the temperature in mobility limited by impurities",
        ),
        Parameter(
            *("heat_capacity_scale", "c_h", "1", 1.0, 0.5, 1.5),
            "scale of the heat capacity, which counts in time",
        ),
    )
}


#: Those that count in time only.
IN_TIME = ("heat_capacity_scale",)


def bounded(parameter: Parameter, **default: Any) -> Any:
    """Return the bounds of a parameter, twice as wide as a fit's, and what it is."""
    meaning = f"{parameter.meaning}, {parameter.symbol} ({parameter.unit})"
    return Field(ge=parameter.lower / 2, le=2 * parameter.upper, description=meaning, **default)


def impurity_exponent() -> Any:
    """Return the bounds of the exponent that the paper takes as 0, and what it is."""
    known = OF_SILICON["impurity_exponent"]
    return Field(
        default=0.0,
        ge=known.lower,
        le=known.upper,
        description="mobility limited by impurities rises as (T / 300 K) to this power; 0: Eq. 9",
    )


def high_doping() -> Any:
    """Return the bounds of the doping of high-doped silicon, and what it is."""
    known = OF_SILICON["n_hd"]
    return Field(
        default=2.2e20,
        ge=known.lower / 2,
        le=2 * known.upper,
        description=f"{known.meaning} ({known.unit})",
    )
