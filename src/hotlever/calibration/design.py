"""What a change of design does: knee, tip temperature and loss to air against any dimension."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from hotlever import __version__
from hotlever.calibration.characteristic import Characteristic, characteristic
from hotlever.errors import ComputationError, InputError, unknown_name
from hotlever.lever.lever import Lever
from hotlever.materials.diffusion import ANNEALING_K, ANNEALING_S, diffusion_length
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import MeshOptions, Probe

#: What follows from a design: name, unit, what it is.
QUANTITIES: dict[str, tuple[str, str]] = {
    "knee_K": ("K", "tip temperature of the knee"),
    "inversion_K": ("K", "inversion temperature of the heater's doping"),
    "knee_mW": ("mW", "power of the knee in vacuum"),
    "knee_V": ("V", "lever voltage of the knee"),
    "knee_mA": ("mA", "heater current of the knee"),
    "knee_bias_V": ("V", "bias of the knee"),
    "tip_K": ("K", "tip temperature at the power given"),
    "cold_ohm": ("ohm", "resistance of the lever when cold"),
    "k": ("1", "power of the knee in air over that in vacuum"),
}
#: Names beside those of a probe file: what they are, and their reference.
ANNEALING: dict[str, tuple[str, float]] = {
    "annealing_K": ("temperature of the annealing", ANNEALING_K),
    "annealing_min": ("time of the annealing", ANNEALING_S / 60.0),
}
#: What a designer asks for first.
USUAL = (
    "heater_length_um",
    "heater_width_um",
    "thickness_um",
    "n_d",
    "annealing_K",
    "annealing_min",
)
#: Relative change by which a sensitivity is found; for the annealing temperature far smaller.
_STEP = 0.02
_MESH, _STEP_K = MeshOptions(refinement=0.6), 40.0


@dataclass(frozen=True)
class Design:
    """A probe, and how it was annealed.

    Attributes
    ----------
    probe : Probe
    annealing_K, annealing_min : float
        Of the probe's Δ, so that a change of either scales it.
    """

    probe: Probe
    annealing_K: float = ANNEALING_K
    annealing_min: float = ANNEALING_S / 60.0

    def value(self, name: str) -> float:
        """Return a value by its name.

        Raises
        ------
        InputError
            If there is none; the text gives the nearest one.
        """
        if name in ANNEALING:
            return float(getattr(self, name))
        known = {
            key: entry
            for section in self.probe.values().values()
            for key, entry in section.items()
            if isinstance(entry, float | int) and not isinstance(entry, bool)
        }
        if name not in known:
            raise unknown_name("name", name, [*known, *ANNEALING])
        return float(known[name])

    def changed(self, name: str, value: float) -> Probe:
        """Return the probe with one value changed.

        The diffusion length follows the annealing as Δ = 2 √(D t_a) does, from the probe's Δ at
        the design's own annealing: the law's ± 40 % in D does not enter.
        """
        self.value(name)
        if name not in ANNEALING:
            return self.probe.with_values({name: value})
        before = diffusion_length(self.annealing_K, 60.0 * self.annealing_min)
        annealing = {"annealing_K": self.annealing_K, "annealing_min": self.annealing_min}
        annealing[name] = value
        after = diffusion_length(annealing["annealing_K"], 60.0 * annealing["annealing_min"])
        return self.probe.with_values({"delta": self.probe.material.delta * float(after / before)})


def quantities(probe: Probe, power_mW: float, air: bool = True) -> dict[str, float]:
    """Return the `QUANTITIES` of a probe; k is NaN without air, the knee's where there is none.

    Parameters
    ----------
    probe : Probe
    power_mW : float
        Power (mW) in vacuum at which the tip temperature is given.
    air : bool
        Solve the lever in air too, for k.
    """
    lever = Lever(probe.in_medium("vacuum"), _MESH)
    vacuum = characteristic(lever, step_K=_STEP_K)
    material, series = probe.material, probe.circuit.series_resistance_ohm / 1000.0
    knee = vacuum.knee
    first = vacuum.data.isel(bias=0)
    found = {
        **dict.fromkeys(QUANTITIES, float("nan")),
        "inversion_K": float(inversion_temperature(material.n_d, material.p)),
        "tip_K": float(vacuum.tip_temperature(power_mW)),
        "cold_ohm": float(1000.0 * first.lever_V / first.current_mA),
    }
    if knee is None:
        return found
    found |= {
        "knee_K": knee.tip_K,
        "knee_mW": knee.power_mW,
        "knee_V": knee.lever_V,
        "knee_mA": knee.current_mA,
        "knee_bias_V": knee.lever_V + series * knee.current_mA,
    }
    if air:
        in_air: Characteristic = characteristic(lever.in_medium("air"), step_K=_STEP_K)
        if in_air.knee is not None:
            found["k"] = in_air.knee.power_mW / knee.power_mW
    return found


def vary(
    design: Design,
    name: str,
    values: Sequence[float],
    *,
    power_mW: float = 2.0,
    air: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Solve a design for several values of one of its numbers.

    Returns
    -------
    xarray.Dataset
        `QUANTITIES` on the dimension `name`, which is a probe file's key or of `ANNEALING`.

    Raises
    ------
    InputError
        If the name does not exist or a value is impossible.
    """
    probes = [design.changed(name, float(value)) for value in values]
    rows = []
    for done, probe in enumerate(probes, start=1):
        rows.append(quantities(probe, power_mW, air))
        if progress is not None:
            progress(done, len(probes))
    data = xr.Dataset(
        {
            key: (name, [row[key] for row in rows], {"units": unit, "long_name": text})
            for key, (unit, text) in QUANTITIES.items()
        },
        coords={name: np.asarray(values, dtype=float)},
    )
    data.attrs = {
        **{key: json.dumps(section) for key, section in design.probe.values().items()},
        "power_mW": power_mW,
        "base_value": design.value(name),
        "software": f"hotlever {__version__}",
    }
    return data


