"""Formulas as SVG in the page itself, drawn by ziamath: no script, font or network is needed."""

from __future__ import annotations

import html
from typing import Any

import ziamath
from docutils import nodes
from sphinx.errors import ExtensionError
from sphinx.util.math import get_node_equation_number

#: Height of the letters in pixels, as the text of the pages has.
_SIZE = 16

ziamath.config.svg2 = False  # paths with their own colour, which every browser draws


def drawn(latex: str, *, inline: bool) -> str:
    """Return a formula as an SVG element that stands on the line of the text.

    Raises
    ------
    ExtensionError
        If the formula cannot be drawn; Sphinx then stops.
    """
    try:
        formula = ziamath.Latex(latex, size=_SIZE, color="currentColor", inline=inline)
        picture = formula.svg()
    except Exception as error:  # ziamath raises errors of many types
        raise ExtensionError(f"formula {latex!r}: {error}") from error
    label = html.escape(latex, quote=True)
    style = f"vertical-align: {formula.getyofst():.2f}px"
    return picture.replace("<svg ", f'<svg role="img" aria-label="{label}" style="{style}" ', 1)


def visit_math(translator: Any, node: nodes.math) -> None:
    """Write a formula in the text."""
    translator.body.append(f'<span class="math">{drawn(node.astext(), inline=True)}</span>')
    raise nodes.SkipNode


def visit_math_block(translator: Any, node: nodes.math_block) -> None:
    """Write a formula in its own line, with its number if it has a label."""
    number = ""
    if node["number"]:
        number = get_node_equation_number(translator, node)
        number = f'<span class="eqno">({html.escape(number)})</span>'
    name = f' id="{node["ids"][0]}"' if node["ids"] else ""
    formula = drawn(node.astext(), inline=False)
    translator.body.append(f'<div class="math"{name}>{number}{formula}</div>\n')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Register as Sphinx's writer of formulas."""
    app.add_html_math_renderer("svg", (visit_math, None), (visit_math_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
