"""Levers that radiate from faces and edges: exact strips, balances, derivatives, in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from hotlever.cache import CACHE_VARIABLE
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import integrate, simulate, step
from hotlever.lever.transient.frequency_domain import spectrum
from hotlever.lever.transient.reduced import reduced_in_time
from hotlever.lever3d import SolidLever
from hotlever.materials import heat as heat_laws
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.mesh import SolidMeshOptions
from hotlever.probe.surroundings import Physics

BASE, LENGTH = 293.0, 40.0
#: W/(cm K) and Ω cm, both the same at all temperatures.
KAPPA, RESISTIVITY = 0.3, 1e-3
EMISSIVITY = 0.7


@pytest.fixture
def bright(monkeypatch) -> None:
    """Surfaces that radiate a thousand times as much: as much as the legs conduct, or more."""
    monkeypatch.setenv(CACHE_VARIABLE, "")
    monkeypatch.setattr(heat_laws, "STEFAN_BOLTZMANN", 1000.0 * heat_laws.STEFAN_BOLTZMANN)


def strip(width_um: float, thickness_um: float) -> Probe:
    """A straight strip with a constant conductivity, its ends at the base temperature."""
    outline = [[0.0, 0.0], [LENGTH, 0.0], [LENGTH, width_um], [0.0, width_um]]
    material = {"kind": "metal-film", "kappa": KAPPA, "resistivity": RESISTIVITY, "tcr": 0.0}
    material["melting_point_K"] = 4000.0
    return Probe.from_sections(
        {
            "probe": {
                "shape": "drawing",
                "thickness_um": thickness_um,
                "tip_um": [LENGTH / 2, width_um / 2],
            },
            "layers": {"body": {"drawn": [outline], "material": "metal"}},
            "terminals": {
                "supply": [[LENGTH, 0.0], [LENGTH, width_um]],
                "ground": [[0.0, 0.0], [0.0, width_um]],
            },
            "materials": {"metal": {**material, "emissivity": EMISSIVITY}},
            "circuit": {"series_resistance_ohm": 0.0, "base_temperature_K": BASE},
            "physics": {"radiation": True},
        },
        "test",
    )


def exact_strip(width_um: float, thickness_um: float, bias: float) -> tuple[float, float]:
    """Highest temperature (K) and what is radiated (mW) of a strip, by its first integral.

    κ A T″ = ε σ (T⁴ − T₀⁴) P − V² A/(ρ L²) with cross-section A and circumference P: multiplied by
    T′ it is integrated once, and once more by quadrature. In W, cm and K.
    """
    A = width_um * thickness_um * 1e-8
    P = 2e-4 * (width_um + thickness_um)
    losses = EMISSIVITY * heat_laws.STEFAN_BOLTZMANN * P / (KAPPA * A)
    heat = bias**2 / (RESISTIVITY * (LENGTH * 1e-4) ** 2) / KAPPA

    def square(T: float, top: float) -> float:
        """T′² over top − T, which it has as a factor."""
        fifth = sum(top**n * T ** (4 - n) for n in range(5)) / 5
        return 2 * (heat - losses * (fifth - BASE**4))

    def half(top: float) -> float:
        """Half the length: with T = top − s² the root at the top goes."""
        accurate = {"epsabs": 0, "epsrel": 1e-10}
        root = np.sqrt(top - BASE)
        return quad(lambda s: 2 / np.sqrt(square(top - s**2, top)), 0, root, **accurate)[0]

    # above this the strip would be cooled more than it is heated
    ceiling = brentq(lambda T: heat - losses * (T**4 - BASE**4), BASE, 1e5)
    lowest, highest = BASE + 1e-3, ceiling * (1 - 1e-6)
    top = brentq(lambda T: half(T) - LENGTH * 0.5e-4, lowest, highest, xtol=1e-10, rtol=1e-14)
    by_ends = 2 * KAPPA * A * np.sqrt((top - BASE) * square(BASE, top))
    return top, 1e3 * (heat * KAPPA * A * LENGTH * 1e-4 - by_ends)


def test_a_strip_that_radiates_most_of_its_heat_is_the_exact_one(bright):
    """With its edges, two sevenths of the surface, at fourth order; so narrow that it is a line."""
    width, thickness, bias = 0.05, 0.02, 1.0
    expected, light = exact_strip(width, thickness, bias)
    tips = []
    for size in (1.6, 0.2, 0.1):
        lever = Lever(strip(width, thickness), MeshOptions(heater=20.0 * size, lever=size))
        swept = lever.dataset(lever.solve([bias]))
        tips.append(swept.tip_K.item())
    assert light > 0.6 * swept.power_mW.item()
    assert tips[-1] == pytest.approx(expected, rel=1e-6)
    assert swept.radiated_mW.item() == pytest.approx(light, rel=1e-6)
    coarse, fine = np.abs(np.subtract(tips[:2], tips[-1]))
    assert np.log2(coarse / fine) / 3 > 3.5


def test_a_solid_strip_radiates_as_a_flat_one_and_its_edges(bright, monkeypatch):
    """All its surface, the sides a fifth of it, is that of the exact strip; less bright."""
    monkeypatch.setattr(heat_laws, "STEFAN_BOLTZMANN", 0.1 * heat_laws.STEFAN_BOLTZMANN)
    probe, bias = strip(4.0, 1.0), 1.0
    expected, light = exact_strip(4.0, 1.0, bias)
    for lever in (Lever(probe), SolidLever(probe, SolidMeshOptions(refinement=0.6))):
        swept = lever.dataset(lever.solve([bias]))
        assert swept.tip_K.item() - BASE == pytest.approx(expected - BASE, rel=3e-4)
        assert swept.radiated_mW.item() == pytest.approx(light, rel=3e-4)


ALL = Probe.reference().with_physics(Physics.model_fields)


def test_beside_a_warm_end_heat_out_is_heat_in(bright):
    """Of all other levers that radiate `test_every_lever.py` says so."""
    ends = {"circuit.ground.kind": "ground", "circuit.ground.base_temperature_K": 420.0}
    lever = Lever(ALL.with_(**ends), COARSE)
    swept = lever.dataset(lever.solve([3.0]))
    out = swept.end_heat_mW + swept.air_heat_mW + swept.radiated_mW
    assert swept.radiated_mW.item() > 0.05 * swept.power_mW.item()
    np.testing.assert_allclose(out, swept.power_mW, rtol=1e-9)


def test_a_step_in_time_ends_at_rest_and_keeps_the_heat(bright):
    lever = Lever(ALL, COARSE)
    history = simulate(lever, step(5.0), at=[1.0, 3.0, 10.0, 20000.0], tolerance_K=1e-3)
    (rest,) = lever.solve([5.0])
    assert history.tip_K.values[-1] - BASE == pytest.approx(rest.tip_K - BASE, rel=1e-6)
    stored_and_lost = history.stored_nJ - float(history.stored_nJ[0]) + history.lost_nJ
    missing = (history.supplied_nJ - stored_and_lost).values
    assert np.ptp(missing) < 1e-6 * float(history.supplied_nJ.max())


def test_modes_of_a_train_radiate_as_the_full_lever(bright):
    """The reduced equations at states of the modes are those of the full ones, tested with them."""
    lever, snapshots = Lever(ALL, COARSE), []
    simulate(lever, step(5.0), 40.0, callback=lambda t, state: snapshots.append(state.x))
    reduced = reduced_in_time(lever, np.hstack(snapshots))
    x = snapshots[-1]
    few = reduced.equations
    found = few.losses(reduced.space.coordinates(x))["rim"][0].sum()
    assert found == pytest.approx(lever.equations.losses(x)["rim"][0].sum(), rel=1e-4)
    (rest,) = lever.solve([5.0])
    late = integrate(reduced, step(5.0), at=[20000.0])
    assert late.tip_K.item() - BASE == pytest.approx(rest.tip_K - BASE, rel=2e-3)


def test_slow_signals_see_the_slopes_at_rest(bright):
    lever = Lever(ALL, COARSE)
    (state,) = lever.solve([6.0])
    along = lever.equations.along(state.x, lever.equations.factorised(state.x))
    lever_V, current_mA, _ = lever.equations.observed_change(state.x, along)[:, 0]
    data = spectrum(state, [1e-3])
    assert data.impedance_real_ohm.item() == pytest.approx(1e3 * lever_V / current_mA, rel=1e-6)
    nearby = lever.solve([5.99, 6.01])
    slope = (nearby[1].lever_V - nearby[0].lever_V) / (nearby[1].current_mA - nearby[0].current_mA)
    assert data.impedance_real_ohm.item() == pytest.approx(1e3 * slope, rel=1e-4)
