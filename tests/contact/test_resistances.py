"""Cone, interface and sample against quadrature, exact solutions and limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_bvp
from scipy.special import j1

from hotlever.contact.law import (
    AirBeside,
    ContactLaw,
    axis_rise,
    cold_resistance,
    contact_resistance,
    up_the_cone,
)
from hotlever.errors import InputError
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.heat import thermal_conductivity, thermal_conductivity_of_wire
from hotlever.probe import Probe, Tip
from hotlever.probe.tip import OUT_OF_CONTACT, interface_of

SHARP = Tip(height_um=0.7, half_angle_deg=20.0, apex_radius_um=0.005)
BLUNT = Tip(height_um=0.5, half_angle_deg=50.0, apex_radius_um=0.1)
RADIUS = 0.005


def at_the_lever(*arguments: object) -> list[np.ndarray]:
    """Temperature, heat and resistance of a cone where it meets the lever."""
    _, *along = up_the_cone(*arguments)
    return [each[-1] for each in along]


def probe(**values: object) -> Probe:
    tip = {f"tip.{name}": value for name, value in SHARP}
    return Probe.reference().with_(**tip | {"sample": "polymer, 100nm, silicon"} | values)


@pytest.mark.parametrize("tip", [SHARP, BLUNT])
def test_a_cold_cone_is_the_integral_of_its_shells(tip):
    """Caps of spheres about the point of the cone, from the flat end's rim to the base's."""
    half_angle = np.radians(tip.half_angle_deg)

    def shell(distance: float) -> float:
        kappa, _ = thermal_conductivity_of_wire(400.0, 2.0 * distance * np.sin(half_angle))
        return 1.0 / (0.1 * float(kappa) * 2.0 * np.pi * (1.0 - np.cos(half_angle)) * distance**2)

    rims = np.array([tip.apex_radius_um, tip.base_radius_um]) / np.sin(half_angle)
    whole, _ = quad(shell, *rims, epsrel=1e-10, limit=200)
    assert cold_resistance(tip, 400.0) == pytest.approx(whole, rel=1e-8)
    # a heat that warms it by a microkelvin
    heat = np.array([1e-6 / whole])
    T, same, _ = at_the_lever(tip, np.array([400.0]), heat, 293.0)
    assert pytest.approx(1e-6, rel=1e-5) == T - 400.0
    assert same == heat


def test_a_hot_cone_is_the_integral_of_bulk_and_surface():
    """At a given heat, dz/(π r²) of bulk is dT less what the surface adds, wherever it is large."""
    wide = Tip(height_um=0.7, half_angle_deg=20.0, apex_radius_um=10.0)
    cosine = np.cos(np.radians(20.0))
    heat = 0.1 * np.pi * 10.0 * wide.base_radius_um / 0.7 * 20.0 * 2.0 * cosine / (1.0 + cosine)
    T, *_ = at_the_lever(wide, np.array([500.0]), np.array([heat]), 293.0)
    # almost bulk: Kirchhoff's integral of κ, less the surface's share at the mean diameter
    by_surface = 0.3 / (float(thermal_conductivity(300.0)[0]) * 20.25)
    kappa = lambda K: 1.0 / (1.0 / float(thermal_conductivity(K)[0]) + by_surface)  # noqa: E731
    conducted, _ = quad(kappa, 500.0, T.item())
    assert conducted == pytest.approx(20.0, rel=1e-4)


def test_the_air_beside_a_sharp_cone_is_that_between_coaxial_cones():
    sharp = Tip(height_um=1.0, half_angle_deg=20.0, apex_radius_um=1e-4)
    by_height = AirBeside(1.0, 0.0, 0.0).conductance(sharp, np.array([0.1])) / 0.9**1.5
    exact = 2.0 * np.pi / np.log(1.0 / np.tan(np.radians(10.0))) / np.cos(np.radians(20.0))
    assert by_height.item() == pytest.approx(exact, rel=3e-3)


def test_a_cone_in_air_is_a_fin():
    """Its two first-order equations, solved by collocation."""
    tip, air, base = BLUNT, AirBeside(1.0, 0.3, 0.1), 293.0

    def slopes(z: np.ndarray, state: np.ndarray) -> np.ndarray:
        radius = tip.apex_radius_um + z * tip.slope
        kappa, _ = thermal_conductivity_of_wire(state[0], 2.0 * radius)
        cosine = np.cos(np.radians(tip.half_angle_deg))
        area = np.pi * radius**2 * 2.0 * cosine / (1.0 + cosine)
        theta = [
            quad(lambda T: 0.1 * float(thermal_conductivity_of_air(T)[0]), base, K)[0]
            for K in state[0]
        ]
        return np.stack([state[1] / (0.1 * kappa * area), air.conductance(tip, z) * theta])

    z = np.linspace(0.0, tip.height_um, 30)
    fixed = lambda a, b: np.array([a[0] - 400.0, a[1] - 1e-3])  # noqa: E731
    exact = solve_bvp(slopes, fixed, z, np.stack([400.0 + 0 * z, 1e-3 + 0 * z]), tol=1e-6)
    T, heat, _ = at_the_lever(tip, np.array([400.0]), np.array([1e-3]), base, air)
    assert pytest.approx(exact.y[0, -1], abs=1e-4) == T
    assert heat == pytest.approx(exact.y[1, -1], rel=1e-4)
    # of a cold cone it is what it would be in vacuum, where no heat comes through its end too
    *_, cone = at_the_lever(tip, np.array([base + 0.01]), np.array([0.0]), base, air)
    assert cone == pytest.approx(cold_resistance(tip, base), rel=1e-4)


def by_collocation(kappas: list[float], thicknesses_um: list[float], count: int = 60) -> float:
    """The dual integral equations of two materials, at Gauss's points, by images of the film.

    With K = (κ₁ − κ₂)/(κ₁ + κ₂) the film answers with z − 1 = 2 Σ Kⁿ exp(−2nkh), whose cosine
    transforms are Lorentzians.
    """
    depth, (top, below) = thicknesses_um[0] / RADIUS, kappas
    image = (top - below) / (top + below)
    nodes, weights = np.polynomial.legendre.leggauss(count)
    x, weights = (1.0 + nodes) / 2.0, weights / 2.0
    apart, sum_ = x[:, None] - x, x[:, None] + x
    kernel = np.zeros((count, count))
    for n in range(1, 4000):
        far = 2.0 * n * depth
        kernel += image**n * far * (1.0 / (far**2 + apart**2) + 1.0 / (far**2 + sum_**2))
        if abs(image) ** n / n < 1e-14:
            break
    phi = np.linalg.solve(np.eye(count) + (2.0 / np.pi) * kernel * weights, np.ones(count))
    return 1e3 / (4.0 * top * RADIUS) / (weights @ phi)


@pytest.mark.parametrize("depth", [0.2, 1.0, 20.0])
@pytest.mark.parametrize("kappas", [[0.2, 1.4], [1.4, 0.2], [0.2, 141.0]])
def test_a_film_on_a_substrate_is_the_exact_solution(kappas, depth):
    resistance = contact_resistance(RADIUS, kappas, [depth * RADIUS])
    assert resistance == pytest.approx(by_collocation(kappas, [depth * RADIUS]), rel=1e-4)


def test_spreading_in_its_limits():
    half_space = contact_resistance(RADIUS, [0.2], [])
    assert half_space == pytest.approx(1e-3 / (4 * 0.2 * RADIUS * 1e-6), rel=1e-4)
    same = contact_resistance(RADIUS, [0.2, 0.2, 0.2], [0.004, 0.02])
    assert same == pytest.approx(half_space, rel=1e-12)
    deep = contact_resistance(RADIUS, [0.2, 400.0], [1000 * RADIUS])
    # Hertz's first image: 1 − (2/π) ln 2 a/h
    assert deep / half_space == pytest.approx(1 - 2 / np.pi * np.log(2) / 1000, abs=2e-5)
    # a thin film adds its own resistance to that of a substrate that conducts well
    thin = contact_resistance(RADIUS, [0.2, 2000.0], [0.02 * RADIUS])
    assert thin == pytest.approx(1e-3 * 0.02 / (0.2 * np.pi * RADIUS * 1e-6), rel=0.05)


def test_through_an_interface_that_resists_the_flux_is_uniform():
    """Then the mean temperature under it is Hankel's integral, in any number of layers."""
    kappas, depths = [0.2, 1.4, 141.0], [1.0, 3.0]

    def uniform(k: float) -> float:
        z = 1.0
        for above, below, depth in zip([1.4, 0.2], [141.0, 1.4], depths[::-1], strict=True):
            fall, ratio = np.tanh(k * depth), above / below * z
            z = (ratio + fall) / (1 + ratio * fall)
        return z * j1(k) ** 2 / k**2

    integral, _ = quad(uniform, 0.0, 400.0, limit=2000)
    flux = 1e3 * 2.0 / (np.pi * 0.2 * RADIUS) * integral
    thicknesses = [depth * RADIUS for depth in depths]
    resistance = contact_resistance(RADIUS, kappas, thicknesses, 1e9) - 1e9
    assert resistance == pytest.approx(flux, rel=1e-4)


