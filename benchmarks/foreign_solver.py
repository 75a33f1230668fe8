"""A solver of levers that shares nothing with hotlever: laws, elements, air, circuit.

Biquadratic elements on rectangles, whose lines crowd towards corners and the heater's borders; the
state at each bias by Newton's method, the supply's potential and the current through its resistor
among the unknowns. Laws are those of Spieser et al., J. Appl. Phys. 121, 174503 (2017), stated
again from the paper, each with a departure that may be zero.

Air: single layers on both faces of the plate, constant on each element, in free air (no chip, no
jump); what the sides give off is left to the faces. How far this is off says
``foreign_levers.py --check``.

Units: µm, K, V, mA, mW, kΩ; carriers per cm³, mobilities in cm²/(V s), as they are printed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solve_banded
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, gmres, splu
from scipy.special import erfc

PER_CM = 0.1  # 1 S/cm = 0.1 mA/(V µm) and 1 W/(cm K) = 0.1 mW/(µm K)
BOLTZMANN_EV = 8.617333262e-5
CHARGE_C = 1.6e-19
N_HD = 2.2e20
#: Diffusion length (µm) of published levers, of which the profile of `phosphorus` is taken to be.
USUAL_DELTA = 0.647

# --- laws --------------------------------------------------------------------------------------


@dataclass
class Laws:
    """The paper's laws with a lever's parameters, and departures from them.

    Attributes
    ----------
    c_kappa, delta, n_d, p, a0, a1 : float
        Of Eqs. 4 to 11; Δ in µm.
    surface_share : float
        How much of the film's additional thermal resistivity, (1/c_κ − 1) of that of silicon at
        300 K, does not grow with the temperature (boundary scattering); all of it does in Eq. 4.
    carriers : str
        Published law towards which the intrinsic density departs from Eq. 7.
    carriers_share : float
        How far, by the logarithm: 0 is Eq. 7, 1 the other law.
    arora_share : float
        The same of the mobilities, from Eqs. 8 to 10 to those of Arora et al.
    front_share : float
        How far the dopant departs from erfc, by the logarithm: 1 is phosphorus that diffuses by
        vacancies, faster where there is more of it (`phosphorus`).
    tail_share, tail_length : float
        Of the dopant, the share that has diffused farther, and how much farther.
    legs_bend : float
        By which share the resistivity of the legs is off Eq. 11 at 1000 K, as a parabola from
        300 K on.
    """

    c_kappa: float = 0.686
    delta: float = 0.647
    n_d: float = 5.75e17
    p: float = 2.65
    a0: float = 9.34e-4
    a1: float = 1.11e-6
    surface_share: float = 0.0
    carriers: str = "Misiakos and Tsamakis"
    carriers_share: float = 0.0
    arora_share: float = 0.0
    front_share: float = 0.0
    tail_share: float = 0.0
    tail_length: float = 1.0
    legs_bend: float = 0.0

    def kappa(self, T):
        """Return the thermal conductivity of the film (mW/(µm K))."""
        bulk, cold = bulk_resistivity(T), bulk_resistivity(300.0)
        scaled = bulk / self.c_kappa
        by_surface = bulk + (1.0 / self.c_kappa - 1.0) * cold
        share = self.surface_share
        return PER_CM / ((1.0 - share) * scaled + share * by_surface)

    def legs_sigma(self, T):
        """Return the conductivity of the legs (mA/(V µm)), Eq. 11."""
        bend = 1.0 + self.legs_bend * ((T - 300.0) / 700.0) ** 2
        return PER_CM / ((self.a0 + self.a1 * (T - 300.0)) * bend)

    def doping(self, distances):
        """Return the doping (cm⁻³) of the heater by the distances from its two borders."""
        share = 0.0
        for distance in distances:
            near, far = distance / self.delta, distance / (self.delta * self.tail_length)
            first = 0.5 * erfc(near)
            if self.front_share:
                depth, diffused = phosphorus()
                front = np.exp(np.interp(near, depth / USUAL_DELTA, np.log(diffused)))
                first = first ** (1.0 - self.front_share) * front**self.front_share
            share = share + (1.0 - self.tail_share) * first
            share = share + 0.5 * self.tail_share * erfc(far)
        return self.n_d + (N_HD - self.n_d) * np.minimum(share, 1.0)

    def heater_sigma(self, T, n):
        """Return the conductivity of the heater (mA/(V µm)), Eqs. 5 to 10."""
        gap = 1.17 - 4.73e-4 * T**2 / (T + 636.0) - 0.025 * np.cbrt(n / 1e18)
        intrinsic = 2.70e19 * (T / 300.0) ** 1.5 * np.exp(-gap / (2.0 * BOLTZMANN_EV * T))
        if self.carriers_share:
            intrinsic = intrinsic * carriers_ratio(T, self.carriers) ** self.carriers_share
        electrons = 0.5 * (n + np.sqrt(n**2 + 4.0 * intrinsic**2))
        holes = intrinsic**2 / electrons
        conducted = electrons * self._mobility(T, n, False) + holes * self._mobility(T, n, True)
        return PER_CM * CHARGE_C * conducted

    def _mobility(self, T, n, is_hole):
        impurity = (0.746 if is_hole else 1.0) * 4.1e11 / np.sqrt(n)
        phonon = (0.279 if is_hole else 1.0) * 1.6e3 * (300.0 / T) ** self.p
        paper = impurity * phonon / (impurity + phonon)
        if not self.arora_share:
            return paper
        return paper * (arora(T, n, is_hole) / paper) ** self.arora_share


@cache
def phosphorus():
    """Return depths (µm) and shares of the dopant beyond a border at 0, after 30 min at 1150 °C.

    R. B. Fair and J. C. C. Tsai, J. Electrochem. Soc. 124, 1107 (1977): vacancies of no, one and
    two charges, and the field of the dopant. Implicit steps, each with the diffusivity before it.
    """
    kT = BOLTZMANN_EV * 1423.15
    neutral, single, double = (
        factor * np.exp(-energy / kT)
        for factor, energy in ((3.85, 3.66), (4.44, 4.0), (44.2, 4.37))
    )
    n_i = 3.87e16 * 1423.15**1.5 * np.exp(-0.605 / kT)
    depth = np.linspace(-8.0, 6.0, 1401)
    size, steps = 1e-4 * (depth[1] - depth[0]), 900
    share = np.where(depth < 0.0, 1.0, 0.0)
    for _ in range(steps):
        n = 5e17 + N_HD * (share[1:] + share[:-1]) / 2.0
        root = np.hypot(n, 2.0 * n_i)
        electrons = (n + root) / (2.0 * n_i)
        moved = (1.0 + n / root) * (neutral + single * electrons + double * electrons**2)
        moved = moved * (1800.0 / steps) / size**2
        bands = np.zeros((3, depth.size))
        bands[0, 1:], bands[2, :-1] = -moved, -moved
        bands[1, 1:-1] = 1.0 + moved[1:] + moved[:-1]
        bands[1, [0, -1]] = 1.0 + moved[[0, -1]]
        share = solve_banded((1, 1), bands, share)
    return depth, np.maximum(share, 1e-12)


def bulk_resistivity(T):
    """Return the thermal resistivity of silicon (cm K/W), Eq. 4."""
    above = T - 680.0
    return 0.707 + 3.15e-3 * (T - 300.0) + 5.25e-4 * (1.0 + np.tanh(above)) * above


def plain_intrinsic(T):
    """Return Eq. 7 without dopants (cm⁻³)."""
    gap = 1.17 - 4.73e-4 * T**2 / (T + 636.0)
    return 2.70e19 * (T / 300.0) ** 1.5 * np.exp(-gap / (2.0 * BOLTZMANN_EV * T))


def carriers_ratio(T, law):
    """Return the intrinsic density of a published law over that of Eq. 7, without dopants.

    Morin and Maita, Phys. Rev. 96, 28 (1954); Putley and Mitchell, Proc. Phys. Soc. 72, 193 (1958);
    Misiakos and Tsamakis, J. Appl. Phys. 74, 3293 (1993).
    """
    if law == "Morin and Maita":
        return 3.87e16 * T**1.5 * np.exp(-0.605 / (BOLTZMANN_EV * T)) / plain_intrinsic(T)
    if law == "Putley and Mitchell":
        return 3.0e16 * T**1.5 * np.exp(-0.603 / (BOLTZMANN_EV * T)) / plain_intrinsic(T)
    if law == "Misiakos and Tsamakis":
        return 5.29e19 * (T / 300.0) ** 2.54 * np.exp(-6726.0 / T) / plain_intrinsic(T)
    raise ValueError(law)


def arora(T, n, is_hole):
    """Return the mobility of Arora et al., IEEE Trans. Electron Devices 29, 292 (1982)."""
    t = T / 300.0
    lowest, lattice, half = (54.3, 1.36e8, 2.35e17) if is_hole else (88.0, 7.4e8, 1.26e17)
    power = -2.23 if is_hole else -2.33
    scattered = 1.0 + 0.88 * t**-0.146 * n / (half * t**2.4)
    return lowest * t**-0.57 + lattice * T**power / scattered


def air_integral(T):
    """Return the integral of the conductivity of air (mW/µm), Eq. 13, and its slope."""
    slope = 2.60e-4 + 4.70e-7 * T + 1.48e-7 * np.sqrt(T)
    slope = slope - 6.63e-2 / T + 9.14 / T**2 - 6.50e2 / T**3
    theta = 2.60e-4 * T + 2.35e-7 * T**2 + 1.48e-7 / 1.5 * T**1.5
    theta = theta - 6.63e-2 * np.log(T) - 9.14 / T + 3.25e2 / T**2
    return PER_CM * theta, PER_CM * slope


# --- shapes ------------------------------------------------------------------------------------


@dataclass
class Plan:
    """Rectangles (x0, x1, y0, y1) of a lever, its heater last, and its ends at x = 0."""

    legs: list[tuple[float, float, float, float]]
    heater: tuple[float, float, float, float]
    along_x: bool  # whether the current crosses the heater along x
    supply: tuple[float, float]
    ground: tuple[float, float]
    reader: tuple[float, float] | None


def three_leg(d):
    """Return the plan of a three-legged lever from its dimensions, as in a probe file."""
    inner = d["centre_leg_width_um"] / 2
    out = inner + d["gap_um"]
    edge, front = out + d["outer_leg_width_um"], d["length_um"]
    bar = front - d["bridge_width_um"]
    back, half = bar - d["heater_length_um"], d["heater_width_um"] / 2
    legs = [
        (0.0, back, -inner, inner),
        (0.0, front, out, edge),
        (0.0, front, -edge, -out),
        (bar, front, -out, out),
    ]
    heater = (back, bar, -half, half)
    return Plan(legs, heater, True, (-inner, inner), (out, edge), (-edge, -out))


def u_shape(d):
    """Return the plan of a two-legged lever from its dimensions, as in a probe file."""
    inner, half = d["gap_um"] / 2, d["heater_length_um"] / 2
    edge, front = inner + d["leg_width_um"], d["length_um"]
    back = front - d["bridge_width_um"]
    middle, across = back + d["bridge_width_um"] / 2, d["heater_width_um"] / 2
    legs = [
        (0.0, front, inner, edge),
        (0.0, front, -edge, -inner),
        (back, front, half, inner),
        (back, front, -inner, -half),
    ]
    heater = (middle - across, middle + across, -half, half)
    return Plan(legs, heater, False, (-edge, -inner), (inner, edge), None)


SHAPES = {"three-leg": three_leg, "u-shape": u_shape}


def lines(points, smallest, largest):
    """Return where element borders are between points at which something ends (µm)."""
    found = [np.array([points[0]])]
    for start, end in pairwise(points):
        sizes, half = [], (end - start) / 2.0
        while sum(sizes) < half:
            sizes.append(min(smallest * 1.7 ** len(sizes), largest(start, end)))
        scaled = np.array(sizes) * half / sum(sizes)
        found.append(start + np.cumsum(np.concatenate([scaled, scaled[::-1]])))
    return np.concatenate(found)


# --- elements ----------------------------------------------------------------------------------

_AT, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def _quadratic(s):
    """Return the three quadratic functions on [−1, 1] and their slopes, (3, points)."""
    values = np.array([s * (s - 1) / 2, 1 - s**2, s * (s + 1) / 2])
    return values, np.array([s - 0.5, -2 * s, s + 0.5])


@dataclass
class Lever:
    """A lever in its circuit.

    Attributes
    ----------
    shape : {"three-leg", "u-shape"}
    dimensions : dict
        In µm, with ``thickness_um``, by the names of a probe file.
    laws : Laws
    series_kohm, base_K : float
    chip_K_per_mW : float
        By which the ends of the legs warm up with the power V_l I_h.
    in_air : bool
    fineness : float
        Element sizes are divided by it.
    """

    shape: str
    dimensions: dict
    laws: Laws = field(default_factory=Laws)
    series_kohm: float = 5.6
    base_K: float = 293.0
    chip_K_per_mW: float = 0.0
    in_air: bool = False
    air_scale: float = 1.0
    fineness: float = 1.0

    def __post_init__(self):
        plan = self.plan = SHAPES[self.shape](self.dimensions)
        self.thickness = self.dimensions["thickness_um"]
        x0, x1, y0, y1 = plan.heater
        middle = ((x0 + x1) / 2, (y0 + y1) / 2)
        heater_x, heater_y = (0.2, 0.4) if plan.along_x else (0.4, 0.2)

        def largest(low, high, heater, beside):
            def size(start, end):
                inside = start > low - 1e-9 and end < high + 1e-9
                return (heater if inside else beside) / self.fineness

            return size

        xs, ys = ({v for r in (*plan.legs, plan.heater) for v in r[k : k + 2]} for k in (0, 2))
        xs, ys = sorted(xs | {middle[0]}), sorted(ys | {middle[1]})
        smallest = 0.12 / self.fineness
        x = lines(xs, smallest, largest(x0, x1, heater_x, 6.0))
        y = lines(ys, smallest, largest(y0, y1, heater_y, 1.5))
        cx, cy = np.meshgrid((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2, indexing="ij")

        def inside(r):
            return (cx > r[0]) & (cx < r[1]) & (cy > r[2]) & (cy < r[3])

        heater = inside(plan.heater)
        solid = heater | np.any([inside(r) for r in plan.legs], axis=0)
        i, j = np.nonzero(solid)
        self.is_heater = heater[i, j]
        self.size = np.stack([np.diff(x)[i], np.diff(y)[j]])  # (2, elements)
        self.corner = np.stack([x[i], y[j]])
        grid = (2 * i[:, None, None] + np.arange(3)[:, None]) * (2 * y.size - 1)
        grid = grid + 2 * j[:, None, None] + np.arange(3)
        used, nodes = np.unique(grid.reshape(len(i), 9), return_inverse=True)
        self.nodes = nodes.reshape(len(i), 9)
        fine = [np.interp(np.arange(2 * v.size - 1) / 2, np.arange(v.size), v) for v in (x, y)]
        self.x, self.y = fine[0][used // (2 * y.size - 1)], fine[1][used % (2 * y.size - 1)]
        self.tip = int(np.argmin(np.hypot(self.x - middle[0], self.y - middle[1])))
        self._functions()
        self._unknowns()

    def _functions(self):
        """Tabulate element functions at the points, with gradients and weights."""
        values, slopes = _quadratic(_AT)
        self.value = np.einsum("ap,bq->abpq", values, values).reshape(9, 9)
        by_x = np.einsum("ap,bq->abpq", slopes, values).reshape(9, 9)
        by_y = np.einsum("ap,bq->abpq", values, slopes).reshape(9, 9)
        self.slope = np.stack([by_x, by_y])[:, :, None, :] * (2.0 / self.size)[:, None, :, None]
        self.slope = self.slope.transpose(0, 2, 1, 3)  # (2, elements, functions, points)
        plane = np.outer(_WEIGHTS, _WEIGHTS).ravel() / 4.0
        self.weight = self.size.prod(axis=0)[:, None] * plane  # (elements, points)
        at = np.stack([v.ravel() for v in np.meshgrid(_AT, _AT, indexing="ij")])
        where = self.corner[:, :, None] + (at[:, None, :] + 1) / 2 * self.size[:, :, None]
        low, high = self.plan.heater[:2] if self.plan.along_x else self.plan.heater[2:]
        along = where[0 if self.plan.along_x else 1][self.is_heater]
        self.doping = self.laws.doping([along - low, high - along])

    def _unknowns(self):
        """Number the unknowns, and find the pattern of the matrix."""
        plan = self.plan
        end = self.x < 1e-9

        def of(span):
            low, high = span
            return end & (self.y > low - 1e-9) & (self.y < high + 1e-9)

        supply, ground = of(plan.supply), of(plan.ground)
        self.reader = np.flatnonzero(of(plan.reader)) if plan.reader else None
        self.is_end = end
        temperature = np.where(end, -1, np.cumsum(~end) - 1)
        free = ~(supply | ground)
        first = temperature.max() + 1
        potential = np.where(free, first + np.cumsum(free) - 1, -1)
        self.supply_unknown = first + int(free.sum())
        potential[supply] = self.supply_unknown
        self.unknowns, self.of_T, self.of_V = self.supply_unknown + 1, temperature, potential
        both = np.hstack([temperature[self.nodes], potential[self.nodes]])  # (elements, 18)
        self.rows = both
        self.kept = (both[:, :, None] >= 0) & (both[:, None, :] >= 0)
        column_major = both[:, None, :] * self.unknowns + both[:, :, None]
        keys, self.place = np.unique(column_major[self.kept], return_inverse=True)
        self.indices = keys % self.unknowns
        counts = np.bincount(keys // self.unknowns, minlength=self.unknowns)
        self.pointer = np.concatenate([[0], np.cumsum(counts)])

    # --- equations ---

    def properties(self, T):
        """Return κ and σ at the points, (elements, points)."""
        sigma = self.laws.legs_sigma(T)
        sigma[self.is_heater] = self.laws.heater_sigma(T[self.is_heater], self.doping)
        return self.laws.kappa(T), sigma

    def fields(self, u, end_K):
        """Return temperature and potential of the nodes."""
        padded = np.append(u, 0.0)  # what has no unknown is at its end
        T = padded[self.of_T]
        T[self.is_end] = end_K
        return T, padded[self.of_V]

    def equations(self, u, bias, end_K, derive=True):
        """Return the residual (mW, mA) and, if asked, the matrix of its derivatives."""
        T, V = self.fields(u, end_K)
        local_T, local_V = T[self.nodes], V[self.nodes]
        at = local_T @ self.value
        grad_T = np.einsum("ea,keap->kep", local_T, self.slope)
        grad_V = np.einsum("ea,keap->kep", local_V, self.slope)
        kappa, sigma = self.properties(at)
        weight = self.thickness * self.weight
        joule = (grad_V**2).sum(axis=0)
        flux_T, flux_V = weight * kappa * grad_T, weight * sigma * grad_V
        heat = (
            np.einsum("kep,keap->ea", flux_T, self.slope) - (weight * sigma * joule) @ self.value.T
        )
        if self.in_air:
            theta, _ = air_integral(self.means @ T)
            cold, _ = air_integral(self.base_K)
            loss = self.air_scale * (self.air @ (theta - cold))  # mW/µm² of both faces
            heat = heat + (loss[:, None] * self.weight) @ self.value.T
        charge = np.einsum("kep,keap->ea", flux_V, self.slope)
        parts = np.hstack([heat, charge])
        inside = self.rows >= 0
        residual = np.bincount(self.rows[inside], parts[inside], self.unknowns)
        residual[self.supply_unknown] -= (bias - u[self.supply_unknown]) / self.series_kohm
        if not derive:
            return residual, None
        step = 0.05
        (kappa_up, sigma_up), (kappa_down, sigma_down) = (
            self.properties(at + step),
            self.properties(at - step),
        )
        kappa_T = (kappa_up - kappa_down) / (2 * step)
        sigma_T = (sigma_up - sigma_down) / (2 * step)
        left = (weight * kappa)[None, :, None] * self.slope
        block = np.empty((len(self.nodes), 18, 18))
        tests = np.einsum("kep,keap->eap", weight * kappa_T * grad_T, self.slope)
        tests = tests - (weight * sigma_T * joule)[:, None] * self.value
        block[:, :9, :9] = tests @ self.value.T + stiffness(left, self.slope)
        if self.in_air:
            local = self.air_scale * self.local_air * air_integral(self.means @ T)[1]
            block[:, :9, :9] += (
                (local[:, None] * self.weight)[:, None] * self.value
            ) @ self.value.T
        crossed = np.einsum("kep,keap->eap", weight * sigma * grad_V, self.slope)
        block[:, :9, 9:] = -2.0 * self.value @ crossed.transpose(0, 2, 1)
        tests = np.einsum("kep,keap->eap", weight * sigma_T * grad_V, self.slope)
        block[:, 9:, :9] = tests @ self.value.T
        block[:, 9:, 9:] = stiffness((weight * sigma)[None, :, None] * self.slope, self.slope)
        data = np.bincount(self.place, block[self.kept], self.indices.size)
        matrix = csc_array((data, self.indices, self.pointer), shape=(self.unknowns,) * 2)
        corner = self.supply_unknown
        matrix[corner, corner] += 1.0 / self.series_kohm
        return residual, matrix

    @cached_property
    def means(self):
        """Mean temperatures of elements from those of nodes."""
        share = self.value @ (np.outer(_WEIGHTS, _WEIGHTS).ravel() / 4.0)
        rows = np.repeat(np.arange(len(self.nodes)), 9)
        values = np.tile(share, len(self.nodes))
        shape = len(self.nodes), self.x.size
        return csc_array((values, (rows, self.nodes.ravel())), shape=shape)

    @cached_property
    def air(self):
        """Losses of both faces by θ, elements by elements."""
        centre = self.corner + self.size / 2
        away = centre[:, :, None] - centre[:, None, :]
        layer = sum(over_rectangle(away, self.size, z) for z in (0.0, self.thickness))
        return np.linalg.inv(layer / (8.0 * np.pi))

    @cached_property
    def local_air(self):
        """What the losses come to if all else is as warm as an element."""
        return self.air.sum(axis=1)

    # --- states ---

    def solve(self, bias, start, tolerance_K=1e-4):
        """Return the state at a bias near another; None if it is not found."""
        u, end_K, factors, before = start.copy(), self.end_K(start, bias), None, np.inf
        count_T = self.of_T.max() + 1
        for _ in range(25):
            residual, matrix = self.equations(u, bias, end_K, derive=factors is None)
            if factors is None:
                factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
                jacobian, around = matrix, u.copy()
            step = self._step(residual, factors, jacobian, around, end_K)
            largest = np.abs(step[:count_T]).max()
            if not np.isfinite(largest) or largest > 1e4:
                return None
            step *= min(1.0, 80.0 / largest)
            u += step
            moved = self.end_K(u, bias) - end_K
            end_K += moved
            if max(largest, abs(moved)) < tolerance_K:
                return u
            if largest > 0.2 * before or largest > 5.0:
                factors = None
            before = largest
        return None

    def _step(self, residual, factors, jacobian, around, end_K):
        if not self.in_air:
            return -factors.solve(residual)
        T, _ = self.fields(around, end_K)
        slope = self.air_scale * air_integral(self.means @ T)[1]
        of_T, count = self.of_T, self.x.size
        area = self.weight.sum(axis=1)
        free = of_T >= 0

        def times(x):
            nodal = np.zeros(count)
            nodal[free] = x[of_T[free]]
            mean = slope * (self.means @ nodal)
            nonlocal_part = self.air @ mean - self.local_air * mean
            nodal = self.means.T @ (area * nonlocal_part)
            result = jacobian @ x
            result[of_T[free]] += nodal[free]
            return result

        shape = (self.unknowns,) * 2
        step, _ = gmres(
            LinearOperator(shape, times, dtype=float),
            -residual,
            M=LinearOperator(shape, factors.solve, dtype=float),
            rtol=1e-5,
            restart=40,
            maxiter=5,
        )
        return step

    def current_mA(self, u, bias):
        """Return the current of the supply."""
        return (bias - u[self.supply_unknown]) / self.series_kohm

    def end_K(self, u, bias):
        """Return the temperature of the legs' ends by the power of the lever."""
        power_mW = u[self.supply_unknown] * self.current_mA(u, bias)
        return self.base_K + self.chip_K_per_mW * power_mW

    def sweep(self, hottest_K, highest_V):
        """Raise the bias until the tip is this hot, or to a bias; return a `Sweep`."""
        u = np.zeros(self.unknowns)
        u[self.of_T[self.of_T >= 0]] = self.base_K
        states, biases, step = [u], [0.0], 0.3
        while biases[-1] < highest_V:
            bias = min(biases[-1] + step, highest_V)
            u = self.solve(bias, extrapolated(biases[-3:], states[-3:], bias))
            rise = np.inf if u is None else self.tip_K(u) - self.tip_K(states[-1])
            if rise > 45.0:
                step /= 2.0
                if step < 2e-3:
                    break
                continue
            states.append(u)
            biases.append(bias)
            if self.tip_K(u) > hottest_K:
                break
            step = min(0.45, step * min(1.5, 25.0 / max(rise, 1.0)))
        rows = []
        for bias, state in zip(biases, states, strict=True):
            T, V = self.fields(state, self.base_K)
            reader = V[self.reader].mean() if self.reader is not None else np.nan
            rows.append((self.current_mA(state, bias), reader, T[self.tip]))
        return Sweep(np.array(biases), np.array(rows).T)

    def tip_K(self, u):
        """Return the temperature of the tip."""
        return u[self.of_T[self.tip]]


