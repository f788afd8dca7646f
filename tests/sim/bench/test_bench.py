import json
import math
from dataclasses import replace
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import refseq_bench.sim.bench.bench
import refseq_bench.worlds.build
from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.individual import RobotSpread
from refseq_bench.robots.odometry import CalibrationErrors
from refseq_bench.sim.bench.bench import ADAPTATION, Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.cameras.exposure import ExposureControl
from refseq_bench.sim.cameras.lens import Lens
from refseq_bench.sim.cameras.library import load_camera
from refseq_bench.sim.cameras.sensor import Sensor
from refseq_bench.sim.drives.operator import OperatorStyle
from refseq_bench.sim.drives.recorder import describe
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.envs.episodes.pixels import square_camera
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.drivers import gl_backend
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.laser_model import LaserModel
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.sim.bench.lamp import Lamp, signal
from tests.worlds.conftest import SMALL

BLIND = BenchSettings(renderer=RendererKind.NONE)


@pytest.fixture(scope="module")
def corridor() -> World:
    """8 m long, walls at y = ±1.2 m, its route along the x axis from 1 m on."""
    return build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), seed=0)


def bench_in(world: World, seed: int = 0, settings: BenchSettings = BLIND) -> Bench:
    return Bench(world, robots.load("robuter"), seed=seed, settings=settings)


def drive(bench: Bench, twist: Twist, seconds: float) -> None:
    for _ in range(round(seconds / CONTROL_PERIOD)):
        bench.drive(twist)


def test_it_starts_at_the_routes_first_point_facing_the_second(corridor: World) -> None:
    with bench_in(corridor) as bench:
        assert bench.time == 0.0
        assert (bench.pose.x, bench.pose.y, bench.pose.heading) == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)


def test_a_world_without_pictures_is_for_benches_without_cameras() -> None:
    plan = parse_plan(SMALL.format(top="", end=""))
    bare = build_world(plan, light_named("16:00"), pictured=False)
    with bench_in(bare) as bench:
        assert bench.sense().scan is not None
    with pytest.raises(SimError, match=r"^world 'small' was built without pictures; valid is the renderer 'none'$"):
        bench_in(bare, settings=BenchSettings(renderer=RendererKind.CLASSIC))


def test_an_unknown_route_is_told_with_the_valid_ones(corridor: World) -> None:
    with pytest.raises(SimError, match=r"^unknown route 'up' in world 'small': valid are forward$"):
        Bench(corridor, robots.load("robuter"), route="up", settings=BLIND)


@pytest.mark.parametrize(
    ("route", "told"),
    [
        ([[1.0, 0.0]], "a route needs two different points, not 1"),
        ([[1.0, 0.0], [1.0, 0.0]], "a route needs two different points, not 1"),
        ([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], "a route has shape (n, 2), not (2, 3)"),
        ([[1.0, 0.0], [math.inf, 0.0]], "a route's points must be finite"),
    ],
)
def test_a_route_that_is_no_polyline_is_refused(corridor: World, route: list[list[float]], told: str) -> None:
    with pytest.raises(SimError) as refused:
        Bench(corridor, robots.load("robuter"), route=np.array(route), settings=BLIND)
    assert str(refused.value) == told


def test_points_that_a_route_repeats_do_not_turn_the_robot(corridor: World) -> None:
    route = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 0.5]])
    with Bench(corridor, robots.load("robuter"), route=route, settings=BLIND) as bench:
        assert bench.pose.heading == pytest.approx(math.pi / 2)


def test_seeds_and_units_below_0_are_refused(corridor: World) -> None:
    with pytest.raises(SimError, match=r"^bench: seed = -1 is not valid; it should be 0 or more$"):
        bench_in(corridor, seed=-1)
    with pytest.raises(RobotsError, match=r"^robot: unit = -1 is not valid; it should be 0 or more$"):
        bench_in(corridor, settings=BenchSettings(RendererKind.NONE, unit=-1))


