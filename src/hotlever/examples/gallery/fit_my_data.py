"""Which material explains my data?"""

from hotlever import Lever, figures, fit, save_figure

found = fit("src/hotlever/examples/lever-a.csv")
for name, one in found.parameters.items():
    print(f"{name}: {one}")

measured = found.measurement.dataset(found.probe.circuit)
model = Lever(found.probe).sweep(found.measurement.bias_V)
made = figures.data_and_model(measured, model, found.observables)
save_figure(made, "fit_my_data.png")
