"""A tip in contact against full 3-D, and the resistance of its interface from simulated data.

    python benchmarks/contact.py [solid] [air]      (needs NGSolve)
    python benchmarks/contact.py twins [COUNT] [CASE...]

solid  Heat conduction in the lever of its true thickness, the cone and a half-ball of the sample,
       all meshed by Netgen and solved by NGSolve, with the Joule heat of the flat lever; in three
       regimes.
air    A cone between a hot plate and a sample in air whose temperature jumps at surfaces, meshed in
       the plane of its axis. The laws of silicon and air are stated here on their own.
twins  Each has a resistance of its own, between a third and three times what resists beside it, and
       a material of its own, known to 1 % by priors, as from a fit out of contact. Of its interface
       nothing is known but its power of ten. Currents have a noise of 1e-4, and a scale that is off
       by 1e-3, as is assumed of a meter; melting points have a noise of 1.5 K. Simulated and
       estimated on the same coarse mesh: what is examined is the inference.
       in: 41 biases in contact. melting: these, and melting points at three of them. in and out: 41
       biases in contact and the same out of it. approach: in air, where the gas is known to 5 %, a
       curve at 11.5 V of 200 rows from 3 µm to contact and 200 in it, with 21 biases out of
       contact; the lever is then near its knee, and its current tells nine times as much of the
       interface as at 9 V. radius: in and out, where the apex is known to 10 %.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import ngsolve as ng
import numpy as np
from netgen.occ import (
    Axes,
    Axis,
    Cylinder,
    Glue,
    HalfSpace,
    OCCGeometry,
    Pnt,
    Sphere,
    Vec,
    WorkPlane,
    X,
    Y,
    Z,
)
from scipy.integrate import quad
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.optimize import brentq

from hotlever import Measurement, fit
from hotlever.contact.law import INTERFACE, ContactLaw, cold_resistance
from hotlever.estimate.experiment import ExperimentAtRest, with_distances
from hotlever.lever import Lever
from hotlever.lever.contact import sweep_in_contact
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement.data import as_attributes
from hotlever.probe import Probe
from hotlever.probe.mesh import face_of
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.probe.tip import OUT_OF_CONTACT
from hotlever.quantities import FITTED, METERS
from problems import table

# --- full 3-D ------------------------------------------------------------------------------------

#: Contact radius (nm), height (µm), half-angle (°), sample, interface (K/mW), bias (V).
CASES = (
    (5.0, 0.7, 20.0, "polymer, 100nm, silicon", 2e4, 8.0),
    (20.0, 0.7, 20.0, "SiO2", 1e2, 8.0),
    (100.0, 0.5, 35.0, "silicon", 20.0, 8.0),
)
#: Radius of the half-ball of sample, over that of the contact, or over a third of the films.
OUT = 60.0
#: κ of bulk silicon at 300 K (mW/(µm K)), and the mean free path of phonons (µm) there.
AT_300, PATH = 0.1 / 0.707, 0.3
#: Rounds in which κ follows the temperature, and edges on the disc of the contact, over its radius.
ROUNDS, FINE = 8, 0.15
#: Contact radius (nm), height (µm) and half-angle (°) of cones in air, and their distance to the
#: sample (µm).
IN_AIR = (
    *((5.0, 0.7, 20.0, 0.0), (20.0, 0.7, 35.0, 0.0), (20.0, 3.0, 14.0, 0.0)),
    *((20.0, 0.7, 35.0, 0.05), (20.0, 0.7, 35.0, 0.5), (20.0, 3.0, 14.0, 1.0)),
)
#: Temperature at the base of these cones (K), and how far the plate reaches, over the height.
HOT_K, REACH = 800.0, 6.0


def kappa_silicon(T: Any, scale: float, diameter: Any = None) -> Any:
    """Return κ (mW/(µm K)) as an expression of NGSolve."""
    bend = ng.IfPos(T - 680.0, 1.05e-3 * (T - 680.0), 0.0)
    resistivity = (0.707 + 3.15e-3 * (T - 300.0) + bend) / (0.1 * scale)
    return 1.0 / (resistivity if diameter is None else resistivity + PATH / (AT_300 * diameter))


def solid(
    radius: float, height: float, angle: float, sample: str, interface: float, bias: float
) -> list[str]:
    """Return a row: the case, and heat into the sample and T_tip beside the full 3-D."""
    end = 1e-3 * radius
    tip = {"tip.height_um": height, "tip.half_angle_deg": angle, "tip.apex_radius_um": end}
    probe = Probe.reference().with_(**tip, sample=sample, interface_K_per_mW=interface)
    lever = Lever(probe)
    data = sweep_in_contact(lever, [bias])
    layout, layers = probe.layout(), probe.contact.layers
    x, y = layout.tip
    bottom = -layout.thickness_um / 2.0
    apex, base = bottom - height, probe.circuit.base_temperature_K

    plates = []
    for region in layout.regions:
        plate = face_of(region, WorkPlane(Axes((0, 0, bottom), Z, X))).Extrude(layout.thickness_um)
        plate.maxh = 0.3 if region is layout.heater else 2.0
        plate.mat("plate")
        plates.append(plate)
    section = WorkPlane(Axes((x, y, bottom), Y, X)).MoveTo(0, 0)
    section = section.LineTo(probe.tip.base_radius_um, 0).LineTo(end, height).LineTo(0, height)
    cone = section.Close().Face().Revolve(Axis(Pnt(x, y, bottom), Z), 360)
    cone.mat("cone")
    films = sum(layer.thickness_um or 0.0 for layer in layers)
    out = OUT * max(end, films / 3.0)
    centre = Pnt(x, y, apex)
    rest = Sphere(centre, out) * HalfSpace(centre, Vec(0, 0, 1))
    parts, top = [], apex
    for number, layer in enumerate(layers):
        depth = 2.0 * out if layer.thickness_um is None else layer.thickness_um
        slab = Cylinder(Pnt(x, y, top - depth), Z, 2.0 * out, depth)
        part = rest * slab
        part.mat(f"layer{number}")
        for face in part.faces:
            if abs(math.dist(tuple(face.center), tuple(centre)) - out) < 0.6 * out:
                face.name = f"out{number}"
        parts.append(part)
        top -= depth
    shape = Glue([*plates, cone, *parts])
    for face in shape.faces:
        level = [vertex.p[2] for vertex in face.vertices]
        flat = max(abs(z - apex) for z in level) < 1e-9
        middle = math.hypot(face.center.x - x, face.center.y - y) < 1e-6
        if flat and middle and face.mass < 4.0 * end**2:
            face.name, face.maxh = "touched", FINE * end
        elif abs(face.center.x) < 1e-6:
            face.name = "ends"
        elif flat:
            face.name = "bare"
    mesh = ng.Mesh(OCCGeometry(shape).GenerateMesh(maxh=max(2.0, out / 4.0), grading=0.2))
    mesh.Curve(2)

    # the Joule heat of the flat lever, by its place in the plane
    (state,) = lever.solve([bias])
    made = -lever.equations.fluxes(state.x).heat_source[:, 0]
    places = lever.space.elements.positions.T
    inside, beyond = LinearNDInterpolator(places, made), NearestNDInterpolator(places, made)
    heated = [element for element in mesh.Elements(ng.VOL) if element.mat == "plate"]
    corners = np.array([[mesh[v].point for v in element.vertices] for element in heated])
    middles = corners.mean(axis=1)[:, :2]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    density = np.where(np.isnan(inside(middles)), beyond(middles), inside(middles))
    density *= (made @ lever.space.weights[:, 0]) / (density @ volumes)
    constant = ng.L2(mesh, order=0)
    source = ng.GridFunction(constant)
    source.vec.FV().NumPy()[[element.nr for element in heated]] = density

    # temperatures above and below the contact, coupled through the interface
    above = ng.H1(mesh, order=2, definedon="plate|cone", dirichlet="ends")
    below = ng.H1(mesh, order=2, definedon="layer.*")
    both = above * below
    (u, w), (v, z) = both.TnT()
    rise = ng.GridFunction(both)
    through = 1.0 / (interface * math.pi * end**2)
    diameter = 2.0 * (end + probe.tip.slope * ng.IfPos(ng.z - apex, ng.z - apex, 0.0))
    right = ng.LinearForm(source * v * ng.dx("plate")).Assemble()
    for _ in range(ROUNDS):
        T = base + rise.components[0]
        form = ng.BilinearForm(both, symmetric=True)
        c_kappa = probe.material.c_kappa
        form += kappa_silicon(T, c_kappa) * ng.grad(u) * ng.grad(v) * ng.dx("plate")
        form += kappa_silicon(T, 1.0, diameter) * ng.grad(u) * ng.grad(v) * ng.dx("cone")
        form += through * (u - w) * (v - z) * ng.ds("touched")
        for number, layer in enumerate(layers):
            kappa = 1e-3 * layer.kappa
            form += kappa * ng.grad(w) * ng.grad(z) * ng.dx(f"layer{number}")
            # far away the temperature falls with the distance
            form += (kappa / out) * w * z * ng.ds(f"out{number}")
        form.Assemble()
        rise.vec.data = form.mat.Inverse(both.FreeDofs(), inverse="sparsecholesky") * right.vec
    upper, lower = rise.components
    heat = float(ng.Integrate(through * (upper - lower), mesh.Boundaries("touched")))
    tip_K = base + float(upper(mesh(x, y, bottom)))
    flat_mW, flat_K = data.sample_mW.item(), data.tip_K.item()
    name = f"{radius:g} nm, {height:g} µm, {angle:g}°; {sample}; {1e3 * interface:.1e} K/W"
    return [
        name,
        f"{1e3 * flat_mW:.4g}",
        f"{1e3 * heat:.4g}",
        f"{100 * (flat_mW / heat - 1):+.2f}",
        f"{flat_K:.1f}",
        f"{tip_K:.1f}",
        f"{both.ndof}",
    ]


def in_air(radius: float, height: float, angle: float, distance: float) -> list[str]:
    """Return a row: a cone, and where its heat goes beside a mesh of cone and air."""
    end = 1e-3 * radius
    tip = {"tip.height_um": height, "tip.half_angle_deg": angle, "tip.apex_radius_um": end}
    probe = Probe.reference().with_(**tip, sample="polymer", medium="air", surface_gap_um=height)
    if distance:
        probe = probe.replace({"surface_gap_um": height + distance, INTERFACE: OUT_OF_CONTACT})
    law, base = ContactLaw(probe), probe.circuit.base_temperature_K
    around = probe.surroundings.with_(accommodation=1.0)
    jumps = [around.jump_length_um(T) for T in (around.jump_temperature_K, base)]
    wide, gap = probe.tip.base_radius_um, height + distance
    reach = REACH * gap

    def polygon(corners: list[tuple[float, float]], name: str) -> Any:
        plane = WorkPlane().MoveTo(*corners[0])
        for corner in corners[1:]:
            plane = plane.LineTo(*corner)
        face = plane.Close().Face()
        face.name = name
        return face

    below = [(end, distance), (0, distance), (0, 0)] if distance else [(end, 0)]
    cone = polygon([(0, distance), (end, distance), (wide, gap), (0, gap)], "cone")
    air = polygon([*below, (reach, 0), (reach, gap), (wide, gap)], "air")
    shape = Glue([cone, air])
    for edge in shape.edges:
        x, y = edge.center.x, edge.center.y
        low, high = abs(y) < 1e-9, abs(y - gap) < 1e-9
        inner = x < end and not distance if low else x < wide
        if low or high:
            edge.name = {(1, 1): "touched", (1, 0): "sample", (0, 1): "base", (0, 0): "plate"}[
                int(low), int(inner)
            ]
        elif 0.0 < x < wide:
            edge.name = "end" if abs(y - distance) < 1e-9 else "side"
    for vertex in shape.vertices:
        if abs(vertex.p[1] - distance) < 1e-9 and vertex.p[0] <= end * 1.001:
            vertex.maxh = end / 6.0
    mesh = ng.Mesh(OCCGeometry(shape, dim=2).GenerateMesh(maxh=gap / 6.0, grading=0.15))
    solid_space = ng.H1(mesh, order=3, definedon="cone", dirichlet="base")
    air_space = ng.H1(mesh, order=3, definedon="air")
    both = solid_space * air_space
    (u, w), (v, z) = both.TnT()
    rise = ng.GridFunction(both)
    around_axis = 2.0 * math.pi * ng.x
    diameter = 2.0 * (end + probe.tip.slope * (ng.y - distance))
    through = 1.0 / (law.below_apex_K_per_mW * math.pi * end**2)
    for _ in range(ROUNDS):
        upper, lower = rise.components
        T, T_air = base + upper, base + lower
        of_air = kappa_air(T_air)
        form = ng.BilinearForm(both, symmetric=True)
        of_cone = kappa_silicon(T, 1.0, diameter)
        form += around_axis * of_cone * ng.grad(u) * ng.grad(v) * ng.dx("cone")
        form += around_axis * of_air * ng.grad(w) * ng.grad(z) * ng.dx("air")
        form += around_axis * through * u * v * ng.ds("touched")
        form += around_axis * of_air / jumps[0] * (u - w) * (v - z) * ng.ds("side|end")
        form += around_axis * of_air / jumps[1] * w * z * ng.ds("sample")
        form += around_axis * of_air / jumps[0] * w * z * ng.ds("plate")
        hot = around_axis * of_air / jumps[0] * (HOT_K - base) * z * ng.ds("plate")
        right = ng.LinearForm(hot).Assemble()
        form.Assemble()
        upper.Set(ng.CF(HOT_K - base), definedon=mesh.Boundaries("base"))
        rest = right.vec - form.mat * rise.vec
        rise.vec.data += form.mat.Inverse(both.FreeDofs(), inverse="sparsecholesky") * rest
    upper, lower = rise.components
    into = around_axis * kappa_air(base + lower) / jumps[1] * lower
    into_mW = float(ng.Integrate(into, mesh.Boundaries("sample")))
    # the lever's own surface is a plate that gives its heat without a tip
    beside_mW = into_mW - math.pi * reach**2 * plate_flux(base, gap, jumps)
    touched, bottom = mesh.Boundaries("touched"), mesh.Boundaries("touched|end")
    heat = 0.0 if distance else float(ng.Integrate(around_axis * through * upper, touched))
    apex = base + float(ng.Integrate(upper * ng.x, bottom) / ng.Integrate(ng.x, bottom))
    ours = law.at(np.array([HOT_K]))
    return [
        f"{radius:g} nm, {height:g} µm, {angle:g}°, {distance:g} µm away",
        f"{1e3 * ours.beside_mW.item():.3g}",
        f"{1e3 * beside_mW:.3g}",
        f"{1e3 * ours.sample_mW.item():.4g}",
        f"{1e3 * heat:.4g}",
        f"{ours.apex_K.item():.1f}",
        f"{apex:.1f}",
    ]


def plate_flux(base: float, height: float, jumps: list[float]) -> float:
    """Return the heat flux (mW/µm²) from a plate to a sample through air, with its jumps."""

    def missing(flux: float) -> float:
        hot = brentq(lambda T: HOT_K - T - flux * jumps[0] / kappa_air(T), base, HOT_K)
        cold = brentq(lambda T: T - base - flux * jumps[1] / kappa_air(T), base, HOT_K)
        return quad(kappa_air, cold, hot)[0] - flux * height

    return float(brentq(missing, 0.0, kappa_air(HOT_K) * (HOT_K - base) / (height + sum(jumps))))


def kappa_air(T: Any) -> Any:
    """Return κ (mW/(µm K)) of air as an expression of NGSolve: Eq. 13."""
    rising = 2.60e-4 + 4.70e-7 * T + 1.48e-7 * T**0.5
    return 0.1 * (rising - 6.63e-2 / T + 9.14 / T**2 - 6.50e2 / T**3)


def meshed(asked: list[str]) -> None:
    """Print the tables that are asked for."""
    if "solid" in asked:
        heads = ["contact", "heat (µW)", "3-D", "off (%)", "T_tip (K)", "3-D", "unknowns"]
        table(heads, [solid(*case) for case in CASES])
    if "air" in asked:
        heads = ["cone", "by air (µW)", "meshed", "by contact", "meshed", "apex (K)", "meshed"]
        table(heads, [in_air(*case) for case in IN_AIR])


# --- twins ---------------------------------------------------------------------------------------

#: Noise of the current, and what is known of the material.
NOISE, KNOWN = 1e-4, 0.01
#: Biases (V) of a sweep, of some rows before an approach, and of that.
BIAS, FEW, AT = np.linspace(5.0, 10.5, 41), np.linspace(5.0, 10.5, 21), 11.5
#: Distances of an approach (µm), and temperatures near which samples melt, with their error (K).
DISTANCE, MELTING, MELTING_ERROR = np.geomspace(3.0, 0.003, 200), (333.0, 403.0, 528.0), 1.5
PROBE = Probe.reference().with_(
    **{"tip.height_um": 0.7, "tip.apex_radius_um": 0.02}, sample="glass", interface_K_per_mW=1e4
)
PROBE_IN_AIR = PROBE.with_(medium="air", surface_gap_um=0.7)
#: Errors that an interface may have where it counts, and the quantile of a band of 95 %.
GOOD, BAND = 0.1, 1.96


class Case(NamedTuple):
    """What is measured: where, and what else than the material is known to a share."""

    probe: Probe
    bias: np.ndarray
    distance: np.ndarray
    melting: bool = False
    known: Mapping[str, float] = MappingProxyType({})


def both(bias: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return biases and distances of rows in contact, and of the same out of it."""
    return np.tile(bias, 2), np.repeat([0.0, 1.0], bias.size)


