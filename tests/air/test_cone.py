"""The tip's surface in air: bodies with an exact loss, a plate with a cone, heat through it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plates import plate, turned
from scipy.integrate import solve_ivp

from hotlever.air.bodies import conduction, cone_panels, revolved
from hotlever.air.laplace import Laplace
from hotlever.air.operator import PanelledAir, air_operator
from hotlever.air.single_layer import single_layer_matrix
from hotlever.errors import InputError
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.probe import Tip
from hotlever.probe.surroundings import Surroundings

BOX = ((0, 0), (4, 0), (4, 2), (0, 2))
CONE = Tip(height_um=1.0, half_angle_deg=20, in_air=True)
COARSE = 0.5
#: A cone that is all of the temperature of its base.
PERFECT = 30.0


def spheroid(radius: float, rings: int) -> float:
    """Heat lost by a spheroid at θ = 1 whose half-axis of revolution is 1 µm."""
    angle = np.linspace(0.0, np.pi, rings + 1)
    profile = np.stack([radius * np.sin(angle), np.cos(angle)], axis=1)
    profile[[0, -1], 0] = 0.0
    panels = revolved(profile, 12)
    return float(
        panels.areas @ np.linalg.solve(single_layer_matrix(panels, Laplace()), panels.areas)
    )


@pytest.mark.parametrize("radius", [1.0, 0.5, 0.2, 0.05])
def test_a_sphere_and_prolate_spheroids_lose_the_exact_heat(radius):
    focus = np.sqrt(1.0 - radius**2)
    exact = 4.0 * np.pi * (focus / np.arctanh(focus) if focus else 1.0)
    errors = [spheroid(radius, rings) / exact - 1.0 for rings in (8, 16)]
    assert abs(errors[1]) < 0.005
    # corners of rings lie on the body
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.4)


@pytest.mark.parametrize(
    "cone",
    [
        CONE,
        Tip(height_um=100.0, half_angle_deg=1.0, apex_radius_um=1e-4),
        Tip(height_um=0.01, half_angle_deg=80.0, apex_radius_um=10.0),
        Tip(height_um=0.01, half_angle_deg=1.0, apex_radius_um=1e-4),
    ],
)
def test_panels_cover_side_and_flat_end_of_any_cone(cone):
    base, apex, height = cone.base_radius_um, cone.apex_radius_um, cone.height_um
    panels = cone_panels(cone)
    area = np.pi * (base + apex) * np.hypot(height, base - apex) + np.pi * apex**2
    assert panels.areas.sum() == pytest.approx(area, rel=0.02)
    assert len(panels) < 1000
    assert panels.corners[..., 2].max() == 0.0
    assert panels.corners[..., 2].min() == pytest.approx(-height)


def with_cone(cone=CONE, **changes):
    return replace(plate(BOX, 0.4), cone=cone.model_copy(update=changes), tip=(2.0, 1.0))


def heats(layout, refinement=1.0, **surroundings) -> tuple[float, float]:
    """Heat lost at θ = 1 by all and by the cone's panels."""
    around = Surroundings(medium="air", **surroundings)
    air = PanelledAir(layout, around, 293.0, refinement)
    heat = air.densities(np.ones(len(air.surface.sites))) * air.panels.areas
    own = heat[: len(air.surface.panels)]
    return float(own.sum()), float(own[len(own) - len(air.surface.through_tip) :].sum())


def test_the_air_does_not_see_a_tip_that_does_not_ask_for_it():
    hidden, none = with_cone(in_air=False), replace(with_cone(), cone=None)
    assert np.array_equal(
        air_operator(hidden, refinement=COARSE).matrix, air_operator(none, refinement=COARSE).matrix
    )


def test_panels_are_fine_enough_and_the_operator_is_one():
    operator = air_operator(with_cone(), refinement=COARSE)
    assert np.abs(operator.matrix - operator.matrix.T).max() == 0.0
    assert np.linalg.eigvalsh(operator.matrix).min() > 0.0
    more = [
        air_operator(with_cone(), refinement=refinement).matrix.sum()
        - air_operator(with_cone(in_air=False), refinement=refinement).matrix.sum()
        for refinement in (COARSE, 1.0)
    ]
    assert more[0] == pytest.approx(more[1], rel=0.03)
    # the cone shades the lever
    assert 0.0 < more[1] < 0.5 * heats(with_cone(), COARSE)[1]


def test_turning_changes_nothing():
    here, there = (
        heats(one, COARSE) for one in (with_cone(), turned(with_cone(), 0.7, (9.0, 5.0)))
    )
    assert there == pytest.approx(here, rel=1e-3)


