"""Does it matter how the lever lies on the wafer?"""

import gdstk
import numpy as np

from hotlever import Lever, Probe, save_figure
from hotlever.probe.drawing import Drawing

library = gdstk.read_gds("src/hotlever/examples/reference-probe.gds")
(cell,) = library.top_level()
library.new_cell("WAFER").add(gdstk.Reference(cell, (120, -35), rotation=np.pi / 6))
library.write_gds("turned.gds")

tip = np.array([120, -35]) + 48.58 * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
layers = {"silicon": "1/0", "heater": "2/0", "reader": "3/0"}
terminals = {"supply": "10/0", "ground": "11/0", "reader": "12/0"}
drawing = Drawing(layers, terminals, tuple(tip.tolist()), thickness_um=0.4, file="turned.gds")
turned = Probe.from_drawing(drawing)

bias = np.linspace(1.0, 11.0, 11)
as_drawn, as_turned = (Lever(probe).sweep(bias) for probe in (Probe.reference(), turned))
apart = abs(as_turned.tip_K - as_drawn.tip_K).max().item()
print(f"The tip temperatures of both differ by {apart:.2f} K at most.")
save_figure(turned.draw("turned by 30°"), "turned_on_the_wafer.png")
