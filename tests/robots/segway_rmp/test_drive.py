"""The RMP driven by commands: how far, how straight, how it stops, by itself and before what is in its way."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Blocked, Cause, Shape, Twist
from refseq_bench.robots.mounting import FLOOR, Mounting
from refseq_bench.robots.odometry import Pulses
from refseq_bench.robots.segway_rmp import DRIVE, LIMITS, MOUNTING, SHAPE, build
from refseq_bench.robots.segway_rmp.control import MARGIN
from refseq_bench.robots.segway_rmp.firmware import ACCELERATION, COMMAND_HOLD, LATERAL, PERIOD, SegwayFirmware
from refseq_bench.robots.segway_rmp.obstacle_monitor import obstacle
from refseq_bench.robots.segway_rmp.protocol import COUNTS_PER_RADIAN, COUNTS_PER_SPEED, SegwayCommand
from refseq_bench.robots.signals import Signals
from refseq_bench.sim.sensors.inertial import InertialModel
from tests.robots.balancing import Boxes, Machine

BOTH = pytest.mark.parametrize("name", ["segway_rmp", "segway_rmp-tractor"])
STAND = Twist()


@pytest.mark.quick_cases("segway_rmp-tractor")
@BOTH
def test_ten_metres_straight(name: str) -> None:
    machine = Machine(name, inertial=InertialModel()).go(10.0, Twist(1.0, 0.0)).go(4.0, STAND)
    assert machine.axle[0] == pytest.approx(10.0, rel=0.005)
    assert abs(machine.axle[1]) < 0.02
    assert abs(machine.turned) < math.radians(0.2)


@pytest.mark.quick_cases("1-segway_rmp")
@BOTH
@pytest.mark.parametrize("direction", [1, -1])
def test_a_whole_turn_on_the_spot(name: str, direction: int) -> None:
    machine = Machine(name, inertial=InertialModel()).go(2 * math.pi, Twist(0.0, 1.0 * direction)).go(3.0, STAND)
    assert math.degrees(machine.turned) == pytest.approx(360.0 * direction, rel=0.005)
    assert math.hypot(*machine.axle[:2]) < 0.03


@BOTH
def test_its_tyres_keep_on_the_floor_while_they_scrub_in_a_turn(name: str) -> None:
    machine = Machine(name).go(2.0, Twist(0.0, LIMITS.turn_rate))
    for _ in range(100):
        machine.go(0.01, Twist(0.0, LIMITS.turn_rate))
        touching = {machine.model.geom(geom).name for geom in machine.data.contact.geom.ravel()}
        assert touching >= {"r/tread-left", "r/tread-right"}


@pytest.mark.quick_cases("segway_rmp")
@BOTH
def test_the_odometer_tells_the_path_but_for_slip(name: str) -> None:
    machine = Machine(name, inertial=InertialModel()).go(10.0, Twist(0.8, 0.3)).go(3.0, STAND)
    told = machine.control.odometry
    assert told.heading == pytest.approx(machine.turned, rel=0.02)
    assert math.dist((told.x, told.y), machine.axle[:2]) < 0.15
    still = Machine(name, inertial=InertialModel()).go(10.0, STAND)
    assert still.control.odometry.x == pytest.approx(still.axle[0], abs=2e-3), "swaying is not driving"


@pytest.mark.quick_cases("1.0-segway_rmp-tractor")
@BOTH
@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_it_brakes_in_the_way_of_its_deceleration_and_of_what_the_loop_adds(name: str, speed: float) -> None:
    machine = Machine(name).go(5.0, Twist(speed, 0.0))
    start = machine.axle[0]
    machine.control.emergency_stop()
    way = machine.go(5.0, Twist(speed, 0.0)).since(5.0)[:, 1].max() - start
    ideal = speed**2 / (2 * ACCELERATION)
    # The ramp is averaged over twice 0.24 s, a frame takes 0.02 s; leaning back takes the wheels ahead by 0.08 m.
    loop = speed * (0.24 + 0.02)
    assert ideal + 0.8 * loop < way < ideal + loop + 0.09
    assert Cause.EMERGENCY in machine.causes
    assert abs(machine.speed) < 0.02
    machine.control.release()
    assert machine.go(3.0, Twist(speed, 0.0)).speed == pytest.approx(speed, abs=0.03)


def test_a_command_holds_for_its_time_and_then_it_slows_to_a_stop() -> None:
    machine = Machine().go(4.0, Twist(0.5, 0.0))
    quiet = machine.go(3.0).since(4.0)
    held = quiet[quiet[:, 0] < 4.0 + COMMAND_HOLD - 0.04]
    assert held[:, 3] == pytest.approx(0.5, abs=0.02)
    assert abs(quiet[-1, 3]) < 0.02
    assert machine.causes == {Cause.NO_COMMAND}
    machine.go(2.0, Twist(0.5, 0.0))
    assert machine.control.state.free
    assert machine.speed > 0.3


def test_the_machine_itself_stops_when_its_computer_is_silent() -> None:
    firmware = SegwayFirmware(build(tail=True))
    firmware.receive(SegwayCommand(velocity=332), 0.0)
    speeds = []
    for tick in range(300):
        firmware.tick(Signals(time=tick * PERIOD, pulses=Pulses(0, 0)))
        speeds.append(firmware.courses[0].speed)
    assert np.argmax(speeds) * PERIOD == pytest.approx(COMMAND_HOLD + 0.24, abs=0.2)
    assert speeds[-1] == 0.0


@given(speed=st.floats(-1176, 1176), turn=st.floats(-1024, 1024))
@example(speed=1176.0, turn=1024.0)
@settings(max_examples=6, deadline=None)
def test_no_command_makes_it_turn_faster_than_half_g(speed: float, turn: float) -> None:
    firmware = SegwayFirmware(build(tail=True))
    for tick in range(450):
        firmware.receive(SegwayCommand(round(speed), round(turn)), tick * PERIOD)
        firmware.tick(Signals(time=tick * PERIOD, pulses=Pulses(0, 0)))
    way, heading = firmware.courses
    assert abs(way.speed * heading.speed) <= LATERAL * 1.01
    assert abs(way.speed) == pytest.approx(abs(round(speed)) / COUNTS_PER_SPEED, abs=1e-6)
    if abs(way.speed * turn / COUNTS_PER_RADIAN) < 0.9 * LATERAL:
        assert heading.speed == pytest.approx(round(turn) / COUNTS_PER_RADIAN, abs=1e-6)


# --- what is in the way ---

BOX: Boxes = (((3.0, 0.0, 0.5), (0.1, 0.3, 0.5)),)


@pytest.mark.quick_cases("1.0-segway_rmp-tractor")
@BOTH
@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_it_stops_before_a_box(name: str, speed: float) -> None:
    machine = Machine(name, inertial=InertialModel(), boxes=BOX, scans=True).go(2.9 / speed + 4.0, Twist(speed, 0.0))
    front = machine.since(0.0)[:, 1].max() + SHAPE.ahead
    assert 0.1 < 2.9 - front < 0.5
    assert abs(machine.speed) < 0.02
    (stop,) = machine.control.state.stops
    assert (stop.cause, stop.blocks) == (Cause.LASER, Blocked.FORWARD)
    assert stop.detail.startswith("laser: 0.")
    assert machine.go(3.0, Twist(-0.3, 0.0)).control.state.free, "it can go back"


@pytest.mark.quick_cases("segway_rmp-tractor")
@BOTH
def test_before_a_wall_it_turns_on_the_spot_until_its_arc_is_free(name: str) -> None:
    wall: Boxes = (((1.1, 0.0, 0.5), (0.1, 6.0, 0.5)),)
    machine = Machine(name, inertial=InertialModel(), boxes=wall, scans=True).go(3.0, Twist(1.0, 0.0))
    corners = [complex(ahead, left) for ahead in (0.254, -0.254) for left in (0.305, -0.305)]
    turned, near = 0.0, math.inf
    for _ in range(50):
        before, stopped = machine.turned, Cause.LASER in machine.causes
        machine.go(0.1, Twist(1.0, -0.8))
        turned += abs(machine.turned - before) * stopped
        near = min(
            near, 1.0 - machine.axle[0] - max((corner * np.exp(1j * machine.heading)).real for corner in corners)
        )
    assert turned > math.radians(45)
    assert near > 0.03
    assert machine.control.state.free
    assert machine.speed == pytest.approx(1.0, abs=0.1)


def test_what_stops_it_is_outside_of_the_circle_that_its_corners_take() -> None:
    assert SHAPE.ahead + MARGIN > math.hypot(SHAPE.ahead, SHAPE.half_width)


def doorway(width: float) -> Boxes:
    """A wall across the way 3 m ahead with an opening in its middle."""
    half = (2.0 - width / 2) / 2
    return tuple(((3.0, side * (width / 2 + half), 1.0), (0.1, half, 1.0)) for side in (1.0, -1.0))


@pytest.mark.quick_cases("1.0")
@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_it_goes_through_a_door_of_90_cm_without_a_stop(speed: float) -> None:
    machine = Machine(inertial=InertialModel(), boxes=doorway(0.9), scans=True)
    for _ in range(round((4.5 / speed + 1.5) / 0.4)):
        machine.go(0.4, Twist(speed, 0.0))
        assert machine.control.state.free
    assert machine.axle[0] > 3.5


def test_it_does_not_go_through_a_door_that_is_too_narrow() -> None:
    machine = Machine(inertial=InertialModel(), boxes=doorway(0.6), scans=True).go(8.0, Twist(0.6, 0.0))
    assert machine.axle[0] + SHAPE.ahead < 2.9
    assert Cause.LASER in machine.causes


def test_an_empty_floor_never_stops_it_however_it_leans() -> None:
    """Pushed about, it leans until the laser sees the floor near by; there is nothing in its way all the same."""
    machine = Machine(inertial=InertialModel(), scans=True).go(1.0, STAND)
    nearest, causes = math.inf, set()
    for push in (150.0, -150.0, 100.0, -150.0, 200.0):
        machine.push = push, 0.0, 0.0
        machine.go(0.25, Twist(0.8, 0.0))
        machine.push = 0.0, 0.0, 0.0
        for _ in range(10):
            machine.go(0.1, Twist(0.8, 0.0))
            nearest = min(nearest, float(machine._scan.ranges.min()))
            causes |= machine.causes
    assert nearest < 4.0, "the laser saw the floor"
    assert causes == set()


SQUARE = Shape(ahead=0.25, behind=0.25, half_width=0.3, height=1.4)


def single(bearing: float, distance: float) -> Scan:
    ranges = np.full(361, np.inf, np.float32)
    scan = Scan(ranges)
    ranges[int(np.argmin(np.abs(scan.bearings - bearing)))] = distance
    return scan


@given(
    bearing=st.floats(-1.5, 1.5),
    distance=st.floats(0.3, 6.0),
    pitch=st.floats(-0.2, 0.2),
    curvature=st.one_of(st.just(0.0), st.floats(-1.0, 1.0)),
)
@settings(deadline=None)
def test_what_is_in_the_way_is_what_a_walk_along_the_arc_meets(
    bearing: float, distance: float, pitch: float, curvature: float
) -> None:
    """Oracle: the robot's front line is carried along the arc in steps of 2 mm, until it passes the point."""
    scan, mounting = single(bearing, distance), Mounting(ahead=0.17, height=0.59, axle=0.24)
    seen = scan.bearings[int(np.argmin(scan.ranges))]
    ahead, aside = 0.17 + distance * math.cos(seen), distance * math.sin(seen)
    x = ahead * math.cos(pitch) + 0.35 * math.sin(pitch)
    up = 0.24 + 0.35 * math.cos(pitch) - ahead * math.sin(pitch)
    found = obstacle(scan, pitch, Twist(0.5, 0.5 * curvature), SQUARE, mounting)
    if abs(up - FLOOR) < 0.01:
        return
    walked = _walk(x, aside, curvature, SQUARE.half_width + 0.05)
    if up < FLOOR:
        assert found is None
    elif walked is not None and walked[1] > 0.01:
        assert found is not None
        assert found.gap == pytest.approx(walked[0] - SQUARE.ahead, abs=0.02)
    elif walked is None:
        assert found is None


def _walk(x: float, y: float, curvature: float, half: float) -> tuple[float, float] | None:
    """Way along the arc at which the axle passes a point, and how far within the robot's width that is."""
    heading, at = 0.0, np.zeros(2)
    last = x
    for step in range(4000):
        heading += curvature * 0.002
        at = at + 0.002 * np.array([math.cos(heading), math.sin(heading)])
        off = np.array([x, y]) - at
        along = off @ (math.cos(heading), math.sin(heading))
        aside = abs(off @ (-math.sin(heading), math.cos(heading)))
        if last > 0 >= along and aside < half + 0.01:
            return (0.002 * step, half - aside)
        last = along
    return None


def test_its_limits_are_those_that_its_robot_tells() -> None:
    robot = robots.load("segway_rmp")
    assert robot.limits is LIMITS
    assert robot.drive is DRIVE
    assert pytest.approx(0.24) == MOUNTING.axle
    assert robot.limits.speed < DRIVE.max_wheel_speed * DRIVE.wheel_radius == pytest.approx(3.54)
