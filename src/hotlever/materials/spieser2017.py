"""The parameter sets published by Spieser et al.

M. Spieser, C. Rawlings, E. Lörtscher, U. Duerig, A. W. Knoll, "Comprehensive modeling of
Joule heated cantilever probes", J. Appl. Phys. 121, 174503 (2017), doi:10.1063/1.4981883,
arXiv:1711.09582. Tables I and II.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hotlever.errors import unknown_name
from hotlever.materials.material import Material

DOI = "10.1063/1.4981883"
#: Doping concentration of the wafer (cm⁻³), to which the "n_d fixed" rows are held.
NOMINAL_DOPING = 3.3e17
#: The ramp of the bias (V).
RAMP = np.linspace(1.0, 11.0, 25)


@dataclass(frozen=True)
class PublishedSet:
    """One row of a published table.

    Attributes
    ----------
    name : str
    observables : tuple of str
        The measured quantities that were fitted: ``current``, ``reader``, ``tip``.
    material : Material
    standard_error : mapping
        By parameter name; empty where the table prints none.
    inversion_temperature_K : float or None
        As printed, where the table has it.
    """

    name: str
    observables: tuple[str, ...]
    material: Material
    standard_error: Mapping[str, float] = field(default_factory=dict)
    inversion_temperature_K: float | None = None


_ALL = ("current", "reader", "tip")


def _material(
    c_kappa: float, delta: float, n_d_e17: float, p: float, a0_em4: float, a1_em6: float
) -> Material:
    return Material(
        c_kappa=c_kappa, delta=delta, n_d=n_d_e17 * 1e17, p=p, a0=a0_em4 * 1e-4, a1=a1_em6 * 1e-6
    )


def _option(
    numeral: str,
    observables: tuple[str, ...],
    values: tuple[float, ...],
    errors: tuple[float, ...],
    inversion_temperature_K: float,
) -> PublishedSet:
    material, error = _material(*values), _material(*errors)
    return PublishedSet(
        f"option {numeral}",
        observables,
        material,
        {name: getattr(error, name) for name in type(error).model_fields if name != "n_hd"},
        inversion_temperature_K,
    )


#: Table I (lever 1, by the observables fitted) and Table II (option III, by lever).
PUBLISHED: dict[str, PublishedSet] = {
    entry.name: entry
    for entry in (
        _option(
            "I",
            _ALL[:1],
            (0.744, 0.681, 4.10, 2.64, 5.87, 1.67),
            (0.007, 0.030, 0.62, 0.02, 0.21, 0.10),
            805,
        ),
        _option(
            "II",
            _ALL[:2],
            (0.675, 0.649, 6.87, 2.80, 9.32, 1.08),
            (0.008, 0.053, 1.40, 0.02, 0.06, 0.03),
            851,
        ),
        _option(
            "III",
            _ALL,
            (0.686, 0.647, 5.75, 2.65, 9.34, 1.11),
            (0.005, 0.051, 0.94, 0.05, 0.15, 0.05),
            831,
        ),
        PublishedSet("lever 1", _ALL, _material(0.686, 0.647, 5.75, 2.65, 9.34, 1.11)),
        PublishedSet("lever 1, n_d fixed", _ALL, _material(0.692, 0.763, 3.30, 2.74, 9.30, 1.12)),
        PublishedSet("lever 2", _ALL, _material(0.687, 0.719, 3.64, 2.80, 10.2, 1.25)),
        PublishedSet("lever 2, n_d fixed", _ALL, _material(0.688, 0.735, 3.30, 2.81, 10.2, 1.26)),
        PublishedSet("lever 3", _ALL, _material(0.688, 0.646, 3.50, 2.85, 10.3, 1.26)),
        PublishedSet("lever 3, n_d fixed", _ALL, _material(0.690, 0.659, 3.30, 2.86, 10.3, 1.26)),
        PublishedSet("lever 4", _ALL, _material(0.613, 0.544, 5.93, 2.86, 10.7, 1.23)),
        PublishedSet("lever 4, n_d fixed", _ALL, _material(0.686, 0.716, 3.30, 2.99, 10.7, 1.26)),
    )
}


@dataclass(frozen=True)
class OperatingPoint:
    """A published state of lever 1 with the option-III parameters (caption of Fig. 7).

    Attributes
    ----------
    name : str
    lever_V, current_mA : float
        V_l and I_h.
    tip_K : float or None
        Predicted tip temperature, where it is given.
    """

    name: str
    lever_V: float
    current_mA: float
    tip_K: float | None = None


#: In the order of rising temperature.
OPERATING_POINTS = (
    OperatingPoint("plateau", 1.90, 0.95),
    OperatingPoint("knee", 3.06, 0.93, 893.0),
    OperatingPoint("hot", 2.74, 1.43),
)


def published(name: str) -> PublishedSet:
    """Return a published parameter set by name.

    Parameters
    ----------
    name : str
        ``option I`` to ``option III`` (Table I), ``lever 1`` to ``lever 4`` (Table II), or
        ``lever 1, n_d fixed`` and so on.

    Raises
    ------
    InputError
        If there is no such set; the text gives the nearest name.

    Examples
    --------
    >>> published("option III").material.c_kappa
    0.686
    >>> published("option III").standard_error["c_kappa"]
    0.005
    """
    if name not in PUBLISHED:
        raise unknown_name("published parameter set", name, PUBLISHED)
    return PUBLISHED[name]
