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

from hotlever.cache import CACHE_VARIABLE
from hotlever.probe import Probe, ProbeMesh
from hotlever.probe.layout import BorderTaper
from hotlever.spieser2017 import RAMP

BIAS = RAMP
EXAMPLE = Path(__file__).parents[1] / "examples" / "lever-a.csv"
PEER = Path(__file__).parent / "fenics" / "peer.py"
DEBIAN_PYTHON = "/usr/bin/python3"


def peer_problem(
    probe: Probe, mesh: ProbeMesh, *, degree: int, quadrature: int, bias: Sequence[float]
) -> dict[str, Any]:
    """Return a mesh, material and circuit as the peer reads them."""
    layout, triangles = mesh.layout, mesh.elements
    regions: dict[str, dict[str, Any]] = {}
    for index, region in enumerate(layout.regions):
        regions[str(index)] = {"name": region.name, "doping": "high"}
        if isinstance(region.taper, BorderTaper):
            regions[str(index)] |= {"doping": "bordered", "borders_um": region.taper.borders}
        elif region.taper is not None:
            regions[str(index)] |= {
                "doping": "tapered",
                "centre_um": region.taper.centre,
                "axis": region.taper.axis,
                "length_um": region.taper.length_um,
            }
    return {
        "points_um": triangles.p.T.tolist(),
        "triangles": triangles.t.T.tolist(),
        "region": mesh.region.tolist(),
        "regions": regions,
        "terminals": {
            name: triangles.facets[:, facets].T.tolist()
            for name, facets in mesh.terminal_facets.items()
        },
        "tip_um": layout.tip,
        "thickness_um": layout.thickness_um,
        "circuit": probe.circuit.model_dump(),
        "material": probe.material.model_dump(),
        "bias_V": list(bias),
        "quadrature_degree": quadrature,
        "degree": degree,
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
    found = shutil.which(DEBIAN_PYTHON) and (
        subprocess.run([DEBIAN_PYTHON, "-c", "import dolfin"], capture_output=True).returncode == 0
    )
    if not found:
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


def fit_command(cache: str | Path) -> None:
    """Run the whole command ``hotlever fit`` on the example, with its cache in a folder."""
    with tempfile.TemporaryDirectory() as folder:
        fit = [sys.executable, "-c", "from hotlever.cli import main; main()", "fit"]
        subprocess.run(
            [*fit, str(EXAMPLE), "-o", str(Path(folder, "fit.json"))],
            check=True,
            env=os.environ | {CACHE_VARIABLE: str(cache)},
            capture_output=True,
        )


def table(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print a Markdown table."""
    cells = [list(columns), *[[str(cell) for cell in row] for row in rows]]
    widths = [max(len(row[k]) for row in cells) for k in range(len(columns))]
    for number, row in enumerate(cells):
        line = " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print(f"| {line} |")
        if number == 0:
            print("|" + "|".join("-" * (width + 2) for width in widths) + "|")
