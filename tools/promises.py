"""Count what stands behind the promises of docs/promises.md: ``python tools/promises.py``."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "hostile")]


def hostile_counts() -> dict[str, int]:
    """Return how many hostile cases there are with ``make test-hostile``."""
    import test_arguments_at_random as arguments
    import test_files_at_random as files
    import test_full_disks as disks
    import test_kills as kills
    import test_memory as memory

    options = [choices for _, wrong in arguments.WRONG for choices in wrong.values()]
    return {
        "kinds of hostile files": len(files.NAMES),
        "hostile files of `make test-hostile`": files.CASES,
        "arguments and options that are given wrong values": len(options),
        "wrong values of theirs": sum(map(len, options)),
        "hostile argument lists of `make test-hostile`": arguments.CASES,
        "the same by a process of its own": arguments.PROCESSES,
        "commands on a disk that is full at a random byte": len(disks.WRITERS) * disks.DISKS,
        "kills of a batch on this machine": kills.KILLS["local"],
        "kills of a batch on a cluster": kills.KILLS["cluster"],
        "kills of a posterior": kills.KILLS["posterior"],
        "rows of the data whose memory is measured": memory.ROWS,
    }


def main() -> None:
    """Print them as a table."""
    print(*rows(hostile_counts()), sep="\n")


def rows(counts: dict[str, int]) -> list[str]:
    """Return counts as rows of a table."""
    return [f"| {what} | {count:,} |".replace(",", " ") for what, count in counts.items()]


if __name__ == "__main__":
    main()
