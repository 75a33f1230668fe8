"""The paper's results, computed: one page that puts ours beside the published ones."""

from __future__ import annotations

from collections.abc import Callable

from hotlever.lever import Lever
from hotlever.materials import published
from hotlever.probe import Probe
from hotlever.report.page import Page
from hotlever.report.reproduce import air, claims, discrepancy, inference, thermoelectricity, vacuum
from hotlever.report.reproduce.findings import Findings
from hotlever.steps import each
from hotlever.types import Progress

REMAINS = "What remains of the 50 K that the knee is off"
NEVER_SEEN = "A lever never seen: how wrong is its calibration?"
OTHER_LEVERS = "T(P) above the knee on other levers (Eq. 12)"
RADIATION = "Radiation (Section IV)"
SAME_MATERIAL = "The same parameters from other levers? (Table II)"
ONE_SIDED = "A surface on one side (Section V)"
#: Headings and sections, in the order of the page.
SECTIONS: dict[str, Callable[[Findings], None]] = {
    "The reference probe": vacuum.probe_section,
    "Published parameters and inversion temperatures (Tables I and II)": vacuum.parameter_section,
    "Published operating points": vacuum.operating_points_section,
    "Characteristics in vacuum (Figs. 5 and 6)": vacuum.characteristics_section,
    OTHER_LEVERS: claims.few_linear_section,
    "Inside the heater (Fig. 7)": vacuum.heater_section,
    "Why the knee is not at the inversion temperature": vacuum.knee_section,
    "Material parameters from a measurement (option III)": inference.fit_section,
    "What each observable adds (options I to III, Figs. 3 and 4, Table I)": inference.data_section,
    SAME_MATERIAL: claims.few_consistency_section,
    "The Raman thermometer (Fig. 2)": inference.thermometer_section,
    "Heat into air depends on the surroundings (Fig. 8)": air.disc_section,
    "Characteristics in air (Figs. 9 and 10)": air.characteristics_section,
    "Is air one factor of the power? (Fig. 10b)": air.scale_section,
    ONE_SIDED: claims.few_one_sided_section,
    RADIATION: claims.radiation_section,
    "Where the heat goes": air.map_section,
    REMAINS: discrepancy.short_section,
    NEVER_SEEN: inference.few_levers_section,
    "Balances": vacuum.balance_section,
}
#: Left out of the quick form, or shorter there.
LONG_SECTIONS: dict[str, Callable[[Findings], None]] = {
    "k by size and pressure": air.geometry_section,
    "The missing tip": air.tip_section,
    "Thermoelectricity: which way the hot spot moves": thermoelectricity.shift_section,
    "Thermoelectricity: what a fit gains by it": thermoelectricity.prediction_section,
    "Mesh": vacuum.mesh_section,
    REMAINS: discrepancy.discrepancy_section,
    NEVER_SEEN: inference.many_levers_section,
    OTHER_LEVERS: claims.linear_section,
    SAME_MATERIAL: claims.consistency_section,
    ONE_SIDED: claims.one_sided_section,
}


def reproduce_page(quick: bool, progress: Progress, within: Progress | None = None) -> Page:
    """Compute everything and return the page, the claims of the paper first.

    Parameters
    ----------
    quick : bool
        Leave out `LONG_SECTIONS`.
    progress : callable
        Called with the sections done and their number.
    within : callable, optional
        Called with the steps done and their number, where a section takes long.
    """
    material = published("option III").material
    page = Findings(Lever(Probe.reference().with_(**material.model_dump())), within)
    sections = SECTIONS if quick else SECTIONS | LONG_SECTIONS
    for heading, section in each(sections.items(), progress):
        page.heading(heading)
        section(page)
    filled, page.blocks = page.blocks, []
    page.heading("What the paper says, and what was found")
    page.tabulate(
        "claims", ("where", "claim", "verdict", "found in this run"), page.claims, prose=True
    )
    page.blocks += filled
    return page
