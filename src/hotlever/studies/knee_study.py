"""The knee of a lever: why it is not at the inversion temperature, and what it is off by.

The paper (discussion of its Fig. 6) gives two reasons why its knee is not at T_i: the resistance of
the legs rises with the temperature, and the doping of the heater is not uniform. Levers without the
one, the other or both show what each accounts for. Two more remain without either: only the middle
of the heater is as hot as the tip; and dV_l/dI_h = 0 is not dR_l/dT = 0, because with V² = P R the
voltage still rises where the resistance is highest.

The paper fits a model to a lever and predicts the temperature at its knee; the measured one is 50 K
higher. Each suspect is a lever that has one thing more than the model, or another law, measured as
the paper did: currents, reader voltages and tip temperatures of a bias ramp. The model is fitted to
that, and what the knee is read to be above what the fit predicts is what the suspect carries;
beside it stands what it would carry were the model not fitted, and what it carries where both knees
are read off the ramp, at its highest V_l. A law is known to within a departure
(`hotlever.materials.departures`), each coefficient of which is a suspect of the size of a standard
deviation.

Of a tip on the heater, which the paper suspects, three things are told apart: how it moves the knee
of the same lever, how it moves the temperature at the same power, and by how much a tipless model
*fitted* to a lever with a tip misses its knee. A tip conducts heat away from the middle of the
heater, and in air its surface gives heat to the air; what the latter does by itself is told too.

What each suspect carries of the layouts of the paper's lever is stored, as
``benchmarks/published_lever.py knee`` writes it. What a law may carry is a standard error: the root
of the sum of the squares over its coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from hotlever import spieser2017 as paper
from hotlever.datasets import labelled
from hotlever.errors import ComputationError
from hotlever.estimate import Estimate, Measurement, calibrate, fit, plan_next
from hotlever.estimate.options import FitOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import solve
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.materials import PARAMETERS
from hotlever.materials.departures import DEPARTURES, FACTORS, departure_of
from hotlever.materials.heat import thermal_conductivity
from hotlever.materials.silicon import intrinsic_density, inversion_temperature
from hotlever.probe import Probe, Tip
from hotlever.probe.probe_parameters import parameter_named
from hotlever.raman.thermometer import published_raman_calibration
from hotlever.studies.published_lever.ensemble import stored_table
from hotlever.studies.published_lever.statements import raman_error
from hotlever.studies.simulation_based_calibration import MinimosMaterial
from hotlever.types import Array, Progress
from hotlever.work import each

#: Plausible tips of lithography probes, cones: height (µm) and half-angle (degrees).
SIZES = ((0.5, 15.0), (0.5, 30.0), (0.7, 20.0), (1.0, 15.0), (1.0, 30.0))


class Suspect(StrEnum):
    """What a lever may have beyond the paper's model, or other than it, by what is said of it.

    A line reads what is curved; a tip conducts, and gives heat to the air; thermoelectricity
    depends on the polarity. Laws differ: κ of a film by its thickness, or with all that c_κ takes
    away scattered at surfaces, whatever the temperature; carriers as they were measured, or as few
    as Barber calculated at 700 K; their mobility.
    """

    RAMAN = "curved Raman law"
    FILM = "κ of a film of this thickness"
    SURFACES = "κ with all of c_κ by surfaces"
    CARRIERS = "carriers of Misiakos and Tsamakis"
    FEW_CARRIERS = "0.6 of the carriers of Eq. 7"
    MOBILITY = "mobility of MINIMOS"
    IN_VACUUM = "tip"
    IN_AIR = "tip with its surface in air"
    TOWARDS = "thermoelectricity, current to the bridge"
    AWAY = "thermoelectricity, current from it"
    RADIATION = "radiation"
    CHIP_WARMS = "warm chip, 2 K/mW"
    TOGETHER = "all together"


def knee_K(probe: Probe) -> float:
    """Return the tip temperature at a probe's knee (K).

    Raises
    ------
    ComputationError
        If it has none.
    """
    return Lever(probe).branch().need_knee().tip_K


# --- why it is not at the inversion temperature ---------------------------------------------------


def reasons_of_the_knee(lever: Lever) -> xr.Dataset:
    """Solve the lever without leg resistance, without dopant diffusion, and without both.

    Returns
    -------
    xarray.Dataset
        ``knee_K`` and ``resistance_K``, the tip temperatures at which V_l and R_l are highest, on
        the dimension ``lever`` (``as it is``, ``no leg resistance``, ``uniform doping``,
        ``neither``); the inversion temperature T_i of the heater's doping as the attribute
        ``inversion_K``.

    Raises
    ------
    ComputationError
        If one of them has no knee.
    """
    material = lever.probe.material
    # a thousandth of the legs' resistivity, and a diffusion length (µm) far below the mesh size
    ideal_legs = {"a0": 1e-3 * material.a0, "a1": 1e-3 * material.a1}
    uniform = {"delta": 1e-3}
    levers = {"as it is": {}, "no leg resistance": ideal_legs, "uniform doping": uniform}
    levers["neither"] = ideal_legs | uniform
    # none of these materials is possible, so none is checked
    maxima = [
        _highest(lever.with_material(material.model_copy(update=changes)).branch(), name)
        for name, changes in levers.items()
    ]
    knee, resistance = zip(*maxima, strict=True)
    return labelled(
        {"knee_K": list(knee), "resistance_K": list(resistance)},
        "lever",
        {"lever": list(levers)},
        inversion_K=float(inversion_temperature(material.n_d, material.p)),
    )


def steps_to_the_knee(reasons: xr.Dataset) -> list[tuple[str, float]]:
    """Return the way from the inversion temperature to the knee: reason and kelvins."""
    knee = dict(zip(reasons.lever.values, reasons.knee_K.values.tolist(), strict=True))
    resistance = reasons.resistance_K.sel(lever="neither").item()
    return [
        ("the heater's ends are colder than its middle", resistance - reasons.inversion_K),
        ("the voltage is highest above where the resistance is", knee["neither"] - resistance),
        ("the doping is not uniform", knee["no leg resistance"] - knee["neither"]),
        ("the legs have a resistance", knee["as it is"] - knee["no leg resistance"]),
    ]


def _highest(branch: Branch, name: str) -> tuple[float, float]:
    """Tip temperatures (K) at the knee and at the first maximum of the resistance."""
    tip = np.linspace(400.0, branch.hottest_K, 400)
    curve = CubicSpline(tip, branch.lever_voltage(tip) / branch.current(tip))
    roots = curve.derivative().roots(extrapolate=False)
    maxima = roots[curve(roots, 2) < 0]
    if not maxima.size:
        raise ComputationError(f"the lever ({name}) has no knee below {branch.hottest_K:.0f} K")
    return branch.need_knee(f"the lever ({name})").tip_K, float(maxima[0])


# --- what a tip changes ---------------------------------------------------------------------------


def tip_effects(probe: Probe, sizes: Sequence[tuple[float, float]] = SIZES) -> xr.Dataset:
    """Compute what tips change on a lever, in the flat model and the probe's medium.

    Parameters
    ----------
    probe : Probe
        Without a tip.
    sizes : sequence of (float, float)
        Height (µm) and half-angle (degrees) of each tip.

    Returns
    -------
    xarray.Dataset
        On the dimension ``tip`` its ``height_um`` and ``half_angle_deg``; ``knee_K`` and
        ``knee_V``; how far the tip has ``moved_K`` and ``moved_V`` the knee; ``at_power_K``, the
        largest change of the tip temperature at the same power. Of these three the parts
        ``surface_moved_K``, ``surface_moved_V`` and ``surface_at_power_K`` that the tip's surface
        has in air: against a tip that conducts only, zero in vacuum. ``fitted_knee_K`` of a tipless
        lever fitted to the one with the tip, and ``missed_K``, how far the knee lies above it. The
        knee without a tip as the attributes ``without_K`` and ``without_V``.

    Raises
    ------
    ComputationError
        If one of the levers has no knee.
    """
    bare = Lever(probe).branch()
    without = bare.need_knee()
    rows = []
    for height, angle in sizes:
        tip = Tip(height_um=height, half_angle_deg=angle, in_air=True)
        lever = Lever(probe.model_copy(update={"tip": tip}))
        data = Measurement.of_sweep(lever.sweep(paper.RAMP))
        hottest, branch = float(data.tip_K.max()), lever.branch()
        conducting = branch
        if lever.medium == "air":
            conducts = tip.model_copy(update={"in_air": False})
            conducting = Lever(probe.model_copy(update={"tip": conducts})).branch()
        fitted_K = knee_K(fit(data, probe).probe)
        knee, by_conduction = branch.need_knee(), conducting.need_knee()
        rows.append(
            {
                "height_um": height,
                "half_angle_deg": angle,
                "knee_K": knee.tip_K,
                "knee_V": knee.lever_V,
                "moved_K": knee.tip_K - without.tip_K,
                "moved_V": knee.lever_V - without.lever_V,
                "at_power_K": _at_same_power(bare, branch, hottest),
                "surface_moved_K": knee.tip_K - by_conduction.tip_K,
                "surface_moved_V": knee.lever_V - by_conduction.lever_V,
                "surface_at_power_K": _at_same_power(conducting, branch, hottest),
                "fitted_knee_K": fitted_K,
                "missed_K": knee.tip_K - fitted_K,
            }
        )
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return labelled(columns, "tip", without_K=without.tip_K, without_V=without.lever_V)


def _at_same_power(without: Branch, with_tip: Branch, hottest_K: float) -> float:
    """Largest change of the tip temperature at the same power (K), with its sign."""
    if with_tip is without:
        return 0.0  # not what curves are off by
    tip = np.linspace(without.base_temperature_K, hottest_K, 200)
    change = tip - without.tip_temperature(with_tip.power(tip))
    return float(change[np.nanargmax(np.abs(change))])


# --- what remains of the 50 K ---------------------------------------------------------------------


def read_by_the_line(tip_K: ArrayLike) -> Array:
    """Return what the published line reads (K) where silicon's phonons soften anharmonically.

    The paper calibrated the line up to 900 K; the anharmonic law has Balkanski's constants.
    """
    law = published_raman_calibration()
    shift, _ = law.anharmonic.shift(np.asarray(tip_K, dtype=float), law.room_temperature_K)
    return np.asarray(law.linear.temperature(shift, law.room_temperature_K))


def measured_carriers(T: ArrayLike) -> Array:
    """Return n_i (cm⁻³): K. Misiakos and D. Tsamakis, J. Appl. Phys. 74, 3293 (1993)."""
    temperature = np.asarray(T, dtype=float)
    return np.asarray(5.29e19 * (temperature / 300.0) ** 2.54 * np.exp(-6726.0 / temperature))


def _departure(law: str, ratio: Callable[[Array], Array]) -> dict[str, float]:
    """Return by which coefficients of its departure a law is so many times as large."""
    factor = FACTORS[law]
    T = np.linspace(factor.low_K, factor.high_K, 100)
    coefficients = np.linalg.lstsq(factor.modes(T).T, np.log(ratio(T)), rcond=None)[0]
    return dict(zip(factor.names, coefficients.tolist(), strict=True))


def scattered_at_surfaces(T: ArrayLike, c_kappa: float) -> Array:
    """Return κ over c_κ κ_Si where surfaces add a resistivity that does not depend on T.

    It is what c_κ adds at 300 K: M. Asheghi et al., J. Appl. Phys. 91, 5079 (2002).
    """
    bulk = thermal_conductivity(np.asarray(T, dtype=float))[0]
    added = (1.0 / c_kappa - 1.0) / thermal_conductivity(np.array(300.0))[0]
    return np.asarray(1.0 / (1.0 + added * bulk) / c_kappa)


def suspect_lever(probe: Probe, suspect: str) -> tuple[Probe, bool]:
    """Return a probe with what a suspect has beyond the paper's model, and if a line reads it.

    The coefficient of a law's departure, by its name, is a suspect as well.
    """
    everything = suspect == Suspect.TOGETHER
    has: set[str] = {suspect}
    if everything:
        # the others exclude one of these
        has = {Suspect.RAMAN, Suspect.SURFACES, Suspect.CARRIERS, Suspect.MOBILITY}
        has |= {Suspect.TOWARDS, Suspect.RADIATION, Suspect.CHIP_WARMS}
    # of the usual size of lithography probes
    tip = Tip(height_um=0.7, half_angle_deg=20.0)
    if suspect == Suspect.IN_VACUUM or everything:
        probe = probe.model_copy(update={"tip": tip})
    if suspect == Suspect.IN_AIR or (everything and probe.surroundings.medium == "air"):
        probe = probe.model_copy(update={"tip": tip.with_(in_air=True)})
    c_kappa = float(probe.values(["c_kappa"])[0])
    values: dict[str, dict[str, Any]] = {
        Suspect.FILM: {"c_kappa": "thickness"},
        Suspect.SURFACES: _departure("kappa", lambda T: scattered_at_surfaces(T, c_kappa)),
        Suspect.CARRIERS: _departure(
            "n_i", lambda T: measured_carriers(T) / intrinsic_density(T, 0.0)[0]
        ),
        Suspect.FEW_CARRIERS: {"intrinsic_scale": 0.6},
        Suspect.CHIP_WARMS: {"chip_K_per_mW": 2.0},
        **({} if departure_of(suspect) is None else {suspect: {suspect: 1.0}}),
    }
    for name in has & values.keys():
        probe = probe.with_(**values[name])
    if Suspect.MOBILITY in has:
        probe = probe.with_material("material", MinimosMaterial)
    effects = ["thermoelectric"] if has & {Suspect.TOWARDS, Suspect.AWAY} else []
    effects += ["radiation"] if Suspect.RADIATION in has else []
    return probe.with_physics(effects), Suspect.RAMAN in has


class Carried(NamedTuple):
    """How far the knee of a suspect's lever is read above predictions (K).

    Attributes
    ----------
    moved_K : float
        That of the model with the lever's own parameters.
    shift_K : float
        That of the model fitted to it.
    ramp_K : float
        The latter where both knees are read off the paper's ramp, at its highest V_l.
    fitted : Probe
        That model.
    """

    moved_K: float
    shift_K: float
    ramp_K: float
    fitted: Probe


def carried_by(probe: Probe, suspect: str, own_K: float | None = None) -> Carried:
    """Return what a suspect carries; the knee of the probe may be given where it is known.

    Raises
    ------
    ComputationError
        If one of the levers has no knee.
    """
    true, by_line = suspect_lever(probe, suspect)
    lever, away = Lever(true), suspect == Suspect.AWAY
    data = Measurement.of_sweep(ramp_of(lever, -1 if away else 1))
    branch = lever.branch_to(0.0, lowest=-paper.RAMP[-1]).mirrored if away else lever.branch()
    apparent_K = branch.need_knee(f"the lever ({suspect})").tip_K
    if by_line:
        data = replace(data, tip_K=read_by_the_line(data.tip_K))
        apparent_K = float(read_by_the_line(apparent_K))
    # what describes the data badly is asked for all the same, and nobody asks why
    fitted = solve(Problem.of(data, probe, FitOptions())).probe
    model = Lever(fitted)
    ramp_K = read_off_the_ramp(data) - read_off_the_ramp(Measurement.of_sweep(ramp_of(model, 1)))
    own_K = knee_K(probe) if own_K is None else own_K
    fitted_K = model.branch().need_knee("the fitted lever").tip_K
    return Carried(apparent_K - own_K, apparent_K - fitted_K, ramp_K, fitted)


def steps_at_the_knee(lever: Lever) -> dict[str, float]:
    """Return how the paper's ramp shows a knee: its row of the highest V_l, and those beside it.

    Returns
    -------
    dict of str to float
        ``row_K``, the tip temperature of that row; ``up_K``, how much hotter the next one is; and
        ``up_current``, by what share the current of either must be off for the next one to have
        the highest V_l; ``down_K`` and ``down_current`` of the one before.
    """
    ramp = lever.sweep(paper.RAMP)
    tip, lever_V, current = (ramp[name].values for name in ("tip_K", "lever_V", "current_mA"))
    # from rows beyond the knee V_l may rise again; its own row is no further away
    knee = lever.branch().knee
    hottest = np.inf if knee is None else knee.tip_K + 150.0
    row = int(np.argmax(np.where(tip < hottest, lever_V, 0.0)))
    steps = {"row_K": float(tip[row])}
    for name, other in (("up", min(row + 1, tip.size - 1)), ("down", max(row - 1, 0))):
        off_mA = (lever_V[row] - lever_V[other]) / lever.circuit.series_kohm
        steps[f"{name}_K"] = float(tip[other] - tip[row])
        steps[f"{name}_current"] = float(off_mA / current[other])
    return steps


def read_off_the_ramp(data: Measurement) -> float:
    """Return the tip temperature (K) of the row with the highest V_l."""
    assert data.current_mA is not None
    kohm = (data.series_resistance_ohm or 0.0) / 1000.0
    return float(data.tip_K[np.argmax(data.bias_V - kohm * data.current_mA)])


def ramp_of(lever: Lever, polarity: int) -> xr.Dataset:
    """Return the paper's ramp of a lever as an instrument shows it that is wired either way round.

    With −1 the current flows the other way, and all that is shown is positive.
    """
    sweep = lever.sweep([polarity * bias for bias in paper.RAMP])
    for name in ("bias_V", "lever_V", "current_mA", "reader_V"):
        sweep[name] = polarity * sweep[name]
    return sweep


def described_without(probe: Probe) -> xr.Dataset:
    """Fit a model without thermoelectricity to a lever that has it, without noise.

    Parameters
    ----------
    probe : Probe
        Whether it has thermoelectricity does not matter.

    Returns
    -------
    xarray.Dataset
        On the dimension ``polarity``: root mean squares of what the fit leaves,
        ``rms_current_mA``, ``rms_reader_V`` and ``rms_tip_K``; and ``off_K``, the largest
        difference of a tip temperature from the fitted one.
    """
    lever, plain = Lever(probe.with_physics(("thermoelectric",))), probe.with_physics(())
    polarities, rows = (1, -1), []
    for polarity in polarities:
        sweep = ramp_of(lever, polarity)
        result = fit(Measurement.of_sweep(sweep), plain)
        off = abs(result.band.tip_K.values - sweep.tip_K.values)
        rms = {f"rms_{name}": value for name, value in result.residual_rms.items()}
        rows.append({**rms, "off_K": float(off.max())})
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return labelled(columns, "polarity", {"polarity": list(polarities)})


def by_covariance(result: Estimate) -> float:
    """Return the standard error (K) of the knee that a fit predicts, by its covariance."""
    errors = {name: result.parameters[name].stderr or 0.0 for name in result.names}

    def knee(**changes: float) -> float:
        branch = Lever(result.probe.with_(**changes), COARSE).branch()
        return float("nan") if branch.knee is None else branch.knee.tip_K

    # by half a standard error to either side
    slopes = []
    for name, error in errors.items():
        value = result.parameters[name].value
        ends = [knee(**{name: value + way * error}) for way in (0.5, -0.5)]
        slopes.append(ends[0] - ends[1])
    return float(np.sqrt(np.array(slopes) @ result.correlation @ slopes))


def compare_suspects(
    probe: Probe,
    example: Estimate,
    suspects: Sequence[str] = tuple(Suspect),
    progress: Progress | None = None,
) -> xr.Dataset:
    """Compute what each suspect carries of the knee's discrepancy, in one medium.

    Parameters
    ----------
    probe : Probe
        In vacuum or in air.
    example : Estimate
        Of a measurement with noise as the paper's, for the covariance.
    suspects : sequence of str
        Of `Suspect`.
    progress : callable, optional
        Called with the suspects done and their number.

    Returns
    -------
    xarray.Dataset
        ``moved_K`` and ``shift_K`` on the dimension ``suspect``, see `carried_by`; NaN where one
        does not count in the medium. As attributes the published ``discrepancy_K``; what is
        ``left_K`` after the last suspect, all together; and ``stderr_K``, the error of the knee
        that a fit predicts, by its covariance.

    Raises
    ------
    ComputationError
        If a lever has no knee, or a fit does not come to an end.
    """
    shifts, own_K = [], knee_K(probe)
    for suspect in each(suspects, progress):
        counts = suspect != Suspect.IN_AIR or probe.surroundings.medium == "air"
        shifts.append(carried_by(probe, suspect, own_K)[:2] if counts else (np.nan, np.nan))
    own, fitted = np.transpose(shifts)
    return labelled(
        {
            "moved_K": ("suspect", own, {"units": "K", "long_name": "above the model's knee"}),
            "shift_K": ("suspect", fitted, {"units": "K", "long_name": "above the fit's knee"}),
        },
        "suspect",
        {"suspect": list(suspects)},
        medium=probe.surroundings.medium,
        discrepancy_K=paper.KNEE_OFF_K,
        left_K=paper.KNEE_OFF_K - float(fitted[-1]),
        stderr_K=by_covariance(example),
    )


# --- what is stored of it -------------------------------------------------------------------------


@cache
def carried() -> xr.Dataset:
    """Return what is stored.

    Returns
    -------
    xarray.Dataset
        On ``layout`` and ``suspect``: ``moved_K``, ``shift_K`` and ``ramp_K``, see
        `Carried`; and each fitted parameter, by its name. On ``layout``
        and ``law``: ``stderr_K``, what a law may carry where the model is fitted; NaN where that
        was not computed.
    """
    table = stored_table("knee.csv", "layout", "suspect")
    layouts, suspects = (list(table.index.unique(level)) for level in ("layout", "suspect"))
    coefficients = {name for law in DEPARTURES.values() for name in law.names}
    suspects = [name for name in suspects if name not in coefficients]

    def column(key: str, names: list[str]) -> Array:
        values = table[key].unstack("suspect").reindex(index=layouts, columns=names)
        return values.to_numpy(dtype=float)

    by_law = [
        np.linalg.norm(column("shift_K", list(law.names)), axis=1) for law in DEPARTURES.values()
    ]
    both = ("layout", "suspect")
    columns = {
        key: (both, column(key, suspects)) for key in ("moved_K", "shift_K", "ramp_K", *PARAMETERS)
    }
    columns["stderr_K"] = (("layout", "law"), np.transpose(by_law))
    coordinates = {"layout": layouts, "suspect": suspects, "law": list(DEPARTURES)}
    return labelled(columns, both, coordinates)


# --- which measurement would decide ---------------------------------------------------------------


def what_to_measure(probe: Probe, seed: int = 0) -> xr.Dataset:
    """Ask what to measure next for the knee of a lever that was measured as the paper's was.

    The 2 % within which the paper describes currents are taken as two standard deviations of
    currents and reader voltages; temperatures have the error of the paper's thermometer.

    Parameters
    ----------
    probe : Probe
    seed : int
        Of the noise.

    Returns
    -------
    xarray.Dataset
        On ``added``, what is measured next (nothing, a spectrum, a finer sweep, a dimension), and
        ``data``, what is calibrated (the ramp without its temperatures, with them): ``stderr_K``,
        the standard error of the knee then, and ``what`` is proposed, in words.

    Raises
    ------
    InputError
        If a calibration does not describe the ramp.
    ComputationError
        If the lever cannot be solved.
    """
    ramp, rng = Lever(probe).sweep(paper.RAMP), np.random.default_rng(seed)
    error_K = raman_error(ramp.tip_K.values - probe.circuit.base_temperature_K)

    def noisy(values: Array, errors: Array) -> Array:
        return values + errors * rng.standard_normal(values.size)

    current, reader = (
        noisy(ramp[name].values, 0.5 * paper.CURRENT_ERROR * ramp[name].values)
        for name in ("current_mA", "reader_V")
    )
    tip_K = noisy(ramp.tip_K.values, error_K)
    everything = Measurement(ramp.bias_V.values, current, reader, tip_K, error_K)
    nothing = np.full(len(paper.RAMP), np.nan)
    data = {
        "ramp without temperatures": replace(everything, tip_K=nothing, tip_error_K=nothing),
        "ramp with temperatures": everything,
    }
    choices: dict[str, dict[str, Any]] = {
        "a spectrum": {"allowed": {"spectra": 1}, "count": 1},
        "eight more biases, currents to 0.1 %": {
            "allowed": {"bias": 8},
            "count": 8,
            "noise": {"current": 1e-3},
        },
        "a dimension, to 1 %": {"allowed": {"dimensions": 1}, "count": 1},
    }
    stderr_K, what = [], []
    for measurement in data.values():
        estimate = calibrate(measurement, probe=probe)
        plans = [plan_next(estimate, quantity="knee", **choice) for choice in choices.values()]
        spectrum, *_, dimension = (plan.proposals.isel(proposal=0) for plan in plans)
        now = spectrum.stderr_now_K.item()
        stderr_K.append([now, *(plan.proposals.stderr_then_K.values[-1] for plan in plans)])
        name = parameter_named(dimension.what.item()).symbol
        what.append(["", f"at {spectrum.tip_K.item():.0f} K", "", name])
    both = ("added", "data")
    columns = {"stderr_K": (both, np.transpose(stderr_K)), "what": (both, np.transpose(what))}
    return labelled(columns, both, {"added": ["nothing", *choices], "data": list(data)})
