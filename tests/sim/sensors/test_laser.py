import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.sensors.laser import Laser, Telegram
from refseq_bench.sim.sensors.laser_echoes import THRESHOLD, LaserEchoes
from refseq_bench.sim.sensors.laser_model import ABOVE_MAX, LOW_SNR, LaserModel, RangeMode
from tests.robots.driving import PREFIX, Driven, add_wall, flat_world
from tests.sim.carried import BEARINGS, BODY, ROOM, SITE, Carried, room, room_distances, wall_at

ROBOT_SITE, ROBOT_BASE = PREFIX + "laser", PREFIX + "base"
IN_ROOM = Carried(room())
METRES_8 = LaserModel(mode=RangeMode.METRES_8)


def device(seed: int = 0, **figures: float) -> Laser:
    return Laser(LaserModel(**figures), np.random.default_rng(seed))


def exact(**figures: float) -> Laser:
    """A device without errors but its steps."""
    return device(**{"sigma": 0.0, "weak_sigma": 0.0, "bias_limit": 0.0} | figures)


def scan(carried: Carried, laser: Laser) -> Scan:
    return laser.scan(carried.model, carried.data, SITE, BODY)


def words(carried: Carried, laser: Laser) -> NDArray[np.uint16]:
    return laser.raw(carried.model, carried.data, SITE, BODY).words


def robot_in_room() -> Driven:
    world = flat_world()
    x, y = ROOM[0] / 2, ROOM[1] / 2
    for side in (-1, 1):
        add_wall(world, (side * (x + 0.1), 0.0), (0.1, y + 0.2))
        add_wall(world, (0.0, side * (y + 0.1)), (x + 0.2, 0.1))
    return Driven(world)


def on_robot(driven: Driven, laser: Laser) -> Scan:
    return laser.scan(driven.model, driven.data, ROBOT_SITE, ROBOT_BASE)


# --- ranges ---


@settings(max_examples=20, deadline=None)
@given(st.floats(-3, 3), st.floats(-2, 2), st.floats(-np.pi, np.pi), st.integers(0, 1000))
def test_ranges_in_a_room_within_the_noise(x: float, y: float, heading: float, seed: int) -> None:
    IN_ROOM.place(x, y, heading)
    laser = device(seed)
    exact_ranges = room_distances(x, y, heading + BEARINGS)
    error = scan(IN_ROOM, laser).ranges - exact_ranges - laser.bias
    spot = np.abs(IN_ROOM.echoes().distance - exact_ranges)
    assert (np.abs(error) < 5.5 * 0.0051 + 0.005 + spot).all()
    assert abs(error.mean()) < 5 * 0.0058 / math.sqrt(361) + spot.mean()


def test_noise_is_that_of_the_device_and_of_its_steps() -> None:
    IN_ROOM.place(0.25, 0.0, 0.0)
    laser = device(3, weak_sigma=0.0)
    errors = np.array([scan(IN_ROOM, laser).ranges for _ in range(200)]) - IN_ROOM.echoes().distance
    sigma = math.hypot(0.005, 0.01 / math.sqrt(12))
    assert np.sqrt(np.mean((errors - laser.bias) ** 2)) == pytest.approx(sigma, rel=0.02)


@pytest.mark.parametrize("strength", [1.0, 2.0, 10.0])
def test_noise_grows_as_echoes_weaken(strength: float) -> None:
    laser = Laser(replace(METRES_8, bias_limit=0.0), np.random.default_rng(0))
    echoes = LaserEchoes(np.full(361, 5.0), np.full(361, strength * THRESHOLD))
    errors = np.array([laser.reading(echoes).ranges for _ in range(100)]) - 5.0
    assert errors.std() == pytest.approx(math.hypot(0.005, 0.01 / strength), rel=0.02)


def test_the_bias_is_the_device_s_own_and_bounded() -> None:
    biases = np.array([device(seed).bias for seed in range(500)])
    assert np.abs(biases).max() <= 0.015
    assert biases.std() == pytest.approx(0.015 / math.sqrt(3), rel=0.1)


