"""How warm is a metal film on a membrane?"""

from hotlever import Lever, Probe, figures, save_figure

probe = Probe.from_file("src/hotlever/examples/palladium-on-nitride.toml")
lever = Lever(probe)
(state,) = lever.solve([0.5])
print(f"At a bias of 0.5 V the tip is at {state.tip_K:.0f} K.")
save_figure(figures.field_maps(state), "metal_film.png")
