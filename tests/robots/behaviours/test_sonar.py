"""Behaviours by sonar and odometry: any readings give a motion within limits, and one stray reading ends nothing."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq_bench.robots import Blocked, Cause, PlanarPose, RobotState, Stop, Twist
from refseq_bench.robots.behaviours import Behaviour, BehaviourOutcome, Ranger, RobotDescription, Senses
from refseq_bench.robots.behaviours.lamp.beside import Beside, keeps
from refseq_bench.robots.behaviours.lamp.dead_reckoned import DeadReckoned
from refseq_bench.robots.behaviours.lamp.narrow import Narrow
from refseq_bench.robots.behaviours.lamp.until import Gone, Near, Turned
from refseq_bench.robots.behaviours.sensing.sonar_filter import HISTORY, abeam
from refseq_bench.robots.behaviours.sensing.wall import WallSide
from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.odometry import along_arc
from refseq_bench.robots.robuter import LIMITS, SHAPE
from tests.robots.behaviours.mounted import ON_THE_ROBUTER

AHEAD, LEFT, RIGHT = Ranger(0.3, 0.0, 0.0), Ranger(0.0, 0.25, math.pi / 2), Ranger(0.0, -0.25, -math.pi / 2)
FRAME = RobotDescription(SHAPE, LIMITS, ON_THE_ROBUTER, (AHEAD, LEFT, Ranger(-0.4, 0.25, math.pi / 2), RIGHT))
KINDS: dict[str, Callable[[], Behaviour]] = {
    "turn": lambda: DeadReckoned(FRAME, Twist(0.0, 0.3), Turned(math.radians(-90))),
    "arc": lambda: DeadReckoned(FRAME, Twist(0.2, 0.3), Turned(1.0)),
    "length": lambda: DeadReckoned(FRAME, Twist(-0.9, 0.0), Gone(1.0)),
    "beside": lambda: Beside(FRAME, 1.0, WallSide.LEFT, Near(FRAME, 0, 0.5)),
    "ahead": lambda: Beside(FRAME, 0.02, None, Near(FRAME, 0, 0.5)),
    "narrow": lambda: Narrow(FRAME),
}

calm = st.floats(-50, 50)
stops = st.builds(Stop, st.sampled_from([Cause.SONAR, Cause.BUMPER]), st.just("x"), calm, st.sampled_from(Blocked))
states = st.builds(
    RobotState,
    time=calm,
    pose=st.builds(PlanarPose, calm | st.floats(width=32), calm, calm),
    distance=calm,
    twist=st.builds(Twist, st.floats(-2, 2), st.floats(-2, 2)),
    stops=st.lists(stops, max_size=1).map(tuple),
    sonar=st.none() | arrays(np.float64, st.integers(3, 5), elements=st.floats()),
)
senses = st.builds(Senses, states, st.none(), st.none() | calm)


@pytest.mark.quick_cases("ahead", "beside", "arc")
@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(looks=st.lists(senses, min_size=1, max_size=5))
def test_any_senses_give_a_finite_motion_within_the_limits(kind: str, looks: list[Senses]) -> None:
    behaviour, ended = KINDS[kind](), BehaviourOutcome.RUNNING
    for look in looks:
        step = behaviour.step(look)
        assert abs(step.twist.linear) <= LIMITS.speed * (1 + 1e-9)
        assert abs(step.twist.angular) <= LIMITS.turn_rate * (1 + 1e-9)
        assert "\n" not in step.why
        if ended is not BehaviourOutcome.RUNNING:
            assert step.outcome is ended
            assert step.twist == Twist()
        ended = step.outcome


STILL = PlanarPose()


def look(time: float, sonar: list[float], pose: PlanarPose = STILL, gone: float = 0.0) -> Senses:
    return Senses(RobotState(time, pose, gone, sonar=np.array(sonar)), None)


def test_a_stray_reading_ends_nothing_and_a_steady_one_does() -> None:
    """Ten readings a second; a stray one lasts until the sonar's next turn, 0.4 s later."""
    behaviour = DeadReckoned(FRAME, Twist(0.1, 0.0), Near(FRAME, 0, 0.5))
    for k in range(40):
        stray = 15 <= k < 19
        assert behaviour.step(look(0.1 * k, [0.2 if stray else 3.0, 3.0, 3.0, 3.0])).outcome is BehaviourOutcome.RUNNING
    times = [
        k for k in range(20) if behaviour.step(look(4 + 0.1 * k, [0.4, 3, 3, 3])).outcome is BehaviourOutcome.FINISHED
    ]
    assert 0.1 * times[0] <= HISTORY / 2 + 0.2


@pytest.mark.parametrize(("away", "slant"), [(1.24, 0.0), (0.74, 0.0), (0.94, 0.1), (0.94, -0.1)])
def test_it_comes_to_its_distance_from_a_wall_and_along_it(away: float, slant: float) -> None:
    """5 m without wheels or floor: the wall to the left begins ``away`` from the axle and slants by an angle."""
    rng = np.random.default_rng(3)
    behaviour, pose, gone = Beside(FRAME, 0.1, WallSide.LEFT, Near(FRAME, 0, 0.5)), PlanarPose(), 0.0
    for k in range(500):
        readings = [5.0, *(_perpendicular(pose, ranger, away, slant) for ranger in FRAME.sonars[1:3]), 5.0]
        readings[1:3] += rng.normal(0, 0.05, 2)
        if k % 20 == 0:
            readings[1 + k // 20 % 2] = 0.15  # a stray one
        twist = behaviour.step(look(0.1 * k, readings, pose, gone)).twist
        pose, gone = along_arc(pose, 0.1 * twist.linear, 0.1 * twist.angular), gone + 0.1 * twist.linear
    assert gone == pytest.approx(5.0, abs=0.1)
    assert _perpendicular(pose, Ranger(0.0, 0.0, 0.0), away, slant) == pytest.approx(keeps(FRAME), abs=0.04)
    assert pose.heading == pytest.approx(slant, abs=math.radians(4))  # two sonars that spread by 5 cm


def _perpendicular(pose: PlanarPose, ranger: Ranger, away: float, slant: float) -> float:
    """Distance [m] of a ranger from the wall."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    x, y = pose.x + cos * ranger.x - sin * ranger.y, pose.y + sin * ranger.x + cos * ranger.y
    return (away - y) * math.cos(slant) + x * math.sin(slant)


def test_sonars_of_a_side_are_those_that_look_there() -> None:
    assert abeam(FRAME, 1).tolist() == [1, 2]
    assert abeam(FRAME, -1).tolist() == [3]
    blind = RobotDescription(SHAPE, LIMITS, ON_THE_ROBUTER, (AHEAD, LEFT))
    with pytest.raises(RobotsError, match=r"^no sonar looks to the right: valid is a robot with some there$"):
        Narrow(blind)