def test_beams_go_counter_clockwise() -> None:
    world = flat_world()
    add_wall(world, (0.25, 2.0), (0.5, 0.1))
    ranges = on_robot(Driven(world), exact()).ranges
    assert ranges[360] == np.float32(1.9)
    assert np.isinf(ranges[:300]).all()


def test_too_near_is_reported_at_the_nearest_range() -> None:
    assert scan(Carried(wall_at(0.1)), exact()).ranges[180] == np.float32(0.14)


def test_what_is_only_seen_stops_no_beam() -> None:
    assert np.isinf(scan(Carried(wall_at(3.0, group=2)), exact()).ranges).all()


# --- words, modes and codes ---


@pytest.mark.parametrize(("mode", "step"), [(RangeMode.METRES_80, 0.01), (RangeMode.METRES_8, 0.001)])
def test_a_mode_s_ranges_are_whole_steps(mode: RangeMode, step: float) -> None:
    IN_ROOM.place()
    laser = Laser(LaserModel(mode=mode), np.random.default_rng(1))
    made = scan(IN_ROOM, laser)
    assert made.ranges.dtype == np.float32
    counts = made.ranges.astype(float) / step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-3)
    assert made.max_range == pytest.approx(8182 * step)
    assert np.abs(made.ranges - IN_ROOM.echoes().distance - laser.bias).max() < 6 * 0.005 + step / 2


@given(st.lists(st.integers(0, 8191), min_size=361, max_size=361), st.sampled_from(RangeMode))
@settings(max_examples=20)
def test_words_and_ranges_say_the_same(sent: list[int], mode: RangeMode) -> None:
    telegram = Telegram(np.array(sent, np.uint16), mode)
    ranges = telegram.ranges
    readable = telegram.words < 8183
    assert (np.isinf(ranges) == ~readable).all()
    assert (np.round(ranges[readable] * mode.value) == telegram.words[readable]).all()
    assert ranges[readable].max(initial=0.0) <= np.float32(mode.max_range)


@pytest.mark.parametrize(("mode", "last"), [(RangeMode.METRES_80, 81.82), (RangeMode.METRES_8, 8.182)])
def test_the_last_range_and_the_first_code(mode: RangeMode, last: float) -> None:
    laser = exact(mode=mode)
    near, far = (words(Carried(wall_at(x, userdata=[1.5])), laser)[180] for x in (last, last + 1.1 / mode.value))
    assert (near, far) == (8182, ABOVE_MAX)


def test_codes_tell_too_far_from_too_weak() -> None:
    beyond = Carried(wall_at(85.0, userdata=[1.5]))
    assert (words(beyond, exact()) == ABOVE_MAX).all()
    black = Carried(wall_at(31.0, userdata=[0.1]))
    assert words(black, exact())[180] == LOW_SNR
    assert words(black, exact())[0] == ABOVE_MAX, "parallel to the wall there is nothing"
    assert set(words(black, exact())) == {ABOVE_MAX, LOW_SNR}
    assert np.isinf(scan(black, exact()).ranges).all()


def test_a_scan_is_what_the_words_say() -> None:
    IN_ROOM.place()
    sent = device(4).raw(IN_ROOM.model, IN_ROOM.data, SITE, BODY)
    made = scan(IN_ROOM, device(4))
    np.testing.assert_array_equal(made.ranges, sent.ranges)
    assert sent.words.dtype == np.uint16
    assert not sent.words.flags.writeable
    assert (len(made.ranges), made.start, made.step, made.max_range) == (361, -np.pi / 2, np.pi / 360, 81.82)


# --- repeatability ---


def test_the_same_seed_gives_the_same_scans_whatever_is_there() -> None:
    def scans(seed: int) -> NDArray[np.float32]:
        laser = device(seed)
        return np.array([scan(IN_ROOM, laser).ranges for _ in range(3)])

    IN_ROOM.place(1.0, 0.5, 1.0, speed=(0.3, 0.1), turn=0.4)
    np.testing.assert_array_equal(scans(5), scans(5))
    assert (scans(5) != scans(6)).any()
    elsewhere_first = device(5)
    scan(Carried(mujoco.MjSpec()), elsewhere_first)
    np.testing.assert_array_equal(scan(IN_ROOM, elsewhere_first).ranges, scans(5)[1])


