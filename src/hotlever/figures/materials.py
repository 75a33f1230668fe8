"""The figure of what levers are made of."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle

from matplotlib.figure import Figure

from hotlever.figures.style import COLOURS, figure
from hotlever.types import Array


def material_curves(curves: Mapping[str, tuple[Array, Array, Array | None]]) -> Figure:
    """Draw thermal conductivity and resistivity of materials against the temperature.

    Parameters
    ----------
    curves : mapping of str to tuple
        From `hotlever.materials.catalogue.curves`.
    """
    with figure(7.4, 4.6, 1, 2) as (made, (left, right)):
        styles = zip(cycle(COLOURS), cycle(["-"] * len(COLOURS) + ["--"] * len(COLOURS)))
        for (name, (T, kappa, rho)), (colour, line) in zip(curves.items(), styles, strict=False):
            left.semilogy(T, kappa, line, color=colour, label=name)
            if rho is not None:
                right.semilogy(T, rho, line, color=colour)
        left.set(xlabel="temperature (K)", ylabel="thermal conductivity (W m⁻¹ K⁻¹)")
        right.set(xlabel="temperature (K)", ylabel="resistivity (Ω cm)")
        made.legend(loc="outside lower center", ncols=4)
    return made
