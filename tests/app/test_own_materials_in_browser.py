"""A drawing and materials of one's own, to a calibrated curve, in the app alone."""

from __future__ import annotations

import tomllib
from pathlib import Path

import gdstk
import pytest

pytest.importorskip("playwright", reason="the extra test-app is not installed")

from playwright.sync_api import Locator, Page, expect

from app_in_browser import EXAMPLES, browsing, chromium_path, go, running

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium_path() is None, reason="no Chromium on this machine"),
]
_WORK = 240_000
expect.set_options(timeout=60_000)


class Counted:
    """A page whose user counts what he clicks; what he types he does not."""

    def __init__(self, page: Page) -> None:
        self.page, self.clicks = page, 0

    def click(self, what: Locator) -> None:
        self.clicks += 1
        what.click()

    def drop(self, *files: Path) -> None:
        """Press +, and choose files."""
        self.clicks += 1
        self.page.locator("input[type=file]").first.set_input_files(list(files))

    def choose(self, field: str, option: str) -> None:
        self.click(self.page.get_by_role("combobox", name=field))
        self.click(self.page.get_by_role("option", name=option, exact=True))

    def type(self, field: str, text: str) -> None:
        self.page.get_by_role("textbox", name=field).fill(text)


def drawn(folder: Path) -> Path:
    """Write a GDSII file of the outlines of an example: lever, track and two contacts."""
    sections = tomllib.loads((EXAMPLES / "palladium-on-nitride.toml").read_text())
    library = gdstk.Library()
    cell = library.new_cell("LEVER")
    for name, layer in (("body", 1), ("track", 5)):
        cell.add(gdstk.Polygon(sections["layers"][name]["drawn"], layer=layer))
    for name, layer in (("supply", 10), ("ground", 11)):
        (_, low), (_, high) = sections["terminals"][name]
        cell.add(gdstk.rectangle((-2.0, low), (0.5, high), layer=layer))
    library.write_gds(folder / "mine.gds")
    return folder / "mine.gds"


def alert(page: Page, text: str) -> Locator:
    """Return what is said at a field."""
    return page.locator(".q-field [role=alert]").filter(has_text=text)


def test_own_drawing_of_two_own_materials_to_a_calibrated_curve(tmp_path):
    project, mine = tmp_path / "project", tmp_path / "mine"
    mine.mkdir()
    table = mine / "film.csv"
    table.write_text("T (K),resistivity (uOhm cm)\n290,21.9\n600,33.8\n900,45.4\n1300,60.8\n")
    with running(project) as app, browsing(app) as (page, seen):
        page.set_default_timeout(60_000)
        go(page, app, "lever")
        user = Counted(page)
        user.drop(drawn(mine), table)
        expect(page.get_by_text("Layers of the drawing")).to_be_visible(timeout=_WORK)
        # fields of what is proposed go when another material is chosen
        user.choose("layer 1/0 is made of", "new: dielectric")
        expect(page.get_by_text("dielectric: dielectric")).to_be_visible()
        user.type("thermal conductivity at 300 K", "k300*(T/300)**0.33")
        expect(alert(page, "other names need a value")).to_be_visible()
        user.type("k300, a number in a formula", "0.032")
        user.choose("layer 5/0 is made of", "new: metal film")
        expect(page.get_by_text("metal-film: metal film")).to_be_visible()
        user.type("5/0: thickness", "0.05")
        user.type("resistivity at 293 K", "flm.csv")
        expect(alert(page, "flm.csv: no such file")).to_be_visible()
        user.type("resistivity at 293 K", "film.csv")
        user.type("heat carried over", "1")
        user.type("place of the tip", "56, 0")
        user.type("series resistance", "100")
        expect(page.locator("img[alt^='The lever from above']")).to_be_visible()
        user.click(page.get_by_role("button", name="Measurements", exact=True).last)
        page.wait_for_url("**/measurements")
        user.drop(EXAMPLES / "palladium-on-nitride.csv")
        expect(page.get_by_text("heater current, 'I_h (mA)'")).to_be_visible()
        user.click(page.get_by_role("button", name="Calibrate", exact=True).last)
        expect(page.locator("[data-answer=tip_K]")).to_contain_text("set a bias", timeout=_WORK)
        assert user.clicks <= 8
        assert seen.errors == []
