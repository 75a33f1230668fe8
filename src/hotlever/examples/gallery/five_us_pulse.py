"""How hot does the tip get in a pulse of 5 µs?"""

import numpy as np

from hotlever import Lever, Probe, save_figure, simulate
from hotlever.figures.style import figure
from hotlever.lever.transient import pulse

lever = Lever(Probe.reference())
heights = np.array([3.0, 6.0, 9.0, 12.0])
peak = [simulate(lever, pulse(V, 5.0), at=[5.0]).tip_K.item() for V in heights]
rest = lever.sweep(np.linspace(0.5, 10.0, 100))
print(f"{heights[-1]:g} V for 5 µs heat the tip to {peak[-1]:.0f} K.")

with figure(4.8, 3.4) as (fig, axes):
    axes.plot(rest.bias_V, rest.tip_K, label="at rest")
    axes.plot(heights, peak, "o-", label="peak of a pulse of 5 µs")
    axes.set(xlabel="bias (V)", ylabel="tip temperature (K)")
    axes.legend()
save_figure(fig, "five_us_pulse.png")
