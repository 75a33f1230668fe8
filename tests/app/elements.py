"""Elements of a page, by what they say or are called, and what a user does with them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from nicegui import ui
from nicegui.testing import User
from nicegui.testing.user_interaction import UserInteraction


def all_of(user: User, kind: Any, label: str = "") -> list[Any]:
    """Return the elements of a kind, with some label."""
    there = (one for one in user.client.elements.values() if isinstance(one, kind))
    return [one for one in there if not label or one.props.get("label") == label]


def of(user: User, kind: Any, label: str = "") -> Any:
    """Return the last element of a kind, with some label."""
    return all_of(user, kind, label)[-1]


async def until(true: Callable[[], bool]) -> None:
    """Wait, ten seconds at most, until something is true."""
    for _ in range(200):
        if true():
            return
        await asyncio.sleep(0.05)
    raise AssertionError("it did not become true")


async def tell_columns(user: User) -> None:
    """Pick what the columns a and b of the file are that Fit shows: bias in V, current in mA."""
    for column, symbol, unit in (("a", "V_b", "V"), ("b", "I_h", "mA")):
        named(user, f"Column {column} is").set_value(symbol)
        await until(lambda c=column: named(user, f"Unit of column {c}").visible)  # type: ignore
        named(user, f"Unit of column {column}").set_value(unit)
        await until(lambda c=column: named(user, f"Column {c} is").value)  # type: ignore
        await asyncio.sleep(0.3)


def named(user: User, name: str, kind: Any = ui.element) -> Any:
    """Return the last element of a kind with a name for who cannot see it; None without."""
    there = [one for one in all_of(user, kind) if one.props.get("aria-label") == name]
    return there[-1] if there else None


def texts(user: User) -> list[str]:
    """Return what labels say."""
    there = user.client.elements.values()
    return [one.text for one in there if isinstance(one, ui.label) and one.visible]


def plots(user: User) -> list[Any]:
    """Return what is plotted: the figures of all plots that have points."""
    figures = [one.figure for one in all_of(user, ui.plotly)]
    return [figure for figure in figures if figure["data"][0].get("x")]


def images(user: User) -> list[str]:
    """Return what the pictures of a page show."""
    return [one.props["alt"] for one in user.client.elements.values() if one.tag == "img"]


def press(user: User, text: str) -> None:
    """Press the last button that says something: that of the page, not the one that leads to it."""
    buttons = [one for one in user.client.elements.values() if isinstance(one, ui.button)]
    named = [one for one in buttons if text in (one.text, one.props.get("aria-label"))]
    UserInteraction(user, {named[-1]}, None).click()
