"""The app in a real browser: how soon it answers, what it asks of other hosts, what it withstands.

    python benchmarks/app_in_browser.py speed [COUNT]       (needs Chromium, and the extra test-app)
    python benchmarks/app_in_browser.py memory [ACTIONS] [MINUTES]  (10 000 take half an hour)
    python benchmarks/app_in_browser.py live [contact|reader]        (no browser)

Times of ``speed`` are of the wall, as a user has them, from the key press to the last figure drawn;
the processor's, of the app and the browser together, tell what a machine without other work would
need. ``live`` prints what the pages Contact and Reader show while sliders move, beside what the
commands give; its times are of the processor, of a step after the first. Tests and tools take from
here the app, started as a user starts it, a headless Chromium, and files that somebody may drop.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from base64 import b64encode
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import psutil
from playwright.sync_api import Error, Page, sync_playwright

from hotlever.app import approaching, touching
from hotlever.app.pages.frame import PAGES
from hotlever.app.project import safe_name
from hotlever.app.session import Task
from problems import table

EXAMPLES = Path(__file__).parents[1] / "src" / "hotlever" / "examples"
#: Seconds for the app to say its address, and to end.
_START_S, _END_S = 60, 15
#: Seconds in which a line must be said of a file.
_SAID_S = 20.0
#: Milliseconds in which a page that is there comes to rest.
_IDLE_MS = 10_000
#: There is no input while another file is on its way.
_DROP = """async ([zone, name, content]) => {
    const bytes = Uint8Array.from(atob(content), one => one.charCodeAt(0));
    const given = new DataTransfer();
    given.items.add(new File([bytes], name));
    const find = () => document.querySelectorAll('.q-uploader')[zone]?.querySelector('input');
    for (let look = 0; !find() && look < 1000; look++) {
        await new Promise(done => setTimeout(done, 5));
    }
    const input = find();
    input.files = given.files;
    input.dispatchEvent(new Event('change', {bubbles: true}));
}"""
#: Waits until nothing in a page has changed for so many milliseconds, and nothing moves but what
#: moves for ever.
_STILL = """([quiet, most]) => new Promise(done => {
    const began = performance.now();
    let changed = began;
    const watch = new MutationObserver(() => { changed = performance.now(); });
    watch.observe(document, {
        subtree: true, childList: true, attributes: true, characterData: true,
    });
    const moves = one => one.playState === 'running'
        && one.effect.getComputedTiming().endTime !== Infinity;
    const look = () => {
        const now = performance.now();
        if (document.getAnimations().some(moves)) changed = now;
        if (now - changed < quiet && now - began < most) return setTimeout(look, 25);
        watch.disconnect();
        done();
    };
    requestAnimationFrame(look);
})"""
#: Milliseconds after which a page that never stands still is as it is.
_RESTLESS_MS = 3_000
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def chromium_path() -> str | None:
    """Return the browser of this machine; None if it has none."""
    return next((path for name in _BROWSERS if (path := shutil.which(name))), None)


class App:
    """A running app.

    Attributes
    ----------
    process : subprocess.Popen
    address : str
        With its token.
    """

    def __init__(self, folder: Path, *options: str) -> None:
        command = [sys.executable, "-m", "hotlever", "app", str(folder), "--no-browser", *options]
        # NiceGUI behaves otherwise where it believes to be tested by its own fixtures
        own = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=own)
        self.lines: list[str] = []
        self._said = threading.Event()
        threading.Thread(target=self._read, daemon=True).start()
        self._said.wait(_START_S)
        words = [word for line in self.lines for word in line.split()]
        self.address = next((word for word in words if word.startswith("http:")), "")
        if not self.address:
            self.end()
            raise RuntimeError(f"the app did not start: {self.lines}")

    @property
    def base(self) -> str:
        """Address without token."""
        return self.address.partition("/?")[0]

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as lines:
            for line in lines:
                self.lines.append(line.rstrip())
                if "http://" in line:
                    self._said.set()
        # nothing more will be said
        self._said.set()

    def end(self) -> None:
        """Stop it as Ctrl-C does."""
        self.process.terminate()
        try:
            self.process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()


@contextmanager
def running(folder: Path, *options: str) -> Iterator[App]:
    """Give an app that serves a folder."""
    app = App(folder, *options)
    try:
        yield app
    finally:
        app.end()


def give(page: Page, zone: int, name: str, content: bytes) -> None:
    """Drop a file, under a name that a dialogue may not give."""
    page.evaluate(_DROP, [zone, name, b64encode(content).decode("ascii")])


def answer(page: Page, app: App, address: str, zone: int, name: str, content: bytes) -> str:
    """Drop a file in a page, and wait for the answer.

    Afterwards the page shows the page again.

    Returns
    -------
    str
        "said" if a line names the file, "moved on" if the page went to another page, or "silent".
    """
    give(page, zone, name, content)
    # it may be kept with a number
    kept = Path(safe_name(name)).stem
    deadline = time.monotonic() + _SAID_S
    while time.monotonic() < deadline:
        page.wait_for_timeout(50)
        try:
            lines = page.locator("[role=alert]").all_inner_texts()
        except Error:
            lines = []  # it is going to another page
        if urlsplit(page.url).path.strip("/") != address:
            go(page, app, address)
            return "moved on"
        if any(kept in line for line in lines):
            return "said"
    return "silent"


def go(page: Page, app: App, address: str) -> None:
    """Open a page, and wait until it is there."""
    page.goto(f"{app.base}/{address}")
    page.wait_for_function("window.did_handshake === true")
    # an upload that the last page broke off may count as under way for ever
    with suppress(Error):
        page.wait_for_load_state("networkidle", timeout=_IDLE_MS)


def stand_still(page: Page, quiet_ms: float = 200.0) -> None:
    """Wait until nothing in a page has changed for so many milliseconds."""
    page.evaluate(_STILL, [quiet_ms, _RESTLESS_MS])


class Seen:
    """What a browser met: errors of pages, and requests to other hosts."""

    def __init__(self, page: Page, base: str) -> None:
        self.errors: list[str] = []
        self.elsewhere: list[str] = []
        self.requests = 0
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", self._console)
        self._own = (base, base.replace("http", "ws", 1), "data:", "blob:")
        page.on("request", self._request)
        page.on("websocket", lambda socket: self._address(socket.url))

    def _console(self, message: object) -> None:
        if getattr(message, "type", "") == "error":
            self.errors.append(str(getattr(message, "text", "")))

    def _request(self, request: object) -> None:
        self._address(str(getattr(request, "url", "")))

    def _address(self, url: str) -> None:
        self.requests += 1
        if not url.startswith(self._own):
            self.elsewhere.append(url)


@contextmanager
def browsing(app: App, width: int = 1280, height: int = 800) -> Iterator[tuple[Page, Seen]]:
    """Give a page of a headless Chromium, which has opened the app."""
    # as root, Chromium has no sandbox; the pages are ours
    arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium_path(), args=arguments)
        page = browser.new_context(viewport={"width": width, "height": height}).new_page()
        seen = Seen(page, app.base)
        page.goto(app.address)
        page.wait_for_load_state("networkidle")
        try:
            yield page, seen
        finally:
            browser.close()


# --- bad files -----------------------------------------------------------------------------------

_GOOD = "V_b (V),I_h (mA)\n" + "".join(f"{i},{0.1 * i:.2f}\n" for i in range(1, 12))
_PROBE = '[probe]\nshape = "three-leg"\nlength_um = {}\n'


def bad_files() -> Iterator[tuple[str, bytes]]:
    """Give names and contents of fifty files dropped by mistake or mischief, always the same."""
    noise = random.Random(1)
    yield "empty.csv", b""
    yield "spaces.csv", b"   \n\n  \t \n"
    yield "bom.csv", "\ufeff".encode()
    yield "nul.csv", bytes(1000)
    yield "binary.csv", noise.randbytes(5000)
    yield "binary.txt", noise.randbytes(5000)
    yield "page.csv", b"<!doctype html><script>alert(1)</script>"
    yield "words.txt", b"to whom it may concern\n" * 20
    yield "header.csv", b"V_b (V),I_h (mA)\n"
    yield "one-row.csv", b"V_b (V),I_h (mA)\n1,0.1\n"
    yield "no-bias.csv", _GOOD.replace("V_b (V)", "time (s)").encode()
    yield "no-unit.csv", _GOOD.replace("(V)", "").replace("(mA)", "").encode()
    yield "furlongs.csv", _GOOD.replace("(mA)", "(furlongs)").encode()
    yield "power.csv", _GOOD.replace("(mA)", "(9**9**9**9)").encode()
    yield "twice.csv", b"V_b (V),V_b (V)\n1,2\n2,3\n3,4\n"
    yield "letters.csv", _GOOD.replace("0.", "a.").encode()
    yield "infinite.csv", _GOOD.replace("0.1", "inf").replace("0.2", "-1e999").encode()
    yield "huge.csv", _GOOD.replace("0.", "1e300").encode()
    yield "negative.csv", _GOOD.replace("0.", "-0.").encode()
    yield "ragged.csv", b"V_b (V),I_h (mA)\n1\n2,3,4\n,,,,,\n5\n"
    yield "long-line.csv", b"V_b (V),I_h (mA)\n" + b"1," * 100_000
    yield "quotes.csv", b'V_b (V),I_h (mA)\n"1,"2\n"3""",4\n"'
    yield "formula.csv", b"V_b (V),I_h (mA)\n=cmd|' /C calc'!A0,1\n2,3\n"
    yield "utf16.csv", "caf\u00e9 \u03ba\n".encode("utf-16")
    yield "latin.csv", b"\xe9\xff\xfe,\xb5\n1,2\n"
    yield "<img src=x onerror=alert(1)>.csv", b"x"
    yield "$\\frac{1}{$.csv", b"x"
    yield "../../../etc/cron.d/evil.csv", b"x"
    yield "-o.csv", b"--report\n"
    yield ".hidden.csv", b"x"
    yield "a" * 300 + ".csv", b"x"
    yield "right\u202ecsv.exe", b"MZ"
    yield "con.csv", b"\x1b[2J\x1b[31m\n"
    yield "deep.json", b"[" * 100_000
    yield "number.json", b'{"parameters": 1e999}'
    yield "fit.json", b'{"correlation": {"names": 3}, "parameters": {}}'
    yield "cal.json", b'{"route": "probe", "table": []}'
    yield "broken.toml", b"[probe\nshape="
    yield "other.toml", b"[tool]\nname = 'x'\n"
    yield "nan.toml", _PROBE.format("nan").encode()
    yield "tiny.toml", _PROBE.format("1e-9").encode()
    yield "text.toml", _PROBE.format('"<b>long</b>"').encode()
    yield "keys.toml", b"a" + b".a" * 100_000 + b" = 1\n"
    yield "link.toml", b'[probe]\nshape = "drawing"\nfile = "/etc/passwd"\nthickness_um = 0.4\n'
    yield "noise.gds", noise.randbytes(2000)
    yield "short.gds", b"\x00\x06\x00\x02\x02\x58"
    yield "noise.oas", b"%SEMI-OASIS\r\n" + noise.randbytes(500)
    yield "words.dxf", b"0\nSECTION\n2\nENTITIES\n0\nLINE\n"
    yield "zip.dxf", b"PK\x03\x04" + noise.randbytes(500)
    yield "picture.png", b"\x89PNG\r\n\x1a\n" + noise.randbytes(500)


