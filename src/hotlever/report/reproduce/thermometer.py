"""The Raman thermometer."""

from __future__ import annotations

from importlib.resources import as_file, files

from hotlever.figures import raman_check, thermometry
from hotlever.raman import Thermometer, calibrate_from, measure, read_lines, read_spectra
from hotlever.report.reproduce.findings import Findings
from hotlever.studies.raman_check import conclusion, paper_check


def thermometer_section(page: Findings) -> None:
    """Fig. 2, and what the linear law does beyond its calibration."""
    with as_file(files("hotlever") / "examples" / "raman") as folder:
        calibration, series = calibrate_from(read_spectra([folder / "hot-plate"]))
        lines = measure(read_spectra([folder / "tip"]))
    table = read_lines(lines, Thermometer(calibration, "anharmonic"))
    page.figure(
        "raman_calibration",
        thermometry(lines, table, calibration, series),
        "Silicon spectra of a hot plate (some of the virtual lab's), the two calibration laws with "
        "tip spectra read by the anharmonic one, and what the laws leave of the hot plate.",
    )
    check = paper_check()
    page.figure("raman_check", raman_check(check), conclusion(check))

    published = check.isel(line=0)
    page.claim(
        "Fig. 2",
        "the linear Raman law, calibrated to 900 K, serves up to the hottest tip",
        f"it reads {published.error_at_hottest.item():+.0f} K at {check.hottest_K:.0f} K",
        holds=abs(published.error_at_hottest.item()) < 25.0,
        because="silicon's phonons soften faster than linearly",
    )
    gap = check.knee_measured_K - check.knee_predicted_K
    page.claim(
        "Figs. 6 and 10",
        f"the measured knee lies {gap:.0f} K above the simulated one",
        f"{published.discrepancy.item():.0f} K once the line is read with the anharmonic law",
        holds=published.explained.item() < 0.25,
        because=f"{published.explained.item():.0%} of it is the linear law's curvature",
    )
