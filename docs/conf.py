"""How Sphinx builds these pages: `make docs`."""

from __future__ import annotations

import sys
from pathlib import Path

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
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# --- HTML: everything is in the folder, nothing is loaded from elsewhere ----------------------
html_theme = "furo"
html_title = f"hotlever {version}"
html_static_path = ["_static"]
html_css_files = ["math.css"]
html_math_renderer = "svg"
html_copy_source = False
html_show_copyright = False
