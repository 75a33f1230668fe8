"""Posterior samples of the example fit, all observables and the current alone: cost and worth.

python benchmarks/posterior.py [SAMPLES]
"""

from __future__ import annotations

import sys

from hotlever.estimate import fit, read_measurement
from hotlever.estimate.sampling import predictive_band, sample_posterior
from problems import EXAMPLE, processor_time, table


def report(samples, observables=None):
    """Sample the posterior of one fit, and print it beside the standard errors."""
    result = fit(read_measurement(EXAMPLE), observables=observables)
    began = processor_time()
    posterior = sample_posterior(result, samples=samples, processes=2)
    sampled = processor_time()
    predictive_band(result, posterior)
    banded = processor_time()
    print(
        f"\n{', '.join(result.observables)}: {samples} samples, worth "
        f"{posterior.effective_sample_size.item():.0f}, {sampled - began:.0f} s of processor; "
        f"predictive band {banded - sampled:.0f} s; surrogate off by "
        f"{posterior.surrogate_error_K:.1f} K at the outermost samples\n"
    )
    rows = []
    for name in posterior.quantity.values.tolist():
        fitted = result.parameters.get(name)
        value, error = (
            (fitted.value, fitted.stderr)
            if fitted
            else (result.inversion_temperature_K, result.inversion_temperature_stderr_K)
        )
        mean, spread = posterior[name].mean().item(), posterior[name].std().item()
        rows.append((name, f"{value:.4g}", f"{error:.2g}", f"{mean:.4g}", f"{spread:.2g}"))
    table(("", "fit", "standard error", "mean", "spread"), rows)


def main():
    samples = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000
    report(samples)
    report(samples, ("current",))


if __name__ == "__main__":
    main()
