"""How sure is my tip temperature?"""

from hotlever import calibrate, figures, save_figure

calibration = calibrate("src/hotlever/examples/lever-a.csv")
print(calibration.text())

save_figure(figures.calibration_curves(calibration), "how_sure.png")
