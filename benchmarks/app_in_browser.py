"""The app, started as a user starts it, and a headless Chromium to use it with."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from base64 import b64encode
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Error, Page, sync_playwright

from hotlever.app.project import safe_name

EXAMPLES = Path(__file__).parents[1] / "src" / "hotlever" / "examples"
#: Seconds for the app to say its address, and to end.
_START_S, _END_S = 60, 15
#: Seconds in which a line must be said of a file.
_SAID_S = 8.0
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
