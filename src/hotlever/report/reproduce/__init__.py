"""The paper's results, computed: one page that puts ours beside the published ones."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from hotlever.lever import Lever
from hotlever.materials import published
from hotlever.probe import Probe
from hotlever.processes import PROCESSORS, local_processes
from hotlever.report.report_page import Block, Page
from hotlever.report.reproduce import claim_sections as claims
from hotlever.report.reproduce import layout_sections as layout
from hotlever.report.reproduce import paper_sections as paper
from hotlever.report.reproduce.findings import Claim, Findings
from hotlever.types import Progress

#: Headings and sections, in the order of the paper.
SECTIONS: dict[str, Callable[[Findings], None]] = {
    "The lever of the paper, from all that is printed of it": layout.layouts_section,
    "The reference probe (Fig. 1)": paper.probe_section,
    "The Raman thermometer (Section III, Fig. 2)": paper.thermometer_section,
    "Material parameters from a measurement (Section IV, option III)": paper.fit_section,
    "What each observable adds (options I to III, Figs. 3 and 4, Table I)": paper.data_section,
    "Published parameters and inversion temperatures (Tables I and II)": paper.parameter_section,
    "The same parameters from other levers? (Table II)": claims.consistency_section,
    "Characteristics in vacuum (Figs. 5 and 6)": paper.characteristics_section,
    "Published operating points (Figs. 6a and 7b)": paper.operating_points_section,
    "T(P) above the knee on other levers (Eq. 12)": claims.linear_section,
    "Inside the heater (Fig. 7)": paper.heater_section,
    "Why the knee is not at the inversion temperature (Section IV)": paper.knee_section,
    "Radiation (Section IV)": claims.radiation_section,
    "Thermoelectricity: which way the hot spot moves (Section IV)": claims.shift_section,
    "Thermoelectricity: what a fit gains by it (Section IV)": claims.prediction_section,
    "Heat into air depends on the surroundings (Fig. 8)": claims.disc_section,
    "Characteristics in air (Figs. 9 and 10)": claims.characteristics_section,
    "Is air one factor of the power? (Fig. 10b)": claims.scale_section,
    "Where the heat goes (Section V)": claims.map_section,
    "A surface on one side (Section V)": claims.one_sided_section,
    "k by size and pressure (Section V)": claims.geometry_section,
    "The 50 K that the knee is off (Figs. 6a and 10a)": layout.discrepancy_section,
    "Which measurement would decide the 50 K?": layout.next_section,
    "The missing tip (Conclusions)": claims.tip_section,
    "A lever never seen: how wrong is its calibration?": paper.levers_section,
    "Balances": paper.balance_section,
    "Mesh": paper.mesh_section,
}


def reproduce_page(quick: bool, progress: Progress) -> Page:
    """Compute everything and return the page, the claims of the paper first.

    Sections are computed side by side, by as many processes as there are processors.

    Parameters
    ----------
    quick : bool
        Leave out what takes longest; other sections are of fewer levers.
    progress : callable
        Called with the sections done and their number.
    """
    long = {claims.shift_section, claims.prediction_section, paper.mesh_section}
    long |= {claims.geometry_section, claims.tip_section}
    headings = [name for name, section in SECTIONS.items() if not (quick and section in long)]
    # processes begin with those that take longest
    longest = (paper.levers_section, claims.consistency_section, claims.linear_section)
    order = sorted(headings, key=lambda heading: SECTIONS[heading] not in longest)
    with local_processes(PROCESSORS) as run:
        done = run(filled_section, [(heading, quick) for heading in order], progress)
    filled = dict(zip(order, done, strict=True))
    page = _shared_page(quick)
    page.heading("What the paper says, and what was found")
    caption = (
        "A verdict that depends on the layout of the paper's lever is that of the layouts which "
        "agree with what is printed (next section): a claim holds if it is true of 95 % of their "
        "weight or more. The last column is the number that decides, from the least to the largest "
        "of these layouts. What was found is of the reference probe, in this run, and more of it "
        "stands in the section that the first column leads to."
    )
    columns = ("where", "the paper says", "verdict", "found", "over the layouts")
    rows = [claim for heading in headings for claim in filled[heading][1]]
    page.table(columns, rows, caption, prose=True)
    page.blocks += [block for heading in headings for block in filled[heading][0]]
    return page


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
    SECTIONS[heading](page)
    return page.blocks, page.claims
