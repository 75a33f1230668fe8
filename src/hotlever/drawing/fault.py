"""What is wrong with a drawing, and where."""

from __future__ import annotations

from collections.abc import Mapping

from hotlever.errors import InputError
from hotlever.probe.layout import Point

# A polygon, or a line of two points.
Ring = tuple[Point, ...]


class DrawingError(InputError):
    """A drawing is at fault.

    Attributes
    ----------
    what : str
    part : str
        What is drawn wrongly: ``silicon``, ``heater``, a terminal, ...
    polygon : int or None
        Its number among those of the part, from 1.
    place : tuple of float or None
        Where (µm).
    outlines : mapping of str to rings
        All that is drawn, by part.
    """

    def __init__(
        self,
        what: str,
        part: str,
        polygon: int | None = None,
        place: Point | None = None,
        *,
        outlines: Mapping[str, tuple[Ring, ...]] | None = None,
        where: str = "",
        drawn: str | None = None,
    ) -> None:
        self.what, self.part, self.polygon, self.place = what, part, polygon, place
        self.outlines = dict(outlines or {})
        words = [part if drawn is None else f"{part} (layer {drawn})"]
        if polygon is not None:
            words.append(f"polygon {polygon}")
        if place is not None:
            words.append(f"at ({place[0]:.3f}, {place[1]:.3f}) µm")
        start = f"{where}: " if where else ""
        super().__init__(f"{start}{', '.join(words)}: {what}")

    def drawn_at(self, scale: float) -> DrawingError:
        """Return the same with its place on the drawing, of which the lever is `scale` times."""
        place = None if self.place is None else (self.place[0] / scale, self.place[1] / scale)
        return DrawingError(self.what, self.part, self.polygon, place)

    def of_file(
        self, where: str, drawn: Mapping[str, str], outlines: Mapping[str, tuple[Ring, ...]]
    ) -> DrawingError:
        """Return the same with the file's name, the layers' names and all that is drawn."""
        layer = drawn.get(self.part)
        return DrawingError(
            self.what,
            self.part,
            self.polygon,
            self.place,
            outlines=outlines,
            where=where,
            drawn=layer,
        )
