"""Which material explains my data?"""

from hotlever import Lever, figures, fit, save_figure

result = fit("src/hotlever/examples/lever-a.csv")
for name, parameter in result.parameters.items():
    print(f"{name}: {parameter}")

measured = result.measurement.dataset(result.probe.circuit)
model = Lever(result.probe).sweep(result.measurement.bias_V)
fig = figures.data_and_model(measured, model, result.observables)
save_figure(fig, "fit_my_data.png")
