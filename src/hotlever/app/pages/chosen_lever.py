"""The lever that is chosen on a page, a probe and what is changed of it, and another beside it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hotlever.app.jobs import Task

NOW, _PROBE = "now", "probe:"
#: Which levers may be beside it, whatever probes there are.
_BESIDE = {
    "": "nothing",
    "vacuum": "the same in vacuum",
    "air": "the same in air",
    NOW: "the lever as it is now",
}


def files_of(lever: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the files that a task of a lever is given."""
    return (lever["probe"],) if lever["probe"] else ()


def settings(lever: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a task that say what is changed of a probe."""
    changes = {
        name: str(value).lower() if value is None or isinstance(value, bool) else value
        for name, value in lever["changes"].items()
    }
    medium = changes.pop("medium", None)
    return {"medium": medium, "set": [f"{name}={changes[name]}" for name in sorted(changes)]}


def sweep_of(lever: Mapping[str, Any]) -> Task:
    """Return the task of a sweep of the lever that is chosen, whatever the biases."""
    return Task("sweep", files_of(lever), settings(lever))


def in_python(lever: Mapping[str, Any], last: str, *imports: str) -> str:
    """Return lines of Python that end with what is done with the lever that is chosen.

    Examples
    --------
    >>> print(in_python({"probe": "", "changes": {"n_d": 5e17}}, "sweep = lever.sweep([8.0])"))
    from hotlever import Lever, Probe
    <BLANKLINE>
    lever = Lever(Probe.reference().with_(n_d=5e+17))
    sweep = lever.sweep([8.0])
    """
    name, changes = lever["probe"], dict(sorted(lever["changes"].items()))
    probe = f"Probe.from_file({name!r})" if name else "Probe.reference()"
    if changes and all(name.isidentifier() for name in changes):
        probe += f".with_({', '.join(f'{key}={value!r}' for key, value in changes.items())})"
    elif changes:
        probe += f".with_(**{changes!r})"
    heads = sorted(["from hotlever import Lever, Probe", *imports], key=lambda line: line[0] == "f")
    return "\n".join([*heads, "", f"lever = Lever({probe})", last])


# --- beside it ------------------------------------------------------------------------------------


def options_beside(probes: Iterable[str]) -> dict[str, str]:
    """Return which levers may be shown beside the one that is chosen, in words."""
    return {**_BESIDE, _PROBE: "reference probe", **{f"{_PROBE}{name}": name for name in probes}}


def lever_beside(chosen: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the probe and the changes of the lever beside that of the page; None if there is none.

    Examples
    --------
    >>> lever_beside({"beside": "air", "probe": "", "changes": {"n_d": 5e17}})
    {'probe': '', 'changes': {'n_d': 5e+17, 'medium': 'air'}}
    """
    beside = chosen["beside"]
    if not beside:
        return None
    if beside == NOW:
        return dict(chosen["kept"])
    if beside.startswith(_PROBE):
        return {"probe": beside.removeprefix(_PROBE), "changes": {}}
    return {"probe": chosen["probe"], "changes": {**chosen["changes"], "medium": beside}}


def beside_in_words(chosen: Mapping[str, Any]) -> str:
    """Return what the lever beside is called."""
    if chosen["beside"] == NOW:
        stored_lever = chosen["kept"]
        changes = ", ".join(f"{name} = {value}" for name, value in stored_lever["changes"].items())
        name = Path(stored_lever["probe"] or "reference probe").stem
        return f"{name} with {changes}" if changes else name
    name = chosen["beside"].removeprefix(_PROBE)
    return _BESIDE.get(chosen["beside"]) or Path(name or "reference probe").stem
