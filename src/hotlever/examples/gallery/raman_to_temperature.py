"""How hot was the tip in these Raman spectra?"""

from hotlever import (
    Thermometer,
    calibrate_from,
    figures,
    measure,
    read_lines,
    read_spectra,
    save_figure,
)

calibration, hot_plate = calibrate_from(read_spectra(["src/hotlever/examples/raman/hot-plate"]))
lines = measure(read_spectra(["src/hotlever/examples/raman/tip"]), calibration.options)
table = read_lines(lines, Thermometer(calibration))
columns = (table.file, table.temperature_K, table.temperature_error_K)
for file, T, error in zip(*(column.values for column in columns), strict=True):
    print(f"{file}: {T:.0f} ± {error:.0f} K")

save_figure(figures.thermometry(lines, table, calibration, hot_plate), "raman_to_temperature.png")
