"""What holds for every robot: its model, and a Control layer that nothing which comes in can upset."""

import math
import re
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Cause, Inertial, Robot, Signals, Twist
from refseq_bench.robots.odometry import Pulses, true_geometry
from refseq_bench.robots.sensor_mast import COLLISION_GROUP, VISUAL_GROUP
from tests.pages import ROOT

every_robot = pytest.mark.parametrize("name", robots.names())


@pytest.fixture(scope="module")
def compiled() -> dict[str, mujoco.MjModel]:
    return {name: robots.load(name).spec.compile() for name in robots.names()}


def test_both_robots_are_there() -> None:
    assert {"robuter", "segway_rmp"} <= set(robots.names())


@every_robot
def test_it_names_what_its_model_has(name: str, compiled: dict[str, mujoco.MjModel]) -> None:
    robot, model = robots.load(name), compiled[name]
    assert robot.name == name
    assert model.joint(robot.base).type[0] == mujoco.mjtJoint.mjJNT_FREE
    assert model.site(robot.laser).bodyid[0] == model.body(robot.base).id
    for camera in robot.cameras:
        assert model.camera(camera).bodyid[0] == model.body(robot.base).id
    for joint, actuator in zip(robot.wheel_joints, robot.wheel_actuators, strict=True):
        assert model.actuator(actuator).trnid[0] == model.joint(joint).id
    for part in robot.bumpers.values():
        assert model.geom(part).contype[0] != 0
    for site in robot.sonars:
        assert model.site(site).bodyid[0] == model.body(robot.base).id


@every_robot
def test_what_is_seen_and_what_is_touched_are_apart(name: str, compiled: dict[str, mujoco.MjModel]) -> None:
    model = compiled[name]
    seen, solid = model.geom_group == VISUAL_GROUP, model.geom_group == COLLISION_GROUP
    assert seen.any()
    assert solid.any()
    assert not (model.geom_contype[~solid] | model.geom_conaffinity[~solid]).any()
    assert (model.geom_contype[solid] != 0).all()


@every_robot
def test_every_part_that_moves_has_an_inertia_that_a_body_can_have(
    name: str, compiled: dict[str, mujoco.MjModel]
) -> None:
    model = compiled[name]
    for inertia in model.body_inertia[1:]:
        assert (inertia > 0).all()
        assert 2 * inertia.max() <= inertia.sum() * (1 + 1e-9), "no axis is worth more than the two others together"


@every_robot
def test_its_shape_holds_all_that_can_touch(name: str, compiled: dict[str, mujoco.MjModel]) -> None:
    model, shape = compiled[name], robots.load(name).shape
    corners = np.concatenate(list(_corners(model)))
    assert corners[:, 0].max() == pytest.approx(shape.ahead, abs=0.02)
    assert -corners[:, 0].min() == pytest.approx(shape.behind, abs=0.02)
    assert np.abs(corners[:, 1]).max() == pytest.approx(shape.half_width, abs=0.02)
    assert corners[:, 2].max() == pytest.approx(shape.height, abs=0.05)


