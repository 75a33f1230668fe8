"""The package as someone meets it in Python: words, names, coordinates, layers."""

from __future__ import annotations

import ast
import pydoc
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

import hotlever
from documents import EXAMPLES, ROOT
from hotlever.errors import InputError

SOURCE = Path(hotlever.__file__).parent
MODULES = sorted(
    ".".join(("hotlever", *path.relative_to(SOURCE).with_suffix("").parts))
    for path in SOURCE.rglob("*.py")
    # scripts of the gallery are data of the package
    if path.stem != "__init__" and "examples" not in path.relative_to(SOURCE).parts
)
PACKAGES = {f"hotlever.{path.parent.name}" for path in SOURCE.glob("*/__init__.py")}
#: From the ground up: what stands on a floor imports of those below it, and nothing beside it but
#: on the floors of single modules.
FLOORS = {
    "ground": ("errors", "types", "work"),
    "numbers and files": (
        "files",
        "piecewise",
        "quantities",
        "records",
        "spieser2017",
        "units",
    ),
    "texts": ("cache", "datasets", "text"),
    "tables and processes": ("processes", "tables"),
    "materials": ("materials",),
    "probe": ("probe",),
    "air": ("air",),
    "contact": ("contact",),
    "lever": ("lever",),
    "measurement": ("lever3d", "measurement", "raman"),
    "estimate": ("estimate",),
    "instruments": ("instruments",),
    "studies": ("studies",),
    "figures": ("figures",),
    "report": ("report",),
    "tasks": ("tasks",),
    "app": ("app",),
    "command line": ("cli",),
}
#: A module named by a text, to be loaded later.
MODULE = re.compile(r"hotlever(\.\w+)+")
SINGLE = {"ground", "numbers and files", "texts", "tables and processes"}


@pytest.mark.parametrize("name", dir(hotlever))
def test_every_word_exists_and_has_help(name):
    word = getattr(hotlever, name)
    assert name in dir(hotlever)
    assert word.__doc__


def test_the_words_of_the_story():
    story = {"Probe", "Circuit", "Material", "Lever", "read_measurement", "fit", "read_fit"}
    story |= {"calibrate", "read_calibration", "PowerLaw", "read_spectra", "Thermometer"}
    assert story <= set(dir(hotlever))
    with pytest.raises(AttributeError, match="no attribute 'Prob'"):
        _ = hotlever.Prob


def test_help_begins_with_a_tour_and_explains_no_word():
    text = pydoc.render_doc(hotlever, renderer=pydoc.plaintext)
    tour, contents = text.split("PACKAGE CONTENTS")
    assert len(tour.splitlines()) <= 30
    assert len(contents.splitlines()) < 60
    assert max(map(len, tour.splitlines())) <= 80
    names = set(re.findall(r"[A-Za-z_]+", tour))
    assert {"Probe", "Lever", "simulate", "read_measurement", "fit", "calibrate"} <= names


def test_importing_the_package_loads_nothing_heavy():
    script = "import sys, hotlever; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "scipy", "xarray", "skfem", "matplotlib"} & set(done.stdout.split())


#: What a command that solves levers imports of that which hotlever requires, with at most how many
#: modules each: what it costs to start. Whatever comes with these is theirs.
OF_A_LEVER = {
    "numpy": 180,
    "skfem": 140,
    "netgen": 20,
    "pydantic": 60,
    "typer": 40,
    "platformdirs": 10,
    "threadpoolctl": 1,
    "nbklu": 6,
}
#: The same of one that reads spectra.
OF_SPECTRA = {"numpy": 180, "pydantic": 60, "typer": 40, "platformdirs": 10, "threadpoolctl": 1}
OF_SCIPY = {"linalg", "sparse"}
#: What SciPy's optimisers bring along.
OPTIMISED = {"constants", "fft", "optimize", "spatial", "special"}


def imported_by(commands: Sequence[str], folder: Path) -> list[str]:
    """Return the modules that commands import together."""
    script = (
        "import runpy, sys\n"
        "for words in sys.argv[1:]:\n"
        "    sys.argv = ['hotlever', *words.split()]\n"
        "    try: runpy.run_module('hotlever', run_name='__main__')\n"
        "    except SystemExit as end: assert not end.code\n"
        "open('modules.txt', 'w').write(' '.join(sys.modules))"
    )
    command = [sys.executable, "-c", script, *commands]
    subprocess.run(command, cwd=folder, capture_output=True, check=True)
    return (folder / "modules.txt").read_text().split()


DATA, SPECTRA = EXAMPLES / "lever-a.csv", EXAMPLES / "raman"
HOT_PLATE = SPECTRA / "hot-plate"


