"""What a robot tells of itself."""

import pytest

from refseq_bench.robots import Cause, RobotState, Stop, Twist
from refseq_bench.robots.state import STANDS


def test_a_stop_in_words_is_its_cause_and_what_was_read() -> None:
    assert str(Stop(Cause.SONAR, "0.30 m ahead", 2.0)) == "sonar: 0.30 m ahead"
    assert str(Stop(Cause.SONAR, "", 2.0)) == "sonar"


@pytest.mark.parametrize("linear", [0.0, 0.9 * STANDS, -0.9 * STANDS, STANDS, -0.5])
@pytest.mark.parametrize("angular", [0.0, 0.9 * STANDS, -0.9 * STANDS, STANDS, -0.5])
def test_a_robot_stands_where_it_neither_goes_nor_turns(linear: float, angular: float) -> None:
    slow = (0.0, 0.9 * STANDS, -0.9 * STANDS)
    assert RobotState(twist=Twist(linear, angular)).stands is (linear in slow and angular in slow)
