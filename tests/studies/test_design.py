"""What a change of design does, against scaling laws that hold exactly."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.probe import Probe
from hotlever.spieser2017 import ANNEALING_K
from hotlever.studies.design import Design, quantities, sensitivities, vary


@pytest.fixture(scope="module")
def start() -> Design:
    return Design(Probe.reference())


def test_in_vacuum_the_thickness_scales_the_power_and_nothing_else(start):
    """Sheets of any thickness have the same fields; powers and currents scale with it."""
    found = sensitivities(start, ["thickness_um"], air=False)
    row = found.sel(name="thickness_um")
    assert row.value == 0.4
    assert row.by_knee_K.item() == pytest.approx(0.0, abs=1e-6)
    assert row.by_knee_V.item() == pytest.approx(0.0, abs=1e-6)
    assert row.by_knee_mW.item() == pytest.approx(1.0, abs=1e-6)
    assert row.by_cold_ohm.item() == pytest.approx(-1.0, abs=2e-3)
    assert row.by_tip_K < 0
    assert np.isnan(found.k)


def test_the_design_s_knee_is_the_lever_s(start, reference):
    found = quantities(start.probe, 2.0, air=False)
    assert found["knee_K"] == pytest.approx(reference.knee.tip_K, abs=0.3)
    assert found["knee_mW"] == pytest.approx(reference.knee.power_mW, rel=1e-3)
    assert found["tip_K"] == pytest.approx(reference.tip_temperature(2.0).item(), abs=0.3)


def test_a_sweep_of_the_heater_s_length(start):
    data = vary(start, "heater_length_um", [4.0, 4.6], air=False)
    assert data.heater_length_um.values.tolist() == [4.0, 4.6]
    assert data.cold_ohm.diff("heater_length_um").item() > 0
    assert data.knee_K.diff("heater_length_um").item() < 0
    assert data.knee_mW.attrs["units"] == "mW"


def test_annealing_changes_the_diffusion_length_only(start):
    longer = start.changed("annealing_min", 120.0)
    delta = start.probe.material.delta
    assert longer.material.delta == pytest.approx(2 * delta)
    assert longer.shape == start.probe.shape
    assert start.changed("annealing_K", ANNEALING_K).material.delta == pytest.approx(delta)


def test_names_that_do_not_exist_are_refused(start):
    with pytest.raises(InputError, match="did you mean 'heater_length_um'"):
        start.value("heater_lenght_um")


def test_design_command(run, tmp_path):
    status, out, err = run(
        "design", "--vary", "thickness_um=0.3:0.4:2", "--no-air", "--plot", "d.png"
    )
    assert status == 0, err
    assert out.splitlines()[0].startswith("thickness_um,knee_K,inversion_K,knee_mW")
    assert len(out.splitlines()) == 3
    assert (tmp_path / "d.png").stat().st_size > 10_000
    status, out, err = run("design", "--vary", "thicknes_um=0.3:0.4:2")
    assert (status, out) == (2, "")
    assert "did you mean 'thickness_um'" in err
    assert run("design", "--plot", "d.png")[0] == 2
