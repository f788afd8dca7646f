"""The way left to a scene, against a camera that truly is so far from where it was cut."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.scenes.approach import SceneApproach
from refseq.scenes.finder import SceneSighting, projected
from tests.refseq.scenes.drawn import BOX, moved, scene

AHEAD, ASIDE = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def sighting(left: float, along: tuple[float, float, float], lane: float, distance: float) -> SceneSighting:
    """The scene as it looks ``left`` [m] before where it was cut, from a lane so far above it [m]."""
    shift = (-left * along[0], lane, -left * along[2])
    homography = moved(shift, AHEAD, distance)
    corners = projected(homography, BOX.corners)
    assert corners is not None
    return SceneSighting(homography, 30, corners)


@settings(deadline=None)
@given(
    along=st.sampled_from([AHEAD, ASIDE]),
    lane=st.floats(-0.1, 0.1),
    distance=st.floats(2.5, 8.0),
    lefts=st.lists(st.floats(-0.5, 2.0), min_size=2, max_size=5, unique=True).filter(lambda all_: np.ptp(all_) > 0.4),
)
def test_of_a_plane_it_is_the_true_way(
    along: tuple[float, float, float], lane: float, distance: float, lefts: list[float]
) -> None:
    approach, told = SceneApproach(scene()), None
    for left in sorted(lefts, reverse=True):
        told = approach.update(sighting(left, along, lane, distance), 20.0 - left)
    assert told == pytest.approx(min(lefts), abs=0.15)


def test_one_sighting_tells_nothing_nor_do_several_from_one_place() -> None:
    approach = SceneApproach(scene())
    assert approach.update(sighting(2.0, AHEAD, 0.0, 4.0), 0.0) is None
    assert approach.update(sighting(2.0, AHEAD, 0.0, 4.0), 0.1) is None
    assert approach.update(None, 0.5) is None
    assert approach.update(sighting(1.5, AHEAD, 0.0, 4.0), 0.5) == pytest.approx(1.5, abs=0.3)


def test_sightings_that_do_not_move_with_the_robot_are_not_believed() -> None:
    approach = SceneApproach(scene())
    jumps = (1.0, -2.0, 2.0, -1.0)
    told = [approach.update(sighting(left, ASIDE, 0.0, 3.0), 0.6 * number) for number, left in enumerate(jumps)]
    assert told[2:] == [None, None]


def test_what_was_seen_long_ago_does_not_count() -> None:
    approach = SceneApproach(scene())
    assert approach.update(sighting(2.0, AHEAD, 0.0, 4.0), 0.0) is None
    assert approach.update(sighting(1.9, AHEAD, 0.0, 4.0), 9.0) is None
