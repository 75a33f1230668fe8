"""A lever whose medium nobody knows: both are tried, and it is said which describes the data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar, get_args

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.inverse_problem import Estimate
from hotlever.probe.surroundings import Medium

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class InMedium(Generic[Answer]):
    """What is answered for a lever in a medium.

    Attributes
    ----------
    answer : object
    estimate : Estimate
        That the answer is read from.
    reason : str
        Why it does not describe the data; empty if it does.
    """

    answer: Answer
    estimate: Estimate
    reason: str


def likelier(
    answered: Callable[[Medium], InMedium[Answer]],
) -> tuple[Answer, Answer | None, str]:
    """Answer for a lever in either medium.

    Returns
    -------
    answer : object
        The one that describes the data, or describes them better.
    other : object or None
        That in the other medium, if it describes the data too: they do not tell which it is.
    words : str
        How well either describes them.

    Raises
    ------
    ComputationError
        If the lever can be solved in neither.
    """
    tried: dict[Medium, InMedium[Answer]] = {}
    failed: dict[Medium, ComputationError] = {}
    for medium in get_args(Medium):
        try:
            tried[medium] = answered(medium)
        except ComputationError as error:
            failed[medium] = error
    if not tried:
        raise next(iter(failed.values()))
    # what describes the data comes first, and of two of a kind the more probable one
    best, *rest = sorted(
        tried, key=lambda medium: (bool(tried[medium].reason), tried[medium].estimate.unlikeliness)
    )
    said = [f"in {medium} a lever {_how_well(tried[medium])}" for medium in (best, *rest)]
    said += [f"in {medium} none can be solved: {error}" for medium, error in failed.items()]
    words = f"the medium is not known: {'; '.join(said)}"
    other = next((tried[medium] for medium in rest if not tried[medium].reason), None)
    if other is None:
        return tried[best].answer, None, words
    words += "; the data do not tell which, and the errors of the tip temperature hold both"
    return tried[best].answer, other.answer, words


def error_of_choice(tip_K: np.ndarray, other_K: np.ndarray) -> np.ndarray:
    """Return the standard error (K) of a tip temperature that may as well be another one."""
    return np.asarray(np.abs(tip_K - other_K) / np.sqrt(2.0))


def _how_well(tried: InMedium[Answer]) -> str:
    estimate = tried.estimate
    rms = estimate.problem.residuals.rms(estimate.optimum.prediction.values)
    shown = ", ".join(f"{value:.2g} {name.rsplit('_', 1)[1]}" for name, value in rms.items())
    return f"{'does not describe' if tried.reason else 'describes'} the data (rms {shown})"
