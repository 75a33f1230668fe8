"""The colours of figures, in print and in the browser."""

from __future__ import annotations

#: Okabe and Ito's colours, safe for colour-blind readers.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
#: matplotlib's colour map of temperatures.
HEAT = "inferno"
