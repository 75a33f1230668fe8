"""The page of a lever in time."""

from __future__ import annotations

import pytest

from hotlever import Lever, Probe
from hotlever.lever.lever import COARSE
from hotlever.report.result_pages import transient_page


@pytest.mark.slow
def test_the_page_shows_steps_trains_time_constants_and_spectra(tmp_path):
    # few pulses and frequencies are as many pages
    few = {"pulses": 2, "frequencies": 7}
    progress = []
    lever = Lever(Probe.reference(), COARSE)
    page = transient_page(lever, lambda *steps: progress.append(steps), **few)
    written = page.write(tmp_path)
    text = written.read_text(encoding="utf-8")
    for heading in ("A step", "A train of pulses", "Time constants", "Small signals", "Harmonics"):
        assert f"{heading}</h2>" in text
    names = [block["name"] for block in page.blocks if block["kind"] == "figure"]
    assert len(names) == 5
    assert all((tmp_path / f"{name}.pdf").stat().st_size > 5000 for name in names)
    step, constants = (block["rows"] for block in page.blocks if block["kind"] == "table")
    assert all(float(row[-1]) > float(row[1]) for row in step)
    # at a constant bias the knee is slow, at a constant voltage it is not
    assert float(constants[-1][2]) > 2.0 * float(constants[-1][3])
    assert progress[-1] == (5, 5)


def test_the_command_takes_no_wave_form_beside_it(refused, tmp_path):
    assert "--step: does not go with --report" in refused(
        "pulse", "--report", str(tmp_path / "page"), "--step", "3"
    )
    assert not (tmp_path / "page").exists()
