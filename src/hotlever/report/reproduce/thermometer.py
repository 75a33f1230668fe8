"""The Raman thermometer."""

from __future__ import annotations

from importlib.resources import as_file, files

from hotlever.raman import (
    Thermometer,
    calibrate_from,
    measure,
    paper_check,
    read_lines,
    read_spectra,
)
from hotlever.raman.figures import paper_check as draw_paper_check
from hotlever.raman.figures import thermometry
from hotlever.report.reproduce.study import Study


def thermometer_section(study: Study) -> None:
    """Fig. 2, and what the linear law does beyond its calibration."""
    study.page.heading("The Raman thermometer (Fig. 2)")
    with as_file(files("hotlever") / "examples" / "raman") as folder:
        calibration, series = calibrate_from(read_spectra([folder / "hot-plate"]))
        lines = measure(read_spectra([folder / "tip"]))
    rows = read_lines(lines, Thermometer(calibration, "anharmonic"))
    study.page.figure(
        "raman_calibration",
        thermometry(lines, rows, calibration, series),
        "Silicon spectra of a hot plate (some of the virtual lab's), the two calibration laws with "
        "tip spectra read by the anharmonic one, and what the laws leave of the hot plate.",
    )
    check = paper_check()
    study.page.figure("raman_check", draw_paper_check(check), check.conclusion())

    published = check.results[0]
    study.claim(
        "Fig. 2",
        "the linear Raman law, calibrated to 900 K, serves up to the hottest tip",
        f"it reads {published.error_at_hottest:+.0f} K at {check.hottest:.0f} K",
        holds=abs(published.error_at_hottest) < 25.0,
        because="silicon's phonons soften faster than linearly",
    )
    gap = check.knee_measured - check.knee_predicted
    study.claim(
        "Figs. 6 and 10",
        f"the measured knee lies {gap:.0f} K above the simulated one",
        f"{published.discrepancy:.0f} K once the line is read with the anharmonic law",
        holds=published.explained < 0.25,
        because=f"{published.explained:.0%} of it is the linear law's curvature",
    )
