"""Silicon doped with boron: what differs from the phosphorus-doped silicon of the paper.

Holes are the majority and electrons the minority. The laws have the form of Eqs. 5 to 10 of the
paper (`hotlever.materials.silicon`); `n` is the concentration of boron (cm⁻³).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated, law
from hotlever.materials.silicon import (
    ELEMENTARY_CHARGE,
    Carried,
    band_gap,
    carriers,
    conducted,
    matthiessen,
    mobility,
)

#: Of the resistivity of boron-doped silicon at 23 °C (Thurber et al.; ASTM F723): resistivity
#: times doping (Ω cm⁻²) by phonons and, at the highest doping, by impurities; the inverse of the
#: doping (cm³) above which the latter hardly grows; and the power of its fall below.
_BY_PHONONS, _BY_IMPURITIES, _SATURATES, _FALLS = 1.305e16, 1.133e17, 2.58e-19, -0.737
_THURBER_K = 296.0
#: Narrowing of the band gap (eV), and the doping (cm⁻³) from which it grows.
_NARROWING, _NARROWS_FROM = 6.92e-3, 1.3e17


@law(
    meant_for=(200.0, 1300.0),
    source="Klaassen, Slotboom and de Graaff, Solid-State Electron. 35, 125 (1992); gap of Eq. 7",
)
def band_gap_p(T: ArrayLike, n: ArrayLike) -> Evaluated:
    """Band gap of boron-doped silicon with band-gap narrowing, in eV.

    Examples
    --------
    >>> band_gap_p(300.0, [1e16, 1e18])[0].round(4).tolist()
    [1.1239, 1.0955]
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    gap, d_gap = band_gap.formula(T, 0.0)
    log = np.log(n / _NARROWS_FROM)
    root = np.sqrt(log**2 + 0.5)
    narrowing = _NARROWING * (log + root)
    return gap - narrowing, {"T": d_gap["T"], "n": -narrowing / (root * n)}


@law(
    meant_for=(290.0, 1300.0),
    source="Thurber et al., J. Electrochem. Soc. 127, 2291 (1980); ASTM F723",
)
def hole_mobility(
    T: ArrayLike, n: ArrayLike, p: float, impurity_exponent: float = 0.0
) -> Evaluated:
    """Mobility of holes in boron-doped silicon, in cm² V⁻¹ s⁻¹.

    At 296 K it gives the resistivity by the concentration of boron that Thurber et al. measured,
    which is of the form of Matthiessen's rule. Its share by phonons goes with the temperature as in
    Eq. 10; that by impurities does not, or by an `impurity_exponent` as in
    `hotlever.materials.silicon.impurity_mobility`. Boron that is not ionised at room temperature
    counts as lower mobility.

    Examples
    --------
    >>> hole_mobility(296.0, [1e15, 1e18], p=2.2)[0].round().tolist()
    [470.0, 143.0]
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    hot = T / _THURBER_K
    phonon = hot**-p / (ELEMENTARY_CHARGE * _BY_PHONONS)
    fallen = (_SATURATES * n) ** _FALLS
    per_fallen = hot**impurity_exponent / (ELEMENTARY_CHARGE * _BY_IMPURITIES)
    impurity = per_fallen * (1.0 + fallen)
    return matthiessen(
        (
            impurity,
            {
                "T": impurity_exponent * impurity / T,
                "n": per_fallen * _FALLS * fallen / n,
                "impurity_exponent": impurity * np.log(hot),
            },
        ),
        (phonon, {"T": -p * phonon / T, "p": -phonon * np.log(hot)}),
    )


@law(
    meant_for=(290.0, 1300.0),
    source="Eq. 5; holes: Thurber et al., J. Electrochem. Soc. 127, 2291 (1980); gap: Klaassen et "
    "al., Solid-State Electron. 35, 125 (1992)",
)
def conductivity_p(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float = 0.0,
    intrinsic_scale: float = 1.0,
) -> Evaluated:
    """Electrical conductivity of silicon doped with boron, in S cm⁻¹.

    Electrons, the minority, move as in silicon doped with as much phosphorus (Eqs. 8 to 10).

    Examples
    --------
    >>> sigma, _ = conductivity_p(296.0, [1e15, 1e20], p=2.2)
    >>> (1.0 / sigma).round(5).tolist()  # Ω cm
    [13.30622, 0.00117]
    """
    return conducted(carried_in_p_silicon(T, n, p, impurity_exponent, intrinsic_scale))


def carried_in_p_silicon(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float = 0.0,
    intrinsic_scale: float = 1.0,
) -> list[Carried]:
    """Return the carriers of silicon doped with boron; see `conductivity_p`."""
    holes, electrons = carriers(T, n, band_gap_p, intrinsic_scale)
    return [
        (holes, hole_mobility.formula(T, n, p, impurity_exponent), "hole"),
        (electrons, mobility.formula(T, n, p, impurity_exponent), "electron"),
    ]
