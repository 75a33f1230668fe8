"""What remains of the 50 K that the knee is off: the suspects, each computed."""

from __future__ import annotations

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever.report.reproduce.findings import Findings
from hotlever.studies.knee_discrepancy import IN_AIR, TOGETHER, compare_suspects

#: Of a cell whose suspect does not count in the medium.
_NOTHING = "–"


def discrepancy_section(page: Findings) -> None:
    """The suspects in vacuum and in air; quickly in vacuum, without the uncertain layout."""
    media = ("vacuum",) if page.quick else ("vacuum", "air")
    studies = {
        medium: compare_suspects(
            page.lever.probe.in_medium(medium),
            page.fitted_example,
            layout=not page.quick,
            progress=page.progress,
        )
        for medium in media
    }
    page.draw("knee_discrepancy", figures.knee_discrepancy(studies))
    rows = []
    for suspect in studies[media[0]].suspect.values:
        row = [str(suspect)]
        for study in studies.values():
            row += map(_shift, study[["moved_K", "shift_K"]].sel(suspect=suspect).values())
        rows.append(row)
    for name in studies[media[0]].uncertainty.values:
        row = [str(name)]
        for study in studies.values():
            row += ["", f"± {study.stderr_K.sel(uncertainty=name).item():.1f}"]
        rows.append(row)
    left = [f"{study.left_K:.0f} ± {study.total_stderr_K:.0f}" for study in studies.values()]
    rows.append(["what remains", *(cell for value in left for cell in ("", value))])
    headings = [f"{way}, in {medium} (K)" for medium in media for way in ("not fitted", "fitted")]
    gap = studies["vacuum"].discrepancy_K
    page.tabulate("knee_discrepancy", ["suspect", *headings], rows, gap=gap)
    together = studies["vacuum"].shift_K.sel(suspect=TOGETHER).item()
    page.say("knee_discrepancy", gap=gap, together=together, left=studies["vacuum"].left_K)
    if "air" in studies:
        in_air = studies["air"]
        gap, carried = in_air.discrepancy_K, in_air.shift_K.sel(suspect=IN_AIR).item()
        page.claim("tip_in_air", holds=carried > 0.75 * gap, gap=gap, carried=carried)


def _shift(value: xr.DataArray) -> str:
    return _NOTHING if np.isnan(value.item()) else f"{value.item():+.1f}"
