"""Physics beyond the paper, stated on its own: the Seebeck coefficient, the hot spot, radiation.

    python benchmarks/beyond_the_paper.py seebeck
    python benchmarks/beyond_the_paper.py axis [n-silicon] [p-silicon]
    python benchmarks/beyond_the_paper.py radiation [FIGURE.png]

seebeck    The Seebeck coefficient of silicon: Fermi integrals of two carriers against what was
           measured. The law is stated here on its own, without hotlever, so that hotlever's can be
           tested against it. The published numbers and their sources are in
           `seebeck_of_silicon.toml`.
axis       The shift of the hot spot on the axis of the reference probe, in one dimension, heat by
           heat. Centre leg, heater and both outer legs are strips in a row, with the Seebeck
           coefficient above, κ, resistivities and doping stated here on their own, and solved by
           collocation (`scipy.integrate.solve_bvp`). What the plane adds, where the strips change
           in width and turn, is squares of conformal maps. Each heat has a factor of its own; how
           the hot spot answers to it is a difference of two solutions. Beside it:
           `hotlever.studies.thermoelectric_shift` on the plane lever.
radiation  Levers where radiation counts: what they radiate, and how much cooler that makes their
           tips. In vacuum, at three tip temperatures, with the emissivities that materials have
           unless they are told otherwise, and with a half, which a thin sheet that conducts can
           have at most. Then what sheets of the resistance of each material would emit.
"""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial
from numpy.polynomial.chebyshev import chebpts1
from scipy.integrate import quad, solve_bvp
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import brentq, minimize_scalar
from scipy.special import erfc

from hotlever.errors import ComputationError
from hotlever.figures import radiated_shares, save_figure
from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.probe.shapes import ThreeLeg
from hotlever.studies.radiation import radiated_heat, sheet_emissivities
from hotlever.studies.thermoelectric_shift import of_p_silicon, shift_by_heat

# --- the Seebeck coefficient of silicon ----------------------------------------------------------

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


def seebeck_of_silicon() -> None:
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


# --- the hot spot on the axis --------------------------------------------------------------------

BIAS_V = (2.0, 4.0, 6.0, 7.22, 8.268, 10.748)
#: Between them the lever is followed to the next bias (V).
STEP_V = 0.5
#: The reference probe (µm), its circuit, and option III of the paper.
SHAPE = ThreeLeg.reference()
HEATER, HEATER_WIDTH, THICK = SHAPE.heater_length_um, SHAPE.heater_width_um, SHAPE.thickness_um
LEG_WIDTH, OUTER_WIDTH = SHAPE.centre_leg_width_um, SHAPE.outer_leg_width_um
BRIDGE, GAP, LENGTH = SHAPE.bridge_width_um, SHAPE.gap_um, SHAPE.length_um
LEG = LENGTH - BRIDGE - HEATER
R_S, COLD = 5.6, 293.0  # kΩ, K
C_KAPPA, DELTA, N_D, P, A0, A1, N_HD = 0.686, 0.647, 5.75e17, 2.65, 9.34e-4, 1.11e-6, 2.2e20
EXPONENT = 0.0
#: By which a factor is changed to see what the hot spot does.
CHANGE = 0.05


def step_in_width(ratio: float) -> float:
    """Return the squares that a symmetrical step of a strip's width adds, by narrow over wide."""
    # by Schwarz and Christoffel
    arch = (1.0 + ratio**2) / ratio * math.log((1.0 + ratio) / (1.0 - ratio))
    return (arch - 2.0 * math.log(4.0 * ratio / (1.0 - ratio**2))) / (2.0 * math.pi)


def outer_squares() -> float:
    """Return the squares from the middle of the bridge to the end of one outer leg.

    Half of the heater's width enters the bridge at its middle, where a strip of the bridge's width
    begins: the half-strip is mapped by the hyperbolic cosine. A corner counts 0.56 squares.
    """
    enters = math.log(2.0 / (math.cosh(0.5 * math.pi * HEATER_WIDTH / BRIDGE) - 1.0)) / math.pi
    to_corner = (0.5 * LEG_WIDTH + GAP) / BRIDGE
    return enters + to_corner + 0.56 + (LENGTH - BRIDGE) / OUTER_WIDTH


