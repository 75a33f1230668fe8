"""Cases: a published number of a lever or a material, and what was known of it beforehand.

A case is a probe file with a head: what is predicted, from which source, what that states, and what
had to be assumed. Numbers that the quantity asks for stand in ``[given]``, with a spread where they
are uncertain. The prediction is written down before the published number is.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import Field

from hotlever.contact.law import cold_resistance, contact_resistance
from hotlever.errors import InputError, unknown_name
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.noise import johnson_without_feedback
from hotlever.lever.reader import Reader
from hotlever.lever.transient.modes import slowest_modes
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.heat import thermal_conductivity_of_layer
from hotlever.materials.silicon import conductivity_low_doped
from hotlever.probe import Probe
from hotlever.probe.parts import SECTIONS
from hotlever.probe.priors import Prior, parsed
from hotlever.probe.probe import read_sections
from hotlever.probe.tip import EXAMPLE
from hotlever.raman import anharmonic
from hotlever.records import Record
from hotlever.units import PER_CM_TO_MILLI_PER_UM

#: K/W in K/mW.
_PER_K_PER_W = 1e-3


class PredictedQuantity(NamedTuple):
    """What is predicted: a positive number, or a share."""

    unit: str
    meaning: str
    compute: Callable[..., float]

    @property
    def is_share(self) -> bool:
        """Whether it lies between zero and one."""
        return self.unit == "share"

    @property
    def arguments(self) -> dict[str, bool]:
        """Its arguments beside the lever, and whether each must be given."""
        parameters = inspect.signature(self.compute).parameters
        return {
            name: parameter.default is inspect.Parameter.empty
            for name, parameter in parameters.items()
            if name != "probe"
        }

    @property
    def of_a_lever(self) -> bool:
        """Whether it needs a probe."""
        return "probe" in inspect.signature(self.compute).parameters


def _both_media(probe: Probe, tip_K: float) -> tuple[float, float]:
    """Return the powers (mW) that heat the tip so far in vacuum and in the probe's air."""
    lever = Lever(probe.in_medium("vacuum"), COARSE)
    in_air = Lever(probe.in_medium("air"), COARSE, space=lever.space)
    vacuum, air = (float(each.branch(tip_K).power(tip_K)) for each in (lever, in_air))
    return vacuum, air


def power_ratio_in_air(probe: Probe, *, tip_K: float) -> float:
    """Power in air over that in vacuum at the same tip temperature, the paper's k."""
    vacuum, air = _both_media(probe, tip_K)
    return air / vacuum


def share_into_air(probe: Probe, *, tip_K: float) -> float:
    """Share of the power that leaves through the air instead of the leg ends."""
    vacuum, air = _both_media(probe, tip_K)
    return 1.0 - vacuum / air


def time_constant(probe: Probe, *, tip_K: float) -> float:
    """Slowest time constant with the tip at a temperature, at constant power."""
    lever = Lever(probe, COARSE)
    branch = lever.branch(tip_K)
    (state,) = lever.solve([float(branch.bias(tip_K, probe.circuit))])
    constants, _ = slowest_modes(state, "power", 1)
    return float(constants[0])


def resistance_ratio(probe: Probe, *, power_mW: float, from_mW: float) -> float:
    """Resistance of the lever at a power over that at a lower one."""
    branch = _reaching(Lever(probe, COARSE), power_mW)
    tip_K = branch.tip_temperature([from_mW, power_mW])
    low, high = branch.lever_voltage(tip_K) / branch.current(tip_K)
    return float(high / low)


def _reaching(lever: Lever, power_mW: float) -> Branch:
    branch = lever.branch_past_knee()
    return branch if branch.by_power.highest_mW >= power_mW else lever.branch()


def johnson_noise(probe: Probe, *, tip_K: float) -> float:
    """Johnson noise of the lever's resistance, faster than its temperature follows."""
    return _johnson_nV(Lever(probe, COARSE).branch(tip_K), tip_K)


def temperature_resolution(probe: Probe, *, tip_K: float) -> float:
    """Johnson noise over what the lever's voltage shows of the tip temperature at a current."""
    branch = Lever(probe, COARSE).branch(tip_K + 1.0)
    around = tip_K + np.array([-1.0, 1.0])
    kohm_per_K = np.diff(branch.lever_voltage(around) / branch.current(around)) / 2.0
    mV_per_K = 1e3 * branch.current(tip_K) * kohm_per_K[0]
    return _johnson_nV(branch, tip_K) / abs(float(mV_per_K))


