"""Reads a GDSII, OASIS or DXF file into plain lists, in a process of its own.

The libraries that read these files take damaged ones for valid memory, and deep arrays for short
work; a process that is started for one file can fail or be stopped. So this module is run as a
script (see `hotlever.probe.drawing.sheet`), imports nothing of hotlever, and prints JSON: the
sheet, or an error in one line.
"""

from __future__ import annotations

import io
import json
import sys
from collections import Counter
from typing import Any

#: Polygons, and corners in all, beyond which a file holds more than one lever.
MOST_POLYGONS, MOST_CORNERS = 20_000, 200_000
#: How deep blocks of a DXF file may be nested.
_DEEPEST = 20

Ring = list[tuple[float, float]]


class Refusal(Exception):
    """What is wrong with the file, in one line."""


def kind_of(content: bytes) -> str:
    """Return what a file is, by its first bytes."""
    if content[2:4] == b"\x00\x02":
        return "GDSII"
    if content.startswith(b"%SEMI-OASIS"):
        return "OASIS"
    if content.startswith(b"AutoCAD Binary DXF") or b"SECTION" in content[:4096]:
        return "DXF"
    raise Refusal("no GDSII, OASIS or DXF file")


# --- GDSII and OASIS ----------------------------------------------------------------------------


def read_stream(path: str, kind: str, cell: str | None, unit_um: float | None) -> dict[str, Any]:
    """Return what a cell of a GDSII or OASIS file holds, in µm."""
    import gdstk

    # OASIS files know no unit but the µm
    stated_um = 1e6 * gdstk.gds_units(path)[0] if kind == "GDSII" else 1.0
    scale = 1.0 if unit_um is None else unit_um / stated_um
    library = (gdstk.read_gds if kind == "GDSII" else gdstk.read_oas)(path, unit=1e-6)
    cells: dict[str, Any] = {each.name: each for each in library.cells}
    top = [each.name for each in library.top_level()]
    sheet: dict[str, Any] = {"kind": kind, "cells": sorted(cells), "top": sorted(top)}
    sheet["unit_um"] = unit_um or stated_um
    counts: dict[str, int] = {}
    for each in library.cells:
        _count(each, counts, ())
    if cell is None and len(top) == 1:
        cell = top[0]
    if cell is None or cell not in cells:
        return sheet | {"cell": cell, "layers": {}, "labels": []}
    if counts[cell] > MOST_POLYGONS:
        raise Refusal(
            f"cell '{cell}' holds {counts[cell]} polygons, expected at most {MOST_POLYGONS}: "
            "name the cell of one lever"
        )
    layers: dict[str, dict[str, list[Ring]]] = {}
    for polygon in cells[cell].get_polygons():
        name = f"{polygon.layer}/{polygon.datatype}"
        layers.setdefault(name, {"rings": [], "lines": []})["rings"].append(
            (scale * polygon.points).tolist()
        )
    labels = [
        (f"{label.layer}/{label.texttype}", label.text, *(scale * at for at in label.origin))
        for label in cells[cell].get_labels()
    ]
    return sheet | {"cell": cell, "layers": layers, "labels": labels[:1000]}


def _count(cell: Any, counts: dict[str, int], above: tuple[str, ...]) -> int:
    """Return how many polygons a cell has with all that it refers to."""
    if cell.name in above:
        raise Refusal(f"cell '{cell.name}' refers to itself")
    if cell.name not in counts:
        polygons = len(cell.polygons) + len(cell.paths)
        for reference in cell.references:
            inner = reference.cell
            if isinstance(inner, str):
                raise Refusal(f"cell '{cell.name}' refers to '{inner}', which is not there")
            times = max(1, reference.repetition.size or 1)
            polygons += times * _count(inner, counts, (*above, cell.name))
        counts[cell.name] = polygons
    return counts[cell.name]


# --- DXF ----------------------------------------------------------------------------------------


