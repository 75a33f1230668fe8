"""Drawings of levers: in Python, and GDSII, OASIS and DXF files, made layouts.

A file's *sheet* (its outlines by layer) becomes a shape of the probe file, whose outlines are
healed, cut into regions and checked; a `Drawing` of areas made in Python goes the same way. Nothing
of this is loaded for a shape by its dimensions.
"""
# ruff: noqa: F401 (what is imported here is what the package offers)

from hotlever.probe.drawing.kit import (
    Drawing,
    Layer,
    Polygon,
    difference,
    fillet,
    mirror,
    rectangle,
    union,
)
