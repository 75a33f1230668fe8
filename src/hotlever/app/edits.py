"""The text of a probe file with a value or a layer set.

A text is edited line by line, so that what nobody touched stays as it was written.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from hotlever.errors import InputError, excerpt
from hotlever.text import as_toml

_BARE = re.compile(r"[A-Za-z0-9_-]+")
#: What layers of a drawing may be beside films and parts, which have names of their own.
BODIES, FILM, TERMINALS = ("silicon", "body"), "film", ("supply", "ground", "reader")

Section = tuple[str, ...]


@dataclass
class _Entry:
    """Lines of a file that belong together: a header, a key with its value, or a line of none."""

    lines: list[str]
    section: Section
    key: str | None = None
    is_header: bool = False


def _entries(text: str) -> list[_Entry]:
    """Return a text in its parts; from where it is no TOML, it is one part."""
    entries: list[_Entry] = []
    section: Section = ()
    waiting: list[str] = []
    for line in text.splitlines():
        waiting.append(line)
        if len(waiting) > 1 and line.endswith(",") and "#" not in line:
            continue  # no value ends so: long outlines took minutes where each line was tried
        try:
            content = tomllib.loads("\n".join(waiting))
        except ValueError:
            continue
        is_header = len(waiting) == 1 and line.lstrip().startswith("[")
        if is_header:
            section = _only_path(content)
        key = None if is_header else next(iter(content), None)
        entries.append(_Entry(waiting, section, key, is_header))
        waiting = []
    return [*entries, _Entry(waiting, section)] if waiting else entries


def _only_path(content: Mapping[str, Any]) -> Section:
    """Return the keys of sections inside each other."""
    path: list[str] = []
    while content:
        name, content = next(iter(content.items()))
        path.append(name)
    return tuple(path)


def _text(entries: Sequence[_Entry]) -> str:
    return "\n".join([line for entry in entries for line in entry.lines] + [""])


def _quoted(name: str) -> str:
    return name if _BARE.fullmatch(name) else as_toml(name)


def with_value(text: str, section: Section, key: str, value: Any) -> str:
    """Return a probe file with a value set, or with None taken out.

    A comment behind the value goes: it was of the one before.

    Examples
    --------
    >>> print(with_value("[probe]\\nthickness_um = 1 # mine\\n", ("probe",), "thickness_um", 2.0))
    [probe]
    thickness_um = 2.0
    <BLANKLINE>
    """
    entries = _entries(text)
    placeholder = re.compile(rf"#\s*{re.escape(_quoted(key))}\s*=")
    inside = [entry for entry in entries if entry.section == section]
    own = [entry for entry in inside if entry.key == key]
    if value is None:
        return _text([entry for entry in entries if entry not in own])
    line = f"{_quoted(key)} = {as_toml(value)}"
    own += [entry for entry in inside if placeholder.match(entry.lines[0].strip())]
    if own:
        own[0].lines, own[0].key = [line], key
        return _text(entries)
    new = _Entry([line], section, key)
    if any(entry.is_header for entry in inside):
        last = next(entry for entry in reversed(inside) if entry.is_header or entry.key)
        return _text(_after(entries, last, new))
    head = _Entry(["", f"[{'.'.join(map(_quoted, section))}]"], section, is_header=True)
    alike = [entry for entry in entries if entry.section[:1] == section[:1] and entry.key]
    return _text(_after(entries, alike[-1] if alike else None, head, new))


def same(first: str, second: str) -> bool:
    """Return whether two probe files say the same."""
    try:
        return tomllib.loads(first) == tomllib.loads(second)
    except ValueError:
        return first == second


def _after(entries: list[_Entry], last: _Entry | None, *new: _Entry) -> list[_Entry]:
    """Return entries with new ones behind one of them, or at the end."""
    at = (
        len(entries)
        if last is None
        else next(number for number, entry in enumerate(entries, start=1) if entry is last)
    )
    return [*entries[:at], *new, *entries[at:]]


def has_section(text: str, section: Section) -> bool:
    """Return whether a probe file has a section."""
    try:
        content: Any = tomllib.loads(text)
    except ValueError:
        return False
    for name in section:
        content = content.get(name) if isinstance(content, dict) else None
    return isinstance(content, dict)


def without_section(text: str, section: Section) -> str:
    """Return a probe file without a section."""
    return _text([entry for entry in _entries(text) if entry.section != section])


def with_material_renamed(text: str, old: str, new: str) -> str:
    """Return a probe file in which a material has another name, wherever it is named.

    Layers are made of it, priors are of its parameters, and a monitor may be the mean over it.

    Raises
    ------
    InputError
        If the name is taken or empty, or the text says it in a way that is not edited.

    Examples
    --------
    >>> text = '[layers.track]\\nmaterial = "film"\\n[materials.film]\\nkind = "metal-film"\\n'
    >>> print(with_material_renamed(text, "film", "Pt"))
    [layers.track]
    material = "Pt"
    [materials.Pt]
    kind = "metal-film"
    <BLANKLINE>
    """
    expected = tomllib.loads(text)
    materials, new = expected.get("materials", {}), new.strip()
    if not new or new in materials:
        raise InputError(f"found '{excerpt(new)}', expected a name that no material has")
    layers, of_old = expected.get("layers", {}), f"{old}."
    expected["materials"] = {new if name == old else name: own for name, own in materials.items()}
    if "prior" in expected:
        expected["prior"] = {
            new + name.removeprefix(old) if name.startswith(of_old) else name: stated
            for name, stated in expected["prior"].items()
        }
    # the keys that name it, in sections of which kind; a layer of its name comes before it
    keys = {"layers": "material"} | ({} if old in layers else {"monitor": "region"})
    for part, key in keys.items():
        for own in expected.get(part, {}).values():
            if isinstance(own, dict) and own.get(key) == old:
                own[key] = new
    entries = _entries(text)
    for entry in entries:
        part = entry.section[0] if entry.section else ""
        if entry.is_header and entry.section == ("materials", old):
            entry.lines = [f"[materials.{_quoted(new)}]"]
        elif entry.is_header or entry.key is None:
            continue
        elif part == "prior" and entry.key.startswith(of_old):
            name = new + entry.key.removeprefix(old)
            entry.lines[0] = entry.lines[0].replace(as_toml(entry.key), as_toml(name), 1)
        elif part in keys:
            named = rf"""(\b{keys[part]}\s*=\s*)(["']){re.escape(old)}\2"""
            entry.lines = [
                re.sub(named, lambda match: match[1] + as_toml(new), line) for line in entry.lines
            ]
    renamed = _text(entries)
    if tomllib.loads(renamed) != expected:
        raise InputError(f"'{excerpt(old)}': expected to be renamed in the text of the probe file")
    return renamed


# --- layers ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LayerRow:
    """What a layer of a drawing is.

    Attributes
    ----------
    label : str
        The layer's name in the drawing, or of the outlines that the probe file lists.
    drawn : str or list
        It, or the outlines.
    part : str
        ``layers`` or ``terminals``; empty if it is not used.
    name : str
        Its key there.
    material : str
        Of ``[materials]``; empty for the silicon of ``[material]``.
    thickness_um : float or None
        Of a film.
    """

    label: str
    drawn: Any
    part: str = ""
    name: str = ""
    material: str = ""
    thickness_um: float | None = None

    @property
    def role(self) -> str:
        """What it is, in one word."""
        if self.part == "layers":
            return "body" if self.name in BODIES else FILM
        return self.name


def drawn_in(layer: Any) -> Any:
    """Return what a layer or terminal of a probe file is drawn in: a name, or outlines."""
    return layer.get("drawn", layer.get("area")) if isinstance(layer, dict) else layer


def with_layer(text: str, row: LayerRow, role: str, material: str) -> str:
    """Return a probe file in which a layer of a drawing is something else.

    The row says what it was when it was shown; that it may have got another name or thickness
    since, the text says. A ``material`` that begins with ``+`` is a new one: its kind, and behind
    ``/`` its preset. Materials that no layer is made of any more go.
    """
    values = tomllib.loads(text)
    if row.name not in values.get(row.part, {}):
        for part in ("layers", "terminals"):
            for name, layer in values.get(part, {}).items():
                if drawn_in(layer) == row.drawn:
                    row = replace(row, part=part, name=name)
    now = values.get(row.part, {}).get(row.name)
    thickness = now.get("thickness_um") if isinstance(now, dict) else None
    if material.startswith("+"):
        kind, _, preset = material[1:].partition("/")
        material = _free(preset or kind, _names(text))
        text = with_value(text, ("materials", material), "kind", kind)
        if preset:
            text = with_value(text, ("materials", material), "preset", preset)
    if row.part:
        text = with_value(text, (row.part,), row.name, None)
        text = without_section(text, (row.part, row.name))
    if role in TERMINALS:
        text = with_value(text, ("terminals",), role, row.drawn)
    elif role == "body":
        for name in BODIES:
            text = without_section(with_value(text, ("layers",), name, None), ("layers", name))
        text = _with_drawn(text, "body" if material else "silicon", row.drawn, material, None)
    elif role == FILM:
        text = with_value(text, ("layers",), row.name, None)
        # a name of its own stays, one after what it was made of does not
        is_own = row.role == FILM and bool(row.material) == bool(material)
        is_own = is_own and not (row.material and row.name.startswith(row.material))
        layers = set(tomllib.loads(text).get("layers", {}))
        name = row.name if is_own else _free(material or "heater", layers)
        text = _with_drawn(text, name, row.drawn, material, thickness)
    elif role:
        text = with_value(text, (row.part,), row.name, row.drawn)
    return _without_unused(text)


def _names(text: str) -> set[str]:
    return set(tomllib.loads(text).get("materials", {}))


def _free(name: str, existing_names: set[str]) -> str:
    number, free = 1, name
    while free in existing_names:
        number += 1
        free = f"{name}-{number}"
    return free


def _with_drawn(text: str, name: str, drawn: Any, material: str, thickness: float | None) -> str:
    if not material:
        return with_value(text, ("layers",), name, drawn)
    for key, value in (("drawn", drawn), ("material", material), ("thickness_um", thickness)):
        text = with_value(text, ("layers", name), key, value)
    return text


def _without_unused(text: str) -> str:
    """Return a probe file without materials that no layer is made of: it would be refused."""
    values = tomllib.loads(text)
    layers = values.get("layers", {}).values()
    used = {layer.get("material") for layer in layers if isinstance(layer, dict)}
    for name in values.get("materials", {}):
        if name not in used:
            text = without_section(text, ("materials", name))
    if "material" in values and layers and all(isinstance(layer, dict) for layer in layers):
        text = without_section(text, ("material",))
    return text


# --- what was typed ------------------------------------------------------------------------------


def typed(key: str, text: str) -> Any:
    """Return what was typed in a field as a value of a probe file; None if nothing was."""
    text = text.strip()
    numbers = [_as_number(part) for part in text.split(",")] if key == "tip_um" else []
    if len(numbers) > 1 and None not in numbers:
        return numbers
    number = _as_number(text)
    return number if number is not None else text or None


def _as_number(text: str) -> float | None:
    """Return a finite number; None if it is none: others are no values of a probe file."""
    try:
        number = float(text.replace("−", "-"))
    except ValueError:
        return None
    return number if math.isfinite(number) else None