def _johnson_nV(branch: Branch, tip_K: float) -> float:
    """Return the density of the Johnson noise (nV/√Hz)."""
    state, current = branch.states(np.atleast_1d(branch.u_at(tip_K))), branch.current(tip_K)
    density = johnson_without_feedback(branch.equations, state, float(current))
    return float(1e9 * np.sqrt(density))


def voltage_by_distance(probe: Probe, *, tip_K: float) -> float:
    """Change of the lever's voltage with the distance to a surface, at a bias."""
    lever = Lever(probe, COARSE)
    branch = lever.branch(tip_K)
    bias = float(branch.bias(tip_K, probe.circuit))
    signal = Reader(probe).signal(lever, branch, float(branch.u_at(tip_K)), bias)
    return abs(signal.dV_dz_V_per_um)


def resistivity_ratio(*, n_d: float, p: float, temperature_K: float, from_K: float) -> float:
    """Resistivity of n-doped silicon at a temperature over that at another."""
    cold, hot = conductivity_low_doped([from_K, temperature_K], n_d, p)[0]
    return float(cold / hot)


def air_coefficient(probe: Probe, *, decay_um: float = np.inf) -> float:
    """Heat that a warm strip gives to the air, by area of both faces and mean rise.

    It is evenly warm, or the less so, by the decay length, the farther behind its front.
    """
    air = Lever(probe.in_medium("air"), COARSE).space.air
    base_K = probe.circuit.base_temperature_K
    kappa = PER_CM_TO_MILLI_PER_UM * float(thermal_conductivity_of_air(base_K)[0])
    behind = air.operator.sites[:, :1].max() - air.operator.sites[:, :1]
    heat, _ = air.heat(kappa * np.exp(-behind / decay_um))
    mean_rise = np.exp(-np.linspace(0.0, behind.max(), 1001) / decay_um).mean()
    area = sum(region.area for region in probe.layout().regions)
    gas = probe.surroundings.gas_conductivity
    # from mW/(µm² K) to W/(m² K)
    return 1e9 * float(heat[0]) * gas / (2.0 * area * float(mean_rise))


def layer_conductivity(*, thickness_um: float, temperature_K: float, scale: float) -> float:
    """Thermal conductivity of a silicon layer along its plane."""
    return 100.0 * scale * float(thermal_conductivity_of_layer(temperature_K, thickness_um)[0])


def raman_softening(
    *, temperature_K: float, reference_K: float, three_phonon: float, four_phonon: float
) -> float:
    """Softening of silicon's Raman line from a reference temperature."""
    shift_per_cm, _ = anharmonic.shift(temperature_K, reference_K, three_phonon, four_phonon)
    return -float(shift_per_cm)


def two_sided_contact(*, radius_um: float, kappa: float, other_kappa: float) -> float:
    """Resistance of a contact of two bodies, by spreading in each."""
    both = sum(contact_resistance(radius_um, [each]) for each in (kappa, other_kappa))
    return both / _PER_K_PER_W


def spreading_resistance(*, radius_um: float, kappa: float) -> float:
    """Resistance that a tip meets as heat spreads in a sample."""
    return contact_resistance(radius_um, [kappa]) / _PER_K_PER_W


def surface_share(
    *, radius_um: float, kappa: float, interface_K_per_W: float, tip_K_per_W: float | None = None
) -> float:
    """Rise of a sample's surface under a tip over that of the heater.

    Where the tip is not stated it is a cone of silicon.
    """
    interface = _PER_K_PER_W * interface_K_per_W
    below = contact_resistance(radius_um, [kappa], (), interface)
    if tip_K_per_W is None:
        tip = cold_resistance(EXAMPLE.with_(apex_radius_um=radius_um), 300.0)
    else:
        tip = _PER_K_PER_W * tip_K_per_W
    return (below - interface) / (tip + below)


def surface_share_on_another(*, share: float, kappa: float, on_kappa: float) -> float:
    """Rise of a surface over that of the heater by that on another sample, all else the same.

    Tip and interface are one resistance, fitted to the other sample.
    """
    fitted = (1.0 / share - 1.0) / kappa
    return 1.0 / (1.0 + on_kappa * fitted)


def heat_conductance_of_contact(
    *, radius_um: float, kappa: float, interface_m2K_per_W: float, height_um: float
) -> float:
    """Conductance from the heater through a silicon tip into a sample, in vacuum."""
    interface = 1e9 * interface_m2K_per_W / (np.pi * radius_um**2)
    tip = EXAMPLE.with_(apex_radius_um=radius_um, height_um=height_um)
    below = contact_resistance(radius_um, [kappa], (), interface)
    return 1e6 / (cold_resistance(tip, 300.0) + below)


