"""A lever whose tip touches a sample: at rest, in time, on modes, as a solid."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.text import Text
from taylor import remainder_orders

from experiments import on_coarse_meshes
from hotlever import Measurement, fit
from hotlever.contact.law import INTERFACE
from hotlever.errors import ComputationError, InputError
from hotlever.figures import contact_overview
from hotlever.lever import Lever
from hotlever.lever.contact import (
    history_in_contact,
    out_of_contact,
    state_in_contact,
    sweep_in_contact,
)
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import can_be_reduced
from hotlever.lever.transient import pulse, simulate, step
from hotlever.lever.transient.reduced import reduced_in_time
from hotlever.lever3d import SolidLever
from hotlever.probe import Probe
from hotlever.probe.mesh import SolidMeshOptions
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.probe.tip import OUT_OF_CONTACT
from hotlever.tasks.surfaces import what_the_current_tells

TIP = {"tip.height_um": 0.7, "tip.half_angle_deg": 20.0, "tip.apex_radius_um": 0.1}


@pytest.fixture(scope="module")
def free() -> Lever:
    return Lever(Probe.reference().with_(**TIP), COARSE)


@pytest.fixture(scope="module")
def touching(free: Lever) -> Lever:
    """A blunt tip on silicon: it takes a tenth of the power."""
    return free.with_probe(free.probe.with_(sample="silicon", interface_K_per_mW=100.0))


def test_heat_goes_somewhere(touching):
    data = touching.sweep([4.0, 8.0])
    left = data.end_heat_mW + data.into_tip_mW
    np.testing.assert_allclose(left, data.power_mW, rtol=1e-5)
    assert (data.into_tip_mW > 0.05 * data.power_mW).all()


def test_a_state_in_contact_needs_no_branch_in_contact(touching):
    """From the state out of contact, from one nearby, and of another radius."""
    free, near = out_of_contact(touching), None
    for bias, radius in ((4.0, 0.1), (4.2, 0.09)):
        probe = touching.probe.with_(**{"tip.apex_radius_um": radius})
        row, near = state_in_contact(free, probe, bias, near)
        lever = Lever(probe, COARSE)
        data = sweep_in_contact(lever, [bias], sensitivities=False)
        # the cone of another radius is a little narrower where it meets the lever
        close = {"rel": 1e-3} if radius == 0.1 else {"rel": 2e-2}
        for name, value in row.items():
            assert value == pytest.approx(data[name].item(), **close), name


def test_a_contact_cools_the_heater(touching, free):
    data, before = sweep_in_contact(touching, [0.0, 4.0, 8.0]), free.sweep([0.0, 4.0, 8.0])
    np.testing.assert_allclose(data.tip_change_K, data.tip_K - before.tip_K, atol=1e-3)
    assert (data.tip_change_K[1:] < -10.0).all()
    assert (data.apex_K[1:] < data.tip_K[1:] - 10.0).all()
    # what is known of the heat at the apex is what the lever loses
    np.testing.assert_allclose(data.sample_mW, data.into_tip_mW, rtol=2e-2)
    by_heat = (data.tip_K - data.apex_K) / data.sample_mW
    np.testing.assert_allclose(data.tip_K_per_mW[1:], by_heat[1:])
    words = " ".join(
        text.get_text() for text in contact_overview(data, touching.probe).findobj(Text)
    )
    assert "interface, r = 100 nm: 1e+05 K/W" in words
    assert "(µW)" in words


def test_without_heat_through_the_interface_nothing_is_touched(touching, free):
    away = out_of_contact(touching)
    assert away.probe.contact.interface_K_per_mW == OUT_OF_CONTACT
    assert away.sweep([8.0]).tip_K.item() == pytest.approx(free.sweep([8.0]).tip_K.item(), abs=1e-5)
    with pytest.raises(InputError, match=r"a section \[contact\]"):
        out_of_contact(free)


def test_the_current_tells_of_the_resistance(touching):
    at = {"interface_K_per_mW": 102.0}, {"interface_K_per_mW": 98.0}
    more, less = (touching.with_probe(touching.probe.with_(**one)).sweep([4.0, 8.0]) for one in at)
    slope = sweep_in_contact(touching, [4.0, 8.0]).current_by_resistance
    by_interface = slope * touching.equations.contact.sum_by_interface
    np.testing.assert_allclose(by_interface, (more.current_mA - less.current_mA) / 4.0, rtol=2e-3)


def test_the_jacobian_is_exact(touching):
    (state,) = touching.solve([7.0])
    orders = remainder_orders(touching.equations, state.x, 1, (1.0, 0.5, 0.25))
    assert orders == pytest.approx(2.0, abs=0.1)


def test_a_step_ends_at_rest_and_the_balance_is_closed(touching):
    history = simulate(touching, step(6.0), 600.0)
    (state,) = touching.solve([6.0])
    assert history.tip_K[-1] == pytest.approx(state.tip_K, abs=0.05)
    held = history.stored_nJ + history.lost_nJ
    np.testing.assert_allclose(held, history.supplied_nJ, atol=2e-3 * history.supplied_nJ.max())


def test_modes_in_time_are_the_full_lever(touching):
    states = touching.solve([2.0, 5.0, 6.5, 8.0])
    few = reduced_in_time(touching, np.concatenate([state.x for state in states], axis=1))
    few_state = few.polished(few.space.coordinates(states[2].x), 6.5)
    assert few_state.tip_K == pytest.approx(states[2].tip_K, abs=0.1)
    assert few.equations.losses(few_state.x)["footprint"][0].sum() == pytest.approx(
        touching.equations.losses(states[2].x)["footprint"][0].sum(), rel=1e-3
    )


def test_where_silicon_melts_what_was_reached_is_given(touching):
    for follow, named in (
        (lambda: sweep_in_contact(touching, [8.0, 40.0], sensitivities=False), "bias"),
        (lambda: history_in_contact(touching, step(60.0)), "time"),
    ):
        with pytest.raises(ComputationError, match="melts") as caught:
            follow()
        assert caught.value.partial[named].size > 0
        assert np.isfinite(caught.value.partial.current_change_mA).all()


def test_what_the_current_tells_does_not_depend_on_its_sign(touching):
    texts = {}
    for sign in (1.0, -1.0):
        lever = touching.with_probe(touching.probe.with_(thermoelectric=True))
        data = sweep_in_contact(lever, sign * np.array([4.0, 8.0]))
        texts[sign] = what_the_current_tells(data)
    assert "best at 8 V: to 0.00" in texts[1.0]
    assert "best at -8 V: to 0.00" in texts[-1.0]


def test_a_pulse_is_cooler_in_contact(touching):
    data = history_in_contact(touching, pulse(8.0, 5.0), times_us=[5.0, 30.0])
    assert data.apex_K[0] < data.tip_K[0] - 10.0
    assert data.current_change_mA[0] != 0.0
    assert data.sample_mW[0] > data.sample_mW[1] > 0.0


@pytest.mark.slow
def test_a_solid_shows_what_a_flat_lever_does(touching):
    probe = touching.probe.with_(**{"tip.half_angle_deg": 40.0})
    solid = SolidLever(probe, SolidMeshOptions(refinement=0.4, grading=0.7))
    (flat,), (full,) = Lever(probe, COARSE).solve([5.0]), solid.solve([5.0])
    bare = probe.replace({"interface_K_per_mW": OUT_OF_CONTACT})
    (without,) = Lever(bare, COARSE).solve([5.0])
    assert without.tip_K - flat.tip_K > 20.0
    assert full.tip_K == pytest.approx(flat.tip_K, abs=0.03 * (without.tip_K - flat.tip_K))


def test_a_lever_in_contact_is_not_reduced_at_rest(touching):
    assert not can_be_reduced(touching.probe, ())


def test_in_air_the_cone_conducts_to_the_sample_beside_the_contact(in_air):
    tip = {**TIP, "tip.apex_radius_um": 0.005}
    probe = in_air.probe.with_(**tip, surface_gap_um=0.7, sample="polymer")
    data = sweep_in_contact(Lever(probe, COARSE), [8.0])
    assert data.beside_mW.item() > data.sample_mW.item() > 0.0
    left = data.end_heat_mW + data.air_heat_mW + data.into_tip_mW
    assert left.item() == pytest.approx(data.power_mW.item(), rel=1e-5)


def test_the_resistance_of_an_interface_is_fitted():
    """To a current measured in contact, of a lever whose material is known."""
    probe = Probe.reference().with_(**TIP, sample="glass", interface_K_per_mW=500.0)
    bias, noise = np.linspace(5.0, 10.0, 41), np.random.default_rng(0).normal(size=41)
    with on_coarse_meshes():
        lever = Lever(probe.with_(interface_K_per_mW=750.0))
        current = lever.sweep(bias).current_mA.values * (1.0 + 1e-4 * noise)
        nothing = np.full(bias.size, np.nan)
        measured = Measurement(bias, current, nothing, nothing, nothing)
        fixed = dict.fromkeys(usual_parameters(probe))
        result = fit(measured, probe, fixed=fixed, free=(INTERFACE,))
    found = result.parameters[INTERFACE]
    assert abs(found.value - 750.0) < 4.0 * found.stderr < 75.0
