import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import robots
import sim.bench
from refseq.view import View
from robots import Twist
from sim.bench import ADAPTATION, CONTROL_PERIOD, Bench, BenchSettings
from sim.camera import CameraModel
from sim.errors import SimError
from sim.laser import LaserModel
from sim.odometry import CalibrationErrors
from sim.render import RendererKind
from tests.worlds.conftest import SMALL
from worlds.build import World, build
from worlds.light import light_named
from worlds.plan import parse_plan

BLIND = BenchSettings(renderer=RendererKind.NONE)


@pytest.fixture(scope="module")
def corridor() -> World:
    """8 m long, walls at y = ±1.2 m, its route along the x axis from 1 m on."""
    return build(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), seed=0)


def bench_in(world: World, seed: int = 0, settings: BenchSettings = BLIND) -> Bench:
    return Bench(world, robots.load("robuter"), seed=seed, settings=settings)


def drive(bench: Bench, twist: Twist, seconds: float) -> None:
    for _ in range(round(seconds / CONTROL_PERIOD)):
        bench.drive(twist)


def test_it_starts_at_the_routes_first_point_facing_the_second(corridor: World) -> None:
    with bench_in(corridor) as bench:
        assert bench.time == 0.0
        assert (bench.pose.x, bench.pose.y, bench.pose.heading) == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)


def test_an_unknown_route_is_told_with_the_valid_ones(corridor: World) -> None:
    with pytest.raises(SimError, match=r"^unknown route 'up' in world 'small': valid are forward$"):
        Bench(corridor, robots.load("robuter"), route="up", settings=BLIND)


def test_the_worlds_spec_stays_free_of_robots(corridor: World) -> None:
    before = len(corridor.spec.bodies)
    with bench_in(corridor) as one, bench_in(corridor) as other:
        assert len(corridor.spec.bodies) == before
        drive(one, Twist(0.3, 0.0), 1.0)
        assert other.pose.x == pytest.approx(1.0, abs=1e-9)
        assert one.model.ngeom == other.model.ngeom


def test_one_command_takes_one_control_period(corridor: World) -> None:
    with bench_in(corridor) as bench:
        drive(bench, Twist(), 1.0)
        assert bench.time == pytest.approx(1.0, abs=1e-9)


def test_truth_is_the_pose_of_the_base(corridor: World) -> None:
    with bench_in(corridor) as bench:
        drive(bench, Twist(0.3, 0.4), 2.0)
        truth = bench.sense().truth
        body = bench.data.body("robuter/base")
        w, _, _, z = body.xquat
        assert truth is not None
        assert (truth.x, truth.y) == (body.xpos[0], body.xpos[1])
        assert truth.heading == pytest.approx(2 * math.atan2(z, w), abs=1e-4)  # the base is level to 1e-2 rad
        assert 0.5 < truth.heading < 0.9


def test_the_motion_of_views_is_that_of_the_true_path_but_for_slip_and_calibration(corridor: World) -> None:
    with bench_in(corridor) as bench:
        first, views = bench.sense(), []
        for _ in range(5):
            drive(bench, Twist(0.3, 0.05), 1.0)
            views.append(bench.sense())
    assert first.distance == first.turn == 0.0
    for before, after in pairwise([first, *views]):
        assert before.truth is not None
        assert after.truth is not None
        true = math.dist((before.truth.x, before.truth.y), (after.truth.x, after.truth.y))
        assert after.distance == pytest.approx(true, rel=0.02, abs=0.002)
        assert after.turn == pytest.approx(after.truth.heading - before.truth.heading, abs=0.005)


def test_reversing_counts_as_negative_distance(corridor: World) -> None:
    with bench_in(corridor) as bench:
        drive(bench, Twist(0.3, 0.0), 2.0)
        bench.sense()
        drive(bench, Twist(-0.3, 0.0), 2.0)
        assert bench.sense().distance == pytest.approx(-0.6, abs=0.1)


def test_sensing_twice_in_one_place_is_no_motion(corridor: World) -> None:
    with bench_in(corridor) as bench:
        bench.sense()
        drive(bench, Twist(0.3, 0.0), 1.0)
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
        settings = BenchSettings(RendererKind.NONE, calibration=CalibrationErrors(size=0.05), unit=unit)
        with bench_in(corridor, seed, settings) as bench:
            drive(bench, Twist(0.3, 0.0), 2.0)
            poses.append(bench.odometry)
    assert poses[0] == poses[1]
    assert abs(poses[0].x - poses[2].x) > 1e-3


class Lamp:
    """A renderer of a wall that is evenly lit by ``luminance`` [cd/m²]."""

    kind = RendererKind.FILAMENT

    def __init__(self, luminance: float) -> None:
        self.luminance = luminance
        self.closed = False

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        return np.full((height, width), self.luminance, np.float32)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def lamp(monkeypatch: pytest.MonkeyPatch) -> Lamp:
    lamp = Lamp(100.0)
    monkeypatch.setattr(sim.bench, "open_renderer", lambda kind, model: lamp)
    return lamp


def signal(view: View) -> float:
    """Mean signal before gamma, as a share of full scale."""
    return float(np.mean((view.images["camera-1"] / 255.0) ** CameraModel().gamma))


@pytest.mark.parametrize("elapsed", [0.04, 0.2, 2.0])
def test_the_exposure_trails_a_change_of_light_by_the_cameras_lag(corridor: World, lamp: Lamp, elapsed: float) -> None:
    model, factor = CameraModel(), 3.0
    with bench_in(corridor, settings=BenchSettings()) as bench:
        assert signal(bench.sense()) == pytest.approx(model.target, rel=0.03)
        lamp.luminance *= factor
        drive(bench, Twist(), elapsed)
        # The loop looks at the new light for as long as the time since the last view, ADAPTATION at most.
        left = math.exp(-min(elapsed, ADAPTATION) / model.lag)
        assert signal(bench.sense()) == pytest.approx(model.target * factor**left, rel=0.03)


def test_every_camera_takes_a_picture_with_noise_of_its_own(corridor: World, lamp: Lamp) -> None:
    with bench_in(corridor, settings=BenchSettings()) as bench:
        images = bench.sense().images
    assert set(images) == {"camera-1", "camera-2"}
    assert all(image.shape == (480, 640) and image.dtype == np.uint8 for image in images.values())
    assert not np.array_equal(images["camera-1"], images["camera-2"])


def test_leaving_the_block_gives_the_renderer_back(corridor: World, lamp: Lamp) -> None:
    with bench_in(corridor, settings=BenchSettings()):
        assert not lamp.closed
    assert lamp.closed
