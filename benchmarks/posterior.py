"""10 000 posterior samples of the example fit: seconds, effective sample size, R-hat.

python benchmarks/posterior.py [SAMPLES]
"""

from __future__ import annotations

import sys
import time

from hotlever.estimate import fit, read_measurement
from hotlever.estimate.sampling import predictive_band, sample_posterior
from problems import EXAMPLE, table


def main():
    samples = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    result = fit(read_measurement(EXAMPLE))
    began = time.perf_counter()
    posterior = sample_posterior(result, samples=samples, processes=2)
    sampled = time.perf_counter()
    predictive_band(result, posterior)
    banded = time.perf_counter()
    taken = posterior.sizes["chain"] * posterior.sizes["draw"]
    print(
        f"{taken} posterior samples on 2 processes: {sampled - began:.0f} s (target 180 s), "
        f"{100 * posterior.acceptance_fraction.item():.0f} % of proposals accepted; "
        f"predictive band: {banded - sampled:.0f} s\n"
    )
    rows = []
    for name in posterior.quantity.values.tolist():
        fitted = result.parameters.get(name)
        value, error = (
            (fitted.value, fitted.stderr)
            if fitted
            else (result.inversion_temperature_K, result.inversion_temperature_stderr_K)
        )
        rows.append(
            (
                name,
                f"{value:.4g}",
                f"{error:.2g}",
                f"{posterior[name].mean().item():.4g}",
                f"{posterior[name].std().item():.2g}",
                f"{posterior.effective_sample_size.sel(quantity=name).item():.0f}",
                f"{posterior.rhat.sel(quantity=name).item():.4f}",
            )
        )
    table(("", "fit", "standard error", "mean", "spread", "effective samples", "R-hat"), rows)


if __name__ == "__main__":
    main()
