"""Corners of a scan against those of rooms whose plan is known."""

import numpy as np
import pytest

from refseq.features.corners import CornerCounts, find_corners
from refseq.features.walls import WallSettings
from refseq.planar import Pose
from tests.refseq.rooms import cast, rectangle

ROOM = rectangle(-3.0, -2.0, 3.0, 2.0)
"""A room whose corners ahead are 3 m ahead and 2 m to the side."""


def test_the_corners_of_a_room_are_where_they_are() -> None:
    scan = cast(ROOM, Pose(0.0, 0.0, 0.0), rng=np.random.default_rng(1))
    found = find_corners(scan, WallSettings())
    assert found.inside.all()
    assert found.place[np.argsort(found.place[:, 1])] == pytest.approx(np.array([[3.0, -2.0], [3.0, 2.0]]), abs=0.03)


def test_a_cupboard_has_a_corner_that_stands_out() -> None:
    walls = [*ROOM, *rectangle(1.5, 0.8, 2.9, 1.9)]
    found = find_corners(cast(walls, Pose(0.0, 0.0, 0.0), rng=np.random.default_rng(1)), WallSettings())
    assert found.place[~found.inside] == pytest.approx(np.array([[1.5, 0.8]]), abs=0.05)


def test_the_bits_are_those_of_their_distances() -> None:
    """Two corners inside at 3.6 m: of the bits of the middle band both."""
    bits = CornerCounts(WallSettings()).bits(cast(ROOM, Pose(0.0, 0.0, 0.0), rng=np.random.default_rng(1)))
    assert bits.tolist() == [2, 3]


def test_a_corridor_has_no_corners() -> None:
    walls = [(-20.0, 1.2, 20.0, 1.2), (-20.0, -1.2, 20.0, -1.2)]
    assert not len(find_corners(cast(walls, Pose(0.0, 0.0, 0.0), rng=np.random.default_rng(1)), WallSettings()).place)