@pytest.mark.parametrize(
    ("kappas", "thicknesses_um", "interface"),
    [([0.2, 0.2, 0.2], [0.003, 0.02], 0.0), ([0.2, 1.4, 141.0], [0.005, 0.02], 1e5)],
)
def test_under_the_disc_heat_flows_on_and_far_away_it_comes_from_a_point(
    kappas, thicknesses_um, interface
):
    below = RADIUS, kappas, thicknesses_um, interface
    edge, step = thicknesses_um[0], 1e-4 * thicknesses_um[0]
    above, under = (
        axis_rise(*below, edge + way * step * np.arange(1e-9, 3)) @ [3.0, -4.0, 1.0] * way
        for way in (-1, 1)
    )
    assert kappas[0] * above == pytest.approx(kappas[1] * under, rel=1e-4)
    far = axis_rise(*below, np.array([50.0])).item()
    point = 1e3 / (2.0 * np.pi * kappas[-1] * 50.0) / contact_resistance(*below)
    assert far == pytest.approx(point, rel=1e-3)
    if interface == 0.0:  # all of one material: a disc on a half-space
        depths = RADIUS * np.array([0.1, 0.5, 1.0, 3.9, 10.0])
        exact = 2.0 / np.pi * np.arctan(RADIUS / depths)
        assert axis_rise(*below, depths) == pytest.approx(exact, abs=1e-4)


