"""A doorway held in the odometer's frame, and how wide it is open: against geometry; what is asked of a finder."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench.robots import Limits, PlanarPose, RobotState, Shape
from refseq_bench.robots.behaviours import BehaviourOutcome, RobotDescription, Senses
from refseq_bench.robots.behaviours.cross_door import CrossDoor, CrossingSide
from refseq_bench.robots.behaviours.sensing.doorway import LOOKS, DoorWatch, Passage, clearance_of
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from tests.robots.behaviours.mounted import ON_THE_ROBUTER

FRAME = RobotDescription(Shape(0.3, 0.7, 0.35, 1.4), Limits(0.5, 0.5, 0.5, 1.0), ON_THE_ROBUTER)
LASER = FRAME.laser.ahead


@dataclass(frozen=True)
class Found:
    """A doorway that a finder tells of."""

    centre: tuple[float, float]
    width: float = 0.9
    heading: float = 0.0


@dataclass(frozen=True)
class Seen:
    """A scan of beams that come back from nowhere, and what a finder finds in it."""

    doors: tuple[Found, ...] = ()
    ranges: NDArray[np.float32] = field(default_factory=lambda: np.full(361, np.inf, np.float32))

    @property
    def bearings(self) -> NDArray[np.float64]:
        return np.linspace(-np.pi / 2, np.pi / 2, 361)

    @property
    def points(self) -> NDArray[np.float64]:
        return np.minimum(self.ranges, 80.0)[:, None] * np.stack([np.cos(self.bearings), np.sin(self.bearings)], axis=1)


def finder(scan: Seen) -> Sequence[Found]:
    return scan.doors


def watch(*looks: tuple[Found, ...], pose: PlanarPose | None = None) -> DoorWatch:
    watched = DoorWatch(finder, LASER)
    for doors in looks:
        watched.look(pose or PlanarPose(), Seen(doors))
    return watched


def chosen(watched: DoorWatch, side: CrossingSide = CrossingSide.AHEAD) -> Passage:
    assert watched.choose(PlanarPose(), side.value, math.radians(50))
    return watched.passage


angles = st.floats(-math.pi, math.pi)
metres = st.floats(-20.0, 20.0)


@given(
    x=metres, y=metres, heading=angles, ahead=st.floats(0.5, 3.0), aside=st.floats(-1.0, 1.0), off=st.floats(-0.8, 0.8)
)
def test_a_doorway_stays_put_wherever_it_is_seen_from(
    x: float, y: float, heading: float, ahead: float, aside: float, off: float
) -> None:
    """The scanner is ahead of the axle, and all turns with the robot."""
    watched = watch(*[(Found((ahead, aside), heading=off),)] * LOOKS, pose=PlanarPose(x, y, heading))
    assert watched.choose(PlanarPose(x, y, heading), heading, math.radians(50))
    axis = watched.passage.axis
    along = LASER + ahead
    assert axis.x == pytest.approx(x + along * math.cos(heading) - aside * math.sin(heading), abs=1e-9)
    assert axis.y == pytest.approx(y + along * math.sin(heading) + aside * math.cos(heading), abs=1e-9)
    assert math.remainder(axis.heading - heading - off, 2 * math.pi) == pytest.approx(0, abs=1e-9)


def test_the_nearest_door_of_a_side_is_chosen() -> None:
    ahead, far = Found((3.0, 0.0)), Found((4.0, 1.0))
    left, right = Found((1.5, 1.0), heading=math.pi / 2), Found((1.0, -1.2), heading=-math.pi / 2)
    looks = [(far, ahead, right, left)] * LOOKS
    assert chosen(watch(*looks)).axis.x == pytest.approx(3.0 + LASER)
    assert chosen(watch(*looks), CrossingSide.LEFT).axis.y == pytest.approx(1.0)
    assert chosen(watch(*looks), CrossingSide.RIGHT).axis.y == pytest.approx(-1.2)


def test_a_door_that_is_found_now_and_then_is_none() -> None:
    door = (Found((2.0, 0.0)),)
    assert not watch(door, (), door, (), ()).choose(PlanarPose(), 0.0, 1.0)
    assert watch(door, (), door, (), door).choose(PlanarPose(), 0.0, 1.0)


def test_one_wrong_finding_does_not_move_a_door() -> None:
    right, wrong = (Found((2.0, 0.0)),), (Found((2.2, 0.1), 1.2, 0.3),)
    passage = chosen(watch(right, right, wrong, right, right))
    assert (passage.axis.x, passage.axis.y, passage.width) == pytest.approx((2.0 + LASER, 0.0, 0.9))


def test_a_door_is_off_when_three_findings_in_turn_say_so() -> None:
    here, moved, neighbour = (Found((2.0, 0.0)),), (Found((2.0, 0.2)),), (Found((2.0, 1.0)),)
    watched = watch(*[here] * LOOKS)
    chosen(watched)
    for doors in (here, moved, neighbour, (), moved):
        watched.look(PlanarPose(), Seen(doors))
        assert watched.off == 0
    watched.look(PlanarPose(), Seen((*neighbour, *moved)))
    assert watched.off == pytest.approx(0.2)


# --- how wide a doorway is open ---

DOOR = Passage(DirectedLine(3.0, 1.0, 0.4), 0.9)


def in_odometers_frame(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 2) given as beyond the door's face and to the left of its middle."""
    cos, sin = math.cos(0.4), math.sin(0.4)
    return points @ np.array([[cos, sin], [-sin, cos]]) + (3.0, 1.0)


