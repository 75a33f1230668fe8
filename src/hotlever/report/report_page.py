"""A report page: text, tables and figures in one self-contained HTML file.

Paragraphs and captions stand by their names in ``texts.toml``. Braces of a text name what is found
as the page is made, or numbers of `hotlever.spieser2017`, as ``{paper.SHIFT_NM:.0f}``; these may be
parts of an object, as ``{factor.best_k:.2f}``.
"""

from __future__ import annotations

import base64
import html
import io
import os
import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from matplotlib.figure import Figure

from hotlever import __version__
from hotlever import spieser2017 as paper
from hotlever.figures import save_figure
from hotlever.files import output_folder, write_text
from hotlever.materials.parameters import sentence

# A part of a page: its ``kind``, and what that has.
Block = dict[str, Any]


class Html(str):
    """Text that is HTML, which is not escaped once more."""


def _escaped(text: str) -> str:
    return text if isinstance(text, Html) else html.escape(str(text))


def element(name: str, *inside: str, **attributes: str) -> Html:
    """Return an element of a page: texts inside it are escaped, elements are not.

    Attributes that are empty are left out.

    Examples
    --------
    >>> element("p", "1 < 2, see ", element("a", "here", href="#here"), class_="")
    '<p>1 &lt; 2, see <a href="#here">here</a></p>'
    """
    stated = ((key.rstrip("_").replace("_", "-"), value) for key, value in attributes.items())
    written = "".join(f' {key}="{html.escape(value)}"' for key, value in stated if value)
    if name == "img":  # which has no inside, and so no end
        return Html(f"<img{written}>")
    return Html(f"<{name}{written}>{''.join(map(_escaped, inside))}</{name}>")


def _with_links(text: str) -> Html:
    """Return a text whose DOIs and other pages are links."""
    link = r'<a href="https://doi.org/\1">doi:\1</a>'
    linked = re.sub(r"doi:(10\.\d{4,9}/[^\s,;]*[^\s,;.])", link, _escaped(text))
    return Html(re.sub(r"\b(\w+\.html)\b", r'<a href="\1">\1</a>', linked))


@cache
def texts() -> dict[str, Any]:
    """Return the words of pages by name: captions of figures and tables, paragraphs, claims."""
    path = files("hotlever") / "report" / "texts.toml"
    return tomllib.loads(path.read_text(encoding="utf-8"))


def filled(text: str, /, **numbers: Any) -> str:
    """Return a text with what was found, and what the paper has, in its braces."""
    return text.format(paper=paper, **numbers)