def test_the_temperature_falls_from_the_lever_through_the_contact():
    law = ContactLaw(probe(interface_K_per_mW=5e4))
    height, T, under = law.along_axis(900.0, RADIUS * np.array([0.01, 1.0, 100.0]))
    assert (height[0], height[-1]) == pytest.approx((0.0, 0.7))
    assert (T[0], T[-1]) == pytest.approx(
        (law.at(np.array([900.0])).apex_K.item(), 900.0), rel=1e-6
    )
    whole = [*T[::-1], *under, 293.0]
    assert (np.diff(whole) < 0.0).all()


def test_the_law_is_a_series_of_resistances():
    law = ContactLaw(probe(interface_K_per_mW=5e4))
    rise = np.array([1.0, 300.0, 600.0])
    heat, _ = law.heat(rise)
    apex, surface, sample, beside, _ = law.at(293.0 + rise)
    assert sample == pytest.approx(heat)
    assert beside == pytest.approx(0.0, abs=1e-12)
    assert apex - surface == pytest.approx(heat * 5e4, rel=1e-9)
    assert apex - 293.0 == pytest.approx(heat * (5e4 + law.spreading_K_per_mW), rel=1e-9)
    T, *_ = at_the_lever(SHARP, apex, heat, 293.0)
    assert pytest.approx(293.0 + rise, rel=1e-7) == T
    cold = 5e4 + law.spreading_K_per_mW + cold_resistance(SHARP, 293.0)
    assert heat[0] == pytest.approx(1.0 / cold, rel=1e-4)


def test_the_law_in_its_limits():
    away = ContactLaw(probe(interface_K_per_mW=OUT_OF_CONTACT))
    assert away.heat(np.array([600.0]))[0] == pytest.approx(0.0, abs=1e-9)
    assert away.at(np.array([893.0])).apex_K == pytest.approx(893.0, rel=1e-4)
    sink = ContactLaw(probe(sample="1e4"))
    assert sink.at(np.array([893.0])).apex_K == pytest.approx(293.0, abs=0.2)


@pytest.mark.parametrize("medium", ["vacuum", "air"])
def test_the_law_s_derivatives(medium):
    around = {"medium": medium, "surface_gap_um": 0.7 if medium == "air" else None}
    law, rise = ContactLaw(probe(interface_K_per_mW=1e4, **around)), np.array([350.0])
    names = ["interface_K_per_mW", "height_um", "base_temperature_K"]
    _, by = law.heat(rise, names)
    step = 1e-3
    above, below = (law.heat(rise + way)[0] for way in (step, -step))
    assert by["T"] == pytest.approx((above - below) / (2 * step), rel=1e-6)
    # of what resists in series the heat goes with the inverse sum
    if medium == "vacuum":
        whole = rise / law.heat(rise)[0]
        assert by["interface_K_per_mW"] == pytest.approx(
            -law.sum_by_interface * rise / whole**2, rel=1e-2
        )
    assert by["height_um"] != 0.0


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("polimer", "did you mean 'polymer'"),
        ("polymer, silicon", "expected the thickness of polymer"),
        ("polymer, 100nm", "nothing under 100nm of polymer"),
        ("100nm, silicon", "found '100nm', expected the material"),
        ("polymer, 5m, silicon", "found '5m', expected the thickness"),
        ("polymer, , silicon", "expected the thickness"),
        ("-0.2", "0.001 to 10000"),
        ("", "expected the material"),
    ],
)
def test_a_sample_that_is_none_is_refused(text, named):
    with pytest.raises(InputError, match=named):
        probe(sample=text)


@pytest.mark.parametrize(("text", "named"), [("3", "1e7 K/W"), ("-1 K/W", "1e7"), ("1 W", "1e7")])
def test_an_interface_that_is_none_is_refused(text, named):
    with pytest.raises(InputError, match=named):
        interface_of(text, 0.005, "--interface")


def test_a_contact_that_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"without a section \[tip\]"):
        Probe.reference().with_(sample="silicon")
    with pytest.raises(InputError, match=r"the height of the tip in contact, 0\.7"):
        probe(medium="air")
