import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from refseq_bench import robots
from refseq_bench.robots import RobotsError, Twist
from tests.robots.driving import PREFIX, Driven, add_wall, flat_world, ramped

STRAIGHT = ramped(Twist(0.5, 0.0), 21.0)


def slalom(time: float) -> Twist:
    part = float(np.clip(min(time, 41.0 - time), 0, 1))
    return Twist(0.5 * part, 0.4 * part * math.sin(time / 2))


def normal_forces(driven: Driven) -> dict[str, float]:
    """Normal force by the robot's geom [N]."""
    forces: dict[str, float] = {}
    for index, contact in enumerate(driven.data.contact):
        wrench = np.zeros(6)
        mujoco.mj_contactForce(driven.model, driven.data, index, wrench)
        name = driven.model.geom(max(contact.geom)).name.removeprefix(PREFIX)
        forces[name] = forces.get(name, 0.0) + wrench[0]
    return forces


def test_unknown_robot_lists_the_valid_ones() -> None:
    with pytest.raises(RobotsError) as error:
        robots.load("scout")
    assert str(error.value) == f"unknown robot 'scout': valid are {', '.join(robots.names())}"


def test_every_load_is_fresh() -> None:
    first, second = robots.load("robuter"), robots.load("robuter")
    first.spec.body("base").pos = (1, 2, 3)
    assert second.spec.body("base").pos.tolist() == [0, 0, 0]


def test_it_names_what_its_model_has() -> None:
    robot = robots.load("robuter")
    model = robot.spec.compile()
    for camera in robot.cameras:
        model.camera(camera)
    for joint, actuator in zip(robot.wheel_joints, robot.wheel_actuators, strict=True):
        assert model.actuator(actuator).trnid[0] == model.joint(joint).id
    assert model.site(robot.laser).bodyid[0] == model.body(robot.base).id
    assert model.joint(robot.base).type[0] == mujoco.mjtJoint.mjJNT_FREE


def test_mass() -> None:
    assert robots.load("robuter").spec.compile().body_mass.sum() == pytest.approx(154.0, abs=1.0)


def test_outer_dimensions_of_the_bare_vehicle() -> None:
    path = Path(robots.__file__).parent / "robuter" / "robuter.xml"
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    half = model.geom_aabb[:, 3:]
    rotation = np.abs(data.geom_xmat.reshape(-1, 3, 3))
    reach = np.einsum("gij,gj->gi", rotation, half)
    size = (data.geom_xpos + reach).max(axis=0) - (data.geom_xpos - reach).min(axis=0)
    np.testing.assert_allclose(size, [1.031, 0.710, 0.748], atol=0.005)


def test_wheels_turn_on_the_axle_where_the_drive_says() -> None:
    robot = robots.load("robuter")
    left, right = (robot.spec.body(name).pos for name in ("wheel-left", "wheel-right"))
    assert left[1] - right[1] == pytest.approx(robot.drive.track)
    assert left[0] == right[0] == 0
    assert left[2] == pytest.approx(robot.drive.wheel_radius)


def test_the_floor_carries_the_weight_mostly_under_the_driven_wheels() -> None:
    driven = Driven()
    driven.drive(3.0, lambda _: Twist())
    forces = normal_forces(driven)
    assert set(forces) == {"tread-left", "tread-right", "caster-left", "caster-right"}
    assert sum(forces.values()) == pytest.approx(154.0 * 9.81, rel=1e-3)
    assert 0.5 < (forces["tread-left"] + forces["tread-right"]) / sum(forces.values()) < 0.75


def test_ten_metres_straight() -> None:
    driven = Driven()
    driven.drive(22.0, STRAIGHT)
    assert driven.pose.x == pytest.approx(10.0, rel=0.005)
    assert abs(driven.pose.y) < 0.005
    assert abs(driven.turned) < math.radians(0.1)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_whole_turn_on_the_spot(direction: int) -> None:
    driven = Driven()
    duration = 2 * math.pi / 0.5 + 1.0
    driven.drive(duration + 1.0, ramped(Twist(0.0, 0.5 * direction), duration))
    assert math.degrees(driven.turned) == pytest.approx(360.0 * direction, rel=0.02)
    assert math.hypot(driven.pose.x, driven.pose.y) < 0.01


def test_wheels_slip_a_little_when_it_starts_hard_and_when_it_turns() -> None:
    driven = Driven()
    driven.drive(1.0, lambda _: Twist(0.5, 0.0))
    rolled = np.mean(driven.wheel_angles) * driven.robot.drive.wheel_radius
    assert 1e-4 < (rolled - driven.pose.x) / rolled < 0.02
    driven = Driven()
    driven.drive(8.0, lambda _: Twist(0.0, 0.5))
    left, right = driven.wheel_angles
    rolled = (right - left) * driven.robot.drive.wheel_radius / driven.robot.drive.track
    assert 1e-4 < (rolled - driven.turned) / rolled < 0.02


