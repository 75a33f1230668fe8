"""The pages in `docs/`: their examples run, and what they name exists."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from contextlib import nullcontext
from importlib import import_module
from math import isclose
from pathlib import Path

import pytest

from documents import (
    EXAMPLES,
    ROOT,
    beside_examples,
    blocks,
    commands,
    missing_lines,
    run_commands,
    without_blocks,
)
from experiments import on_coarse_meshes
from hotlever.app import open_app
from hotlever.tasks.commands import COMMANDS, command_line

COMMAND_LINE = command_line(lambda *_: 0, {**COMMANDS, "app": open_app})
DOCS = ROOT / "docs"
PAGES = {
    path.relative_to(DOCS).with_suffix("").as_posix(): path.read_text(encoding="utf-8")
    for path in sorted(DOCS.rglob("*.md"))
    if "_build" not in path.parts
}
#: Pages whose examples take minutes.
SLOW = {
    *("how-to/calibrate", "how-to/design", "how-to/fit", "how-to/levers", "how-to/uncertainty"),
    *("how-to/unknown-lever", "how-to/draw-in-python", "how-to/melting-points"),
    *("how-to/next-measurement", "how-to/pulses", "how-to/wire-the-lever"),
    *("examples/reference-probe", "examples/boron-lever", "examples/palladium-on-nitride"),
}
#: Modules whose numbers the theory page states.
LAWS = (
    "spieser2017.py",
    "materials",
    "probe/tip.py",
    "lever/reduced_lever.py",
    "estimate",
)

with_examples = [
    pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else [])
    for name, text in PAGES.items()
    if blocks(text, "sh", "python")
]
each_page = pytest.mark.parametrize("name", PAGES)


@pytest.mark.parametrize("name", with_examples)
def test_examples_run_and_print_what_the_page_shows(name, run, tmp_path, capsys):
    beside_examples(tmp_path)
    names = {}
    # what the others show holds on coarse meshes too
    with nullcontext() if name in SLOW else on_coarse_meshes():
        for block in blocks(PAGES[name], "sh", "python"):
            if block.language == "sh":
                printed = run_commands(block.content, run)
            else:
                exec(compile(block.content, name, "exec"), names)
                printed = capsys.readouterr().out
            if block.output is not None:
                assert missing_lines(block.output, printed) == [], printed


def test_a_line_that_was_not_printed_is_noticed():
    assert missing_lines("knee at 900(3) K\n2 mW\n", "so\nknee at 901(2) K\n2 mW\n") == []
    assert missing_lines("knee at 900 K\n", "knee at 950 K\n") == ["knee at 900 K"]
    assert missing_lines("b 1\na 1\n", "a 1\nb 1\n") == ["a 1"]


def test_the_head_of_the_data_file_is_shown_as_it_is():
    heads = [b.content for b in blocks(PAGES["tutorial"], "text") if b.content.startswith("#")]
    assert len(heads) == 1
    assert heads[0] in (EXAMPLES / "lever-a.csv").read_text(encoding="utf-8")


def found_command(words):
    """The command that words name, and the words behind its name."""
    command = COMMAND_LINE
    while hasattr(command, "commands") and words and re.fullmatch(r"[a-z-]+", words[0]):
        name, *words = words
        assert name in command.commands, f"no command {name!r}"
        command = command.commands[name]
    return command, words


def options_of(command):
    own = {name for p in command.params for name in (*p.opts, *p.secondary_opts)}
    return own.union(
        {"--help"}, *(options_of(c) for c in getattr(command, "commands", {}).values())
    )


@pytest.mark.parametrize("name", [*PAGES, "README"])
def test_commands_and_options_exist(name):
    text = PAGES.get(name) or (ROOT / "README.md").read_text(encoding="utf-8")
    for block in blocks(text, "sh", "console", ""):
        for _, (_, *words) in commands(block.content):
            command, rest = found_command(words)
            used = {word for word in rest if re.match(r"--?[a-zA-Z]", word)}
            assert used <= options_of(command), words
    known = options_of(COMMAND_LINE)
    for code in re.findall(r"`([^`\n]+)`", without_blocks(text)):
        if code.startswith("hotlever "):
            found_command(code.split()[1:])
        elif code.startswith("--"):
            assert code.split()[0] in known, code


@each_page
def test_names_of_the_package_exist(name):
    for dotted in set(re.findall(r"`(hotlever(?:\.\w+)+)`", without_blocks(PAGES[name]))):
        *parents, last = dotted.split(".")
        try:
            import_module(dotted)
        except ModuleNotFoundError:
            assert hasattr(import_module(".".join(parents)), last), dotted


@each_page
def test_links_and_listed_pages_exist(name):
    folder = (DOCS / name).parent
    for link in re.findall(r"\]\((?!http)([^)#]+)", PAGES[name]):
        assert (folder / link).exists(), link
    for script in re.findall(r"(benchmarks/[\w/.]+\.\w+)", PAGES[name]):
        assert (ROOT / script).exists(), script


def test_every_page_is_in_a_table_of_contents():
    listed = {"index"}
    for name, text in PAGES.items():
        for block in blocks(text, "{toctree}"):
            entries = (line for line in block.content.split("\n") if line and line[0] != ":")
            listed |= {(Path(name).parent / entry).as_posix() for entry in entries}
    assert listed == set(PAGES)


def test_numbers_in_the_equations_are_those_of_the_code():
    known = {2.0, 3.0, 4.0, 8.0, 1e-12}  # of the mathematics, and the paper's diffusivity
    for place in LAWS:
        path = ROOT / "src" / "hotlever" / place
        for source in path.rglob("*.py") if path.is_dir() else [path]:
            for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
                    known.add(float(node.value))
    theory = without_blocks(PAGES["theory"])
    formulas = re.findall(r"\$\$(.+?)\$\$|\$(.+?)\$", theory, flags=re.DOTALL)
    stated = set()
    for formula in (
        re.sub(r"\^\{?[-−]?[\d/]+\}?(?=[^}])|_\{?\w+\}?", "", f) for f in _plain(formulas)
    ):
        stated |= {float(number) for number in re.findall(r"\d+(?:\.\d+)?(?:e-?\d+)?", formula)}
    assert len(stated) > 25
    assert not [x for x in stated if not any(isclose(x, y, rel_tol=1e-9) for y in known)]


def _plain(formulas):
    """Formulas with powers of ten as Python writes them."""
    for formula in map("".join, formulas):
        joined = re.sub(r"\\times10\^\{([-\d]+)\}", r"e\1", formula)
        yield re.sub(r"(?<![\d.])10\^\{([-\d]+)\}", r"1e\1", joined)


@pytest.mark.slow
def test_site_builds_without_warnings(tmp_path):
    pytest.importorskip("ziamath")
    build = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-n",
        "docs",
        str(tmp_path),
    ]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    pages = list(tmp_path.rglob("*.html"))
    assert len(pages) > len(PAGES)
    for page in pages:
        loaded = re.findall(
            r'<(?:script|img|link)[^>]+(?:src|href)="(https?:[^"]+)', page.read_text()
        )
        assert loaded == [], page
