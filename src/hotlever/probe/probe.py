"""A probe with its material and measuring circuit, and the file that describes it."""

from __future__ import annotations

import os
import tomllib
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from hotlever.air.surroundings import Surroundings
from hotlever.errors import InputError, unknown_name
from hotlever.files import read_text, write_text
from hotlever.materials import PARAMETERS, Material
from hotlever.materials.spieser2017 import DOI, published
from hotlever.probe.layout import Layout
from hotlever.probe.shapes import Shape, ThreeLeg, UShape, shape_of
from hotlever.probe.tip import Tip
from hotlever.records import Record


class Circuit(Record):
    """The measuring circuit (section ``[circuit]`` of a probe file).

    Attributes
    ----------
    series_resistance_ohm : float
        Series resistance R_s between the bias source and the lever (Ω); 0 is allowed.
    base_temperature_K : float
        Temperature of the leg ends (K).
    """

    series_resistance_ohm: Annotated[float, Field(ge=0)] = 5600.0
    base_temperature_K: Annotated[float, Field(ge=250, le=1000)] = 293.0


SECTIONS = ("probe", "circuit", "material", "surroundings", "tip")


class Probe(Record):
    """Shape, circuit, material, surroundings and tip of one lever: everything a solve needs.

    Without a `tip` the lever is flat, as in the paper.

    Examples
    --------
    >>> probe = Probe.reference()
    >>> probe.shape.length_um, probe.circuit.series_resistance_ohm
    (54.4, 5600.0)
    >>> probe.with_values({"n_d": 4e17, "series_resistance_ohm": 0}).material.n_d
    4e+17
    """

    shape: Shape
    circuit: Circuit = Circuit()
    material: Material = published("option III").material
    surroundings: Surroundings = Surroundings()
    tip: Tip | None = None

    @model_validator(mode="after")
    def _tip_stands_on_the_heater(self) -> Probe:
        if self.tip is not None:
            heater = np.array(self.shape.layout().heater.outline)
            room = np.ptp(heater, axis=0).min() / 2
            if not self.tip.base_radius_um < room:
                raise ValueError(
                    f"the tip's base has a radius of {self.tip.base_radius_um:.4g} µm, expected "
                    f"less than {room:.4g} µm, half the heater's narrow side"
                )
        return self

    @classmethod
    def reference(cls) -> Probe:
        """Return the reference probe: the three-legged lever that reproduces the paper.

        No drawing of the paper's lever is public. These dimensions and the series resistance
        are inferred: with the option-III parameters they give the published operating points.
        """
        return cls(
            shape=ThreeLeg(
                length_um=54.4,
                centre_leg_width_um=6.44,
                outer_leg_width_um=3.46,
                gap_um=3.2,
                bridge_width_um=3.82,
                heater_length_um=4.0,
                heater_width_um=1.645,
                thickness_um=0.4,
                reader_length_um=4.0,
            )
        )

    @classmethod
    def u_shape(cls) -> Probe:
        """Return a two-legged lever with a heater like the reference probe's."""
        return cls(
            shape=UShape(
                length_um=60.0,
                leg_width_um=6.0,
                gap_um=6.0,
                bridge_width_um=4.0,
                heater_length_um=4.0,
                heater_width_um=1.645,
                thickness_um=0.4,
            )
        )

    @classmethod
    def from_values(cls, values: dict[str, Any], where: str) -> Probe:
        """Make a probe of the sections of a probe file; `where` names it in an error.

        Raises
        ------
        InputError
            Naming the section and key, what was found and what is expected.
        """
        for name, section in values.items():
            if name not in SECTIONS:
                raise unknown_name("section", name, SECTIONS, where)
            if not isinstance(section, dict):
                raise InputError(f"{where}: [{name}] must be a section, found {section!r}")
        if "probe" not in values:
            raise InputError(f"{where}: section [probe] is missing")
        tip = values.get("tip")
        sections = {
            "shape": shape_of(values["probe"], f"{where}: [probe]"),
            "circuit": Circuit.of(values.get("circuit", {}), f"{where}: [circuit]"),
            "material": Material.of(
                {**published("option III").material.model_dump(), **values.get("material", {})},
                f"{where}: [material]",
            ),
            "surroundings": Surroundings.of(
                values.get("surroundings", {}), f"{where}: [surroundings]"
            ),
            "tip": None if tip is None else Tip.of(tip, f"{where}: [tip]"),
        }
        return cls.of(sections, where)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Probe:
        """Read a probe file (TOML).

        Sections left out, and material parameters left out, take the reference probe's values.

        Raises
        ------
        InputError
            If the file cannot be read or its content is at fault.
        """
        try:
            values = tomllib.loads(read_text(path))
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{path}: not valid TOML: {error}") from None
        return cls.from_values(values, str(path))

    def values(self) -> dict[str, dict[str, Any]]:
        """Return the sections as plain values: what `from_values` takes."""
        sections = {
            "probe": self.shape.model_dump(exclude_none=True),
            "circuit": self.circuit.model_dump(),
            "material": self.material.model_dump(),
            "surroundings": self.surroundings.model_dump(exclude_none=True),
        }
        if self.tip is not None:
            sections["tip"] = self.tip.model_dump()
        return sections

    def with_values(self, changes: dict[str, Any]) -> Probe:
        """Return a copy with some values changed, each named by its key in a probe file.

        Raises
        ------
        InputError
            If a name exists in no section (the nearest one is given) or a value is impossible.
        """
        sections = self.values()
        sections["probe"] = self.shape.model_dump()
        sections["surroundings"] = self.surroundings.model_dump()
        for name, value in changes.items():
            section = next((values for values in sections.values() if name in values), None)
            if section is None:
                known = [key for values in sections.values() for key in values]
                raise unknown_name("name", name, known)
            section[name] = value
        return Probe.from_values(sections, "probe")

    def in_medium(self, medium: str) -> Probe:
        """Return the probe in vacuum or in air.

        Raises
        ------
        InputError
            If the medium is neither.
        """
        return self.with_values({"medium": medium})

    def layout(self) -> Layout:
        """Return the regions, terminals and tip."""
        return replace(self.shape.layout(), cone=self.tip)

    def to_toml(self) -> str:
        """Return the probe as a commented probe file."""
        comments = {
            **self.shape.description(),
            "series_resistance_ohm": "between the bias source and the lever, R_s",
            "base_temperature_K": "of the leg ends",
            **{p.name: f"{p.meaning}, {p.symbol} ({p.unit})" for p in PARAMETERS.values()},
            "n_hd": "doping concentration of the high-doped silicon (cm⁻³)",
            **Surroundings.description(),
            **Tip.description(),
        }
        lines = ["# A hotlever probe file: lengths in µm, temperatures in K."]
        if self.shape == Probe.reference().shape:
            lines.append(
                "# The reference probe. No drawing of the published lever exists: these dimensions"
                f"\n# are inferred from the operating points in doi:{DOI}."
            )
        for name, section in self.values().items():
            lines += ["", f"[{name}]"]
            if name == "surroundings":
                section = self.surroundings.model_dump()
            for key, value in section.items():
                entry = f"# {key} =" if value is None else f"{key} = {_toml(value)}"
                lines.append(f"{entry:<32}# {comments[key]}" if key in comments else entry)
        if self.tip is None:
            example = Tip(height_um=0.7, half_angle_deg=20, apex_radius_um=0.02)
            lines += ["", "# Without a section [tip] the lever is flat. A cone under the heater:"]
            lines.append("# [tip]")
            for key, value in example.model_dump().items():
                lines.append(f"{f'# {key} = {_toml(value)}':<32}# {comments[key]}")
        return "\n".join(lines) + "\n"

    def to_file(self, path: str | os.PathLike[str]) -> None:
        """Write the probe as a commented probe file, whole or not at all."""
        write_text(path, self.to_toml())


def _toml(value: str | float) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else f"{value:.12g}"
