"""What a sweep with thermoelectricity or radiation costs beside a plain one.

    python benchmarks/physics_cost.py [RUNS]

25 biases of the reference probe on the default mesh; mesh and operators are made beforehand, so
that all is the sweep's own. Processor seconds of several runs (15 by default) of all kinds in turn,
so that a slow spell of the machine meets all; medians, of the times and of the ratios in each turn.
"""

from __future__ import annotations

import sys
from statistics import median

from hotlever.lever import Lever
from hotlever.probe import Probe
from problems import BIAS, processor_seconds, table

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 15
#: At most so many times a plain sweep.
TARGETS = {"thermoelectric": 1.3, "radiation": 1.1}
PLAIN, FIRST = "neither", "thermoelectric, the first in a process"


def main() -> None:
    reference = Probe.reference()
    lever = Lever(reference)

    def levers(run: int) -> dict[str, Lever]:
        """Levers of nothing solved yet, by name."""
        electric = reference.with_physics(("thermoelectric",))
        probes = {
            PLAIN: reference,
            "thermoelectric": electric,
            "thermoelectric, other polarity": electric,
            # Fermi integrals of an exponent that no run had are tabulated anew
            FIRST: electric.with_(scattering_exponent=1e-6 * (run + 1)),
            "radiation": reference.with_physics(("radiation",)),
            "both": reference.with_physics(("thermoelectric", "radiation")),
        }
        return {name: lever.with_probe(probe) for name, probe in probes.items()}

    times: dict[str, list[float]] = {}
    states: dict[str, int] = {}
    for run in range(-1, RUNS):
        for name, of_probe in levers(run).items():
            bias = -BIAS if "polarity" in name else BIAS
            seconds = processor_seconds(lambda of_probe=of_probe, bias=bias: of_probe.sweep(bias))
            states[name] = of_probe.branch_to(bias[-1]).u.size
            if run >= 0:  # the first loads what is loaded where it is wanted
                times.setdefault(name, []).append(seconds)
    rows = []
    for name, seconds in times.items():
        ratio = median(own / plain for own, plain in zip(seconds, times[PLAIN], strict=True))
        target = f"{TARGETS[name]:g}" if name in TARGETS else ""
        rows.append((name, states[name], f"{median(seconds):.3f}", f"{ratio:.2f}", target))
    table(("with", "states solved", "sweep (s)", "times a plain one", "target"), rows)


if __name__ == "__main__":
    main()
