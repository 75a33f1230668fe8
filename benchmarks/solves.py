"""What an estimate solves: curves, states, factorisations, solves by phase.

Curves are levers that are linearised, with the derivatives that are asked for. Factorisations
and solves are those of sparse matrices, one for each state and right-hand side. The search is that
of the optimiser, a confirmation a curve on the full mesh between two searches; profile and budget
belong to a calibration.

Run: python benchmarks/solves.py [ARGUMENTS OF hotlever fit OR calibrate ...]
"""

from __future__ import annotations

import os
import shlex
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from functools import wraps
from io import StringIO
from typing import Any

import hotlever.estimate.tip_temperature as tips
from hotlever.cache import CACHE_VARIABLE
from hotlever.cli import main as command
from hotlever.estimate.experiment import Predictor
from hotlever.estimate.optimiser import Optimiser
from hotlever.lever.full_space import FullSpace, SparseFactors
from hotlever.lever.similar import SimilarLevers
from problems import EXAMPLE, table

COMMANDS = (f"fit {EXAMPLE} -o out.json", f"calibrate {EXAMPLE} -o out.json")
KINDS = ("curves", "states", "factorisations", "solves")


class Count:
    """Counts what is solved while commands run, by phase and by the unknowns of the mesh."""

    def __init__(self) -> None:
        self.phases = ["rest"]
        self.counts: Counter[tuple[str, int, str]] = Counter()

    def add(self, size: int, kind: str, number: int = 1) -> None:
        """Count some in the phase that is under way."""
        self.counts[self.phases[-1], size, kind] += number

    def phase(self, owner: Any, method: str, name: str) -> None:
        """Call what a function does by the name of a phase."""

        def during(function: Callable[..., Any], *args: Any, **named: Any) -> Any:
            self.phases.append(name)
            try:
                return function(*args, **named)
            finally:
                self.phases.pop()

        _wrap(owner, method, during)

    def start(self) -> None:
        """Count from now on."""
        self.phase(Optimiser, "solve", "search")
        self.phase(Predictor, "confirm", "confirm")
        self.phase(tips, "profile_of_tip", "profile")

        def linearised(function: Callable[..., Any], levers: Any, *args: Any, **named: Any) -> Any:
            found = function(levers, *args, **named)
            size = found.branch.equations.space.size
            self.add(size, "curves")
            self.add(size, "states", found.branch.u.size)
            return found

        def factorised(function: Callable[..., Any], space: Any, tangent: Any, *args: Any) -> Any:
            self.add(space.size, "factorisations", tangent.sigma.shape[-1])
            return function(space, tangent, *args)

        def solved(
            function: Callable[..., Any], factors: Any, right: Any, *args: Any, **named: Any
        ) -> Any:
            self.add(len(right) - 1, "solves", right[0].size)
            return function(factors, right, *args, **named)

        _wrap(SimilarLevers, "linearised", linearised)
        _wrap(FullSpace, "factorised", factorised)
        _wrap(SparseFactors, "solve", solved)


def _wrap(owner: Any, name: str, around: Callable[..., Any]) -> None:
    function = getattr(owner, name)

    @wraps(function)
    def wrapped(*args: Any, **named: Any) -> Any:
        return around(function, *args, **named)

    setattr(owner, name, wrapped)


@contextmanager
def empty_folder() -> Iterator[None]:
    """Work in a folder of its own, with nothing in hotlever's cache."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = os.path.join(folder, "cache")
        os.chdir(folder)
        yield
        os.chdir("/")


def main() -> None:
    count = Count()
    count.start()
    asked = [shlex.join(sys.argv[1:])] if sys.argv[1:] else COMMANDS
    for words in map(shlex.split, asked):
        count.counts.clear()
        with empty_folder(), redirect_stdout(StringIO()):
            try:
                command(words)
            except SystemExit as end:
                if end.code:
                    raise
        print(f"\nhotlever {words[0]}\n")
        rows = sorted({(phase, size) for phase, size, _ in count.counts})
        table(
            ("phase", "unknowns", *KINDS),
            [
                (phase, size, *(count.counts[phase, size, kind] for kind in KINDS))
                for phase, size in rows
            ],
        )


if __name__ == "__main__":
    main()
