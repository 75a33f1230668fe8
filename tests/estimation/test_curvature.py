"""Quantities of an estimate beyond first order, of two parameters whose re-estimates are exact."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hotlever.estimate.posterior import CurvedQuantity

#: Derivatives of the quantity 100 a + 20 b.
GRADIENT = np.array([100.0, 20.0])


class _Surrogate:
    """Two data, exp(a) / s and b / 0.5, or the quantity alone."""

    def __init__(self, of_data, share=1.0):
        self.of_data, self.share = of_data, share

    def predict(self, point):
        if not self.of_data:
            return np.array([[GRADIENT @ point]]), GRADIENT[None, None]
        grown = np.exp(point[0]) / self.share
        slopes = np.diag([grown, 2.0])
        return np.array([[grown, 2.0 * point[1]]]), slopes[None]

    def values_at(self, point):
        return self.predict(point)[0]


def curved(share):
    """The quantity, where data know exp(a) within a share of it."""
    origin, data = np.zeros(2), _Surrogate(True, share)
    slopes = data.predict(origin)[1]
    objective = SimpleNamespace(
        names=("a", "b"),
        columns=[0, 1],
        bounds=np.array([[-9.0, -9.0], [9.0, 9.0]]),
        coordinates=SimpleNamespace(rates=np.ones_like),
        point=lambda probe: origin,
        among=lambda parameters, point: point,
        residual=lambda values, point: values[0],
        jacobian=lambda slopes, point: slopes[0],
    )
    probe = SimpleNamespace(values=lambda names: origin)
    at = SimpleNamespace(probe=probe, slopes=slopes, surrogate=data)
    posterior = SimpleNamespace(objective=objective, at=at, covariance=np.diag([share**2, 0.25]))
    return CurvedQuantity(posterior, _Surrogate(False), 0)


def exact(share, errors):
    """Changes by re-estimates: an error moves exp(a) and b by what it is."""
    return 100.0 * np.log1p(share * errors[:, 0]) + 10.0 * errors[:, 1]


def test_an_estimate_is_followed_to_second_order():
    errors = np.array([[1.0, 0.5], [-1.0, 2.0]])
    quantity = curved(0.02)
    whole, half = (
        np.abs(quantity.changes(size * errors) - exact(0.02, size * errors)).max()
        for size in (2.0, 1.0)
    )
    # less than a tenth of what the linear estimate is off by, and falling as the cube
    assert whole < 0.1 * np.abs(2.0 * errors @ [2.0, 10.0] - exact(0.02, 2.0 * errors)).max()
    assert whole / half > 6.0
    np.testing.assert_allclose(quantity.axes_of(np.diag([0.02, 0.5])), np.eye(2))


def test_the_most_bent_axis_is_solved():
    errors = np.array([[-2.5, 0.0], [-1.25, 3.0], [1.25, -1.0], [2.5, 1.0]])
    quantity = curved(0.3)
    assert quantity.changes(errors) == pytest.approx(exact(0.3, errors), rel=1e-4)
    # between what is solved it is interpolated, where the second order is off by half
    between = np.array([[-2.0, 0.5]])
    assert quantity.changes(between) == pytest.approx(exact(0.3, between), rel=0.06)