# --- a user who clicks at random -----------------------------------------------------------------

#: What can be clicked, and what is moved by a key. Buttons of the sliders' page come first often.
_CLICKED = "button, [role=checkbox], [role=option], [role=radio], label.q-field, .q-expansion-item"
_MOVED = ".q-slider__focus-ring, .q-slider [tabindex], input[type=number]"
#: Focuses or clicks one of what is seen and enabled; returns how many there are.
_TOUCH = """([selector, place, click]) => {
    const all = [...document.querySelectorAll(selector)].filter(one =>
        one.offsetParent !== null && !one.disabled && one.getAttribute('aria-disabled') !== 'true');
    if (!all.length) return 0;
    const one = all[Math.floor(place * all.length)];
    click ? one.click() : one.focus();
    return all.length;
}"""
#: Shares of all actions: what is moved by a key, a file dropped; the others are clicks.
_KEYS, _DROPS = 0.8, 0.01
#: Milliseconds for a page to answer.
_ANSWERS = 30_000


class RandomUser:
    """Acts at random on a page of the app.

    Attributes
    ----------
    done : int
        Actions.
    dead : int
        Times that a page did not answer, and was opened anew.
    """

    def __init__(self, page, base, seed=1):
        self._page, self._base, self._rng = page, base, np.random.default_rng(seed)
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        good = [("lever-a.csv", (EXAMPLES / "lever-a.csv").read_bytes())]
        self._files = good * 10 + list(bad_files())
        self.done = self.dead = 0

    def act(self):
        """Do one thing; where there is nothing to be moved, click."""
        self.done += 1
        kind, place = self._rng.random(2)
        try:
            if kind < _DROPS:
                self._drop()
            elif kind > _KEYS or not self._page.evaluate(_TOUCH, [_MOVED, place, False]):
                self._page.evaluate(_TOUCH, [_CLICKED, place, True])
            else:
                self._page.keyboard.press(str(self._rng.choice(["ArrowUp", "ArrowDown"])))
        except Error as error:
            # the click before has led to another page, which is being opened
            if "context was destroyed" not in str(error) and "navigat" not in str(error):
                raise

    def _drop(self):
        if self._page.locator("input[type=file]").count():
            give(self._page, 0, *self._files[self._rng.integers(len(self._files))])

    def look(self):
        """Go to Simulate, where sliders are; a page that does not, when asked twice, is dead."""
        for again in (True, False):
            # a menu that is open covers the rest; a click before may lead elsewhere meanwhile
            self._page.keyboard.press("Escape")
            try:
                tab = self._page.get_by_role("button", name="Simulate", exact=True).first
                tab.click(timeout=_ANSWERS)
                self._page.wait_for_url("**/simulate", timeout=_ANSWERS)
                # a probe that cannot be read has no sliders, but a line that says so
                there = self._page.get_by_role("slider").or_(self._page.get_by_role("alert"))
                there.first.wait_for(timeout=_ANSWERS)
                return
            except Error as error:
                if not again:
                    self.dead += 1
                    print(f"after {self.done} actions, {self._page.url}: {error}")
        self.open("simulate")

    def open(self, address):
        """Open a page anew."""
        try:
            self._page.goto(f"{self._base}/{address}")
        except Error:
            # a click before has led elsewhere meanwhile
            self._page.wait_for_timeout(1000)
            self._page.goto(f"{self._base}/{address}")
        self._page.wait_for_load_state("networkidle")

    def rest(self):
        """Cancel what runs in any page."""
        for address in PAGES:
            self.open(address)
            cancel = self._page.get_by_role("button", name="Cancel")
            if cancel.count() and cancel.first.is_visible():
                cancel.first.click()
        self.open("")


