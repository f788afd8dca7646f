import math
from dataclasses import replace

import numpy as np
import pytest

from refseq.fault import CLOCK, ODOMETRY, FaultKind
from refseq.health.likelihood_field import REACH, Walls, hits
from refseq.health.monitor import HealthMonitor
from refseq.planar import Pose
from refseq.view import LASER, Scan, View
from tests.refseq.health.drives import STEP, WALLS, drive, from_view, picture, with_image
from tests.refseq.rooms import Wall, cast, rectangle

VIEWS = drive()
START = 12


def upside_down(scan: Scan) -> Scan:
    return replace(scan, ranges=scan.ranges[::-1].copy())


def blinded(scan: Scan, degrees: float) -> Scan:
    return replace(scan, ranges=np.where(np.abs(np.degrees(scan.bearings)) < degrees / 2, np.inf, scan.ranges))


FAULTS = {
    "black camera": (
        "camera-1",
        FaultKind.BLANK,
        lambda view, _: with_image(view, {"camera-1": np.zeros_like(view.images["camera-1"])}),
    ),
    "frozen camera": (
        "camera-2",
        FaultKind.FROZEN,
        lambda view, last: with_image(view, {"camera-2": last.images["camera-2"].copy()}),
    ),
    "laser dazzled": (LASER, FaultKind.BLIND, lambda view, _: replace(view, scan=blinded(view.scan, 90))),
    "laser stuck": (LASER, FaultKind.FROZEN, lambda view, last: replace(view, scan=replace(last.scan))),
    "laser upside down": (LASER, FaultKind.MIRRORED, lambda view, _: replace(view, scan=upside_down(view.scan))),
    "odometry lost": (
        ODOMETRY,
        FaultKind.LOST,
        lambda view, _: replace(view, distance=0.0, turn=0.0, has_odometry=False),
    ),
    "odometry no numbers": (ODOMETRY, FaultKind.LOST, lambda view, _: replace(view, distance=np.nan)),
    "odometry doubled": (
        ODOMETRY,
        FaultKind.DOUBLED,
        lambda view, _: replace(view, distance=2 * view.distance, turn=2 * view.turn),
    ),
    "odometry frozen": (ODOMETRY, FaultKind.FROZEN, lambda view, _: replace(view, distance=0.0, turn=0.0)),
    "odometry negated": (
        ODOMETRY,
        FaultKind.REVERSED,
        lambda view, _: replace(view, distance=-view.distance, turn=-view.turn),
    ),
    "stamps back": (CLOCK, FaultKind.JUMPING, lambda view, _: replace(view, time=view.time - 5)),
    "stamps a day ahead": (CLOCK, FaultKind.JUMPING, lambda view, _: replace(view, time=view.time + 86_400)),
}


def declared(views):
    monitor = HealthMonitor()
    return [monitor.update(view).faults for view in views]


@pytest.mark.quick_cases("0")
@pytest.mark.parametrize("seed", range(4))
def test_a_healthy_robot_has_no_fault(seed):
    monitor = HealthMonitor()
    for view in drive(seed=seed):
        health = monitor.update(view)
        assert health.faults == ()
        assert health.usable is view


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_declared_within_two_metres_and_nothing_else(name):
    sensor, kind, fault = FAULTS[name]
    found = declared(from_view(VIEWS, START, fault))
    assert all(not faults for faults in found[:START])
    first = next(k for k, faults in enumerate(found) if faults)
    assert (first - START) * STEP <= 2.0
    assert {(one.sensor, one.kind) for faults in found for one in faults} == {(sensor, kind)}
    assert abs(found[first][0].since - START) <= 1
    assert found[first][0].time == pytest.approx(1.8 * found[first][0].since, abs=90_000)


@pytest.mark.parametrize("name", [one for one in FAULTS if "stamps" not in one])
def test_what_is_ill_is_left_out_and_comes_back_when_it_is_well(name):
    sensor, _, fault = FAULTS[name]
    ill = from_view(VIEWS, START, fault)[: START + 6] + VIEWS[START + 6 :]
    monitor = HealthMonitor()
    usable = [monitor.update(view).usable for view in ill]
    used = [view.has_odometry if sensor == ODOMETRY else sensor in view.sensors for view in usable]
    assert not any(used[START + 3 : START + 6])
    assert all(used[START + 10 :])
    others = {LASER, "camera-1", "camera-2"} - {sensor}
    assert all(others <= view.sensors for view in usable)