def read_dxf(
    file: str, content: bytes, unit_um: float | None, tolerance_um: float
) -> dict[str, Any]:
    """Return what the model space of a DXF file holds, in µm; curves become short lines."""
    import ezdxf
    from ezdxf import path, recover, units
    from ezdxf.enums import InsertUnits

    try:
        if content.startswith(b"AutoCAD Binary DXF"):
            document = ezdxf.readfile(file)
        else:
            document, _ = recover.read(io.BytesIO(content))
    except ezdxf.DXFError as error:
        raise Refusal(f"a damaged DXF file ({error})") from None
    stated = unit_um is not None or document.units != 0
    if unit_um is None:
        # a file that says no unit is taken to be in µm
        unit = InsertUnits(document.units or InsertUnits.Microns)
        unit_um = units.conversion_factor(unit, InsertUnits.Microns)
    layers: dict[str, dict[str, list[Ring]]] = {}
    labels, left_out, corners = [], Counter[str](), 0

    def take(entity: Any, name: str) -> None:
        nonlocal corners
        if entity.dxftype() in ("TEXT", "MTEXT"):
            text = entity.dxf.text if entity.dxftype() == "TEXT" else entity.plain_text()
            x, y, _ = entity.dxf.insert
            labels.append((name, text, x * unit_um, y * unit_um))
            return
        try:
            outline = path.make_path(entity)
        except TypeError:
            left_out[entity.dxftype()] += 1
            return
        for piece in outline.sub_paths() if outline.has_sub_paths else [outline]:
            points = [
                (point.x * unit_um, point.y * unit_um)
                for point in piece.flattening(tolerance_um / unit_um)
            ]
            if len(points) > 1 and points[0] == points[-1]:
                points.pop()
            corners += len(points)
            if corners > MOST_CORNERS:
                raise Refusal(f"holds more than {MOST_CORNERS} corners, expected one lever")
            layer = layers.setdefault(name, {"rings": [], "lines": []})
            closed = len(points) > 2 and (piece.is_closed or _is_area(entity))
            layer["rings" if closed else "lines"].append(points)

    def walk(entities: Any, above: str | None, depth: int) -> None:
        for entity in entities:
            own = entity.dxf.get("layer", "0")
            # in a block, layer 0 means that of the reference
            name = above if above is not None and own == "0" else own
            if entity.dxftype() != "INSERT":
                take(entity, name)
                continue
            if depth >= _DEEPEST:
                raise Refusal(f"blocks are nested more than {_DEEPEST} deep")
            if entity.mcount > MOST_POLYGONS:
                raise Refusal(f"an array of {entity.mcount} blocks, expected one lever")
            for single in entity.multi_insert():
                walk(single.virtual_entities(), name, depth + 1)

    walk(document.modelspace(), None, 0)
    return {
        "kind": "DXF",
        "cells": [],
        "top": [],
        "cell": None,
        "layers": layers,
        "labels": labels[:1000],
        "unit_um": unit_um,
        "unit_stated": stated,
        "left_out": dict(left_out),
    }


def _is_area(entity: Any) -> bool:
    return entity.dxftype() in ("HATCH", "MPOLYGON", "SOLID", "TRACE", "3DFACE")


def main() -> None:
    """Read the file named on the command line; options are JSON in the second argument."""
    path, options = sys.argv[1], json.loads(sys.argv[2])
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (options["memory"], options["memory"]))
    except (ImportError, ValueError, OSError):
        pass
    try:
        with open(path, "rb") as file:
            content = file.read()
        kind = kind_of(content)
        if kind == "DXF":
            sheet = read_dxf(path, content, options["unit_um"], options["tolerance_um"])
        else:
            sheet = read_stream(path, kind, options["cell"], options["unit_um"])
    except Refusal as error:
        sheet = {"error": str(error)}
    except Exception as error:
        # what these libraries raise for damaged files has no end
        sheet = {"error": f"a damaged file ({type(error).__name__}: {error})"}
    print(json.dumps(sheet))


if __name__ == "__main__":
    main()
