"""How warm is a metal film on a membrane?"""

from hotlever import Lever, Probe, figures, save_figure
from hotlever.lever.fields import FieldMapper

probe = Probe.from_file("src/hotlever/examples/palladium-on-nitride.toml")
lever = Lever(probe)
(state,) = lever.solve([0.5])
print(f"At a bias of 0.5 V the tip is at {state.tip_K:.0f} K.")

maps = FieldMapper(lever).map(state)
save_figure(figures.field_maps(maps, probe.layout(), "palladium on nitride"), "metal_film.png")
