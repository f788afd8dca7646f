"""The regulator of one wheel, on a servo whose equations are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench import robots
from refseq_bench.robots import Actuation
from refseq_bench.robots.robuter.firmware import PERIOD
from refseq_bench.robots.robuter.regulator import GAIN, MOST, MOTOR_TORQUE, ROUNDING, SERVO_GAIN, SERVO_LAG, Regulator
from tests.robots.rolling import ENCODERS, Wheels


class Loaded:
    """A regulator, its wheel, and the torque of a ``load`` [N·m], under which the servo turns it slower."""

    def __init__(self) -> None:
        self.regulator, self.wheels, self.load, self.held = Regulator(ENCODERS, PERIOD), Wheels(), 0.0, False

    def run(self, seconds: float, wanted: float) -> float:
        """Return what the servo was told last [rad/s]."""
        told = 0.0
        for _ in range(round(seconds / PERIOD)):
            told = self.regulator.told(wanted, self.wheels.pulses.left)
            if not self.held:
                self.wheels.roll(Actuation(told - self.load / SERVO_GAIN, 0.0))
        return told

    def mean_speed(self, seconds: float, wanted: float) -> float:
        before = self.wheels.angles[0]
        self.run(seconds, wanted)
        return float(self.wheels.angles[0] - before) / seconds


def test_it_knows_the_motors_of_the_model() -> None:
    robot = robots.load("robuter")
    model = robot.spec.compile()
    for name in robot.wheel_actuators:
        motor = model.actuator(name)
        assert motor.forcerange[1] == MOTOR_TORQUE
        assert motor.gainprm[0] == -motor.biasprm[2] == SERVO_GAIN
        assert motor.dynprm[0] == SERVO_LAG


@given(st.lists(st.floats(-8.0, 8.0), max_size=60))
def test_it_adds_nothing_where_the_servo_does_as_it_is_told(wanted: list[float]) -> None:
    loaded = Loaded()
    for speed in wanted:
        assert loaded.run(PERIOD, speed) == speed


@pytest.mark.parametrize("load", [-20.0, 5.0, 20.0])
@pytest.mark.parametrize("wanted", [-1.0, 0.2, 3.0])
def test_a_loaded_wheel_turns_as_fast_as_it_is_told(load: float, wanted: float) -> None:
    loaded = Loaded()
    loaded.load = load
    assert loaded.mean_speed(0.1, wanted) != pytest.approx(wanted, abs=0.01), "the servo alone gives way"
    loaded.run(4.0, wanted)
    assert loaded.mean_speed(4.0, wanted) == pytest.approx(wanted, abs=1e-3)
    behind = wanted * 8.1 - loaded.wheels.angles[0]
    lasting = load / SERVO_GAIN / GAIN + wanted * SERVO_LAG
    assert behind == pytest.approx(lasting, abs=ENCODERS.angle(ROUNDING + 1)), "what it is behind holds the load"


def test_a_wheel_that_is_held_is_pushed_with_all_that_the_motor_has_and_does_not_burst_out() -> None:
    loaded = Loaded()
    loaded.held = True
    told = loaded.run(60.0, 0.01)
    assert told * SERVO_GAIN >= MOTOR_TORQUE
    assert told <= 0.01 + MOST
    loaded.held = False
    before = loaded.wheels.angles[0]
    loaded.run(10.0, 0.01)
    assert loaded.wheels.angles[0] - before < 0.1 + MOST / GAIN + ENCODERS.angle(2 * ROUNDING)


def test_what_is_to_stand_is_not_pushed_and_begins_anew() -> None:
    loaded = Loaded()
    loaded.load = 20.0
    assert loaded.run(2.0, 1.0) > 1.0
    assert loaded.run(PERIOD, 0.0) == 0.0
    assert loaded.run(1.0, 0.0) == 0.0
    loaded.load = 0.0
    assert loaded.run(PERIOD, 1.0) == 1.0


def test_set_down_it_expects_a_standing_wheel() -> None:
    loaded = Loaded()
    loaded.run(1.0, 4.0)
    loaded.wheels.speeds = np.zeros(2)
    loaded.regulator.rest()
    for _ in range(50):
        assert loaded.run(PERIOD, 4.0) == 4.0
