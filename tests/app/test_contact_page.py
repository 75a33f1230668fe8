"""The page Contact: the numbers of the command, while its sliders move and when they rest."""

from __future__ import annotations

import csv

import pytest
from elements import named
from nicegui import ui
from test_app_pages import text_of, until, visited

from hotlever.app.pages.live_page import slider

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@visited
async def test_contact_shows_the_numbers_of_the_command(user, session, tmp_path, run):
    words = ["--sample", "SiO2, 100nm, silicon", "--radius", "10nm", "--interface", "1e+07K/W"]
    _, out, _ = run("contact", "--bias", "8:8:1", *words)
    row = next(csv.DictReader(out.splitlines()))

    session.chosen["contact"] = {"radius_nm": 10.0, "most": 9.0}
    await user.open("/contact")
    await until(lambda: "full lever" in text_of(user, "aria-live=polite"))
    named(user, "resistance of the interface", ui.number).set_value(1e7)
    (layer,) = (
        one
        for one in user.client.elements.values()
        if isinstance(one, ui.select) and one.props.get("label") == "layer 1"
    )
    layer.set_value("SiO2")
    await until(lambda: "moving" in text_of(user, "aria-live=polite"))
    moving = text_of(user, "data-number=apex_K")
    await until(lambda: "full lever" in text_of(user, "aria-live=polite"))
    assert text_of(user, "data-number=apex_K") == f"{float(row['apex_K']):.1f} K"
    assert text_of(user, "data-number=sample_mW") == f"{1e3 * float(row['sample_mW']):.3g} µW"
    change = f"{1e3 * float(row['current_change_mA']):.3g} µA"
    assert text_of(user, "data-number=current_change_mA") == change
    assert float(moving.split()[0]) == pytest.approx(float(row["apex_K"]), abs=2.0)
    await user.should_see("interface 1e+07 K/W")
    await user.should_see(
        "hotlever contact --bias 0.36:9:25 --sample 'SiO2, 100nm, silicon' --radius 10nm "
        "--interface 10000000K/W -o reference.contact.csv"
    )
    layer.set_value("SiO3")
    await until(lambda: "did you mean 'SiO2'" in text_of(user, "role=alert"))
    assert text_of(user, "data-number=apex_K") == "–"


@visited
async def test_a_slider_by_decades_keeps_what_is_typed(user, session, tmp_path):
    await user.open("/")
    with user:
        field = slider("length", 0.0, 1.0, 1e4, by_decades=True, from_zero=True)
    bar = named(user, "length", ui.slider)
    assert (field.value, bar.value) == (0.0, 0.0)
    field.set_value(123.456)
    assert bar.value == pytest.approx(2.0915, abs=1e-4)
    assert field.value == 123.456
    for place, value in ((3.0, 1000.0), (0.5, 3.16), (0.0, 0.0)):
        bar.set_value(place)
        assert (field.value, bar.value) == (value, place)
