"""Runs of pairs that tell most for two sequences sharing them: local alignment (Smith and Waterman 1981).

A chain that follows one sequence through the other is slow to believe that it came upon it, and passes over stretches
of a few metres. Here every pair of places is weighed. A run goes on on both sequences, and from pair to pair both have
moved alike by their odometry, in length and in turn: what looks alike by chance mostly turns another way.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.planar import wrapped
from refseq.pose_graph import motions_between, moved, ways_along

STEPS = ((1, 1), (1, 2), (2, 1), (2, 2), (2, 3), (3, 2), (3, 3), (3, 4), (4, 3))
"""Places that a run may go on by, on the one and on the other: views are not taken at the same spots, and one of them
may tell nothing. The first of equals is taken."""
CLEAR = 2
"""Pairs so many places from a run belong to it, and make no run beside it: choices of the aligner's own."""


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Price of what two sequences do differently in a run.

    A pair adds what it tells beyond ``bar`` [nats]; a step that is longer on one of them costs half the square of the
    difference in units of ``slack`` [m], one that turns otherwise in units of ``bend`` [rad]. A run is kept with a
    score of ``score`` [nats] or more, if its pairs tell of one relative pose within ``spread`` [m] and ``askew`` [rad],
    root mean squares. Lower scores bring more candidates, most of them false.
    """

    bar: float = 0.3
    slack: float = 0.4
    bend: float = 0.12
    score: float = 5.0
    spread: float = 1.0
    askew: float = 0.2


DEFAULT_RUNS = RunSettings()


def best_runs(
    nats: NDArray[np.float64],
    one: NDArray[np.float64],
    other: NDArray[np.float64],
    settings: RunSettings = DEFAULT_RUNS,
) -> list[NDArray[np.intp]]:
    """Runs of pairs (n, 2), those that tell most first, none through another.

    ``nats`` (K, L) is what each pair of places tells; −∞ forbids it. ``one`` (K, 3) and ``other`` (L, 3) are the
    places' poses by each one's own odometry.
    """
    scores, steps = _scores(nats - settings.bar, one, other, settings)
    found = _traced(scores, steps, settings.score)
    return [pairs for pairs in found if len(pairs) > 1 and _rigid(one[pairs[:, 0]], other[pairs[:, 1]], settings)]


def _scores(
    gains: NDArray[np.float64], one: NDArray[np.float64], other: NDArray[np.float64], settings: RunSettings
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Score of the best run that ends with each pair (K, L), 0 for none, and its last step, −1: it begins there."""
    scores, steps = np.zeros_like(gains), np.full(gains.shape, -1, np.int8)
    motions = [(_motions(one, a), _motions(other, b)) for a, b in STEPS]
    for i in range(len(one)):
        best = np.zeros(len(other))
        for number, (a, b) in enumerate(STEPS):
            if i < a or len(other) <= b:
                continue
            before = scores[i - a, :-b]
            mine, its = motions[number]
            longer = np.where(before > 0, before - _costs(mine[i - a], its, settings), 0.0)
            better = longer > best[b:]
            best[b:][better] = longer[better]
            steps[i, b:][better] = number
        scores[i] = np.maximum(best + gains[i], 0.0)
    return scores, steps


def _motions(track: NDArray[np.float64], by: int) -> NDArray[np.float64]:
    """Length and turn from each place to the one so many places on, (n − by, 2)."""
    stay = max(len(track) - by, 0)
    ways = ways_along(track)
    return np.column_stack([ways[by:] - ways[:stay], track[by:, 2] - track[:stay, 2]])


def _costs(mine: NDArray[np.float64], its: NDArray[np.float64], settings: RunSettings) -> NDArray[np.float64]:
    """Cost of a motion (2,) beside each of others (m, 2), by the lengths and the turns of both, (m,)."""
    length, turn = (mine - its).T
    return np.asarray(np.square(length / settings.slack) / 2 + np.square(wrapped(turn) / settings.bend) / 2)


def _traced(scores: NDArray[np.float64], steps: NDArray[np.int8], least: float) -> Iterator[NDArray[np.intp]]:
    """The runs that lead to the highest scores, each but for what belongs to a better one."""
    taken = np.zeros(scores.shape, np.bool_)
    ends = np.flatnonzero(scores >= least)
    for end in ends[np.argsort(-scores.ravel()[ends], kind="stable")].tolist():
        i, j = divmod(end, scores.shape[1])
        if taken[i, j]:
            continue
        run = [(i, j)]
        while steps[i, j] >= 0:
            a, b = STEPS[steps[i, j]]
            i, j = i - a, j - b
            run.append((i, j))
        whole = not any(taken[pair] for pair in run)
        for i, j in run:
            taken[max(i - CLEAR, 0) : i + CLEAR + 1, max(j - CLEAR, 0) : j + CLEAR + 1] = True
        if whole:
            yield np.array(run[::-1], np.intp)


def _rigid(one: NDArray[np.float64], other: NDArray[np.float64], settings: RunSettings) -> bool:
    """True where pairs of poses (n, 3) tell of one relative pose, as seen from their middle."""
    middle = len(one) // 2
    relative = moved(motions_between(one[middle], one), motions_between(other, other[middle]))
    turn = np.angle(np.exp(1j * relative[:, 2]).mean())
    askew = np.sqrt(np.square(wrapped(relative[:, 2] - turn)).mean())
    return bool(np.hypot(*relative[:, :2].std(axis=0)) <= settings.spread and askew <= settings.askew)
