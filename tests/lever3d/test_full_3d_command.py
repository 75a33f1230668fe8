"""``hotlever sweep --model full-3d``."""

from __future__ import annotations

import csv
import io

import meshio
import pytest


def test_an_unknown_model_is_answered_with_the_nearest(refused):
    assert "did you mean 'full-3d'?" in refused("sweep", "--model", "full3d")


def test_without_ngsolve_the_command_says_what_to_install(refused, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ngsolve", None)
    assert "pip install 'hotlever[air3d]'" in refused(
        "sweep", "--model", "full-3d", "--medium", "air"
    )


@pytest.mark.slow
def test_a_sweep_in_air_writes_table_fields_and_slices(run, tmp_path):
    pytest.importorskip("ngsolve")
    arguments = ("sweep", "--model", "full-3d", "--medium", "air", "--bias", "1:2:2")
    status, out, err = run(*arguments, "--fields", "fields")
    assert status == 0, err
    rows = list(csv.DictReader(io.StringIO(out)))
    assert [row["bias_V"] for row in rows] == ["1", "2"]
    names = sorted(path.name for path in (tmp_path / "fields").iterdir())
    assert names == [f"bias_00{bias}.0000V.{kind}" for bias in (1, 2) for kind in ("png", "vtu")]
    hottest = meshio.read(tmp_path / "fields" / names[-1]).point_data["temperature_K"].max()
    assert hottest == pytest.approx(float(rows[1]["tip_K"]), abs=1.0)
    # the states were kept: the same table again, without a solve
    assert run(*arguments)[1] == out
