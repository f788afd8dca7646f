"""What a robot touches: nothing while it stands and drives free, and what it is pushed against, by name."""

from collections.abc import Iterator

import pytest

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.contacts import ContactLog
from tests.sim.drives.behaving_in import BOX, PERFECT, corridor, touches

THINGS = BOX.format(x=6, y=0)


@pytest.fixture(params=["robuter", "segway_rmp"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    with Bench(corridor(things=THINGS), robots.load(request.param), settings=PERFECT) as bench:
        yield bench


def pushed(bench: Bench, touched: ContactLog, x: float, y: float, heading: float = 0.0) -> frozenset[str]:
    """What is touched at a pose, a moment after the robot was put there."""
    bench.place(Pose(x, y, heading))
    seen: frozenset[str] = frozenset()
    for _ in range(10):
        bench.drive(Twist())
        seen |= touched.look()
    return seen


def test_a_robot_that_drives_free_touches_nothing(bench: Bench) -> None:
    touched = ContactLog(bench)
    for _ in range(75):
        bench.drive(Twist(0.4, 0.0))
        assert touched.look() == frozenset()
    assert bench.pose.x > 2.5
    assert touched.found == ()
    assert touched.begun == 0


def test_what_it_is_pushed_against_is_named(bench: Bench) -> None:
    """The same as a look at all contacts by name finds."""
    touched = ContactLog(bench)
    shape = bench.robot.shape
    assert pushed(bench, touched, 3.0, 0.0) == frozenset()
    found = pushed(bench, touched, 6.0 - 0.25 - shape.ahead + 0.05, 0.0)
    assert found
    assert all("box" in name for name in found)
    once = touched.begun
    assert once >= 1
    wall = pushed(bench, touched, 3.0, 1.2 - shape.half_width + 0.03)
    assert any("left" in name for name in wall)
    assert set(touched.found) == found | wall
    assert list(touched.found)[: len(found)] == sorted(found)
    assert touched.begun > once


def test_a_touch_counts_once_until_it_is_let_go(bench: Bench) -> None:
    touched = ContactLog(bench)
    against, free = Pose(6.0 - 0.25 - bench.robot.shape.ahead + 0.02, 0.0, 0.0), Pose(3.0, 0.0, 0.0)
    for number in range(1, 4):
        bench.place(against)
        now = touched.look()
        assert now == touches(bench)
        assert len(now) == 1
        assert touched.look() == now
        assert touched.begun == number
        bench.place(free)
        assert touched.look() == frozenset()
    assert len(touched.found) == 1
