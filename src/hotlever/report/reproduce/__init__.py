"""The paper's results, computed: one page that puts ours beside the published ones."""

from __future__ import annotations

from collections.abc import Callable

from hotlever.lever import Lever
from hotlever.materials.spieser2017 import DOI, published
from hotlever.probe import Probe
from hotlever.report.page import Page
from hotlever.report.reproduce import air, fits, thermometer, vacuum
from hotlever.report.reproduce.study import Claim, Study

__all__ = ["Claim", "Study", "reproduce_page"]

#: In the order of the page.
SECTIONS: tuple[Callable[[Study], None], ...] = (
    vacuum.probe_section,
    vacuum.parameter_section,
    vacuum.operating_points_section,
    vacuum.characteristics_section,
    vacuum.heater_section,
    vacuum.knee_section,
    fits.fit_section,
    fits.options_section,
    thermometer.thermometer_section,
    air.disc_section,
    air.characteristics_section,
    air.scale_section,
    air.map_section,
    vacuum.balance_section,
)
#: Left out of the quick form.
LONG_SECTIONS: tuple[Callable[[Study], None], ...] = (
    air.geometry_section,
    air.tip_section,
    vacuum.mesh_section,
)


def reproduce_page(quick: bool, progress: Callable[[int, int], None]) -> Page:
    """Compute everything and return the page, the claims of the paper first.

    Parameters
    ----------
    quick : bool
        Leave out `LONG_SECTIONS`.
    progress : callable
        Called with the sections done and their number.
    """
    probe = Probe.reference().with_values(published("option III").material.model_dump())
    page = Page(
        "Joule-heated cantilever probes: the published results, computed",
        f"Spieser et al., J. Appl. Phys. 121, 174503 (2017), doi:{DOI}, with hotlever's reference "
        "probe, whose dimensions are inferred: no drawing of the published lever exists.",
    )
    study = Study(Page(page.title), Lever(probe), quick)
    sections = SECTIONS if quick else SECTIONS + LONG_SECTIONS
    for number, section in enumerate(sections, start=1):
        section(study)
        progress(number, len(sections))
    page.heading("What the paper says, and what was found")
    page.table(
        ("where", "claim", "verdict", "found in this run"),
        [(claim.where, claim.statement, claim.verdict, claim.found) for claim in study.claims],
        "Every verdict is computed from the sections below.",
        prose=True,
    )
    page.blocks.extend(study.page.blocks)
    return page
