"""What a robot tells of itself."""

import pytest

from refseq_bench.robots import RobotState, Twist
from refseq_bench.robots.state import STANDS


@pytest.mark.parametrize("linear", [0.0, 0.9 * STANDS, -0.9 * STANDS, STANDS, -0.5])
@pytest.mark.parametrize("angular", [0.0, 0.9 * STANDS, -0.9 * STANDS, STANDS, -0.5])
def test_a_robot_stands_where_it_neither_goes_nor_turns(linear: float, angular: float) -> None:
    slow = (0.0, 0.9 * STANDS, -0.9 * STANDS)
    assert RobotState(twist=Twist(linear, angular)).stands is (linear in slow and angular in slow)
