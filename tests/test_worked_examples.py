"""The worked examples: their files are those of their scripts, and their calibrations are right."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from boron_lever_drawing import boron_lever

from documents import ROOT, missing_lines
from example_measurements import EXAMPLES, compare
from hotlever.measurement import read_measurement
from hotlever.probe import Probe
from hotlever.probe.drawing.shape import TOLERANCE_UM
from hotlever.probe.drawing.sheet import read_sheet
from hotlever.probe.priors import Prior, default_priors

#: The others take longer, and show no more of the code.
QUICK = "palladium-on-nitride"


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name == QUICK else [pytest.mark.slow]) for name in EXAMPLES],
)
def test_a_calibration_is_as_near_to_the_truth_as_it_says_and_the_page_too(name, capsys):
    compare(name)
    printed = capsys.readouterr().out
    off = [float(one) for one in re.findall(r"([+-]\d\.\d) +\|$", printed, flags=re.MULTILINE)]
    assert len(off) == 4
    assert max(np.abs(off)) < 2.0
    page = (ROOT / "docs" / "examples" / f"{name}.md").read_text(encoding="utf-8")
    table = [line for line in page.splitlines() if line.startswith("| ")]
    assert len(table) == 6 + len(EXAMPLES[name].values)
    assert missing_lines("\n".join(table), printed, within=0.05) == [], printed


def test_the_real_curve_agrees_with_itself_and_its_probe_says_how_little_is_known():
    """Resistance and power were read from the same picture as voltages and currents."""
    path = ROOT / "src" / "hotlever" / "examples" / "uiuc-lever.csv"
    data, probe = read_measurement(path), Probe.from_file(path.with_suffix(".toml"))
    assert (data.bias_V.size, data.series_resistance_ohm) == (19, 1970.0)
    assert "ssomnath/cantilever_temperature_control" in path.read_text(encoding="utf-8")
    rows = [
        line for line in path.read_text(encoding="utf-8").splitlines() if line[0] in "0123456789"
    ]
    bias, lever_V, current, kohm, power = np.loadtxt(rows, delimiter=",").T
    np.testing.assert_array_equal(data.bias_V, bias)
    np.testing.assert_array_equal(data.current_mA, current)
    np.testing.assert_allclose(bias - lever_V, 1.97 * current, atol=0.03)
    np.testing.assert_allclose(lever_V / current, kohm, atol=0.12)
    np.testing.assert_allclose(lever_V * current, power, atol=0.04)
    known = default_priors(probe)
    assert known["n_d"] == Prior(3e16, math.log(3.0))
    assert known["length_um"] == Prior(120.0, 0.15)
    assert known["thickness_um"] == Prior(1.0, 0.3)
    assert (probe.surroundings.medium, probe.circuit.series_resistance_ohm) == ("air", 1970.0)


def test_the_drawing_is_that_of_its_tool(tmp_path):
    boron_lever().saveas(tmp_path / "made.dxf")
    generated_sheet, shipped_sheet = (
        read_sheet(path, None, tolerance_um=TOLERANCE_UM)
        for path in (
            tmp_path / "made.dxf",
            ROOT / "src" / "hotlever" / "examples" / "boron-lever.dxf",
        )
    )
    assert generated_sheet.layers.keys() == shipped_sheet.layers.keys()
    for name, layer in generated_sheet.layers.items():
        for one, other in zip(layer.rings, shipped_sheet.layers[name].rings, strict=True):
            np.testing.assert_allclose(one, other)
