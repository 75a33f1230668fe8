"""Reduced levers of other materials than the paper's silicon, and batches that use them."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.cache import CACHE_VARIABLE
from hotlever.estimate import FitOptions, Measurement, many
from hotlever.estimate.surrogate import Rows
from hotlever.lever import Lever
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import cached_reduction, estimated_error, known_reduction
from hotlever.lever.response_surface import PAPER, ParameterDomain, is_papers
from hotlever.probe import Probe
from of_materials import p_type_probe, strip_probe

BIAS = np.linspace(0.05, 0.45, 9)


@pytest.fixture(scope="module")
def strip():
    return Lever(strip_probe(), COARSE)


@pytest.fixture(scope="module")
def reduced(strip):
    return cached_reduction(strip)


@pytest.mark.parametrize("seed", range(3))
def test_it_follows_the_full_lever_as_its_error_estimate_says(strip, reduced, seed):
    domain = ParameterDomain.of(strip.probe)
    shares = np.random.default_rng(seed).random(len(domain.names))
    lever = strip.with_probe(domain.probe(strip.probe, shares))
    found = reduced.linearised(lever.probe, Reach(lever.circuit, BIAS[-1]))
    branch = found.branch
    u = branch.read(lever.circuit, BIAS).u
    assert estimated_error(lever, branch, u[u > 0])[2].max() < 0.02
    full = lever.sweep(BIAS)
    current, _, tip, _ = Rows(BIAS).values(branch, lever.circuit)
    np.testing.assert_allclose(current, full.current_mA, rtol=1e-5)
    np.testing.assert_allclose(tip, full.tip_K, atol=0.02)
    assert found.names == reduced.names == domain.names
    with pytest.raises(ValueError, match=r"by nitride\.kappa, film\.resistivity, film\.tcr only"):
        reduced.linearised(lever.probe, Reach(lever.circuit, 0.1), names=("thickness_um",))


@pytest.mark.slow
def test_boron_doped_silicon_is_as_good():
    lever = Lever(p_type_probe(), COARSE)
    reduced, domain = cached_reduction(lever), ParameterDomain.of(lever.probe)
    for seed in range(3):
        shares = np.random.default_rng(seed).random(len(domain.names))
        there = lever.with_probe(domain.probe(lever.probe, shares))
        bias = np.linspace(1.0, 5.0, 9)
        branch = reduced.linearised(there.probe, Reach(there.circuit, 5.0)).branch
        assert estimated_error(there, branch, branch.read(there.circuit, bias).u)[2].max() < 0.1
        tip = Rows(bias).values(branch, there.circuit)[2]
        np.testing.assert_allclose(tip, there.sweep(bias).tip_K, atol=0.1)


def test_it_serves_where_it_was_made_for_and_a_little_beyond(strip, reduced):
    near, far = (strip.probe.with_(**{"film.resistivity": 2e-5 * n}) for n in (1.2, 4.0))
    assert known_reduction(strip.with_probe(near)) is not None
    assert known_reduction(strip.with_probe(far)) is None
    # what does not vary is part of what it depends on
    other = strip.probe.with_(**{"film.lorenz_ratio": 2.0})
    assert known_reduction(strip.with_probe(other)) is None
    assert known_reduction(strip, ["film.lorenz_ratio"]) is None


def test_the_paper_s_silicon_has_ranges_of_its_own():
    probe = Probe.reference()
    assert ParameterDomain.of(probe).names == tuple(PAPER)
    np.testing.assert_array_equal(
        ParameterDomain.of(probe).low, ParameterDomain.of(probe.with_(n_d=1e18)).low
    )
    assert is_papers(probe)
    assert not is_papers(probe, ["impurity_exponent"])
    wider = ParameterDomain.of(probe, ["impurity_exponent"])
    place = wider.names.index("impurity_exponent")
    assert wider.low[place] < 0 < wider.high[place]
    middle = np.full(len(wider.names), 0.3)
    np.testing.assert_allclose(wider.shares(wider.probe(probe, middle)), 0.3)


def test_a_batch_reduces_what_can_be_reduced(strip, monkeypatch):
    reduced_names = []
    monkeypatch.setattr(
        many, "cached_reduction", lambda _, progress, names: reduced_names.append(names)
    )
    data, free = Measurement.of_sweep(strip.sweep(BIAS)), ("film.lorenz_ratio",)
    for options in (FitOptions(), FitOptions(free=free), FitOptions(free=("thickness_um",))):
        assert not many._not_reduced(strip.probe, options, {"one": data}, None)
    assert reduced_names == [
        set(ParameterDomain.of(strip.probe).names),
        {*ParameterDomain.of(strip.probe).names, *free},
    ]


@pytest.mark.slow
def test_a_batch_of_film_levers_is_fitted(tmp_path, monkeypatch):
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    paths, progress = [], []
    for number, resistivity in enumerate((1.8e-5, 2.2e-5)):
        sweep = Lever(strip_probe().with_(**{"film.resistivity": resistivity})).sweep(BIAS)
        rows = zip(BIAS, sweep.current_mA.values, sweep.tip_K.values, strict=True)
        text = "\n".join(",".join(map(str, row)) for row in rows)
        paths.append(tmp_path / f"film-{number}.csv")
        paths[-1].write_text(f"V_b (V),I_h (mA),T_tip (K)\n{text}\n")
    done = many.fit_many(
        *(paths, tmp_path / "fits", strip_probe()),
        processes=1,
        reducing=lambda *steps: progress.append(steps),
    )
    assert not done.failures
    assert progress[-1] == (8, 8)
    found = [one.parameters["film.resistivity"].value for one in done.results.values()]
    assert found == pytest.approx([1.8e-5, 2.2e-5], rel=3e-3)
