"""The shift of the hot spot on the axis of the reference probe, in one dimension, heat by heat.

Centre leg, heater and both outer legs are strips in a row, with the Seebeck coefficient of
`seebeck.py`, κ, resistivities and doping stated here on their own, and solved by collocation
(`scipy.integrate.solve_bvp`). What the plane adds, where the strips change in width and turn, is
squares of conformal maps. Each heat has a factor of its own; how the hot spot answers to it is a
difference of two solutions. Beside it: `hotlever.studies.thermoelectric_shift` on the plane lever.

Run: python benchmarks/thermoelectric_axis.py [n-silicon] [p-silicon]
"""

from __future__ import annotations

import math
import sys
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.integrate import solve_bvp
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import brentq
from scipy.special import erfc

from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.probe.shapes import ThreeLeg
from hotlever.studies.thermoelectric_shift import of_p_silicon, shift_by_heat
from seebeck import BOLTZMANN_EV, CHARGE_C, bands, reduced_seebeck

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


def main() -> None:
    for kind in sys.argv[1:] or ("n-silicon", "p-silicon"):
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


if __name__ == "__main__":
    main()
