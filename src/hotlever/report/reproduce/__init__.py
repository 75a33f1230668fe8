"""The paper's results, computed: one page that puts ours beside the published ones."""

from __future__ import annotations

from collections.abc import Callable

from hotlever.lever import Lever
from hotlever.materials import published
from hotlever.probe import Probe
from hotlever.report.report_page import Page
from hotlever.report.reproduce import air_sections as air
from hotlever.report.reproduce import claim_sections as claims
from hotlever.report.reproduce import paper_sections as inference
from hotlever.report.reproduce import paper_sections as vacuum
from hotlever.report.reproduce.findings import Findings
from hotlever.steps import each
from hotlever.types import Progress

#: Headings and sections, in the order of the page.
SECTIONS: dict[str, Callable[[Findings], None]] = {
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
    "What remains of the 50 K that the knee is off": vacuum.discrepancy_section,
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


def reproduce_page(quick: bool, progress: Progress, within: Progress | None = None) -> Page:
    """Compute everything and return the page, the claims of the paper first.

    Parameters
    ----------
    quick : bool
        Leave out `LONG_SECTIONS`; others are of fewer levers.
    progress : callable
        Called with the sections done and their number.
    within : callable, optional
        Called with the steps done and their number, where a section takes long.
    """
    material = published("option III").material
    lever = Lever(Probe.reference().with_(**material.model_dump()))
    page = Findings(lever, quick=quick, progress=within)
    sections = SECTIONS if quick else SECTIONS | LONG_SECTIONS
    for heading, section in each(sections.items(), progress):
        page.heading(heading)
        section(page)
    filled, page.blocks = page.blocks, []
    page.heading("What the paper says, and what was found")
    caption = "Every verdict is computed from the sections below."
    columns = ("where", "claim", "verdict", "found in this run")
    page.table(columns, page.claims, caption, prose=True)
    page.blocks += filled
    return page
