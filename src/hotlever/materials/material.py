"""The silicon of a lever as in the paper: the six parameters that a fit finds, and two more."""

from __future__ import annotations

from pydantic import model_validator

from hotlever.errors import unknown_name
from hotlever.materials.kinds import HighDopedSilicon, Kind, NSilicon
from hotlever.materials.parameters import (
    OF_SILICON,
    Parameter,
    bounded,
    high_doping,
    impurity_exponent,
)
from hotlever.records import Record

#: The six fit parameters in the paper's order.
PARAMETERS: dict[str, Parameter] = {
    name: OF_SILICON[name] for name in ("c_kappa", "delta", "n_d", "p", "a0", "a1")
}

#: What the two kinds of silicon are called that `Material` describes.
LOW_DOPED, HIGH_DOPED = "low-doped", "high-doped"


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


def full_name(material: str, own: str) -> str:
    """Return the name of a material's parameter in probe files, fits and on the command line.

    Examples
    --------
    >>> full_name("film", "tcr"), full_name("low-doped", "n_d")
    ('film.tcr', 'n_d')
    """
    return own if material in (LOW_DOPED, HIGH_DOPED) else f"{material}.{own}"


class Material(Record):
    """Parameters of the laws in Eqs. 4 to 11 (section ``[material]`` of a probe file).

    They make two kinds of silicon that share c_κ: the n-doped one of heater and reader, and the
    high-doped one around it.
    """

    c_kappa: float = bounded(OF_SILICON["c_kappa"])
    delta: float = bounded(OF_SILICON["delta"])
    n_d: float = bounded(OF_SILICON["n_d"])
    p: float = bounded(OF_SILICON["p"])
    a0: float = bounded(OF_SILICON["a0"])
    a1: float = bounded(OF_SILICON["a1"])
    n_hd: float = high_doping()
    impurity_exponent: float = impurity_exponent()
    heat_capacity_scale: float = bounded(OF_SILICON["heat_capacity_scale"], default=1.0)

    @model_validator(mode="after")
    def _heater_is_the_low_doped_part(self) -> Material:
        if self.n_d >= self.n_hd:
            raise ValueError(f"n_d = {self.n_d:g} must be below n_hd = {self.n_hd:g}")
        return self

    @property
    def kinds(self) -> dict[str, Kind]:
        """The two kinds of silicon, by `LOW_DOPED` and `HIGH_DOPED`."""
        values = dict(self)
        made: dict[str, type[Kind]] = {LOW_DOPED: NSilicon, HIGH_DOPED: HighDopedSilicon}
        # unchecked, since the values are checked already: fits make many
        return {
            name: kind.model_construct(
                **{own: values[own] for own in kind.model_fields if own in values}
            )
            for name, kind in made.items()
        }