def test_the_worlds_spec_stays_free_of_robots(corridor: World) -> None:
    before = len(corridor.spec.bodies)
    with bench_in(corridor) as one, bench_in(corridor) as other:
        assert len(corridor.spec.bodies) == before
        drive(one, Twist(0.3, 0.0), 1.0)
        assert other.pose.x == pytest.approx(1.0, abs=1e-9)
        assert one.model.ngeom == other.model.ngeom


def test_a_robot_serves_any_number_of_benches(corridor: World) -> None:
    robot = robots.load("robuter")
    with Bench(corridor, robot, settings=BLIND) as one, Bench(corridor, robot, settings=BLIND) as other:
        for bench in (one, other):
            drive(bench, Twist(0.3, 0.1), 1.0)
        assert np.array_equal(one.data.qpos, other.data.qpos)
    assert robot.spec.compile().nbody == robots.load("robuter").spec.compile().nbody


def test_one_command_takes_one_control_period(corridor: World) -> None:
    with bench_in(corridor) as bench:
        drive(bench, Twist(), 1.0)
        assert bench.time == pytest.approx(1.0, abs=1e-9)


def test_truth_is_the_pose_of_the_axle(corridor: World) -> None:
    with bench_in(corridor) as bench:
        drive(bench, Twist(0.3, 0.4), 2.0)
        truth = bench.sense().truth
        body = bench.data.body("robuter/base")
        w, _, _, z = body.xquat
        axle = (bench.data.body("robuter/wheel-left").xpos + bench.data.body("robuter/wheel-right").xpos) / 2
        assert truth is not None
        assert (truth.x, truth.y) == pytest.approx(axle[:2], abs=1e-9)
        assert truth.heading == pytest.approx(2 * math.atan2(z, w), abs=1e-4)  # the base is level to 1e-2 rad
        assert 0.5 < truth.heading < 0.9


@pytest.mark.parametrize("robot", robots.names())
def test_truth_and_sensors_are_where_the_robot_is_now_and_it_goes_as_if_nobody_looked(
    corridor: World, robot: str
) -> None:
    plain, looked = (Bench(corridor, robots.load(robot), settings=BLIND) for _ in range(2))
    plain._physics.update_frames = lambda: None  # type: ignore[method-assign]
    with plain, looked:
        for bench in (plain, looked):
            drive(bench, Twist(0.5, 0.2), 2.0)
        sensors = robots.load(robot).cameras
        pose, eyes = looked.pose, [looked.data.camera(f"{robot}/{name}").xpos.copy() for name in sensors]
        mast, velocity = looked.data.site(f"{robot}/laser").xpos.copy(), looked.data.cvel.copy()
        mujoco.mj_forward(looked.model, looked.data)
        assert pose == looked.pose != plain.pose
        assert np.array_equal(eyes, [looked.data.camera(f"{robot}/{name}").xpos for name in sensors])
        assert np.array_equal(mast, looked.data.site(f"{robot}/laser").xpos)
        assert np.array_equal(velocity, looked.data.cvel)
        assert np.array_equal(plain.data.qpos, looked.data.qpos)


def test_the_motion_of_views_is_that_of_the_true_path_but_for_slip_and_calibration(corridor: World) -> None:
    with bench_in(corridor) as bench:
        first, views = bench.sense(), []
        for _ in range(5):
            drive(bench, Twist(0.3, 0.05), 1.0)
            views.append(bench.sense())
        late = 0.3 * bench.control.period  # the wheels' counters were last read a tick ago
    assert first.distance == first.turn == 0.0
    for before, after in pairwise([first, *views]):
        assert before.truth is not None
        assert after.truth is not None
        true = math.dist((before.truth.x, before.truth.y), (after.truth.x, after.truth.y))
        assert after.distance == pytest.approx(true, rel=0.02, abs=0.002 + late)
        assert after.turn == pytest.approx(after.truth.heading - before.truth.heading, abs=0.005)