def leaf(angle: float, hinge: int, recess: float = 0.08) -> NDArray[np.float64]:
    """Points on a leaf 0.9 m long that is open by ``angle`` and hangs on the left (1) or right (−1) jamb."""
    along = np.arange(0.0, 0.9, 0.02)
    return np.stack([recess + along * math.sin(angle), hinge * (0.45 - along * math.cos(angle))], axis=1)


@given(angle=st.floats(0.0, math.radians(88)), hinge=st.sampled_from([-1, 1]))
def test_a_leaf_leaves_open_what_geometry_says(angle: float, hinge: int) -> None:
    """A leaf as long as the door is wide leaves 1 − cos of its angle, on the other jamb's side."""
    way = clearance_of(DOOR, in_odometers_frame(leaf(angle, hinge)), 1.0, 1.5)
    assert way.width == pytest.approx(0.9 * (1 - math.cos(angle)), abs=0.021)
    assert way.leaf
    if way.width > 0.05:
        assert way.middle == pytest.approx(hinge * (way.width - 0.9) / 2, abs=0.011)


@given(beyond=st.floats(0.4, 1.4), aside=st.floats(0.01, 0.2), side=st.sampled_from([-1, 1]))
def test_what_stands_free_is_no_leaf(beyond: float, aside: float, side: int) -> None:
    turn = np.linspace(0, 2 * np.pi, 20)
    leg = np.stack([beyond + 0.06 * np.cos(turn), side * aside + 0.06 * np.sin(turn)], axis=1)
    way = clearance_of(DOOR, in_odometers_frame(leg), 1.0, 1.5)
    assert not way.leaf
    assert way.width == pytest.approx(0.45 - 0.06 + aside, abs=0.002)
    assert way.middle * side < 0


def test_somebody_before_an_open_leaf_is_told_from_the_leaf() -> None:
    person = np.array([[0.6, 0.3], [0.62, 0.32], [0.6, 0.34], [0.58, 0.32]])
    both = np.concatenate([leaf(math.radians(89), -1), person])
    assert not clearance_of(DOOR, in_odometers_frame(both), 1.0, 1.5).leaf


def test_nothing_there_is_all_open_and_what_is_far_off_does_not_count() -> None:
    assert clearance_of(DOOR, np.empty((0, 2)), 1.0, 1.5).width == pytest.approx(0.9)
    around = in_odometers_frame(np.array([[-1.2, 0.0], [1.6, 0.0], [0.1, 0.5], [0.1, -0.5]]))
    assert clearance_of(DOOR, around, 1.0, 1.5).width == pytest.approx(0.9)


# --- what a crossing asks of the robot ---


def ending(behaviour: CrossDoor, scans: Sequence[Seen | None], seconds: float = 20.0) -> tuple[BehaviourOutcome, str]:
    """Let a robot that stands still be asked for a while, with a new scan every fifth time."""
    for k in range(round(seconds / 0.04)):
        time = 0.04 * k
        step = behaviour.step(Senses(RobotState(time=time), scans[(k // 5) % len(scans)], time))
        assert step.twist.linear == 0 or step.outcome is BehaviourOutcome.RUNNING
        if step.outcome is not BehaviourOutcome.RUNNING:
            return step.outcome, step.why
    return BehaviourOutcome.RUNNING, ""


def test_it_gives_up_where_nothing_is_found_or_seen() -> None:
    blank = [Seen(), Seen()]
    assert ending(CrossDoor(FRAME, finder), blank) == (BehaviourOutcome.FAILED, "waited 10 s: no door ahead")
    assert ending(CrossDoor(FRAME, finder, CrossingSide.LEFT), blank) == (
        BehaviourOutcome.FAILED,
        "waited 10 s: no door left",
    )
    assert ending(CrossDoor(FRAME, finder), [None]) == (BehaviourOutcome.FAILED, "waited 10 s: the scan is lost")


def test_a_narrow_door_is_refused_with_what_the_robot_needs() -> None:
    narrow = [Seen((Found((2.0, 0.0), 0.75),)) for _ in range(LOOKS)]
    outcome, why = ending(CrossDoor(FRAME, finder), narrow)
    assert (outcome, why) == (BehaviourOutcome.FAILED, "door 0.75 m wide: too narrow, 0.82 m are needed")


def test_after_its_end_it_says_stop_and_the_same_reason() -> None:
    narrow = [Seen((Found((2.0, 0.0), 0.75),)) for _ in range(LOOKS)]
    behaviour = CrossDoor(FRAME, finder)
    first = ending(behaviour, narrow)
    assert ending(behaviour, narrow) == first
