"""The Seebeck coefficient of silicon: Fermi integrals of two carriers against what was measured.

The law is stated here on its own, without hotlever, so that hotlever's can be tested against it.
The published numbers and their sources are in `seebeck_of_silicon.toml`.

Run: python benchmarks/seebeck.py
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.chebyshev import chebpts1
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

PUBLISHED = Path(__file__).with_name("seebeck_of_silicon.toml")
#: τ ∝ E^r: acoustic phonons, a mean free time, between, ionised impurities.
EXPONENTS = (-0.5, 0.0, 0.5, 1.5)
BOLTZMANN_EV, CHARGE_C = 8.617333262e-5, 1.6e-19
#: p of the paper, and of holes by Arora et al. (1982).
PHONON_EXPONENT = {"n-silicon": 2.65, "p-silicon": 2.23}
#: How far, in %, a measurement may be from what is computed to agree.
AGREES = 15.0


#: Carriers over states up to which there is a polynomial, and its degree: an error of 1e-10.
DENSEST, DEGREE = 30.0, 18


class Band(NamedTuple):
    """Carriers of one band at one temperature: sign, density and states (cm⁻³), mobility."""

    sign: int
    carriers: float
    states: float
    mobility: float


def fermi_integral(j: float, eta: float) -> float:
    """Return F_j(η), over Γ(j + 1)."""
    # x = t², which has no root at 0 for the half-odd orders
    end, edge = math.sqrt(max(eta, 0.0) + 60.0), math.sqrt(max(eta, 0.0))
    breaks = [edge] if edge > 0 else None
    value, _ = quad(
        lambda t: 2.0 * t ** (2.0 * j + 1.0) / (1.0 + math.exp(min(t * t - eta, 700.0))),
        *(0.0, end),
        points=breaks,
        epsabs=0.0,
        epsrel=1e-11,
        limit=200,
    )
    return value / math.gamma(j + 1.0)


@cache
def fermi_level(ratio: float) -> float:
    """Return η, over k_B T from the edge of the band, at which F_½(η) is carriers over states."""
    few = math.log(ratio)
    highest = max(few + 1.0, (0.75 * math.sqrt(math.pi) * ratio) ** (2.0 / 3.0))
    return brentq(
        lambda eta: math.log(fermi_integral(0.5, eta) / ratio), few - 1.0, highest, xtol=1e-13
    )


@cache
def reduced_seebeck(ratio: float, r: float) -> float:
    """Return |S| e/k_B of one band, by carriers over states and the exponent of scattering."""
    eta = fermi_level(ratio)
    mean = (r + 2.5) * fermi_integral(r + 1.5, eta) / fermi_integral(r + 0.5, eta)
    return mean - eta


@cache
def reduced_seebeck_polynomial(r: float) -> list[float]:
    """Return the coefficients, from the constant on, of |S| e/k_B + ln(x) in ln(1 + x).

    x is carriers over states, up to `DENSEST`.

    Raises
    ------
    ValueError
        If the polynomial is not as good as it should be.
    """
    end = math.log1p(DENSEST)
    w = 0.5 * end * (chebpts1(3 * DEGREE) + 1.0)
    ratios = np.expm1(w).tolist()
    values = [reduced_seebeck(ratio, r) + math.log(ratio) for ratio in ratios]
    polynomial = Polynomial.fit(w, values, DEGREE, domain=[0.0, end], window=[0.0, end])
    if np.abs(polynomial(w) - values).max() > 1e-10:
        raise ValueError(f"Fermi integrals of r = {r:g} are no polynomial of degree {DEGREE}")
    return polynomial.coef.tolist()


def bands(T: float, n: float, kind: str = "n-silicon", p: float | None = None) -> list[Band]:
    """Return the majority and the minority of doped silicon, by Eqs. 5 to 10 of the paper.

    Of silicon with boron the gap is narrowed as by Klaassen et al. (1992), and the holes move as by
    Thurber et al. (1980, ASTM F723).
    """
    p = PHONON_EXPONENT[kind] if p is None else p
    states = 2.70e19 * (T / 300.0) ** 1.5
    gap = 1.17 - 4.73e-4 * T**2 / (T + 636.0)
    electron = matthiessen(4.1e11 * n**-0.5, 1600.0 * (300.0 / T) ** p)
    if kind == "n-silicon":
        gap -= 0.025 * (n / 1e18) ** (1.0 / 3.0)
        hole = matthiessen(0.746 * 4.1e11 * n**-0.5, 0.279 * 1600.0 * (300.0 / T) ** p)
    else:
        log = math.log(n / 1.3e17)
        gap -= 6.92e-3 * (log + math.sqrt(log**2 + 0.5))
        hole = matthiessen(
            (1.0 + (2.58e-19 * n) ** -0.737) / (1.133e17 * CHARGE_C),
            (296.0 / T) ** p / (1.305e16 * CHARGE_C),
        )
    intrinsic = states * math.exp(-gap / (2.0 * BOLTZMANN_EV * T))
    majority = 0.5 * n + math.hypot(0.5 * n, intrinsic)
    minority = intrinsic**2 / majority
    if kind == "n-silicon":
        return [Band(-1, majority, states, electron), Band(1, minority, states, hole)]
    return [Band(1, majority, states, hole), Band(-1, minority, states, electron)]


def matthiessen(a: float, b: float) -> float:
    """Return the mobility of two kinds of scattering."""
    return a * b / (a + b)


def conductivity(T: float, n: float, kind: str = "n-silicon") -> float:
    """Return σ in S/cm."""
    return CHARGE_C * sum(band.carriers * band.mobility for band in bands(T, n, kind))


def seebeck(T: float, n: float, r: float, kind: str = "n-silicon", p: float | None = None) -> float:
    """Return S in mV/K: that of each carrier, weighted with its conductivity."""
    total = weighted = 0.0
    for band in bands(T, n, kind, p):
        weight = band.carriers * band.mobility
        total += weight
        weighted += weight * band.sign * reduced_seebeck(band.carriers / band.states, r)
    return 1e3 * BOLTZMANN_EV * weighted / total


def intrinsic_by_hand(T: float, r: float, ratio: float = 1.0 / 0.279) -> float:
    """Return S of pure silicon in mV/K, by the ratio of the mobilities and half the gap."""
    half_gap = (1.17 - 4.73e-4 * T**2 / (T + 636.0)) / (2.0 * BOLTZMANN_EV * T)
    return -1e3 * BOLTZMANN_EV * (ratio - 1.0) / (ratio + 1.0) * (r + 2.5 + half_gap)


def read() -> dict[str, Any]:
    """Return what was published."""
    return tomllib.loads(PUBLISHED.read_text(encoding="utf-8"))


def points() -> Iterator[tuple[str, str, float, float, float]]:
    """Yield what was measured on silicon: name, kind, T, carriers and S."""
    for entry in read()["silicon"]:
        numbers = zip(entry["temperature_K"], entry["carriers"], entry["seebeck"], strict=True)
        yield from ((entry["name"], entry["kind"], *row) for row in numbers)


def by_the_rule(T: float, n: float, kind: str) -> float:
    """Return S in mV/K by the rule for measurements near 300 K."""
    rule = read()["rule"]
    resistivity = 1.0 / conductivity(T, n, kind)
    size = 1e3 * rule["m"] * BOLTZMANN_EV * math.log(resistivity / rule["smallest_ohm_cm"])
    return -size if kind == "n-silicon" else size


def largest(
    n: float, r: float, kind: str = "n-silicon", p: float | None = None
) -> tuple[float, float]:
    """Return where the majority's S is largest, from 300 to 1600 K, and S there."""
    sign = 1.0 if kind == "n-silicon" else -1.0
    top = minimize_scalar(
        lambda T: sign * seebeck(float(T), n, r, kind, p), bounds=(300.0, 1600.0), method="bounded"
    )
    return float(top.x), seebeck(float(top.x), n, r, kind, p)


