"""A probe made ready to solve, and what a sweep over the bias gives."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from hotlever import __version__
from hotlever.air.operator import AirOperator, air_operator
from hotlever.errors import ComputationError, InputError
from hotlever.files import read_text, whole_file, write_text
from hotlever.lever.continuation import AT_BIAS, BranchFollower, ContinuationOptions
from hotlever.lever.equations import LAWS, OBSERVABLES, LeverEquations
from hotlever.lever.newton import NewtonOptions, newton
from hotlever.lever.space import LeverSpace
from hotlever.lever.state_store import StateStore
from hotlever.materials import PARAMETERS, Material
from hotlever.probe import MeshOptions, Probe, mesh_layout
from hotlever.probe.probe import SECTIONS
from hotlever.threads import one_blas_thread

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

#: Columns of a sweep file: name, unit, what it is.
SWEEP_COLUMNS: dict[str, tuple[str, str]] = {
    "bias_V": ("V", "bias"),
    "current_mA": ("mA", "heater current"),
    "lever_V": ("V", "lever voltage"),
    "reader_V": ("V", "reader voltage"),
    "tip_K": ("K", "tip temperature"),
    "power_mW": ("mW", "power dissipated in the lever"),
    "heater_ohm": ("ohm", "heater resistance"),
    "legs_ohm": ("ohm", "resistance of both legs"),
}
#: Further variables of a sweep.
_MORE: dict[str, tuple[str, str]] = {
    "leg1_ohm": ("ohm", "resistance of the leg at the supply"),
    "leg2_ohm": ("ohm", "resistance of the leg to ground"),
    "lever_ohm": ("ohm", "resistance of the lever"),
    "max_K": ("K", "highest temperature in the lever"),
    "ground_current_mA": ("mA", "current leaving to ground"),
    "end_heat_mW": ("mW", "heat leaving by the leg ends"),
    "air_heat_mW": ("mW", "heat leaving into the air"),
}
#: Error left after polishing: 10 µK, 0.1 µV.
_POLISHED = NewtonOptions(tolerance=1e-5, keep_while=0.4)
#: Unit of each observable in a sweep, by its name.
OBSERVABLE_COLUMNS = {"current": "current_mA", "reader": "reader_V", "tip": "tip_K"}


@dataclass(frozen=True)
class LeverState:
    """A solved state of a lever.

    Attributes
    ----------
    bias : float
        V.
    x : ndarray
        Unknowns, see `LeverSpace`.
    """

    bias: float
    x: Array


@dataclass(frozen=True)
class Ramp:
    """What a slow ramp of the bias passes.

    Attributes
    ----------
    states : list of LeverState
        In the order of rising bias.
    notes : list of str
        A sentence on each jump to another branch.
    """

    states: list[LeverState]
    notes: list[str]


class Lever:
    """A probe with its mesh, ready to be solved for any material and circuit.

    Parameters
    ----------
    probe : Probe
    mesh : MeshOptions, optional
    space : LeverSpace, optional
        Share the mesh and operators of another lever of the same shape, and its air if both are
        in air: the surroundings must be the same then.
    progress : callable, optional
        Called while the air operator of a new geometry is made, with steps done and their number.

    Examples
    --------
    >>> lever = Lever(Probe.reference())
    >>> sweep = lever.sweep([7.22])
    >>> round(sweep.current_mA.item(), 3), round(sweep.tip_K.item())
    (0.949, 547)
    """

    def __init__(
        self,
        probe: Probe,
        mesh: MeshOptions | None = None,
        space: LeverSpace | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.probe = probe
        space = space or LeverSpace(mesh_layout(probe.layout(), mesh))
        if (space.air is None) != (self.medium == "vacuum"):
            space = space.in_air(_air(probe, progress))
        self.space: LeverSpace = space
        self.equations = LeverEquations(self.space, probe.circuit, probe.material)

    @property
    def medium(self) -> str:
        """What is around the lever: vacuum or air."""
        return self.probe.surroundings.medium

    def in_medium(self, medium: str) -> Lever:
        """Return the same lever in vacuum or in air; mesh and operators are shared."""
        return Lever(self.probe.in_medium(medium), space=self.space)

    def with_material(self, material: Material) -> Lever:
        """Return the same lever of another material; the mesh is shared."""
        changed = self.probe.model_copy(update={"material": material})
        return Lever(changed, space=self.space)

    def follower(self, options: ContinuationOptions | None = None) -> BranchFollower:
        """Return a follower of the lever's solutions, at zero bias."""
        return BranchFollower(self.equations, options)

    @one_blas_thread
    def solve(
        self,
        bias: ArrayLike,
        progress: Progress | None = None,
        store: StateStore | None = None,
    ) -> Ramp:
        """Find the states that a slow ramp of the bias from zero passes.

        Parameters
        ----------
        bias : array_like, shape (n,)
            Biases (V) in any order, not negative; repeated ones are solved once.
        progress : callable, optional
            Called with the states done and their number.
        store : StateStore, optional
            States found there are taken as they are; others are added as they are solved.

        Returns
        -------
        Ramp
            States in the order of rising bias.

        Raises
        ------
        InputError
            If a bias is negative or not finite.
        BranchEndError, ComputationError
            If not every bias is reached; ``partial`` holds the ramp up to there.
        """
        values = np.unique(checked_bias(bias))
        ramp = Ramp([], [])
        follower = self.follower()
        try:
            for value in values.tolist():
                found = None if store is None else store.load(value)
                if found is not None:
                    state, notes = found
                    follower.resume(state)
                else:
                    state = follower.advance_to(value)
                    notes = [
                        f"at a bias of {fold.bias:.4f} V the lever jumps from a tip at "
                        f"{fold.tip:.0f} K to a hotter branch; the next state given is at "
                        f"{state.bias:.4f} V, {state.tip:.0f} K"
                        for fold in follower.folds
                    ]
                    follower.folds.clear()
                    if store is not None:
                        store.save(state, notes)
                ramp.notes.extend(notes)
                ramp.states.append(LeverState(state.bias, state.x))
                if progress is not None:
                    progress(len(ramp.states), len(values))
        except ComputationError as error:
            error.partial = ramp
            raise
        return ramp

    @one_blas_thread
    def polish(self, guesses: Iterable[Array]) -> Ramp:
        """Solve at the biases of some nearby states, each from its own guess.

        Parameters
        ----------
        guesses : iterable of ndarray
            Full states in the order of bias, such as a reduced lever's expanded ones. They are
            so near that one state's factorised Jacobian often serves the next.

        Raises
        ------
        NewtonError
            If one is too far from a solution.
        """
        states = []
        jacobian = None
        for guess in guesses:
            bias = float(guess[-1])
            equations = self.equations.pinned(AT_BIAS, bias)
            found = newton(equations, guess, _POLISHED, jacobian)
            jacobian = found.jacobian
            states.append(LeverState(bias, found.x))
        return Ramp(states, [])

    @one_blas_thread
    def knee(self) -> xr.Dataset:
        """Find the knee of the I-V curve, dV_l/dI_h = 0, and return that one state.

        Without a series resistor the knee is the fold at which a bias ramp leaves the branch;
        the state does not depend on the resistor, only its bias does.

        Raises
        ------
        ComputationError
            If V_l keeps rising until the silicon melts.
        """
        bare = self.probe.with_values({"series_resistance_ohm": 0.0})
        follower = Lever(bare, space=self.space).follower()
        for _ in follower.follow_arc(lambda _: not follower.folds):
            pass
        fold = follower.folds[0]
        x = fold.x.copy()
        current = self.equations.observe(x)["current_mA"]
        x[-1] = x[-2] + self.probe.circuit.series_resistance_ohm / 1000.0 * current
        return self.dataset(Ramp([LeverState(float(x[-1]), x)], []))

    def sweep(
        self,
        bias: ArrayLike,
        *,
        sensitivities: bool = False,
        progress: Progress | None = None,
    ) -> xr.Dataset:
        """Solve the lever over a range of bias.

        Parameters
        ----------
        bias : array_like, shape (n,)
            Biases (V) in any order, not negative; a slow ramp from zero meets them rising.
        sensitivities : bool
            Add the derivatives of I_h, V_r and T_tip by the six fit parameters.
        progress : callable, optional
            Called with the states done and their number.

        Returns
        -------
        xarray.Dataset
            See `dataset`; in the order of `bias`.

        Raises
        ------
        InputError
            If a bias is negative or not finite.
        BranchEndError, ComputationError
            If not every bias is reached; ``partial`` holds the dataset up to there.
        """
        try:
            ramp = self.solve(bias, progress)
        except ComputationError as error:
            error.partial = self.dataset(error.partial, sensitivities=sensitivities)
            raise
        asked = np.atleast_1d(np.asarray(bias, dtype=float))
        rows = np.searchsorted([state.bias for state in ramp.states], asked)
        return self.dataset(ramp, sensitivities=sensitivities).isel(bias=rows)

    @one_blas_thread
    def dataset(self, ramp: Ramp, *, sensitivities: bool = False) -> xr.Dataset:
        """Return what is measured in some states.

        Parameters
        ----------
        ramp : Ramp
        sensitivities : bool
            Add ``sensitivity``, dimensions (observable, bias, parameter): mA, V or K per unit
            of the parameter, at fixed bias.

        Returns
        -------
        xarray.Dataset
            One variable for each of `SWEEP_COLUMNS` and a few more, on the dimension
            ``bias``; units and long names as attributes; the probe, material, circuit and
            version as attributes of the dataset.
        """
        states = ramp.states
        rows = [self.equations.observe(state.x) for state in states]
        columns = {
            name: np.array([row[name] for row in rows]) for name in (rows[0] if rows else ())
        }
        columns["bias_V"] = np.array([state.bias for state in states])
        if rows:
            columns["legs_ohm"] = columns["leg1_ohm"] + columns["leg2_ohm"]
            columns["lever_ohm"] = columns["legs_ohm"] + columns["heater_ohm"]
        described = {**SWEEP_COLUMNS, **_MORE}
        data = xr.Dataset(
            {
                name: ("bias", columns.get(name, np.empty(0)), {"units": unit, "long_name": text})
                for name, (unit, text) in described.items()
            }
        ).set_coords("bias_V")
        if sensitivities:
            table = np.array([self.equations.sensitivities(state.x) for state in states]).reshape(
                -1, len(OBSERVABLES), len(PARAMETERS)
            )
            data["sensitivity"] = (("observable", "bias", "parameter"), np.swapaxes(table, 0, 1))
            data["sensitivity"].attrs["long_name"] = "derivative by a fit parameter, at fixed bias"
            data = data.assign_coords(observable=list(OBSERVABLES), parameter=list(PARAMETERS))
        values = self.probe.values()
        data.attrs = {
            **{name: json.dumps(section) for name, section in values.items()},
            "medium": self.medium,
            "notes": "\n".join([*ramp.notes, *self._range_notes(data)]),
            "software": f"hotlever {__version__}",
        }
        return data

    def _range_notes(self, data: xr.Dataset) -> list[str]:
        """Say where the laws are used beyond the temperatures they are meant for."""
        limit = min(law.temperature_range[1] for law in LAWS)
        beyond = data.bias_V.values[data.max_K.values > limit]
        if not beyond.size:
            return []
        return [
            f"from a bias of {beyond.min():.4g} V part of the lever is above {limit:.0f} K, "
            "where the material laws are extrapolated"
        ]