@dataclass
class Sweep:
    """States of a lever by rising bias: current (mA), reader (V) and tip (K), as splines."""

    bias_V: np.ndarray
    rows: np.ndarray

    def at(self, bias):
        """Return current, reader and tip at some biases, (3, n)."""
        curves = [CubicSpline(self.bias_V, row)(bias) for row in self.rows[[0, 2]]]
        reader = self.rows[1]
        known = np.isfinite(reader).all()
        volts = CubicSpline(self.bias_V, reader)(bias) if known else np.full(len(bias), np.nan)
        return np.array([curves[0], volts, curves[1]])


def stiffness(left, right):
    """Return the matrices of elements, summed over directions and points."""
    return sum(a @ b.transpose(0, 2, 1) for a, b in zip(left, right, strict=True))


def extrapolated(biases, states, bias):
    """Return the polynomial through some states at a bias."""
    total = np.zeros_like(states[0])
    for k, own in enumerate(biases):
        others = [other for other in biases if other != own]
        total += np.prod([(bias - o) / (own - o) for o in others]) * states[k]
    return total


def over_rectangle(away, size, z):
    """Return the integral of 1/R over rectangles, from points at a height over their planes.

    ``away`` is (2, points, rectangles), from the rectangles' centres.
    """
    total = 0.0
    for sx in (-1, 1):
        for sy in (-1, 1):
            a = away[0] + sx * size[0] / 2
            b = away[1] + sy * size[1] / 2
            r = np.sqrt(a**2 + b**2 + z**2)
            part = a * np.log(b + r) + b * np.log(a + r)
            if z:
                part = part - z * np.arctan2(a * b, z * r)
            total = total + sx * sy * part
    return total
