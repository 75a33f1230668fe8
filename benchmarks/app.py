"""The app in a real browser: how soon it answers, and what it asks of other hosts.

python benchmarks/app.py [MOVES]     (needs Chromium, and the extra test-app)

Times are of the wall, as a user has them, from the key press to the last figure drawn.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
from app_in_browser import EXAMPLES, browsing, running

from problems import table

MATERIAL = "phonon scattering exponent"
#: Notes when a key was pressed and when a plot was drawn.
_COUNT = """() => {
    window.drawn = 0; window.last = 0; window.pressed = 0;
    document.addEventListener('keydown', () => {
        window.pressed = performance.now(); window.drawn = 0;
    }, true);
    document.querySelectorAll('.js-plotly-plot').forEach(plot => plot.on('plotly_afterplot',
        () => { window.drawn += 1; window.last = performance.now(); }));
}"""
#: Waits until all four figures were drawn since the key was pressed; returns milliseconds.
_DRAWN = """() => new Promise(done => {
    const begin = performance.now();
    const look = () => {
        if (window.drawn >= 4) { done(window.last - window.pressed); }
        else if (performance.now() - begin > 5000) { done(NaN); }
        else { setTimeout(look, 2); }
    };
    look();
})"""


def start_to_page(folder):
    """Start the app and open it, until the page shows a button that can be pressed."""
    begin = time.perf_counter()
    with running(folder) as app:
        said = time.perf_counter() - begin
        with browsing(app) as (page, _):
            page.get_by_role("button", name="Simulate").wait_for()
            # the browser's own start is not the app's
            begin = time.perf_counter()
            page.goto(app.base)
            page.get_by_role("button", name="Simulate").click()
            page.wait_for_url("**/simulate")
            return said, said + time.perf_counter() - begin


def moves(page, label, count):
    """Move a slider by one step, count times; return milliseconds of each."""
    # the focus is on the inside of a slider
    slider = page.get_by_role("slider", name=label, exact=True).locator("[tabindex]")
    found = []
    for number in range(count):
        slider.press("ArrowRight" if number % 40 < 20 else "ArrowLeft")
        found.append(page.evaluate(_DRAWN))
        page.wait_for_timeout(30)
    return np.array(found)


def sliders(page, app, count):
    page.goto(f"{app.base}/simulate")
    page.get_by_text("full lever:").wait_for(timeout=60_000)
    page.wait_for_timeout(1000)
    page.evaluate(_COUNT)
    bias = moves(page, "Bias", count)
    # the reduced lever is made in the background
    deadline, model = time.monotonic() + 240, ""
    while "reduced" not in model and time.monotonic() < deadline:
        moves(page, MATERIAL, 1)
        model = page.locator("[aria-live=polite]").first.inner_text()
        if "reduced" not in model:
            page.wait_for_timeout(1000)
    material = moves(page, MATERIAL, count // 2)
    return bias, material, model


def fit(page, app):
    """Drop the shipped measurement, fit, and wait for the drawn result: seconds."""
    page.goto(f"{app.base}/fit")
    page.wait_for_load_state("networkidle")
    page.locator("input[type=file]").first.set_input_files(EXAMPLES / "lever-a.csv")
    page.get_by_text("What was understood").wait_for()
    page.wait_for_timeout(500)
    begin = time.perf_counter()
    page.locator("input[type=file]").first.set_input_files(EXAMPLES / "lever-b.csv")
    page.get_by_role("cell", name="lever-b.csv").or_(
        page.get_by_text("lever-b.csv")
    ).first.wait_for()
    page.get_by_role("button", name="Fit", exact=True).last.click()
    page.get_by_text("lever-b.fit.json", exact=True).wait_for(timeout=120_000)
    parameters = time.perf_counter() - begin
    page.locator("img[alt^='Measured and modelled']").wait_for(timeout=120_000)
    return parameters, time.perf_counter() - begin


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        said, answered = start_to_page(folder)
        with running(folder) as app, browsing(app) as (page, seen):
            bias, material, model = sliders(page, app, count)
            fit(page, app)
            (folder / "lever-b.fit.json").unlink()
            (folder / "lever-b.csv").unlink()
            parameters, drawn = fit(page, app)
            rows = [
                ("address printed", f"{said:.2f} s", ""),
                ("start to a page that answers", f"{answered:.2f} s", "3 s"),
                ("bias slider, median", f"{median(bias):.0f} ms", "100 ms"),
                ("bias slider, 95 %", f"{np.percentile(bias, 95):.0f} ms", "250 ms"),
                (f"material slider, median ({model})", f"{np.median(material):.0f} ms", "200 ms"),
                ("fit, drop to parameters, warm", f"{parameters:.1f} s", ""),
                ("fit, drop to drawn, warm", f"{drawn:.1f} s", "3 s"),
                ("requests to other hosts", f"{len(seen.elsewhere)} of {seen.requests}", "0"),
                ("errors in the browser", f"{len(seen.errors)}", "0"),
            ]
            table(("quantity", "measured", "target"), rows)
            for line in (*seen.errors[:5], *seen.elsewhere[:5]):
                print(line)


if __name__ == "__main__":
    main()
