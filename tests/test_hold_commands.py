"""``hotlever sweep --hold-resistance``: files, notes, refusals."""

from __future__ import annotations

import csv
import io

import pytest
import xarray as xr
from PIL import Image

pytestmark = pytest.mark.usefixtures("coarse_meshes")


def test_states_at_set_points_are_written_and_drawn(run, tmp_path):
    status, out, err = run(
        *("sweep", "--hold-resistance", "2kohm,3kohm", "-o", "held.nc", "--plot", "held.png"),
        *("--fields", "fields", "--map", "map.png"),
    )
    assert (status, out, err) == (0, "", "")
    data = xr.load_dataset(tmp_path / "held.nc")
    assert data.set_ohm.values.tolist() == [2000.0, 2000.0, 3000.0, 3000.0]
    assert data.state.values.tolist() == [1, 2] * 2
    assert len(list((tmp_path / "fields").glob("*.vtu"))) == 4
    for name in ("held.png", "map.png"):
        with Image.open(tmp_path / name) as image:
            assert image.size[0] > 600
    assert len(data.hotlever.plot().axes) == 2


def test_a_table_has_the_columns_of_a_sweep_and_those_of_set_points(run):
    status, out, _ = run("sweep", "--hold-power", "2.5mW")
    (row,) = csv.DictReader(io.StringIO(out))
    assert status == 0
    assert list(row)[:2] == ["bias_V", "current_mA"]
    assert list(row)[-3:] == ["set_mW", "state", "slope_mW_per_K"]
    assert float(row["power_mW"]) == pytest.approx(2.5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sweep", "--hold-resistance", "9kohm"), "expected one that the lever has: from 1323 ohm"),
        (("sweep", "--hold-resistance", "3000"), "expected a number with a unit like ohm"),
        (("sweep", "--hold-resistance", "-3kohm"), "expected more than 0"),
        (("sweep", "--hold-power", "1mW:2mW"), "START:STOP:COUNT, such as 1mW:4mW:7"),
        (
            ("sweep", "--hold-power", "1mW", "--bias", "1:2:2"),
            "--bias and --hold-power: expected only one of them",
        ),
        (("sweep", "--hold-power", "1mW", "--model", "full-3d"), "goes with --model flat"),
        (
            ("pulse", "--controller", "1,9", "--step", "3kohm"),
            "pulse --controller: gone since version 3.0; no controller is followed in time",
        ),
        (("pulse", "--gain-map=map.png"), "hotlever sweep --hold-resistance finds its states"),
        (("fit", "data.csv", "--drift"), "fit --drift: gone since version 3.0; correct the zeros"),
        (("raman-check", "-o", "x.json"), "raman-check: gone since version 3.0; the check of"),
    ],
)
def test_what_cannot_be_is_one_line(refused, arguments, message):
    assert message in refused(*arguments)
