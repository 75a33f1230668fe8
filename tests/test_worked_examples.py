"""The worked examples: their files are those of their scripts, and their calibrations are right."""

from __future__ import annotations

import re

import numpy as np
import pytest
from boron_lever_drawing import boron_lever

from documents import ROOT, missing_lines
from example_measurements import EXAMPLES, compare
from hotlever.drawing.shape import TOLERANCE_UM
from hotlever.drawing.sheet import read_sheet

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
    shown = [line for line in page.splitlines() if line.startswith("| ")]
    assert len(shown) == 6 + len(EXAMPLES[name].values)
    assert missing_lines("\n".join(shown), printed, within=0.05) == [], printed


def test_the_drawing_is_that_of_its_tool(tmp_path):
    boron_lever().saveas(tmp_path / "made.dxf")
    made, shipped = (
        read_sheet(path, None, tolerance_um=TOLERANCE_UM)
        for path in (tmp_path / "made.dxf", ROOT / "examples" / "boron-lever.dxf")
    )
    assert made.layers.keys() == shipped.layers.keys()
    for name, layer in made.layers.items():
        for one, other in zip(layer.rings, shipped.layers[name].rings, strict=True):
            np.testing.assert_allclose(one, other)
