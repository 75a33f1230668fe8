"""Drawn levers of other materials than the paper's silicon."""

from __future__ import annotations

from typing import Any

from drawn import box, reference_points
from hotlever.probe import Probe

#: A pointed membrane of silicon nitride with a track of palladium on it.
OUTLINE = [
    *([0, -25], [40, -25], [60, -4], [60, 4], [40, 25], [0, 25]),
    *([0, 15], [30, 15], [40, 5], [40, -5], [30, -15], [0, -15]),
]
TRACK = [
    *([0, -24], [38, -24], [58, -2], [58, 2], [38, 24], [0, 24]),
    *([0, 16], [33, 16], [54, 1], [54, -1], [33, -16], [0, -16]),
]
FILM = {"kind": "metal-film", "preset": "Pd", "resistivity": 2e-5, "tcr": 2e-3}
NITRIDE = {"kind": "dielectric", "preset": "SiN"}


def metal_film_sections() -> dict[str, dict[str, Any]]:
    """A probe of palladium on silicon nitride."""
    return {
        "probe": {"shape": "drawing", "thickness_um": 0.4, "tip_um": [56.0, 0.0]},
        "layers": {
            "body": {"drawn": [OUTLINE], "material": "nitride"},
            "track": {"drawn": [TRACK], "material": "film", "thickness_um": 0.05},
        },
        "terminals": {
            "supply": [[0.0, -25.0], [0.0, -15.0]],
            "ground": [[0.0, 15.0], [0.0, 25.0]],
        },
        "materials": {"film": FILM, "nitride": NITRIDE},
        "circuit": {"series_resistance_ohm": 100.0},
    }


def metal_film_probe(**changes: Any) -> Probe:
    return Probe.from_sections(metal_film_sections() | changes, "test")


def strip_probe(**changes: Any) -> Probe:
    """A small strip of palladium on silicon nitride, all of it track."""
    sections = metal_film_sections()
    outline = [box(0, 0, 20, 2)]
    for layer in sections["layers"].values():
        layer["drawn"] = outline
    sections["probe"]["tip_um"] = [10.0, 1.0]
    sections["terminals"] = {
        "supply": [[20.0, 0.0], [20.0, 2.0]],
        "ground": [[0.0, 0.0], [0.0, 2.0]],
    }
    return Probe.from_sections(sections | changes, "test")


def of_named_silicon(kind: str, legs: dict[str, Any], heater: dict[str, Any]) -> Probe:
    """The reference probe as lists of points, of silicon that has names."""
    sections = reference_points()
    drawn = sections["layers"]
    sections["layers"] = {
        "silicon": {"drawn": drawn["silicon"], "material": "legs"},
        "heater": {"drawn": [drawn["heater"]], "material": "hot"},
        "reader": {"drawn": [drawn["reader"]], "material": "hot"},
    }
    sections["materials"] = {
        "legs": {"kind": "high-doped-silicon", **legs},
        "hot": {"kind": kind, **heater},
    }
    return Probe.from_sections(sections, "test")


def p_type_probe() -> Probe:
    """The reference probe's drawing, doped with boron."""
    return of_named_silicon("p-silicon", {"n_hd": 1e20, "a0": 1.2e-3}, {"n_d": 2e18, "p": 2.5})


def silicon_with_a_film(**film: Any) -> Probe:
    """The reference probe's drawing with gold on the centre leg."""
    sections = reference_points()
    sections["layers"]["gold"] = {
        "drawn": [box(-1, -3.22, 40, 3.22)],
        "material": "gold",
        "thickness_um": 0.02,
        **film,
    }
    sections["materials"] = {"gold": {"kind": "metal-film", "preset": "Au"}}
    return Probe.from_sections(sections, "test")
