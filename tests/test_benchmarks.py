"""Benchmarks are run by hand; what they take from elsewhere must be there all the same."""

from __future__ import annotations

import ast
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from documents import ROOT

SCRIPTS = sorted((ROOT / "benchmarks").glob("*.py"))
_OWN = {path.stem for path in SCRIPTS}


def defined(path: Path) -> set[str]:
    """Return the names that a module defines or takes from others."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif isinstance(node, ast.ImportFrom):
            found |= {one.asname or one.name for one in node.names}
    return found


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_what_it_imports_is_there(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or node.module is None:
            continue
        names = {one.name for one in node.names}
        if node.module in _OWN:
            assert names <= defined(path.with_name(f"{node.module}.py")), node.module
        elif node.module.startswith("hotlever"):
            module = import_module(node.module)
            # a module of a package is an attribute of it once something has imported it
            missing = {
                name
                for name in names
                if not hasattr(module, name) and find_spec(f"{node.module}.{name}") is None
            }
            assert not missing, node.module
