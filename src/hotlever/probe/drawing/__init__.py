"""Drawings of levers: GDSII, OASIS and DXF files made layouts.

A file's *sheet* (its outlines by layer) becomes a shape of the probe file, whose outlines are
healed, cut into regions and checked. Nothing of this is loaded for a parametric shape.
"""
