"""The measuring circuit: what is wired to the terminals of a lever.

The swept supply drives the heater current through a series resistor. Other terminals are at
ground, are sensed without a current, or are held: by a supply of their own, of a voltage behind a
resistor or of a current.

Resistor and lever may be one arm of a Wheatstone bridge, whose other arm divides the same voltage.
An amplifier that draws no current shows V_bridge = gain (V_l − V_b lower / (upper + lower)) +
offset. With a divider like the cold lever and its resistor that is what heat does to the
resistance, so that a lock-in or an amplifier sees more of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from hotlever.errors import InputError, unknown_name
from hotlever.records import Record, bounded
from hotlever.spieser2017 import BASE_TEMPERATURE_K
from hotlever.types import Array

#: Largest offset of an amplifier (V).
MOST_OFFSET_V = 10.0


class Contact(Record):
    """What is wired to one terminal (section ``[circuit.NAME]`` of a probe file).

    Examples
    --------
    >>> Contact(kind="supply", bias_V=2.0, series_resistance_ohm=1000).kind
    'supply'
    """

    kind: Literal["supply", "ground", "sense"]
    bias_V: float | None = bounded("of a supply that holds a voltage", -1000.0, 1000.0, None)
    current_mA: float | None = bounded("of a supply that holds a current", -1000.0, 1000.0, None)
    series_resistance_ohm: float = bounded(
        "between the terminal and its supply or ground", 0, 1e7, 0.0
    )
    base_temperature_K: float | None = bounded("of this leg end, if it is another", 250, 1000, None)

    @model_validator(mode="after")
    def _has_what_its_kind_has(self) -> Self:
        held = [name for name in ("bias_V", "current_mA") if getattr(self, name) is not None]
        if self.kind != "supply" and held:
            raise ValueError(f'{held[0]} means nothing with kind = "{self.kind}"')
        if len(held) == 2:
            raise ValueError("found bias_V and current_mA, expected one of them")
        if self.series_resistance_ohm and (self.kind == "sense" or "current_mA" in held):
            what = "a sense contact, which has no current" if self.kind == "sense" else "a current"
            raise ValueError(f"series_resistance_ohm means nothing before {what}")
        return self

    @property
    def is_held(self) -> bool:
        """Whether a supply drives it."""
        return self.bias_V is not None or self.current_mA is not None

    def __str__(self) -> str:
        held = "" if self.bias_V is None else f", {self.bias_V:g} V"
        held += "" if self.current_mA is None else f", {self.current_mA:g} mA"
        behind, warm = self.series_resistance_ohm, self.base_temperature_K
        after = f" behind {behind:g} ohm" if behind else ""
        return f"{self.kind}{held}{after}" + ("" if warm is None else f", leg end at {warm:g} K")

    @property
    def norton(self) -> tuple[float, float]:
        """Its conductance (mA/V) and short-circuit current (mA), as Norton has them."""
        if self.current_mA is not None:
            return 0.0, self.current_mA
        # a held voltage is behind at least ten nano-ohm, far less than any contact has
        conductance = 1.0 / max(self.series_resistance_ohm / 1000.0, 1e-11)
        return conductance, conductance * (self.bias_V or 0.0)


@dataclass(frozen=True)
class Wiring:
    """Which terminals are what.

    Attributes
    ----------
    swept : str
        The swept supply.
    grounds : tuple of str
        At ground, nothing between.
    held : tuple of str
        Each of one potential that follows from what is behind it: a supply of its own, or ground.
    senses : tuple of str
        No current.
    on_chip : tuple of str
        Those whose leg ends share one temperature that follows from the heat into the chip.
    """

    swept: str
    grounds: tuple[str, ...]
    held: tuple[str, ...]
    senses: tuple[str, ...]
    on_chip: tuple[str, ...] = ()

    @property
    def measurable(self) -> tuple[str, ...]:
        """Those whose potential follows from the rest."""
        return (*self.senses, *self.held)

    @property
    def conducting(self) -> tuple[str, ...]:
        """Those that a current passes, beside the swept supply."""
        return (*self.grounds, *self.held)


class Circuit(Record):
    """The measuring circuit (section ``[circuit]`` of a probe file).

    The bias V_b drives the heater current I_h through the series resistor R_s and the lever,
    V_b = V_l + R_s I_h. What a lever shows at a tip temperature does not depend on R_s; which tip
    temperature it takes at a bias does.

    A terminal ``supply`` is the swept supply, ``ground`` is at ground, and others are sensed,
    unless ``[circuit.NAME]`` says something else.

    Examples
    --------
    >>> Circuit().bias(lever_V=3.06, current_mA=0.93)
    8.268
    """

    # other keys are sections of contacts, by the names of their terminals
    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Contact] = Field(init=False)

    series_resistance_ohm: float = bounded(
        "between the bias source and the lever, R_s", 0, 1e7, 5600.0
    )
    base_temperature_K: float = bounded("of the leg ends", 250, 1000, BASE_TEMPERATURE_K)
    chip_K_per_mW: float = bounded(
        "by which leg ends get warmer for the heat that enters the chip by them", 0, 1000, 0.0
    )
    bridge_upper_ohm: float | None = bounded(
        "of a bridge, from the bias source to what V_l is compared with", 1e-3, 1e7, None
    )
    bridge_lower_ohm: float | None = bounded("of a bridge, from there to ground", 1e-3, 1e7, None)
    bridge_gain: float | None = bounded("of the bridge's amplifier; 1 if left out", -1e6, 1e6, None)
    bridge_offset_V: float = bounded(
        "that the bridge's amplifier shows of no voltage", -MOST_OFFSET_V, MOST_OFFSET_V, 0.0
    )
    swept: str = Field(
        default="supply",
        description="terminal of the supply that is swept",
        exclude_if=lambda name: name == "supply",
    )

    @model_validator(mode="after")
    def _bridge_is_whole(self) -> Self:
        arms = {name: getattr(self, name) for name in ("bridge_upper_ohm", "bridge_lower_ohm")}
        missing = [name for name, ohm in arms.items() if ohm is None]
        amplified = self.bridge_gain is not None or self.bridge_offset_V != 0.0
        if len(missing) == 1 or (missing and amplified):
            raise ValueError(f"a bridge needs {missing[0]}")
        if not missing and not self.series_resistance_ohm:
            raise ValueError(
                "series_resistance_ohm = 0: a bridge needs a resistor in series with the lever, "
                "for without one V_l is V_b"
            )
        if self.bridge_gain == 0.0:
            raise ValueError("bridge_gain = 0: expected the gain of an amplifier")
        return self

    @classmethod
    def from_values(cls, values: dict[str, Any], where: str) -> Self:
        """Check `values` and make a circuit; `where` names their origin in an error."""
        contacts = {
            name: Contact.from_values(dict(section), f"{where[:-1]}.{name}]")
            for name, section in values.items()
            if name not in cls.model_fields and isinstance(section, Mapping)
        }
        return super().from_values({**values, **contacts}, where)

    @model_validator(mode="before")
    @classmethod
    def _other_keys_are_sections(cls, values: Any) -> Any:
        for name, value in values.items() if isinstance(values, Mapping) else ():
            if name not in cls.model_fields and not isinstance(value, Mapping | Contact):
                raise ValueError(str(unknown_name("key", name, cls.model_fields)))
        return values

    @property
    def contacts(self) -> dict[str, Contact]:
        """What is said to be wired to terminals, by their names."""
        return self.model_extra or {}

    @model_validator(mode="after")
    def _one_supply_is_swept(self) -> Self:
        swept = self.contacts.get(self.swept)
        if swept is not None and (swept.kind != "supply" or swept.is_held):
            what = f'kind = "{swept.kind}"' if swept.kind != "supply" else "a value of its own"
            raise ValueError(
                f"{self.swept}: found {what}, expected a supply without a value: it is swept"
            )
        if swept is not None and swept.series_resistance_ohm:
            raise ValueError(
                f"{self.swept}: series_resistance_ohm of the swept supply stands in [circuit]"
            )
        for name, contact in self.contacts.items():
            if name != self.swept and contact.kind == "supply" and not contact.is_held:
                raise ValueError(
                    f"{name}: expected bias_V or current_mA of a supply that is not swept; the "
                    f"swept one is '{self.swept}'"
                )
        return self

    def contact(self, name: str) -> Contact:
        """Return what is wired to a terminal."""
        usual: dict[str, Literal["supply", "ground"]] = {self.swept: "supply", "ground": "ground"}
        return self.contacts.get(name) or Contact(kind=usual.get(name, "sense"))

    def wiring(self, terminals: Iterable[str], where: str = "probe") -> Wiring:
        """Return what some terminals are.

        Raises
        ------
        InputError
            If one that is wired does not exist, ``supply`` is left without one, or nothing holds a
            potential.
        """
        names = list(dict.fromkeys(terminals))
        for name in (self.swept, *self.contacts):
            if name not in names:
                raise unknown_name("terminal", name, names, f"{where}: [circuit]")
        if "supply" in names and "supply" not in (self.swept, *self.contacts):
            raise InputError(
                f"{where}: [circuit]: swept = \"{self.swept}\" leaves the terminal 'supply', "
                "expected [circuit.supply] with what is wired to it"
            )
        others = {name: self.contact(name) for name in names if name != self.swept}
        senses = tuple(name for name, contact in others.items() if contact.kind == "sense")
        wired = {name: contact for name, contact in others.items() if name not in senses}
        if not any(contact.norton[0] for contact in wired.values()):
            raise InputError(f"{where}: [circuit]: no terminal is at ground, expected one")
        bare = tuple(
            name
            for name, contact in wired.items()
            if contact.kind == "ground" and not contact.series_resistance_ohm
        )
        held = tuple(name for name in wired if name not in bare)
        warm = self.end_rises() if self.chip_K_per_mW else names
        on_chip = tuple(name for name in names if name not in warm)
        return Wiring(self.swept, bare, held, senses, on_chip)

    def check(self, terminals: Iterable[str], medium: str, where: str) -> None:
        """Refuse what does not fit some terminals in a medium.

        Raises
        ------
        InputError
            As `wiring`, or if in air leg ends are not at the base temperature.
        """
        self.wiring(terminals, where)
        if medium == "air" and self.end_rises():
            names = ", ".join(f"'{name}'" for name in self.end_rises())
            raise InputError(
                f"{where}: [circuit]: in air all leg ends have the base temperature, found another "
                f"of {names}"
            )

    def norton(self, contacts: Iterable[str]) -> tuple[Array, Array]:
        """Return conductances (mA/V) and short-circuit currents (mA) behind some contacts."""
        pairs = [self.contact(name).norton for name in contacts]
        conductance, current = np.reshape(pairs, (-1, 2)).T
        return conductance, current

    def end_rises(self) -> dict[str, float]:
        """Return by how much leg ends are warmer than the base temperature (K), if they are."""
        base = self.base_temperature_K
        ends = {name: contact.base_temperature_K for name, contact in self.contacts.items()}
        return {name: end - base for name, end in ends.items() if end not in (None, base)}

    @property
    def starts_cold(self) -> bool:
        """Whether all of the lever is at the base temperature until the swept supply heats it."""
        held = any(contact.norton[1] for contact in self.contacts.values())
        return not held and not self.end_rises()

    @property
    def is_plain(self) -> bool:
        """Whether it is the paper's circuit: one supply, grounds and sense contacts."""
        return not self.contacts and self.swept == "supply"

    def need_cold_start(self, what: str) -> None:
        """Refuse a lever that something else than the swept supply heats.

        Raises
        ------
        InputError
            Naming the terminal.
        """
        warm = self.end_rises()
        for name, contact in self.contacts.items():
            if contact.norton[1] or name in warm:
                raise InputError(
                    f"[circuit.{name}]: {what} takes a lever that only the swept supply heats, "
                    f"found {'a held supply' if contact.norton[1] else 'a warmer leg end'}"
                )

    # --- the swept supply and its bridge ----------------------------------------------------------

    @property
    def series_kohm(self) -> float:
        """R_s in kΩ, which makes volts of milliamperes."""
        return self.series_resistance_ohm / 1000.0

    def bias(self, lever_V: Any, current_mA: Any) -> Any:
        """Return the bias V_b (V) of a lever voltage (V) and a current (mA), or its change."""
        return lever_V + self.series_kohm * current_mA

    def bias_by(self, name: str, current_mA: Any) -> Any:
        """Return how the bias (V) changes with a value of the circuit, the lever being the same."""
        return current_mA / 1000.0 if name == "series_resistance_ohm" else 0.0 * current_mA

    def lever_voltage(self, bias_V: Any, current_mA: Any) -> Any:
        """Return the lever voltage V_l (V) of a bias (V) and a current (mA)."""
        return bias_V - self.series_kohm * current_mA

    def power(self, bias_V: Any, current_mA: Any) -> Any:
        """Return the power P_l = V_l I_h (mW) of a bias (V) and a current (mA)."""
        return self.lever_voltage(bias_V, current_mA) * current_mA

    @property
    def has_bridge(self) -> bool:
        """Whether the lever is part of a Wheatstone bridge."""
        return self.bridge_upper_ohm is not None

    @property
    def _arms(self) -> tuple[float, float, float]:
        """Gain, and upper and lower resistor of the divider (Ω), NaN without a bridge."""
        upper, lower = self.bridge_upper_ohm, self.bridge_lower_ohm
        if upper is None or lower is None:
            return (float("nan"),) * 3
        return 1.0 if self.bridge_gain is None else self.bridge_gain, upper, lower

    def bridge_voltage(self, lever_V: Any, bias_V: Any) -> Any:
        """Return the voltage V_bridge (V) of a lever voltage and a bias (V); NaN without one."""
        return self.bridge_change(lever_V, bias_V) + self.bridge_offset_V

    def bridge_change(self, lever_V: Any, bias_V: Any) -> Any:
        """Return how V_bridge (V) changes where the lever voltage and the bias change (V)."""
        gain, upper, lower = self._arms
        return gain * (lever_V - lower / (upper + lower) * bias_V)

    def bridge_by(self, name: str, bias_V: Array) -> Array:
        """Return how V_bridge (V) changes with a value of the circuit, V_l and V_b being the same.

        The gain is no such value: its error is that of the scale of what is shown.
        """
        gain, upper, lower = self._arms
        if name == "bridge_offset_V":
            return np.full_like(bias_V, 1.0)
        by = {"bridge_upper_ohm": lower, "bridge_lower_ohm": -upper}.get(name, 0.0)
        return np.asarray(gain * by / (upper + lower) ** 2 * bias_V)

    def current_of_bridge(self, bridge_V: Array, bias_V: Array) -> Array:
        """Return the current I_h (mA) at which the bridge shows a voltage (V); NaN without one."""
        gain, upper, lower = self._arms
        difference_V = (bridge_V - self.bridge_offset_V) / gain
        return np.asarray((upper / (upper + lower) * bias_V - difference_V) / self.series_kohm)
