"""The paper's results, computed: one page that puts ours beside the published ones."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from hotlever.lever import Lever
from hotlever.materials import published
from hotlever.probe import Probe
from hotlever.processes import PROCESSORS, local_processes
from hotlever.report.report_page import Block, Page
from hotlever.report.reproduce import air_sections as air
from hotlever.report.reproduce import claim_sections as claims
from hotlever.report.reproduce import layout_sections as layout
from hotlever.report.reproduce import paper_sections as inference
from hotlever.report.reproduce import paper_sections as vacuum
from hotlever.report.reproduce.findings import Claim, Findings
from hotlever.types import Progress

#: Headings and sections, in the order of the page.
SECTIONS: dict[str, Callable[[Findings], None]] = {
    "The lever of the paper, from all that is printed of it": layout.layouts_section,
    "The reference probe": vacuum.probe_section,
    "Published parameters and inversion temperatures (Tables I and II)": vacuum.parameter_section,
    "Published operating points": vacuum.operating_points_section,
    "Characteristics in vacuum (Figs. 5 and 6)": vacuum.characteristics_section,
    "T(P) above the knee on other levers (Eq. 12)": claims.linear_section,
    "Inside the heater (Fig. 7)": vacuum.heater_section,
    "Why the knee is not at the inversion temperature": vacuum.knee_section,
    "Material parameters from a measurement (option III)": inference.fit_section,
    "What each observable adds (options I to III, Figs. 3 and 4, Table I)": inference.data_section,
    "The same parameters from other levers? (Table II)": claims.consistency_section,
    "The Raman thermometer (Fig. 2)": inference.thermometer_section,
    "Heat into air depends on the surroundings (Fig. 8)": air.disc_section,
    "Characteristics in air (Figs. 9 and 10)": air.characteristics_section,
    "Is air one factor of the power? (Fig. 10b)": air.scale_section,
    "A surface on one side (Section V)": air.one_sided_section,
    "Radiation (Section IV)": claims.radiation_section,
    "Where the heat goes": air.map_section,
    "The 50 K that the knee is off (Figs. 6 and 10)": layout.discrepancy_section,
    "A lever never seen: how wrong is its calibration?": inference.levers_section,
    "Balances": vacuum.balance_section,
}
#: Left out of the quick form.
LONG_SECTIONS: dict[str, Callable[[Findings], None]] = {
    "k by size and pressure": air.geometry_section,
    "The missing tip": air.tip_section,
    "Thermoelectricity: which way the hot spot moves": claims.shift_section,
    "Thermoelectricity: what a fit gains by it": claims.prediction_section,
    "Mesh": vacuum.mesh_section,
}


#: Sections that take longest, the longest first: with these two processes begin.
_LONGEST = (
    "A lever never seen: how wrong is its calibration?",
    "The same parameters from other levers? (Table II)",
    "T(P) above the knee on other levers (Eq. 12)",
)


def reproduce_page(quick: bool, progress: Progress) -> Page:
    """Compute everything and return the page, the claims of the paper first.

    Sections are computed side by side, by as many processes as there are processors.

    Parameters
    ----------
    quick : bool
        Leave out `LONG_SECTIONS`; others are of fewer levers.
    progress : callable
        Called with the sections done and their number.
    """
    headings = list(_sections(quick))
    order = sorted(headings, key=[*_LONGEST, *headings].index)
    with local_processes(PROCESSORS) as run:
        done = run(filled_section, [(heading, quick) for heading in order], progress)
    filled = dict(zip(order, done, strict=True))
    page = _shared_page(quick)
    page.heading("What the paper says, and what was found")
    caption = (
        "Where the layout of the paper's lever matters, the verdict is that of the layouts which "
        "what is printed leaves, by their weight, and the last column is their range of what "
        "decides. Other numbers are of the reference probe in this run, from the sections below."
    )
    columns = ("where", "the paper says", "verdict", "found", "over the layouts")
    claims = [claim for heading in headings for claim in filled[heading][1]]
    page.table(columns, claims, caption, prose=True)
    page.blocks += [block for heading in headings for block in filled[heading][0]]
    return page


def _sections(quick: bool) -> dict[str, Callable[[Findings], None]]:
    return SECTIONS if quick else SECTIONS | LONG_SECTIONS


@cache
def _shared_page(quick: bool) -> Findings:
    """Return a page with what sections of this process share."""
    material = published("option III").material
    return Findings(Lever(Probe.reference().with_(**material.model_dump())), quick=quick)


def filled_section(heading: str, quick: bool) -> tuple[list[Block], list[Claim]]:
    """Compute one section; return its blocks, and its claims."""
    page = _shared_page(quick)
    page.blocks, page.claims = [], []
    page.heading(heading)
    _sections(quick)[heading](page)
    return page.blocks, page.claims