def sensitivities(
    design: Design,
    names: Sequence[str] = USUAL,
    *,
    power_mW: float = 2.0,
    air: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
    """Return the quantities of a design, and how each changes with some of its numbers.

    Returns
    -------
    base : dict
    slopes : dict of str to dict
        By name, then by quantity: the change for one per cent more of the number, in K for
        temperatures and in per cent for everything else; central differences.
    """
    steps: Mapping[str, float] = {
        name: 0.1 * _STEP if name == "annealing_K" else _STEP for name in names
    }
    total = 2 * len(names) + 1
    probes = [
        (name, sign, design.changed(name, design.value(name) * (1.0 + sign * steps[name])))
        for name in names
        for sign in (1, -1)
    ]
    base = quantities(design.probe, power_mW, air)
    if np.isnan(base["knee_K"]):
        raise ComputationError("the design has no knee below the highest temperature of the laws")
    found: dict[tuple[str, int], dict[str, float]] = {}
    for done, (name, sign, probe) in enumerate(probes, start=1):
        found[name, sign] = quantities(probe, power_mW, air)
        if progress is not None:
            progress(done + 1, total)
    slopes: dict[str, dict[str, float]] = {}
    for name in names:
        per_cent = 200.0 * steps[name]
        slopes[name] = {}
        for key, (unit, _) in QUANTITIES.items():
            change = (found[name, 1][key] - found[name, -1][key]) / per_cent
            slopes[name][key] = change if unit == "K" else 100.0 * change / base[key]
    return base, slopes


def parse_range(text: str) -> tuple[str, list[float]]:
    """Parse ``NAME=START:STOP:COUNT``, ends included.

    Raises
    ------
    InputError
        If it is anything else.

    Examples
    --------
    >>> parse_range("heater_length_um=3:6:4")
    ('heater_length_um', [3.0, 4.0, 5.0, 6.0])
    """
    name, equals, numbers = text.partition("=")
    parts = numbers.split(":")
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (IndexError, ValueError):
        equals = ""
    if not equals or len(parts) != 3 or count < 2 or not np.isfinite([start, stop]).all():
        raise InputError(
            f"--vary {text}: expected NAME=START:STOP:COUNT, such as heater_length_um=3:6:7"
        )
    return name.strip(), np.linspace(start, stop, count).tolist()
