"""What does a pulse do in air?"""

from hotlever import Lever, Probe, figures, save_figure, simulate
from hotlever.lever.transient import pulse

lever = Lever(Probe.reference().in_medium("air"))
history = simulate(lever, pulse(12.0, 10.0), until=60.0)  # V, µs
hottest = history.tip_K.max().item()
lost = history.lost_nJ[-1].item() / history.supplied_nJ[-1].item()
print(f"The tip reaches {hottest:.0f} K; after 60 µs {lost:.0%} of the heat has left the lever.")

save_figure(figures.history_overview(history), "pulse_in_air.png")
