"""BLAS threads are limited inside, and the caller's setting comes back."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

from hotlever.estimate import knee
from hotlever.work import one_blas_thread


def blas_threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_one_thread_inside_and_the_callers_setting_after():
    scipy.linalg.lu_factor(np.eye(3))  # loads scipy's own BLAS
    seen = []

    @one_blas_thread
    def work(value):
        seen.append(blas_threads())
        if value is None:
            raise ValueError("on purpose")
        return value

    with threadpool_limits(2, user_api="blas"):
        assert work(7) == 7
        assert seen == [{1}]
        assert blas_threads() == {2}
        with pytest.raises(ValueError, match="on purpose"):
            work(None)
        assert blas_threads() == {2}


def test_a_curve_is_smoothed_with_one_thread(monkeypatch):
    """Two threads made finding a knee forty times slower on a busy machine."""
    seen = []

    def factorised(*arguments, **options):
        seen.append(blas_threads())
        return scipy.linalg.cho_factor(*arguments, **options)

    monkeypatch.setattr(knee, "cho_factor", factorised)
    x = np.linspace(0.0, 1.0, 12)
    with threadpool_limits(2, user_api="blas"):
        knee.GaussianProcess(x, np.sin(x), np.full(12, 1e-3))
    assert seen
    assert all(threads == {1} for threads in seen)
