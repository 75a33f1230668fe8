"""Pages on paper: how many sheets a browser prints them on."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

import hotlever
from hotlever.estimate import calibrate
from hotlever.report.result_pages import budget_page, calibration_page

pytest.importorskip("playwright", reason="the extra test-app is not installed")

from app_in_browser import chromium_path

EXAMPLES = Path(hotlever.__file__).parent / "examples"
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium_path() is None, reason="no Chromium on this machine"),
]


def sheets(page: Path) -> int:
    """Return how many sheets of A4 a browser prints a page on."""
    printed = page.with_suffix(".pdf")
    options = ("--headless", "--no-sandbox", "--disable-gpu", f"--print-to-pdf={printed}")
    subprocess.run([chromium_path(), *options, page.as_uri()], check=True, capture_output=True)
    content = printed.read_bytes()
    assert {tuple(map(round, map(float, box.split()))) for box in _boxes(content)} == {
        (0, 0, 595, 842)
    }
    return len(re.findall(rb"/Type /Page\b(?!s)", content))


def _boxes(content: bytes) -> list[bytes]:
    return re.findall(rb"/MediaBox \[([^\]]*)\]", content)


def test_a_calibration_prints_on_two_sheets_and_its_uncertainty_budget_on_one(tmp_path):
    result = calibrate(EXAMPLES / "lever-a.csv")
    assert sheets(calibration_page(result).write(tmp_path)) == 2
    assert sheets(budget_page(result).write(tmp_path, "budget")) == 1
