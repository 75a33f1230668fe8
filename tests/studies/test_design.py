"""What a change of design does, against scaling laws that hold exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import hotlever
from drawn import reference_points
from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.spieser2017 import ANNEALING_K
from hotlever.studies import design as study
from hotlever.studies.design import Design, design_notes, quantities, sensitivities, vary

pytestmark = pytest.mark.usefixtures("coarse_meshes")

EXAMPLES = Path(hotlever.__file__).parent / "examples"


@pytest.fixture(scope="module")
def start() -> Design:
    return Design(Probe.reference())


def test_in_vacuum_the_thickness_scales_the_power_and_nothing_else(start):
    """Sheets of any thickness have the same fields; powers and currents scale with it."""
    slopes = sensitivities(start, ["thickness_um"], air=False)
    row = slopes.sel(name="thickness_um")
    assert row.value == 0.4
    assert row.by_knee_K.item() == pytest.approx(0.0, abs=1e-6)
    assert row.by_knee_V.item() == pytest.approx(0.0, abs=1e-6)
    assert row.by_knee_mW.item() == pytest.approx(1.0, abs=1e-6)
    assert row.by_cold_ohm.item() == pytest.approx(-1.0, abs=2e-3)
    assert row.by_tip_K < 0
    assert np.isnan(slopes.k)


def test_the_design_s_knee_is_the_lever_s(start, reference):
    values = quantities(start.probe, 2.0, air=False)
    assert values["knee_K"] == pytest.approx(reference.knee.tip_K, abs=0.3)
    assert values["knee_mW"] == pytest.approx(reference.knee.power_mW, rel=1e-3)
    assert values["tip_K"] == pytest.approx(reference.tip_temperature(2.0).item(), abs=0.3)


def test_a_map_has_each_with_each_and_gaps_with_their_reasons(start):
    """In vacuum the power of the knee grows as the thickness, whatever the doping."""
    varied = {"thickness_um": [-0.2, 0.2, 0.4], "n_d": [5e17, 6e17]}
    data = vary(start, varied, air=False)
    assert data.knee_mW.dims == ("thickness_um", "n_d")
    thin, thick = data.knee_mW.values[1:]
    np.testing.assert_allclose(thick, 2.0 * thin, rtol=1e-6)
    alone = quantities(start.changed({"n_d": 5e17}), 2.0, air=False)
    assert data.tip_K.values[2, 0] == pytest.approx(alone["tip_K"], abs=1e-6)
    assert np.isnan(data.tip_K.values[0]).all()
    assert all("thickness_um = -0.2" in reason for reason in data.reason.values[0])
    assert set(data.reason.values[1:].flat) == {""}
    [note] = design_notes(data)
    assert note.startswith("with thickness_um = -0.2 and n_d = 5e+17; thickness_um = -0.2 and")
    assert data.n_d.attrs["base_value"] == start.probe.material.n_d
    with pytest.raises(InputError, match=r"thickness_um = -0\.2"):
        vary(start, {"thickness_um": [-0.2]}, air=False)


def test_annealing_changes_the_diffusion_length_only(start):
    longer = start.changed({"annealing_min": 120.0})
    delta = start.probe.material.delta
    assert longer.material.delta == pytest.approx(2 * delta)
    assert longer.shape == start.probe.shape
    both = start.changed({"delta": 0.5, "annealing_min": 120.0})
    assert both.material.delta == pytest.approx(2 * 0.5)
    assert start.changed({"annealing_K": ANNEALING_K}).material.delta == pytest.approx(delta)


@pytest.fixture(scope="module")
def drawn() -> Design:
    return Design(Probe.from_sections(reference_points(), "drawn"))


@pytest.mark.parametrize(
    ("example", "usual"),
    [
        (
            "palladium-on-nitride.toml",
            ("scale", "thickness_um", "layers.track.thickness_um", "film.resistivity"),
        ),
        ("boron-lever.toml", ("scale", "thickness_um", "hot.n_d")),
    ],
)
def test_what_is_varied_of_a_drawing(example, usual):
    design = Design(Probe.from_file(EXAMPLES / example))
    assert design.usual == usual
    for name, value in design.numbers.items():
        if name == "pressure_mbar":  # means nothing without accommodation, as its error says
            continue
        factor = 1.02 if value else 1.0
        assert isinstance(design.changed({name: value * factor}), Probe)


def test_a_film_of_a_drawing_is_varied_exactly():
    design = Design(Probe.from_file(EXAMPLES / "palladium-on-nitride.toml"))
    data = vary(design, {"layers.track.thickness_um": [0.05, 0.1]}, air=False)
    first, second = data.cold_ohm.values
    assert first / second == pytest.approx(2.0, rel=1e-3)
    data = vary(design, {"film.resistivity": [2e-5, 3e-5]}, air=False)
    assert data.cold_ohm.values[1] / data.cold_ohm.values[0] == pytest.approx(1.5, rel=1e-3)


def test_the_numbers_of_a_drawing_are_those_it_has(drawn):
    assert drawn.usual == ("scale", "thickness_um", "n_d", "annealing_K", "annealing_min")
    assert {"heater.edge_bias_um", "series_resistance_ohm", "c_kappa"} <= set(drawn.numbers)
    for name in ("unit_um", "tolerance_um", "heater_length_um"):
        with pytest.raises(InputError, match=r"expected one of: thickness_um, silicon\.edge"):
            drawn.value(name)


def test_scale_and_edges_of_a_drawing_are_varied(drawn):
    larger = vary(drawn, {"scale": [1.0, 1.1]}, air=False)
    assert larger.tip_K.diff("scale").item() > 0
    wider = vary(drawn, {"edge_bias_um": [-0.05, 0.0, 0.05]}, air=False)
    assert (wider.cold_ohm.diff("edge_bias_um") < 0).all()
    assert wider.cold_ohm.values[1] == pytest.approx(larger.cold_ohm.values[0], rel=1e-9)


@pytest.mark.slow
def test_design_command_of_a_drawing(run, tmp_path):
    Probe.from_sections(reference_points(), "drawn").to_file(tmp_path / "own.toml")
    status, out, err = run("design", "own.toml", "--no-air")
    assert status == 0, err
    rows = [line.split()[0] for line in out.splitlines()[4:]]
    assert rows == ["scale", "thickness_um", "n_d", "annealing_K", "annealing_min"]
    assert "--vary NAME=START:STOP:COUNT of thickness_um, silicon.edge_bias_um, heater.edge" in err
    status, out, err = run(
        "design", "own.toml", "--no-air", "--vary", "edge_bias_um=-0.05:0.05:2", "--plot", "d.png"
    )
    assert status == 0, err
    assert len(out.splitlines()) == 3
    assert (tmp_path / "d.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_drawing_without_a_knee_has_a_table_too(run):
    status, out, err = run("design", EXAMPLES / "palladium-on-nitride.toml", "--no-air")
    assert status == 0, err
    assert out.startswith("no knee: the lever voltage rises until something melts; tip at ")
    assert "layers.track.thickness_um" in out


def test_names_that_do_not_exist_are_refused(start):
    with pytest.raises(InputError, match="did you mean 'heater_length_um'"):
        start.value("heater_lenght_um")


def test_design_command(run, refused, tmp_path):
    status, out, err = run(
        "design", "--vary", "thickness_um=0.3:0.4:2", "--no-air", "--plot", "d.png"
    )
    assert status == 0, err
    assert out.splitlines()[0].startswith("thickness_um,knee_K,inversion_K,knee_mW")
    assert len(out.splitlines()) == 3
    assert (tmp_path / "d.png").stat().st_size > 10_000
    twice = ("--vary", "thickness_um=0.3:0.4:2", "--vary", "heater_width_um=1:2:2")
    status, out, err = run("design", *twice, "--no-air", "-o", "d.nc", "--plot", "d.svg")
    assert (status, out) == (0, ""), err
    with xr.open_dataset("d.nc") as data:
        assert dict(data.knee_K.sizes) == {"thickness_um": 2, "heater_width_um": 2}
        assert data.heater_width_um.attrs["units"] == "µm"
    assert "heater width (µm)" in Path("d.svg").read_text()
    twice = refused("design", "--vary", "p=2:3:2", "--vary", "p=1:2:2")
    assert "--vary p: given twice" in twice
    assert "did you mean 'thickness_um'" in refused("design", "--vary", "thicknes_um=0.3:0.4:2")
    refused("design", "--plot", "d.png")


def test_how_far_the_mesh_of_designs_is_from_that_of_a_sweep_is_said() -> None:
    """`hotlever design` was 0.2 % off `hotlever sweep` without a word."""
    probe = Probe.reference()
    own, sweep = (Lever(probe, mesh).branch_past_knee() for mesh in (study.DESIGN_MESH, None))
    assert own.knee is not None
    assert sweep.knee is not None
    stated = study.mesh_note(probe, 2.0)
    power = 100 * (own.knee.power_mW / sweep.knee.power_mW - 1)
    tip = own.tip_temperature(2.0) - sweep.tip_temperature(2.0)
    assert f"{power:+.2g} % of the power at the knee" in stated
    assert f"{tip:+.2g} K at 2 mW" in stated
