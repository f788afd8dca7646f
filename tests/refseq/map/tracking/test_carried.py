"""A robot that was carried, by what its sensors saw of the way: from the measurement to the chain."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from refseq.belief import LOST_ABOVE, Stage, Timings
from refseq.map.guard import SensorGuard
from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.map.matcher import Measurement
from refseq.map.profile import profile_named
from refseq.map.tracking.hindsight import Hindsight
from refseq.map.tracking.stands import Stands
from refseq.map.tracking.trackers import tracker_for
from refseq.planar import Pose
from refseq.view import View
from tests.refseq.rooms import bits_drive, bits_sequence, cast, rectangle

K = 40
VIEWS = bits_drive({"camera": np.eye(K, dtype=bool)})
NEVER, SELDOM = (
    Map.of(bits_sequence(VIEWS, profile_named(f"best+chain.carried={carried}")), "path") for carried in (0, 0.005)
)


def view(place: int, carried: float = -3.0) -> Measurement:
    """A metre on, a view that looks like one place and, a little, like the next ones of the stretch it came from."""
    even = np.full(K, 1 / K)
    return Measurement(even, 1.0, Timings(), 6.0 * np.eye(K)[place] - 1.0, turn=0.0, log_ratio_carried=carried)


def answers(map_: Map, drive: list[Measurement]) -> list[int | None]:
    """The places that the chain answers, None where it says lost; of a map of two paths both see the same."""
    tracker = tracker_for(Stage.CHAIN, map_)
    found = [tracker.update([one] * len(map_)) for one in drive]
    return [None if belief.lost > LOST_ABOVE else belief.best % K for belief in found]


CARRIED = [view(place) for place in range(10)] + [view(30, carried=4.0)] + [view(place) for place in range(31, 36)]
"""From place 9 to place 30, which the sensors saw."""


@pytest.mark.parametrize("two", [False, True], ids=["one path", "two paths"])
def test_who_is_seen_to_be_carried_is_found_at_once(two: bool) -> None:
    never, seldom = (beside([m.named("a"), m.named("b")]) if two else m for m in (NEVER, SELDOM))
    assert answers(seldom, CARRIED)[10:] == [30, 31, 32, 33, 34, 35]
    assert answers(never, CARRIED)[10] != 30


def test_sensors_that_tell_nothing_change_nothing() -> None:
    """Nor do those that saw it come by itself: the chain has its own ways of being lost."""
    for carried in (0.0, -3.0):
        drive = [replace(one, log_ratio_carried=carried) for one in CARRIED]
        never, seldom = (tracker_for(Stage.CHAIN, map_) for map_ in (NEVER, SELDOM))
        for one in drive:
            np.testing.assert_array_equal(never.update([one]).places, seldom.update([one]).places)


def test_a_stand_begins_where_the_robot_was_set_down() -> None:
    stands = Stands()
    first, *others = [view(30, 4.0), replace(view(30, 0.0), again=True), replace(view(30, -3.0), again=True)]
    stands.mean([first])
    assert [stands.mean([one])[0].log_ratio_carried for one in others] == [4.0, 4.0]


def test_a_laser_alone_is_not_asked() -> None:
    """Ever other rooms, in which no scan follows the one before."""
    rng = np.random.default_rng(4)
    rooms = [cast(rectangle(*rng.uniform(-9, -1, 2), *rng.uniform(1, 9, 2)), Pose(0, 0, 0), rng=rng) for _ in range(9)]
    drive = [View(float(t), {}, room, 0.5, 0.0) for t, room in enumerate(rooms)]
    guard = SensorGuard(learn(drive, profile="best"))
    assert [guard.match(one)[0].log_ratio_carried for one in drive] == [0.0] * 9


def test_one_camera_is_enough_to_tell() -> None:
    """Pictures of a wall of spots, each a tenth of its width on; then one from farther along."""
    wall = cv2.GaussianBlur(np.random.default_rng(3).random((480, 4000)), (0, 0), 4.0)
    wall = np.clip(127 + 900 * (wall - wall.mean()), 0, 255).astype(np.uint8)
    starts = [*range(0, 768, 64), 2600, 2664]
    drive = [View(t, {"forward": wall[:, start : start + 640]}, None, 0.5, 0.0) for t, start in enumerate(starts)]
    guard = SensorGuard(learn(drive[:8], profile="best"))
    told = [guard.match(one)[0].log_ratio_carried for one in drive]
    assert told[0] == 0.0
    assert max(told[1:12]) < -2.0
    assert told[12] > 2.0
    assert told[13] < -2.0


def test_hindsight_does_not_ask() -> None:
    """A stretch that changed is none that the robot was carried past: the views behind it tell."""
    found = []
    for carried in (0.0, 4.0):
        hindsight = Hindsight(SELDOM)
        for one in CARRIED:
            hindsight.take([replace(one, log_ratio_carried=carried)])
        found.append([belief.places.tolist() for belief in hindsight.beliefs()])
    assert found[0] == found[1]