def _corners(model: mujoco.MjModel) -> Iterator[NDArray[np.float64]]:
    """Extreme points of all solid geoms, in the robot's frame."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for geom in np.flatnonzero(model.geom_group == COLLISION_GROUP):
        reach = np.abs(data.geom_xmat[geom].reshape(3, 3)) @ model.geom_aabb[geom, 3:]
        yield data.geom_xpos[geom] + np.stack([reach, -reach])


LASER = re.compile(r"^\| `laser` \| (\S+) m ahead of the axle, scan plane (\S+) m above the floor", re.MULTILINE)


@every_robot
def test_its_scan_plane_is_where_its_page_says(name: str, compiled: dict[str, mujoco.MjModel]) -> None:
    row = LASER.search((ROOT / "robots" / name.partition("-")[0] / "README.md").read_text())
    assert row is not None
    data = mujoco.MjData(compiled[name])
    mujoco.mj_forward(compiled[name], data)
    ahead, _, height = data.site(robots.load(name).laser).xpos
    assert (ahead, height) == pytest.approx((float(row[1]), float(row[2])), abs=1e-6)


# --- signals that nobody would believe ---

numbers = st.one_of(
    st.floats(-3, 3), st.sampled_from([math.nan, math.inf, -math.inf, 1e300, 0.0]), st.floats(allow_nan=True)
)
counts = st.one_of(st.integers(-(10**6), 10**6), st.just(math.nan))


@st.composite
def signals(draw: st.DrawFn, robot: Robot, time: float) -> Signals:
    ranges = np.full(361, draw(st.one_of(st.floats(width=32), st.sampled_from([math.nan, math.inf]))), np.float32)
    return Signals(
        time=time,
        pulses=Pulses(draw(counts), draw(counts)),
        torques=(draw(numbers), draw(numbers)),
        inertial=Inertial(*(draw(numbers) for _ in range(4))),
        bumpers=draw(st.frozensets(st.sampled_from(sorted(robot.bumpers)))) if robot.bumpers else frozenset(),
        sonar=np.full(len(robot.sonars), draw(numbers)) if robot.sonars else None,
        scan=draw(st.sampled_from([None, Scan(ranges)])),
    )


@pytest.mark.quick_cases("segway_rmp")
@every_robot
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_signal_upsets_a_control_layer(name: str, data: st.DataObject) -> None:
    robot = LOADED[name]
    control = robot.control(true_geometry(robot.drive))
    for tick in range(12):
        if tick % 3 == 0:
            control.command(Twist(data.draw(st.floats(-1, 1)), data.draw(st.floats(-1, 1))))
        actuation = control.tick(data.draw(signals(robot, tick * control.period)))
        assert math.isfinite(actuation.left)
        assert math.isfinite(actuation.right)
        assert all(stop.detail and "\n" not in stop.detail for stop in control.state.stops)


LOADED = {name: robots.load(name) for name in robots.names()}


class Fed:
    """A Control layer that is told to go on and hears what a test says; its wheels stand still."""

    def __init__(self, robot: Robot) -> None:
        self.control = robot.control(true_geometry(robot.drive))
        self._whole: dict[str, Any] = {"pulses": Pulses(0, 0)}
        if robot.sonars:
            self._whole["sonar"] = np.full(len(robot.sonars), 5.0)
        if self.control.needs_scan:
            self._whole["scan"] = Scan(np.full(361, 10.0, np.float32))
        self._time = 0.0

    def hears(self, readings: dict[str, Any]) -> set[Cause]:
        """Let a second pass; returns the causes of all stops that hold then."""
        for _ in range(round(1.0 / self.control.period)):
            self._time += self.control.period
            self.control.command(Twist(0.3, 0.0))
            self.control.tick(Signals(time=self._time, **{**self._whole, **readings}))
        return {stop.cause for stop in self.control.state.stops}


BROKEN = {
    "inertial": Inertial(pitch=math.nan),
    "pulses": Pulses(math.nan, 0),  # type: ignore[arg-type]
    "sonar": np.array([5.0, math.nan, *[5.0] * 22]),
    "scan": Scan(np.where(np.arange(361) == 180, np.float32(np.nan), np.float32(10.0))),
}


@every_robot
@pytest.mark.parametrize("sensor", BROKEN)
def test_a_sensor_without_numbers_stops_the_robot_until_it_is_released(name: str, sensor: str) -> None:
    robot = LOADED[name]
    fed = Fed(robot)
    if (sensor == "sonar" and not robot.sonars) or (sensor == "scan" and not fed.control.needs_scan):
        pytest.skip(f"the Control layer of {name} has no {sensor}")
    assert Cause.SENSOR not in fed.hears({})
    assert Cause.SENSOR in fed.hears({sensor: BROKEN[sensor]})
    assert Cause.SENSOR in fed.hears({}), "it holds although the sensor is well again"
    fed.control.release()
    assert Cause.SENSOR not in fed.hears({})