@dataclass
class Page:
    """A page that is filled from top to bottom and then written.

    Attributes
    ----------
    title, summary : str
    one_sheet : bool
        Whether it is printed on one sheet of A4, in small letters.
    blocks : list of dict
    """

    title: str
    summary: str = ""
    one_sheet: bool = False
    blocks: list[Block] = field(default_factory=list)

    def _add(self, kind: str, **block: Any) -> None:
        self.blocks.append({"kind": kind, **block})

    def heading(self, text: str) -> None:
        """Start a section, to which links lead by its anchor."""
        anchor = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
        self._add("heading", text=text, anchor=anchor)

    def linked(self, text: str) -> Html:
        """Return a cell of a table that leads to the section being filled."""
        anchors = [block["anchor"] for block in self.blocks if block["kind"] == "heading"]
        return element("a", text, href=f"#{anchors[-1] if anchors else ''}")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._add("text", text=text)

    def say(self, name: str, /, **numbers: Any) -> None:
        """Add the paragraph of a name."""
        self.text(filled(texts()["paragraphs"][name], **numbers))

    def sentences(self, *texts: str) -> None:
        """Add paragraphs of words, each made a sentence."""
        for text in texts:
            self.text(sentence(text))

    def table(
        self,
        columns: Sequence[str],
        rows: Sequence[Sequence[str]],
        caption: str = "",
        *,
        prose: bool = False,
    ) -> None:
        """Add a table of strings; one of sentences is set flush left."""
        self._add("table", columns=columns, rows=rows, caption=caption, prose=prose)

    def tabulate(
        self,
        name: str,
        columns: Sequence[str],
        rows: Sequence[Sequence[str]],
        /,
        *,
        prose: bool = False,
        **numbers: Any,
    ) -> None:
        """Add a table with the caption of its name."""
        self.table(columns, rows, filled(texts()["tables"][name], **numbers), prose=prose)

    def figure(self, name: str, figure: Figure, caption: str) -> None:
        """Add a figure; `name` is its file name without suffix."""
        self._add("figure", name=name, figure=figure, caption=caption)

    def draw(self, name: str, figure: Figure, /, file: str = "", **numbers: Any) -> None:
        """Add a figure with the caption of its name, which is that of its file by default."""
        self.figure(file or name, figure, filled(texts()["figures"][name], **numbers))

    def write(self, folder: str | os.PathLike[str], name: str = "index") -> Path:
        """Write the page, and each figure as PDF beside it; return the page's path.

        Raises
        ------
        InputError
            If the folder cannot be made or written.
        """
        target = output_folder(folder)
        path = target / f"{name}.html"
        write_text(path, self.html(target))
        return path

    def html(self, figures: Path | None = None) -> str:
        """Return the text of the page; figures are written as PDF to a folder, if one is given."""
        if figures is not None:
            for block in self.blocks:
                if block["kind"] == "figure":
                    save_figure(block["figure"], figures / f"{block['name']}.pdf")
        frame = files("hotlever") / "report" / "page.html"
        return Template(frame.read_text(encoding="utf-8")).substitute(
            title=html.escape(self.title),
            kind="one-sheet" if self.one_sheet else "",
            body="\n".join(self._elements()),
            version=__version__,
        )

    def _elements(self, contents_from: int = 5) -> Iterator[Html]:
        """Give what the page shows; a table of contents above so many sections or more."""
        yield element("h1", self.title)
        if self.summary:
            yield element("p", _with_links(self.summary))
        headings = [block for block in self.blocks if block["kind"] == "heading"]
        if len(headings) >= contents_from:
            entries = (element("a", each["text"], href=f"#{each['anchor']}") for each in headings)
            yield element(
                "nav",
                element("ol", *(element("li", entry) for entry in entries)),
                aria_label="contents",
            )
        for block in self.blocks:
            if block["kind"] == "heading":
                yield element("h2", block["text"], id=block["anchor"])
            elif block["kind"] == "text":
                yield element("p", _with_links(block["text"]))
            elif block["kind"] == "table":
                yield _table(block["columns"], block["rows"], block["caption"], block["prose"])
            else:
                yield _figure(block["figure"], block["caption"])


def _table(
    columns: Sequence[str], rows: Sequence[Sequence[str]], caption: str, prose: bool
) -> Html:
    """Return a table; in one of sentences a cell is marked by how it begins, if on a claim."""
    marks = {"holds for some": "some", "holds": "holds", "met, ": "holds"}
    marks |= {"does not hold": "fails", "off, ": "fails"}

    def mark(cell: str) -> str:
        return next((marks[begin] for begin in marks if prose and cell.startswith(begin)), "")

    body = (
        element("tr", *(element("td", cell, class_=mark(cell)) for cell in cells)) for cells in rows
    )
    return element(
        "table",
        *([element("caption", caption)] if caption else []),
        element("thead", element("tr", *(element("th", cell) for cell in columns))),
        element("tbody", *body),
        class_="prose" if prose else "",
    )


def _figure(figure: Figure, caption: str) -> Html:
    """Return a figure in the page itself, as wide as it is drawn for print and a little more."""
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=160)
    source = f"data:image/png;base64,{base64.b64encode(image.getvalue()).decode('ascii')}"
    width = f"width: {round(108 * figure.get_figwidth())}px"
    return element(
        "figure",
        element("img", src=source, alt=caption, style=width),
        element("figcaption", caption),
    )
