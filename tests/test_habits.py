"""What contributors and those who cite the package read: it names what there is."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from pathlib import Path

import hotlever

ROOT = Path(__file__).parents[1]


def read(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_files_that_contributors_are_led_to_exist():
    text = read("CONTRIBUTING.md")
    named = re.findall(r"`((?:src|tests|docs)/[\w/.]+|\w+\.lock|CHANGELOG\.md)`", text)
    assert len(named) >= 12
    assert [name for name in named if not (ROOT / name).exists()] == []
    packages = re.findall(r"`(\w+)/`", text.partition("| --- |")[2].partition("\n\n")[0])
    there = {path.parent.name for path in (ROOT / "src" / "hotlever").glob("*/__init__.py")}
    assert set(packages) == there - {"examples"}


def test_commands_that_contributors_are_told_are_targets_of_make():
    targets = set(re.findall(r"^([\w-]+):", read("Makefile"), re.MULTILINE))
    documented = set(re.findall(r"\bmake\s+(env|test[\w-]*)", read("CONTRIBUTING.md")))
    assert documented == {"env", "test", "test-slow", "test-app", "test-hostile", "test-pythons"}
    assert documented <= targets


def test_hooks_run_what_make_test_checks_before_the_tests():
    recipe = read("Makefile").partition("\ntest: env\n")[2].partition("\n\n")[0]
    before = [line.strip().replace("$(BIN)", ".venv/bin") for line in recipe.splitlines()]
    checks = [line for line in before if "pytest" not in line]
    hooks = re.findall(r"entry: (.+)", read(".pre-commit-config.yaml"))
    assert hooks == checks
    assert set(re.findall(r"repo: (\S+)", read(".pre-commit-config.yaml"))) == {"local"}


def test_the_citation_is_of_this_version_and_licence():
    project = tomllib.loads(read("pyproject.toml"))["project"]
    citation = dict(
        re.findall(
            r"^(version|date-released|license|title|abstract): (.+)$", read("CITATION.cff"), re.M
        )
    )
    assert citation["version"] == hotlever.__version__
    released = f"## {hotlever.__version__} ({citation['date-released']})"
    # what comes next stands above the last release
    headings = re.findall(r"^## .+", read("CHANGELOG.md"), re.M)
    assert next(heading for heading in headings if heading != "## Unreleased") == released
    assert citation["license"] == project["license"]
    assert citation["title"] == project["name"]
    assert citation["abstract"] == project["description"]


def test_names_of_modules_and_classes_are_unique():
    """Who looks for one finds one."""
    package = ROOT / "src" / "hotlever"
    files = [path for path in package.rglob("*.py") if "examples" not in path.parts]
    modules = Counter(path.stem for path in files if not path.stem.startswith("__"))
    classes = Counter(
        node.name
        for path in files
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    )
    assert [name for name, count in (modules + classes).items() if count > 1] == []