def test_casters_trail_and_swing_round_when_it_reverses() -> None:
    driven = Driven()
    driven.drive(4.0, lambda _: Twist(0.4, 0.0))
    caster = driven.data.joint(PREFIX + "caster-left-yaw")
    assert abs(math.remainder(float(caster.qpos[0]), 2 * math.pi)) < 0.05
    # A perfect reversal is a balance on the needle's point: a turn tips the casters out of it.
    driven.drive(2.0, lambda _: Twist(-0.3, 0.2))
    driven.drive(6.0, lambda _: Twist(-0.4, 0.0))
    assert abs(math.remainder(float(caster.qpos[0]), 2 * math.pi)) > math.pi - 0.1


def test_at_rest_nothing_moves_and_energy_does_not_grow() -> None:
    world = flat_world()
    world.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    driven = Driven(world)
    driven.drive(2.0, lambda _: Twist())
    start, height, energy = driven.pose, float(driven.data.qpos[2]), driven.data.energy.sum()
    driven.drive(60.0, lambda _: Twist())
    assert math.hypot(driven.pose.x - start.x, driven.pose.y - start.y) < 1e-3
    assert abs(driven.pose.heading - start.heading) < 1e-3
    assert float(driven.data.qpos[2]) == pytest.approx(height, abs=1e-4)
    assert driven.data.energy.sum() <= energy + 1e-3
    assert driven.data.energy[1] < 1e-6


def test_a_wall_stops_it() -> None:
    world = flat_world()
    add_wall(world, (2.05, 0.0), (0.05, 1.0))
    driven = Driven(world)
    driven.drive(8.0, lambda _: Twist(0.5, 0.0))
    assert driven.pose.x == pytest.approx(2.0 - 0.335, abs=0.01)
    assert abs(driven.data.qvel[0]) < 0.01
    assert driven.data.warning.number.sum() == 0


@pytest.mark.slow
def test_twenty_metres_of_slalom_converge_with_the_time_step() -> None:
    ends = {}
    for timestep in (0.001, 0.002, 0.004):
        driven = Driven(flat_world(timestep))
        driven.drive(42.0, slalom)
        ends[timestep] = np.array([driven.pose.x, driven.pose.y, driven.turned])
    finest = ends[0.001]
    coarse, middle = (np.abs(ends[step] - finest) for step in (0.004, 0.002))
    assert coarse.max() < 0.01
    assert middle.max() < 0.5 * coarse.max()


def test_cameras_look_where_they_should() -> None:
    driven = Driven()
    forward, lateral = (driven.data.camera(PREFIX + name) for name in driven.robot.cameras)
    np.testing.assert_allclose(-forward.xmat.reshape(3, 3)[:, 2], [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(-lateral.xmat.reshape(3, 3)[:, 2], [0, 1, 0], atol=1e-9)
    for camera in (forward, lateral):
        np.testing.assert_allclose(camera.xmat.reshape(3, 3)[:, 1], [0, 0, 1], atol=1e-9)
    assert (forward.xpos[2], lateral.xpos[2]) == (pytest.approx(1.1), pytest.approx(1.35))


def test_cameras_have_the_lens_of_the_fire_i() -> None:
    driven = Driven()
    for name in driven.robot.cameras:
        camera = driven.model.camera(PREFIX + name)
        half = math.tan(math.radians(camera.fovy[0]) / 2)
        assert driven.model.cam_resolution[camera.id].tolist() == [640, 480]
        assert 2 * math.degrees(math.atan(half * 640 / 480)) == pytest.approx(45.2, abs=0.1)


def test_cameras_do_not_see_the_robot_itself() -> None:
    driven = Driven()
    driven.drive(3.0, lambda _: Twist(0.3, 0.2))
    for name in driven.robot.cameras:
        assert not seen_bodies(driven, PREFIX + name) - {"world"}


def test_a_camera_turned_round_does_see_the_robot() -> None:
    driven = Driven()
    driven.model.camera(PREFIX + "camera-1").quat[:] = driven.model.camera(PREFIX + "camera-2").quat
    driven.model.camera(PREFIX + "camera-1").pos[:] = (0.08, -0.3, 1.1)
    mujoco.mj_forward(driven.model, driven.data)
    assert PREFIX + "base" in seen_bodies(driven, PREFIX + "camera-1")


def seen_bodies(driven: Driven, name: str) -> set[str]:
    """Bodies whose geoms are met by rays through a grid over the whole image, those only seen included."""
    camera = driven.data.camera(name)
    half = math.tan(math.radians(driven.model.camera(name).fovy[0]) / 2)
    u, v = np.meshgrid(np.linspace(-half * 4 / 3, half * 4 / 3, 81), np.linspace(-half, half, 61))
    rays = np.stack([u, v, -np.ones_like(u)], axis=-1).reshape(-1, 3) @ camera.xmat.reshape(3, 3).T
    hit, distance = np.empty(len(rays), np.int32), np.empty(len(rays))
    mujoco.mj_multiRay(
        driven.model, driven.data, camera.xpos, rays.ravel(), None, True, -1, hit, distance, None, len(rays), 100.0
    )
    return {driven.model.body(driven.model.geom(geom).bodyid[0]).name for geom in set(hit[hit >= 0])}