class Factors(NamedTuple):
    """By which heats and Seebeck's voltage are multiplied."""

    thomson: float = 0.0
    supply: float = 0.0  # Peltier heat on the side of the supply
    ground: float = 0.0
    voltage: float = 0.0


class Silicon:
    """Resistivity and Seebeck coefficient by temperature and doping, tabulated."""

    def __init__(self, kind: str) -> None:
        self.kind, self.sign = kind, -1.0 if kind == "n-silicon" else 1.0
        T, log_n = np.linspace(285.0, 1345.0, 30), np.linspace(*np.log([5.7e17, 2.3e20]), 30)
        S, sigma = np.empty((T.size, log_n.size)), np.empty((T.size, log_n.size))
        for i, t in enumerate(T.tolist()):
            for j, n in enumerate(np.exp(log_n).tolist()):
                parts = bands(t, n, kind, P)
                weights = np.array([band.carriers * band.mobility for band in parts])
                each = [band.sign * reduced_seebeck(band.carriers / band.states, EXPONENT)
                        for band in parts]  # fmt: skip
                sigma[i, j] = CHARGE_C * weights.sum()
                S[i, j] = BOLTZMANN_EV * (weights @ each) / weights.sum()
        self._S, self._sigma = (
            RectBivariateSpline(T, log_n, values) for values in (S, np.log(sigma))
        )
        states = 2.70e19 * (T / 300.0) ** 1.5
        high = [reduced_seebeck(N_HD / full, EXPONENT) for full in states]
        self._high = np.polynomial.Chebyshev.fit(T, self.sign * BOLTZMANN_EV * np.array(high), 12)
        self._high_slope = self._high.deriv()

    def low_doped(self, T: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return ρ (V µm/mA), S (V/K), ∂S/∂T and ∂S/∂ln n."""
        log_n = np.log(n)
        rho = 10.0 * np.exp(-self._sigma.ev(T, log_n))
        return rho, self._S.ev(T, log_n), self._S.ev(T, log_n, dx=1), self._S.ev(T, log_n, dy=1)

    def high_doped(self, T: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return ρ, S and ∂S/∂T."""
        return 10.0 * (A0 + A1 * (T - 300.0)), self._high(T), self._high_slope(T)


def kappa(T: np.ndarray) -> np.ndarray:
    """Return κ in mW/(µm K)."""
    above = T - 680.0
    return (
        0.1 * C_KAPPA / (0.707 + 3.15e-3 * (T - 300.0) + 5.25e-4 * (1.0 + np.tanh(above)) * above)
    )


def doping(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the doping (cm⁻³) and d ln n/dx along the heater, from its end at the supply (µm)."""
    share = 0.5 * (erfc(x / DELTA) + erfc((HEATER - x) / DELTA))
    slope = (np.exp(-(((HEATER - x) / DELTA) ** 2)) - np.exp(-((x / DELTA) ** 2))) / (
        math.sqrt(math.pi) * DELTA
    )
    n = N_D + (N_HD - N_D) * share
    return n, (N_HD - N_D) * slope / n


@cache
def silicon(kind: str) -> Silicon:
    """Return the tables of a kind."""
    return Silicon(kind)


class Axis:
    """The lever in one dimension: T (K) and heat (mW) along four strips, and the voltage.

    All strips have the same coordinate s from 0 to 1: centre leg, heater, and the outer legs, of
    which only the first carries the current.
    """

    def __init__(self, kind: str, biases: tuple[float, ...] = BIAS_V) -> None:
        self.silicon, self.biases = silicon(kind), biases
        self.lengths = (
            LEG + step_in_width(HEATER_WIDTH / LEG_WIDTH) * LEG_WIDTH,
            HEATER,
            outer_squares() * OUTER_WIDTH,
            outer_squares() * OUTER_WIDTH,
        )
        self.areas = tuple(THICK * w for w in (LEG_WIDTH, HEATER_WIDTH, OUTER_WIDTH, OUTER_WIDTH))

    def rates(self, s, y, p, factors: Factors):
        """Return the derivatives by s."""
        rates, (current,) = np.zeros_like(y), p
        n, by_x = doping(HEATER * s)
        half = s < 0.5
        peltier = np.where(half, factors.supply, factors.ground)
        for strip, (length, area) in enumerate(zip(self.lengths, self.areas, strict=True)):
            T, q = y[2 * strip], y[2 * strip + 1]
            flows = current * (strip < 3)
            slope = -q / (kappa(T) * area)
            if strip == 1:
                rho, S, by_T, by_n = self.silicon.low_doped(T, n)
            else:
                (rho, S, by_T), by_n = self.silicon.high_doped(T), 0.0
            heat = flows**2 * rho / area
            heat = heat - flows * T * (factors.thomson * by_T * slope + peltier * by_n * by_x)
            rates[2 * strip], rates[2 * strip + 1] = length * slope, length * heat
            if strip < 3:
                rates[8] += length * (flows * rho / area + factors.voltage * S * slope)
        return rates

    def ends(self, a, b, p, factors: Factors, bias: float):
        """Return what is left of the conditions at both ends of the strips."""
        (current,) = p
        n, _ = doping(np.array([0.0, HEATER]))

        def step(T, end):
            return self.silicon.low_doped(T, n[end])[1] - self.silicon.high_doped(T)[1]

        into = -factors.supply * current * a[2] * step(a[2], 0)
        out = factors.ground * current * b[2] * step(b[2], 1)
        return np.array([
            *(a[0] - COLD, b[0] - a[2], b[1] + into - a[3]),
            *(b[2] - a[4], b[2] - a[6], b[3] + out - a[5] - a[7]),
            *(b[4] - COLD, b[6] - COLD, a[8], b[8] + R_S * current - bias),
        ])  # fmt: skip

    def solved(self, bias: float, factors: Factors, guess):
        """Return the solution at a bias from one nearby."""
        s, y, p = guess
        solution = solve_bvp(
            lambda s, y, p: self.rates(s, y, p, factors),
            lambda a, b, p: self.ends(a, b, p, factors, bias),
            *(s, y, p),
            tol=1e-6,
            max_nodes=20_000,
        )
        if not solution.success:
            raise RuntimeError(f"{bias:g} V: {solution.message}")
        return solution

    def hot_spot(self, solution) -> float:
        """Return where the heater is hottest (nm from its centre, towards ground)."""
        s = brentq(lambda s: float(solution.sol(s)[3]), 0.1, 0.9, xtol=1e-12)
        return 1e3 * HEATER * (s - 0.5)

    @cached_property
    def plain(self) -> dict[float, object]:
        """The solutions without thermoelectricity, by bias."""
        s = np.linspace(0.0, 1.0, 81)
        y = np.zeros((9, s.size))
        y[::2] = COLD
        guess, solutions = (s, y, [0.01]), {}
        at = 0.0
        for bias in self.biases:
            for step in np.linspace(at, bias, math.ceil((bias - at) / STEP_V) + 1)[1:]:
                solution = self.solved(float(step), Factors(), guess)
                guess = solution.x, solution.y, solution.p
            solutions[bias], at = solution, bias
        return solutions

    def shares(self, bias: float, polarity: int) -> tuple[dict[str, float], float]:
        """Return by which heat the hot spot is moved along the current, and by all (nm).

        As the factors go from 0 to 1 together, or to −1, which is the other polarity.
        """
        solution = self.plain[bias]
        before = self.hot_spot(solution)
        shares = dict.fromkeys(Factors._fields, 0.0)
        nodes, weights = np.polynomial.legendre.leggauss(3)
        for node, weight in zip(0.5 + 0.5 * nodes, 0.5 * weights, strict=True):
            factors = Factors(*[polarity * node] * 4)
            solution = self.solved(bias, factors, (solution.x, solution.y, solution.p))
            guess = solution.x, solution.y, solution.p
            for name in shares:
                ends = [
                    self.hot_spot(self.solved(bias, factors._replace(**{name: value}), guess))
                    for value in (getattr(factors, name) + CHANGE, getattr(factors, name) - CHANGE)
                ]
                shares[name] += weight * (ends[0] - ends[1]) / (2.0 * CHANGE)
        whole = self.solved(bias, Factors(*[polarity] * 4), (solution.x, solution.y, solution.p))
        return shares, polarity * (self.hot_spot(whole) - before)


def parts(shares: dict[str, float], whole: float) -> list[float]:
    """Return what is compared: Thomson heat, Peltier heat on either side, and the whole (nm)."""
    return [shares["thomson"], shares["supply"], shares["ground"], whole]


def of_the_lever(kind: str) -> xr.Dataset:
    """Return the same of the lever in its plane."""
    probe = Probe.reference()
    probe = of_p_silicon(probe) if kind == "p-silicon" else probe
    return shift_by_heat(Lever(probe), BIAS_V)


def parts_of_lever(shift: xr.Dataset, bias: float, polarity: int) -> list[float]:
    """Return the parts of the lever's shift, as `parts`."""
    at = shift.sel(polarity=polarity).sel(bias=bias, method="nearest")
    thomson = at.share_nm.sel(heat="Thomson").sum().item()
    return [thomson, *at.share_nm.sel(heat="Peltier").values.tolist(), at.moved_nm.item()]


def axis(*kinds: str) -> None:
    for kind in kinds or ("n-silicon", "p-silicon"):
        axis, lever = Axis(kind), of_the_lever(kind)
        print(f"{kind}: shift of the hot spot along the current (nm), lever and axis\n"
              f"{'bias (V)':>8}{'polarity':>9}{'Thomson':>20}{'Peltier, supply':>20}"
              f"{'Peltier, ground':>20}{'whole':>20}")  # fmt: skip
        for bias in BIAS_V:
            for polarity in (1, -1):
                pairs = zip(parts_of_lever(lever, bias, polarity),
                            parts(*axis.shares(bias, polarity)), strict=True)  # fmt: skip
                cells = "".join(f"{plane:>11.1f}{line:>9.1f}" for plane, line in pairs)
                print(f"{bias:>8g}{polarity:>9}{cells}", flush=True)


# --- levers that radiate -------------------------------------------------------------------------

TIPS = np.array([900.0, 1150.0, 1500.0])
PALLADIUM = Path(__file__).parents[1] / "src/hotlever/examples/palladium-on-nitride.toml"


def levers() -> dict[str, Probe]:
    """The reference probe, and others of its material or of palladium on nitride."""
    reference = Probe.reference()
    return {
        "reference probe": reference,
        "200 µm long, 0.1 µm thick": reference.with_(length_um=200.0, thickness_um=0.1),
        "paddle of 60 µm at the front": reference.with_(
            length_um=110.0, bridge_width_um=60.0, reader_centre_um=30.0
        ),
        "palladium on nitride": Probe.from_file(PALLADIUM),
    }


def radiation(file: str | None = None) -> None:
    print(f"{'lever':<30}{'ε':>5}{'tip K':>7}{'mW':>8}{'µW':>9}{'edges':>7}{'share':>8}{'K':>7}")
    curves = {}
    for name, probe in levers().items():
        for emissivity in (None, 0.5):
            for tip in TIPS:
                try:
                    data = radiated_heat(probe, [tip], emissivity).isel(tip=0)
                except ComputationError as error:
                    print(f"{name:<30}{emissivity or 'own':>5}{tip:>7.0f}  {error}")
                    continue
                light, power = data.radiated_mW.item(), data.power_mW.item()
                print(
                    f"{name:<30}{emissivity or 'own':>5}{tip:>7.0f}{power:>8.3f}{1e3 * light:>9.2f}"
                    f"{data.edges_mW.item() / light:>7.0%}{light / power:>8.2%}"
                    f"{data.cooler_K.item():>7.1f}"
                )
        curves[name] = radiated_heat(probe, np.linspace(400.0, TIPS[-2], 31))
    print(f"\n{'material':<30}{'K':>6}{'ohm':>9}{'ε of a sheet':>14}")
    for probe in (levers()["reference probe"], levers()["palladium on nitride"]):
        for (name, T), row in sheet_emissivities(probe, TIPS[:2]).to_dataframe().iterrows():
            print(f"{name:<30}{T:>6.0f}{row.sheet_ohm:>9.1f}{row.emissivity:>14.2f}")
    if file is not None:
        save_figure(radiated_shares(curves), file)


if __name__ == "__main__":
    what, *words = sys.argv[1:] or ["seebeck"]
    {"seebeck": seebeck_of_silicon, "axis": axis, "radiation": radiation}[what](*words)
