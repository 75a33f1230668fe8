"""The README's examples run as printed, and its links lead somewhere."""

from __future__ import annotations

import re

import pytest

from documents import ROOT, blocks, commands, run_commands

README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def beside_examples(tmp_path):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    return tmp_path


def test_python_example(beside_examples, monkeypatch, capsys):
    monkeypatch.chdir(beside_examples)
    (example,) = blocks(README, "python")
    assert len(example.content.splitlines()) <= 12
    exec(compile(example.content, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "knee of the I-V curve: tip at 900 K" in printed
    assert printed.count("±") == 6


def test_command_line_example(run, beside_examples):
    (example,) = blocks(README, "sh")
    assert 0 < len(commands(example.content)) == len(example.content.splitlines()) <= 10
    run_commands(example.content, run)
    made = {path.name for path in beside_examples.iterdir()}
    assert {"probe.toml", "probe.png", "sweep.csv", "one.nc", "fields", "fit.json"} <= made


def test_make_targets_and_links_exist():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:`|^)make ([a-z-]+)", README, flags=re.MULTILINE):
        assert f"\n{target}:" in makefile
    for link in re.findall(r"\]\((?!http)([^)]+)\)", README):
        assert (ROOT / link).exists(), link


def test_every_benchmark_is_listed():
    folder = ROOT / "benchmarks"
    listed = set(re.findall(r"`(\w+\.py)`", (folder / "README.md").read_text(encoding="utf-8")))
    scripts = {path.name for path in folder.glob("*.py") if "__main__" in path.read_text()}
    assert listed == scripts
