"""What if the reader is heated too?"""

import numpy as np

from hotlever import Lever, Probe, save_figure
from hotlever.figures.style import figure

probe = Probe.reference()
held = {"circuit.reader.kind": "supply", "circuit.reader.series_resistance_ohm": 500.0}
bias = np.linspace(0.0, 9.0, 10)

with figure(7.4, 3.2, 1, 2) as (fig, (left, right)):
    for volts in (0.0, 1.5, 3.0):
        both = Lever(probe.with_(**held, **{"circuit.reader.bias_V": volts})).sweep(bias)
        left.plot(both.bias_V, both.tip_K, "o-", label=f"reader at {volts:g} V")
        right.plot(both.bias_V, both.reader_mA, "o-")
    print(f"With 3 V at the reader alone the tip is at {both.tip_K[0].item():.0f} K.")
    left.set(xlabel="bias of the heater (V)", ylabel="tip temperature (K)")
    right.set(xlabel="bias of the heater (V)", ylabel="current into the reader (mA)")
    left.legend()
save_figure(fig, "heat_the_reader.png")