def act(user, count, seconds):
    """Act so many times, or as long as there is time; look now and then whether the page lives."""
    begin = time.monotonic()
    for number in range(count):
        if number % 50 == 0:
            user.look()
        user.act()
        if time.monotonic() - begin > seconds:
            return


# --- how soon, and how much memory ---------------------------------------------------------------

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
    go(page, app, "measurements")
    page.locator("input[type=file]").first.set_input_files(EXAMPLES / "lever-a.csv")
    page.get_by_text("What was understood").first.wait_for()
    page.wait_for_timeout(500)
    begin = time.perf_counter()
    page.locator("input[type=file]").first.set_input_files(EXAMPLES / "lever-b.csv")
    page.get_by_role("cell", name="lever-b.csv").or_(
        page.get_by_text("lever-b.csv")
    ).first.wait_for()
    page.get_by_role("button", name="Fit", exact=True).first.click()
    page.get_by_role("button", name="Fit", exact=True).last.click()
    page.get_by_text("lever-b.fit.json", exact=True).wait_for(timeout=120_000)
    parameters = time.perf_counter() - begin
    page.locator("img[alt^='Tip temperature against the power']").wait_for(timeout=120_000)
    return parameters, time.perf_counter() - begin


def speed(count=60):
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


def memory(count=1000, minutes=30):
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


