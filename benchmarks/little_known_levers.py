"""Levers of which the owner knows little, and says so: simulated, measured, calibrated.

The levers of `hotlever.studies.simulation_based_calibration` depart from the model and are known
well. These are levers of the model itself, solved on a finer mesh, whose owner states doping,
dimensions and thickness with wide priors. What is tried is the search: whether it gets to such a
lever from so far away, and whether the errors that it states are those it makes.

`twins.py --wild` runs and reports them.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from hotlever.calibration.procedure import calibrate
from hotlever.errors import HotleverError, InputError
from hotlever.estimation import Measurement
from hotlever.lever import Branch, Lever
from hotlever.lever.discretisation import chosen_space, energy_between_degrees, making
from hotlever.lever.full_space import FullSpace
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.parameters import parameters_of
from hotlever.probe.parts import PriorTexts
from hotlever.probe.priors import default_priors
from hotlever.studies.simulation_based_calibration import stated_on_that_side
from hotlever.types import Array

SHAPES = ("three-leg", "u-shape", "drawing")
MEDIA = ("vacuum", "air")
#: What the owner says of the lever, beside the usual priors; of the doping one of two.
PRIORS = {"delta": "± 35%", "thickness_um": "± 20%", "dimensions": "± 12%"}
DOPING = ("± 60%", "×/ 2.5")
#: Nominal doping (cm⁻³) from and to; a dimension is the reference's times two factors, one of all
#: dimensions and one of its own, each at most √2 either way.
_DOPING_CM3, _FACTOR = (3e16, 1e18), float(np.sqrt(2.0))
#: Series resistance (Ω), rows, and the first bias over the last.
_SERIES_OHM, _ROWS, _FIRST = (1e3, 1e4), (18, 55), (0.03, 0.12)
#: The coldest tip (K) at which data end; the hottest, as a share of the rise at which it melts.
_COLDEST_END_K, _HOTTEST_END = 350.0, 0.98
#: Noise of the current over the current; of a picture, the error of reading either axis over its
#: full scale, from and to.
_NOISE, _READING = 5e-3, (1e-3, 3e-3)
#: Share of the error estimate whose triangles are split once more than by default; panels of the
#: air, as much smaller.
_SPLIT, _PANELS = 0.8, 1.3
#: Most levers drawn for one number.
_MOST_DRAWN = 200
#: What becomes of a lever: of the last two there is no band to be judged.
DESCRIBED, CONTRADICTED, NOT_CONVERGED, FAILED = (
    "described",
    "not described",
    "not converged",
    "error",
)
_OUTCOMES = {True: DESCRIBED, False: CONTRADICTED, None: NOT_CONVERGED}


@dataclass(frozen=True)
class LittleKnownLever:
    """A lever that is measured, and what its owner knows of it.

    Attributes
    ----------
    number : int
    true, nominal : Probe
        The lever, and the owner's probe with the owner's priors in ``[prior]``.
    branch : Branch
        Of the true lever, until something melts.
    measurement : Measurement
    digitised : bool
        Whether the data were read from a picture; the current has noise otherwise.
    jumps : bool
        Whether the ramp of the bias passed a fold.
    repeated : int
        Levers drawn before that could not be drawn, meshed or solved.
    """

    number: int
    true: Probe
    nominal: Probe
    branch: Branch
    measurement: Measurement
    digitised: bool
    jumps: bool
    repeated: int

    def tip_K(self, bias_V: Array) -> Array:
        """Return the true tip temperature (K) on a ramp of the bias; NaN where it has ended."""
        return self.branch.tip_K(self.branch.read(self.true.circuit, bias_V).u)

    @property
    def below_knee(self) -> bool:
        """Whether the data stop below the knee."""
        knee = self.branch.knee
        return knee is None or float(np.nanmax(self.tip_K(self.measurement.bias_V))) < knee.tip_K

    def measurement_csv(self) -> str:
        """Return the data as a measurement file."""
        rows = zip(self.measurement.bias_V, self.measurement.current_mA, strict=True)
        lines = ["V_b (V),I_h (mA)", *(f"{bias:.7g},{current:.7g}" for bias, current in rows)]
        return "\n".join(lines) + "\n"


def little_known_lever(number: int, medium: str | None = None) -> LittleKnownLever:
    """Draw and measure the lever of a number, the same each time.

    Parameters
    ----------
    number : int
        Decides the shape in turn, and the rest by chance.
    medium : {"vacuum", "air"}, optional
        By default, either by chance.

    Raises
    ------
    HotleverError
        If no lever that was drawn could be solved: the reason of the last.
    """
    rng = np.random.default_rng(number)
    reason = HotleverError()
    for repeated in range(_MOST_DRAWN):
        by_chance = MEDIA[int(rng.random() < 0.5)]
        try:
            nominal = _nominal(rng, SHAPES[number % len(SHAPES)]).in_medium(medium or by_chance)
            true = _drawn(rng, nominal)
            branch = _finer(true).branch(np.inf)
            measurement, digitised, jumps = _measured(rng, true, branch)
        except HotleverError as error:
            reason = error
            continue
        return LittleKnownLever(
            number, true, nominal, branch, measurement, digitised, jumps, repeated
        )
    raise reason


def _factor(rng: Generator, most: float = _FACTOR) -> float:
    """Draw a factor, evenly by its logarithm."""
    return float(most ** rng.uniform(-1.0, 1.0))


def _between(rng: Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _nominal(rng: Generator, shape: str) -> Probe:
    """Draw the probe that an owner believes to have, with priors."""
    common = _factor(rng)
    if shape == "drawing":
        probe = _drawing(rng, common)
    else:
        probe = Probe.reference() if shape == "three-leg" else Probe.u_shape()
        sizes = probe.shape.dimensions()
        probe = probe.with_(
            **{name: size * common * _factor(rng) for name, size in sizes.items() if size}
        )
    priors = {"n_d": DOPING[int(rng.random() < 0.5)], **PRIORS}
    if not probe.shape.outline_moves:
        del priors["dimensions"]
    probe = probe.with_(
        n_d=_between(rng, *_DOPING_CM3),
        delta=common * probe.material.delta,
        series_resistance_ohm=_between(rng, *_SERIES_OHM),
    )
    return probe.model_copy(update={"prior": PriorTexts.from_values(priors, "priors")})


def _drawing(rng: Generator, common: float) -> Probe:
    """Draw a lever of straight lines: two legs that taper towards a front bar with the heater."""

    def size(usual: float) -> float:
        return usual * common * _factor(rng)

    length, bar, heater = size(60.0), size(1.645), size(4.0)
    gap = heater * rng.uniform(1.1, 1.8)
    wide, narrow, slit = size(8.0), size(4.0), size(8.0)
    back, half = length - bar, gap / 2.0
    corner = half + narrow * rng.uniform(0.3, 1.0)
    left = [
        [0.0, slit / 2.0],
        [0.0, slit / 2.0 + wide],
        [back, half + narrow],
        [length, corner],
    ]
    inner = [[back, -half], [back, half]]
    right = [[x, -y] for x, y in reversed(left)]
    beyond = [back - 1.0, length + 1.0]
    across = [[beyond[0], -heater / 2], [beyond[1], -heater / 2]]
    sections = {
        "probe": {
            "shape": "drawing",
            "thickness_um": size(0.4),
            "tip_um": [length - bar / 2.0, 0.0],
        },
        "layers": {
            "silicon": [[*left, *right, *inner]],
            "heater": [[*across, *([x, -y] for x, y in reversed(across))]],
        },
        "terminals": {"supply": right[-2:], "ground": left[:2]},
    }
    return Probe.from_sections(sections, "drawn lever")


def _drawn(rng: Generator, nominal: Probe) -> Probe:
    """Draw a lever from all that its owner knows.

    Raises
    ------
    InputError
        If it cannot be drawn, or a parameter is beyond what levers have.
    """
    bounds, values = parameters_of(nominal, anywhere=True), dict[str, float]()
    for name, prior in default_priors(nominal).items():
        values[name] = value = prior.at(float(rng.standard_normal()))
        if not bounds[name].lower <= value <= bounds[name].upper:
            raise InputError(f"{name} = {value:g} is beyond what levers have")
    return nominal.model_copy(update={"prior": None}).with_(**values)


def _finer(true: Probe) -> Lever:
    """Return a lever on a mesh that is finer than the one it has by default."""
    usual = chosen_space(true)
    by_element = energy_between_degrees(usual, true.kinds, true.circuit)
    space = FullSpace(usual.mesh.refined(making(by_element, _SPLIT)), wiring=true.wiring)
    return Lever(true, MeshOptions(panels=_PANELS), space=space)


def _measured(rng: Generator, true: Probe, branch: Branch) -> tuple[Measurement, bool, bool]:
    """Measure a lever; return also whether it is read from a picture, and whether it jumped.

    Half of the sweeps end below the knee, if there is one.

    Raises
    ------
    InputError
        If the ramp of the bias does not heat the tip to 350 K.
    """
    base = branch.base_temperature_K
    coldest, hottest = _COLDEST_END_K, base + _HOTTEST_END * (branch.hottest_K - base)
    below = rng.random() < 0.5
    if branch.knee is not None:
        middle = min(branch.knee.tip_K, hottest)
        coldest, hottest = (coldest, middle) if below else (middle, hottest)
    end_K = rng.uniform(coldest, hottest)
    end_V = float(branch.bias(end_K, true.circuit))
    rows = int(rng.integers(_ROWS[0], _ROWS[1] + 1))
    bias = np.linspace(rng.uniform(*_FIRST) * end_V, end_V, rows)
    digitised = bool(rng.random() < 0.5)
    if digitised:  # points of a picture are not evenly spaced
        bias[1:-1] += rng.uniform(-0.3, 0.3, rows - 2) * (bias[1] - bias[0])
    reading = branch.read(true.circuit, bias)
    tip = branch.tip_K(reading.u)
    if not (np.isfinite(tip).all() and tip[-1] >= _COLDEST_END_K):
        raise InputError("a ramp of the bias does not heat the tip so far")
    current = branch.electrical_outputs(reading.u)["current_mA"]
    if digitised:
        share = rng.uniform(*_READING)
        bias = bias + share * bias.max() * rng.standard_normal(rows)
        current = current + share * current.max() * rng.standard_normal(rows)
        # who reads a picture goes from left to right
        bias = np.maximum(bias, 1e-3 * end_V)
        order = np.argsort(bias)
        bias, current = bias[order], current[order]
    else:
        current = current * (1.0 + _NOISE * rng.standard_normal(rows))
    nothing = np.full(rows, np.nan)
    measurement = Measurement(bias, current, nothing, nothing, nothing)
    jumps = any(fold < end_V for fold, _ in reading.jumps)
    return measurement, digitised, jumps


def judge_little_known(number: int, medium: str | None = None) -> dict[str, Any]:
    """Make the lever of a number, calibrate it, and compare with its true temperature.

    Returns
    -------
    dict
        What can be written as JSON: what the lever is; ``outcome``, with ``reason`` and, for an
        exception, its type as ``exception``; ``seconds`` of processor; and if there is an answer
        ``tip_K``, the truth, ``off_K``, the error, and ``stated_K``, the one that is stated on
        that side, by row of the calibration's table, where it has a bias and the lever a state.

    Raises
    ------
    HotleverError
        If there is no lever of that number.
    """
    lever = little_known_lever(number, medium)
    probe, data = lever.nominal, lever.measurement
    record: dict[str, Any] = {
        "lever": number,
        "shape": probe.shape.shape,
        "medium": probe.surroundings.medium,
        "n_d": probe.material.n_d,
        "rows": data.bias_V.size,
        "digitised": lever.digitised,
        "jumps": lever.jumps,
        "below_knee": lever.below_knee,
        "end_K": round(float(np.nanmax(lever.tip_K(data.bias_V))), 1),
        "repeated": lever.repeated,
        "exception": "",
        "reason": "",
    }
    began = time.process_time()
    try:
        calibration = calibrate(data, probe=probe)
    except Exception as error:  # also what should never come is a result here
        record |= {"outcome": FAILED, "exception": type(error).__name__, "reason": str(error)}
        return record | {"seconds": time.process_time() - began}
    record["seconds"] = time.process_time() - began
    table = calibration.table.isel(bias=calibration.table.bias_V.values > 0)
    tip = lever.tip_K(table.bias_V.values)
    there = np.isfinite(tip)
    table, tip = table.isel(bias=there), tip[there]
    off = table.tip_K.values - tip
    return record | {
        "outcome": _OUTCOMES[calibration.describes_data],
        "reason": calibration.reason,
        "tip_K": tip.round(2).tolist(),
        "off_K": off.round(3).tolist(),
        "stated_K": stated_on_that_side(table, off).round(4).tolist(),
    }
