"""States of a robot in messages: read back to the last bit, and refused in one line where they are none."""

import json
import math
from typing import Any

import numpy as np
import pytest

from refseq.modules.heads import MessageError
from refseq_bench.robots import PlanarPose, Twist
from refseq_bench.robots.state import Blocked, Cause, Motors, RobotState, Stop
from refseq_bench.sim.modules.state import state_bytes, state_in

STATE = RobotState(
    time=0.1 + 0.2,
    pose=PlanarPose(-0.0, 5e-324, 1.7976931348623157e308),
    distance=-1 / 3,
    twist=Twist(0.1, -0.7),
    stops=(Stop(Cause.BUMPER, "front: pressed", 0.7, Blocked.FORWARD),),
    motors=Motors.LOCKED,
    mode="tractor",
    pitch=math.pi,
    sonar=np.array([0.1 * 3, np.inf, np.nan]),
)


def damaged(where: str, value: Any) -> bytes:
    """The state with another value at ``where``, such as ``pose.x``."""
    whole = json.loads(state_bytes(STATE))
    *tables, key = where.split(".")
    table = whole
    for name in tables:
        table = table[name]
    table[key] = value
    return json.dumps(whole).encode()


def test_a_state_is_read_back_to_the_last_bit() -> None:
    read = state_in(state_bytes(STATE))
    assert state_bytes(read) == state_bytes(STATE)
    assert read.sonar is not None
    assert read.sonar.dtype == np.float64
    assert (read.stops, read.motors, read.pose) == (STATE.stops, STATE.motors, STATE.pose)
    assert state_in(state_bytes(RobotState())) == RobotState()


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (None, "all: Invalid JSON"),
        (b"[" * 100_000, "all: Invalid JSON"),
        (damaged("twist.linear", math.nan), "twist (nan m/s, -0.7 rad/s) cannot be driven"),
        (damaged("twist.linear", "abc"), "twist.linear: Input should be a valid number"),
        (damaged("pose.x", "abc"), "pose.x: Input should be a valid number"),
        (damaged("pose.x", True), "pose.x: Input should be a valid number"),
        (damaged("pose.z", 1.0), "pose.z: Unexpected keyword argument"),
        (damaged("battery", 1.0), "battery: Unexpected keyword argument"),
        (damaged("mode", 3), "mode: Input should be a valid string"),
        (damaged("sonar", "abc"), "sonar: Input should be a valid array"),
        (damaged("motors", "loud"), "motors: Input should be 'on', 'locked' or 'off'"),
    ],
)
def test_what_is_no_state_is_told(data: bytes | None, told: str) -> None:
    with pytest.raises(MessageError) as caught:
        state_in(data)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_number_beyond_all_others_is_infinite() -> None:
    """As one that is written with an exponent is; a range without an echo is infinite too."""
    read = state_in(damaged("sonar", [10**400]))
    assert read.sonar is not None
    assert read.sonar.tolist() == [math.inf]
