"""Derivatives by dimensions, by the conductivity of the gas and by the series resistance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from experiments import full_experiment
from hotlever.errors import ComputationError, InputError
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.observables import shown_at_knee_by_parameter
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import heat as heat_laws
from hotlever.piecewise import spline_through
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import dimensions_of, nuisances
from hotlever.probe.tip import Tip

pytestmark = pytest.mark.usefixtures("coarse_meshes")

REACH = Reach(Probe.reference().circuit, 6.0)
PROBES = {
    "three-leg": Probe.reference(),
    "u-shape": Probe.u_shape(),
    "with a tip": Probe.reference().model_copy(update={"tip": Tip(height_um=0.7)}),
}

RADIATING = ["emissivity", "base_temperature_K", *dimensions_of(PROBES["with a tip"])]


def orders(lever, name):
    """Observed orders of what a first-order prediction leaves at fixed tip temperatures."""
    probe, names, similar = lever.probe, (name,), SimilarLevers(lever)
    start = similar.linearised(probe, REACH, None, names)
    columns = slice(0, 3 if "reader" in lever.space.mesh.terminal_facets else 2)
    (value,), rest = probe.values(names), []
    unit = value or 1.0
    for step in (0.02, 0.01):
        perturbed_probe = probe.replace({name: float(value + step * unit)})
        other = similar.linearised(perturbed_probe, REACH, start, names).branch
        count = start.branch.u.size
        change = (other.values[:count] - start.branch.values)[1:, columns]
        rest.append(np.abs(change - step * unit * start.output_slopes[1:, columns, 0]))
    size = np.abs(start.branch.values[1:, columns])
    # what does not bend leaves nothing to measure an order of
    bent = rest[0] > 1e-7 * size
    return np.log2(rest[0][bent] / rest[1][bent]), rest[0] / size


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        (kind, name)
        for kind, probe in PROBES.items()
        for name in dimensions_of(probe)
        # the others of a lever with a tip are those of one without
        if kind != "with a tip" or name not in dimensions_of(PROBES["three-leg"])
    ],
)
def test_derivatives_by_dimensions_have_taylor_order_two(kind, name):
    found, rest = orders(Lever(PROBES[kind], COARSE), name)
    assert np.all(found > 1.6)
    assert rest.max() < 2e-3


@pytest.mark.parametrize("name", RADIATING)
def test_so_have_those_of_a_lever_that_radiates_most_of_its_heat(name, monkeypatch):
    """From faces and edges, whose lengths and heights change."""
    monkeypatch.setattr(heat_laws, "STEFAN_BOLTZMANN", 1000.0 * heat_laws.STEFAN_BOLTZMANN)
    lever = Lever(PROBES["with a tip"].with_physics(("radiation",)), COARSE)
    found, rest = orders(lever, name)
    assert np.all(found > 1.6)
    assert rest.max() < 2e-3


@pytest.mark.parametrize("name", ["gas_conductivity", "base_temperature_K"])
def test_so_have_those_by_gas_and_base_temperature_in_air(in_air, name):
    found, _ = orders(in_air, name)
    assert np.all(found > 1.8)


def test_so_has_that_by_the_gap_to_a_surface(coarse):
    above = Lever(coarse.probe.with_(medium="air", surface_gap_um=2.0), COARSE)
    found, _ = orders(above, "surface_gap_um")
    assert np.all(found > 1.8)
    # linear in the inverse gap is nearly what another operator says
    names, other = ("surface_gap_um",), above.probe.with_(surface_gap_um=2.2)
    displaced_branch = SimilarLevers(above).linearised(other, REACH, None, names).branch
    new, u = Lever(other, COARSE).branch_to(6.0), np.linspace(2.0, 9.0, 8)
    start = above.branch_to(6.0).curve(u)[:, :2]
    change = new.curve(u)[:, :2] - start
    np.testing.assert_allclose(
        displaced_branch.curve(u)[:, :2] - start, change, rtol=0.03, atol=1e-6
    )


def test_so_has_that_by_the_base_temperature_in_vacuum(coarse):
    found, _ = orders(coarse, "base_temperature_K")
    assert np.all(found > 1.8)


def test_a_moved_mesh_shows_what_a_new_one_does(coarse):
    probe = coarse.probe.with_(heater_length_um=4.3, gap_um=3.0, length_um=56.0, thickness_um=0.42)
    displaced_branch = SimilarLevers(coarse).linearised(probe, REACH).branch
    new = Lever(probe, COARSE).branch_to(6.0)
    u = np.linspace(2.0, 9.0, 8)
    np.testing.assert_allclose(displaced_branch.curve(u)[:, :3], new.curve(u)[:, :3], rtol=1e-3)


def test_a_mesh_that_would_turn_over_is_refused(coarse):
    probe = coarse.probe.replace({"heater_length_um": 60.0})
    with pytest.raises(ComputationError, match="cannot follow so large a change"):
        SimilarLevers(coarse).linearised(probe, REACH)


@pytest.fixture(scope="module")
def bridged(coarse):
    """A lever in a bridge far from balance: of every observable relative errors mean something."""
    return coarse.with_probe(coarse.probe.with_(bridge_upper_ohm=5600.0, bridge_lower_ohm=100.0))


@pytest.mark.parametrize(
    "name",
    ["series_resistance_ohm", "base_temperature_K", "heater_width_um", "thickness_um"],
)
def test_derivatives_at_a_fixed_bias(bridged, name):
    """Circuit and dimensions together, as a fit takes them."""
    bias = np.array([2.0, 5.0, 7.0])
    names = (name,)
    model = replace(full_experiment(bridged, bias), names=names)
    probe, rest = bridged.probe, []
    start = model.predict(probe)
    for step in (0.02, 0.01):
        (value,) = probe.values(names)
        prediction = model.predict(probe.replace({name: float(value * (1 + step))}), start)
        change = prediction.values - start.values
        rest.append(np.abs(change - step * value * start.slopes[..., 0]) / start.values)
    # between its states a branch's slopes are splines
    assert np.all(rest[0] < 3e-3)
    assert np.all(rest[1] < 0.35 * rest[0] + 2e-5)


def test_predictions_nearby_agree_with_a_new_branch(bridged):
    """To second order, at four per cent."""
    bias = np.array([2.0, 5.0, 7.0])
    names = ("n_d", "heater_length_um", "series_resistance_ohm", "base_temperature_K")
    model = replace(full_experiment(bridged, bias), names=names)
    start = model.predict(bridged.probe)
    values = bridged.probe.values(names) * np.array([1.04, 0.96, 1.01, 1.02])
    nearby, slopes = start.surrogate.predict(values)
    perturbed_probe = bridged.probe.replace(dict(zip(names, values.tolist(), strict=True)))
    exact = model.predict(perturbed_probe)
    np.testing.assert_allclose(nearby, exact.values, rtol=3e-3)
    assert slopes.shape == exact.slopes.shape == (4, 3, 4)


def test_dimensions_that_hold_parts_together_are_held():
    """A heater that fills its gap, in a U-shaped lever."""
    probe = Probe.u_shape().with_(heater_length_um=6.0)
    assert {"heater_length_um", "gap_um"}.isdisjoint(nuisances(probe))
    with pytest.raises(InputError, match="gap_um cannot change by itself"):
        SimilarLevers(Lever(probe, COARSE)).equations(probe, ("gap_um",))
    # what remains can move
    SimilarLevers(Lever(probe, COARSE)).linearised(probe, REACH, None, tuple(nuisances(probe)))


@pytest.mark.parametrize("name", ["heater_length_um", "c_kappa", "base_temperature_K"])
def test_what_the_knee_shows_moves_as_its_derivatives_say(coarse, name):
    similar, probe, reach = SimilarLevers(coarse), coarse.probe, Reach(coarse.circuit, 10.0)
    solved = similar.linearised(probe, reach, None, (name,))
    branch = solved.branch
    slopes = shown_at_knee_by_parameter(branch, branch.u, solved.output_slopes)[:, 0]
    (value,), share = probe.values([name]).tolist(), 1e-3
    ends = [
        similar.linearised(probe.replace({name: value + way}), reach, solved, (name,)).branch
        for way in (share * value, -share * value)
    ]
    above, below = (each.curve(each.knee_u) for each in ends)
    # V, mA, V and K for twice the value; the knee of a lever with another κ is as hot
    moved = (above - below) / (2.0 * share)
    np.testing.assert_allclose(value * slopes, moved, rtol=1e-2, atol=0.02)


def test_a_finer_mesh_is_solved_where_it_is_not_foretold():
    """What was passed over is between its neighbours: nobody sees that it was not solved."""
    probe = Probe.reference()
    similar, fine = (
        SimilarLevers(Lever(probe, COARSE)),
        SimilarLevers(Lever(probe, replace(COARSE, refinement=1.5))),
    )
    branch = similar.lever(probe).branch(1100.0)
    equations, places = fine.equations(probe), branch.u[branch.solved]
    u, x = similar.full_states(branch, equations)
    assert 0.5 * places.size < u.size < 0.9 * places.size
    assert set(u.tolist()) <= set(places.tolist())
    assert u[-1] == places[-1]
    every = fine.lever(probe).branch(1100.0)
    shown = every.curve(places)
    lacking = np.vstack([equations.observed(x), equations.space.tip_rise(x)]).T - branch.curve(u)
    found = branch.curve(places) + spline_through(u, lacking)(places)
    np.testing.assert_allclose(found[:, :3], shown[:, :3], rtol=3e-5)
    assert np.abs(branch.curve(places) / shown - 1.0)[:, :3].max() > 1e-4
