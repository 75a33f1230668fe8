"""How much colder is the tip in air?"""

import numpy as np

from hotlever import Lever, Probe, save_figure
from hotlever.figures.style import figure

bias = np.linspace(0.5, 11.0, 22)

with figure(4.8, 3.4) as (fig, axes):
    for medium in ("vacuum", "air"):
        sweep = Lever(Probe.reference().in_medium(medium)).sweep(bias)
        axes.plot(sweep.power_mW, sweep.tip_K, ".-", label=medium)
        print(f"{medium}: {np.interp(2.0, sweep.power_mW, sweep.tip_K):.0f} K at 2 mW")
    axes.set(xlabel="power of the lever (mW)", ylabel="tip temperature (K)")
    axes.legend()
save_figure(fig, "what_air_takes.png")
