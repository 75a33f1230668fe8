"""What the benchmarks share: our problems as files for the FEniCS peer, times, and tables."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from shapely import Polygon, union_all

from beyond_the_paper import reduced_seebeck_polynomial
from hotlever.cache import CACHE_VARIABLE
from hotlever.materials import Kind, full_name
from hotlever.materials.kinds import PSilicon, Silicon
from hotlever.probe import Probe, ProbeMesh
from hotlever.probe.drawing import Drawing
from hotlever.probe.layout import BorderTaper, Region
from hotlever.spieser2017 import RAMP

BIAS = np.array(RAMP)
EXAMPLE = Path(__file__).parents[1] / "src" / "hotlever" / "examples" / "lever-a.csv"
PEER = Path(__file__).parent / "fenics" / "peer.py"
DEBIAN_PYTHON = "/usr/bin/python3"


def peer_problem(
    probe: Probe,
    mesh: ProbeMesh,
    *,
    degree: int,
    quadrature: int,
    bias: Sequence[float],
    tolerance_K: float = 1e-6,
) -> dict[str, Any]:
    """Return a mesh, materials and circuit as the peer reads them."""
    layout, triangles, kinds = mesh.layout, mesh.elements, probe.made_of
    stacks = [_stack(region, layout.thickness_um) for region in layout.regions]
    # regions without a taper that are made of the same are one to the peer
    unique = [stack for number, stack in enumerate(stacks) if stack not in stacks[:number]]
    of_region = np.array([unique.index(stack) for stack in stacks])
    named = {name: _parameters(kind) for name, kind in kinds.items()}
    return {
        "points_um": triangles.p.T.tolist(),
        "triangles": triangles.t.T.tolist(),
        "stack": of_region[mesh.region].tolist(),
        "stacks": unique,
        "materials": {
            name: {
                "kind": kinds[name].kind,
                "parameters": {own: full_name(name, own) for own in own_values},
                **(_thermoelectric(kinds, name) if probe.physics.thermoelectric else {}),
            }
            for name, own_values in named.items()
        },
        "parameters": {
            full_name(name, own): value
            for name, own_values in named.items()
            for own, value in own_values.items()
        },
        "terminals": {
            name: probe.circuit.contact(name).model_dump()
            | {"edges": triangles.facets[:, facets].T.tolist()}
            for name, facets in mesh.terminal_facets.items()
        },
        "circuit": {
            name: getattr(probe.circuit, name)
            for name in ("series_resistance_ohm", "base_temperature_K", "swept")
        },
        "physics": probe.physics.effects,
        "tip_um": layout.tip,
        "bias_V": list(bias),
        "quadrature_degree": quadrature,
        "degree": degree,
        "tolerance_K": tolerance_K,
    }


def _stack(region: Region, thickness_um: float) -> dict[str, Any]:
    """Return what lies on one another in a region, the body first."""
    films: list[dict[str, Any]] = [
        {"material": film.material, "thickness_um": film.thickness_um or thickness_um}
        for film in region.stack
    ]
    if isinstance(region.taper, BorderTaper):
        films[0] |= {"taper": {"borders_um": region.taper.borders}}
    elif region.taper is not None:
        films[0] |= {
            "taper": {
                "centre_um": region.taper.centre,
                "axis": region.taper.axis,
                "length_um": region.taper.length_um,
            }
        }
    if region.taper is not None:
        films[0] |= {"dopant_from": region.dopant_from}
    return {"films": films}


def _thermoelectric(kinds: dict[str, Kind], name: str) -> dict[str, Any]:
    """Return what the peer takes as given of the Seebeck coefficient of one of the materials.

    The Fermi integrals, and that high-doped silicon has the carriers of the silicon that it dopes.
    """
    kind = kinds[name]
    if not isinstance(kind, Silicon):
        return {}
    holes = any(isinstance(other, PSilicon) for other in kinds.values())
    return {
        "sign": 1 if holes else -1,
        "reduced_seebeck": reduced_seebeck_polynomial(kind.scattering_exponent),
    }


def _parameters(kind: Kind) -> dict[str, float]:
    """Return the parameters of a material that matter to the peer.

    An impurity exponent of 0, the paper's, is left out, so that the peer raises nothing to it.
    """
    values = {name: getattr(kind, name) for name in kind.parameters}
    return {
        name: value for name, value in values.items() if (name, value) != ("impurity_exponent", 0.0)
    }


def solve_with_peer(problem: dict[str, Any], *, plain: bool = False) -> dict[str, Any]:
    """Solve a problem with legacy FEniCS in a process of its own."""
    check_peer()
    with tempfile.TemporaryDirectory() as folder:
        question, answer = Path(folder, "problem.json"), Path(folder, "result.json")
        question.write_text(json.dumps(problem))
        command = [DEBIAN_PYTHON, str(PEER), str(question), "-o", str(answer)]
        subprocess.run(
            command + ["--plain"] * plain,
            check=True,
            env=_peer_environment(folder),
            stdout=subprocess.DEVNULL,
        )
        return json.loads(answer.read_text())


@contextmanager
def peer_server(
    problem: dict[str, Any], *, plain: bool = False
) -> Iterator[Callable[[dict[str, float]], dict[str, Any]]]:
    """Give a function that sweeps with legacy FEniCS, which keeps its mesh and forms.

    It takes material values and returns results; ``error`` where the peer found no solution.
    """
    check_peer()
    with tempfile.TemporaryDirectory() as folder:
        question = Path(folder, "problem.json")
        question.write_text(json.dumps(problem))
        command = [DEBIAN_PYTHON, str(PEER), str(question), "--serve"] + ["--plain"] * plain
        with subprocess.Popen(
            command,
            env=_peer_environment(folder),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as process:

            def answer() -> dict[str, Any]:
                for line in process.stdout:
                    if line.startswith("{"):  # dolfin may print lines of its own
                        return json.loads(line)
                sys.exit("legacy FEniCS stopped")

            def ask(material: dict[str, float]) -> dict[str, Any]:
                process.stdin.write(json.dumps(material) + "\n")
                process.stdin.flush()
                return answer()

            answer()
            yield ask
            process.stdin.close()


def _peer_environment(folder: str) -> dict[str, str]:
    return {
        "PATH": os.environ["PATH"],
        "HOME": os.environ.get("HOME", folder),  # keeps the peer's compiled forms
        "OMP_NUM_THREADS": "1",
    }


def check_peer() -> None:
    """Stop, saying how to install it, if legacy FEniCS is not there."""
    installed = shutil.which(DEBIAN_PYTHON) and (
        subprocess.run([DEBIAN_PYTHON, "-c", "import dolfin"], capture_output=True).returncode == 0
    )
    if not installed:
        sys.exit("legacy FEniCS is not installed: run benchmarks/fenics/install.sh (Debian)")


def processor_time() -> float:
    """Return the processor time (s) of this process and of those that it started and that ended.

    Other work on the machine lengthens it much less than the time on the clock.
    """
    return sum(os.times()[:4])


def processor_seconds(action: Callable[[], object], runs: int = 1) -> float:
    """Return the median processor time (s) of some runs of an action."""
    times = []
    for _ in range(runs):
        began = processor_time()
        action()
        times.append(processor_time() - began)
    return median(times)


def run_python(
    arguments: Sequence[str],
    folder: str | Path,
    cache: str | Path,
    source: str | Path | None = None,
) -> None:
    """Run Python with some arguments in a folder, quietly, with hotlever's cache in another.

    Modules may come from a source folder, before all others.
    """
    environment = os.environ | {CACHE_VARIABLE: str(cache)}
    # what is installed is compiled once
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    if source is not None:
        environment["PYTHONPATH"] = str(source)
    subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        check=True,
        capture_output=True,
    )


def fit_command(cache: str | Path) -> None:
    """Run the whole command ``hotlever fit`` on the example, with its cache in a folder."""
    with tempfile.TemporaryDirectory() as folder:
        run_python(["-m", "hotlever", "fit", str(EXAMPLE), "-o", "fit.json"], folder, cache)


def table(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print a Markdown table."""
    cells = [list(columns), *[[str(cell) for cell in row] for row in rows]]
    widths = [max(len(row[k]) for row in cells) for k in range(len(columns))]
    for number, row in enumerate(cells):
        line = " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print(f"| {line} |")
        if number == 0:
            print("|" + "|".join("-" * (width + 2) for width in widths) + "|")


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def drawn_reference(layer: str, shift_um: float) -> Probe:
    """The reference probe as a drawing, one of whose layers is drawn larger."""
    layout = Probe.reference().layout()
    sections = Drawing.of_layout(layout).sections()
    (x0, y0), (x1, y1) = layout.heater.box
    away = shift_um if layer == "heater" else 0.0
    # the window is wider than the silicon, as is usual
    sections["layers"]["heater"] = box(x0 - away, y0 - 1 - away, x1 + away, y1 + 1 + away)
    if layer == "silicon":
        ends = {end.name: sorted((end.start[1], end.end[1])) for end in layout.terminals}
        # legs end on their line
        longer = [Polygon(box(-1.0, low, 0.0, high)) for low, high in ends.values()]
        (_, low), (right, high) = layout.box
        whole = union_all([layout.polygon, *longer]).buffer(shift_um, join_style="mitre")
        inside = whole.intersection(Polygon(box(0.0, low - 1, right + 1, high + 1)))
        sections["layers"]["silicon"] = [list(inside.exterior.coords)[:-1]]
        sections["terminals"] = {
            name: [[0.0, low - shift_um], [0.0, high + shift_um]]
            for name, (low, high) in ends.items()
        }
    return Probe.from_sections(sections, "drawn")
