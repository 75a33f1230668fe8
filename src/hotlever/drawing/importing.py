"""A drawing file told in words, and the probe file that is proposed for it."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hotlever.drawing.contacts import REQUIRED, terminal_part
from hotlever.drawing.fault import Ring
from hotlever.drawing.layers import HEATER, SILICON
from hotlever.drawing.proposal import Drawn, Proposal, proposed
from hotlever.drawing.shape import TOLERANCE_UM
from hotlever.drawing.sheet import Sheet, read_sheet
from hotlever.errors import InputError
from hotlever.probe.layout import Point, ring_area
from hotlever.probe.probe import Probe
from hotlever.probe.sections import commented
from hotlever.text import aligned, as_toml

#: Layers that are listed.
_MOST_LISTED = 60


@dataclass(frozen=True)
class Imported:
    """A drawing file made a probe file.

    Attributes
    ----------
    sheet : Sheet
    proposal : Proposal
    listing : list of str
        What the file holds and what is proposed, in lines.
    text : str
        The probe file.
    fault : InputError or None
        Why the probe file cannot be solved as it stands.
    """

    sheet: Sheet
    proposal: Proposal
    listing: list[str]
    text: str
    fault: InputError | None

    @property
    def outlines(self) -> dict[str, tuple[Ring, ...]]:
        """All that is drawn, by what it is and by layer."""
        roles = _by_part(self.proposal)
        of_layer = {one: role for role, one in roles.items() if isinstance(one, str)}
        found = {}
        for name, layer in self.sheet.layers.items():
            role = of_layer.get(name)
            label = name if role in (None, name) else f"{role} ({name})"
            found[label] = (*layer.rings, *layer.lines)
        return found | {role: one for role, one in roles.items() if not isinstance(one, str)}


def import_drawing(path: Path, cell: str | None, folder: Path) -> Imported:
    """Read a drawing file and propose a probe file.

    Parameters
    ----------
    path : path
    cell : str, optional
        Of a GDSII or OASIS file.
    folder : path
        Where the probe file will stand: the name of the drawing is relative to it.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    sheet = read_sheet(path, cell, tolerance_um=TOLERANCE_UM)
    proposal = proposed(sheet, TOLERANCE_UM)
    listing = _listing(sheet, proposal)
    name = _relative(path, folder)
    text = _probe_file(sheet, proposal, listing, name)
    fault: InputError | None = None
    try:
        Probe.from_values(tomllib.loads(text), str(path), folder)
    except InputError as error:
        fault = error
    return Imported(sheet, proposal, listing, text, fault)


def _by_part(proposal: Proposal) -> dict[str, Drawn]:
    """Return what is drawn by what it is taken as."""
    ends = {terminal_part(name): one for name, one in proposal.terminals.items()}
    return proposal.layers | ends


def _relative(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return path.resolve().as_posix()


def _listing(sheet: Sheet, proposal: Proposal) -> list[str]:
    """Return what the file holds, line by line."""
    lines = [f"{Path(sheet.file).name}: {sheet.kind}"]
    if sheet.cell is not None:
        others = [name for name in sheet.cells if name != sheet.cell]
        more = f"; others: {', '.join(others[:20])}" if others else ""
        lines.append(f"cell {sheet.cell}{more}")
    elif not sheet.unit_stated:
        lines.append("the file states no unit: taken to be in µm; see unit_um")
    else:
        lines.append(f"one unit of the file is {sheet.unit_um:g} µm")
    roles = _by_part(proposal)
    of_layer = {one: role for role, one in roles.items() if isinstance(one, str)}
    rows = [["layer", "outlines", "area (µm²)", "x (µm)", "y (µm)", "taken as"]]
    for name, layer in list(sheet.layers.items())[:_MOST_LISTED]:
        points = np.array([place for ring in (*layer.rings, *layer.lines) for place in ring])
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        number = f"{len(layer.rings)}" + (f" + {len(layer.lines)} open" if layer.lines else "")
        extent = [f"{x0:.6g} to {x1:.6g}", f"{y0:.6g} to {y1:.6g}"]
        area = f"{sum(ring_area(np.array(ring)) for ring in layer.rings):.4g}"
        rows.append([name, number, area, *extent, of_layer.get(name, "–")])
    lines += aligned(rows)
    if len(sheet.layers) > _MOST_LISTED:
        lines.append(f"and {len(sheet.layers) - _MOST_LISTED} more layers")
    lines += [f"{label}: {reason}" for label, reason in proposal.reasons.items()]
    if sheet.left_out:
        kinds = ", ".join(f"{count} {kind}" for kind, count in sheet.left_out.items())
        lines.append(f"left out, since they draw no outline: {kinds}")
    return lines + [f"to be checked: {doubt}" for doubt in proposal.doubts]


def _probe_file(sheet: Sheet, proposal: Proposal, listing: list[str], name: str) -> str:
    reference = Probe.reference()
    lines = ["# A hotlever probe file: lengths in µm, temperatures in K.", "#"]
    lines += [f"# {line}" for line in listing]
    lines += ["", "[probe]", 'shape = "drawing"', f"file = {as_toml(name)}"]
    if sheet.cell is not None:
        lines.append(f"cell = {as_toml(sheet.cell)}")
    if sheet.kind == "DXF" and not sheet.unit_stated:
        lines.append("unit_um = 1.0                   # the file does not say")
    lines.append(
        f"thickness_um = {reference.layout().thickness_um:<17g}# that of the reference probe: a "
        "drawing does not say"
    )
    lines.append(_entry("tip_um", proposal.tip, proposal.reasons.get("tip"), (0.0, 0.0)))
    reasons = proposal.reasons
    lines += ["", "[layers]"]
    for role in dict.fromkeys((SILICON, HEATER, *proposal.layers)):
        lines.append(_entry(role, proposal.layers.get(role), reasons.get(role), "1/0"))
    lines += ["", "[terminals]"]
    for role in dict.fromkeys((*REQUIRED, *proposal.terminals)):
        reason = reasons.get(terminal_part(role))
        lines.append(_entry(role, proposal.terminals.get(role), reason, "10/0"))
    return "\n".join(lines) + "\n" + reference.other_sections()


def _entry(key: str, value: Drawn | Point | None, reason: str | None, example: object) -> str:
    """Return a line of the probe file; where nothing is proposed, a comment in its place."""
    if value is None:
        return f"# {key} = {as_toml(example)}    # not found in the drawing"
    one_outline = isinstance(value, tuple) and len(value) == 1
    entry = f"{key} = {as_toml(value[0] if one_outline else value)}"
    return commented(entry, reason)
