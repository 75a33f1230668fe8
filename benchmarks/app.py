"""The app in a real browser: how soon it answers, what it asks of other hosts, what it withstands.

python benchmarks/app.py [speed|files] [COUNT]         (needs Chromium, and the extra test-app)
python benchmarks/app.py memory [ACTIONS] [MINUTES]    (10 000 take about half an hour)

Times are of the wall, as a user has them, from the key press to the last figure drawn; the
processor's, of the app and the browser together, tell what a machine without other work would need.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from app_in_browser import EXAMPLES, answer, browsing, go, running
from bad_files import bad_files
from problems import table
from random_clicks import PAGES, RandomUser, act

MATERIAL = "phonon scattering exponent, p"
#: Seconds after which the app has forgotten a page, and given back its memory.
_FORGOTTEN_S = 52.0
#: Notes when a key was pressed, and which plots were drawn since.
_COUNT = """() => {
    window.drawn = new Set(); window.last = 0; window.pressed = 0;
    document.addEventListener('keydown', () => {
        window.pressed = performance.now(); window.drawn.clear();
    }, true);
    document.querySelectorAll('.js-plotly-plot').forEach(plot => {
        for (const name of ['plotly_afterplot', 'plotly_animated', 'plotly_relayout'])
            plot.on(name, () => { window.drawn.add(plot); window.last = performance.now(); });
    });
}"""
#: Waits until all four figures were drawn since the key was pressed; returns milliseconds.
_DRAWN = """() => new Promise(done => {
    const begin = performance.now();
    const look = () => {
        if (window.drawn.size >= 4) { done(window.last - window.pressed); }
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
            page.get_by_role("button", name="Simulate", exact=True).wait_for()
            # the browser's own start is not the app's
            begin = time.perf_counter()
            page.goto(app.base)
            page.get_by_role("button", name="Simulate", exact=True).click()
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
    before = _spent(app)
    bias = moves(page, "Bias V_b", count)
    by_bias = 1000 * (_spent(app) - before) / count
    # the reduced lever is made in the background
    deadline, model = time.monotonic() + 240, ""
    while "reduced" not in model and time.monotonic() < deadline:
        moves(page, MATERIAL, 1)
        model = page.locator("[aria-live=polite]").first.inner_text()
        if "reduced" not in model:
            page.wait_for_timeout(1000)
    before = _spent(app)
    material = moves(page, MATERIAL, count // 2)
    by_material = 1000 * (_spent(app) - before) / (count // 2)
    return bias, material, model, (by_bias, by_material)


def fit(page, app):
    """Drop the shipped measurement, fit, and wait for the drawn result: seconds."""
    go(page, app, "fit")
    page.locator("input[type=file]").first.set_input_files(EXAMPLES / "lever-a.csv")
    page.get_by_text("What was understood").first.wait_for()
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


def speed(count):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        said, answered = start_to_page(folder)
        with running(folder) as app, browsing(app) as (page, seen):
            bias, material, model, shares = sliders(page, app, count)
            fit(page, app)
            (folder / "lever-b.fit.json").unlink()
            (folder / "lever-b.csv").unlink()
            parameters, drawn = fit(page, app)
            rows = [
                ("address printed", f"{said:.2f} s", ""),
                ("start to a page that answers", f"{answered:.2f} s", "3 s"),
                ("bias slider, median", f"{np.nanmedian(bias):.0f} ms", "100 ms"),
                ("bias slider, 95 %", f"{np.nanpercentile(bias, 95):.0f} ms", "250 ms"),
                ("bias slider, processor", f"{shares[0]:.0f} ms", ""),
                ("material slider, median", f"{np.nanmedian(material):.0f} ms", "200 ms"),
                ("material slider, answered by", model.removeprefix("moving: "), ""),
                ("material slider, processor", f"{shares[1]:.0f} ms", ""),
                ("fit, drop to parameters, warm", f"{parameters:.1f} s", ""),
                ("fit, drop to drawn, warm", f"{drawn:.1f} s", "3 s"),
                ("requests to other hosts", f"{len(seen.elsewhere)} of {seen.requests}", "0"),
                ("errors in the browser", f"{len(seen.errors)}", "0"),
                ("load of the machine", f"{os.getloadavg()[0]:.1f} on {os.cpu_count()}", ""),
            ]
            table(("quantity", "measured", "target"), rows)
            for line in (*seen.errors[:5], *seen.elsewhere[:5]):
                print(line)


def files(count):
    """Drop bad files in every page; say of which no line was said that names them."""
    rows, silent = [], []
    with (
        tempfile.TemporaryDirectory() as name,
        running(Path(name)) as app,
        browsing(app) as (page, seen),
    ):
        for address in PAGES:
            go(page, app, address)
            for zone in range(page.locator("input[type=file]").count()):
                found = [_dropped(page, app, address, zone, *file) for file in bad_files()][:count]
                where = f"{address or 'start'}{f', {zone + 1}' if zone else ''}"
                kinds = ("said", "moved on", "silent")
                dead = sum(not one[2] for one in found)
                rows.append((where, len(found), *(_count(found, kind) for kind in kinds), dead))
                silent += [f"{where}: {one[0]}" for one in found if one[1] != "said"]
        table(("page", "files", "a line", "moved on", "no line", "dead pages"), rows)
        print(f"errors in the browser: {len(seen.errors)}")
        for line in (*silent, *app.lines[1:], *seen.errors[:5]):
            print(line)


def _count(found, kind):
    return sum(one[1] == kind for one in found)


def _dropped(page, app, address, zone, name, content):
    """Drop a file; return its name, what became of it, and whether the page is alive."""
    said = answer(page, app, address, zone, name, content)
    return name, said, page.get_by_role("button", name="Simulate", exact=True).first.is_enabled()


def memory(count, minutes):
    """Click at random in all pages; say how the memory of the app grows.

    Before each number all work is cancelled, and pages that were closed have been forgotten. After
    a tenth of the actions each kind of work has been done once, and caches are full.
    """
    parts, rows = 5, []
    with (
        tempfile.TemporaryDirectory() as name,
        running(Path(name)) as app,
        browsing(app) as (page, seen),
    ):
        page.goto(f"{app.base}/simulate")
        page.get_by_text("full lever:").wait_for(timeout=180_000)
        user = RandomUser(page, app.base)
        begin = time.monotonic()
        for done in (100, count // 10, *((part + 1) * count // parts for part in range(parts))):
            act(user, done - user.done, begin + 60 * minutes - time.monotonic())
            user.rest()
            _idle(app)
            own, *others = _used(app)
            sizes = "+".join(f"{size:.0f}" for size in others)
            took = f"{time.monotonic() - begin:.0f} s"
            rows.append((user.done, took, f"{own + sum(others):.0f} MB", f"{own:.0f} MB", sizes))
            print(*rows[-1], flush=True)
        table(("actions", "after", "memory of all", "server", "its processes"), rows)
        sizes = [float(row[2].split()[0]) for row in rows]
        for at in (0, 1):
            first, *others = sizes[at:]
            grown = f"{others[-1] / first - 1:+.0%}, at most {max(others) / first - 1:+.0%}"
            print(f"growth since {rows[at][0]} actions: {grown}")
        print(f"dead pages: {user.dead}; errors in the browser: {len(seen.errors)}")
        for line in (*app.lines[1:], *seen.errors[:20]):
            print(line)


def _processes(app):
    own = psutil.Process(app.process.pid)
    return [own, *own.children(recursive=True)]


def _idle(app):
    """Wait until pages are forgotten and memory is given back, and there is nothing to do."""
    time.sleep(_FORGOTTEN_S)
    for _ in range(20):
        before = _of_app(app)
        time.sleep(3.0)
        if _of_app(app) - before < 0.3:
            return


def _of_app(app):
    times = _each(app, psutil.Process.cpu_times)
    return sum(time.user + time.system for time in times)


def _used(app):
    """Return MB of the server and of each of its processes."""
    sizes = [info.rss / 2**20 for info in _each(app, psutil.Process.memory_info)]
    return [size for size in sizes if size > 0]


def _each(app, ask):
    """Return what is known of each process that is there; some end meanwhile."""
    found = []
    for one in _processes(app):
        with suppress(psutil.NoSuchProcess):
            found.append(ask(one))
    return found


def _spent(app):
    """Return processor seconds of the app and of the browsers."""
    known = [*_processes(app), *psutil.Process().children(recursive=True)]
    times = {one.pid: one.cpu_times() for one in known}
    return sum(time.user + time.system for time in times.values())


#: How many moves of a slider, files and random actions, and minutes for the last.
_USUAL = {"speed": [60], "files": [50], "memory": [1000, 30]}


def main():
    what, *given = sys.argv[1:] or ["speed"]
    usual = _USUAL[what]
    numbers = [*map(int, given), *usual[len(given) :]]
    {"speed": speed, "files": files, "memory": memory}[what](*numbers)


if __name__ == "__main__":
    main()
