"""Sparse matrices of one pattern are factorised here, and nowhere else.

SuperLU, which comes with SciPy, is there always. KLU (T. A. Davis and E. Palamadai Natarajan, ACM
Trans. Math. Softw. 37, 36 (2010)) is taken if the extra ``fast`` is installed: it can factorise
a matrix with the pivots of an earlier one of the same pattern, which takes a third of the time. It
is an extra because KLU is under the LGPL.
"""

from __future__ import annotations

import atexit
from abc import ABC, abstractmethod
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Literal
from weakref import WeakSet, finalize

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from hotlever.errors import NewtonError
from hotlever.types import Array, Index, LinearSolver


@dataclass(frozen=True)
class FactorisationOptions:
    """How sparse matrices are factorised.

    Attributes
    ----------
    solver : "superlu", "klu" or None
        KLU where it is installed, SuperLU elsewhere, unless stated.
    pivot_threshold : float
        A diagonal entry is the pivot if it has this share of the largest in its column.
    backward_error : float
        Factors by the pivots of an earlier matrix are taken if they solve a linear system so
        exactly, relative in each row (W. Oettli and W. Prager, Numer. Math. 6, 405 (1964)).
        Otherwise pivots are chosen anew.
    spare : int
        Factors that are no longer in use, and wait for another matrix, at most: those of a curve
        that the next one is solved with. Those of the reference probe have 4 MB each, on a coarse
        mesh 1 MB.
    """

    solver: Literal["superlu", "klu"] | None = None
    pivot_threshold: float = 0.01
    backward_error: float = 1e-12
    spare: int = 32


class Factorisation(ABC):
    """Factorises matrices of one pattern, whose unknowns are ordered for little fill.

    Parameters
    ----------
    rows, starts : ndarray of int
        Of the entries column by column, in rising order in each, and where each column begins.
    options : FactorisationOptions, optional
    """

    def __init__(
        self, rows: Index, starts: Index, options: FactorisationOptions | None = None
    ) -> None:
        self._rows, self._starts = (np.asarray(each, dtype=np.int32) for each in (rows, starts))
        self._options = options or FactorisationOptions()

    @staticmethod
    def of_pattern(
        rows: Index, starts: Index, options: FactorisationOptions | None = None
    ) -> Factorisation:
        """Return that of the solver that is asked for, or the fastest there is."""
        options = options or FactorisationOptions()
        solver = options.solver or ("klu" if find_spec("nbklu") else "superlu")
        return {"superlu": SuperLU, "klu": KLU}[solver](rows, starts, options)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self._starts.size - 1

    def matrix(self, entries: Array) -> csc_matrix:
        """Return the matrix with these entries."""
        return csc_matrix((entries, self._rows, self._starts), shape=(self.size, self.size))

    @abstractmethod
    def factorised(self, entries: Array) -> LinearSolver:
        """Factorise the matrix with these entries.

        Raises
        ------
        NewtonError
            If it is singular.
        """


class SuperLU(Factorisation):
    """By SuperLU, with pivots of its own for each matrix."""

    def factorised(self, entries: Array) -> LinearSolver:
        """See `Factorisation`."""
        try:
            factors = splu(
                self.matrix(entries),
                permc_spec="NATURAL",
                diag_pivot_thresh=self._options.pivot_threshold,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:  # nothing else does SciPy say by it
            raise NewtonError("the Jacobian of a state is singular") from error
        return _SuperLUFactors(factors)


class _SuperLUFactors:
    def __init__(self, factors: Any) -> None:
        self._factors = factors

    def solve(self, right_hand_side: Array, transposed: bool = False) -> Array:
        solution: Array = self._factors.solve(right_hand_side, "T" if transposed else "N")
        return solution


class KLU(Factorisation):
    """By KLU, with the pivots of an earlier matrix where these serve.

    What was analysed and factorised for a matrix that is no longer in use serves the next.
    """

    def __init__(
        self, rows: Index, starts: Index, options: FactorisationOptions | None = None
    ) -> None:
        super().__init__(rows, starts, options)
        # no right-hand side of the equations, so that none is solved well by chance
        self._trial = np.random.default_rng(0).normal(size=self.size)
        self._unused: list[_KLUSolver] = []

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process can use."""
        return vars(self) | {"_unused": []}

    def factorised(self, entries: Array) -> LinearSolver:
        """See `Factorisation`."""
        try:
            solver = self._unused.pop()
        except IndexError:
            solver = _KLUSolver(self._rows, self._starts, self._options.pivot_threshold)
        if not (solver.has_pivots and self._refactorised(solver, entries)):
            solver.factorise(entries)
        return _KLUFactors(solver, self._unused, self._options.spare)

    def _refactorised(self, solver: _KLUSolver, entries: Array) -> bool:
        """Factorise with the pivots that there are; return whether they serve."""
        from nbklu import KLUSingularException

        try:
            solver.klu.refactor(entries)
        except KLUSingularException:
            return False
        matrix, solution = self.matrix(entries), solver.klu.solve(self._trial)
        residual = np.abs(matrix @ solution - self._trial)
        size = abs(matrix) @ np.abs(solution) + np.abs(self._trial)
        # what is not a number does not serve either
        return bool((residual <= self._options.backward_error * size).all())


class _KLUSolver:
    """What KLU knows of a pattern, and of the matrix that was factorised last."""

    def __init__(self, rows: Any, starts: Any, pivot_threshold: float) -> None:
        from nbklu import KLUSolver32Real

        self.klu = KLUSolver32Real(singular_as_error=True)
        common = self.klu.common
        # the matrix is one block, in the order that it comes in
        common.btf, common.tol = 0, pivot_threshold
        self.klu.analyze_given(starts.size - 1, starts, rows)
        _IN_USE.add(self)

    @property
    def has_pivots(self) -> bool:
        """Whether a matrix has been factorised."""
        return self.klu.numeric is not None

    def factorise(self, entries: Array) -> None:
        """Choose pivots and factorise; see `Factorisation.factorised`."""
        from nbklu import KLUSingularException

        try:
            self.klu.factor(entries)
        except KLUSingularException as error:
            # KLU has freed it
            self.klu.numeric = None
            raise NewtonError("the Jacobian of a state is singular") from error

    def free(self) -> None:
        """Give back what nbklu leaves to its callers: what is outside of Python's memory."""
        for part in (self.klu.numeric, self.klu.symbolic):
            if part is not None:
                part.free(self.klu.common)
        del self.klu

    def __del__(self) -> None:
        if hasattr(self, "klu"):
            self.free()


#: What is still there when Python ends; nbklu complains of it on standard error.
_IN_USE: WeakSet[_KLUSolver] = WeakSet()


@atexit.register
def _free_all() -> None:
    for solver in list(_IN_USE):
        solver.free()


class _KLUFactors:
    def __init__(self, solver: _KLUSolver, unused: list[_KLUSolver], spare: int) -> None:
        self._solver = solver
        # A destructor would not do: where these factors go with a cycle of references, Python calls
        # the destructor of the solver too, which then is freed and yet among the unused.
        finalize(self, _give_back, solver, unused, spare).atexit = False

    def solve(self, right_hand_side: Array, transposed: bool = False) -> Array:
        klu = self._solver.klu
        # of several, each stands in a row
        solve = klu.tsolve if transposed else klu.solve
        solution: Array = solve(np.ascontiguousarray(right_hand_side.T)).T
        return solution


def _give_back(solver: _KLUSolver, unused: list[_KLUSolver], spare: int) -> None:
    if len(unused) < spare:
        unused.append(solver)