#: By the names that cases have for them.
QUANTITIES = {
    function.__name__: PredictedQuantity(unit, (function.__doc__ or "").partition(".")[0], function)
    for function, unit in (
        (power_ratio_in_air, "1"),
        (share_into_air, "share"),
        (time_constant, "µs"),
        (resistance_ratio, "1"),
        (johnson_noise, "nV/√Hz"),
        (temperature_resolution, "µK/√Hz"),
        (voltage_by_distance, "mV/nm"),
        (resistivity_ratio, "1"),
        (air_coefficient, "W/(m² K)"),
        (layer_conductivity, "W/(m K)"),
        (raman_softening, "cm⁻¹"),
        (two_sided_contact, "K/W"),
        (spreading_resistance, "K/W"),
        (surface_share, "share"),
        (surface_share_on_another, "share"),
        (heat_conductance_of_contact, "nW/K"),
    )
}


class StoredPrediction(Record):
    """A prediction as it was written down: the median, and within what it is with 95 %."""

    median: float = Field(gt=0)
    low_95: float = Field(gt=0)
    high_95: float = Field(gt=0)


class Published(Record):
    """What was published, and its standard error as stated or as it can be read."""

    value: float = Field(gt=0)
    error: float = Field(gt=0)
    says: str = Field(description="the words of the source")


class Variant(Record):
    """Another assumption that was tried because the published number is outside the band."""

    why: str
    changes: dict[str, bool | float | str]


class Case(Record):
    """A published number, and what is known of what it is of."""

    name: str
    quantity: str
    group: str
    source: str
    stated: str
    assumed: str
    given: dict[str, float | str] = Field(default_factory=dict)
    lever: dict[str, Any] = Field(default_factory=dict)
    prediction: StoredPrediction | None = None
    published: Published | None = None
    remark: str = ""
    outside: str = Field(default="", description="why the published value is not in the band")
    variants: dict[str, Variant] = Field(default_factory=dict)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read a case file.

        Raises
        ------
        InputError
            If it cannot be read, or something of it is missing, unknown or impossible.
        """
        where, values = str(path), read_sections(path)
        lever = {name: values.pop(name) for name in SECTIONS if name in values}
        case = cls.from_values({"name": Path(path).stem, **values, "lever": lever}, where)
        if case.quantity not in QUANTITIES:
            raise unknown_name("quantity", case.quantity, QUANTITIES, where)
        arguments = case.definition.arguments
        for name in case.given:
            if name not in arguments:
                raise unknown_name("key", name, arguments, f"{where}: [given]")
        for name, needed in arguments.items():
            if needed and name not in case.given:
                raise InputError(f"{where}: [given]: {name} is missing")
        if lever and not case.definition.of_a_lever:
            raise InputError(
                f"{where}: [{next(iter(lever))}]: {case.quantity} is of no lever, expected its "
                "arguments in [given]"
            )
        case.numbers(where)
        case.probe(where)
        return case

    @property
    def definition(self) -> PredictedQuantity:
        """The quantity."""
        return QUANTITIES[self.quantity]

    def probe(self, where: str = "") -> Probe | None:
        """Return the lever, or what it is taken for; None of a law."""
        if not self.definition.of_a_lever:
            return None
        return Probe.from_sections(self.lever, where or self.name)

    def numbers(self, where: str = "") -> tuple[dict[str, float], dict[str, Prior]]:
        """Return what is given: values, and priors of those that are uncertain."""
        values, priors = dict[str, float](), dict[str, Prior]()
        for name, entry in self.given.items():
            if isinstance(entry, str):
                here = f"{where or self.name}: [given]: {name}"
                value, spread, written = parsed(entry, here)
                if value is None:
                    raise InputError(f"{here} = '{entry}', expected a value before its spread")
                priors[name] = Prior(value, spread, written != "unit")
                entry = value
            values[name] = float(entry)
        return values, priors


def cases() -> list[Case]:
    """Return the cases of the package, by name."""
    with resources.as_file(resources.files(__package__)) as folder:
        return [Case.from_file(path) for path in sorted((folder / "cases").glob("*.toml"))]


def sought() -> list[list[str]]:
    """Return the sources that were sought, what was wanted of each, and why it is no case."""
    with resources.as_file(resources.files(__package__)) as folder:
        entries = read_sections(folder / "sought.toml")
    return [[name, entry["wanted"], entry["found"]] for name, entry in entries.items()]
