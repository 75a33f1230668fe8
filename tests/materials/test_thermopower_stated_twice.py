"""The thermoelectric laws of silicon against the same, stated on its own in `benchmarks`."""

from __future__ import annotations

import numpy as np
import pytest

from beyond_the_paper import PHONON_EXPONENT, conductivity, seebeck
from hotlever.materials import thermopower
from hotlever.materials.silicon import conductivity_low_doped, conductivity_p


@pytest.mark.parametrize("kind", ["n-silicon", "p-silicon"])
@pytest.mark.parametrize("n", [1e16, 5.75e17, 1e19, 2.2e20, 5e20])
@pytest.mark.parametrize("r", [-0.5, 0.0, 0.37, 1.5])
def test_of_two_carriers_is_that_of_fermi_integrals_by_quadrature(kind, n, r):
    T, p = np.array([300.0, 500.0, 831.0, 1300.0]), PHONON_EXPONENT[kind]
    if kind == "n-silicon":
        law, conducts = thermopower.thermoelectric_n_silicon, conductivity_low_doped
    else:
        law, conducts = thermopower.thermoelectric_p_silicon, conductivity_p
    conducted = conducts(T, n, p)[0]
    beta = law(T, n, p, 0.0, r)[0][0]
    for t, coefficient, sigma in zip(T.tolist(), 1e3 * beta / conducted, conducted, strict=True):
        assert coefficient == pytest.approx(seebeck(t, n, r, kind), rel=1e-8)
        assert sigma == pytest.approx(conductivity(t, n, kind), rel=1e-9)