def test_reversing_counts_as_negative_distance(corridor: World) -> None:
    with bench_in(corridor) as bench:
        drive(bench, Twist(0.3, 0.0), 2.0)
        drive(bench, Twist(), 1.0)
        bench.sense()
        drive(bench, Twist(-0.3, 0.0), 3.0)
        # All the time but what it takes to speed up, half of 0.3 / 0.5 s.
        assert bench.sense().distance == pytest.approx(-0.3 * 2.7, abs=0.1)


def test_sensing_twice_in_one_place_is_no_motion(corridor: World) -> None:
    with bench_in(corridor) as bench:
        bench.sense()
        drive(bench, Twist(0.3, 0.0), 1.5)
        one, two = bench.sense(), bench.sense()
    assert one.distance > 0.2
    assert (two.distance, two.turn) == (0.0, 0.0)
    assert two.truth == one.truth


def test_the_scan_shows_the_walls_where_they_are(corridor: World) -> None:
    with bench_in(corridor) as bench:
        scan = bench.sense().scan
    assert scan is not None
    model = LaserModel()
    error = model.bias_limit + 6 * model.sigma + 1 / model.mode.value
    assert scan.ranges[[0, -1]] == pytest.approx([1.2, 1.2], abs=error)
    assert scan.ranges[np.argmin(np.abs(scan.bearings - math.radians(30)))] == pytest.approx(2.4, abs=2 * error)


@pytest.mark.parametrize("black", ["albedo = 0.7, remission = 0.0", "albedo = 0.0", "albedo = 0.7, remission = 1e-9"])
def test_a_scan_does_not_show_walls_that_send_no_light_back(black: str) -> None:
    text = SMALL.format(top="", end="").replace("albedo = 0.7", black, 1)
    with bench_in(build_world(parse_plan(text), light_named("16:00"), pictured=False)) as bench:
        assert np.isinf(bench.scan().ranges).all()


def test_without_a_renderer_there_are_no_images(corridor: World) -> None:
    with bench_in(corridor) as bench:
        view = bench.sense()
    assert view.sensors == {"laser"}
    assert dict(view.images) == {}


def test_the_same_seed_gives_the_same_scans_bit_for_bit_and_another_does_not(corridor: World) -> None:
    scans = []
    for seed in (3, 3, 4):
        with bench_in(corridor, seed) as bench:
            drive(bench, Twist(0.3, 0.1), 1.0)
            view = bench.sense()
            assert view.scan is not None
            scans.append((view.scan.ranges.tobytes(), view.truth, bench.odometry))
    assert scans[0] == scans[1]
    assert scans[0][0] != scans[2][0]
    assert scans[0][1:] == scans[2][1:], "a seed is about the sensors' noise; the same commands lead the same way"


def test_a_unit_keeps_its_calibration_errors_over_drives_and_another_unit_has_others(corridor: World) -> None:
    poses = []
    for unit, seed in ((1, 1), (1, 2), (2, 1)):
        settings = BenchSettings(RendererKind.NONE, spread=RobotSpread(CalibrationErrors(size=0.05)), unit=unit)
        with bench_in(corridor, seed, settings) as bench:
            drive(bench, Twist(0.3, 0.0), 2.0)
            poses.append(bench.odometry)
    assert poses[0] == poses[1]
    assert abs(poses[0].x - poses[2].x) > 1e-3


@pytest.mark.parametrize("elapsed", [0.04, 0.2, 2.0])
def test_the_exposure_trails_a_change_of_light_by_the_cameras_lag(corridor: World, lamp: Lamp, elapsed: float) -> None:
    model, factor = CameraModel(), 3.0
    with bench_in(corridor, settings=BenchSettings()) as bench:
        target = model.exposure.target
        assert signal(bench.sense()) == pytest.approx(target, rel=0.03)
        lamp.luminance *= factor
        drive(bench, Twist(), elapsed)
        # The loop looks at the new light for as long as the time since the last view, ADAPTATION at most.
        left = math.exp(-min(elapsed, ADAPTATION) / model.exposure.lag)
        assert signal(bench.sense()) == pytest.approx(target * factor**left, rel=0.03)