def test_scans_do_not_share_memory() -> None:
    laser = exact()
    IN_ROOM.place()
    first = scan(IN_ROOM, laser)
    kept = first.ranges.copy()
    IN_ROOM.place(1.0, 0.5, 1.0)
    scan(IN_ROOM, laser)
    np.testing.assert_array_equal(first.ranges, kept)


# --- on a robot ---


def test_a_robot_that_stands_measures_as_a_bare_scanner_does() -> None:
    driven = robot_in_room()
    driven.place(-1.0, 0.5, 0.4)
    x, y, _ = driven.data.site(ROBOT_SITE).xpos
    IN_ROOM.place(float(x), float(y), driven.pose.heading)
    np.testing.assert_allclose(on_robot(driven, exact()).ranges, scan(IN_ROOM, exact()).ranges, atol=0.0101)


def test_a_robot_that_turns_shows_the_interlacing() -> None:
    """Between a scan in motion and one on the spot lies what each beam's age makes of the turn."""
    driven = robot_in_room()
    driven.drive(2.0, lambda _: Twist(0.0, 0.5))
    moving = exact().echoes(driven.model, driven.data, ROBOT_SITE, ROBOT_BASE).distance
    driven.data.qvel[:] = 0.0
    mujoco.mj_fwdVelocity(driven.model, driven.data)
    still = exact().echoes(driven.model, driven.data, ROBOT_SITE, ROBOT_BASE).distance
    jagged = np.abs(np.diff(moving - still, 2))
    assert np.median(jagged) > 2e-3
    assert np.median(np.abs(np.diff(still, 2))) < 0.5e-3


def test_in_the_open_it_sees_neither_the_floor_nor_its_own_robot() -> None:
    driven = Driven()
    driven.drive(2.0, lambda _: Twist(0.2, 0.3))
    assert np.isinf(on_robot(driven, exact()).ranges).all()


def test_even_with_all_bodies_nothing_of_the_robot_is_in_the_scan_plane_but_the_scanner() -> None:
    driven = Driven()
    inside = exact().echoes(driven.model, driven.data, ROBOT_SITE, "world").distance
    assert inside.max() < 0.12


def test_it_sees_another_robot() -> None:
    world, other = flat_world(), robots.load("robuter")
    world.attach(other.spec, frame=world.worldbody.add_frame(pos=(3, 0, 0)), prefix="other/")
    assert 1.5 < on_robot(Driven(world), exact()).ranges[180] < 2.5


def test_a_tilted_robot_tilts_its_beams() -> None:
    world = flat_world()
    add_wall(world, (4.1, 0.0), (0.1, 50.0))
    driven = Driven(world)
    pitch = math.radians(-2)
    driven.data.joint(ROBOT_BASE).qpos = (0, 0, 0.1, math.cos(pitch / 2), 0, math.sin(pitch / 2), 0)
    mujoco.mj_forward(driven.model, driven.data)
    x = driven.data.site(ROBOT_SITE).xpos[0]
    measured = exact().echoes(driven.model, driven.data, ROBOT_SITE, ROBOT_BASE).distance[180]
    assert measured == pytest.approx((4.0 - x) / math.cos(pitch), rel=1e-4)


@pytest.mark.parametrize(
    ("figures", "message"),
    [
        ({"min_range": 90.0}, "laser: min_range = 90.0 m must be in [0, 81.82 m)"),
        ({"min_range": 9.0, "mode": RangeMode.METRES_8}, "laser: min_range = 9.0 m must be in [0, 8.182 m)"),
        ({"sigma": -1.0}, "laser: sigma = -1.0 m must be 0 or more, and finite"),
        ({"sigma": math.inf}, "laser: sigma = inf m must be 0 or more, and finite"),
        ({"weak_sigma": math.nan}, "laser: weak_sigma = nan m must be 0 or more, and finite"),
        ({"bias_limit": -0.1}, "laser: bias_limit = -0.1 m must be 0 or more, and finite"),
    ],
)
def test_impossible_figures_are_refused(figures: dict[str, float], message: str) -> None:
    with pytest.raises(SimError) as error:
        LaserModel(**figures)
    assert str(error.value) == message