@pytest.mark.parametrize(
    ("commands", "limits", "of_scipy"),
    [
        (
            ("sweep --bias 1:3:3 -o sweep.csv", "pulse --pulse 8V,5us -o pulse.csv"),
            {**OF_A_LEVER, "hotlever": 125, "scipy": 230, "xarray": 130},
            OF_SCIPY,
        ),
        (
            (f"fit {DATA} -o fit.json", f"calibrate {DATA} -o calibration.json --table table.csv"),
            {**OF_A_LEVER, "hotlever": 180, "scipy": 400},
            OF_SCIPY | OPTIMISED | {"interpolate"},
        ),
        (
            ("contact --sample polymer,100nm,silicon --radius 5nm --bias 1:3:3 -o contact.csv",),
            {**OF_A_LEVER, "hotlever": 130, "scipy": 370, "xarray": 130},
            OF_SCIPY | OPTIMISED | {"interpolate"},
        ),
        (
            (f"join {SPECTRA / 'bias-log.csv'} {SPECTRA / 'tip'} --calibrate-from {HOT_PLATE}",),
            {**OF_SPECTRA, "hotlever": 60, "scipy": 360, "xarray": 130},
            OF_SCIPY | OPTIMISED | {"ndimage"},
        ),
    ],
    ids=["solved", "estimated", "in contact", "spectra"],
)
def test_plain_commands_import_what_they_need_and_no_more(tmp_path, commands, limits, of_scipy):
    """Not matplotlib, nor Shapely, nor Dask, which xarray brings for a number out of a dataset.

    What is solved is a dataset, which brings pandas along, for as long as a fifth of a fit, and
    needs none of SciPy's optimisers and special functions, which take longer than all levers;
    estimates are not and do.
    """
    modules = imported_by(commands, tmp_path)
    assert "dask.base" not in modules
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    every = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    named = {re.split(r"[^\w-]", requirement)[0].replace("-", "_") for requirement in every}
    required = named | {"hotlever", "netgen", "skfem", "nbklu", "rich"}
    counts = Counter(name.partition(".")[0] for name in modules)
    found = {name: count for name, count in counts.items() if name in required}
    assert found.keys() <= limits.keys()
    assert {name: count for name, count in found.items() if count > limits[name]} == {}
    parts = {name.split(".")[1] for name in modules if name.startswith("scipy.")}
    assert {part for part in parts if not part.startswith("_")} - {"version"} <= of_scipy


def test_plots_of_sweeps_and_histories_load_no_dask(tmp_path):
    commands = "sweep --bias 1:3:3 -o a.csv --plot a.png", "pulse --pulse 8V,5us --plot b.png"
    modules = imported_by(commands, tmp_path)
    assert "matplotlib" in modules
    assert "dask.base" not in modules


def test_the_help_waits_for_no_numpy(tmp_path):
    """It computes nothing, and would take half as long again."""
    modules = imported_by(["--help"], tmp_path)
    assert "typer" in modules
    assert not {"numpy", "scipy", "pydantic"} & set(modules)


@pytest.mark.parametrize("stated", [None, "3"])
def test_commands_start_one_thread_of_blas_unless_told_otherwise(monkeypatch, stated):
    name = "OPENBLAS_NUM_THREADS"
    monkeypatch.delenv(name, raising=False)
    if stated:
        monkeypatch.setenv(name, stated)
    script = (
        "import atexit, os, sys; from hotlever.cli import main;"
        f"atexit.register(lambda: print(os.environ['{name}'], file=sys.stderr));"
        "sys.argv[1:] = ['--version']; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stderr.split() == [stated or "1"]


def test_datasets_offer_figures_before_matplotlib_is_loaded():
    script = (
        "import sys; from hotlever.datasets import labelled; data = labelled({'tip_K': [1.0]});"
        "print(hasattr(data, 'hotlever'), 'matplotlib' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["True", "False"]


@pytest.mark.parametrize("name", MODULES)
def test_no_module_has_the_name_of_something_in_it(name):
    """`import hotlever.estimate.fit` would give a function in its place."""
    package, _, last = name.rpartition(".")
    module = import_module(name)
    assert not hasattr(module, last)
    assert getattr(import_module(package), last, module) is module


@cache
def imports_between_modules() -> dict[str, set[str]]:
    """Return what each module imports of the others: inside functions, for types and by a text."""
    imports = {}
    for name in MODULES:
        source = Path(find_spec(name).origin).read_text(encoding="utf-8")
        imports[name] = set()
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Import):
                imports[name] |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, name
                names = {f"{node.module}.{alias.name}" for alias in node.names}
                imports[name] |= (names & {*MODULES, *PACKAGES}) or {node.module}
            elif isinstance(node, ast.Constant) and re.fullmatch(
                r"hotlever(\.\w+)+", str(node.value)
            ):
                imports[name].add(node.value)
        imports[name] = {other for other in imports[name] - {name} if other.startswith("hotlever.")}
    return imports


def test_every_package_and_module_has_a_floor():
    names = {path.stem for path in SOURCE.iterdir() if path.is_dir() or path.suffix == ".py"}
    names -= {"__init__", "__main__", "__pycache__", "examples"}
    assert sorted(names) == sorted(name for floor in FLOORS.values() for name in floor)


def test_imports_go_down():
    floor_of = {name: floor for floor, names in FLOORS.items() for name in names}
    level = {floor: number for number, floor in enumerate(FLOORS)}
    rising = []
    for module, others in imports_between_modules().items():
        for other in others:
            here, there = module.split(".")[1], other.split(".")[1]
            if here in floor_of and here != there:
                mine, other_floor = floor_of[here], floor_of[there]
                beside = mine == other_floor and mine in SINGLE
                if level[other_floor] >= level[mine] and not beside:
                    rising.append(f"{module} -> {other}")
    assert rising == []


def test_modules_do_not_import_each_other_in_circles():
    imports = imports_between_modules()
    graph = np.array([[other in names for other in MODULES] for names in imports.values()])
    _, part = connected_components(graph, connection="strong")
    circles = {MODULES[k] for k in range(len(MODULES)) if np.sum(part == part[k]) > 1}
    assert circles == set()


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
    instance = {
        "Probe": probe,
        "Lever": coarse,
        "Circuit": probe.circuit,
        "Material": probe.material,
    }[kind]
    text = repr(instance)
    assert "object at 0x" not in text
    assert len(text.splitlines()) < 40
