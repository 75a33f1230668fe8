"""The README's examples run as printed, and its links lead somewhere."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


@pytest.fixture
def beside_examples(tmp_path):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    return tmp_path


def test_python_example(beside_examples, monkeypatch, capsys):
    monkeypatch.chdir(beside_examples)
    (example,) = blocks("python")
    assert len(example.splitlines()) <= 12
    exec(compile(example, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "knee of the I-V curve: tip at 900 K" in printed
    assert printed.count("±") == 6


def test_command_line_example(run, beside_examples):
    (example,) = blocks("sh")
    commands = example.strip().splitlines()
    assert len(commands) <= 10
    for command in commands:
        name, *arguments = shlex.split(command)
        assert name == "hotlever"
        status, _, err = run(*arguments)
        assert status == 0, (command, err)
    made = {path.name for path in beside_examples.iterdir()}
    assert {"probe.toml", "probe.png", "sweep.csv", "one.nc", "fields", "fit.json"} <= made


def test_make_targets_and_links_exist():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"`?make ([a-z-]+)", README):
        assert f"\n{target}:" in makefile
    for link in re.findall(r"\]\((?!http)([^)]+)\)", README):
        assert (ROOT / link).exists(), link
    for script in re.findall(r"(benchmarks/[\w/.]+)", README):
        assert (ROOT / script).exists(), script