# --- Contact and Reader while sliders move -------------------------------------------------------


class Silent:
    """A report that nobody hears."""

    def note(self, *_: str) -> None:
        """Say nothing."""

    def progress_bars(self, *labels: str) -> Any:
        """Show nothing."""
        return nullcontext(tuple(lambda done, total: None for _ in labels))

    def progress(self, _: str) -> Any:
        """Show nothing."""
        return nullcontext(lambda done, total: None)


REPORT: Any = Silent()


def timed(ask: Callable[[], dict[str, Any]]) -> tuple[float, dict[str, Any]]:
    """Return the processor seconds of an answer, and its numbers."""
    begin = time.process_time()
    answer = ask()
    return time.process_time() - begin, answer["now"]


def contact() -> None:
    """Print the moving contact beside the full one."""
    rows = []
    for medium in ("vacuum", "air"):
        for sample, radius, interface, bias in (
            ("polymer, 100nm, silicon", "20nm", "0K/W", 8.0),
            ("polymer, 100nm, silicon", "5nm", "0K/W", 8.0),
            ("polymer, 100nm, silicon", "5nm", "1e7K/W", 8.0),
            ("polymer, 100nm, silicon", "5nm", "1e7K/W", 8.1),
            ("SiO2, 300nm, silicon", "100nm", "0K/W", 8.1),
            ("silicon", "100nm", "0K/W", 8.1),
        ):
            options = {"medium": medium, "sample": sample, "radius": radius, "interface": interface}
            task = Task("contact", (), options)

            def ask(quick: bool, task: Task = task, bias: float = bias) -> dict[str, Any]:
                return touching.answer(REPORT, task, bias, 12.0, quick)

            seconds, moving = timed(lambda ask=ask: ask(True))
            full = ask(False)["now"]
            change, off = full["current_change_mA"], moving["current_change_mA"]
            tips = [f"{now[key]:.1f}" for key in ("tip_K", "apex_K") for now in (moving, full)]
            share = f"{100 * (off / change - 1):+.1f}"
            rows.append((medium, sample, radius, interface, bias, f"{seconds:.2f}", *tips, share))
    head = ("medium", "sample", "radius", "interface", "V", "s", "tip (K)", "full", "apex", "full")
    table((*head, "change of I_h, % off"), rows)


