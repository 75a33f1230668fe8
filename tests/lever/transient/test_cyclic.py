"""A repeated wave form whose periods have become alike."""

from __future__ import annotations

import pytest

from hotlever.errors import HistoryEndError
from hotlever.lever.transient import pulse, simulate
from hotlever.lever.transient.trains import cyclic_steady_state


@pytest.mark.slow
def test_a_train_settles_as_if_it_were_followed(coarse):
    history, start = cyclic_steady_state(coarse, pulse(8.0, 4.0), 20.0)
    long = simulate(coarse, pulse(8.0, 4.0, 20.0, 12), at=[220.0, 224.0, 240.0])
    assert start.tip_K == pytest.approx(long.tip_K.values[0], abs=0.2)
    assert history.tip_K.max().item() == pytest.approx(long.tip_K.values[1], abs=0.2)
    assert history.tip_K.values[-1] == pytest.approx(start.tip_K, abs=0.1)


def test_a_train_that_melts_says_when(coarse):
    with pytest.raises(HistoryEndError, match="melts after"):
        cyclic_steady_state(coarse, pulse(40.0, 4.0), 20.0)
