"""Small signals of a lever that a controller holds at a resistance: its poles, and stable gains.

With Z = dV_l/dI_h the impedance at a state (`hotlever.lever.transient.frequency_domain`), the
resistance R = V_l/I_h answers a change of the bias by::

    G(s) = dR/dV_b = (Z − R)/((Z + R_s) I_h)

Its values at frequencies are taken together in a sum of poles by rational approximation (AAA; Y.
Nakatsukasa, O. Sète, L. N. Trefethen, SIAM J. Sci. Comput. 40, A1494 (2018)). With these the closed
loop is a small system for any gains, and its poles are the eigenvalues.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import AAA

from hotlever.datasets import labelled
from hotlever.errors import ComputationError
from hotlever.lever.lever import State
from hotlever.lever.transient.frequency_domain import Complex, spectrum

if TYPE_CHECKING:
    import xarray as xr

#: Frequencies (Hz) at which the resistance is answered, and how near (relative) the sum is to it.
_FREQUENCIES, _ACCURATE = np.geomspace(1.0, 1e8, 161), 1e-6
#: The fastest of these, as a rate (1/µs): of faster oscillations nothing is known.
FASTEST = 2e-6 * np.pi * float(_FREQUENCIES[-1])
#: Poles with a smaller share in the answer to a step are not told.
_SEEN = 0.01
#: Gains of a map: P over that which would halve a lasting error, I over that with which it would do
#: so as slowly as the slowest pole; and how many of each.
_P, _I, _GAINS = (0.03, 1e3), (0.1, 3e4), 81
#: The share of a step within which an answer has settled; times that are looked at, and the last of
#: these over that of the slowest pole.
_SETTLED, _TIMES, _LONG = 0.02, 240, 30.0
#: An overshoot, as a share of a step, that is little.
_LITTLE = 0.1


@dataclass(frozen=True)
class ClosedLoop:
    """A lever at a state, with a controller of its resistance.

    Attributes
    ----------
    state : State
    poles, residues : ndarray, shape (k,)
        Of dR/dV_b: 1/µs, and kΩ/(V µs).
    direct : float
        What of dR/dV_b is there at once (kΩ/V): other supplies and thermovoltages make V_l/I_h
        change with the bias alone.
    gain : float
        dR/dV_b at rest (kΩ/V).
    """

    state: State
    poles: Complex
    residues: Complex
    direct: float
    gain: float

    @classmethod
    def at(cls, state: State) -> ClosedLoop:
        """Return that of a state with some current.

        Raises
        ------
        InputError, ComputationError
            If there is no current, or the resistance answers as no sum of poles does.

        Examples
        --------
        >>> from hotlever import Lever, Probe
        >>> from hotlever.lever.set_points import hold
        >>> colder, hotter = hold(Lever(Probe.reference()), "resistance", [3000.0]).states
        >>> for state in (colder, hotter):
        ...     poles, _ = ClosedLoop.at(state).closed(proportional=1.0, integral=30.0)
        ...     print(bool(poles.real.max() < 0.0))
        True
        False
        """
        answer = spectrum(state, _FREQUENCIES)
        impedance = (answer.impedance_real_ohm + 1j * answer.impedance_imag_ohm).values / 1000.0
        current, resistance = state.current_mA, state.lever_V / state.current_mA
        series = state.lever.circuit.series_kohm
        by_bias = (impedance - resistance) / ((impedance + series) * current)
        turns = 2e-6j * np.pi * _FREQUENCIES
        both = [np.concatenate([each, each.conj()]) for each in (turns, by_bias)]
        sum_of_poles = AAA(*both, rtol=_ACCURATE)
        if sum_of_poles.errors[-1] > 10.0 * _ACCURATE * np.abs(by_bias).max():
            raise ComputationError("no sum of poles is near what the resistance answers to a bias")
        weights, values = sum_of_poles.weights, sum_of_poles.support_values
        direct = float((weights @ values / weights.sum()).real)
        poles, residues = sum_of_poles.poles(), sum_of_poles.residues()
        return cls(state, poles, residues, direct, float(by_bias[0].real))

    def closed(
        self, proportional: ArrayLike, integral: ArrayLike, filter_us: float = 1.0
    ) -> tuple[Complex, Complex]:
        """Return the poles (1/µs) with a controller, the slowest or those that grow first.

        Parameters
        ----------
        proportional, integral : array_like, shape (...)
            P (V/kΩ) and I (V/(kΩ ms)), see `hotlever.lever.transient.controller`.
        filter_us : float
            Time constant of the measured resistance (µs).

        Returns
        -------
        poles, shares : ndarray, shape (..., k + 2)
            After a small step of its set point, R is off by Σ shares exp(poles t) of the step.
        """
        P, per_ms = np.broadcast_arrays(
            np.asarray(proportional, dtype=float), np.asarray(integral, dtype=float)
        )
        count, per_us = self.poles.size, per_ms / 1000.0
        # the poles of the lever, the measured resistance, and the integral
        seen = np.zeros((*P.shape, 1, count + 2), dtype=complex)
        seen[..., 0, :count] = self.residues
        seen[..., 0, count], seen[..., 0, count + 1] = -self.direct * P, self.direct
        system = np.zeros((*P.shape, count + 2, count + 2), dtype=complex)
        each, set_point = np.arange(count), np.zeros((*P.shape, count + 2, 1))
        system[..., each, each] = self.poles
        system[..., :count, count], system[..., :count, count + 1] = -P[..., None], 1.0
        system[..., count, :] = seen[..., 0, :] / filter_us
        system[..., count, count] -= 1.0 / filter_us
        system[..., count + 1, count] = -per_us
        set_point[..., :count, 0], set_point[..., count + 1, 0] = P[..., None], per_us
        set_point[..., count, 0] = self.direct * P / filter_us
        poles, modes = np.linalg.eig(system)
        excited = np.linalg.solve(modes, set_point)[..., 0]
        shares = (seen @ modes)[..., 0, :] * excited / poles
        order = np.argsort(-poles.real, axis=-1)
        return np.take_along_axis(poles, order, -1), np.take_along_axis(shares, order, -1)

    def gain_map(self, sign: float, filter_us: float = 1.0) -> xr.Dataset:
        """Return how R answers a small step of its set point, over gains of a sign.

        Returns
        -------
        xarray.Dataset
            On ``proportional`` (V/kΩ) and ``integral`` (V/(kΩ ms)): ``growth_per_us`` of the
            slowest pole, negative where the loop is stable; ``settling_us``, after which the answer
            stays within 2 % of the step, and ``overshoot`` as a share of it, NaN where it is not.
        """
        slowest, fastest = (float(f(np.abs(self.poles.real))) for f in (np.min, np.max))
        P = sign / abs(self.gain) * np.geomspace(*_P, _GAINS)
        per_ms = sign / abs(self.gain) * 1000.0 * slowest * np.geomspace(*_I, _GAINS)
        poles, shares = self.closed(P[:, None], per_ms, filter_us)
        times = np.geomspace(1.0 / fastest, _LONG / slowest, _TIMES)
        settled, overshoot = np.full(poles.shape[:-1], times[0]), np.zeros(poles.shape[:-1])
        stable = poles.real.max(axis=-1) < 0.0
        for t, later in pairwise(times.tolist()):
            # what grows is left out
            off = (shares * np.exp(np.minimum(poles.real, 0.0) * t + 1j * poles.imag * t)).sum(-1)
            settled[np.abs(off.real) > _SETTLED] = later
            overshoot = np.maximum(overshoot, off.real)
        names = "proportional", "integral"
        return labelled(
            {
                "growth_per_us": (names, poles.real.max(axis=-1)),
                "settling_us": (names, np.where(stable, settled, np.nan)),
                "overshoot": (names, np.where(stable, overshoot, np.nan)),
            },
            coordinates={"proportional": P, "integral": per_ms},
            filter_us=filter_us,
            set_ohm=1000.0 * self.state.lever_V / self.state.current_mA,
            tip_K=self.state.tip_K,
            lever=self.state.lever.probe.title,
        )

    def stable_gains(self, sign: float, filter_us: float = 1.0) -> tuple[float, float] | None:
        """Return the gains of a sign with which a step settles first, with little overshoot."""
        data = self.gain_map(sign, filter_us)
        settled = data.settling_us.where(data.overshoot < _LITTLE)
        if not settled.notnull().any():
            return None
        best = settled[settled.argmin(...)]
        return best.proportional.item(), best.integral.item()

    def settling(
        self, proportional: float, integral: float, filter_us: float = 1.0
    ) -> tuple[float, float]:
        """Return time constant (µs) and damping ratio with a controller; parameters as `closed`.

        They are those of the slowest pole and of the least damped one that have a share of 1 % in
        the answer; both are negative where a pole grows.
        """
        poles, shares = self.closed(proportional, integral, filter_us)
        seen = poles if poles[0].real >= 0.0 else poles[np.abs(shares) >= _SEEN]
        return float(-1.0 / seen[0].real), float((-seen.real / np.abs(seen)).min())
