"""Which width of the heater shall I draw?"""

import numpy as np

from hotlever import Probe, figures, save_figure
from hotlever.studies.design import Design, vary

widths = np.linspace(1.0, 3.0, 5)
study = vary(Design(Probe.reference()), {"heater_width_um": widths}, air=False)
for width, V, K in zip(widths, study.knee_bias_V.values, study.knee_K.values, strict=True):
    print(f"{width:.1f} µm: knee at a bias of {V:.1f} V, {K:.0f} K")

save_figure(figures.design_study(study), "heater_width.png")
