import math

import numpy as np
import pytest

from refseq_bench.scenarios.log_tools.travel import travel


def walk(*legs: tuple[float, float], step: float = 0.05) -> np.ndarray:
    """A path of legs: so far ahead [m], then a turn on the spot [degrees]."""
    poses, x, y, heading = [(0.0, 0.0, 0.0)], 0.0, 0.0, 0.0
    for length, turn in legs:
        for _ in range(round(length / step)):
            x, y = x + step * math.cos(heading), y + step * math.sin(heading)
            poses.append((x, y, heading))
        heading += math.radians(turn)
        poses.append((x, y, heading))
    return np.array(poses)


def test_a_straight_path_has_its_length_and_no_turn():
    found = travel(walk((20, 0)))
    assert found.length == pytest.approx(20, abs=0.2)
    assert (found.left_turns, found.right_turns, found.revisited) == (0, 0, 0.0)


def test_turns_are_counted_by_their_side():
    found = travel(walk((10, 90), (10, -90), (10, 90), (10, 0)))
    assert (found.left_turns, found.right_turns) == (2, 1)
    assert (found.width, found.height) == pytest.approx((20, 20), abs=0.2)


def test_a_second_round_comes_back_where_the_first_began():
    found = travel(walk(*[(10, 90)] * 7, (10, 0)))
    assert found.revisited == pytest.approx(0.5, abs=0.05)


def test_the_way_back_is_no_revisit_for_it_heads_the_other_way():
    assert travel(walk((20, 180), (20, 0))).revisited == 0.0


def test_an_odometer_that_trembles_at_rest_drives_nowhere():
    rng = np.random.default_rng(0)
    assert travel(rng.normal(0, 0.01, (2000, 3))).length == pytest.approx(0, abs=0.2)


def test_no_pose_is_no_path():
    assert travel(np.zeros((0, 3))).length == 0.0
