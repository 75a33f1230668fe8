"""A lever that reads its distance: against differences, circuits and thermodynamics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.constants import Boltzmann
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from hotlever import Lever, Probe
from hotlever.datasets import csv_text
from hotlever.errors import InputError
from hotlever.figures import figure_of
from hotlever.lever.lever import COARSE
from hotlever.lever.noise import (
    NoiseOptions,
    Response,
    johnson,
    johnson_without_feedback,
    of_resistors,
    of_temperature,
    per_hooge,
)
from hotlever.lever.reader import Reader, at_distance, best_bias, over_surface, rows_of
from hotlever.lever.space import TIP
from hotlever.lever.transient.modes import slowest_modes
from hotlever.studies.thermoelectric_shift import strip_of

#: What a difference of the distance is told by must not be the panels of other operators.
MESH = replace(COARSE, panels=0.2)
OVER = Probe.reference().with_(medium="air", surface_gap_um=0.5, accommodation=1.0)
HEATED = {f"circuit.reader.{key}": value for key, value in (
    ("kind", "supply"), ("bias_V", 2.0), ("series_resistance_ohm", 500.0)
)}  # fmt: skip
PROBES = {
    "heater": OVER,
    "reader": OVER.with_(**HEATED),
    "tilted": OVER.with_(**HEATED, surface_tilt_deg=0.5, surface_gap_um=1.0),
}
SIGNALS = ("reader_V", "reader_ohm")
OUTPUT_INDEX = {"lever_V": 0, "reader_V": 2}
NOISE = NoiseOptions(hooge=1e-6, vibration_nm=1e-4)


@pytest.fixture(scope="module", params=PROBES)
def over(request: pytest.FixtureRequest) -> Lever:
    return Lever(PROBES[request.param], MESH)


def test_the_slope_is_that_of_readings_at_two_distances(over):
    gap, bias = over.probe.surroundings.surface_gap_um, [6.0]
    here = over_surface(over, [gap], bias)
    near, far = (over_surface(over, [gap + way], bias) for way in (-1e-3, 1e-3))
    by_V, by_ohm = ((far[name].item() - near[name].item()) / 2e-3 for name in SIGNALS)
    assert here.dV_dz_V_per_um.item() == pytest.approx(by_V, rel=1e-4)
    assert here.dlnR_dz_per_um.item() == pytest.approx(by_ohm / here.reader_ohm.item(), rel=1e-4)


def test_what_is_read_is_what_a_sweep_has(over):
    data, sweep = over_surface(over, [1.0], [6.0]), at_distance(over, 1.0).sweep([5.99, 6.0, 6.01])
    held = "reader_mA" in sweep
    names = ("reader_V", "reader_mA") if held else ("lever_V", "current_mA")
    voltage, current = (sweep[name].values for name in names)
    assert data.reader_V.item() == pytest.approx(voltage[1], rel=1e-4)
    assert data.reader_ohm.item() == pytest.approx(1e3 * voltage[1] / current[1], rel=1e-4)
    if held:
        talk = (voltage[2] - voltage[0]) / 0.02
        assert data.crosstalk_V_per_V.item() == pytest.approx(talk, rel=2e-3)
        power = np.diff(sweep.power_mW.values[[0, 2]]).item() / 0.02
        assert data.crosstalk_V_per_mW.item() == pytest.approx(talk / power, rel=2e-3)


def test_noise_is_the_sum_of_its_sources(over):
    data = over_surface(over, [1.0], [4.0, 6.0], NOISE)
    total = np.sqrt((data.source_V_per_rtHz**2).sum("source"))
    np.testing.assert_allclose(data.noise_V_per_rtHz, total)
    assert (data.source_V_per_rtHz > 0).all()
    resolved = data.noise_V_per_rtHz / np.abs(data.dV_dz_V_per_um) * 1e3
    np.testing.assert_allclose(data.resolution_nm_per_rtHz, resolved)
    narrow = over_surface(over, [1.0], [4.0], replace(NOISE, high_Hz=10.0))
    ratio = (narrow / data.isel(bias=[0])).source_V_per_rtHz.sel(source="1/f noise").item()
    assert ratio**2 == pytest.approx((np.log(10) / 9) / (np.log(1000) / 999))


def test_the_delay_is_how_the_response_falls_with_the_rate(over):
    """Of what changes as exp(st) the response is that at rest over 1 + s τ, for small rates s."""
    near = at_distance(over, 1.0)
    (state,) = near.solve([6.0])
    equations, rate = near.equations, 1e-3
    near.space.air.around = None
    output = "reader_V" if over.circuit.contacts else "lever_V"
    found = Response.of(equations, state.x, TIP, output)
    slope, delay = found.by_parameter("surface_gap_um")
    forced = equations.by_parameter(state.x, ["surface_gap_um"])[..., 0]
    # the heat that is stored meanwhile forces the state again, until nothing changes
    change = found.change(forced)
    for _ in range(4):
        change = found.change(forced + rate * equations.storage_change(state.x, change))
    answer = equations.observed_change(state.x, change)[OUTPUT_INDEX[output], 0]
    assert answer == pytest.approx(slope / (1.0 + rate * delay), rel=1e-4)
    assert found.change(forced)[:, 0] @ equations.observed_gradient(state.x)[
        :, 0, OUTPUT_INDEX[output]
    ] == pytest.approx(slope, rel=1e-4)
    assert 0.0 < delay < float(slowest_modes(state)[0][0])


def response(probe: Probe, bias: float) -> Response:
    lever = Lever(probe, COARSE)
    (state,) = lever.solve([bias])
    return Response.of(lever.equations, state.x, TIP, "lever_V")


def test_johnson_noise_of_2500_ohm_at_600_K_is_9_1_nV():
    """Of a lever that is as warm all over, behind a resistor that carries next to no current."""
    warm = Probe.reference().with_(base_temperature_K=600.0, series_resistance_ohm=1e7)
    found = response(warm, 1.0)
    lever_V, current, _ = found.equations.observed(found.x)[:, 0]
    ohm = 1e3 * lever_V / current
    # the resistor takes part of it
    open_circuit = johnson(found) * (1.0 + ohm / 1e7) ** 2
    assert open_circuit == pytest.approx(4.0 * Boltzmann * 600.0 * ohm, rel=1e-4)
    assert np.sqrt(open_circuit * 2500.0 / ohm) == pytest.approx(9.1e-9, rel=2e-3)
    of_resistor = 4.0 * Boltzmann * 293.0 * 1e7 * (ohm / 1e7) ** 2
    assert of_resistors(found) == pytest.approx(of_resistor, rel=1e-2)


def test_johnson_noise_of_a_resistor_of_many_temperatures():
    """With next to no current: 4 k_B times the mean temperature, weighted by the Joule heat."""
    uneven = {"circuit.ground.kind": "ground", "circuit.ground.base_temperature_K": 900.0}
    probe = Probe.reference().with_(**uneven, series_resistance_ohm=1e7)
    lever = Lever(probe, COARSE)
    branch, reading, _ = lever.read(np.array([1.0]))
    constraint = branch.parametrisation.constraint(reading.u)
    state = lever.polished(branch.states(reading.u), 1.0, constraint)
    found = Response.of(lever.equations, state.x, constraint, "lever_V")
    fields, properties, _ = lever.equations.at(state.x)
    heat = lever.space.weights * properties.sigma * (fields.grad_V**2).sum(axis=0)
    expected = 4e3 * Boltzmann * (fields.T * heat).sum() / state.current_mA**2
    ohm = 1e3 * state.lever_V / state.current_mA
    assert johnson(found) * (1.0 + ohm / 1e7) ** 2 == pytest.approx(expected, rel=1e-3)
    assert johnson_without_feedback(lever.equations, state.x, state.current_mA) == pytest.approx(
        expected, rel=1e-9
    )
    assert 300.0 < (fields.T * heat).sum() / heat.sum() < 850.0


def test_hooge_s_noise_of_a_strip_is_by_the_number_of_carriers():
    """α V²/(N f), of a strip of one doping at one temperature."""
    silicon = Probe.reference().kinds["low-doped"]
    probe = strip_of(silicon, series_resistance_ohm=1e7).with_physics(())
    found = response(probe, 1.0)
    lever_V, current, _ = found.equations.observed(found.x)[:, 0]
    carriers = silicon.n_d * 1e-12 * 8.0 * 1.0 * 0.4
    open_circuit = per_hooge(found) * (1.0 + lever_V / current / 1e4) ** 2
    assert open_circuit == pytest.approx(lever_V**2 / carriers, rel=1e-6)


def of_heat(lever: Lever, shape: np.ndarray) -> Response:
    """What responds to heat by some shape of the temperature, in the cold lever."""
    return Response(lever.equations, np.zeros_like(shape), shape, 0.0, 0.0, np.negative)


@pytest.mark.parametrize("medium", ["vacuum", "air"])
def test_fluctuations_of_the_temperature_are_those_of_a_conductance(medium, coarse):
    """4 k_B T² G with G what the equations conduct, in equilibrium."""
    lever = coarse.in_medium(medium)
    cold = np.zeros((lever.space.size + 1, 1))
    warm = np.where(lever.space.is_temperature, 1.0, 0.0)[:, None]
    conductance = (warm * lever.equations.balance_change(cold, warm)).sum()
    found = of_temperature(of_heat(lever, warm))
    assert found == pytest.approx(4e3 * Boltzmann * 293.0**2 * conductance, rel=1e-9)


def test_fluctuations_of_the_temperature_hold_equipartition(coarse):
    """The spectrum of the mean temperature integrates to k_B T²/C over all frequencies.

    The mean is weighted by heat capacities, and the response at each frequency solved for.
    """
    free = np.flatnonzero(coarse.space.is_temperature)
    each = np.zeros((coarse.space.size + 1, free.size))
    each[free, np.arange(free.size)] = 1.0
    changes = coarse.equations.balance_change, coarse.equations.storage_change
    conducted, stored = (csc_array(change(0.0 * each, each)[free]) for change in changes)
    capacity = stored.sum()
    mean, frequencies = stored.sum(axis=0) / capacity, np.geomspace(1e-5, 2e3, 81)
    spectrum = []
    for MHz in frequencies:
        adjoint = splu((conducted + 2j * np.pi * MHz * stored).tocsc()).solve(mean.astype(complex))
        parts = np.zeros((2, coarse.space.size + 1, 1))
        parts[:, free, 0] = adjoint.real, adjoint.imag
        spectrum.append(sum(of_temperature(of_heat(coarse, part)) for part in parts))
    # below the lowest frequency it is that at rest
    by_octave = np.trapezoid(spectrum * frequencies, np.log(frequencies))
    variance = 1e6 * (by_octave + spectrum[0] * frequencies[0])
    assert variance == pytest.approx(Boltzmann * 293.0**2 / (1e-9 * capacity), rel=1e-3)


def test_the_best_bias_resolves_better_than_others():
    lever = Lever(PROBES["heater"], MESH)
    best = best_bias(lever, [0.5], 9.0)
    (found,) = over_surface(lever, [0.5], [best, 0.9 * best, 3.0]).resolution_nm_per_rtHz.values
    assert found[0] < found[1] < found[2]


def test_pressures_are_a_dimension_and_rows_of_a_file():
    lever = Lever(PROBES["heater"], MESH)
    data = over_surface(lever, [0.5], [5.0, 6.0], pressure_mbar=[100.0, 1000.0])
    assert dict(data.sizes) == {"pressure": 2, "distance": 1, "bias": 2, "source": 6}
    assert "the temperature of the air jumps as at 600 K" in data.attrs["notes"]
    assert (data.dV_dz_V_per_um.isel(pressure=0) < data.dV_dz_V_per_um.isel(pressure=1)).all()
    rows = rows_of(data)
    text = csv_text(rows, [str(name) for name in rows.data_vars])
    assert text.count("\n") == 5
    assert text.startswith("surface_gap_um,bias_V,reader_ohm,")
    assert rows.pressure_mbar.values.tolist() == [100.0] * 2 + [1000.0] * 2
    assert len(figure_of(data).axes) == 4


def test_what_shows_nothing_is_refused():
    ideal = {**HEATED, "circuit.reader.series_resistance_ohm": 0.0}
    for probe, message in (
        (OVER.in_medium("vacuum"), "in vacuum a reader sees no surface"),
        (OVER.with_(**ideal), r"\[circuit.reader\]: found a supply that holds the voltage"),
        (OVER.with_(series_resistance_ohm=0.0), r"\[circuit\]: found a supply that holds"),
    ):
        with pytest.raises(InputError, match=message):
            Reader(probe)
    lever = Lever(PROBES["heater"], MESH)
    for distances, bias, message in (
        ([0.0], [5.0], "found a distance of 0 µm, expected distances above 0"),
        ([1.0], [0.0], "found a bias of 0 V, which heats no reader"),
    ):
        with pytest.raises(InputError, match=message):
            over_surface(lever, distances, bias)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--distance", "0um:3um:4"], "found '0um', expected a length from 1nm to 1cm"),
        (["--distance", "-1um:3um:4"], "found '-1um', expected a length"),
        (["--distance", "3um:0.3um:4"], "expected START < STOP"),
        (["--distance", "0.3:3:4"], "found '0.3', expected a number with a unit like um"),
        (["--medium", "vacuum"], "in vacuum a reader sees no surface, expected air"),
        (["--set", "tip.height_um=0.7"], "0.3 µm, expected distances above the tip's height, 0.7"),
        (["--bandwidth", "1kHz:1Hz"], "expected LOW:HIGH, such as 1Hz:1kHz"),
        (["--bandwidth", "1Hz"], "found '1Hz', expected LOW:HIGH, such as 1Hz:1kHz"),
        (["--amplifier", "5"], "--amplifier: found '5', expected a number with a unit like V"),
        (["--hooge", "-1"], "hooge: found -1, expected a number from 0 to 1"),
        (["--vibration", "1"], "--vibration: found '1', expected a number with a unit like nm"),
        (["--pressure", "0:10:2"], "found '0', expected 1e-6 to 1e6 mbar"),
        (["--set", "sample=polymer", "--set", "tip.height_um=0.2"], "the tip touches a sample"),
    ],
)
def test_bad_input_is_one_line(arguments, message, refused):
    assert message in refused("reader", *arguments, below_notes=True)


@pytest.mark.slow
def test_a_bias_at_which_the_lever_melts_is_no_empty_row(run, coarse_meshes):
    status, out, err = run("reader", "--distance", "1um", "--bias", "40V")
    assert (status, out) == (1, "")
    assert "hotlever: at 1 µm: silicon melts at a bias of" in err


def test_the_command_writes_a_row_for_each_distance(run, coarse_meshes, tmp_path):
    options = ["--distance", "0.5um:1um:2", "--bias", "6:6:1", "--plot", "reader.png"]
    status, out, err = run("reader", *options)
    assert status == 0
    head, *rows = out.splitlines()
    assert head == (
        "surface_gap_um,bias_V,reader_ohm,reader_V,dV_dz_V_per_um,dlnR_dz_per_um,"
        "noise_V_per_rtHz,resolution_nm_per_rtHz"
    )
    assert [row.split(",")[0] for row in rows] == ["0.5", "1"]
    assert "the heater itself is read, behind 5600 ohm" in err
    assert "taken in air" in err
    assert "bend the lever" in err
    assert (tmp_path / "reader.png").stat().st_size > 10_000
