import math

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import robots
from refseq.view import Scan
from robots import Twist
from sim.errors import SimError
from sim.laser import Laser, LaserModel
from tests.robots.driving import PREFIX, Driven, add_wall, flat_world

ROOM = (8.0, 5.0)
SITE, BASE = PREFIX + "laser", PREFIX + "base"


def room() -> Driven:
    """The robot between four walls, whose inner faces are ``ROOM`` apart."""
    world = flat_world()
    x, y = ROOM[0] / 2, ROOM[1] / 2
    for side in (-1, 1):
        add_wall(world, (side * (x + 0.1), 0.0), (0.1, y + 0.2))
        add_wall(world, (0.0, side * (y + 0.1)), (x + 0.2, 0.1))
    return Driven(world)


def before_a_wall(x: float, **how: float) -> Driven:
    """The robot in the open, with the face of a broad wall at ``x``."""
    world = flat_world()
    add_wall(world, (x + 0.1, 0.0), (0.1, 500.0), **how)
    return Driven(world)


def scan(driven: Driven, laser: Laser) -> Scan:
    return laser.scan(driven.model, driven.data, SITE, BASE)


def exact(**changes: float) -> Laser:
    """A scanner that only measures."""
    figures = {"sigma": 0.0, "bias_limit": 0.0, "resolution": 0.0} | changes
    return Laser(LaserModel(**figures), np.random.default_rng(0))


def room_distances(x: float, y: float, heading: float) -> NDArray[np.float64]:
    """Distances to the walls from a point in the room, by hand."""
    bearings = heading - np.pi / 2 + np.radians(0.5) * np.arange(361)
    with np.errstate(divide="ignore"):
        across = (np.copysign(ROOM[0] / 2, np.cos(bearings)) - x) / np.cos(bearings)
        along = (np.copysign(ROOM[1] / 2, np.sin(bearings)) - y) / np.sin(bearings)
    return np.minimum(across, along)


def random_place(driven: Driven, rng: np.random.Generator) -> tuple[float, float, float]:
    """Put the robot somewhere; the place of its scanner."""
    driven.place(rng.uniform(-2, 2), rng.uniform(-1, 1), rng.uniform(-np.pi, np.pi))
    x, y, _ = driven.data.site(SITE).xpos
    return float(x), float(y), driven.pose.heading


