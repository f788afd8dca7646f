"""Actions become steps: behaviours go on while they are chosen, twists keep to what the robot is let."""

import numpy as np
import pytest

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Limits, RobotState, Twist
from refseq_bench.robots.behaviours import BehaviourOutcome, Senses
from refseq_bench.sim.drives.behaviour_runner import description_of
from refseq_bench.sim.envs.episodes.actions import ByBehaviour, ByTwist
from refseq_bench.sim.errors import SimError

FRAME = description_of(robots.load("robuter"))
TURN, OTHER, STOP = 0, 1, 2


def acting() -> ByBehaviour:
    return ByBehaviour(("MT:90", "MT:-90", "stop"), FRAME)


def turned(heading: float, time: float) -> Senses:
    """A robot that stands in the open and has turned so far by its odometer [rad]."""
    return Senses(
        RobotState(time=time, pose=robots.PlanarPose(0.0, 0.0, heading)), Scan(np.full(361, 20.0, np.float32)), time
    )


def test_a_behaviour_goes_on_while_it_is_chosen_again() -> None:
    """A turn by 90° that was begun at 0 ends at 90°, not 90° after it was last chosen."""
    form = acting()
    for time, heading in enumerate(np.radians([0.0, 30.0, 60.0])):
        form.choose(TURN)
        assert form.step(turned(float(heading), float(time))).twist.angular > 0
    outcomes = []
    for time in np.arange(3.0, 4.0, 0.04):  # it stands a while before it says so
        form.choose(TURN)
        outcomes.append(form.step(turned(np.pi / 2, float(time))).outcome)
        if outcomes[-1] is not BehaviourOutcome.RUNNING:
            break
    assert outcomes[-1] is BehaviourOutcome.FINISHED


def test_another_behaviour_or_one_that_ended_begins_anew() -> None:
    form = acting()
    form.choose(TURN)
    form.step(turned(0.0, 0.0))
    form.choose(OTHER)
    assert form.step(turned(0.5, 1.0)).twist.angular < 0
    form.choose(TURN)
    assert form.step(turned(np.pi / 2, 2.0)).twist.angular > 0  # 90° more
    form.choose(STOP)
    assert form.step(turned(0.0, 3.0)).outcome is BehaviourOutcome.FINISHED
    form.choose(STOP)
    assert form.step(turned(0.0, 4.0)).outcome is BehaviourOutcome.FINISHED
    assert form.doing == "stop"
    form.reset()
    assert form.doing == ""


@pytest.mark.parametrize(
    ("action", "twist"),
    [
        ((1.0, 0.0), Twist(0.5, 0.0)),
        ((0.0, -1.0), Twist(0.0, -0.5)),
        ((-0.5, 0.25), Twist(-0.25, 0.125)),
        ((7.0, 0.0), Twist(0.5, 0.0)),
        ((1.0, 1.0), Twist(0.5, 0.5)),
    ],
)
def test_a_twist_is_a_share_of_what_the_robot_is_let(action: tuple[float, float], twist: Twist) -> None:
    form = ByTwist(Limits(speed=0.5, turn_rate=0.5, acceleration=0.5, angular_acceleration=1.0))
    form.choose(np.array(action, np.float32))
    step = form.step(turned(0.0, 0.0))
    assert (step.twist, step.outcome) == (twist, BehaviourOutcome.RUNNING)


def test_a_behaviour_that_the_robot_cannot_do_is_told() -> None:
    with pytest.raises(SimError, match=r"behaviour 'MW:left,0.1': distance 0.1 m to a wall: valid is"):
        ByBehaviour(("MW:left,0.1",), FRAME)