def test_the_light_from_all_sides_is_that_of_the_place(lamp: Lamp) -> None:
    window = 'window = [{ name = "w", wall = "right", at = 6.5 }]'
    world = build_world(parse_plan(SMALL.format(top=window, end="")), light_named("16:00"), seed=0)
    with bench_in(world, settings=BenchSettings()) as bench:
        eyes = [bench.data.camera(f"robuter/{name}") for name in ("camera-1", "camera-2")]
        for x in (1.0, 5.5):
            bench.place(Pose(x, 0.0, 0.0))
            bench.sense()
            assert lamp.around[-2:] == [world.ambient.at(eye.xpos) for eye in eyes]
    assert 0.0 < lamp.around[0] < lamp.around[2]


def test_nothing_is_drawn_for_a_covered_camera(corridor: World, lamp: Lamp) -> None:
    small = square_camera(CameraModel(), 16)
    settings = BenchSettings(
        camera_models={"camera-1": replace(small, lens=replace(small.lens, k1=-0.2)), "camera-2": small}
    )
    with bench_in(corridor, settings=settings) as bench:
        bench.covered = frozenset({"camera-1"})
        images = bench.sense().images
    assert len(lamp.sizes) == len(lamp.around) == 1
    assert [images[name].shape for name in ("camera-1", "camera-2")] == [(16, 16)] * 2
    assert images["camera-1"].mean() < 5 < images["camera-2"].mean()


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
@pytest.mark.parametrize("kind", [RendererKind.BAKED, RendererKind.CLASSIC])
def test_light_that_a_renderer_does_not_read_is_not_worked_out(
    kind: RendererKind, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes up to 1.5 s of the processor."""

    def never(*_: object) -> None:
        raise AssertionError("somebody asked")

    monkeypatch.setattr(refseq_bench.worlds.build, "Meter", never)
    world = build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), seed=0)
    settings = BenchSettings(kind, cameras=("camera-1",), camera_models={"camera-1": square_camera(CameraModel(), 16)})
    with bench_in(world, settings=settings) as bench:
        assert bench.sense().images["camera-1"].shape == (16, 16)


def test_who_draws_by_another_renderer_gives_the_first_one_back(corridor: World, lamp: Lamp) -> None:
    with bench_in(corridor, settings=BenchSettings()) as bench:
        other = Lamp(50.0)
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(refseq_bench.sim.bench.bench, "open_renderer", lambda kind, model, bake: other)
            bench.draw_by(RendererKind.CLASSIC)
        assert (bench.renderer, lamp.closed, other.closed) == (other, True, False)
    assert other.closed


def test_a_robot_that_is_carried_stands_there_and_its_odometer_does_not_notice(corridor: World) -> None:
    with bench_in(corridor) as bench:
        drive(bench, Twist(0.4, 0.0), 2.0)
        bench.sense()
        before = bench.odometry
        bench.place(Pose(5.0, -0.4, 1.2))
        assert (bench.pose.x, bench.pose.y, bench.pose.heading) == pytest.approx((5.0, -0.4, 1.2), abs=1e-9)
        assert bench.odometry == before
        drive(bench, Twist(), 1.0)
        assert math.dist((bench.pose.x, bench.pose.y), (5.0, -0.4)) < 0.005
        assert abs(bench.sense().distance) < 0.01


def test_cameras_of_a_robot_that_is_carried_are_used_to_the_light_there(corridor: World, lamp: Lamp) -> None:
    with bench_in(corridor, settings=BenchSettings()) as bench:
        bench.sense()
        lamp.luminance *= 5.0
        bench.place(Pose(5.0, 0.0, 0.0))
        assert signal(bench.sense()) == pytest.approx(CameraModel().exposure.target, rel=0.03)


def test_every_camera_takes_a_picture_with_noise_of_its_own(corridor: World, lamp: Lamp) -> None:
    with bench_in(corridor, settings=BenchSettings()) as bench:
        images = bench.sense().images
    assert set(images) == {"camera-1", "camera-2"}
    assert all(image.shape == (480, 640) and image.dtype == np.uint8 for image in images.values())
    assert not np.array_equal(images["camera-1"], images["camera-2"])


PHONE = CameraModel(lens=Lens(focal=3e-3), sensor=Sensor(size=(320, 200)))
MIXED = BenchSettings(camera_models={"camera-1": load_camera("fire-i-wide"), "camera-2": PHONE})


def test_each_camera_has_the_lens_and_the_sensor_of_its_own_model(corridor: World, lamp: Lamp) -> None:
    with bench_in(corridor, settings=MIXED) as bench:
        images = bench.sense().images
        fields = {name: float(bench.model.camera(f"robuter/{name}").fovy[0]) for name in images}
        offscreen = bench.model.vis.global_
    assert {name: image.shape for name, image in images.items()} == {"camera-1": (480, 640), "camera-2": (200, 320)}
    assert fields["camera-2"] == pytest.approx(2 * math.degrees(math.atan(100 * 5.6e-6 / 3e-3)))
    wide = load_camera("fire-i-wide").optics().pinhole
    assert fields["camera-1"] == pytest.approx(wide.fovy)
    assert (offscreen.offwidth, offscreen.offheight) == (wide.width, wide.height)
    assert lamp.sizes == [(wide.width, wide.height), (320, 200)]


def test_the_model_of_one_camera_changes_nothing_about_the_other(corridor: World, lamp: Lamp) -> None:
    seen = []
    for models in ({}, {"camera-1": load_camera("fire-i-wide")}):
        with bench_in(corridor, settings=BenchSettings(camera_models=models)) as bench:
            seen.append(bench.sense().images)
    assert np.array_equal(seen[0]["camera-2"], seen[1]["camera-2"])
    assert not np.array_equal(seen[0]["camera-1"], seen[1]["camera-1"])


def test_only_the_cameras_that_were_asked_for_take_images_with_the_noise_that_they_always_have(
    corridor: World, lamp: Lamp
) -> None:
    with bench_in(corridor, settings=BenchSettings(cameras=("camera-2",))) as bench:
        alone = bench.sense().images
    with bench_in(corridor, settings=BenchSettings()) as bench:
        both = bench.sense().images
    assert set(alone) == {"camera-2"}
    assert np.array_equal(alone["camera-2"], both["camera-2"])


@pytest.mark.parametrize("key", ["cameras", "camera_models"])
def test_a_camera_that_the_robot_has_not_is_told_with_those_it_has(corridor: World, key: str) -> None:
    wrong = {"cameras": ("camera-3",), "camera_models": {"camera-3": CameraModel()}}[key]
    settings = BenchSettings(RendererKind.NONE, **{key: wrong})
    with pytest.raises(SimError, match=r"^unknown camera 'camera-3' of robot 'robuter': valid are camera-1, camera-2$"):
        bench_in(corridor, settings=settings)


def test_the_metadata_tell_every_cameras_model(corridor: World) -> None:
    settings = BenchSettings(RendererKind.NONE, camera_models={"camera-1": load_camera("fire-i-wide")})
    with bench_in(corridor, settings=settings) as bench:
        record = describe(bench, route="forward", seed=1, trigger=Trigger(), style=OperatorStyle())
    sensors = json.loads(record["config"])["sensors"]
    assert sensors["cameras"] == ["camera-1", "camera-2"]
    focal = {name: model["lens"]["focal"] for name, model in sensors["camera_models"].items()}
    assert focal == {"camera-1": 2.17e-3, "camera-2": 4.3e-3}
    assert sensors["camera_models"]["camera-1"]["exposure"]["shutter"] == [1e-4, 1 / 15]


def test_driving_along_a_wall_blurs_an_upright_edge_by_speed_shutter_and_focal_over_depth(
    corridor: World, lamp: Lamp
) -> None:
    """The picture is an edge, the depth and the speed are MuJoCo's."""
    quiet = CameraModel(
        gamma=1.0, lens=Lens(blur=0.0), sensor=Sensor(read_noise=0.0), exposure=ExposureControl(shutter=(0.05, 0.05))
    )
    lamp.luminance, lamp.edge = 8.0, True
    with bench_in(corridor, settings=BenchSettings(camera_models={"camera-2": quiet})) as bench:
        standing = width(bench.sense().images["camera-2"])
        drive(bench, Twist(0.4, 0.0), 3.0)
        moving = width(bench.sense().images["camera-2"])
        depth = 1.2 - bench.data.camera("robuter/camera-2").xpos[1]
        speed = float(np.hypot(*bench.data.qvel[:2]))
    assert speed == pytest.approx(0.4, rel=0.05)
    assert standing < 1.0
    assert moving == pytest.approx(speed * 0.05 * 4.3e-3 / 5.6e-6 / depth, rel=0.05)


def width(image: NDArray[np.uint8]) -> float:
    """Length of the ramp that an upright edge in the middle has become [pixels]."""
    profile = image.astype(float).mean(axis=0) / CameraModel().optics().shading.mean(axis=0)
    dark, bright = profile[100:280].mean(), profile[360:540].mean()
    rise = (profile[280:360] - dark) / (bright - dark)
    # A ramp of length L from -L/2 to L/2 overlaps its own mirror image by L / 6.
    return float(6.0 * np.sum(rise * (1.0 - rise)))


def test_a_robot_whose_physics_broke_down_drives_again_once_it_is_set_down(corridor: World) -> None:
    with bench_in(corridor) as bench:
        bench.data.qvel[0] = math.nan
        drive(bench, Twist(0.3, 0.0), 0.4)
        assert bench.fault is not None
        bench.place(Pose(2.0, 0.0, 0.0))
        assert bench.fault is None
        bench.control.release()
        drive(bench, Twist(0.3, 0.0), 3.0)
        assert bench.pose.x > 2.3


def test_leaving_the_block_gives_the_renderer_back(corridor: World, lamp: Lamp) -> None:
    with bench_in(corridor, settings=BenchSettings()):
        assert not lamp.closed
    assert lamp.closed


def test_people_walk_while_the_robot_drives() -> None:
    walker = 'person = [{ name = "p", at = [2, 0.8], walk = [[6, 0.8]], speed = 1.0 }]'
    world = build_world(parse_plan(SMALL.format(top=walker, end="")), light_named("16:00"), seed=0)
    with bench_in(world) as bench:
        for _ in range(3):
            start = float(bench.data.body("person:p").xpos[0])
            drive(bench, Twist(0.2, 0.0), 1.0)
            assert bench.data.body("person:p").xpos[0] - start == pytest.approx(1.0, abs=0.05)


def test_somebody_who_walks_is_blurred_by_their_speed(lamp: Lamp, monkeypatch: pytest.MonkeyPatch) -> None:
    walker = 'person = [{ name = "p", at = [3, 0.2], walk = [[3, -0.9]], speed = 1.0 }]'
    world = build_world(parse_plan(SMALL.format(top=walker, end="")), light_named("16:00"), seed=0)
    seen: list[NDArray[np.float32]] = []
    monkeypatch.setattr(refseq_bench.sim.bench.bench, "smeared", lambda picture, run: seen.append(run) or picture)
    with bench_in(world, settings=BenchSettings(cameras=("camera-1",))) as bench:
        for seconds in (0.0, 0.6):
            drive(bench, Twist(), seconds)
            bench.sense()
        shutter = bench._cameras["camera-1"].exposure.shutter
        away = bench.data.body("person:p").xpos[0] - bench.data.camera("robuter/camera-1").xpos[0]
    standing, walking = seen
    assert np.abs(standing).max() < 0.1
    # The person goes to the right. Arms and legs swing along the way, and the body is nearer than its middle.
    to_the_right = walking[..., 0][np.abs(walking[..., 0]) > 0.1]
    assert np.median(to_the_right) == pytest.approx(1.0 * shutter * 4.3e-3 / 5.6e-6 / away, rel=0.15)