@pytest.mark.parametrize("seed", range(8))
def test_true_distances_in_a_room(seed: int) -> None:
    driven = room()
    place = random_place(driven, np.random.default_rng(seed))
    np.testing.assert_allclose(scan(driven, exact()).ranges, room_distances(*place), rtol=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_ranges_in_a_room_within_the_noise(seed: int) -> None:
    driven, rng = room(), np.random.default_rng(seed)
    place = random_place(driven, rng)
    laser = Laser(LaserModel(), rng)
    error = scan(driven, laser).ranges - room_distances(*place) - laser.bias
    assert np.abs(error).max() < 5 * 0.005 + 0.005
    assert abs(error.mean()) < 5 * 0.0058 / math.sqrt(361)


def test_noise_is_that_of_the_device_and_of_its_steps() -> None:
    driven, laser = room(), Laser(LaserModel(), np.random.default_rng(3))
    errors = np.array([scan(driven, laser).ranges for _ in range(300)]) - room_distances(0.25, 0.0, 0.0)
    sigma = math.hypot(0.005, 0.01 / math.sqrt(12))
    assert np.sqrt(np.mean((errors - laser.bias) ** 2)) == pytest.approx(sigma, rel=0.02)


def test_the_bias_is_the_device_s_own_and_bounded() -> None:
    biases = np.array([Laser(LaserModel(), np.random.default_rng(seed)).bias for seed in range(500)])
    assert np.abs(biases).max() <= 0.015
    assert biases.std() == pytest.approx(0.015 / math.sqrt(3), rel=0.1)


def test_ranges_are_whole_centimetres() -> None:
    ranges = scan(room(), Laser(LaserModel(), np.random.default_rng(1))).ranges
    assert ranges.dtype == np.float32
    np.testing.assert_array_equal(ranges, (np.round(ranges.astype(float) * 100) * 0.01).astype(np.float32))


def test_the_scan_says_how_it_was_made() -> None:
    made = scan(room(), exact())
    assert (len(made.ranges), made.start, made.step, made.max_range) == (361, -np.pi / 2, np.pi / 360, 80.0)


def test_beams_go_counter_clockwise() -> None:
    world = flat_world()
    add_wall(world, (0.25, 2.0), (0.5, 0.1))
    ranges = scan(Driven(world), exact()).ranges
    assert ranges[360] == pytest.approx(1.9, abs=1e-6)
    assert np.isinf(ranges[:300]).all()


def test_beyond_its_reach_nothing_comes_back() -> None:
    assert scan(before_a_wall(79.9), exact()).ranges[180] == pytest.approx(79.65, abs=1e-4)
    ranges = scan(before_a_wall(80.35), exact()).ranges
    assert np.isinf(ranges).all()


def test_in_the_open_it_sees_neither_the_floor_nor_its_own_robot() -> None:
    driven = Driven()
    driven.drive(2.0, lambda _: Twist(0.2, 0.3))
    assert np.isinf(scan(driven, exact()).ranges).all()


def test_even_with_all_bodies_nothing_of_the_robot_is_in_the_scan_plane_but_the_scanner() -> None:
    driven = Driven()
    assert np.isfinite(exact().distances(driven.model, driven.data, SITE, "world")).all()
    inside = exact().distances(driven.model, driven.data, SITE, "world")
    assert inside.max() < 0.12


def test_it_sees_another_robot() -> None:
    world, other = flat_world(), robots.load("robuter")
    world.attach(other.spec, frame=world.worldbody.add_frame(pos=(3, 0, 0)), prefix="other/")
    ranges = scan(Driven(world), exact()).ranges
    assert 1.5 < ranges[180] < 2.5


def test_too_near_is_reported_at_the_nearest_range() -> None:
    assert scan(before_a_wall(0.35), exact()).ranges[180] == np.float32(0.14)


def test_what_is_only_seen_stops_no_beam() -> None:
    driven = before_a_wall(3.0, group=2, contype=0, conaffinity=0)
    assert np.isinf(scan(driven, exact()).ranges).all()


def test_the_same_seed_gives_the_same_scans_whatever_is_there() -> None:
    def scans(driven: Driven, seed: int) -> NDArray[np.float32]:
        laser = Laser(LaserModel(), np.random.default_rng(seed))
        return np.array([scan(driven, laser).ranges for _ in range(3)])

    np.testing.assert_array_equal(scans(room(), 5), scans(room(), 5))
    assert (scans(room(), 5) != scans(room(), 6)).any()
    open_first = Laser(LaserModel(), np.random.default_rng(5))
    scan(Driven(), open_first)
    np.testing.assert_array_equal(scan(room(), open_first).ranges, scans(room(), 5)[1])


def test_scans_do_not_share_memory() -> None:
    driven, laser = room(), exact()
    first = scan(driven, laser)
    kept = first.ranges.copy()
    driven.place(1.0, 0.5, 1.0)
    scan(driven, laser)
    np.testing.assert_array_equal(first.ranges, kept)


def test_a_tilted_robot_tilts_its_beams() -> None:
    driven = before_a_wall(4.0)
    pitch = math.radians(-2)
    driven.data.joint(BASE).qpos = (0, 0, 0.1, math.cos(pitch / 2), 0, math.sin(pitch / 2), 0)
    mujoco.mj_forward(driven.model, driven.data)
    x = driven.data.site(SITE).xpos[0]
    assert scan(driven, exact()).ranges[180] == pytest.approx((4.0 - x) / math.cos(pitch), rel=1e-6)


@pytest.mark.parametrize(
    ("figures", "message"),
    [
        ({"beams": 0}, "laser: beams = 0: at least 1 is needed"),
        ({"min_range": 90.0}, "laser: min_range = 90.0 m must be in [0, max_range = 80.0 m)"),
        ({"sigma": -1.0}, "laser: sigma = -1.0 m must not be negative"),
    ],
)
def test_impossible_figures_are_refused(figures: dict[str, float], message: str) -> None:
    with pytest.raises(SimError) as error:
        LaserModel(**figures)
    assert str(error.value) == message
