"""Where is the knee of my lever?"""

import numpy as np

from hotlever import Lever, Probe, figures, save_figure

probe = Probe.reference()  # or Probe.from_file("my-lever.toml")
lever = Lever(probe)
knee = lever.knee()
volts, current, tip = knee.lever_V.item(), knee.current_mA.item(), knee.tip_K.item()
print(
    f"The lever voltage is highest, {volts:.2f} V, at {current:.2f} mA; the tip is at {tip:.0f} K."
)
print(f"Behind {probe.circuit.series_resistance_ohm:g} ohm it is at {knee.bias_V.item():.2f} V.")

sweep = lever.sweep(np.linspace(0.2, 11.0, 200))
save_figure(figures.iv_curves({"vacuum": sweep}, {"knee": knee}), "knee.png")
