"""The page Reader: what a lever reads at a distance that is none of those that are solved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from elements import named
from nicegui import ui
from nicegui.testing import User
from test_app_pages import text_of, until, visit

from hotlever.app import approaching
from hotlever.app.session import Session
from hotlever.lever import Lever
from hotlever.lever.reader import over_surface
from hotlever.probe import MeshOptions, Probe

#: What is tested does not depend on it.
CHEAP = MeshOptions(heater=0.5, corner=0.25, lever=0.2, panels=0.25)


def test_reader_shows_what_the_lever_reads_between_the_distances_that_are_solved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed = {"_DISTANCES": 3, "_NEAREST_UM": 0.4, "_FARTHEST_UM": 1.0, "COARSE": CHEAP}
    for name, value in changed.items():
        monkeypatch.setattr(approaching, name, value)
    over = {"medium": "air", "accommodation": 1.0, "surface_gap_um": 0.5}
    lever = Lever(Probe.reference().with_(**over), CHEAP)

    def read_at(bias: float) -> xr.Dataset:
        """Return what is read where the air jumps as the command has it: as at the tip, nearest."""
        near = Lever(lever.probe.with_(surface_gap_um=0.4), CHEAP)
        jump_K = round(near.solve([bias])[0].tip_K)
        jumping = lever.with_probe(lever.probe.with_(jump_temperature_K=jump_K))
        return over_surface(jumping, [0.5], [bias]).squeeze()

    data = read_at(9.0)

    async def story(user: User, session: Session) -> None:
        session.chosen["reader"] = {"probe": None, "distance_um": 0.5, "bias": 9.0}
        await user.open("/reader")
        await until(lambda: "coarse lever: voltage" in text_of(user, "aria-live=polite"))

        def number(key: str) -> float:
            return float(text_of(user, f"data-number={key}").split()[0].partition("·")[0])

        # cubic between values and slopes, and what has no slope of its own
        assert number("reader_V") == pytest.approx(data.reader_V.item(), rel=1e-4)
        assert number("reader_ohm") == pytest.approx(data.reader_ohm.item(), rel=2e-4)
        slope = 10.0 * data.dlnR_dz_per_um.item()
        assert number("dlnR_dz_per_um") == pytest.approx(slope, rel=2e-2)
        resolution = 1e3 * data.resolution_nm_per_rtHz.item()
        assert number("resolution_nm_per_rtHz") == pytest.approx(resolution, rel=2e-2)
        await user.should_see("it is taken as 1")
        await user.should_see(
            "hotlever reader --distance 0.4um:1.6um:10 --medium air --amplifier 5nV --bias 9V "
            "-o reference.reader.csv"
        )
        # another tip temperature, at which the air jumps by less
        named(user, "Bias V_b", ui.number).set_value(5.0)
        await until(lambda: "moving" in text_of(user, "aria-live=polite"))
        await until(lambda: "coarse lever: voltage" in text_of(user, "aria-live=polite"))
        assert number("reader_V") == pytest.approx(read_at(5.0).reader_V.item(), rel=2e-4)

    visit(tmp_path, story)


def test_a_tilted_surface_is_asked_for_only_where_it_is_below_the_lever() -> None:
    described = [
        approaching.described(None, None, tilt)["nearest_um"]  # type: ignore[arg-type]
        for tilt in (0.0, 2.0, -2.0)
    ]
    front, base = np.tan(np.radians(2.0)) * np.array([54.4 - 48.58, 48.58])
    assert described[0] == 0.2
    assert front < described[1] < front + 0.2
    assert base < described[2] < base + 0.3
