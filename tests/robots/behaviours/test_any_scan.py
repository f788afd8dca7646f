"""Whatever the sensors say: every behaviour of every robot asks for a finite motion within its limits."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Blocked, Cause, PlanarPose, RobotState, Stop, Twist
from refseq_bench.robots.behaviours import BehaviourOutcome, Ranger, RobotDescription, Senses
from refseq_bench.robots.behaviours.written import KINDS, BehaviourKind, make_behaviour, parse_behaviour
from tests.robots.behaviours.mounted import ON_THE_ROBUTER

any_float = st.floats(width=32)
scans = arrays(np.float32, st.integers(0, 60), elements=any_float, fill=st.floats(0.25, 5.0, width=32)).map(
    lambda ranges: Scan(ranges, step=math.pi / max(len(ranges) - 1, 1))
)
calm = st.floats(-50, 50)
twists = st.builds(Twist, st.floats(-2, 2), st.floats(-2, 2))
stops = st.builds(
    Stop, st.sampled_from([Cause.SONAR, Cause.BUMPER, Cause.NO_COMMAND]), st.just("x"), calm, st.sampled_from(Blocked)
)
states = st.builds(
    RobotState,
    time=calm,
    pose=st.builds(PlanarPose, calm | any_float, calm, calm | any_float),
    distance=calm,
    twist=twists,
    stops=st.lists(stops, max_size=1).map(tuple),
    pitch=calm | any_float,
    sonar=st.none() | arrays(np.float64, st.integers(0, 3), elements=st.floats()),
)
senses = st.builds(Senses, states, st.none() | scans, st.none() | calm)


@pytest.mark.quick_cases(
    "robuter-MA", "robuter-MT", "robuter-MO", "robuter-MW", "robuter-MN", "segway_rmp-MC", "segway_rmp-tractor-stop"
)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.code)
@pytest.mark.parametrize("name", robots.names())
@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(looks=st.lists(senses, min_size=1, max_size=4))
def test_any_senses_give_a_finite_motion_within_the_limits(name: str, kind: BehaviourKind, looks: list[Senses]) -> None:
    robot = robots.load(name)
    frame = RobotDescription(
        robot.shape, robot.limits, ON_THE_ROBUTER, (Ranger(0.2, 0.1, 0.5), Ranger(-0.7, 0.0, math.pi))
    )
    behaviour = make_behaviour(parse_behaviour(kind.example), frame, lambda scan: ())
    ended = BehaviourOutcome.RUNNING
    for look in looks:
        step = behaviour.step(look)
        assert math.isfinite(step.twist.linear)
        assert abs(step.twist.linear) <= robot.limits.speed * (1 + 1e-9)
        assert abs(step.twist.angular) <= robot.limits.turn_rate * (1 + 1e-9)
        assert "\n" not in step.why
        if ended is not BehaviourOutcome.RUNNING:
            assert step.outcome is ended
        ended = step.outcome
        if ended is not BehaviourOutcome.RUNNING:
            assert step.why
            assert step.twist == Twist()
