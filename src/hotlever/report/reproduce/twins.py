"""Levers never seen: the estimate with priors beside the paper's ways to the temperature."""

from __future__ import annotations

from hotlever import figures
from hotlever.report.reproduce.findings import Findings
from hotlever.steps import each
from hotlever.studies.twins import ESTIMATE, LEVELS, WAYS, judge, summary, together

#: Twins of the page, and of its quick form.
MANY_TWINS, FEW_TWINS = 24, 4


def twins_section(page: Findings) -> None:
    """Twins with a richer physics than the model, calibrated from their I-V curve."""
    _compare_ways(page, MANY_TWINS)


def few_twins_section(page: Findings) -> None:
    """The same with fewer twins."""
    _compare_ways(page, FEW_TWINS)


def _compare_ways(page: Findings, count: int) -> None:
    page.text(
        "In use nobody sees how hot a tip is. It is inferred from voltage and current, "
        "and what counts is how wrong that is on the next lever, which differs from its drawing "
        f"and from any model. Therefore {count} levers were made up and solved, half of them "
        "U-shaped, each with its own material and dimensions and with physics that the "
        "calibrating model lacks (another law of the mobility, a tip, a finer mesh), and measured "
        "with noise, drift and outliers. Each way of calibrating is given the drawing, the nominal "
        "doping and the I-V curve; its temperatures are compared with the true ones."
    )
    found = together([judge(number) for number in each(range(count), page.progress)])
    total = summary(found)
    median = {way: total.largest_K.sel(way=way, percentile=50).item() for way in WAYS}
    best, *_, worst = sorted(WAYS[1:], key=median.__getitem__)
    held = [total.held.sel(level=level).mean().item() for level in LEVELS]
    page.text(
        f"The largest error of the estimate is {median[ESTIMATE]:.0f} K on the median lever; it is "
        f"{median[best]:.0f} K by the best of the other ways ({best}) and {median[worst]:.0f} K by "
        f"the worst ({worst}). The estimate alone needs no knee and says how sure it is: its 68 % "
        f"band holds {held[0]:.0%} of the true temperatures, its 95 % band {held[1]:.0%}."
    )
    page.figure(
        "twins",
        figures.twins(found),
        f"(a) The largest error above 400 K of each of {total.answered} levers, by the way of "
        "calibrating. (b) The error of the estimate along the bias, in units of the error that it "
        "states, one line for each lever.",
    )
    rows = [
        (
            way,
            *(f"{value:.0f}" for value in total.largest_K.sel(way=way).values),
            "no" if way == ESTIMATE else "yes",
        )
        for way in WAYS
    ]
    page.table(
        ("way of calibrating", "median (K)", "90 % of the levers (K)", "worst (K)", "needs a knee"),
        rows,
        "Largest error of the tip temperature above 400 K. k: power at the knee of the lever over "
        "that of the reference. T_i: inversion temperature of the nominal doping, the temperature "
        "rising in proportion to the power. With few levers the shares are rough; "
        "benchmarks/twins.py makes 200, and others in air and with Raman temperatures.",
    )
