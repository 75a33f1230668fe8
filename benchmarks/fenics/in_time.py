"""A lever under a bias that is switched on: the two-step backward differentiation formula."""

from itertools import pairwise

import numpy as np

FIRST_STEP = 1e-3  # as a share of the first time that is asked for


def follow(lever, bias, times, growth):
    """Switch the bias [V] on, and return the current and the tip temperature at times [us]."""
    stops = [FIRST_STEP * times[0]]
    for start, end in pairwise([*stops, *times]):
        between = max(1, int(np.ceil(np.log(end / start) / np.log(growth))))
        stops += [start * (end / start) ** (k / between) for k in range(1, between + 1)]
    last, now, found = lever.cold, lever.cold, []
    before, time, given = None, 0.0, lever.supplies.values(bias)
    for stop in dict.fromkeys(stops):
        length = stop - time
        ratio = 0.0 if before is None else length / before
        weights = (1 + 2 * ratio) / (1 + ratio), -(1 + ratio), ratio**2 / (1 + ratio)
        for (_, constant), weight in zip(lever.past, weights, strict=True):
            constant.assign(weight / length)
        for (state, _), known in zip(lever.past[1:], (now, last), strict=True):
            state.vector()[:] = known
        lever.values, lever.is_stale = now + ratio * (now - last), True
        if not lever.iterate(given):
            raise RuntimeError(f"no convergence at {stop} us")
        last, now, before, time = now, lever.values, length, stop
        if stop in times:
            current = lever.currents(lever.residual())[0]
            found.append((current, lever.tip_weights @ lever.values))
    currents, tips = zip(*found, strict=True)
    return {"time_us": times, "current_mA": currents, "tip_K": tips, "steps": len(stops)}
