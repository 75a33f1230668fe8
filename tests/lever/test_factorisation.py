"""Sparse linear systems: factorised by either solver, without the unknowns inside elements."""

from __future__ import annotations

import gc
import pickle
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.sparse import csc_matrix, random_array

from hotlever.errors import NewtonError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.factorisation import KLU, Factorisation, FactorisationOptions
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import COARSE
from hotlever.lever.space import LEVER, TIP
from hotlever.probe import Probe, mesh_layout

KLU_INSTALLED = pytest.mark.skipif(not find_spec("nbklu"), reason="the extra fast is not installed")


@pytest.fixture(params=["superlu", pytest.param("klu", marks=KLU_INSTALLED)])
def options(request) -> FactorisationOptions:
    return FactorisationOptions(solver=request.param)


def random_matrix(seed: int, size: int = 80) -> csc_matrix:
    """Return a matrix whose diagonal is not its largest part; they share a pattern."""
    pattern = random_array((size, size), density=0.05, rng=np.random.default_rng(0)) != 0
    matrix = (pattern + pattern.T).astype(float).tocsc()
    matrix.setdiag(1.0)
    matrix.sort_indices()
    matrix.data[:] = np.random.default_rng(seed).normal(size=matrix.nnz)
    return matrix


def factorisation_of(matrix: csc_matrix, options: FactorisationOptions) -> Factorisation:
    return Factorisation.of_pattern(matrix.indices, matrix.indptr, options)


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("shape", [(80,), (80, 3)])
def test_matrices_of_one_pattern_are_solved_side_by_side(options, transposed, shape):
    """Also those that are factorised with what an earlier one left."""
    matrices = [random_matrix(seed) for seed in range(1, 5)]
    factorisation = factorisation_of(matrices[0], options)
    right = np.random.default_rng(9).normal(size=shape)
    factorisation.factorised(matrices[3].data)
    solvers = [factorisation.factorised(matrix.data) for matrix in matrices]
    for matrix, solver in zip(matrices, solvers, strict=True):
        dense = matrix.toarray()
        expected = np.linalg.solve(dense.T if transposed else dense, right)
        found = solver.solve(right, transposed)
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-10 * np.abs(expected).max())


def test_pivots_are_chosen_anew_where_those_of_the_last_matrix_do_not_serve(options):
    matrix = csc_matrix(np.array([[1.0, 2.0, 0.5], [3.0, 4.0, 1.0], [0.5, 1.0, 2.0]]))
    factorisation = factorisation_of(matrix, options)
    factorisation.factorised(matrix.data)
    for pivot in (0.0, 1e-14, np.nan):
        other = matrix.copy()
        # on the pivots of the first this one would lose all digits
        other[0, 0] = other[2, 2] = pivot
        if np.isnan(pivot):
            # Newton's method says what came of it
            try:
                found = factorisation.factorised(other.data).solve(np.ones(3))
            except NewtonError:
                continue
            assert not np.isfinite(found).all()
        else:
            found = factorisation.factorised(other.data).solve(np.ones(3))
            np.testing.assert_allclose(other @ found, 1.0, rtol=1e-12)


def test_a_singular_matrix_is_said_to_be_one(options):
    matrix = csc_matrix(np.ones((3, 3)) + np.eye(3))
    factorisation = factorisation_of(matrix, options)
    for _ in range(2):
        with pytest.raises(NewtonError, match="singular"):
            factorisation.factorised(np.ones(9))
        solver = factorisation.factorised(matrix.data)
        np.testing.assert_allclose(solver.solve(np.full(3, 4.0)), 1.0)


def test_a_factorisation_goes_to_another_process(options):
    matrix = random_matrix(1)
    factorisation = factorisation_of(matrix, options)
    factorisation.factorised(matrix.data)
    other = pickle.loads(pickle.dumps(factorisation))
    np.testing.assert_allclose(other.factorised(matrix.data).solve(matrix @ np.ones(80)), 1.0)


@KLU_INSTALLED
def test_memory_is_given_back():
    psutil = pytest.importorskip("psutil")
    matrix, process = random_matrix(1, 800), psutil.Process()
    used = []
    for _ in range(3):
        for _ in range(4):
            factorisation = KLU(matrix.indices, matrix.indptr)
            factorisation.factorised(matrix.data)
        used.append(process.memory_info().rss)
    # one of these factorisations holds some megabytes
    assert used[2] - used[0] < 8e6


def test_factors_in_a_cycle_of_references_leave_a_solver_that_serves(options):
    matrix = random_matrix(1)
    factorisation = factorisation_of(matrix, options)
    cycle = [factorisation.factorised(matrix.data)]
    cycle.append(cycle)
    del cycle
    gc.collect()
    right = np.ones(factorisation.size)
    solution = factorisation.factorised(matrix.data).solve(right)
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-10)


@KLU_INSTALLED
def test_few_factors_wait_for_another_matrix():
    matrix = random_matrix(1)
    factorisation = KLU(matrix.indices, matrix.indptr, FactorisationOptions(spare=2))
    several = [factorisation.factorised(matrix.data) for _ in range(5)]
    assert len(factorisation._unused) == 0
    several.clear()
    assert len(factorisation._unused) == 2


@pytest.mark.parametrize("constraint", [TIP, LEVER], ids=["tip", "lever voltage"])
@pytest.mark.parametrize("place", ["at a node", "inside a triangle"])
def test_no_unknown_is_missing_from_a_condensed_jacobian(options, constraint, place):
    """Solutions have the right-hand sides of the whole Jacobian, wherever the tip is."""
    probe = Probe.reference()
    mesh = mesh_layout(probe.layout(), COARSE)
    if place == "inside a triangle":
        corners = mesh.elements.p[:, mesh.elements.t[:, 5]]
        layout = replace(mesh.layout, tip=tuple(corners @ [0.5, 0.3, 0.2]))
        mesh = replace(mesh, layout=layout)
    equations = LeverEquations.of_probe(FullSpace(mesh, factorisation=options), probe)
    random = np.random.default_rng(3)
    x = (
        random.uniform(0.1, 1.0, size=equations.scale.shape)
        * np.where(equations.space.is_temperature, 300.0, 3.0)[:, None]
    )
    factors = equations.factorised(x, constraint)
    changes = random.normal(size=(*x.shape, 2)) * equations.scale[..., None]

    def times_jacobian(change):
        product = equations.balance_change(x, change)
        product[-1] = constraint.of(equations.space, change)
        return product

    found = factors.solve(times_jacobian(changes), np.array([0]))
    np.testing.assert_allclose(found, changes, atol=1e-6 * np.abs(changes).max())
    # (J⁻ᵀ g)·(J d) = g·d
    adjoint = factors.solve(changes, np.array([0]), transposed=True)
    products = np.einsum("ink,inl->kl", adjoint, times_jacobian(changes))
    np.testing.assert_allclose(products, np.einsum("ink,inl->kl", changes, changes), rtol=1e-6)