TWINS = {
    "in": Case(PROBE, BIAS, 0.0 * BIAS),
    "melting": Case(PROBE, BIAS, 0.0 * BIAS, melting=True),
    "in and out": Case(PROBE, *both(BIAS)),
    "approach": Case(
        PROBE_IN_AIR,
        np.concatenate([FEW, np.full(400, AT)]),
        np.concatenate([np.full(FEW.size, 3.0), DISTANCE, np.zeros(200)]),
        known={"gas_conductivity": 0.05},
    ),
    "radius": Case(PROBE, *both(BIAS), known={"apex_radius_um": 0.1}),
}


def model(probe: Probe, bias: np.ndarray, names: Any = None) -> ExperimentAtRest:
    """Return the lever on a coarse mesh, not corrected."""
    names = usual_parameters(probe) if names is None else names
    return ExperimentAtRest(SimilarLevers(Lever(probe, COARSE)), None, bias, names)


def twin(case: Case, number: int) -> tuple[float, float]:
    """Return by how much the logarithm of the resistance is off, and its standard error."""
    random, probe = np.random.default_rng(number), case.probe
    law = ContactLaw(probe)
    assert probe.tip is not None
    beside = law.spreading_K_per_mW + cold_resistance(probe.tip, 293.0)
    known = dict.fromkeys(usual_parameters(probe), KNOWN) | dict(case.known)
    values = dict(zip(known, probe.values(list(known)), strict=True))
    truth = {name: values[name] * np.exp(known[name] * random.normal()) for name in known}
    truth[INTERFACE] = beside * np.exp(random.uniform(-1.0, 1.0) * np.log(3.0))
    experiment = with_distances(model(probe, case.bias), probe, case.distance)
    shown = experiment.measuring(case.bias, None, case.distance).predict(probe.replace(truth))
    rows = {column.name: shown.values[row] for row, column in enumerate(FITTED.values())}
    nothing = np.full(case.bias.size, np.nan)
    shares = 1.0 + NOISE * random.normal(size=nothing.size)
    current = rows["current_mA"] * shares * (1.0 + METERS * random.normal())
    measured = Measurement(case.bias, current, nothing, nothing, nothing)
    measured = replace(measured, distance_um=case.distance)
    if case.melting:
        # of materials that melt at what the rows show: what is between rows is not interpolated
        melts = [int(np.argmin(np.abs(rows["surface_K"] - near))) for near in MELTING]
        at = case.bias[melts]
        found = rows["surface_K"][melts] + MELTING_ERROR * random.normal(size=at.size)
        empty = np.full(at.size, np.nan)
        columns = {
            "bias_V": np.append(case.bias, at),
            "current_mA": np.append(current, empty),
            "surface_K": np.append(nothing, found),
            "surface_error_K": np.append(nothing, np.full(at.size, MELTING_ERROR)),
            "distance_um": np.append(case.distance, 0.0 * at),
        }
        measured = Measurement(**as_attributes(columns))
    priors = {name: f"± {100 * share:g}%" for name, share in known.items()}
    result = fit(measured, probe, priors=priors | {INTERFACE: "×/ 10"}, model=model)
    of = result.parameters[INTERFACE]
    error = np.nan if of.stderr is None else of.stderr / of.value
    return float(np.log(of.value / truth[INTERFACE])), error


def twins(number: str = "200", *names: str) -> None:
    """Print how far off the resistances are, and how often the bands hold them."""
    count, rows = int(number), []
    for name in names or TWINS:
        began = time.process_time()
        off, error = np.array([twin(TWINS[name], number) for number in range(count)]).T
        rows.append(
            [
                name,
                f"{count}",
                f"{100 * np.median(np.abs(off)):.1f}",
                f"{100 * np.mean(np.abs(off) < GOOD):.0f}",
                f"{100 * np.mean(np.abs(off) < BAND * error):.1f}",
                f"{np.sqrt(np.mean((off / error) ** 2)):.2f}",
                f"{(time.process_time() - began) / count:.1f}",
            ]
        )
        print(rows[-1], file=sys.stderr)
    heads = ["measured", "twins", "median error (%)", "within 10 % (%)", "held by 95 % (%)"]
    table([*heads, "pulls (rms)", "s each"], rows)


if __name__ == "__main__":
    if sys.argv[1:2] == ["twins"]:
        twins(*sys.argv[2:])
    else:
        meshed(sys.argv[1:] or ["solid", "air"])