def test_stamps_that_jump_cost_nothing():
    monitor = HealthMonitor()
    for view in from_view(VIEWS, START, lambda view, _: replace(view, time=0.0)):
        health = monitor.update(view)
        assert health.usable == view
    assert [fault.sensor for fault in health.faults] == [CLOCK]


def test_a_pause_is_no_jump_of_the_stamps():
    found = declared(from_view(VIEWS, START, lambda view, _: replace(view, time=view.time + 600)))
    assert not any(found)


def test_a_robot_that_stands_has_no_frozen_sensor():
    # Nobody moves and the camera has no noise at all; the laser repeats itself too.
    still = replace(VIEWS[START], distance=0.0, turn=0.0)
    found = declared([*VIEWS[:START], *(replace(still, time=still.time + k) for k in range(1, 40))])
    assert not any(found)


def test_somebody_who_walks_past_a_standing_robot_is_no_motion():
    rng = np.random.default_rng(3)
    views = list(VIEWS[:START])
    pose = VIEWS[START - 1].truth
    for k in range(20):
        image = picture(pose.x, 1, rng)
        image[:, 4 * k : 4 * k + 50] = 20
        scan = cast(WALLS, pose, rng=rng)
        ranges = scan.ranges.copy()
        ranges[100 + 5 * k : 130 + 5 * k] = 0.8
        views.append(View(100.0 + k, {"camera-1": image}, replace(scan, ranges=ranges)))
    assert not any(declared(views))


def test_a_lamp_that_is_switched_on_is_no_motion_of_a_standing_robot():
    rng = np.random.default_rng(3)
    views = list(VIEWS[:START])
    for k in range(10):
        gain = 0.4 if k < 5 else 1.0
        image = np.clip(picture(10.0, 1, rng) * gain, 0, 255).astype(np.uint8)
        views.append(View(100.0 + k, {"camera-1": image}))
    assert not any(declared(views))


def test_wheels_that_spin_are_told_from_a_robot_that_moves():
    rng, pose = np.random.default_rng(4), VIEWS[START - 1].truth
    spins = [
        replace(
            VIEWS[START],
            time=100.0 + k,
            scan=cast(WALLS, pose, rng=rng),
            images={"camera-1": picture(pose.x, 1, rng)},
            distance=0.5,
            turn=0.0,
        )
        for k in range(6)
    ]
    found = declared([*VIEWS[:START], *spins])
    assert {(one.sensor, one.kind) for one in found[-1]} == {(ODOMETRY, FaultKind.SLIPPING)}


def test_an_upside_down_laser_is_found_by_turns_alone():
    # From the first view on: nothing has changed, only that it turns to the other side than the wheels.
    found = declared([replace(view, scan=upside_down(view.scan)) for view in VIEWS])
    assert {(one.sensor, one.kind) for one in found[-1]} == {(LASER, FaultKind.MIRRORED)}


def test_a_corridor_that_looks_alike_everywhere_says_nothing_of_the_way():
    bare = [(-50.0, -1.2, 90.0, -1.2), (-50.0, 1.2, 90.0, 1.2)]
    rng = np.random.default_rng(5)
    views = [
        View(1.8 * k, scan=cast(bare, Pose(0.85 * k, 0.0, 0.0), rng=rng), distance=1.7 if k else 0.0) for k in range(20)
    ]
    assert not any(declared(views))


def alcoves(seed: int) -> list[Wall]:
    """A corridor of 50 m whose walls step back by half a metre or one here and there, and are bare between."""
    rng, walls = np.random.default_rng(seed), [*rectangle(-3.0, -2.3, 45.0, 2.3)]
    for side in (1.2, -1.2):
        at, behind = -3.0, 0.0
        while at < 45.0:
            end, deep = at + rng.uniform(1.5, 5.0), float(rng.choice([0.0, 0.0, 0.5, 1.0]))
            walls += [
                (at, math.copysign(1.2 + behind, side), at, math.copysign(1.2 + deep, side)),
                (at, math.copysign(1.2 + deep, side), end, math.copysign(1.2 + deep, side)),
            ]
            at, behind = end, deep
    return walls


