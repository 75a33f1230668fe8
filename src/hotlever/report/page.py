"""A report page: text, tables and figures in one self-contained HTML file."""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
from matplotlib.figure import Figure

from hotlever import __version__
from hotlever.files import output_folder, write_text
from hotlever.report.style import save_figure


@dataclass
class Page:
    """A page that is filled from top to bottom and then written.

    Parameters
    ----------
    title, summary : str
    """

    title: str
    summary: str = ""
    blocks: list[dict[str, Any]] = field(default_factory=list)

    def heading(self, text: str) -> None:
        """Start a section."""
        self.blocks.append({"kind": "heading", "text": text})

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self.blocks.append({"kind": "text", "text": text})

    def table(
        self,
        columns: Sequence[str],
        rows: Sequence[Sequence[str]],
        caption: str = "",
        *,
        prose: bool = False,
    ) -> None:
        """Add a table of strings; one of sentences is set flush left."""
        self.blocks.append(
            {
                "kind": "table",
                "columns": columns,
                "rows": rows,
                "caption": caption,
                "prose": prose,
            }
        )

    def figure(self, name: str, made: Figure, caption: str) -> None:
        """Add a figure; `name` is its file name without suffix."""
        self.blocks.append({"kind": "figure", "name": name, "figure": made, "caption": caption})

    def write(self, folder: str | os.PathLike[str], name: str = "index.html") -> Path:
        """Write the page, and each figure as PDF beside it; return the page's path.

        Raises
        ------
        InputError
            If the folder cannot be made or written.
        """
        target = output_folder(folder)
        blocks = []
        for block in self.blocks:
            if block["kind"] == "figure":
                save_figure(block["figure"], target / f"{block['name']}.pdf")
                block = {**block, "image": _png(block["figure"])}
            blocks.append(block)
        environment = jinja2.Environment(
            loader=jinja2.PackageLoader("hotlever", "report"),
            autoescape=True,
            undefined=jinja2.StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        html = environment.get_template("page.html.j2").render(
            title=self.title, summary=self.summary, blocks=blocks, version=__version__
        )
        write_text(target / name, html)
        return target / name


def _png(made: Figure) -> str:
    """Return a figure as base64 PNG."""
    buffer = io.BytesIO()
    made.savefig(buffer, format="png", dpi=160)
    return base64.b64encode(buffer.getvalue()).decode("ascii")
