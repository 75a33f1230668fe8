"""The figure of a plan: how sure a tip temperature is now and after more measurements."""

from __future__ import annotations

from collections import Counter
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hotlever.calibration.next_measurement import SURE, Plan
from hotlever.colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from hotlever.figures.style import axis_label, figure

#: How each kind of measurement is marked, and how errors are drawn, now first.
_MARKS: dict[str, Any] = {
    "bias": {"marker": "o", "color": BLUE},
    "reader": {"marker": "s", "color": GREEN},
    "spectra": {"marker": "^", "color": PURPLE},
}
_LINES = (BLACK, ORANGE, GREEN, BLUE, SKY)


def planned_measurements(plan: Plan) -> Figure:
    """Draw the error by temperature now and after more measurements, and how hot the tip may get.

    The proposed measurements are marked, with how often each is proposed, and the limit.
    """
    errors, proposals = plan.errors, plan.proposals
    shown = np.isfinite(errors.tip_limit_K.values)
    counts = Counter(
        zip(proposals.what.values.tolist(), proposals.bias_V.values.tolist(), strict=True)
    )
    with figure(8.0, 3.8, 1, 2, letters=True) as (made, (by_tip, by_bias)):
        made.suptitle(plan.lever, x=0.01, ha="left")
        for added, colour in zip(errors.added.values.tolist(), cycle(_LINES), strict=False):
            label = f"after {added} more" if added else "now"
            stderr = errors.tip_stderr_K.sel(added=added)
            by_tip.plot(errors.tip_K[shown], stderr[shown], color=colour, label=label)
        last = errors.tip_stderr_K.isel(added=-1)
        by_tip.axvline(plan.at_K, color="0.6", lw=0.9, ls=":")
        above: Any = {"xycoords": by_tip.get_xaxis_transform(), "color": "0.4", "fontsize": 7}
        by_tip.annotate(f"{plan.at_K:.0f} K, where it counts", (plan.at_K, 1.0), **above)
        by_bias.plot(errors.bias[shown], errors.tip_K[shown], color=BLACK, label="expected")
        label = f"no hotter, by {SURE:.0%}"
        by_bias.plot(
            errors.bias[shown], errors.tip_limit_K[shown], "--", color=VERMILION, label=label
        )
        by_bias.axvspan(plan.safe_V, float(errors.bias[shown].max()), color="0.92", lw=0)
        if plan.stay_below_K is not None:
            by_bias.axhline(plan.stay_below_K, color=VERMILION, lw=0.9)
            text = f" limit {plan.stay_below_K:.0f} K"
            by_bias.annotate(text, (errors.bias.values[0], plan.stay_below_K), va="bottom")
        for (kind, bias), times in counts.items():
            tip = float(np.interp(bias, errors.bias, errors.tip_K))
            stderr_K = float(np.interp(bias, errors.bias, last))
            style = {"ls": "none", "ms": 7.0, "mec": "white", **_MARKS[kind], "zorder": 3}
            for axes, at in ((by_bias, (bias, tip)), (by_tip, (tip, stderr_K))):
                axes.plot(*at, **style)
                if times > 1:
                    axes.annotate(f" {times}×", at, fontsize=7, va="top")
        for kind in dict.fromkeys(proposals.what.values.tolist()):
            by_bias.plot([], [], ls="none", label=f"{kind}, proposed", **_MARKS[kind])
        by_tip.set(xlabel=axis_label("tip_K"), ylabel="standard error (K)", ylim=(0, None))
        by_bias.set(xlabel=axis_label("bias_V"), ylabel=axis_label("tip_K"))
        for axes in (by_tip, by_bias):
            axes.legend(loc="upper left")
    return made
