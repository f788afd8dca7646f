"""A fork whose views are written down: two drives share a corridor and part; a third is elsewhere."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from refseq.atlas.decision import Decision
from refseq.belief import Belief, belief_from
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives
from refseq_bench.scenarios.scoring.merging import Merging
from tests.support import certain

UP = math.pi / 2


def views(*poses: tuple[float, float, float] | None, first: float = 0.0) -> list[View]:
    """Views a metre apart by odometry, of which some have no true pose."""
    return [
        View(float(k), distance=1.0 if k else first, truth=None if pose is None else Pose(*pose))
        for k, pose in enumerate(poses)
    ]


AHEAD = views(*((float(x), 0.0, 0.0) for x in range(21)))
"""Along the x axis from 0 to 20 m: views 0 to 20."""
ASIDE = views(*((float(x), 0.0, 0.0) for x in range(11)), *((10.0, float(y), UP) for y in range(1, 11)))
"""The same as far as 10 m, views 21 to 31, then to the left as far as (10, 10): views 32 to 41."""
ELSEWHERE = views(*((float(x), 50.0, 0.0) for x in range(5)))
"""Where none of the others comes: views 42 to 46."""
DRIVES: Mapping[str, Sequence[View]] = {"ahead": AHEAD, "aside": ASIDE, "elsewhere": ELSEWHERE}
COUNT = 47
PARTING = views(*((float(x), 0.0, 0.0) for x in range(11)), *((10.0, float(y), UP) for y in range(1, 9)))
"""A query: as far as the fork with its first eleven views, then to the left; view 11 is the first behind the fork."""

SHARED = Decision("ahead", "aside", (0, 10), (0, 10), (10.0, 10.0), joined=True, why="they are alike")
FALSE = Decision("ahead", "aside", (12, 16), (12, 16), (4.0, 4.0), joined=True, why="they look alike")


def merging(
    moved: Mapping[int, int] | None = None, *decisions: Decision, drives: Mapping[str, Sequence[View]] = DRIVES
) -> Merging:
    """What became of the drives' views where some are ``moved`` to another's place."""
    lengths = tuple(map(len, drives.values()))
    held_by = np.arange(sum(lengths))
    for view, holder in (moved or {}).items():
        held_by[view] = holder
    return Merging(tuple(drives), lengths, held_by, decisions, (4700, 3600), 0.25)


RIGHTLY = {21 + k: k for k in range(11)}
"""The shared corridor's views of the second drive at the places of the first."""


def compared(
    query: Sequence[View],
    beliefs: Mapping[str, Sequence[Belief]],
    mergings: Mapping[str, Merging] | None = None,
    drives: Mapping[str, Sequence[View]] = DRIVES,
) -> Comparison:
    """Answers to a query after the drives were learnt."""
    learnt = [view for drive in drives.values() for view in drive]
    of = Drives(tuple(drives), tuple(map(len, drives.values())))
    return Comparison("fork", learnt, {}, query, {}, beliefs, of, mergings or {})


def known(*places: int, count: int = COUNT) -> list[Belief]:
    """Answers that know one place only."""
    return [certain(count, place) for place in places]


def split(shares: Mapping[int, float], lost: float = 0.0, count: int = COUNT) -> Belief:
    """An answer that shares itself out."""
    weights = np.zeros(count)
    weights[list(shares)] = list(shares.values())
    return belief_from(weights, lost)
