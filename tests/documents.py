"""Reading the README and the pages of `docs/` as tests do: their blocks, and running them."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "src" / "hotlever" / "examples"

_FENCE = re.compile(
    r"^```(?P<language>\{?[\w-]*\}?)[^\n]*\n(?P<content>.*?)^```\n(?P<after>\s*)",
    flags=re.DOTALL | re.MULTILINE,
)
_NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:\.(?P<decimals>\d+))?(?:e[-+]?\d+)?")

Run = Callable[..., tuple[int, str, str]]


@dataclass(frozen=True)
class Block:
    """A fenced block of a page; `output` is what is printed right below it."""

    language: str
    content: str
    output: str | None


def beside_examples(folder: Path) -> Path:
    """Return a folder in which the paths of the shipped examples are those of a checkout."""
    shutil.copytree(EXAMPLES, folder / EXAMPLES.relative_to(ROOT))
    return folder


def blocks(text: str, *languages: str) -> list[Block]:
    """Return the fenced blocks in some languages."""
    found = list(_FENCE.finditer(text))
    outputs: list[str | None] = [None] * len(found)
    for place, (block, following) in enumerate(pairwise(found)):
        if following["language"] == "text" and following.start() == block.end():
            outputs[place] = following["content"]
    return [
        Block(block["language"], block["content"], output)
        for block, output in zip(found, outputs, strict=True)
        if block["language"] in languages
    ]


def without_blocks(text: str) -> str:
    """Return the prose of a page."""
    return _FENCE.sub("\n", text)


def commands(content: str) -> list[tuple[dict[str, str], list[str]]]:
    """Return the commands of a block: environment variables, and words from ``hotlever`` on."""
    found = []
    for line in content.replace("\\\n", " ").splitlines():
        words = shlex.split(line.removeprefix("$ "), comments=True)
        variables = {}
        while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
            name, value = words.pop(0).split("=", 1)
            variables[name] = value
        if words and words[0] == "hotlever":
            found.append((variables, words))
    return found


def run_commands(content: str, run: Run) -> str:
    """Run the commands of a block, each of which must succeed; return what the last printed."""
    printed = ""
    for variables, (_, *arguments) in commands(content):
        with pytest.MonkeyPatch.context() as patch:
            for name, value in variables.items():
                patch.setenv(name, value)
            status, out, err = run(*arguments)
        assert status == 0, (arguments, err)
        printed = out + err
    return printed


def missing_lines(expected: str, printed: str, within: float = 0.01) -> list[str]:
    """Return the lines shown on a page that were not printed, in order, up to rounding.

    Numbers may differ by a share `within` and a unit of rounding.
    """
    lines = iter(printed.splitlines())
    return [
        line
        for line in expected.splitlines()
        if not any(_alike(line, each, within) for each in lines)
    ]


def _alike(expected: str, printed: str, within: float) -> bool:
    """Whether two lines have the same words, and numbers that differ by little."""
    if _words(expected) != _words(printed):
        return False
    pairs = zip(_NUMBER.finditer(expected), _NUMBER.finditer(printed), strict=True)
    return all(_close(mine, theirs, within) for mine, theirs in pairs)


def _words(line: str) -> Sequence[str]:
    return _NUMBER.sub("0", line).split()


def _close(mine: re.Match[str], theirs: re.Match[str], within: float) -> bool:
    a, b = (float(match[0].replace("−", "-")) for match in (mine, theirs))
    unit = 10.0 ** -len(mine["decimals"] or "")
    return abs(a - b) <= within * abs(a) + 1.01 * unit
