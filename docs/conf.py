"""How Sphinx builds these pages: `make docs`."""

from __future__ import annotations

import pydoc
import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import hotlever

project = "hotlever"
version = release = hotlever.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "mathsvg",
]
exclude_patterns = ["_build"]

# --- pages in Markdown -----------------------------------------------------------------------
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

# --- API reference -----------------------------------------------------------------------------
default_role = "autolink"
autodoc_typehints = "none"  # the docstrings say them
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config"}
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# --- HTML: everything is in the folder, nothing is loaded from elsewhere ----------------------
html_theme = "furo"
html_title = f"hotlever {version}"
html_static_path = ["_static"]
html_css_files = ["math.css", "pages.css"]
html_math_renderer = "svg"
html_copy_source = False
html_show_copyright = False


def by_last_name(app: Any, env: Any, node: Any, contents: Any) -> Any:
    """Find what is meant by a name without its module, or by one of another that offers it too."""
    domain, target = env.domains["py"], node.get("reftarget", "")
    full = [name for name in domain.objects if name.endswith(f".{target}")]
    if not full and target.startswith("hotlever."):
        meant = pydoc.locate(target)
        defined = f"{getattr(meant, '__module__', '')}.{getattr(meant, '__qualname__', '')}"
        full = [defined] if defined in domain.objects else []
    if node.get("refdomain") != "py" or len(full) != 1:
        return None
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", full[0], node, contents)


def link_names(app: Any, page: nodes.document) -> None:
    """Make every name of the package that stands in the text a link into the API reference."""
    for name in list(page.findall(nodes.literal)):
        dotted = name.astext()
        linked = isinstance(name.parent, nodes.title | nodes.reference | addnodes.pending_xref)
        if not linked and re.fullmatch(r"hotlever(\.\w+)+", dotted):
            link = addnodes.pending_xref(
                "",
                name.deepcopy(),
                refdomain="py",
                reftype="obj",
                reftarget=dotted,
                refdoc=app.env.docname,
                refwarn=True,
            )
            name.replace_self(link)


def setup(app: Any) -> None:
    """Connect to Sphinx."""
    app.connect("doctree-read", link_names)
    app.connect("missing-reference", by_last_name)
