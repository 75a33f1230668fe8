"""The package as someone meets it in Python: words, names, coordinates, layers."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

import hotlever
from hotlever.errors import InputError

SOURCE = Path(hotlever.__file__).parent
MODULES = sorted(
    ".".join(("hotlever", *path.relative_to(SOURCE).with_suffix("").parts))
    for path in SOURCE.rglob("*.py")
    # scripts of the gallery are data of the package
    if path.stem != "__init__" and "examples" not in path.relative_to(SOURCE).parts
)
#: From the ground up: a layer imports none of those behind it.
LAYERS = (
    ("materials",),
    ("probe",),
    ("air",),
    ("lever",),
    ("lever3d", "measurement"),
    ("raman", "estimation"),
    ("calibration",),
    ("studies",),
    ("figures",),
    ("report",),
    ("tasks",),
    ("app",),
    ("cli",),
)


@pytest.mark.parametrize("name", hotlever.__all__)
def test_every_word_exists_and_has_help(name):
    word = getattr(hotlever, name)
    assert name in dir(hotlever)
    assert word.__doc__


def test_the_words_of_the_story():
    story = {"Probe", "Circuit", "Material", "Lever", "read_measurement", "fit", "read_fit"}
    story |= {"calibrate", "read_calibration", "PowerLaw", "read_spectra", "Thermometer"}
    assert story <= set(hotlever.__all__)
    with pytest.raises(AttributeError, match="no attribute 'Prob'"):
        _ = hotlever.Prob


def test_importing_the_package_loads_nothing_heavy():
    script = "import sys, hotlever; print(*{name.partition('.')[0] for name in sys.modules})"
    found = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "scipy", "xarray", "skfem", "matplotlib"} & set(found.stdout.split())


@pytest.mark.parametrize("name", MODULES)
def test_no_module_has_the_name_of_something_in_it(name):
    """`import hotlever.estimation.fit` would give a function in its place."""
    package, _, last = name.rpartition(".")
    module = import_module(name)
    assert not hasattr(module, last)
    assert getattr(import_module(package), last, module) is module


def imported(path: Path) -> set[str]:
    """Packages of hotlever that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("hotlever."):
            found.add(node.module.split(".")[1])
    return found


@pytest.mark.parametrize("layer", range(len(LAYERS)))
def test_no_layer_imports_one_above_it(layer):
    above = {name for names in LAYERS[layer + 1 :] for name in names}
    for package in LAYERS[layer]:
        for path in (SOURCE / package).rglob("*.py"):
            assert not imported(path) & above, path


def imports_between_modules() -> dict[str, set[str]]:
    """Return what each module imports of the others, anywhere and for types too."""
    of = {}
    for name in MODULES:
        source = find_spec(name).origin
        nodes = ast.walk(ast.parse(Path(source).read_text(encoding="utf-8")))
        of[name] = {
            f"{node.module}.{one.name}" if f"{node.module}.{one.name}" in MODULES else node.module
            for node in nodes
            if isinstance(node, ast.ImportFrom) and node.module
            for one in node.names
        } - {name}
    return of


def test_modules_do_not_import_each_other_in_circles():
    imports = imports_between_modules()
    graph = np.array([[other in names for other in MODULES] for names in imports.values()])
    _, part = connected_components(graph, connection="strong")
    circles = {MODULES[k] for k in range(len(MODULES)) if np.sum(part == part[k]) > 1}
    assert not circles


# --- what Python users do -----------------------------------------------------------------------


def test_a_sweep_is_found_and_drawn_by_its_bias(coarse):
    sweep = coarse.sweep([0.0, 4.0, 8.0])
    assert sweep.sel(bias=8.0).tip_K.item() == sweep.tip_K.values[2]
    assert sweep.tip_K.coords["bias"].values.tolist() == [0.0, 4.0, 8.0]
    [line] = sweep.tip_K.plot()
    np.testing.assert_array_equal(line.get_xdata(), [0.0, 4.0, 8.0])
    assert line.axes.get_xlabel() == "bias [V]"


def test_files_may_be_named_where_objects_are_meant(tmp_path, monkeypatch, coarse):
    monkeypatch.chdir(tmp_path)
    Path("probe.toml").write_text(coarse.probe.to_toml())
    assert hotlever.Lever("probe.toml").probe == coarse.probe
    with pytest.raises(InputError, match=r"none\.toml: no such file"):
        hotlever.Lever("none.toml")
    with pytest.raises(InputError, match=r"none\.csv: no such file"):
        hotlever.fit("none.csv")


def test_a_probe_otherwise_is_made_by_name():
    probe = hotlever.Probe.reference().with_(n_d=4e17, heater_width_um=3.5)
    assert (probe.material.n_d, probe.shape.heater_width_um) == (4e17, 3.5)
    with pytest.raises(InputError, match="did you mean 'n_d'"):
        probe.with_(nd=4e17)


@pytest.mark.parametrize("kind", ["Probe", "Lever", "Circuit", "Material"])
def test_what_is_shown_in_a_terminal_says_what_it_is(coarse, kind):
    probe = coarse.probe
    shown = {
        "Probe": probe,
        "Lever": coarse,
        "Circuit": probe.circuit,
        "Material": probe.material,
    }[kind]
    text = repr(shown)
    assert "object at 0x" not in text
    assert len(text.splitlines()) < 40
