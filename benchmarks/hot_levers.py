"""Levers where radiation counts: what they radiate, and how much cooler that makes their tips.

In vacuum, at three tip temperatures, with the emissivities that materials have unless they are
told otherwise, and with a half, which a thin sheet that conducts can have at most. Then what
sheets of the resistance of each material would emit.

Run: python benchmarks/hot_levers.py [FIGURE.png]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from hotlever.errors import ComputationError
from hotlever.figures import radiated_shares, save_figure
from hotlever.probe import Probe
from hotlever.studies.radiation import radiated_heat, sheet_emissivities

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


def main(file: str | None) -> None:
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
    main(sys.argv[1] if len(sys.argv) > 1 else None)
