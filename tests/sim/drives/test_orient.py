"""Orienting to a thing, and passing one on the way to a set point, by truth."""

import math

import pytest

from refseq_bench.robots.behaviours import BehaviourOutcome
from tests.sim.drives.behaving_in import BOX, behaved, corridor

PILLAR = (
    '[[furniture]]\nname = "pillar"\nkind = "pillar"\nat = [{x}, {y}]\n'
    'width = 0.2\ndepth = 0.2\nheight = 1.5\nmaterial = "metal"'
)


@pytest.mark.quick_cases("robuter-1.1-0.3-0", "segway_rmp-0.7-0.5--90")
@pytest.mark.parametrize(
    ("robot", "x", "y", "bearing"),
    [
        ("robuter", 1.1, 0.3, 0),
        ("robuter", -1.1, -0.2, 0),  # behind it: the sonars alone hear it
        ("segway_rmp", 0.7, -0.5, 0),
        ("segway_rmp", 0.7, 0.5, -90),
    ],
)
def test_it_ends_oriented_to_a_pillar(robot: str, x: float, y: float, bearing: int) -> None:
    done = behaved(corridor(12, PILLAR.format(x=5 + x, y=y)), robot, f"MO:{bearing}", (5.0, 0.0, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED, done.ended.why
    pose = done.rest
    seen_at = math.atan2(y - pose.y, 5 + x - pose.x) - pose.heading
    assert abs(math.degrees(math.remainder(seen_at - math.radians(bearing), math.tau))) < 5
    assert math.dist((pose.x, pose.y), (5.0, 0.0)) < 0.05
    assert not done.touched


def test_where_nothing_is_near_there_is_nothing_to_orient_to() -> None:
    done = behaved(corridor(12, left=1.0), "segway_rmp", "MO", (5.0, 1.2, math.pi / 2))
    assert done.ended.outcome is BehaviourOutcome.FAILED
    assert done.ended.why == "nothing to orient to within 2 m"


@pytest.mark.quick_cases("segway_rmp")
@pytest.mark.parametrize("robot", ["robuter", "segway_rmp"])
def test_a_box_on_the_line_to_a_set_point_is_passed_and_the_line_taken_up_again(robot: str) -> None:
    done = behaved(corridor(14, BOX.format(x=6.0, y=0.3)), robot, "MA:8,0", (2.0, 0.0, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED, done.ended.why
    assert not done.touched
    path = done.ended.path
    assert path[abs(path[:, 0] - 6.0).argmin(), 1] < -0.2
    assert abs(path[path[:, 0] > 9.0, 1]).max() < 0.1
    assert (done.rest.x, done.rest.y) == pytest.approx((10.0, 0.0), abs=0.06)
