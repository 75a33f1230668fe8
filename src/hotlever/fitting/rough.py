"""The reduced lever near a fit's optimum: cheap, because every state starts next to its root."""

from __future__ import annotations

import numpy as np

from hotlever.fitting.models import multiplied, reduced_model, shown_at_bias
from hotlever.lever.curve import spline_through
from hotlever.lever.lever import Lever
from hotlever.lever.reduced import ReducedLever
from hotlever.materials import Material
from hotlever.threads import one_blas_thread
from hotlever.types import Array


class RoughModel:
    """A reduced lever for materials near that of a lever, exact at the latter.

    It stays on the few points of the reduced lever. By what factor voltages and currents differ
    there from those of the lever's own material at the same tip temperature is taken over to the
    full lever's branch. `slopes`, (3, n, 6), are the derivatives of I_h, V_r and T_tip by the
    parameters at the lever's own material.

    Raises
    ------
    ComputationError
        If the lever cannot be solved with its own material.
    """

    def __init__(self, lever: Lever, reduced: ReducedLever, bias: Array) -> None:
        model, probe = reduced_model(lever, reduced, bias), lever.probe
        first = model.predict(probe)
        exact = model.confirmed(first)
        at = exact.predict(probe, first)
        assert exact.offset is not None
        self.slopes = at.slopes
        self._probe, self._bias, self._reduced = probe, bias, reduced
        self._near = at.linearised
        self._branch = exact.offset.added(at.linearised.branch, probe.at(exact.names))
        self._u = self._branch.u[1:]
        few, found = reduced.solved(
            probe.material, self._u, at.linearised.branch.x[:, 1:], at.linearised.factors
        )
        self._shown = few.observed(found.x).T

    @one_blas_thread
    def predict(self, material: Material) -> Array:
        """Return I_h (mA), V_r (V) and T_tip (K) at the biases, shape (3, n).

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of them.
        """
        moved = self._probe.model_copy(update={"material": material})
        guess = self._near.states(moved)[:, 1:]
        few, found = self._reduced.solved(material, self._u, guess, self._near.factors)
        ratio = few.observed(found.x).T / self._shown
        # without power the ratio is that of a barely warm lever
        ratio = np.concatenate([ratio[:1], ratio])
        bend = spline_through(self._branch.u, ratio)(self._branch.u, 1)
        branch = multiplied(self._branch, ratio, bend / ratio)
        return shown_at_bias(branch, self._probe.circuit, self._bias)[1]