@pytest.mark.quick_cases("0.5-0.7")
@pytest.mark.parametrize(
    ("step", "failed"), [(0.25, 0.0), (0.5, 0.0), (1.0, 0.0), (0.25, 0.5), (0.5, 0.3), (0.5, 0.5), (0.5, 0.7)]
)
def test_a_laser_of_any_step_is_no_odometer_in_reverse(step: float, failed: float) -> None:
    """Beams a degree apart meet a corridor's walls in single spots from 7 m on, which fit any motion; and so do those
    that are left where others do not come back.
    """
    for seed in range(12):
        rng, walls = np.random.default_rng(seed), alcoves(seed)
        monitor, faults = HealthMonitor(), []
        for k in range(32):
            pose = Pose(0.9 * k, 0.1 * math.sin(k / 3), 0.05 * math.sin(k / 2 + seed))
            scan = cast(walls, pose, beams=round(180 / step) + 1, rng=rng)
            left = rng.random(len(scan.ranges)) >= failed
            scan = replace(scan, ranges=np.where(left, scan.ranges, np.nan))
            turn = 0.05 * (math.sin(k / 2 + seed) - math.sin((k - 1) / 2 + seed)) if k else 0.0
            faults += monitor.update(View(1.8 * k, {}, scan, 0.9 if k else 0.0, turn)).faults
        assert faults == [], seed


@pytest.mark.quick_cases("3")
@pytest.mark.parametrize("every", [2, 3])
def test_a_laser_that_is_slower_than_the_views_is_no_fault(every: int) -> None:
    """The way between two scans is that of all views since: a part of it would fit other motions better."""
    for seed in range(4):
        views = [replace(view, scan=None) if k % every else view for k, view in enumerate(drive(seed=seed))]
        assert not any(declared(views)), seed


def test_views_that_come_more_rarely_from_now_on_are_no_clock_that_jumps() -> None:
    times = np.cumsum([*[1.0] * 10, *[15.0] * 20])
    faults = [health.faults for health in map(HealthMonitor().update, [View(float(t), {}, None, 0.85) for t in times])]
    assert faults[-1] == ()


def test_the_same_views_after_a_reset_give_the_same_faults():
    views = from_view(VIEWS, START, FAULTS["odometry doubled"][2])
    monitor = HealthMonitor()
    first = [monitor.update(view).faults for view in views]
    monitor.reset()
    assert [monitor.update(view).faults for view in views] == first


@pytest.mark.parametrize("change", [{"has_odometry": False}, {"distance": np.nan}])
def test_an_odometer_that_was_never_there_is_told_at_the_second_view(change):
    found = declared([replace(view, **change) for view in VIEWS])
    assert found[0] == ()
    assert all([(one.sensor, one.kind) for one in at] == [(ODOMETRY, FaultKind.LOST)] for at in found[1:])
    assert len({one for at in found for one in at}) == 1


def test_a_first_view_from_before_the_odometer_s_first_pose_is_no_fault():
    assert not any(declared([replace(VIEWS[0], has_odometry=False), *VIEWS[1:]]))


def test_a_view_without_a_sensor_says_nothing_of_it():
    bare = [replace(view, images={}, scan=None) if k % 3 == 1 else view for k, view in enumerate(VIEWS)]
    assert not any(declared(bare))


@pytest.mark.parametrize("failed", [False, True])
def test_an_opening_that_beams_look_through_is_no_wall_and_beams_that_fail_are_none(failed: bool) -> None:
    """A wall 3 m ahead with an opening of 2 m, seen through to 21 m, or made of glass that sends nothing back."""
    bearings = np.linspace(-np.pi / 2, np.pi / 2, 361)
    with np.errstate(divide="ignore"):
        wall = np.where(np.cos(bearings) > 0.1, 3.0 / np.cos(bearings), np.inf)
    opening = np.abs(3.0 * np.tan(bearings)) < 1.0
    ranges = np.where(opening, np.inf if failed else 21.0, wall).astype(np.float32)
    scan = Scan(ranges)
    walls = Walls(scan, hits(scan, REACH))
    inside = np.stack([np.full(40, 3.0), np.linspace(-0.3, 0.3, 40)], axis=1)
    assert (walls.unexplained(inside, [(0.0, 0.0)]).item() > 0.2) is not failed
