"""The scripts of the gallery run, each draws its figure, and the page shows them as they are."""

from __future__ import annotations

import ast
import re
import runpy
from contextlib import nullcontext

import pytest

from documents import EXAMPLES, ROOT, beside_examples, missing_lines
from experiments import on_coarse_meshes

SCRIPTS = {path.stem: path for path in sorted((EXAMPLES / "gallery").glob("*.py"))}
PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
#: Those that take five seconds or more.
DEAR = ("pulse_in_air", "how_sure")
#: What this one tells is how exact the usual mesh is.
OF_MESHES = "turned_on_the_wafer"
#: Of a picture on the page, in bytes.
LARGEST = 60_000
#: Of the numbers beside a picture, as a share: it is what the script is for, not a result.
SURE = 0.05


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[pytest.mark.slow] * (one in DEAR)) for one in SCRIPTS],
)
def test_a_script_answers_in_words_and_draws_its_figure(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(beside_examples(tmp_path))
    with nullcontext() if name in (OF_MESHES, *DEAR) else on_coarse_meshes():
        runpy.run_path(str(SCRIPTS[name]))
    printed = capsys.readouterr().out
    # the page gives an answer that the script prints
    (answer,) = re.findall(rf"gallery/{name}\.png\)\n\n```text\n(.+?)\n```", PAGE, flags=re.DOTALL)
    assert missing_lines(answer, printed, within=SURE) == [], printed
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000


def test_the_page_shows_every_script_under_its_question():
    question = r"^## (.+)\n(?:.|\n)*?\([\w./]*gallery/(\w+)\.png\)"
    sections = dict(re.findall(question, PAGE, re.MULTILINE))
    questions = {
        ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))): name
        for name, path in SCRIPTS.items()
    }
    assert sections == questions
    assert re.findall(r"src/hotlever/examples/gallery/(\w+)\.py", PAGE) == list(sections.values())
    for path in SCRIPTS.values():
        assert 8 <= len(path.read_text(encoding="utf-8").splitlines()) <= 26
        assert path.with_suffix(".png").stat().st_size < LARGEST
