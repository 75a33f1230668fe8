"""How sure is my tip temperature?"""

from hotlever import calibrate, figures, save_figure
from hotlever.estimate.summary import calibration_text

calibration = calibrate("src/hotlever/examples/lever-a.csv")
print(calibration_text(calibration))

save_figure(figures.calibration_curves(calibration), "how_sure.png")
