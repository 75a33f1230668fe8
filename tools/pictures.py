"""Make the pictures of the gallery, the tutorial and the worked examples again.

    PYTHONPATH=tests python tools/pictures.py [NAME ...]

Runs the scripts of the gallery, and the commands of the tutorial and of the pages in
docs/examples, in an empty folder, and puts the figures that the pages show beside them, small.
"""

from __future__ import annotations

import contextlib
import re
import runpy
import sys
import tempfile
from pathlib import Path

from PIL import Image

from documents import EXAMPLES, ROOT, beside_examples, blocks, commands
from hotlever.cli import main

DOCS = ROOT / "docs"
#: Widest picture, and colours in it.
WIDTH, COLOURS = 1000, 256


def shrunk(source: Path, target: Path) -> None:
    """Write a picture with fewer pixels and colours."""
    picture = Image.open(source).convert("RGB")
    share = min(1.0, WIDTH / picture.width)
    size = round(share * picture.width), round(share * picture.height)
    small = picture.resize(size, Image.Resampling.LANCZOS)
    target.parent.mkdir(exist_ok=True)
    few = small.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(target, optimize=True)
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1000:.0f} kB")


def run_page(page: Path) -> None:
    """Run the commands of a page; the figures that it shows are in the folder then."""
    for block in blocks(page.read_text(encoding="utf-8"), "sh"):
        for _, (_, *arguments) in commands(block.content):
            with contextlib.suppress(SystemExit):
                main(arguments)


def make(names: list[str]) -> None:
    """Make pictures in the present folder, and those of some names only if there are any."""
    for script in sorted((EXAMPLES / "gallery").glob("*.py")):
        if not names or script.stem in names:
            runpy.run_path(str(script))
            # beside its script: the app shows both
            shrunk(Path(f"{script.stem}.png"), script.with_suffix(".png"))
    for page in (DOCS / "tutorial.md", *sorted((DOCS / "examples").glob("*.md"))):
        if not names or page.stem in names:
            run_page(page)
            # others are of the gallery
            for name in re.findall(r"\]\(([\w-]+\.png)\)", page.read_text(encoding="utf-8")):
                shrunk(Path(name), page.parent / name)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        beside_examples(Path(folder))
        make(sys.argv[1:])
