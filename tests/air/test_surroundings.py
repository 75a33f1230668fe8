"""Surroundings of a lever: their limits, and what a probe file says of them."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.air.operator import air_operator
from hotlever.errors import InputError
from hotlever.materials.air import temperature_jump_length
from hotlever.probe import Probe
from hotlever.probe.surroundings import Surroundings

LAYOUT = Probe.reference().layout()
#: For what does not depend on accuracy.
COARSE = 0.4


def loss(refinement=COARSE, **surroundings) -> float:
    """Heat lost by a lever of one temperature."""
    return float(air_operator(LAYOUT, Surroundings(**surroundings), 293.0, refinement).matrix.sum())


@pytest.fixture(scope="module")
def free() -> float:
    return loss()


def top_area() -> float:
    boxes = [np.ptp(np.array(region.outline), axis=0) for region in LAYOUT.regions]
    return float(sum(np.prod(box) for box in boxes))


def test_the_operator_is_symmetric_and_positive():
    matrix = air_operator(LAYOUT, refinement=COARSE).matrix
    assert np.abs(matrix - matrix.T).max() == 0.0
    assert np.linalg.eigvalsh(matrix).min() > 0


def test_a_surface_far_away_is_free_space(free):
    near, far = (loss(surface_gap_um=gap) / free - 1 for gap in (1e3, 1e4))
    # the images of a body of capacity C at a distance h add C/(8πh) to its loss
    assert far == pytest.approx(free / (8 * np.pi * 1e4), rel=0.02)
    assert near == pytest.approx(10 * far, rel=0.1)


def test_a_surface_very_near_takes_kappa_area_over_gap(free):
    wide = [loss(surface_gap_um=gap) * gap / top_area() for gap in (0.04, 0.01)]
    assert wide[0] > wide[1] > 1
    assert wide[1] == pytest.approx(1.0, abs=0.03)


def test_no_tilt_is_the_limit_of_small_tilts():
    parallel = loss(surface_gap_um=2.0)
    assert loss(surface_gap_um=2.0, surface_tilt_deg=1e-7) == pytest.approx(parallel, rel=1e-3)
    tilts = [loss(surface_gap_um=8.0, surface_tilt_deg=tilt) for tilt in (-3.0, 3.0)]
    level = loss(surface_gap_um=8.0)
    # most of the lever lies behind the tip: a base farther away loses less
    assert tilts[1] < level < tilts[0]


def test_the_chip_takes_up_heat_and_is_large_enough(monkeypatch):
    monkeypatch.setenv("HOTLEVER_CACHE", "")

    def heated_at_the_front(chip):
        operator = air_operator(LAYOUT, Surroundings(chip=chip), refinement=COARSE)
        return operator.matrix.sum(axis=0) @ operator.sites[:, 0]

    with_chip = heated_at_the_front(True)
    assert with_chip > 1.15 * heated_at_the_front(False)
    monkeypatch.setattr("hotlever.air.bodies.REACH", 32.0)
    assert heated_at_the_front(True) == pytest.approx(with_chip, rel=1e-3)


def test_pressure_goes_from_dense_air_to_vacuum(free):
    found = [loss(accommodation=0.9, pressure_mbar=p) for p in (1e6, 1013.25, 1.0, 1e-3)]
    assert found[0] == pytest.approx(free, rel=1e-3)
    assert all(np.diff(found) < 0)
    # free molecules: the jump is everything, and the loss is the surface over the jump length
    length, _ = temperature_jump_length(600.0, 1e-3, 0.9)
    sides = 0.4 * 300.0
    assert found[3] * length == pytest.approx(2 * top_area() + sides, rel=0.05)
    assert found[2] / found[3] == pytest.approx(1e3, rel=0.05)


def test_the_air_inside_the_plate_goes_with_the_jump():
    dense, thin = (
        air_operator(LAYOUT, Surroundings(accommodation=1.0, pressure_mbar=p), 293.0, COARSE)
        for p in (1e6, 1e-3)
    )
    assert dense.filling == pytest.approx(1.0, abs=1e-2)
    assert thin.filling == pytest.approx(0.0, abs=1e-6)
    assert air_operator(LAYOUT, refinement=COARSE).filling == 1.0


def test_jumps_at_both_surfaces_of_a_narrow_gap_widen_it():
    length, _ = temperature_jump_length(293.0, 1013.25, 1.0)
    jumps = loss(surface_gap_um=0.05, accommodation=1.0, jump_temperature_K=293.0)
    # but for the fringe field
    assert jumps == pytest.approx(loss(surface_gap_um=0.05 + 2 * float(length)), rel=0.04)


def test_operators_are_kept_and_damaged_files_replaced(tmp_path, monkeypatch):
    monkeypatch.setenv("HOTLEVER_CACHE", str(tmp_path))
    first = air_operator(LAYOUT, refinement=COARSE)
    (file,) = (tmp_path / "air").iterdir()
    calls = []
    monkeypatch.setattr("hotlever.air.operator.single_layer_matrix", lambda *_: calls.append(1))
    assert np.array_equal(air_operator(LAYOUT, refinement=COARSE).matrix, first.matrix)
    assert not calls
    monkeypatch.undo()
    monkeypatch.setenv("HOTLEVER_CACHE", str(tmp_path))
    file.write_bytes(b"damaged")
    assert np.array_equal(air_operator(LAYOUT, refinement=COARSE).matrix, first.matrix)
    assert file.stat().st_size > 1000


def test_probe_files_hold_surroundings(tmp_path):
    probe = Probe.reference().with_(surface_gap_um=8.0, chip=True)
    probe.to_file(tmp_path / "probe.toml")
    assert Probe.from_file(tmp_path / "probe.toml") == probe
    text = Probe.reference().to_toml()
    assert "[surroundings]" in text
    assert "# surface_gap_um =" in text


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("surface_gap = 8", "unknown key 'surface_gap': did you mean 'surface_gap_um'"),
        ("surface_gap_um = -1", "surface_gap_um = -1"),
        ("surface_tilt_deg = 5", "means nothing without surface_gap_um"),
        ("pressure_mbar = 10", "means nothing without accommodation"),
        ("accommodation = 1.5", "accommodation = 1.5"),
    ],
)
def test_wrong_surroundings_name_the_key(tmp_path, line, message):
    path = tmp_path / "probe.toml"
    shape = Probe.reference().to_toml().split("[circuit]")[0]
    path.write_text(f"{shape}\n[surroundings]\n{line}\n", encoding="utf-8")
    with pytest.raises(InputError, match=message):
        Probe.from_file(path)


def test_a_surface_that_cuts_the_lever_is_refused():
    with pytest.raises(InputError, match="crosses the lever"):
        loss(surface_gap_um=1.0, surface_tilt_deg=20.0)