def test_the_sites_of_a_cone_lie_above_it():
    air = PanelledAir(with_cone(), Surroundings(medium="air"), 293.0, COARSE)
    surface, count = air.surface, len(air.surface.through_tip)
    sites = surface.sites[surface.site[-count:]]
    assert count == len(cone_panels(CONE, COARSE))
    assert np.linalg.norm(sites - [2.0, 1.0], axis=1).max() < CONE.base_radius_um


def test_a_wide_flat_end_near_a_surface_is_a_circular_capacitor():
    """Kirchhoff's: area over gap and the fringe field, as for the disc in the open boundary."""
    cone = Tip(height_um=3.0, half_angle_deg=1.0, apex_radius_um=0.5, in_air=True, kappa=PERFECT)
    lost = [heats(with_cone(cone), COARSE, surface_gap_um=3.0 + gap)[1] for gap in (0.01, 0.005)]
    radius = cone.apex_radius_um

    def capacitor(gap):
        return np.pi * radius**2 / gap + radius * np.log(16.0 * np.pi * radius / gap)

    assert lost[1] - lost[0] == pytest.approx(capacitor(0.005) - capacitor(0.01), rel=0.02)


def test_a_tip_that_touches_the_surface_below_is_refused():
    with pytest.raises(InputError, match="crosses the lever, its tip or its chip"):
        air_operator(with_cone(), Surroundings(surface_gap_um=0.99), refinement=COARSE)


@pytest.mark.parametrize("cone", [CONE.with_(kappa=0.02), Tip(height_um=5.0, half_angle_deg=4.0)])
def test_heat_comes_through_the_tip_as_the_equation_of_a_fin_says(cone):
    """Where each place of the surface loses in proportion to its θ, integrated from the apex."""
    exchange = 20.0  # over the air's conductivity, 1/µm
    ratio = thermal_conductivity_of_air(900.0)[0] / cone.kappa

    def fin(z, y):
        theta, flow = y
        radius = cone.base_radius_um - cone.slope * z
        around = 2.0 * np.pi * radius * np.hypot(1.0, cone.slope)
        return -ratio * flow / (np.pi * radius**2), -around * exchange * theta

    at_apex = (1.0, np.pi * cone.apex_radius_um**2 * exchange)
    found = solve_ivp(fin, (cone.height_um, 0.0), at_apex, rtol=1e-8, method="Radau")
    theta, flow = found.y[:, -1]
    panels = cone_panels(cone, 2.0)
    resistance = np.diag(1.0 / (exchange * panels.areas)) + conduction(cone, panels)
    lost = np.linalg.solve(resistance, np.ones(len(panels))).sum()
    assert lost == pytest.approx(flow / theta, rel=0.01)
    assert lost < 0.9 * exchange * panels.areas.sum()  # the tip's θ falls


@pytest.mark.slow
def test_a_plate_with_a_cone_against_three_dimensions():
    """Whole and cone by finite elements, which come to the limit from above."""
    pytest.importorskip("ngsolve")
    from netgen.occ import Axes, Axis, Box, OCCGeometry, Pnt, WorkPlane, X, Y, Z

    from hotlever.lever3d import OpenAir
    from hotlever.probe.mesh import in_a_sphere

    cone = Tip(height_um=3.0, half_angle_deg=10.0, apex_radius_um=0.05, in_air=True, kappa=PERFECT)
    section = WorkPlane(Axes((2, 1, -0.2), Y, X))
    section.MoveTo(0, 0).LineTo(cone.base_radius_um, 0).LineTo(cone.apex_radius_um, cone.height_um)
    solid = section.LineTo(0, cone.height_um).Close().Face().Revolve(Axis(Pnt(2, 1, -0.2), Z), 360)
    body = Box(Pnt(0, 0, -0.2), Pnt(4, 2, 0.2)) + solid
    body.faces.maxh = 0.3
    body.edges.maxh = 0.2
    centre, radius = (2.0, 1.0, 0.0), 8.0
    mesh = OCCGeometry(in_a_sphere(body, centre, radius)).GenerateMesh(maxh=2.4, grading=0.4)
    air = OpenAir(mesh, centre, radius, order=3)
    _, heat = air.solve(np.ones(len(air.sites)))
    whole, of_cone = heats(with_cone(cone))
    assert whole == pytest.approx(heat.sum(), rel=3e-3)
    assert of_cone == pytest.approx(heat[air.sites[:, 2] < -0.2 - 1e-6].sum(), rel=0.012)
