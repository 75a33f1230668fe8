"""The tip: its section of the probe file, and the thickening that stands for it."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.probe import MeshOptions, Probe, Tip
from hotlever.probe.mesh import SolidMeshOptions, mesh_solid
from hotlever.probe.probe_parameters import parameters_of

TIP = Tip(height_um=0.7, half_angle_deg=25, apex_radius_um=0.03)


def tipped(tip=TIP):
    return Probe.from_sections({**Probe.reference().sections(), "tip": tip.model_dump()}, "test")


def test_a_probe_with_a_tip_is_written_and_read_with_comments(tmp_path):
    probe = tipped()
    probe.to_file(tmp_path / "probe.toml")
    assert Probe.from_file(tmp_path / "probe.toml") == probe
    text = probe.to_toml()
    assert tomllib.loads(text)["tip"]["height_um"] == 0.7
    assert "# from the lever's surface to the apex" in text


def test_the_example_in_the_comments_is_a_valid_section(tmp_path):
    text = Probe.reference().to_toml()
    start = text.index("# [tip]")
    uncommented = text[:start] + "\n".join(
        line if line.startswith("# Without") else line.removeprefix("# ")
        for line in text[start:].splitlines()
    )
    (tmp_path / "probe.toml").write_text(uncommented, encoding="utf-8")
    read = Probe.from_file(tmp_path / "probe.toml")
    assert read.tip is not None
    assert read.physics.effects == ("thermoelectric", "radiation")


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"heigth_um": 0.7}, r"\[tip\]: unknown key 'heigth_um': did you mean 'height_um'"),
        (
            {"height_um": -1},
            r"\[tip\]: height_um = -1: expected at least 0.01",
        ),
        ({"half_angle_deg": 20}, r"\[tip\]: height_um is missing"),
        (
            {"height_um": 3.0, "half_angle_deg": 30},
            r"the tip's base has a radius of 1.752 µm, expected less than 0.8225 µm",
        ),
    ],
)
def test_a_wrong_tip_is_one_clear_line(section, message):
    with pytest.raises(InputError, match=message) as caught:
        Probe.from_sections({**Probe.reference().sections(), "tip": section}, "probe.toml")
    assert "\n" not in str(caught.value)


def test_the_thickening_ends_at_the_base_and_is_highest_at_the_axis():
    thickening = TIP.thickening_um(np.linspace(0, 2 * TIP.base_radius_um, 50))
    assert (np.diff(thickening) <= 0).all()
    assert thickening[-1] == 0
    assert thickening[0] < TIP.height_um


def test_a_flat_cone_counts_in_full():
    flat = Tip(height_um=0.01, half_angle_deg=80, apex_radius_um=1e-4)
    volume = np.pi * flat.base_radius_um**2 * flat.height_um / 3
    radius = np.linspace(0, flat.base_radius_um, 2001)
    thickening = flat.thickening_um(radius)
    assert np.trapezoid(2 * np.pi * radius * thickening, radius) == pytest.approx(volume, rel=0.3)
    steep = Tip(height_um=50.0, half_angle_deg=1, apex_radius_um=1e-4)
    assert steep.thickening_um(0.0) == pytest.approx(steep.base_radius_um / 1.84, rel=0.02)


def test_a_tip_cools_the_heater_at_the_same_bias(coarse):
    probe = tipped()
    bias = [7.2]
    with_tip = Lever(probe, MeshOptions(refinement=0.4)).sweep(bias)
    assert with_tip.tip_K.item() < coarse.sweep(bias).tip_K.item() - 3


@pytest.mark.slow
def test_the_solid_has_the_volume_of_lever_and_cone():
    layout = tipped().layout()
    mesh = mesh_solid(layout, SolidMeshOptions(refinement=0.5))
    a, b, c, d = np.moveaxis(mesh.elements.p[:, mesh.elements.t], 1, 0)
    volumes = np.abs(np.einsum("im,im->m", np.cross((b - a).T, (c - a).T).T, d - a)) / 6
    r, s, h = TIP.base_radius_um, TIP.apex_radius_um, TIP.height_um
    cone = np.pi * h * (r**2 + r * s + s**2) / 3
    heater = layout.regions.index(layout.heater)
    # chords cut the round off the cone
    assert volumes[mesh.region == heater].sum() == pytest.approx(4.0 * 1.645 * 0.4 + cone, rel=0.02)
    assert mesh.elements.p[2].min() == pytest.approx(-0.2 - h)
    for region, outline in enumerate(r.outline for r in layout.regions):
        if region != heater:
            (x0, y0), (x1, y1) = np.min(outline, axis=0), np.max(outline, axis=0)
            assert volumes[mesh.region == region].sum() == pytest.approx(
                (x1 - x0) * (y1 - y0) * layout.thickness_um
            )


@pytest.mark.slow
def test_the_thickening_stands_for_the_cone():
    """benchmarks/tip.py prints it for more sizes and biases."""
    from hotlever.lever3d import SolidLever

    bias, mesh = [6.0], SolidMeshOptions(refinement=0.5)
    probe = tipped(Tip(height_um=1.0, half_angle_deg=30))
    cone = SolidLever(probe, mesh).sweep(bias) - SolidLever(Probe.reference(), mesh).sweep(bias)
    sheet = Lever(probe).sweep(bias) - Lever(Probe.reference()).sweep(bias)
    assert cone.tip_K.item() < -8
    assert sheet.tip_K.item() == pytest.approx(cone.tip_K.item(), rel=0.1)
    assert sheet.current_mA.item() == pytest.approx(cone.current_mA.item(), rel=0.1)


@pytest.mark.slow
def test_terminals_are_whole_end_faces():
    layout = Probe.reference().layout()
    mesh = mesh_solid(layout, SolidMeshOptions(refinement=0.25))
    for terminal in layout.terminals:
        facets = mesh.elements.facets[:, mesh.terminal_facets[terminal.name]]
        a, b, c = np.moveaxis(mesh.elements.p[:, facets], 1, 0)
        area = np.linalg.norm(np.cross((b - a).T, (c - a).T), axis=1).sum() / 2
        width = np.linalg.norm(np.subtract(terminal.end, terminal.start))
        assert area == pytest.approx(width * layout.thickness_um)


@pytest.mark.parametrize(("angle", "most"), [(20.0, 30.0), (70.0, 80.0)])
def test_a_fit_leaves_the_tip_a_cone(angle, most):
    """Up to half again of a blunt one's angle it was solved at more than 90°."""
    tip = {"tip.height_um": 0.1, "tip.half_angle_deg": angle}
    found = parameters_of(Probe.reference().with_(**tip))["half_angle_deg"]
    assert found.bounds == (pytest.approx(0.5 * angle), pytest.approx(most))