def main() -> None:
    heads = "".join(f"{f'r = {r:g}':>17}" for r in EXPONENTS)
    print(f"S in mV/K: measured, computed, and computed over measured less one in %\n"
          f"{'':<28}{'K':>7}{'cm^-3':>10}{'measured':>10}{heads}")  # fmt: skip
    away: dict[str, list[list[float]]] = {}
    for name, kind, T, n, measured in points():
        row = [seebeck(T, n, r, kind) for r in EXPONENTS]
        percent = [100.0 * (value / measured - 1.0) for value in row]
        away.setdefault(name, []).append(percent)
        cells = "".join(f"{v:>10.3f}{x:>+6.0f}%" for v, x in zip(row, percent, strict=True))
        print(f"{name:<28}{T:>7.1f}{n:>10.2e}{measured:>10.4f}{cells}")
    for name, rows in away.items():
        for r, column in zip(EXPONENTS, zip(*rows, strict=True), strict=True):
            agree = sum(abs(x) <= AGREES for x in column)
            print(f"{name}, r = {r:g}: {agree} of {len(column)} within {AGREES:g} %, "
                  f"{min(column):+.0f} to {max(column):+.0f} %")  # fmt: skip

    print(f"\nS in mV/K at 300 K: the rule for what was measured, and computed\n"
          f"{'':<12}{'cm^-3':>10}{'rule':>9}" + heads)  # fmt: skip
    for kind in ("n-silicon", "p-silicon"):
        for n in (1e17, 5.75e17, 1e18, 1e19, 3e19, 1e20, 2.2e20):
            cells = "".join(f"{seebeck(300.0, n, r, kind):>17.3f}" for r in EXPONENTS)
            print(f"{kind:<12}{n:>10.2e}{by_the_rule(300.0, n, kind):>9.3f}{cells}")

    print(f"\nS in mV/K of pure silicon at 1000 K, by hand and by integrals\n{'':<31}" + heads)
    for label, row in (
        ("by hand, ratio 3.58", [intrinsic_by_hand(1000.0, r) for r in EXPONENTS]),
        ("by integrals, doping 1e12", [seebeck(1000.0, 1e12, r) for r in EXPONENTS]),
        ("by hand, ratio 2.7", [intrinsic_by_hand(1000.0, r, 2.7) for r in EXPONENTS]),
    ):
        print(f"{label:<31}" + "".join(f"{value:>17.3f}" for value in row))

    print("\nwhere the majority's S is largest (K), and S there (mV/K): Thomson heat turns there\n"
          f"{'':<22}{heads}")  # fmt: skip
    for kind in ("n-silicon", "p-silicon"):
        for n in (1e17, 5.75e17, 1e19, 2.2e20):
            tops = (largest(n, r, kind) for r in EXPONENTS)
            cells = "".join(f"{T:>9.0f}{S:>8.3f}" for T, S in tops)
            print(f"{kind:<12}{n:>10.2e}{cells}")

    print("\nmetals, absolute, uV/K")
    for entry in read()["metal"]:
        error = f" ± {entry['error']}" if "error" in entry else ""
        value = f"{entry['seebeck']:g}{error}"
        print(f"{entry['name']:<4}{value:<14}at {entry['temperature_K']} K, {entry['as']}: "
              f"{entry['source']}")  # fmt: skip


if __name__ == "__main__":
    main()
