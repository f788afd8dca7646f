"""Scans beyond the ends of a join: of one corridor, of two that are alike for a stretch, and of paths that part."""

import numpy as np
import pytest

from refseq.atlas.beyond import FAR, beyond
from refseq.atlas.consistency import LaidPairs
from refseq.atlas.scans import LaidScans, ScannedPath
from refseq.planar import Pose
from refseq.pose_graph import motions_between
from refseq.scan_matching.panorama import panorama
from tests.refseq.rooms import Wall, cast, rectangle

BARE: list[Wall] = rectangle(0, -1.2, 60, 1.2)
NICHES: list[Wall] = [
    *rectangle(0, -1.2, 60, 1.2),
    *[(x, side, x, side / 2) for x in (26.0, 29.0, 32.0, 35.0) for side in (-1.2, 1.2)],
]
"""Alike for 25 m, then pillars stand into it."""
STRETCH = LaidScans(1.0, np.column_stack([np.arange(5, 12)] * 2), LaidPairs(np.array([[8, 8]]), np.zeros((1, 3))))
"""Views 5 to 11, a metre apart, laid on each other as they are."""


def driven(walls: list[Wall], aside: float = 0.0, turns_at: int | None = None) -> ScannedPath:
    """A view a metre from x = 10 m on; or one that turns away at one of them."""
    poses = np.array([(10.0 + n, aside, 0.0) for n in range(24)])
    if turns_at is not None:
        steps = np.arange(24 - turns_at)
        poses[turns_at:] = np.column_stack([np.full(len(steps), poses[turns_at, 0]), steps, np.full(len(steps), 1.57)])
    scans = np.stack([panorama(cast(walls, Pose(*pose))) for pose in poses.tolist()])
    path = ScannedPath.of(motions_between(poses[0], poses), scans)
    assert path is not None
    return path


@pytest.mark.parametrize("aside", [0.0, 0.3])
def test_beyond_a_true_join_the_walls_are_the_same(aside: float) -> None:
    past = beyond(driven(NICHES), driven(NICHES, aside), STRETCH)
    assert past is not None
    assert past.share > 0.98


def test_beyond_a_look_alike_they_are_not() -> None:
    past = beyond(driven(BARE), driven(NICHES), STRETCH)
    assert past is not None
    assert past.share < 0.92
    assert past.metres == pytest.approx(FAR - 1, abs=1)


def test_both_ends_are_looked_at() -> None:
    """A stretch near the paths' end, after which hardly a view is left: what differs lies before it."""
    one, other = driven(BARE), driven(NICHES)
    views = np.arange(17, 23)
    late = LaidScans(1.0, np.column_stack([views] * 2), LaidPairs(np.array([[19, 19]]), np.zeros((1, 3))))
    past = beyond(one, other, late)
    assert past is not None
    assert past.share < 0.94


def test_paths_that_part_tell_nothing() -> None:
    at_once = LaidScans(1.0, np.column_stack([np.arange(12)] * 2), LaidPairs(np.array([[6, 6]]), np.zeros((1, 3))))
    assert beyond(driven(BARE), driven(BARE, turns_at=12), at_once) is None


def test_a_stretch_of_whole_paths_has_nothing_beyond() -> None:
    every = LaidScans(1.0, np.column_stack([np.arange(24)] * 2), LaidPairs(np.array([[12, 12]]), np.zeros((1, 3))))
    assert beyond(driven(BARE), driven(NICHES), every) is None
