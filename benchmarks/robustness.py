"""A thousand random levers: every sweep converges, or ends in a typed error with its bias.

python benchmarks/robustness.py [COUNT]
"""

from __future__ import annotations

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))

from test_lever_physics import BIAS, random_probe

from hotlever.errors import BranchEndError, HotleverError
from hotlever.lever import Lever
from hotlever.probe import MeshOptions


def outcome(seed: int) -> str:
    probe = random_probe(np.random.default_rng(seed))
    try:
        sweep = Lever(probe, MeshOptions(refinement=0.4)).sweep(BIAS)
    except BranchEndError as error:
        kind = "melts" if "melts" in str(error) else "branch ends at a fold"
        named = f"{error.bias_reached:.4f} V" in str(error)
        return f"typed error: {kind}" + ("" if named else ", bias not named")
    except HotleverError as error:
        return f"FAILED, seed {seed}: {error}"
    return "converged, with a jump" if "jumps" in sweep.attrs["notes"] else "converged"


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        outcomes = Counter(pool.map(outcome, range(count), chunksize=10))
    for text, number in outcomes.most_common():
        print(f"{number:5d}  {text}")


if __name__ == "__main__":
    main()