def _air(probe: Probe, progress: Progress | None) -> AirOperator | None:
    if probe.surroundings.medium == "vacuum":
        return None
    base = probe.circuit.base_temperature_K
    return air_operator(probe.layout(), probe.surroundings, base, progress=progress)


def checked_bias(bias: ArrayLike) -> Array:
    """Return biases as an array.

    Raises
    ------
    InputError
        If one is negative or not finite.
    """
    values = np.atleast_1d(np.asarray(bias, dtype=float))
    wrong = values[~(values >= 0) | ~np.isfinite(values)]
    if wrong.size:
        raise InputError(f"found a bias of {wrong[0]:g} V, expected finite biases of 0 or more")
    return values


def sweep(
    probe: Probe,
    bias: ArrayLike,
    *,
    sensitivities: bool = False,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Mesh and solve a probe over a range of bias; see `Lever.sweep`.

    Examples
    --------
    >>> data = sweep(Probe.reference(), [1.0, 7.22])
    >>> data.tip_K.round(0).values.tolist()
    [295.0, 547.0]
    """
    return Lever(probe).sweep(bias, sensitivities=sensitivities, progress=progress)


def write_sweep(data: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a sweep as ``.csv`` (the columns of `SWEEP_COLUMNS`) or ``.nc`` (everything).

    Raises
    ------
    InputError
        If the suffix is neither, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".csv":
        write_text(path, sweep_csv(data))
    elif suffix == ".nc":
        with whole_file(path) as temporary:
            data.to_netcdf(temporary, engine="netcdf4")
    else:
        raise InputError(f"{path}: unknown file type '{suffix}', expected .csv or .nc")


def sweep_csv(data: xr.Dataset) -> str:
    """Return a sweep as CSV text, one row per bias; empty where a value does not exist."""
    columns = [data[name].values for name in SWEEP_COLUMNS]
    rows = (
        ",".join("" if np.isnan(value) else f"{value:.10g}" for value in row)
        for row in zip(*columns, strict=True)
    )
    return "\n".join([",".join(SWEEP_COLUMNS), *rows]) + "\n"


def read_sweep(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a sweep written by `write_sweep` as NetCDF.

    Raises
    ------
    InputError
        If the file is not a sweep.
    """
    if not Path(path).is_file():
        read_text(path)  # says why
    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            loaded = data.load()
    except OSError as error:
        raise InputError(f"{path}: not a NetCDF file") from error
    missing = [name for name in SWEEP_COLUMNS if name not in loaded.variables]
    if missing:
        raise InputError(f"{path}: not a sweep: variable '{missing[0]}' is missing")
    return loaded.set_coords("bias_V")


def probe_of(data: xr.Dataset) -> Probe:
    """Return the probe that a sweep was made of."""
    sections = {name: json.loads(data.attrs[name]) for name in SECTIONS if name in data.attrs}
    return Probe.from_values(sections, "sweep")
