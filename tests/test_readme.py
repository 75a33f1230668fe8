"""The README's examples run as printed, and its links lead somewhere."""

from __future__ import annotations

import re

import pytest

from documents import ROOT, beside_examples, blocks, commands, run_commands

pytestmark = pytest.mark.usefixtures("coarse_meshes")

README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path):
    return beside_examples(tmp_path)


def test_python_example(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    (example,) = blocks(README, "python")
    assert len(example.content.splitlines()) <= 12
    exec(compile(example.content, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "knee of the I-V curve: tip at 900 K" in printed
    # each with the error in its last digits
    assert len(re.findall(r"^\w+ +\d[\d.]*\([\d.]+\)", printed, re.MULTILINE)) == 6


def test_command_line_example(run, folder):
    (example,) = blocks(README, "sh")
    assert 0 < len(commands(example.content)) == len(example.content.splitlines()) <= 10
    run_commands(example.content, run)
    names = {path.name for path in folder.iterdir()}
    assert {"probe.toml", "probe.png", "sweep.csv", "one.nc", "fields", "fit.json"} <= names


def test_make_targets_and_links_exist():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:`|^)make ([a-z-]+)", README, flags=re.MULTILINE):
        assert f"\n{target}:" in makefile
    for link in re.findall(r"\]\((?!http)([^)]+)\)", README):
        assert (ROOT / link).exists(), link


def test_every_benchmark_is_listed():
    folder = ROOT / "benchmarks"
    page = (folder / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\|([^|]+)", page, flags=re.MULTILINE)
    listed = {script for row in rows for script in re.findall(r"`(\w+\.py)", row)}
    scripts = {path.name for path in folder.glob("*.py") if "__main__" in path.read_text()}
    assert listed == scripts


def test_examples_are_one_real_folder_named_by_its_path():
    """Links of a repository are small text files in many a clone on Windows."""
    folders = [ROOT / name for name in ("benchmarks", "docs", "src", "tests", "tools")]
    inside = [path for folder in folders for path in folder.rglob("*")]
    assert [path for path in (*ROOT.iterdir(), *inside) if path.is_symlink()] == []
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    named = {
        name.rstrip(".")
        for page in pages
        for name in re.findall(r"src/hotlever/examples[\w./-]*", page.read_text(encoding="utf-8"))
    }
    assert len(named) > 20
    assert {name for name in named if not (ROOT / name).exists()} == set()
    # no page names a folder of examples that is not there
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert re.findall(r"(?:^|[ `])examples/[\w-]+\.(?:csv|gds|dxf|toml)", text) == [], page