def reader() -> None:
    """Print what is read off between distances beside the full lever there."""
    rows = []
    for bias, z in ((9.0, 0.5), (9.0, 0.9), (10.0, 0.5), (11.0, 2.0), (6.0, 0.25), (4.0, 3.3)):
        options = {"distance": "0.2um:5um:10", "medium": "air", "bias": f"{bias}V"}
        ask = (REPORT, Task("reader", (), options), z)
        full = approaching.answer(*ask, False, None)
        again = (*ask, True, full["jump_K"])
        approaching.answer(*again)
        seconds, now = timed(lambda again=again: approaching.answer(*again))
        off = [
            f"{100 * (now[key] / full['now'][key] - 1):+.3f}"
            for key in ("reader_V", "reader_ohm", "dlnR_dz_per_um", "resolution_nm_per_rtHz")
        ]
        slope = f"{full['now']['dV_dz_V_per_um']:.3g}"
        rows.append((bias, z, f"{seconds:.2f}", slope, *off))
    names = ("voltage, % off", "resistance", "d ln R/dz", "resolution")
    table(("V", "µm", "s", "dV/dz (V/µm)", *names), rows)


def live(*names: str) -> None:
    """Print the tables that are asked for."""
    for name in names or ("contact", "reader"):
        {"contact": contact, "reader": reader}[name]()


if __name__ == "__main__":
    what, *words = sys.argv[1:] or ["speed"]
    if what == "live":
        live(*words)
    else:
        {"speed": speed, "memory": memory}[what](*map(int, words))
