"""Where does the heat go?"""

from hotlever import Lever, Probe, figures, save_figure
from hotlever.lever.fields import AirFields

probe = Probe.reference().in_medium("air")
lever = Lever(probe)
states = lever.solve([4.0, 7.0, 9.0, 11.0])
air = AirFields(lever)
shares = air.shares(states)
into_air = (shares.air_heat_mW.sum("region") / shares.power_mW).values
print(f"At 11 V {into_air[-1]:.0%} of the power go into the air, the rest into the chip.")

flux = air.flux(states[-1])
title = f"tip at {states[-1].tip_K:.0f} K"
fig = figures.air_loss(probe.layout(), air.panels, flux, shares, title)
save_figure(fig, "where_the_heat_goes.png")
