"""A lever whose medium nobody knows: both are tried, and it is said which describes the data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar, get_args

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.inverse_problem import Estimate
from hotlever.estimation.outcome import Outcome
from hotlever.probe.surroundings import Medium
from hotlever.types import Array

Answer = TypeVar("Answer", bound=Outcome)


class Likelier(NamedTuple, Generic[Answer]):
    """Answers for a lever in either medium.

    Attributes
    ----------
    estimate : Estimate
        That the answer is read from.
    answer : Outcome
        The one that describes the data, or describes them better.
    other : Outcome or None
        That in the other medium, if it describes the data too: they do not tell which it is.
    words : str
        How well either describes them.
    """

    estimate: Estimate
    answer: Answer
    other: Answer | None
    words: str


def likelier(answered: Callable[[Medium], tuple[Estimate, Answer]]) -> Likelier[Answer]:
    """Answer for a lever in either medium.

    Raises
    ------
    ComputationError
        If the lever can be solved in neither.
    """
    tried: dict[Medium, tuple[Estimate, Answer]] = {}
    failed: dict[Medium, ComputationError] = {}
    for medium in get_args(Medium):
        try:
            tried[medium] = answered(medium)
        except ComputationError as error:
            failed[medium] = error
    if not tried:
        raise next(iter(failed.values()))

    def unlikeliness(medium: Medium) -> tuple[bool, float]:
        # what describes the data comes first, and of two of a kind the more probable one
        estimate, answer = tried[medium]
        return bool(answer.reason), estimate.posterior.deviance

    best, *rest = sorted(tried, key=unlikeliness)
    said = [f"in {medium} a lever {_how_well(*tried[medium])}" for medium in (best, *rest)]
    said += [f"in {medium} none can be solved: {error}" for medium, error in failed.items()]
    words = f"the medium is not known: {'; '.join(said)}"
    estimate, answer = tried[best]
    others = [tried[medium][1] for medium in rest if not tried[medium][1].reason]
    if not others:
        return Likelier(estimate, answer, None, words)
    words += "; the data do not tell which, and the errors of the tip temperature hold both"
    return Likelier(estimate, answer, others[0], words)


def error_of_choice(tip_K: Array, other_K: Array) -> Array:
    """Return the standard error (K) of a tip temperature that may as well be another one."""
    return np.asarray(np.abs(tip_K - other_K) / np.sqrt(2.0))


def _how_well(estimate: Estimate, answer: Outcome) -> str:
    rms = estimate.residuals.rms(estimate.prediction.values)
    shown = ", ".join(f"{value:.2g} {name.rsplit('_', 1)[1]}" for name, value in rms.items())
    return f"{'does not describe' if answer.reason else 'describes'} the data (rms {shown})"
