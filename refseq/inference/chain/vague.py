"""Vague views: how much the views of a drive tell is not known beforehand, so two filters suppose one thing each.

In dim light, from another lane, or where clutter has moved, a view tells nothing of its place, and speaks a little
against all of them, the robot's own among them: ten in a row say lost, though they are what such a drive shows
anywhere. One filter takes ratios as they are calibrated. The other supposes that views are vague, and takes each for as
likely anywhere with a chance of ``NOTHING`` more. How well each foresaw the views so far tells which to believe, by
Bayes' rule. So a drive that was clear stays so: a robot that leaves its path then is not taken for one in the dark.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Protocol

import numpy as np
from scipy.special import expit, log_expit, logit

from refseq.inference.chain.chain import Observation
from refseq.inference.chain.forward import StatePosterior

NOTHING = 0.6
"""Chance that a vague view tells nothing of its place."""
SETTLED = 20.0
"""Log odds of the two suppositions beyond which the other one is asked no more."""


class StateFilter(Protocol):
    """Observations to the probabilities of the states, view by view."""

    def reset(self) -> None:
        """Forget all views seen."""

    def update(self, observation: Observation) -> StatePosterior:
        """Take the next view and answer from the views up to it."""


class VagueFilter:
    """Two filters of one space as one: views are taken as they are by ``clear``, as vague ones by ``vague``.

    ``chance`` is the probability before a drive that they are vague. Both filters are at their beginning.
    """

    def __init__(self, clear: StateFilter, vague: StateFilter, chance: float) -> None:
        self._clear, self._vague, self._start = clear, vague, float(logit(chance))
        self._before = self._odds = self._start

    def reset(self) -> None:
        """Forget all views seen."""
        self._clear.reset()
        self._vague.reset()
        self._before = self._odds = self._start

    def update(self, observation: Observation) -> StatePosterior:
        """Take the next view and answer from the views up to it."""
        if not observation.again:
            self._before = self._odds
        if self._before < -SETTLED:
            return self._clear.update(observation)
        if self._before > SETTLED:
            return self._vague.update(vaguely(observation))
        clear, vague = self._clear.update(observation), self._vague.update(vaguely(observation))
        self._odds = _odds_after(self._before, (clear, vague))
        return _weighed(clear, vague, self._before, self._odds)


def smoothed_either_way(
    clear: Sequence[StatePosterior], vague: Sequence[StatePosterior], chance: float
) -> list[StatePosterior]:
    """Posteriors of all views in the light of the whole drive; at the last one it is that of ``VagueFilter``.

    ``clear`` and ``vague`` are what follows from either supposition, ``chance`` the probability of the latter before.
    """
    odds = list(accumulate(zip(clear, vague, strict=True), _odds_after, initial=float(logit(chance))))
    return [_weighed(one, other, before, odds[-1]) for one, other, before in zip(clear, vague, odds[:-1], strict=True)]


def vaguely(observation: Observation) -> Observation:
    """The observation, were it one of a vague view: each place's ratio to being lost is a weighted mean with 1."""
    ratios = np.logaddexp(np.log(NOTHING), np.log1p(-NOTHING) + observation.places - observation.lost)
    return replace(observation, places=ratios + observation.lost)


def _odds_after(before: float, answers: tuple[StatePosterior, StatePosterior]) -> float:
    """Log odds of vague views after one that both filters have answered, of clear and of vague views."""
    clear, vague = answers
    return before + vague.log_evidence - clear.log_evidence


def _weighed(clear: StatePosterior, vague: StatePosterior, before: float, odds: float) -> StatePosterior:
    """Both answers to a view, by the log odds of vague views that are known, and by those ``before`` the view."""
    share = float(expit(odds))
    return StatePosterior(
        (1 - share) * clear.places + share * vague.places,
        (1 - share) * clear.lost + share * vague.lost,
        float(np.logaddexp(log_expit(-before) + clear.log_evidence, log_expit(before) + vague.log_evidence)),
    )
