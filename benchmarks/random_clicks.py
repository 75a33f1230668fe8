"""A user who clicks at random: sliders, buttons, boxes, menus and pages, files now and then."""

from __future__ import annotations

import time

import numpy as np
from playwright.sync_api import Error

from app_in_browser import EXAMPLES, give
from bad_files import bad_files

PAGES = ("", "lever", "simulate", "raman", "fit", "calibrate", "levers")
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
